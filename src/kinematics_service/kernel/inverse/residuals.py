# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the error between the tool's pose and a target, with a weight for each component, and the
Jacobian of the error.

The angular error is the rotation vector from tool to target (logarithm of SO(3)). If the target
gives a direction of a tool axis instead of a rotation, the angular error is the shortest rotation
between two directions. To first order the derivative of the angular error is the angular part of
the geometric Jacobian.
"""

import math

from ..forward import vectors
from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Numbers, Vector
from ..loops import closed_pass

# `Residual.size` returns the length, m, by which relative tolerances are multiplied. The products
# are the tolerances of the weighted error, m. The length is the largest weight of an angular
# component, but at least this ratio times the reach of the arm.
MIN_LENGTH_RATIO = 1e-3
# If the sine of a rotation angle is below this, the angle is near 0 or near pi. No vector is then
# divided by the sine, because the relative error of the sine would be large.
MIN_SINE = 1e-9


def _rotation_vector(R: Numbers) -> Vector:
    # Returns the rotation vector, axis times angle in rad, of the rotation matrix R of nine
    # numbers.
    x, y, z = R[7] - R[5], R[2] - R[6], R[3] - R[1]
    sine = math.sqrt(x * x + y * y + z * z)
    cosine = R[0] + R[4] + R[8] - 1.0
    angle = math.atan2(sine, cosine)
    if sine > MIN_SINE:
        scale = angle / sine
        return (x * scale, y * scale, z * scale)
    if cosine > 0.0:
        return (0.5 * x, 0.5 * y, 0.5 * z)
    # If the rotation angle is pi, each column of R + I is parallel to the axis. Take the longest
    # column, which has the least round-off.
    if R[0] >= R[4] and R[0] >= R[8]:
        a, b, c = R[0] + 1.0, R[3], R[6]
    elif R[4] >= R[8]:
        a, b, c = R[1], R[4] + 1.0, R[7]
    else:
        a, b, c = R[2], R[5], R[8] + 1.0
    scale = angle / math.sqrt(a * a + b * b + c * c)
    return (a * scale, b * scale, c * scale)


def _turn_between(a: Vector, b: Vector) -> Vector:
    # Returns the shortest rotation of the unit vector a onto the unit vector b, as axis times
    # angle, rad.
    normal = vectors.cross(a, b)
    sine = math.sqrt(vectors.dot(normal, normal))
    angle = math.atan2(sine, vectors.dot(a, b))
    if sine < MIN_SINE:
        if angle < 1.0:
            return normal
        # If the angle between a and b is pi, take any axis perpendicular to a.
        normal = vectors.across(a)
        sine = math.sqrt(vectors.dot(normal, normal))
    scale = angle / sine
    return (normal[0] * scale, normal[1] * scale, normal[2] * scale)


def _turned_back(axes: Flat, v: Vector) -> Vector:
    return (
        axes[0] * v[0] + axes[3] * v[1] + axes[6] * v[2],
        axes[1] * v[0] + axes[4] * v[1] + axes[7] * v[2],
        axes[2] * v[0] + axes[5] * v[1] + axes[8] * v[2],
    )


def _write_weighted(
    weights: Flat, scale: float, linear: Vector, angular: Vector, six: Numbers
) -> None:
    six[0] = scale * weights[0] * linear[0]
    six[1] = scale * weights[1] * linear[1]
    six[2] = scale * weights[2] * linear[2]
    six[3] = scale * weights[3] * angular[0]
    six[4] = scale * weights[4] * angular[1]
    six[5] = scale * weights[5] * angular[2]


class Residual:
    """
    Computes the weighted error of the tool against a target, and its Jacobian. Only one caller may
    use it at a time.

    Parameters
    ----------
    chain
        The chain of the arm.
    pose : shape (4, 4)
        The target in the base frame, m. If the target is a position, its rotation is not used.
    axes : shape (3, 3)
        Rotation matrix. Its columns are the axes x, y and z, in the base frame, along which the
        error has its components.
    weights : shape (6,)
        Weights of the components x y z rx ry rz of the error: 1 for linear components, a length
        (m) for angular components, 0 for components without a target.
    tool_axis
        0, 1 or 2: the angular components are the error of the direction of this tool axis, and the
        tool may turn about the axis. -1: they are the error of the whole rotation.
    reach
        Reach of the arm, m.
    """

    def __init__(
        self,
        chain: Chain,
        pose: Floats,
        axes: Floats,
        weights: Floats,
        tool_axis: int,
        reach: float,
    ) -> None:
        if not -1 <= tool_axis <= 2:
            raise TypeError('a tool has three axes')
        self.chain, self.tool_axis, self.reach = chain, tool_axis, reach
        self.pose, self.axes = arrays.numbers(pose, 16), arrays.numbers(axes, 9)
        self.weights = arrays.numbers(weights, 6)
        self.n = self.chain.dof
        self.still = arrays.numbers(self.chain.at_rest, self.n)
        self.error, self.columns = arrays.rooms(6, 6 * self.n)
        (self.row,) = arrays.rooms(self.chain.frames_at)

    def evaluate(self, q: Flat, depth: int) -> bool:
        """
        Fill `row` with the results of forward kinematics at q (n,), up to `depth`.

        If a loop does not close, return False and leave `row` unchanged.
        """
        total = closed_pass.evaluate_row(self.chain, q, self.still, depth, self.row)
        return self.chain.loops == 0 or math.isfinite(total)

    def square(self, q: Flat, depth: int) -> float:
        """
        Fill `error` (6,) with the weighted error at q (n,), and return the sum of the squared
        errors.

        The sum is infinite if a loop does not close.
        """
        if not self.evaluate(q, depth):
            return places.INFINITY
        goal, row, error = self.pose, self.row, self.error
        linear = _turned_back(self.axes, (goal[3] - row[3], goal[7] - row[7], goal[11] - row[11]))
        angular = (0.0, 0.0, 0.0)
        k = self.tool_axis
        if k >= 0:
            turn = _turn_between(
                (row[k], row[4 + k], row[8 + k]), (goal[k], goal[4 + k], goal[8 + k])
            )
            angular = _turned_back(self.axes, turn)
        elif self.weights[3] + self.weights[4] + self.weights[5] > 0.0:
            R = [0.0] * 9
            for i in range(3):
                for j in range(3):
                    R[3 * i + j] = (
                        goal[4 * i] * row[4 * j]
                        + goal[4 * i + 1] * row[4 * j + 1]
                        + goal[4 * i + 2] * row[4 * j + 2]
                    )
            angular = _turned_back(self.axes, _rotation_vector(R))
        _write_weighted(self.weights, 1.0, linear, angular, error)
        square = 0.0
        for i in range(3):
            square += error[i] * error[i] + error[3 + i] * error[3 + i]
        return square

    def write_columns(self, scales: Flat) -> None:
        """
        Fill `columns` (n, 6) with the weighted columns of J, with components along `axes`.

        Each row of J is multiplied by the weight of the same component of the error. Column j is
        multiplied by scales[j]. The scale 0 means that joint j must not move.
        """
        n, k = self.n, self.tool_axis
        for j in range(n):
            J = arrays.after(self.row, places.JACOBIAN_AT + j)
            linear = _turned_back(self.axes, (J[0], J[n], J[2 * n]))
            turn: Vector = (J[3 * n], J[4 * n], J[5 * n])
            if k >= 0:
                # Subtract the rotation about the tool axis, because it does not change the
                # direction of this axis.
                axis = (self.row[k], self.row[4 + k], self.row[8 + k])
                turn = vectors.plus(turn, -vectors.dot(turn, axis), axis)
            angular = _turned_back(self.axes, turn)
            _write_weighted(
                self.weights, scales[j], linear, angular, arrays.after(self.columns, 6 * j)
            )

    def length(self) -> float:
        """Return the largest weight of an angular component of the error, m; 0 if all are 0."""
        return max(self.weights[3], self.weights[4], self.weights[5])

    def size(self) -> float:
        """
        Return the length, m, by which relative tolerances are multiplied.

        The products are the tolerances of the weighted error, m.
        """
        return max(self.length(), MIN_LENGTH_RATIO * self.reach)


def parts_of_error(residual: Residual, q: Floats) -> tuple[float, float]:
    """
    Return the linear error, m, and the angular error, rad, of the tool at joint positions q (n,).
    """
    residual.square(arrays.numbers(q, residual.n), places.POSE)
    error, length = residual.error, residual.length()
    turn = arrays.after(error, 3)
    angular, linear = math.sqrt(arrays.dot(turn, turn, 3)), math.sqrt(arrays.dot(error, error, 3))
    largest: float = max(abs(error[0]), abs(error[1]), abs(error[2]))
    # If the sum of squares overflowed, as for errors beyond 1e154 m, divide the linear error by
    # its largest component before squaring.
    if linear == places.INFINITY and largest < places.INFINITY:
        x, y, z = error[0] / largest, error[1] / largest, error[2] / largest
        linear = largest * math.sqrt(x * x + y * y + z * z)
    return linear, angular / length if length > 0.0 else 0.0


def linearise(
    residual: Residual, scales: Floats, q: Floats, error: Floats, columns: Floats
) -> None:
    """
    Fill `error` (6,) with the weighted error at q (n,). Fill `columns` (n, 6) with the columns of
    the Jacobian of this error, where column j is multiplied by scales[j].

    All six errors are infinite if a loop does not close.
    """
    n = residual.n
    errors, slopes = arrays.results(error, 6), arrays.results(columns, 6 * n)
    square = residual.square(arrays.numbers(q, n), places.JACOBIAN)
    residual.write_columns(arrays.numbers(scales, n))
    for k in range(6):
        errors[k] = residual.error[k] if square < places.INFINITY else places.INFINITY
    arrays.copy(slopes, 6 * n, residual.columns)
