"""
Arms whose joint positions have a closed form: candidates for a target, and how far off they are.

Errors are followed from joint to joint: `turn` is that of directions (rad), `way` that of points.
"""

import math

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Numbers, Vector
from . import roots, three_joints


def _back(screws: Numbers, values: Numbers, count: int, v: Vector) -> Vector:
    # A direction as it was before the first `count` joints turned it.
    for k in range(count):
        if not vectors.slides(screws, k):
            v = vectors.turned(vectors.axis_of(screws, k), -values[k], v)
    return v


def _circle_roots_or(
    A: float, B: float, C: float, error: float, free: float, found: Numbers
) -> int:
    # If every angle is a root, the free angle of the joint.
    count = roots.circle_roots(A, B, C, error, found)
    if count >= 0:
        return count
    found[0] = free
    return 1


def _turns_to(
    axis: Vector,
    v: Vector,
    sign: float,
    w: Vector,
    height: float,
    error: float,
    free: float,
    found: Numbers,
) -> int:
    # The angles by which v, turned about an axis, or backwards, is at a height along w.
    still = vectors.dot(w, axis) * vectors.dot(axis, v)
    A, B = vectors.dot(w, v) - still, sign * vectors.dot(w, vectors.cross(axis, v))
    return _circle_roots_or(A, B, height - still, error, free, found)


def _wrist(
    screws: Numbers, T: Numbers, arm: Numbers, turn: float, free: Numbers, found: Numbers
) -> int:
    # The last three joints make the rest of the rotation after the first three (positions `arm`);
    # behind two of their positions stands the error of both.
    a, b = vectors.axis_of(screws, 3), vectors.axis_of(screws, 4)
    c = vectors.axis_of(screws, 5)
    goal = _back(screws, arm, 3, vectors.times_vector(T, c))
    fifths = [0.0] * 3
    count = _turns_to(b, c, 1.0, a, vectors.dot(a, goal), 4.0 * turn, free[4], fifths)
    side = vectors.across(c)
    goal_side = _back(screws, arm, 3, vectors.times_vector(T, side))
    found[6] = fifths[2]
    for i in range(count):
        fourth = vectors.angle(a, vectors.turned(b, fifths[i], c), goal, free[3])
        rest = vectors.turned(b, -fifths[i], vectors.turned(a, -fourth, goal_side))
        found[3 * i] = fourth
        found[3 * i + 1] = fifths[i]
        found[3 * i + 2] = vectors.angle(c, side, rest, free[5])
        found[6] = max(found[6], roots.turn_error(a, goal, 2.0 * turn + fifths[2]))
    return count


def _times(rows: int, columns: int, A: Flat, x: Flat, y: Numbers) -> None:
    # y = A x.
    for i in range(rows):
        y[i] = arrays.dot(arrays.after(A, i * columns), x, columns)


