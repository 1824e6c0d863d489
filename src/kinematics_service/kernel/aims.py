"""
What is aimed at: a target, the axes and weights of the rows that count, and what a pose lacks.

"""

import math

from . import arrays, chain_pass, places, vectors
from .arrays import Floats, Numbers, Vector
from .chain import Chain

# A rotation matrix written with four digits is still meant as one; a better one is taken as it is.
NEARLY_ROTATION, ROTATION = 1e-3, 1e-13


def _rotation_vector(R: Numbers) -> Vector:
    # Axis times angle of the nine numbers of a rotation matrix.
    x, y, z = R[7] - R[5], R[2] - R[6], R[3] - R[1]
    sine = math.sqrt(x * x + y * y + z * z)
    cosine = R[0] + R[4] + R[8] - 1.0
    angle = math.atan2(sine, cosine)
    if sine > 1e-9:
        share = angle / sine
        return (x * share, y * share, z * share)
    if cosine > 0.0:
        return (0.5 * x, 0.5 * y, 0.5 * z)
    # Half a turn: any column of R + I shows the axis, the longest is the safest.
    if R[0] >= R[4] and R[0] >= R[8]:
        a, b, c = R[0] + 1.0, R[3], R[6]
    elif R[4] >= R[8]:
        a, b, c = R[1], R[4] + 1.0, R[7]
    else:
        a, b, c = R[2], R[5], R[8] + 1.0
    share = angle / math.sqrt(a * a + b * b + c * c)
    return (a * share, b * share, c * share)


def _turned_back(aim: Floats, v: Vector) -> Vector:
    at = places.AIM_AXES
    return (
        aim[at] * v[0] + aim[at + 3] * v[1] + aim[at + 6] * v[2],
        aim[at + 1] * v[0] + aim[at + 4] * v[1] + aim[at + 7] * v[2],
        aim[at + 2] * v[0] + aim[at + 5] * v[1] + aim[at + 8] * v[2],
    )


def _write_weighted(
    aim: Floats, scale: float, linear: Vector, angular: Vector, six: Numbers
) -> None:
    at = places.AIM_WEIGHTS
    six[0] = scale * aim[at] * linear[0]
    six[1] = scale * aim[at + 1] * linear[1]
    six[2] = scale * aim[at + 2] * linear[2]
    six[3] = scale * aim[at + 3] * angular[0]
    six[4] = scale * aim[at + 4] * angular[1]
    six[5] = scale * aim[at + 5] * angular[2]


def miss(aim: Floats, row: Floats, error: Numbers) -> float:
    """
    Fill `error` (6,) with what the pose of a row lacks, weighted, and return its square.

    """
    linear = _turned_back(aim, (aim[3] - row[3], aim[7] - row[7], aim[11] - row[11]))
    at = places.AIM_WEIGHTS
    angular = (0.0, 0.0, 0.0)
    if aim[at + 3] + aim[at + 4] + aim[at + 5] > 0.0:
        R = [0.0] * 9
        for i in range(3):
            for j in range(3):
                R[3 * i + j] = (
                    aim[4 * i] * row[4 * j]
                    + aim[4 * i + 1] * row[4 * j + 1]
                    + aim[4 * i + 2] * row[4 * j + 2]
                )
        angular = _turned_back(aim, _rotation_vector(R))
    _write_weighted(aim, 1.0, linear, angular, error)
    square = 0.0
    for i in range(3):
        square += error[i] * error[i] + error[3 + i] * error[3 + i]
    return square


def write_columns(aim: Floats, n: int, row: Floats, scales: Floats, columns: Floats) -> None:
    """
    Fill `columns` (n, 6) with the columns of J in the axes of the rows, weighted like the error.

    A unit of each joint counts scales[j] (0: the joint is held).

    """
    for j in range(n):
        J = arrays.after(row, places.JACOBIAN_AT + j)
        linear = _turned_back(aim, (J[0], J[n], J[2 * n]))
        angular = _turned_back(aim, (J[3 * n], J[4 * n], J[5 * n]))
        _write_weighted(aim, scales[j], linear, angular, arrays.after(columns, 6 * j))


def length_of(aim: Floats) -> float:
    """
    Return the length by which angles count; 0 where none does.

    """
    at = places.AIM_WEIGHTS
    return max(aim[at + 3], aim[at + 4], aim[at + 5])


def parts_of_error(chain: Chain, aim: Floats, q: Floats) -> tuple[float, float]:
    """
    Return by how much q (1, n) misses its target in the rows that count: m, rad.

    """
    arrays.given(chain)
    n = chain.dof
    target = arrays.numbers(aim, places.AIM_SIZE)
    positions = arrays.numbers(q, n)
    row, error = arrays.scratch(places.JACOBIAN_AT), [0.0] * 6
    chain_pass.evaluate_row(chain, positions, positions, places.POSE, row)
    miss(target, row, error)
    arrays.give_back(row)
    length = length_of(target)
    angular = math.sqrt(error[3] * error[3] + error[4] * error[4] + error[5] * error[5])
    linear = math.sqrt(error[0] * error[0] + error[1] * error[1] + error[2] * error[2])
    return linear, angular / length if length > 0.0 else 0.0


def _off(T: Floats) -> float:
    off = 0.0
    for i in range(3):
        for j in range(i + 1):
            a, b = vectors.three(T, 4 * i), vectors.three(T, 4 * j)
            off = max(off, abs(vectors.dot(a, b) - (1.0 if i == j else 0.0)))
    a, b = vectors.three(T, 0), vectors.three(T, 4)
    if vectors.dot(vectors.cross(a, b), vectors.three(T, 8)) < 0.0:
        return places.INFINITY
    return off


def off_rotation(T: Floats) -> float:
    """
    Return by how much the rotation of a pose (4, 4) is not orthogonal; infinite for a mirror.

    """
    return _off(arrays.numbers(T, 12))


def take_aim(target: Floats, aim: Floats) -> int:
    """
    Write a target into an aim and return FINE, or what is wrong with it; ROUGH: almost a rotation.

    Parameters
    ----------
    target : shape (16,) or (3,)
        Pose, row by row, or position (m).
    aim : shape (AIM_SIZE,)
        Whose axes and weights are there already, and the identity.

    """
    size = arrays.size(target)
    wanted = arrays.numbers(target, 3 if size == 3 else 16)
    written = arrays.results(aim, places.AIM_SIZE)
    for k in range(size):
        if not math.isfinite(wanted[k]):
            return places.NOT_FINE
    if size == 3:
        for i in range(3):
            written[4 * i + 3] = wanted[i]
        return places.FINE
    for k in range(16):
        written[k] = wanted[k]
    off = _off(wanted)
    if off > NEARLY_ROTATION or wanted[15] != 1.0:
        return places.NOT_RIGID
    if wanted[12] != 0.0 or wanted[13] != 0.0 or wanted[14] != 0.0:
        return places.NOT_RIGID
    return places.FINE if off <= ROTATION else places.ROUGH
