"""Arms whose joint positions have a closed form: candidates for a target."""

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Floats, Numbers, Vector
from . import roots, three_joints


def _back(screws: Numbers, values: Numbers, count: int, v: Vector) -> Vector:
    # A direction as it was before the first `count` joints turned it.
    for k in range(count):
        if not vectors.slides(screws, k):
            v = vectors.turned(vectors.axis_of(screws, k), -values[k], v)
    return v


def _circle_roots_or(A: float, B: float, C: float, free: float, found: Numbers) -> int:
    # If every angle is a root, the free angle of the joint.
    count = roots.circle_roots(A, B, C, found)
    if count >= 0:
        return count
    found[0] = free
    return 1


def _wrist(screws: Numbers, T: Numbers, arm: Numbers, free: Numbers, found: Numbers) -> int:
    # The last three joints make the rest of the rotation after the first three (positions `arm`).
    a, b = vectors.axis_of(screws, 3), vectors.axis_of(screws, 4)
    c = vectors.axis_of(screws, 5)
    goal = _back(screws, arm, 3, vectors.times_vector(T, c))
    ab, bc = vectors.dot(a, b), vectors.dot(b, c)
    fifths = [0.0] * 2
    count = _circle_roots_or(
        vectors.dot(a, c) - ab * bc,
        vectors.dot(a, vectors.cross(b, c)),
        vectors.dot(a, goal) - ab * bc,
        free[4],
        fifths,
    )
    side = vectors.across(c)
    goal_side = _back(screws, arm, 3, vectors.times_vector(T, side))
    for i in range(count):
        fourth = vectors.angle(a, vectors.turned(b, fifths[i], c), goal, free[3])
        rest = vectors.turned(b, -fifths[i], vectors.turned(a, -fourth, goal_side))
        found[3 * i] = fourth
        found[3 * i + 1] = fifths[i]
        found[3 * i + 2] = vectors.angle(c, side, rest, free[5])
    return count


def _with_wrist(screws: Numbers, T: Numbers, point: Vector, free: Numbers, found: Numbers) -> int:
    # Axes 4 to 6 meet in `point`, so joints 1 to 3 alone bring it to its place.
    arms, wrists, arm = [0.0] * 24, [0.0] * 6, [0.0] * 3
    count = 0
    goal = vectors.times_point(T, point)
    for i in range(three_joints.first_three(screws, point, goal, free, arms)):
        for k in range(3):
            arm[k] = arms[3 * i + k]
        for j in range(_wrist(screws, T, arm, free, wrists)):
            for k in range(3):
                found[6 * count + k] = arm[k]
                found[6 * count + 3 + k] = wrists[3 * j + k]
            count += 1
    return count


def _first_joint(screws: Numbers, T: Numbers, point: Vector, free: float, found: Numbers) -> int:
    # The height of `point` along axis 2, which joints 2 to 4 do not change, gives joint 1:
    # z . (turned(z1, x, ...)) of the goal taken back by joint 1 is the height at rest.
    z1, z = vectors.axis_of(screws, 0), vectors.axis_of(screws, 1)
    o1 = vectors.point_of(screws, 0)
    goal = vectors.plus(vectors.times_point(T, point), -1.0, o1)
    still = vectors.dot(z, z1) * vectors.dot(z1, goal)
    return _circle_roots_or(
        vectors.dot(z, goal) - still,
        -vectors.dot(z, vectors.cross(z1, goal)),
        vectors.dot(z, vectors.plus(point, -1.0, o1)) - still,
        free,
        found,
    )


def _fifth_joint(screws: Numbers, seen: Vector, free: float, found: Numbers) -> int:
    # The direction of axis 2 as the tool sees it gives joints 5 and 6, which turn it into z.
    z, z5, z6 = vectors.axis_of(screws, 1), vectors.axis_of(screws, 4), vectors.axis_of(screws, 5)
    still = vectors.dot(z6, z5) * vectors.dot(z5, z)
    return _circle_roots_or(
        vectors.dot(z6, z) - still,
        -vectors.dot(z6, vectors.cross(z5, z)),
        vectors.dot(z6, seen) - still,
        free,
        found,
    )