class ClosedForm:
    """
    A geometry that has a closed form, as screws psi = coupling q.

    Parameters
    ----------
    way
        POSITION_3, SPHERICAL_WRIST or PARALLEL_AXES.
    screws : shape (k, 7)
        Each joint at rest: its axis, a point on it, 1 if it slides.
    point : shape (3,), m
        The point whose position is solved first, at rest.
    home_inverse : shape (4, 4)
        Inverse of the tool's pose at rest.
    backwards
        Whether the screws are ordered from tool to base.
    to_joints, to_screws : shape (n, k), (k, n)
        Joint positions from those of the screws, and back.
    error
        How far the arm's own axes are from those of the screws: rad, and as a share of its size.
        It includes round-off.
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
        self.n, self.k = arrays.extent(to_joints, 0), arrays.extent(to_joints, 1)
        if self.k != (3 if self.way == places.POSITION_3 else 6):
            raise TypeError('a closed form has three screws for a position, six for a pose')
        self.screws, self.point = arrays.numbers(screws, 7 * self.k), arrays.numbers(point, 3)
        self.home_inverse = arrays.numbers(home_inverse, 16)
        self.to_joints = arrays.numbers(to_joints, self.n * self.k)
        self.to_screws = arrays.numbers(to_screws, self.n * self.k)
        for k in range(self.k):
            at = vectors.point_of(self.screws, k)
            self.size = max(self.size, math.sqrt(vectors.dot(at, at)))
        for at in (vectors.three(self.point, 0), vectors.apart(self.home_inverse, 3, 4)):
            self.size = max(self.size, math.sqrt(vectors.dot(at, at)))

    def write_screws(self, q: Flat, psi: Numbers) -> None:
        """Write the screws' positions for positions of the joints."""
        _times(self.k, self.n, self.to_screws, q, psi)

    def write_joints(self, psi: Flat, q: Flat) -> None:
        """Write the joints' positions for positions of the screws."""
        _times(self.n, self.k, self.to_joints, psi, q)

    def write_motion(self, pose: Flat, T: Numbers) -> None:
        """Write the motion (4, 4) from rest to a pose that the screws have to make."""
        M = [0.0] * 12
        for i in range(3):
            for j in range(4):
                if self.way == places.POSITION_3:
                    M[4 * i + j] = 1.0 if i == j else 0.0
                    continue
                for k in range(4):
                    M[4 * i + j] += pose[4 * i + k] * self.home_inverse[4 * k + j]
            if self.way == places.POSITION_3:
                M[4 * i + 3] = pose[4 * i + 3] - self.point[i]
        for i in range(3):
            T[4 * i + 3] = 0.0 if self.backwards else M[4 * i + 3]
            for j in range(3):
                T[4 * i + j] = M[4 * j + i] if self.backwards else M[4 * i + j]
                if self.backwards:
                    T[4 * i + 3] -= M[4 * j + i] * M[4 * j + 3]

    def candidates(self, T: Numbers, off: float, free: Numbers, found: Flat, said: Numbers) -> int:
        """Do what `inverse_candidates` does, for a motion whose rotation is off by so much."""
        start, to = vectors.three(self.point, 0), vectors.apart(T, 3, 4)
        turn = self.error + off
        way = turn * (self.size + math.sqrt(vectors.dot(to, to)))
        if self.way == places.POSITION_3:
            arm = [0.0] * 25
            goal = vectors.times_point(T, start)
            count = three_joints.first_three(self.screws, start, goal, turn, way, free, arm)
            arrays.copy(found, 3 * count, arm)
            said[0] = arm[24]
            return count
        if self.way == places.SPHERICAL_WRIST:
            return self._with_wrist(T, turn, way, free, found, said)
        return self._with_parallel_axes(T, turn, way, free, found, said)

    def _with_wrist(
        self, T: Numbers, turn: float, way: float, free: Numbers, found: Numbers, said: Numbers
    ) -> int:
        # Axes 4 to 6 meet in the point, so joints 1 to 3 alone bring it to its place.
        arms, wrists, arm = [0.0] * 25, [0.0] * 7, [0.0] * 3
        count, point = 0, vectors.three(self.point, 0)
        goal = vectors.times_point(T, point)
        known = three_joints.first_three(self.screws, point, goal, turn, way, free, arms)
        said[0] = arms[24]
        for i in range(known):
            for k in range(3):
                arm[k] = arms[3 * i + k]
            doubled = _wrist(self.screws, T, arm, turn + 3.0 * arms[24], free, wrists)
            said[0] = max(said[0], wrists[6])
            for j in range(doubled):
                for k in range(3):
                    found[6 * count + k] = arm[k]
                    found[6 * count + 3 + k] = wrists[3 * j + k]
                count += 1
        return count

    def _with_parallel_axes(
        self, T: Numbers, turn: float, way: float, free: Numbers, found: Flat, said: Numbers
    ) -> int:
        # Axes 2, 3, 4 are parallel, 5 and 6 meet in the point.
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
        # The height of the point along axis 2, which joints 2 to 4 do not change, gives joint 1:
        # that of the goal taken back by joint 1 is the height at rest.
        height = vectors.dot(z, vectors.plus(point, -1.0, o1))
        known = _turns_to(z1, to_goal, -1.0, z, height, 4.0 * way, free[0], firsts)
        said[0] = firsts[2]
        for i in range(known):
            # R^T (z as joint 1 turns it), axis 2 as the tool sees it, which joints 6 and 5 must
            # turn into z.
            z_now = vectors.turned(z1, firsts[i], z)
            seen = (
                T[0] * z_now[0] + T[4] * z_now[1] + T[8] * z_now[2],
                T[1] * z_now[0] + T[5] * z_now[1] + T[9] * z_now[2],
                T[2] * z_now[0] + T[6] * z_now[1] + T[10] * z_now[2],
            )
            off, height = 4.0 * (turn + firsts[2]), vectors.dot(z6, seen)
            doubled = _turns_to(z5, z, -1.0, z6, height, off, free[4], fifths)
            said[0] = max(said[0], fifths[2])
            for j in range(doubled):
                sixth = vectors.angle(z6, seen, vectors.turned(z5, -fifths[j], z), free[5])
                off = roots.turn_error(z6, seen, 2.0 * turn + firsts[2] + fifths[2])
                said[0] = max(said[0], off)
                off = way + lever * (firsts[2] + fifths[2] + off)
                to = arrays.after(found, 6 * count)
                count += self._plane_arm(T, firsts[i], fifths[j], sixth, off, free, to, said)
        return count

    def _plane_arm(
        self,
        T: Numbers,
        first: float,
        fifth: float,
        sixth: float,
        way: float,
        free: Numbers,
        found: Numbers,
        said: Numbers,
    ) -> int:
        # G = E1^-1 T E6^-1 E5^-1 moves within the plane across z: its turn, and where it brings
        # the point of axis 4. Joints 2, 3 and 4 are an arm in that plane.
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
            4.0 * size * way,
            free[2],
            thirds,
        )
        said[0] = max(said[0], thirds[2])
        if count > 0:
            said[0] = max(said[0], roots.turn_error(z, to_goal, 2.0 * way + size * thirds[2]))
        for k in range(count):
            bent = vectors.plus(upper, 1.0, vectors.turned(z, thirds[k], lower))
            second = vectors.angle(z, bent, to_goal, free[1])
            found[6 * k] = first
            found[6 * k + 1] = second
            found[6 * k + 2] = thirds[k]
            found[6 * k + 3] = total - second - thirds[k]
            found[6 * k + 4] = fifth
            found[6 * k + 5] = sixth
        return count


def inverse_candidates(
    form: ClosedForm, T: Floats, free: Floats, found: Floats, said: Floats
) -> int:
    """
    Fill `found` with positions of screws that may bring about a motion; return their number.

    These are candidates, not solutions: `refine` improves them and returns the error of each.

    Parameters
    ----------
    form
        Of the arm.
    T : shape (4, 4)
        The motion from rest to the target.
    free : shape (k,), rad or m
        Positions of screws that are free.
    found : shape (MOST_CANDIDATES, k), rad or m
        The candidates.
    said : shape (1,)
        How far they are from solutions, rad; infinite where one may be missing.
    """
    return form.candidates(
        arrays.numbers(T, 16),
        0.0,
        arrays.numbers(free, form.k),
        arrays.results(found, places.MOST_CANDIDATES * form.k),
        arrays.results(said, 1),
    )
