# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Solve the inverse kinematics of three joints, or of six joints with a spherical wrist or three
parallel axes, in closed form.

- Three joints for a position: three_joints.py (Pieper 1968).
- Axes 4, 5 and 6 meet in a point: joints 1 to 3 move this point to its position at the target, and
  joints 4 to 6 give the rotation (Pieper 1968).
- Axes 2, 3 and 4 are parallel: the height of the wrist point, measured in the direction of these
  axes, gives joint 1. The direction of axis 2 in the tool frame gives joints 5 and 6. Joints 2 to
  4 are a planar arm.

Each step of a closed form solves one of two subproblems. Subproblem 1 finds the angle that rotates
one vector onto another (Paden and Kahan; Murray, Li and Sastry, A Mathematical Introduction to
Robotic Manipulation, section 3.2). Subproblem 4 finds the angles that rotate a vector v so that
its scalar product with a constant vector w has a wanted value, the height of v along w (Elias and
Wen, IK-Geo, arXiv:2211.05737).

The functions propagate errors from joint to joint. The argument `turn` is the error of directions,
rad. The argument `shift` is the error of points, m.
"""

import math

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Numbers, Vector
from ..six_joints import six_screws
from . import roots, three_joints


def _back(screws: Numbers, values: Numbers, begin: int, v: Vector) -> Vector:
    # Applies the inverse rotation of joints 1 to 3 to the direction v, and returns the result. The
    # positions of joints 1 to 3 are values[begin] to values[begin + 2].
    for k in range(3):
        if not vectors.slides(screws, k):
            v = vectors.turned(vectors.axis_of(screws, k), -values[begin + k], v)
    return v


def _circle_roots_or(
    A: float, B: float, C: float, error: float, free: float, angles: Numbers
) -> int:
    # Writes to `angles` the roots x of A cos x + B sin x = C. If all angles are roots, writes the
    # angle `free`. Returns the number of written angles.
    count = roots.circle_roots(A, B, C, error, angles)
    if count >= 0:
        return count
    angles[0] = free
    return 1


def _angles_to_height(
    axis: Vector,
    v: Vector,
    sign: float,
    w: Vector,
    height: float,
    error: float,
    free: float,
    angles: Numbers,
) -> int:
    # Solves subproblem 4: writes to `angles` the angles by which v must rotate about `axis`, so
    # that w . v becomes `height`. If `sign` is -1, writes the negative angles. Returns the number
    # of angles.
    constant = vectors.dot(w, axis) * vectors.dot(axis, v)
    A, B = vectors.dot(w, v) - constant, sign * vectors.dot(w, vectors.cross(axis, v))
    return _circle_roots_or(A, B, height - constant, error, free, angles)


def _wrist(
    screws: Numbers, T: Numbers, arms: Numbers, i: int, turn: float, free: Numbers, angles: Numbers
) -> int:
    # Solves joints 4 to 6. T is the motion of the tool from its rest pose (all joint positions 0)
    # to the target. All six joints together must give the rotation of T. Row i of `arms` has the
    # positions of joints 1 to 3. Writes to `angles` up to two solutions, with three angles each.
    # Writes the error of the angles, rad, to angles[6]. Returns the number of solutions.
    a, b = vectors.axis_of(screws, 3), vectors.axis_of(screws, 4)
    c = vectors.axis_of(screws, 5)
    goal = _back(screws, arms, 3 * i, vectors.times_vector(T, c))
    fifths = [0.0] * 3
    count = _angles_to_height(b, c, 1.0, a, vectors.dot(a, goal), 4.0 * turn, free[4], fifths)
    side = vectors.across(c)
    goal_side = _back(screws, arms, 3 * i, vectors.times_vector(T, side))
    angles[6] = fifths[2]
    for k in range(count):
        fourth = vectors.angle(a, vectors.turned(b, fifths[k], c), goal, free[3])
        turned_side = vectors.turned(b, -fifths[k], vectors.turned(a, -fourth, goal_side))
        angles[3 * k] = fourth
        angles[3 * k + 1] = fifths[k]
        angles[3 * k + 2] = vectors.angle(c, side, turned_side, free[5])
        angles[6] = max(angles[6], roots.turn_error(a, goal, 2.0 * turn + fifths[2]))
    return count


class ClosedForm:
    """
    The screws of an arm whose inverse kinematics has a closed form.

    Screw k is the rotation about axis k by the angle psi[k], rad, or the translation along axis k
    by psi[k], m. The arm is at rest if all joint positions q are 0; then all psi are 0.

    Parameters
    ----------
    way
        Kind of closed form: POSITION_3, SPHERICAL_WRIST or PARALLEL_AXES.
    screws : shape (n, 7)
        For each screw: the direction of its axis at rest, a point on this axis, and 1 for a
        translation or 0 for a rotation.
    point : shape (3,), m
        A point at rest: the tool (POSITION_3), the center of the wrist (SPHERICAL_WRIST), or the
        intersection of axes 5 and 6 (PARALLEL_AXES).
    home_inverse : shape (4, 4)
        Inverse of the tool's pose at rest.
    backwards
        Whether the screws are ordered from tool to base.
    to_joints, to_screws : shape (n, n)
        q = to_joints psi, and psi = to_screws q.
    error
        The closed form needs axes that meet or are parallel exactly. The axes in `screws` do so;
        the axes of the arm do so only approximately. `error` is a bound of the difference between
        an axis in `screws` and the same axis of the arm, including round-off. It bounds two
        quantities: the angle between the two axes, rad, and the displacement of the axis divided
        by the size of the arm.
    """

    def __init__(
        self,
        way: int,
        screws: Floats,
        point: Floats,
        home_inverse: Floats,
        backwards: bool,
        to_joints: Floats,
        to_screws: Floats,
        error: float,
    ) -> None:
        self.way, self.backwards, self.error, self.size = way, backwards, error, 0.0
        self.n = arrays.extent(to_joints, 0)
        if self.n != (3 if self.way == places.POSITION_3 else 6):
            raise TypeError('a closed form has three screws for a position, six for a pose')
        self.screws, self.point = arrays.numbers(screws, 7 * self.n), arrays.numbers(point, 3)
        self.home_inverse = arrays.numbers(home_inverse, 16)
        self.to_joints = arrays.numbers(to_joints, self.n * self.n)
        self.to_screws = arrays.numbers(to_screws, self.n * self.n)
        for k in range(self.n):
            at = vectors.point_of(self.screws, k)
            self.size = max(self.size, math.sqrt(vectors.dot(at, at)))
        for at in (vectors.three(self.point, 0), vectors.apart(self.home_inverse, 3, 4)):
            self.size = max(self.size, math.sqrt(vectors.dot(at, at)))

    def write_screws(self, q: Flat, psi: Numbers) -> None:
        """
        Write the angles (rad) or translations (m) psi (n,) of the screws at joint positions q
        (n,).
        """
        for i in range(self.n):
            psi[i] = arrays.dot(arrays.after(self.to_screws, i * self.n), q, self.n)

    def turn_into_joints(self, row: Flat) -> None:
        """
        Convert `row` (n,) in place from the angles or translations psi of the screws to joint
        positions q.
        """
        psi = [0.0] * 6
        arrays.copy(psi, self.n, row)
        for i in range(self.n):
            row[i] = arrays.dot(arrays.after(self.to_joints, i * self.n), psi, self.n)

    def write_motion(self, pose: Flat, T: Numbers) -> None:
        """
        Write to T (3, 4) the motion of the tool from its rest pose to `pose`. If the screws are
        ordered from tool to base, write the inverse of this motion.
        """
        M = [0.0] * 12
        if self.way == places.POSITION_3:
            for i in range(3):
                for j in range(3):
                    T[4 * i + j] = 1.0 if i == j else 0.0
                T[4 * i + 3] = pose[4 * i + 3] - self.point[i]
            return
        six_screws.write_motion(pose, self.home_inverse, M)
        if self.backwards:
            six_screws.write_inverse(M, T)
        else:
            arrays.copy(T, 12, M)

    def candidates(
        self, T: Numbers, rotation_error: float, free: Numbers, psi: Flat, accuracy: Numbers
    ) -> int:
        """
        Write candidates for the motion T to the rows of `psi`. Return the number of candidates.

        A candidate has the angles or translations of the n screws that may produce the motion T.
        If the angle or translation of screw k is arbitrary, it is free[k] in all candidates.
        `rotation_error` is the error of the rotation of T, rad. `accuracy` (1,) receives a bound
        of the distance from a candidate to the solution that it approximates, rad.
        """
        start, to = vectors.three(self.point, 0), vectors.apart(T, 3, 4)
        turn = self.error + rotation_error
        shift = turn * (self.size + math.sqrt(vectors.dot(to, to)))
        if self.way == places.POSITION_3:
            arm = [0.0] * 25
            goal = vectors.times_point(T, start)
            count = three_joints.first_three(self.screws, start, goal, turn, shift, free, arm)
            arrays.copy(psi, 3 * count, arm)
            accuracy[0] = arm[24]
            return count
        if self.way == places.SPHERICAL_WRIST:
            return self._with_wrist(T, turn, shift, free, psi, accuracy)
        return self._with_parallel_axes(T, turn, shift, free, psi, accuracy)

    def _with_wrist(
        self, T: Numbers, turn: float, shift: float, free: Numbers, psi: Numbers, accuracy: Numbers
    ) -> int:
        # Solves an arm whose axes 4 to 6 meet in `point`. Joints 4 to 6 do not move this point, so
        # joints 1 to 3 alone must move it to `goal`, its position at the target.
        arms, wrists = [0.0] * 25, [0.0] * 7
        count, point = 0, vectors.three(self.point, 0)
        goal = vectors.times_point(T, point)
        arm_count = three_joints.first_three(self.screws, point, goal, turn, shift, free, arms)
        accuracy[0] = arms[24]
        for i in range(arm_count):
            wrist_count = _wrist(self.screws, T, arms, i, turn + 3.0 * arms[24], free, wrists)
            accuracy[0] = max(accuracy[0], wrists[6])
            for j in range(wrist_count):
                for k in range(3):
                    psi[6 * count + k] = arms[3 * i + k]
                    psi[6 * count + 3 + k] = wrists[3 * j + k]
                count += 1
        return count

    def _with_parallel_axes(
        self, T: Numbers, turn: float, shift: float, free: Numbers, psi: Flat, accuracy: Numbers
    ) -> int:
        # Solves an arm whose axes 2, 3 and 4 are parallel and whose axes 5 and 6 meet in `point`.
        screws, point = self.screws, vectors.three(self.point, 0)
        o1, z1 = vectors.point_of(screws, 0), vectors.axis_of(screws, 0)
        z = vectors.axis_of(screws, 1)
        z5, z6 = vectors.axis_of(screws, 4), vectors.axis_of(screws, 5)
        firsts, fifths = [0.0] * 3, [0.0] * 3
        count = 0
        to_goal = vectors.plus(vectors.times_point(T, point), -1.0, o1)
        to_wrist = vectors.plus(vectors.point_of(screws, 3), -1.0, point)
        lever = math.sqrt(vectors.dot(to_goal, to_goal))
        lever += math.sqrt(vectors.dot(to_wrist, to_wrist))
        # Solve joint 1. The height of a point is its coordinate along axis 2. At the target,
        # `point` is at the position P = T(point). Joints 2 to 6 do not change the height of
        # `point`, so only joint 1 has changed it. Therefore the inverse motion of joint 1 must
        # move P to the height that `point` has at rest (all joint positions 0).
        height = vectors.dot(z, vectors.plus(point, -1.0, o1))
        first_count = _angles_to_height(z1, to_goal, -1.0, z, height, 4.0 * shift, free[0], firsts)
        accuracy[0] = firsts[2]
        for i in range(first_count):
            # Solve joints 6 and 5. Let R be the rotation of T, and z the direction of axis 2 at
            # rest. Joint 1 rotates z to z_turned, so R^T z_turned is the direction of axis 2 in
            # the tool frame. Joints 6 and 5 must rotate this direction onto z.
            z_turned = vectors.turned(z1, firsts[i], z)
            z_in_tool = (
                T[0] * z_turned[0] + T[4] * z_turned[1] + T[8] * z_turned[2],
                T[1] * z_turned[0] + T[5] * z_turned[1] + T[9] * z_turned[2],
                T[2] * z_turned[0] + T[6] * z_turned[1] + T[10] * z_turned[2],
            )
            error, height = 4.0 * (turn + firsts[2]), vectors.dot(z6, z_in_tool)
            fifth_count = _angles_to_height(z5, z, -1.0, z6, height, error, free[4], fifths)
            accuracy[0] = max(accuracy[0], fifths[2])
            for j in range(fifth_count):
                sixth = vectors.angle(z6, z_in_tool, vectors.turned(z5, -fifths[j], z), free[5])
                error = roots.turn_error(z6, z_in_tool, 2.0 * turn + firsts[2] + fifths[2])
                accuracy[0] = max(accuracy[0], error)
                error = shift + lever * (firsts[2] + fifths[2] + error)
                to = arrays.after(psi, 6 * count)
                count += self._plane_arm(T, firsts[i], fifths[j], sixth, error, free, to, accuracy)
        return count

    def _plane_arm(
        self,
        T: Numbers,
        first: float,
        fifth: float,
        sixth: float,
        shift: float,
        free: Numbers,
        psi: Numbers,
        accuracy: Numbers,
    ) -> int:
        # Solves joints 2 to 4 of an arm with parallel axes 2 to 4. Let Ek be the motion of joint k
        # from rest to the solution. E2 E3 E4 = E1^-1 T E6^-1 E5^-1 is a motion in the plane
        # perpendicular to z, the direction of axis 2. It rotates by the angle `total`, and moves
        # o4, the point that `screws` has for axis 4, to `goal`.
        screws = self.screws
        z1, z = vectors.axis_of(screws, 0), vectors.axis_of(screws, 1)
        z5, z6 = vectors.axis_of(screws, 4), vectors.axis_of(screws, 5)
        o2, o3 = vectors.point_of(screws, 1), vectors.point_of(screws, 2)
        o4 = vectors.point_of(screws, 3)
        thirds = [0.0] * 3
        start = vectors.moved(screws, 5, -sixth, vectors.moved(screws, 4, -fifth, o4))
        goal = vectors.moved(screws, 0, -first, vectors.times_point(T, start))
        side = vectors.across(z)
        side_now = vectors.turned(z6, -sixth, vectors.turned(z5, -fifth, side))
        side_now = vectors.turned(z1, -first, vectors.times_vector(T, side_now))
        total = vectors.angle(z, side, side_now, 0.0)
        to_goal = vectors.plus(goal, -1.0, o2)
        upper, lower = vectors.plus(o3, -1.0, o2), vectors.plus(o4, -1.0, o3)
        upper = vectors.plus(upper, -vectors.dot(upper, z), z)
        lower = vectors.plus(lower, -vectors.dot(lower, z), z)
        height = vectors.dot(to_goal, z)
        reach = vectors.dot(to_goal, to_goal) - height * height
        size = math.sqrt(vectors.dot(upper, upper)) + math.sqrt(vectors.dot(lower, lower))
        size += math.sqrt(max(reach, 0.0))
        count = _circle_roots_or(
            2.0 * vectors.dot(upper, lower),
            2.0 * vectors.dot(upper, vectors.cross(z, lower)),
            reach - vectors.dot(upper, upper) - vectors.dot(lower, lower),
            4.0 * size * shift,
            free[2],
            thirds,
        )
        accuracy[0] = max(accuracy[0], thirds[2])
        if count > 0:
            error = roots.turn_error(z, to_goal, 2.0 * shift + size * thirds[2])
            accuracy[0] = max(accuracy[0], error)
        for k in range(count):
            bent = vectors.plus(upper, 1.0, vectors.turned(z, thirds[k], lower))
            second = vectors.angle(z, bent, to_goal, free[1])
            psi[6 * k] = first
            psi[6 * k + 1] = second
            psi[6 * k + 2] = thirds[k]
            psi[6 * k + 3] = total - second - thirds[k]
            psi[6 * k + 4] = fifth
            psi[6 * k + 5] = sixth
        return count


def inverse_candidates(
    form: ClosedForm, T: Floats, free: Floats, psi: Floats, accuracy: Floats
) -> int:
    """
    Fill the rows of `psi` with candidates, and return the number of candidates.

    A candidate has the angles or translations of the screws at which the tool may reach the
    target. Candidates are approximate. `refine` moves each candidate to a solution and returns the
    remaining error.

    Parameters
    ----------
    form
        The closed form of the arm.
    T : shape (4, 4)
        The motion of the tool from rest (all joint positions 0) to the target.
    free : shape (n,), rad or m
        If the angle or translation of screw k is arbitrary, it is free[k] in all candidates.
    psi : shape (MAX_CANDIDATES, n), rad or m
        Array for the candidates, one row for each.
    accuracy : shape (1,)
        Bound of the distance from a candidate to the solution that it approximates, rad. The bound
        is infinite if a solution may be missing.
    """
    return form.candidates(
        arrays.numbers(T, 16),
        0.0,
        arrays.numbers(free, form.n),
        arrays.results(psi, places.MAX_CANDIDATES * form.n),
        arrays.results(accuracy, 1),
    )
