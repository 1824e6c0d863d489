"""
Three joints that bring a point to its place, in closed form.

Without joint 1 there are two conditions on u, the point before joint 1 moves it; without joint 2
they become one equation in joint 3. A condition f is ten numbers: f[0] |u|^2 + f[1:4] . u + f[4]
= 0, which joint 2 turns into guide . v = `_wanted`, v the part of u across axis 2; the guide is
f[5:8], f[8] its square, and f[9] its error. The origin is the point of axis 1.

Errors are followed from step to step, up to first order: what is not larger than its own may be 0,
and then a solution may be missing. `turn` is the error of directions, `way` that of points.
"""

import math

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Numbers, Vector
from . import roots

# Roots of a polynomial that should lie on the unit circle (or the real line): a double one is
# known to the square root of round-off, one of multiplicity four to its fourth root.
OFF_CIRCLE = 1e-3
# Axes whose cross product has a smaller square are parallel enough for any direction across.
ACROSS = 1e-16
ROUND_OFF = 1e-15


def _write_conditions(screws: Numbers, p: Vector, turn: float, F: Numbers, G: Numbers) -> float:
    # Returns the error of their directions; that of the axes is `turn`.
    z1, z2 = vectors.axis_of(screws, 0), vectors.axis_of(screws, 1)
    if not vectors.slides(screws, 0):
        _write_condition(F, 0.0, z1, -vectors.dot(z1, p))
        _write_condition(G, 1.0, (0.0, 0.0, 0.0), -vectors.dot(p, p))
        return turn
    a: Vector = vectors.cross(z1, z2)
    if vectors.dot(a, a) < ACROSS:
        a = vectors.across(z1)
    length = math.sqrt(vectors.dot(a, a))
    a = (a[0] / length, a[1] / length, a[2] / length)
    b = vectors.cross(z1, a)
    _write_condition(F, 0.0, a, -vectors.dot(a, p))
    _write_condition(G, 0.0, b, -vectors.dot(b, p))
    return turn + ROUND_OFF / length


def _write_condition(f: Numbers, square: float, direction: Vector, constant: float) -> None:
    f[0], f[4] = square, constant
    f[1], f[2], f[3] = direction[0], direction[1], direction[2]


def _write_guide(f: Numbers, z2: Vector, o2: Vector, error: float) -> None:
    guide = vectors.plus(vectors.three(f, 1), 2.0 * f[0], o2)
    guide = vectors.plus(guide, -vectors.dot(guide, z2), z2)
    square = vectors.dot(guide, guide)
    f[5], f[6], f[7] = guide[0], guide[1], guide[2]
    f[8], f[9] = square, error
    if square <= roots.MARGIN * roots.MARGIN * error * error:
        f[8], f[9] = 0.0, error + math.sqrt(square)


def _left_over(f: Numbers, u: Vector) -> float:
    return f[0] * vectors.dot(u, u) + vectors.dot(vectors.three(f, 1), u) + f[4]


def _wanted(f: Numbers, b: Vector, across: float) -> float:
    return -(_left_over(f, b) + f[0] * across)


def _error_of(f: Numbers, b: Vector, across: float, way: float) -> float:
    # The error of `_wanted` where that of points is `way`.
    if f[0] == 0.0:
        return way
    return 2.0 * way * math.sqrt(vectors.dot(b, b) + across + abs(f[4]))


