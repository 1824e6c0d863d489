# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute joint velocities that move the tool with a given twist: damped least squares within the
joint limits.

Resolved-rate control (Whitney 1969) uses the singular value decomposition of J and damps each
singular value separately (Nakamura and Hanafusa 1986; Maciejewski and Klein 1988). If a joint
exceeds its velocity limit, all joint velocities are multiplied by one factor. If a joint would run
into a position limit, its velocity is reduced to the largest value that keeps the limit, and the
other joints compensate (saturation in the null space: Flacco, De Luca and Khatib 2012).
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats
from ..measures import singular_values
from ..measures.task_rows import TaskRows

# A joint velocity may exceed its bound, `Servo.upper` or `Servo.lower`, by this much, because a
# smaller excess is round-off. Unit rad/s; the velocity of a prismatic joint is divided by the
# characteristic length.
REST_VELOCITY = 1e-12
# Largest entry of a twist, m/s or rad/s. A larger twist is scaled down to this value. The scaled
# twist still needs joint velocities above the velocity limits. The joint velocities are then
# reduced to the limits, so the result is the same as without the scaling.
MAX_TWIST = 1e9


class Servo:
    """
    Settings of resolved-rate control: the task, the damping and the joint limits.

    Parameters
    ----------
    task
        The rows of the twist that the servo follows.
    damping, damped_below
        Largest damping, and largest singular value that is damped, both divided by `length`.
    length
        Characteristic length, m.
    horizon
        A time, s. The velocity of a joint towards a position limit is at most the distance from
        the limit divided by this time.
    limits : shape (n, 2), rad or m
        Limits of positions; infinite for a joint without limits.
    fastest : shape (n,), rad/s or m/s
        Limits of velocities, finite.
    """

    def __init__(
        self,
        task: TaskRows,
        damping: float,
        damped_below: float,
        length: float,
        horizon: float,
        limits: Floats,
        fastest: Floats,
    ) -> None:
        self.task, self.length, self.horizon = task, length, horizon
        self.damping, self.damped_below = damping, damped_below
        self.m, self.n = self.task.count, self.task.joints
        self.limits = arrays.numbers(limits, 2 * self.n)
        self.fastest = arrays.numbers(fastest, self.n)

    def upper(self, q: Flat, j: int) -> float:
        """
        Return the largest allowed velocity of joint j towards its upper limit at q, rad/s or m/s.
        """
        return max((self.limits[2 * j + 1] - q[j]) / self.horizon, 0.0)

    def lower(self, q: Flat, j: int) -> float:
        """
        Return the lowest allowed velocity of joint j at q, towards its lower limit, <= 0, rad/s or
        m/s.
        """
        return min((self.limits[2 * j] - q[j]) / self.horizon, 0.0)


