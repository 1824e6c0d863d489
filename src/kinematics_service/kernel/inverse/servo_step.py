"""The servo of an arm, and a step of it: its results, and its scratch memory."""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats
from ..measures import singular_values
from ..measures.task_rows import TaskRows

# Round-off is no motion of a joint at rest at its limit.
AT_REST = 1e-12


class Servo:
    """
    Settings of a servo: how a twist of an arm's tool becomes joint velocities.

    Parameters
    ----------
    task
        The rows that count.
    damping, damped_below
        The largest damping, and the singular values it begins at, as shares of the length.
    length
        Length by which angles count, m.
    horizon
        No joint nears its limit faster than what is left of the way over this time, s.
    limits, fastest : shape (n, 2), (n,), rad or m, rad/s or m/s
        Limits of positions, infinite if there are none; of velocities, finite.
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
        """Return the largest velocity of joint j towards its upper limit."""
        return max((self.limits[2 * j + 1] - q[j]) / self.horizon, 0.0)

    def lower(self, q: Flat, j: int) -> float:
        """Return the least velocity of joint j, not above 0, towards its lower limit."""
        return min((self.limits[2 * j] - q[j]) / self.horizon, 0.0)


class ServoOutput:
    """
    The output of a servo's step: joint velocities, and the limits that shaped them.

    Parameters
    ----------
    servo
        The servo of the step.
    qdot : shape (n,), rad/s or m/s
        Joint velocities, to be written.

    Attributes
    ----------
    damping
        As a share of the largest.
    least_singular_value
        As a share of the length.
    followed
        The share of the twist, along itself, that velocities without limits would make.
    shortened
        The share to which all velocities were shortened for their limits.
    slowest
        The joint whose velocity limit asked for that, or -1.
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

    def begin(self) -> None:
        """Reset an earlier step: all joints are free, and none moves."""
        self.damping, self.least_singular_value, self.largest = 0.0, -1.0, 0.0
        self.followed = 1.0
        self.shortened, self.slowest, self.count = 1.0, -1, self.servo.n
        for j in range(self.servo.n):
            self.rates[j], self.held[j], self.u[j], self.free[j] = 0.0, 0, 0.0, j

    def is_held(self, j: int) -> bool:
        """Return whether a limit of its position decides the velocity of joint j."""
        return 0 <= j < self.servo.n and self.held[j] != 0

    def write_task(self, row: Flat, twist: Flat, size: float) -> None:
        """
        Fill J with the rows that count, and v with the twist by them, as a share of `size`.

        Everything is divided by the largest entry of J, so that no square overflows.
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
        Fill u with the damped least squares of J u = v over the joints that are free.

        Each singular value s below `below` has a damping of its own, damping^2 (1 - (s /
        below)^2) (Nakamura and Hanafusa 1986; Maciejewski and Klein 1988: directions that are not
        lost are not damped).
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
        made, wanted = 0.0, arrays.dot(self.v, self.v, m)
        for j in range(count):
            self.u[free[j]] = 0.0
        for i in range(rows):
            row = arrays.after(W, i * width)
            turns = arrays.after(row, length)
            square = 0.0
            if self.sigma[i] < below:
                share = self.sigma[i] / below
                square = damping * damping * (1.0 - share * share)
                if i < self.servo.task.generic_rank:
                    self.damping = max(self.damping, math.sqrt(square) / damping)
            along = 0.0
            for k in range(m):
                along += (turns[k] if wide else row[k]) * self.v[k]
            own = self.sigma[i] * self.sigma[i]
            made += along * along * (own if wide else 1.0) / (own + square)
            along /= own + square
            for j in range(count):
                self.u[free[j]] += along * (row[j] if wide else turns[j])
        if self.least_singular_value < 0.0:
            least = self.sigma[min(self.servo.task.generic_rank, rows) - 1]
            self.least_singular_value = least * (self.largest / self.servo.length)
            if wanted > 0.0:
                self.followed = made / wanted
        for k in range(count):
            j = free[k]
            self.u[j] *= self.servo.task.column_scale[j] / self.largest

    def _write_matrix(self, rows: int, length: int) -> None:
        # The free columns of J, or its rows, whichever are fewer, and the identity beside them.
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
        """Return the free joint that would run into a limit most, -1 if none does."""
        worst, over = -1, AT_REST
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
        Move the k-th free joint towards its limit at its largest velocity, and remove it from the
        free ones.
        """
        n, j = self.servo.n, self.free[k]
        upwards = self.rates[j] > 0.0
        self.held[j] = 1 if upwards else -1
        self.rates[j] = self.servo.upper(q, j) if upwards else self.servo.lower(q, j)
        self.count -= 1
        for i in range(k, self.count):
            self.free[i] = self.free[i + 1]
        done = self.rates[j] / self.servo.task.column_scale[j] * self.largest
        for i in range(self.servo.m):
            self.v[i] -= self.J[i * n + j] * done