def _eliminated(
    F: Numbers,
    G: Numbers,
    z2: Vector,
    o2: Vector,
    slides: bool,
    w: Vector,
    turn: float,
    way: float,
) -> tuple[float, float]:
    # A number that is zero where joints 1 and 2 can bring w to the target, and its error. It is of
    # second degree in w, whose square is linear in the cosine and sine of joint 3.
    off: float
    if slides:
        along = vectors.dot(vectors.three(F, 1), z2)
        rest, off = _left_over(F, w), 2.0 * way
        if G[0] == 0.0 or abs(along) <= roots.MARGIN * turn:
            return rest, off
        u = vectors.plus(w, -rest / along, z2)
        left = _left_over(G, u)
        off = way + (off + abs(rest) * turn / abs(along)) / abs(along)
        off = along * along * _error_of(G, u, 0.0, off) + 2.0 * abs(along * left) * turn
        return along * along * left, off
    height = vectors.dot(z2, vectors.plus(w, -1.0, o2))
    b = vectors.plus(o2, height, z2)
    v = vectors.plus(w, -1.0, b)
    across = vectors.dot(v, v)
    first, second = _wanted(F, b, across), _wanted(G, b, across)
    off_1, off_2 = _error_of(F, b, across, way), _error_of(G, b, across, way)
    # What a guide that is zero adds is error.
    if F[8] == 0.0:
        return first, off_1 + F[9] * math.sqrt(across)
    if G[8] == 0.0:
        return second, off_2 + G[9] * math.sqrt(across)
    value = first * first * G[8] + second * second * F[8] - across * F[8] * G[8]
    off = 2.0 * (abs(first) * off_1 * G[8] + abs(second) * off_2 * F[8])
    off += 2.0 * math.sqrt(across) * way * F[8] * G[8]
    # Those of the squares of the guides.
    sized = first * first + across * F[8]
    off += 2.0 * sized * math.sqrt(G[8]) * G[9]
    sized = second * second + across * G[8]
    off += 2.0 * sized * math.sqrt(F[8]) * F[9]
    return value, off


def _write_coefficients(slides: bool, g: Numbers, c: Numbers) -> None:
    # Of the polynomial whose values g were taken at five positions of joint 3.
    arrays.fill(c, 10, 0.0)
    if slides:
        c[0] = g[2]
        c[2] = (g[0] - 8.0 * g[1] + 8.0 * g[3] - g[4]) / 12.0
        c[4] = (-g[0] + 16.0 * g[1] - 30.0 * g[2] + 16.0 * g[3] - g[4]) / 24.0
        c[6] = (-g[0] + 2.0 * g[1] - 2.0 * g[3] + g[4]) / 12.0
        c[8] = (g[0] - 4.0 * g[1] + 6.0 * g[2] - 4.0 * g[3] + g[4]) / 24.0
        return
    # g = c0 + Re(c1 e^ix + c2 e^2ix), times 2 e^2ix: a quartic in e^ix.
    for k in range(3):
        for j in range(5):
            turn = -2.0 * places.PI * k * j / 5.0
            c[4 + 2 * k] += 0.4 * g[j] * math.cos(turn)
            c[5 + 2 * k] += 0.4 * g[j] * math.sin(turn)
    c[2], c[3] = c[6], -c[7]
    c[0], c[1] = c[8], -c[9]