class ServoOutput:
    """
    The joint velocities of one step of the servo, and the limits that changed the velocities.

    Parameters
    ----------
    servo
        The servo.
    qdot : shape (n,), rad/s or m/s
        Array that the joint velocities are written to.

    Attributes
    ----------
    damping
        Damping of the singular value that is damped most, divided by `Servo.damping`, the upper
        limit of the damping.
    least_singular_value
        Least singular value of J, divided by the characteristic length `Servo.length`.
    followed
        Component of the tool's twist along the wanted twist, divided by the size of the wanted
        twist. It is computed before the joint limits are applied.
    shortened
        Factor, at most 1, by which velocity limits multiplied all velocities.
    slowest
        Index of the joint whose velocity limit gave `shortened`, or -1.
    """

    def __init__(self, servo: Servo, qdot: Floats) -> None:
        self.servo, self.qdot = servo, qdot
        m, n = self.servo.m, self.servo.n
        least = min(m, n)
        self.rates = arrays.results(qdot, n)
        self.damping, self.least_singular_value, self.followed = 0.0, -1.0, 1.0
        self.shortened, self.slowest, self.largest, self.count = 1.0, -1, 0.0, self.servo.n
        self.J, self.v, self.u = arrays.rooms(m * n, m, n)
        self.sigma, self.W = arrays.rooms(least, least * (m + n))
        self.free, self.held = arrays.whole_rooms(n, n)
        # Start with all joints free.
        for j in range(n):
            self.rates[j], self.held[j], self.u[j], self.free[j] = 0.0, 0, 0.0, j

    def is_held(self, j: int) -> bool:
        """Return whether joint j is held because of its position limit."""
        return 0 <= j < self.servo.n and self.held[j] != 0

    def write_task(self, row: Flat, twist: Flat, size: float) -> None:
        """
        Fill J (m, n) with the scaled task Jacobian: the rows of the Jacobian that the task uses.
        Fill v (m,) with the scaled components of the twist in the same rows, divided by `size`.

        J is then divided by its largest entry, so that no square overflows.
        """
        n, axes = self.servo.n, self.servo.task.rotation
        for i in range(self.servo.m):
            axis = self.servo.task.axis[i]
            first = 3 if axis >= 3 else 0
            component = axis - first
            jacobian = arrays.after(row, places.JACOBIAN_AT + first * n)
            x, y, z = axes[component], axes[3 + component], axes[6 + component]
            weight = self.servo.task.row_scale[i]
            self.v[i] = 0.0
            if size > 0.0:
                a, b, c = twist[first] / size, twist[first + 1] / size, twist[first + 2] / size
                self.v[i] = weight * (x * a + y * b + z * c)
            for j in range(n):
                value = x * jacobian[j] + y * jacobian[n + j] + z * jacobian[2 * n + j]
                self.J[i * n + j] = weight * self.servo.task.column_scale[j] * value
                self.largest = max(self.largest, abs(self.J[i * n + j]))
        if self.largest > 0.0:
            for i in range(self.servo.m * n):
                self.J[i] /= self.largest

    def solve(self) -> None:
        """
        Fill u with the joint velocities that solve J u = v by damped least squares. Only the free
        joints move, those not held at a position limit.

        If a singular value s is less than `damped_below`, its squared damping is damping^2 (1 - (s
        / damped_below)^2). Larger singular values are not damped.
        """
        m, count, W, free = self.servo.m, self.count, self.W, self.free
        damping = self.servo.damping * self.servo.length / self.largest
        below = self.servo.damped_below * self.servo.length / self.largest
        wide = count > m
        rows, length = (m if wide else count), (count if wide else m)
        width = rows + length
        self._write_matrix(rows, length)
        singular_values.orthogonalise(W, rows, length, length + rows, 1)
        singular_values.sort_by_norm(W, self.sigma, rows, length, length + rows, 1)
        made, commanded = 0.0, arrays.dot(self.v, self.v, m)
        for j in range(count):
            self.u[free[j]] = 0.0
        for i in range(rows):
            row = arrays.after(W, i * width)
            turns = arrays.after(row, length)
            square = 0.0
            if self.sigma[i] < below:
                ratio = self.sigma[i] / below
                square = damping * damping * (1.0 - ratio * ratio)
                if i < self.servo.task.generic_rank:
                    self.damping = max(self.damping, math.sqrt(square) / damping)
            along = 0.0
            for k in range(m):
                along += (turns[k] if wide else row[k]) * self.v[k]
            eigenvalue = self.sigma[i] * self.sigma[i]
            made += along * along * (eigenvalue if wide else 1.0) / (eigenvalue + square)
            along /= eigenvalue + square
            for j in range(count):
                self.u[free[j]] += along * (row[j] if wide else turns[j])
        if self.least_singular_value < 0.0:
            least = self.sigma[min(self.servo.task.generic_rank, rows) - 1]
            self.least_singular_value = least * (self.largest / self.servo.length)
            if commanded > 0.0:
                self.followed = made / commanded
        for k in range(count):
            j = free[k]
            self.u[j] *= self.servo.task.column_scale[j] / self.largest

    def _write_matrix(self, rows: int, length: int) -> None:
        # Fills W with a matrix A, and to the right of A the identity matrix. Let J_f be the matrix
        # of the columns of J that belong to free joints. A is J_f if J_f has more columns than
        # rows, otherwise A is the transpose of J_f. The Jacobi rotations later turn the identity
        # matrix into singular vectors.
        n, width = self.servo.n, rows + length
        wide = self.count > self.servo.m
        for i in range(self.servo.m):
            for j in range(self.count):
                at = i * width + j if wide else j * width + i
                self.W[at] = self.J[i * n + self.free[j]]
        for i in range(rows):
            arrays.fill(arrays.after(self.W, i * width + length), rows, 0.0)
            self.W[i * width + length + i] = 1.0

    def worst(self, q: Flat) -> int:
        """
        Return the index in `free` of the joint whose velocity exceeds its bound most; -1 if no
        velocity exceeds its bound.
        """
        worst, over = -1, REST_VELOCITY
        for k in range(self.count):
            j = self.free[k]
            upper, lower = self.servo.upper(q, j), self.servo.lower(q, j)
            beyond = (
                max(self.rates[j] - upper, lower - self.rates[j]) / self.servo.task.column_scale[j]
            )
            if beyond > over:
                worst, over = k, beyond
        return worst

    def hold(self, k: int, q: Flat) -> None:
        """
        Set joint free[k] to the largest velocity that its position limit allows, and remove it
        from the free joints. Subtract the twist that this joint produces from the twist that the
        free joints must produce.
        """
        n, j = self.servo.n, self.free[k]
        upwards = self.rates[j] > 0.0
        self.held[j] = 1 if upwards else -1
        self.rates[j] = self.servo.upper(q, j) if upwards else self.servo.lower(q, j)
        self.count -= 1
        for i in range(k, self.count):
            self.free[i] = self.free[i + 1]
        motion = self.rates[j] / self.servo.task.column_scale[j] * self.largest
        for i in range(self.servo.m):
            self.v[i] -= self.J[i * n + j] * motion


