"""Refinement: joint positions moved to where the tool misses its target least."""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats
from ..measures import symmetric
from .residuals import Residual

# A smaller error is round-off of forward kinematics, as a share of the length.
ROUND_OFF = 1e-15
# Where nothing is gained any more: so many steps that shrink the error by less than this share.
SLOW, SLOW_STEPS = 1e-3, 12
STIFFEST = 1e8


class Refinement:
    """
    Moves joint positions to where the tool misses its target least: Levenberg-Marquardt.

    Parameters
    ----------
    residual
        Of the target.
    scales : shape (n,)
        What a unit of each joint counts, as `Task.column_scales`, inverted; 0 holds a joint.
    limits : shape (n, 2), rad or m
        No joint leaves these; infinite where it may.
    damping
        At first, as a share of the largest column of J squared: 1e-3 from afar, 0 at a solution.
    steps
        Steps at most.
    """

    def __init__(
        self,
        residual: Residual,
        scales: Floats,
        limits: Floats,
        damping: float,
        steps: int,
    ) -> None:
        self.residual, self.damping, self.steps = residual, damping, steps
        n = self.residual.n
        self.scales, self.limits = arrays.numbers(scales, n), arrays.numbers(limits, 2 * n)
        self.A, self.L = arrays.rooms(n * n, n * n)
        self.g, self.step, self.trial = arrays.rooms(n, n, n)

    def refine_one(self, q: Flat) -> float:
        """Refine joint positions (n,) where they are, and return what is left: see `refine`."""
        square = self.residual.square(q, places.JACOBIAN)
        if square == places.INFINITY:
            return places.INFINITY
        length = self.residual.size()
        enough = (ROUND_OFF * length) * (ROUND_OFF * length)
        nearly = (1e-12 * length) * (1e-12 * length)
        damping, slow, fresh, size = self.damping, 0, True, 0.0
        for _ in range(self.steps):
            if square <= enough or slow >= SLOW_STEPS:
                break
            if fresh:
                size = self._linearise(q)
                fresh = False
            if size == 0.0:
                break
            if not symmetric.damped_step(
                self.residual.n, self.A, self.g, damping * size + 1e-18 * size, self.L, self.step
            ):
                damping = max(10.0 * damping, 1e-15)
                continue
            moved = self._try_step(q)
            if moved == 0.0:
                break
            new = self.residual.square(self.trial, places.JACOBIAN)
            if new < square:
                slow = slow + 1 if new > (1.0 - SLOW) * square else 0
                arrays.copy(q, self.residual.n, self.trial)
                square = new
                damping = min(0.1 * damping, square / (length * length))
                fresh = True
            else:
                # A refused step at the level of round-off is the end.
                if square <= nearly or damping > STIFFEST:
                    break
                damping = max(8.0 * damping, 1e-12)
                # The error is the refused one's now, but g and A are still those of q.
                slow += 1 if moved < 1e-13 else 0
        return math.sqrt(square)

    def _linearise(self, q: Flat) -> float:
        # Fills the normal equations A and g at q, which the residual was evaluated at last, and
        # returns the largest square of a column.
        n, A, g, limits = self.residual.n, self.A, self.g, self.limits
        columns, error = self.residual.columns, self.residual.error
        self.residual.write_columns(self.scales)
        size = 0.0
        for i in range(n):
            column = arrays.after(columns, 6 * i)
            g[i] = arrays.dot(column, error, 6)
            for j in range(i + 1):
                A[i * n + j] = arrays.dot(column, arrays.after(columns, 6 * j), 6)
            size = max(size, A[i * n + i])
        # A joint at its bound that would go on is held; the others go where that is best.
        for i in range(n):
            upper = q[i] >= limits[2 * i + 1] and g[i] > 0.0
            if upper or (q[i] <= limits[2 * i] and g[i] < 0.0):
                g[i] = 0.0
                for j in range(n):
                    A[i * n + j] = 0.0
                    A[j * n + i] = 0.0
                A[i * n + i] = size
        return size

    def _try_step(self, q: Flat) -> float:
        # Fills `trial` with q after the step, within the limits; the longest move of a joint.
        moved: float = 0.0
        for j in range(self.residual.n):
            value = q[j] + self.scales[j] * self.step[j]
            value = min(max(value, self.limits[2 * j]), self.limits[2 * j + 1])
            moved = max(moved, abs(value - q[j]))
            self.trial[j] = value
        return moved


def _refine_rows(refinement: Refinement, rows: int, q: Flat, errors: Flat) -> None:
    for k in range(rows):
        errors[k] = refinement.refine_one(arrays.after(q, k * refinement.residual.n))


def refine(refinement: Refinement, q: Floats, errors: Floats) -> None:
    """
    Move each row of q to where the tool misses its target least.

    Parameters
    ----------
    refinement
        Of the target.
    q : shape (N, n), rad or m
        Starts, overwritten.
    errors : shape (N,), m
        What is left: the norm of the weighted rows.
    """
    count = arrays.extent(q, 0)
    positions = arrays.results(q, count * refinement.residual.n)
    left = arrays.results(errors, count)
    lock = arrays.let_go()
    _refine_rows(refinement, count, positions, left)
    arrays.take_back(lock)