def _third_joint(
    screws: Numbers,
    point: Vector,
    F: Numbers,
    G: Numbers,
    scale: float,
    turn: float,
    way: float,
    found: Numbers,
) -> int:
    # Writes positions of joint 3 at which joints 1 and 2 have a solution, and their error behind
    # four; returns -1 if every position is one.
    off: float
    z2, o2 = vectors.axis_of(screws, 1), vectors.point_of(screws, 1)
    slides_2, slides_3 = vectors.slides(screws, 1), vectors.slides(screws, 2)
    g, c, z, bounds = [0.0] * 5, [0.0] * 10, [0.0] * 8, [0.0] * 4
    # No way is longer than twice the unit that roots are in.
    error, largest, unit = 0.0, 0.0, 0.5 * scale if slides_3 else 1.0
    for j in range(5):
        x = unit * (j - 2.0) if slides_3 else 2.0 * places.PI * j / 5.0
        w = vectors.moved(screws, 2, x, point)
        g[j], off = _eliminated(F, G, z2, o2, slides_2, w, turn, way)
        error, largest = max(error, off), max(largest, abs(g[j]))
    # A coefficient is no more than three times as large as the values it is made of.
    error *= 3.0
    _write_coefficients(slides_3, g, c)
    found[4] = places.INFINITY
    degree = 4
    while degree >= 0 and _size(c, degree) <= roots.MARGIN * error:
        degree -= 1
    if degree < 0:
        return -1
    if not slides_3 and degree < 4:
        error = 2.0 * (error + _size(c, 4))
        count = roots.circle_roots(2.0 * c[6], -2.0 * c[7], -c[4], error, found)
        found[4] = found[2]
        return count
    roots.polynomial_roots(c, degree, z)
    for k in range(degree):
        away = _size(z, k)
        off = error * max(1.0, away * away * away * away)
        if slides_3:
            # The way of the root, or one as long, tells more than the longest.
            w = vectors.moved(screws, 2, unit * math.copysign(away, z[2 * k]), point)
            off = _eliminated(F, G, z2, o2, slides_2, w, turn, way)[1] + ROUND_OFF * largest
        bounds[k] = roots.root_bound(c, degree, off, z, k)
    # Two roots that round-off has merged lie beside the line, or the circle, by their distance on
    # it: they are moved back by that distance to either side.
    count = 0
    found[4] = 0.0
    for k in range(degree):
        x, y = z[2 * k], z[2 * k + 1]
        away = roots.absolute(x, y)
        beside = abs(y) if slides_3 else abs(away - 1.0)
        if bounds[k] < beside:
            continue
        # A root that is alone is real: its mirror image, another root or itself, is next to it.
        if roots.is_apart(z, bounds, degree, k):
            found[4] = max(found[4], 2.0 * bounds[k] * unit)
        else:
            found[4] = places.INFINITY
        if slides_3:
            if beside <= OFF_CIRCLE * (1.0 + away):
                found[count] = unit * (x + y)
                count += 1
        elif beside <= OFF_CIRCLE:
            found[count] = math.atan2(y, x) + math.log(away)
            count += 1
    return count


def _size(c: Numbers, k: int) -> float:
    return roots.absolute(c[2 * k], c[2 * k + 1])


def _second_joint_slides(
    z2: Vector,
    F: Numbers,
    G: Numbers,
    w: Vector,
    turn: float,
    way: float,
    free: float,
    found: Numbers,
) -> int:
    f = G if G[0] == 0.0 else F
    along = vectors.dot(vectors.three(f, 1), z2)
    if abs(along) > roots.MARGIN * turn:
        rest = _left_over(f, w)
        found[0] = -rest / along
        found[2] = (2.0 * way + abs(rest) * turn / abs(along)) / abs(along)
        return 1
    if G[0] == 0.0:
        found[0], found[2] = free, places.INFINITY
        return 1
    # |w + d z2|^2 is given.
    middle = -vectors.dot(w, z2)
    square = middle * middle - _left_over(G, w)
    error = 4.0 * way * (abs(middle) + math.sqrt(vectors.dot(w, w) + abs(G[4])))
    count = roots.square_roots(middle, square, middle * middle + abs(G[4]), error, found)
    found[2] += 2.0 * way
    return count


def _second_joint(
    screws: Numbers,
    F: Numbers,
    G: Numbers,
    w: Vector,
    turn: float,
    way: float,
    free: float,
    found: Numbers,
) -> int:
    # Writes positions of joint 2 that bring w to a circle of joint 1, and their error behind two.
    z2, o2 = vectors.axis_of(screws, 1), vectors.point_of(screws, 1)
    if vectors.slides(screws, 1):
        return _second_joint_slides(z2, F, G, w, turn, way, free, found)
    height = vectors.dot(z2, vectors.plus(w, -1.0, o2))
    b = vectors.plus(o2, height, z2)
    from_axis = vectors.plus(w, -1.0, b)
    across = vectors.dot(from_axis, from_axis)
    if F[8] > 0.0 and G[8] > 0.0:
        first, second = _wanted(F, b, across) / F[8], _wanted(G, b, across) / G[8]
        v = vectors.plus((0.0, 0.0, 0.0), first, vectors.three(F, 5))
        v = vectors.plus(v, second, vectors.three(G, 5))
        found[0] = vectors.angle(z2, from_axis, v, free)
        off: float = way + _error_of(F, b, across, way) / math.sqrt(F[8]) + 2.0 * abs(first) * F[9]
        off += _error_of(G, b, across, way) / math.sqrt(G[8]) + 2.0 * abs(second) * G[9]
        found[2] = roots.turn_error(z2, from_axis, off)
        return 1
    f = F if F[8] > 0.0 else G
    count = -1
    if f[8] != 0.0:
        guide = vectors.three(f, 5)
        off = _error_of(f, b, across, way) + math.sqrt(f[8]) * way + f[9] * math.sqrt(across)
        count = roots.circle_roots(
            vectors.dot(guide, from_axis),
            vectors.dot(guide, vectors.cross(z2, from_axis)),
            _wanted(f, b, across),
            off,
            found,
        )
    if count < 0:
        found[0], found[2] = free, places.INFINITY
        return 1
    return count


