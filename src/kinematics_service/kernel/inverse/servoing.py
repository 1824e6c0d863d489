"""A step of the servo: joint velocities for a wanted twist of the tool."""

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats
from .servo_step import ServoOutput

# A faster twist (m/s, rad/s) has the same result as a slower one of its direction.
FASTEST = 1e9


def _shorten_alike(step: ServoOutput, size: float) -> None:
    # Shortens all velocities alike, so that the tool keeps its direction.
    rate = min(size, FASTEST)
    for j in range(step.servo.n):
        if abs(step.u[j]) * rate > step.servo.fastest[j]:
            rate = step.servo.fastest[j] / abs(step.u[j])
            step.slowest = j
    if size > 0.0:
        step.shortened = rate / size
    for j in range(step.servo.n):
        step.rates[j] = rate * step.u[j]
    for i in range(step.servo.m):
        step.v[i] *= rate


def _hold_back(step: ServoOutput, q: Flat) -> None:
    # Holds joints back that would run into their limits, while the others compensate.
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
    # Velocities that became too fast by this are shortened, all alike.
    share = 1.0
    for j in range(step.servo.n):
        if abs(step.rates[j]) * share > step.servo.fastest[j]:
            share = step.servo.fastest[j] / abs(step.rates[j])
            step.slowest = j
    step.shortened *= share
    for j in range(step.servo.n):
        upper, lower = step.servo.upper(q, j), step.servo.lower(q, j)
        step.rates[j] = min(max(step.rates[j] * share, lower), upper)


def servo(step: ServoOutput, q: Floats, row: Floats, twist: Floats) -> None:
    """
    Fill a step with joint velocities for a twist, as far as the arm allows.

    Parameters
    ----------
    step
        Of the arm's servo.
    q, row : shape (n,), (width,)
        Joint positions, and the row `evaluate` filled of them.
    twist : shape (6,), m/s and rad/s
        In base axes, at the tool's origin.
    """
    n, size = step.servo.n, 0.0
    positions, wanted = arrays.numbers(q, n), arrays.numbers(twist, 6)
    step.begin()
    for i in range(6):
        size = max(size, abs(wanted[i]))
    step.write_task(arrays.numbers(row, places.JACOBIAN_AT + 6 * n), wanted, size)
    if not step.largest > 0.0:
        step.damping, step.least_singular_value = 1.0, 0.0
        step.followed = 0.0 if size > 0.0 else 1.0
        return
    step.solve()
    _shorten_alike(step, size)
    _hold_back(step, positions)
    _keep_to_limits(step, positions)