def _within_limits(step: ServoOutput, rates: Flat, factor: float) -> float:
    # Returns the largest number, at most `factor`, by which all joint velocities can be multiplied
    # without exceeding a velocity limit.
    for j in range(step.servo.n):
        if abs(rates[j]) * factor > step.servo.fastest[j]:
            factor = step.servo.fastest[j] / abs(rates[j])
            step.slowest = j
    return factor


def _shorten_alike(step: ServoOutput, size: float) -> None:
    # Multiplies all joint velocities by one factor, so that the tool's twist keeps its direction
    # and no velocity limit is exceeded.
    rate = _within_limits(step, step.u, min(size, MAX_TWIST))
    if size > 0.0:
        step.shortened = rate / size
    for j in range(step.servo.n):
        step.rates[j] = rate * step.u[j]
    for i in range(step.servo.m):
        step.v[i] *= rate


def _hold_joints(step: ServoOutput, q: Flat) -> None:
    # Holds joints that would run into a position limit, one by one, and solves the least squares
    # problem again, so that the other joints compensate.
    for _ in range(step.servo.n):
        worst = step.worst(q)
        if worst < 0:
            return
        step.hold(worst, q)
        if step.count == 0:
            return
        step.solve()
        for k in range(step.count):
            step.rates[step.free[k]] = step.u[step.free[k]]


def _keep_to_limits(step: ServoOutput, q: Flat) -> None:
    # Reduces all joint velocities by one factor if a velocity exceeds its limit. `_shorten_alike`
    # has already done so. But then `_hold_joints` has slowed down joints near position limits, and
    # the other joints have become faster to compensate.
    factor = _within_limits(step, step.rates, 1.0)
    step.shortened *= factor
    for j in range(step.servo.n):
        upper, lower = step.servo.upper(q, j), step.servo.lower(q, j)
        step.rates[j] = min(max(step.rates[j] * factor, lower), upper)


def servo(step: ServoOutput, q: Floats, row: Floats, twist: Floats) -> None:
    """
    Compute joint velocities at q for a twist of the tool, and write them to `step`.

    Parameters
    ----------
    step
        A new `ServoOutput`; it receives the results.
    q, row : shape (n,), (width,)
        Joint positions, and the row of results that `evaluate` filled at these positions.
    twist : shape (6,), m/s and rad/s
        Twist in base axes, at the origin of the tool.
    """
    n, size = step.servo.n, 0.0
    positions, commanded = arrays.numbers(q, n), arrays.numbers(twist, 6)
    for i in range(6):
        size = max(size, abs(commanded[i]))
    step.write_task(arrays.numbers(row, places.JACOBIAN_AT + 6 * n), commanded, size)
    if not step.largest > 0.0:
        step.damping, step.least_singular_value = 1.0, 0.0
        step.followed = 0.0 if size > 0.0 else 1.0
        return
    step.solve()
    _shorten_alike(step, size)
    _hold_joints(step, positions)
    _keep_to_limits(step, positions)
