# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Solve the positions of three joints that move a point to a given position, in closed form (Pieper
1968).

D. L. Pieper, "The kinematics of manipulators under computer control", 1968. Joint 3 moves the
point to w, joint 2 moves w to u, and joint 1 must move u to the target p. Joint 1 does not change
two quantities of u. If joint 1 is revolute, these are the height of u along axis 1, and the
distance of u from a point of axis 1. If joint 1 is prismatic, these are the two coordinates of u
perpendicular to axis 1. Each quantity must have the same value for u and p, which gives two
equations in joints 2 and 3. Elimination of joint 2 leaves one equation in joint 3: a quartic, or A
cos x + B sin x = C for special axes. Joints 2 and 1 follow from joint 3.

An equation f for u is stored as ten numbers. The first five are the coefficients of the equation

    f[0] |u|^2 + f[1:4] . u + f[4] = 0,

where the origin is a point of axis 1. Let b be the foot of the perpendicular from u to axis 2, and
u = b + v. A revolute joint 2 rotates v, but changes neither b nor |v|. With u = b + v the equation
becomes n . v = r. Neither the normal n nor r (`_right_side`) depends on joint 2. The normal n is
f[5:8]; f[8] is |n|^2, and f[9] is the error of n.

Errors are propagated to first order: `turn` is the error of directions, rad, and `point_error`
that of points, m. A number that is not larger than its error may be 0. In this case the returned
error of the solutions is infinite, because a solution may be missing.
"""

import math

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Numbers, Vector
from ..six_joints import complex_numbers, pairs
from . import roots

# The quartic in joint 3 has complex roots z. If joint 3 is revolute, a root z = e^(i angle) on the
# unit circle gives a solution. A root is taken as on the circle if | |z| - 1 | is at most
# MAX_CIRCLE_DISTANCE. If joint 3 is prismatic, a real root gives a solution. A root z = x + i y is
# taken as real if |y| <= MAX_CIRCLE_DISTANCE * (1 + |z|). A round-off of 1e-16 moves a double root
# by 1e-8, and a fourfold root by 1e-4.
MAX_CIRCLE_DISTANCE = 1e-3
# Axes 1 and 2 are taken as parallel if the squared sine of their angle is below this. Such a
# squared sine is round-off.
PARALLEL_SINE_SQUARED = 1e-16
# Relative error of a computed direction or sum: five times the machine epsilon, 2.2e-16.
ROUND_OFF = 1e-15
# The coefficients of the quartic in joint 3 are computed from five values of the quartic, at five
# positions of joint 3. The error of a coefficient is at most this factor times the largest error
# of the five values.
COEFFICIENT_FACTOR = 3.0
# Least length that is used as a unit, m, so that no length is divided by 0.
MIN_SCALE = 1e-300


def _write_equations(screws: Numbers, p: Vector, turn: float, F: Numbers, G: Numbers) -> float:
    # Writes to F and G two equations for a point u. The equations hold if joint 1 can move u to p.
    # For a revolute joint 1, F says that u and p have equal heights along axis 1. G says that u
    # and p have equal distances from the origin, which is a point of axis 1. For a prismatic joint
    # 1, F and G say that u and p have equal coordinates along two directions perpendicular to axis
    # 1. Returns the error of the directions in the equations, rad.
    z1, z2 = vectors.axis_of(screws, 0), vectors.axis_of(screws, 1)
    if not vectors.slides(screws, 0):
        _write_equation(F, 0.0, z1, -vectors.dot(z1, p))
        _write_equation(G, 1.0, (0.0, 0.0, 0.0), -vectors.dot(p, p))
        return turn
    a: Vector = vectors.cross(z1, z2)
    if vectors.dot(a, a) < PARALLEL_SINE_SQUARED:
        a = vectors.across(z1)
    length = math.sqrt(vectors.dot(a, a))
    a = (a[0] / length, a[1] / length, a[2] / length)
    b = vectors.cross(z1, a)
    _write_equation(F, 0.0, a, -vectors.dot(a, p))
    _write_equation(G, 0.0, b, -vectors.dot(b, p))
    return turn + ROUND_OFF / length


def _write_equation(f: Numbers, square: float, direction: Vector, constant: float) -> None:
    f[0], f[4] = square, constant
    f[1], f[2], f[3] = direction[0], direction[1], direction[2]


def _write_normal(f: Numbers, z2: Vector, o2: Vector, error: float) -> None:
    normal = vectors.plus(vectors.three(f, 1), 2.0 * f[0], o2)
    normal = vectors.plus(normal, -vectors.dot(normal, z2), z2)
    square = vectors.dot(normal, normal)
    f[5], f[6], f[7] = normal[0], normal[1], normal[2]
    f[8], f[9] = square, error
    if square <= roots.ERROR_MARGIN * roots.ERROR_MARGIN * error * error:
        f[8], f[9] = 0.0, error + math.sqrt(square)


def _residual(f: Numbers, u: Vector) -> float:
    return f[0] * vectors.dot(u, u) + vectors.dot(vectors.three(f, 1), u) + f[4]


def _right_side(f: Numbers, b: Vector, across: float) -> float:
    return -(_residual(f, b) + f[0] * across)


def _error_of(f: Numbers, b: Vector, across: float, point_error: float) -> float:
    # Returns the error of `_right_side`, the right side of equation f, if points have an error of
    # `point_error` meters.
    if f[0] == 0.0:
        return point_error
    return 2.0 * point_error * math.sqrt(vectors.dot(b, b) + across + abs(f[4]))


def _eliminated(
    screws: Numbers, F: Numbers, G: Numbers, w: Vector, turn: float, point_error: float
) -> tuple[float, float]:
    # Elimination of joint 2 leaves an equation g = 0 for the position of joint 3. Joint 3 moves
    # `point` to w. Returns g for this w, and a bound of the error of g. g is 0 if joints 1 and 2
    # can move w to the target.
    # g is a quadratic polynomial of |w|^2 and the coordinates of w. If joint 3 is revolute, |w|^2
    # and the coordinates of w are linear in the cosine and sine of joint 3.
    error: float
    z2, o2 = vectors.axis_of(screws, 1), vectors.point_of(screws, 1)
    if vectors.slides(screws, 1):
        along = vectors.dot(vectors.three(F, 1), z2)
        residual, error = _residual(F, w), 2.0 * point_error
        if G[0] == 0.0 or abs(along) <= roots.ERROR_MARGIN * turn:
            return residual, error
        u = vectors.plus(w, -residual / along, z2)
        remainder = _residual(G, u)
        error = point_error + (error + abs(residual) * turn / abs(along)) / abs(along)
        error = along * along * _error_of(G, u, 0.0, error) + 2.0 * abs(along * remainder) * turn
        return along * along * remainder, error
    height = vectors.dot(z2, vectors.plus(w, -1.0, o2))
    b = vectors.plus(o2, height, z2)
    v = vectors.plus(w, -1.0, b)
    across = vectors.dot(v, v)
    first, second = _right_side(F, b, across), _right_side(G, b, across)
    error_1, error_2 = _error_of(F, b, across, point_error), _error_of(G, b, across, point_error)
    # F and G are two equations of the form n . v = r (see the module's docstring). Only v depends
    # on joint 2. If the normal n of F is zero within its error, F becomes r = 0, which does not
    # depend on joint 2. Then return the r of F. Do the same for G.
    if F[8] == 0.0:
        return first, error_1 + F[9] * math.sqrt(across)
    if G[8] == 0.0:
        return second, error_2 + G[9] * math.sqrt(across)
    value = first * first * G[8] + second * second * F[8] - across * F[8] * G[8]
    error = 2.0 * (abs(first) * error_1 * G[8] + abs(second) * error_2 * F[8])
    error += 2.0 * math.sqrt(across) * point_error * F[8] * G[8]
    # Add the part of the error that comes from errors of the squared normals F[8] and G[8].
    size = first * first + across * F[8]
    error += 2.0 * size * math.sqrt(G[8]) * G[9]
    size = second * second + across * G[8]
    error += 2.0 * size * math.sqrt(F[8]) * F[9]
    return value, error


def _write_coefficients(slides: bool, g: Numbers, c: Numbers) -> None:
    # Writes to c the coefficients of a quartic for joint 3. The input g has the values of the
    # equation in joint 3 at five positions of joint 3.
    arrays.fill(c, 10, 0.0)
    if slides:
        c[0] = g[2]
        c[2] = (g[0] - 8.0 * g[1] + 8.0 * g[3] - g[4]) / 12.0
        c[4] = (-g[0] + 16.0 * g[1] - 30.0 * g[2] + 16.0 * g[3] - g[4]) / 24.0
        c[6] = (-g[0] + 2.0 * g[1] - 2.0 * g[3] + g[4]) / 12.0
        c[8] = (g[0] - 4.0 * g[1] + 6.0 * g[2] - 4.0 * g[3] + g[4]) / 24.0
        return
    # Compute the Fourier coefficients of g = c0 + Re(c1 e^ix + c2 e^2ix), where x is the angle of
    # joint 3. The product of g with 2 e^2ix is a quartic in e^ix.
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
    point_error: float,
    thirds: Numbers,
) -> int:
    # Writes to `thirds` up to four positions of joint 3 at which joints 1 and 2 have a solution.
    # Writes to thirds[4] the largest error of these positions. Returns the number of positions, or
    # -1 if every position is a solution.
    value_error: float
    slides_3 = vectors.slides(screws, 2)
    g, c, z, bounds = [0.0] * 5, [0.0] * 10, [0.0] * 8, [0.0] * 4
    # If joint 3 is prismatic, a root of the polynomial is the position of joint 3 in multiples of
    # `unit` (m). The position is at most `scale`, which is 2 * unit, so a root is at most 2.
    error, largest, unit = 0.0, 0.0, 0.5 * scale if slides_3 else 1.0
    for j in range(5):
        x = unit * (j - 2.0) if slides_3 else 2.0 * places.PI * j / 5.0
        w = vectors.moved(screws, 2, x, point)
        g[j], value_error = _eliminated(screws, F, G, w, turn, point_error)
        error, largest = max(error, value_error), max(largest, abs(g[j]))
    error *= COEFFICIENT_FACTOR
    _write_coefficients(slides_3, g, c)
    thirds[4] = places.INFINITY
    degree = 4
    margin = roots.ERROR_MARGIN * error
    while degree >= 0 and complex_numbers.absolute(pairs.pair(c, degree)) <= margin:
        degree -= 1
    if degree < 0:
        return -1
    if not slides_3 and degree < 4:
        error = 2.0 * (error + complex_numbers.absolute(pairs.pair(c, 4)))
        count = roots.circle_roots(2.0 * c[6], -2.0 * c[7], -c[4], error, thirds)
        thirds[4] = thirds[2]
        return count
    roots.polynomial_roots(c, degree, z)
    for k in range(degree):
        radius = complex_numbers.absolute(pairs.pair(z, k))
        value_error = error * max(1.0, radius * radius * radius * radius)
        if slides_3:
            # The bound `error` comes from the largest error of g at five positions of joint 3.
            # Replace it by a bound of the error at this root, which is smaller.
            w = vectors.moved(screws, 2, unit * math.copysign(radius, z[2 * k]), point)
            value_error = _eliminated(screws, F, G, w, turn, point_error)[1] + ROUND_OFF * largest
        bounds[k] = roots.root_bound(c, degree, value_error, z, k)
    # Select the roots near the unit circle (revolute joint 3) or near the real line (prismatic
    # joint 3).
    # Round-off can split a double root on the circle into two roots with the same angle: one
    # outside of the circle, one inside. To get two distinct angles, add log|z| to the angle of
    # each root z. This number is small, positive outside of the circle, and negative inside. For
    # the real line, add the imaginary part of the root to the real part.
    count = 0
    thirds[4] = 0.0
    for k in range(degree):
        x, y = pairs.pair(z, k)
        radius = complex_numbers.absolute((x, y))
        distance = abs(y) if slides_3 else abs(radius - 1.0)
        if bounds[k] < distance:
            continue
        # If z is an exact root, the mirror image of z in the unit circle (or the real line) is an
        # exact root, too. The error disc of root k, enlarged by DISC_MARGIN, contains z and the
        # mirror image of z. If the enlarged disc meets no other disc, it contains only one exact
        # root. So z equals its mirror image, and z is on the circle (or line).
        if roots.is_apart(z, bounds, degree, k):
            thirds[4] = max(thirds[4], 2.0 * bounds[k] * unit)
        else:
            thirds[4] = places.INFINITY
        if slides_3:
            if distance <= MAX_CIRCLE_DISTANCE * (1.0 + radius):
                thirds[count] = unit * (x + y)
                count += 1
        elif distance <= MAX_CIRCLE_DISTANCE:
            thirds[count] = math.atan2(y, x) + math.log(radius)
            count += 1
    return count


def _second_joint_slides(
    z2: Vector,
    F: Numbers,
    G: Numbers,
    w: Vector,
    turn: float,
    point_error: float,
    free: float,
    seconds: Numbers,
) -> int:
    f = G if G[0] == 0.0 else F
    along = vectors.dot(vectors.three(f, 1), z2)
    if abs(along) > roots.ERROR_MARGIN * turn:
        residual = _residual(f, w)
        seconds[0] = -residual / along
        seconds[2] = (2.0 * point_error + abs(residual) * turn / abs(along)) / abs(along)
        return 1
    if G[0] == 0.0:
        seconds[0], seconds[2] = free, places.INFINITY
        return 1
    # Joint 3 has moved `point` to w. The prismatic joint 2 moves w along its axis z2 by the
    # distance d, to w + d z2. Equation G prescribes the length of the vector w + d z2, so d solves
    # a quadratic equation.
    middle = -vectors.dot(w, z2)
    square = middle * middle - _residual(G, w)
    error = 4.0 * point_error * (abs(middle) + math.sqrt(vectors.dot(w, w) + abs(G[4])))
    count = roots.square_roots(middle, square, middle * middle + abs(G[4]), error, seconds)
    seconds[2] += 2.0 * point_error
    return count


def _second_joint(
    screws: Numbers,
    F: Numbers,
    G: Numbers,
    w: Vector,
    turn: float,
    point_error: float,
    free: float,
    seconds: Numbers,
) -> int:
    # Joint 3 has moved `point` to w. Writes to `seconds` up to two positions of joint 2 that move
    # w to a point from which joint 1 can reach the target. Writes the error of these positions to
    # seconds[2]. Returns the number of positions.
    error: float
    z2, o2 = vectors.axis_of(screws, 1), vectors.point_of(screws, 1)
    if vectors.slides(screws, 1):
        return _second_joint_slides(z2, F, G, w, turn, point_error, free, seconds)
    height = vectors.dot(z2, vectors.plus(w, -1.0, o2))
    b = vectors.plus(o2, height, z2)
    from_axis = vectors.plus(w, -1.0, b)
    across = vectors.dot(from_axis, from_axis)
    if F[8] > 0.0 and G[8] > 0.0:
        first, second = _right_side(F, b, across) / F[8], _right_side(G, b, across) / G[8]
        v = vectors.plus((0.0, 0.0, 0.0), first, vectors.three(F, 5))
        v = vectors.plus(v, second, vectors.three(G, 5))
        seconds[0] = vectors.angle(z2, from_axis, v, free)
        error = (
            point_error
            + _error_of(F, b, across, point_error) / math.sqrt(F[8])
            + 2.0 * abs(first) * F[9]
        )
        error += _error_of(G, b, across, point_error) / math.sqrt(G[8]) + 2.0 * abs(second) * G[9]
        seconds[2] = roots.turn_error(z2, from_axis, error)
        return 1
    f = F if F[8] > 0.0 else G
    count = -1
    if f[8] != 0.0:
        normal = vectors.three(f, 5)
        error = (
            _error_of(f, b, across, point_error)
            + math.sqrt(f[8]) * point_error
            + f[9] * math.sqrt(across)
        )
        count = roots.circle_roots(
            vectors.dot(normal, from_axis),
            vectors.dot(normal, vectors.cross(z2, from_axis)),
            _right_side(f, b, across),
            error,
            seconds,
        )
    if count < 0:
        seconds[0], seconds[2] = free, places.INFINITY
        return 1
    return count


def first_three(
    screws: Numbers,
    point: Vector,
    p: Vector,
    turn: float,
    point_error: float,
    free: Numbers,
    psi: Numbers,
) -> int:
    """
    Fill `psi` (8, 3) with the positions of three joints that move `point` to p; return the number
    of solutions.

    The number after the eight rows, psi[24], is a bound of the errors of these positions, rad. It
    is infinite if a solution may be missing. `turn` and `point_error` are the errors of directions
    and points, rad and m. If every position of a joint is a solution, the function takes the
    position that `free` (3,) has for this joint.
    """
    # Move the origin to the point of axis 1. The formulas for joint 2 require that the normals of
    # the equations F and G (see the module's docstring) are perpendicular. If joint 1 is revolute,
    # the normal of G is along the vector from the origin to the point of axis 2, and the normal of
    # F is in the plane of the directions of axes 1 and 2. In `screws`, the points of axes 1 and 2
    # are the end points of the common perpendicular of the two axes. So the two normals are
    # perpendicular.
    o1 = vectors.point_of(screws, 0)
    local, F, G = [0.0] * 21, [0.0] * 10, [0.0] * 10
    arrays.copy(local, 21, screws)
    for k in range(3):
        local[7 * k + 3] -= o1[0]
        local[7 * k + 4] -= o1[1]
        local[7 * k + 5] -= o1[2]
    point, p = vectors.plus(point, -1.0, o1), vectors.plus(p, -1.0, o1)
    turn = _write_equations(local, p, turn, F, G)
    z1, z2, o2 = vectors.axis_of(local, 0), vectors.axis_of(local, 1), vectors.point_of(local, 1)
    scale = math.sqrt(vectors.dot(p, p)) + math.sqrt(vectors.dot(point, point))
    scale = max(scale + math.sqrt(vectors.dot(o2, o2)), MIN_SCALE)
    point_error += scale * turn
    _write_normal(F, z2, o2, 2.0 * turn)
    _write_normal(G, z2, o2, 2.0 * point_error if G[0] > 0.0 else 2.0 * turn)
    thirds, seconds = [0.0] * 5, [0.0] * 3
    count_3 = _third_joint(local, point, F, G, scale, turn, point_error, thirds)
    if count_3 < 0:
        thirds[0] = free[2]
        count_3 = 1
    count = 0
    largest = thirds[4] / scale if vectors.slides(local, 2) else thirds[4]
    point_error = point_error + _error_of_point(local, 2, point, thirds[4])
    for i in range(count_3):
        w = vectors.moved(local, 2, thirds[i], point)
        count_2 = _second_joint(local, F, G, w, turn, point_error, free[1], seconds)
        largest = max(largest, seconds[2] / scale if vectors.slides(local, 1) else seconds[2])
        for j in range(count_2):
            u = vectors.moved(local, 1, seconds[j], w)
            error = point_error + _error_of_point(local, 1, w, seconds[2])
            if vectors.slides(local, 0):
                psi[3 * count] = vectors.dot(z1, vectors.plus(p, -1.0, u))
                largest = max(largest, error / scale)
            else:
                psi[3 * count] = vectors.angle(z1, u, p, free[0])
                largest = max(largest, roots.turn_error(z1, p, 2.0 * error))
            psi[3 * count + 1] = seconds[j]
            psi[3 * count + 2] = thirds[i]
            count += 1
    psi[24] = largest
    return count


def _error_of_point(screws: Numbers, k: int, point: Vector, error: float) -> float:
    # Returns the error of `point`, m, if joint k has the error `error`, rad or m.
    if vectors.slides(screws, k):
        return error
    lever = vectors.cross(
        vectors.axis_of(screws, k), vectors.plus(point, -1.0, vectors.point_of(screws, k))
    )
    return error * math.sqrt(vectors.dot(lever, lever)) if error < places.INFINITY else error