def first_three(
    screws: Numbers,
    point: Vector,
    p: Vector,
    turn: float,
    way: float,
    free: Numbers,
    found: Numbers,
) -> int:
    """
    Fill `found` (8, 3) with positions of three joints that bring a point to p; return their
    number.

    Behind them stands how far they are from those of the exact screws and target, in rad; infinite
    where others may be missing. `turn` and `way` are the errors of directions and points, rad and
    m.
    """
    # The points of axes 1 and 2 are the feet of their common perpendicular, so the two guides are
    # orthogonal.
    o1 = vectors.point_of(screws, 0)
    here, F, G = [0.0] * 21, [0.0] * 10, [0.0] * 10
    arrays.copy(here, 21, screws)
    for k in range(3):
        here[7 * k + 3] -= o1[0]
        here[7 * k + 4] -= o1[1]
        here[7 * k + 5] -= o1[2]
    point, p = vectors.plus(point, -1.0, o1), vectors.plus(p, -1.0, o1)
    turn = _write_conditions(here, p, turn, F, G)
    z1, z2, o2 = vectors.axis_of(here, 0), vectors.axis_of(here, 1), vectors.point_of(here, 1)
    scale = math.sqrt(vectors.dot(p, p)) + math.sqrt(vectors.dot(point, point))
    scale = max(scale + math.sqrt(vectors.dot(o2, o2)), 1e-300)
    way += scale * turn
    _write_guide(F, z2, o2, 2.0 * turn)
    _write_guide(G, z2, o2, 2.0 * way if G[0] > 0.0 else 2.0 * turn)
    thirds, seconds = [0.0] * 5, [0.0] * 3
    count_3 = _third_joint(here, point, F, G, scale, turn, way, thirds)
    if count_3 < 0:
        thirds[0] = free[2]
        count_3 = 1
    count = 0
    worst = thirds[4] / scale if vectors.slides(here, 2) else thirds[4]
    carried = way + _carried(here, 2, point, thirds[4])
    for i in range(count_3):
        w = vectors.moved(here, 2, thirds[i], point)
        count_2 = _second_joint(here, F, G, w, turn, carried, free[1], seconds)
        worst = max(worst, seconds[2] / scale if vectors.slides(here, 1) else seconds[2])
        for j in range(count_2):
            u = vectors.moved(here, 1, seconds[j], w)
            off = carried + _carried(here, 1, w, seconds[2])
            if vectors.slides(here, 0):
                found[3 * count] = vectors.dot(z1, vectors.plus(p, -1.0, u))
                worst = max(worst, off / scale)
            else:
                found[3 * count] = vectors.angle(z1, u, p, free[0])
                worst = max(worst, roots.turn_error(z1, p, 2.0 * off))
            found[3 * count + 1] = seconds[j]
            found[3 * count + 2] = thirds[i]
            count += 1
    found[24] = worst
    return count


def _carried(screws: Numbers, k: int, point: Vector, error: float) -> float:
    # How far an error of joint k carries a point.
    if vectors.slides(screws, k):
        return error
    lever = vectors.cross(
        vectors.axis_of(screws, k), vectors.plus(point, -1.0, vectors.point_of(screws, k))
    )
    return error * math.sqrt(vectors.dot(lever, lever)) if error < places.INFINITY else error
