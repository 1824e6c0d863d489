"""
Three joints that bring a point to its place, in closed form.

Without joint 1 there are two conditions on u, the point before joint 1 moves it; without joint 2
they become one equation in joint 3. A condition f is nine numbers: f[0] |u|^2 + f[1:4] . u + f[4]
= 0, which joint 2 turns into guide . v = `_wanted`, v the part of u across axis 2; the guide is
f[5:8], and f[8] its square. The origin is the point of axis 1.
"""

import math

from ..forward import vectors
from ..layout import places
from ..layout.arrays import Numbers, Vector
from . import roots

# Roots of a polynomial that should lie on the unit circle (or the real line): a double one is
# known to the square root of round-off, one of multiplicity four to its fourth root.
OFF_CIRCLE = 1e-3
# Coefficients, and squared lengths against those of the arm, below this share are zero.
NOTHING = 1e-12


def _write_conditions(screws: Numbers, p: Vector, F: Numbers, G: Numbers) -> None:
    z1, z2 = vectors.axis_of(screws, 0), vectors.axis_of(screws, 1)
    if vectors.slides(screws, 0):
        a = vectors.cross(z1, z2)
        if vectors.dot(a, a) < NOTHING:
            a = vectors.cross(z1, (1.0, 0.0, 0.0) if abs(z1[0]) < 0.6 else (0.0, 1.0, 0.0))
        length = math.sqrt(vectors.dot(a, a))
        a = (a[0] / length, a[1] / length, a[2] / length)
        b = vectors.cross(z1, a)
        _write_condition(F, 0.0, a, -vectors.dot(a, p))
        _write_condition(G, 0.0, b, -vectors.dot(b, p))
    else:
        _write_condition(F, 0.0, z1, -vectors.dot(z1, p))
        _write_condition(G, 1.0, (0.0, 0.0, 0.0), -vectors.dot(p, p))


def _write_condition(f: Numbers, square: float, direction: Vector, constant: float) -> None:
    f[0], f[4] = square, constant
    f[1], f[2], f[3] = direction[0], direction[1], direction[2]


def _write_guide(f: Numbers, z2: Vector, o2: Vector, least: float) -> None:
    guide = vectors.plus(vectors.three(f, 1), 2.0 * f[0], o2)
    guide = vectors.plus(guide, -vectors.dot(guide, z2), z2)
    square = vectors.dot(guide, guide)
    f[5], f[6], f[7] = guide[0], guide[1], guide[2]
    f[8] = square if square > least else 0.0


def _left_over(f: Numbers, u: Vector) -> float:
    return f[0] * vectors.dot(u, u) + vectors.dot(vectors.three(f, 1), u) + f[4]


def _wanted(f: Numbers, b: Vector, across: float) -> float:
    return -(_left_over(f, b) + f[0] * across)


def _eliminated(
    F: Numbers, G: Numbers, z2: Vector, o2: Vector, slides: bool, w: Vector
) -> tuple[float, float]:
    # A number that is zero where joints 1 and 2 can bring w to the target, and the size of its
    # terms. It is of second degree in w, whose square is linear in the cosine and sine of joint 3.
    if slides:
        along = vectors.dot(vectors.three(F, 1), z2)
        rest = _left_over(F, w)
        if G[0] == 0.0 or abs(along) <= 1e-9:
            return rest, abs(vectors.dot(vectors.three(F, 1), w)) + abs(F[4])
        u = vectors.plus(w, -rest / along, z2)
        size = along * along * (vectors.dot(u, u) + abs(G[4]))
        return along * along * _left_over(G, u), size
    height = vectors.dot(z2, vectors.plus(w, -1.0, o2))
    b = vectors.plus(o2, height, z2)
    v = vectors.plus(w, -1.0, b)
    across = vectors.dot(v, v)
    first, second = _wanted(F, b, across), _wanted(G, b, across)
    size_0 = abs(vectors.dot(vectors.three(F, 1), b)) + abs(F[4])
    size_1 = G[0] * (vectors.dot(b, b) + across) + abs(vectors.dot(vectors.three(G, 1), b))
    size_1 += abs(G[4])
    if F[8] == 0.0:
        return first, size_0
    if G[8] == 0.0:
        return second, size_1
    value = first * first * G[8] + second * second * F[8]
    size = size_0 * size_0 * G[8] + size_1 * size_1 * F[8]
    product = across * F[8] * G[8]
    return value - product, size + product