def _plane_arm(
    screws: Numbers,
    T: Numbers,
    first: float,
    fifth: float,
    sixth: float,
    free: Numbers,
    found: Numbers,
) -> int:
    # G = E1^-1 T E6^-1 E5^-1 moves within the plane across z: its turn, and where it brings the
    # point of axis 4. Joints 2, 3 and 4 are an arm in that plane.
    z1, z = vectors.axis_of(screws, 0), vectors.axis_of(screws, 1)
    z5, z6 = vectors.axis_of(screws, 4), vectors.axis_of(screws, 5)
    o2, o3, o4 = (
        vectors.point_of(screws, 1),
        vectors.point_of(screws, 2),
        vectors.point_of(screws, 3),
    )
    thirds = [0.0] * 2
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
    count = _circle_roots_or(
        2.0 * vectors.dot(upper, lower),
        2.0 * vectors.dot(upper, vectors.cross(z, lower)),
        reach - vectors.dot(upper, upper) - vectors.dot(lower, lower),
        free[2],
        thirds,
    )
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


def _with_parallel_axes(
    screws: Numbers, T: Numbers, point: Vector, free: Numbers, found: Floats
) -> int:
    # Axes 2, 3, 4 are parallel, 5 and 6 meet in `point`.
    z1, z = vectors.axis_of(screws, 0), vectors.axis_of(screws, 1)
    z5, z6 = vectors.axis_of(screws, 4), vectors.axis_of(screws, 5)
    firsts, fifths = [0.0] * 2, [0.0] * 2
    count = 0
    for i in range(_first_joint(screws, T, point, free[0], firsts)):
        # R^T (z as joint 1 turns it), which joints 6 and 5 must turn into z.
        z_now = vectors.turned(z1, firsts[i], z)
        seen = (
            T[0] * z_now[0] + T[4] * z_now[1] + T[8] * z_now[2],
            T[1] * z_now[0] + T[5] * z_now[1] + T[9] * z_now[2],
            T[2] * z_now[0] + T[6] * z_now[1] + T[10] * z_now[2],
        )
        for j in range(_fifth_joint(screws, seen, free[4], fifths)):
            sixth = vectors.angle(z6, seen, vectors.turned(z5, -fifths[j], z), free[5])
            count += _plane_arm(
                screws, T, firsts[i], fifths[j], sixth, free, arrays.after(found, 6 * count)
            )
    return count


def _times(rows: int, columns: int, A: Floats, x: Floats, y: Numbers) -> None:
    # y = A x.
    for i in range(rows):
        y[i] = 0.0
        for j in range(columns):
            y[i] += A[i * columns + j] * x[j]


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
    ) -> None:
        self.way = way
        self.backwards = backwards
        self.n, self.k = arrays.extent(to_joints, 0), arrays.extent(to_joints, 1)
        if self.k != (3 if self.way == places.POSITION_3 else 6):
            raise TypeError('a closed form has three screws for a position, six for a pose')
        self.screws = arrays.numbers(screws, 7 * self.k)
        self.point = arrays.numbers(point, 3)
        self.home_inverse = arrays.numbers(home_inverse, 16)
        self.to_joints = arrays.numbers(to_joints, self.n * self.k)
        self.to_screws = arrays.numbers(to_screws, self.n * self.k)
        self._arrays = screws, point, home_inverse, to_joints, to_screws

    def write_screws(self, q: Floats, psi: Numbers) -> None:
        """Write the screws' positions for positions of the joints."""
        _times(self.k, self.n, self.to_screws, q, psi)

    def write_joints(self, psi: Floats, q: Floats) -> None:
        """Write the joints' positions for positions of the screws."""
        _times(self.n, self.k, self.to_joints, psi, q)

    def write_motion(self, pose: Floats, T: Numbers) -> None:
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

    def candidates(self, T: Numbers, free: Numbers, found: Floats) -> int:
        """Do what `inverse_candidates` does."""
        start = vectors.three(self.point, 0)
        if self.way == places.POSITION_3:
            goal = vectors.times_point(T, start)
            return three_joints.first_three(self.screws, start, goal, free, found)
        if self.way == places.SPHERICAL_WRIST:
            return _with_wrist(self.screws, T, start, free, found)
        return _with_parallel_axes(self.screws, T, start, free, found)


def inverse_candidates(form: ClosedForm, T: Floats, free: Floats, found: Floats) -> int:
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
    """
    arrays.given(form)
    return form.candidates(
        arrays.numbers(T, 16),
        arrays.numbers(free, form.k),
        arrays.results(found, places.MOST_CANDIDATES * form.k),
    )