def _write_coefficients(slides: bool, g: Numbers, c: Numbers) -> None:
    # Of the polynomial whose values g were taken at five positions of joint 3.
    for k in range(10):
        c[k] = 0.0
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
    screws: Numbers, point: Vector, F: Numbers, G: Numbers, scale: float, found: Numbers
) -> int:
    # Writes positions of joint 3 at which joints 1 and 2 have a solution; returns -1 if every
    # position is one.
    z2, o2 = vectors.axis_of(screws, 1), vectors.point_of(screws, 1)
    slides_2, slides_3 = vectors.slides(screws, 1), vectors.slides(screws, 2)
    g, c, z = [0.0] * 5, [0.0] * 10, [0.0] * 8
    size = 0.0
    for j in range(5):
        x = scale * (j - 2.0) if slides_3 else 2.0 * places.PI * j / 5.0
        value, terms = _eliminated(F, G, z2, o2, slides_2, vectors.moved(screws, 2, x, point))
        g[j] = value
        size = max(size, terms)
    _write_coefficients(slides_3, g, c)
    largest = 0.0
    for k in range(5):
        largest = max(largest, roots.absolute(c[2 * k], c[2 * k + 1]))
    if largest <= NOTHING * size:
        return -1
    degree = 4
    while degree > 0 and roots.absolute(c[2 * degree], c[2 * degree + 1]) <= NOTHING * largest:
        degree -= 1
    if not slides_3 and degree < 4:
        return roots.circle_roots(2.0 * c[6], -2.0 * c[7], -c[4], found)
    roots.polynomial_roots(c, degree, z)
    # Two roots that round-off has merged lie beside the line, or the circle, by their distance on
    # it: they are moved back by that distance to either side.
    count = 0
    for k in range(degree):
        x, y = z[2 * k], z[2 * k + 1]
        away = roots.absolute(x, y)
        if slides_3:
            if abs(y) <= OFF_CIRCLE * (1.0 + away):
                found[count] = scale * (x + y)
                count += 1
        elif abs(away - 1.0) <= OFF_CIRCLE:
            found[count] = math.atan2(y, x) + math.log(away)
            count += 1
    return count


def _second_joint_slides(
    z2: Vector, F: Numbers, G: Numbers, w: Vector, free: float, found: Numbers
) -> int:
    f = G if G[0] == 0.0 else F
    along = vectors.dot(vectors.three(f, 1), z2)
    if abs(along) > 1e-9:
        found[0] = -_left_over(f, w) / along
        return 1
    if G[0] == 0.0:
        found[0] = free
        return 1
    # |w + d z2|^2 is given.
    middle = -vectors.dot(w, z2)
    half = roots.square_root_apart(middle * middle - _left_over(G, w), middle * middle + abs(G[4]))
    if half < 0.0:
        return 0
    found[0], found[1] = middle + half, middle - half
    return 2


def _second_joint(
    screws: Numbers, F: Numbers, G: Numbers, w: Vector, free: float, found: Numbers
) -> int:
    # Writes positions of joint 2 that bring w to a circle of joint 1.
    z2, o2 = vectors.axis_of(screws, 1), vectors.point_of(screws, 1)
    if vectors.slides(screws, 1):
        return _second_joint_slides(z2, F, G, w, free, found)
    height = vectors.dot(z2, vectors.plus(w, -1.0, o2))
    b = vectors.plus(o2, height, z2)
    from_axis = vectors.plus(w, -1.0, b)
    across = vectors.dot(from_axis, from_axis)
    if F[8] > 0.0 and G[8] > 0.0:
        first, second = _wanted(F, b, across) / F[8], _wanted(G, b, across) / G[8]
        v = vectors.plus((0.0, 0.0, 0.0), first, vectors.three(F, 5))
        v = vectors.plus(v, second, vectors.three(G, 5))
        found[0] = vectors.angle(z2, from_axis, v, free)
        return 1
    f = F if F[8] > 0.0 else G
    count = -1
    if f[8] != 0.0:
        guide = vectors.three(f, 5)
        count = roots.circle_roots(
            vectors.dot(guide, from_axis),
            vectors.dot(guide, vectors.cross(z2, from_axis)),
            _wanted(f, b, across),
            found,
        )
    if count < 0:
        found[0] = free
        return 1
    return count


def first_three(screws: Numbers, point: Vector, p: Vector, free: Numbers, found: Numbers) -> int:
    """
    Fill `found` (8, 3) with positions of three joints that bring a point to p; return their
    number.
    """
    # The points of axes 1 and 2 are the feet of their common perpendicular, so the two guides are
    # orthogonal.
    o1 = vectors.point_of(screws, 0)
    here, F, G = [0.0] * 21, [0.0] * 9, [0.0] * 9
    for k in range(21):
        here[k] = screws[k]
    for k in range(3):
        here[7 * k + 3] -= o1[0]
        here[7 * k + 4] -= o1[1]
        here[7 * k + 5] -= o1[2]
    point, p = vectors.plus(point, -1.0, o1), vectors.plus(p, -1.0, o1)
    _write_conditions(here, p, F, G)
    z1, z2, o2 = vectors.axis_of(here, 0), vectors.axis_of(here, 1), vectors.point_of(here, 1)
    scale = math.sqrt(vectors.dot(p, p)) + math.sqrt(vectors.dot(point, point))
    scale += math.sqrt(vectors.dot(o2, o2))
    _write_guide(F, z2, o2, 1e-18)
    _write_guide(G, z2, o2, 1e-18 * (scale * scale if G[0] > 0.0 else 1.0))
    thirds, seconds = [0.0] * 4, [0.0] * 2
    count_3 = _third_joint(here, point, F, G, max(scale, 1e-300), thirds)
    if count_3 < 0:
        thirds[0] = free[2]
        count_3 = 1
    count = 0
    for i in range(count_3):
        w = vectors.moved(here, 2, thirds[i], point)
        count_2 = _second_joint(here, F, G, w, free[1], seconds)
        for j in range(count_2):
            u = vectors.moved(here, 1, seconds[j], w)
            if vectors.slides(here, 0):
                found[3 * count] = vectors.dot(z1, vectors.plus(p, -1.0, u))
            else:
                found[3 * count] = vectors.angle(z1, u, p, free[0])
            found[3 * count + 1] = seconds[j]
            found[3 * count + 2] = thirds[i]
            count += 1
    return count
