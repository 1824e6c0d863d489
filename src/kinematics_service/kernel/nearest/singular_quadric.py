"""The singular poses near a pose to second order: a quadric, and its point that is nearest."""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat
from ..measures import factors, symmetric
from ..measures.factors import Tape
from ..measures.task_rows import TaskRows
from . import singular_equations
from .singular_equations import SingularEquations

# Steps to a multiplier, and how near to its bound it comes as a share of the largest curvature;
# what it may leave of f, as a share: where two sheets meet a search depends on it.
STEPS, BOUND, EXACT = 40, 1e-9, 1e-12
# Steps of the secant method, and what it may leave of f, as a share.
SECANTS, MET = 8, 1e-6
# Of the differences that a factor's curvature is found by, rad.
DIFFERENCE = 1e-5


class SingularQuadric:
    """
    The determinant of J_t between the directions of its two least singular values, or a factor of
    it, as a quadric.

    Of a motion x from the pose that is asked for it is f + g.x + x'Kx, and zero where J_t is
    singular. Neither where two sheets of singular poses meet or just miss each other, nor where a
    singular value has a double zero, does the first order of the least singular value say where
    they are; the quadric does.

    Parameters
    ----------
    n
        Joints.
    """

    def __init__(self, n: int) -> None:
        self.n, self.m, self.f, self.rise, self.steep, self.diagonal = n, n, 0.0, 0.0, 0, False
        count, cells = self.n, self.n * self.n
        self.g, self.along, self.b, self.x = arrays.rooms(count, count, count, count)
        self.K, self.Z, self.of_all, self.step = arrays.rooms(cells, cells, count, count)
        # The joints that count: those that do not would be most of the work.
        (self.joints,) = arrays.whole_rooms(count)

    def _count(self, counts: Flat) -> None:
        # Those of n joints that are above zero.
        self.m, self.diagonal = 0, False
        for j in range(self.n):
            if counts[j] > 0.0:
                self.joints[self.m] = j
                self.m += 1

    def stand_at(self, equations: SingularEquations, counts: Flat) -> None:
        """
        Take the second order of equations that are decomposed.

        `counts` (n,) is above zero for joints that they depend on.
        """
        k = equations.rank - 1
        self._count(counts)
        n, m = self.n, self.m
        second = equations.sigma[k - 1] if k > 0 else 1.0
        self.f = second * equations.sigma[k]
        # What the least singular value is changed by, with what the other directions take of it.
        # The slopes between its joints and the tool's other directions wait in Z.
        equations.hold_joints(k)
        equations.hold_tool(k)
        equations.write_curvature_held(self.Z)
        for i in range(m):
            for j in range(m):
                self.K[i * m + j] = 0.5 * second * self.Z[self.joints[i] * n + self.joints[j]]
        self._write_slope(equations, self.g)
        for r in range(k):
            equations.hold_tool(r)
            self._write_slope(equations, arrays.after(self.Z, r * m))
        equations.hold_tool(k)
        for r in range(k):
            equations.hold_joints(r)
            self._write_slope(equations, self.b)
            # The second direction itself is not divided by its singular value.
            share = 1.0 if r == k - 1 else second / equations.sigma[r]
            self._add_product(-share, self.b, arrays.after(self.Z, r * m))
        if k == 0:
            return
        equations.hold_tool(k - 1)
        self._write_slope(equations, self.b)
        self._add_product(1.0, self.b, self.g)
        for i in range(m):
            self.g[i] = second * self.g[i] + equations.sigma[k] * self.b[i]

    def _write_slope(self, equations: SingularEquations, slope: Flat) -> None:
        equations.write_slope_held(self.of_all)
        for i in range(self.m):
            slope[i] = self.of_all[self.joints[i]]

    def stand_at_factor(
        self, tape: Tape, f: int, task: TaskRows, q: Flat, counts: Flat, work: Flat
    ) -> None:
        """
        Take the second order of a factor at q (n,): K by differences of its slope.

        `counts` (n,) is above zero for joints that it depends on; `work` is room for the tape.
        """
        scale = task.column_scale
        self._count(counts)
        n, m = self.n, self.m
        factors.run_factor(tape, f, n, q, work)
        step = arrays.after(work, tape.ends[f] * (n + 1))
        sign = 1.0 if step[n] >= 0.0 else -1.0
        self.f = sign * step[n]
        for i in range(m):
            self.g[i] = sign * step[self.joints[i]] * scale[self.joints[i]]
        arrays.fill(self.K, m * m, 0.0)
        for i in range(m):
            joint = self.joints[i]
            held = q[joint]
            q[joint] = held + DIFFERENCE * scale[joint]
            factors.run_factor(tape, f, n, q, work)
            q[joint] = held
            for j in range(m):
                change = sign * step[self.joints[j]] * scale[self.joints[j]] - self.g[j]
                self.K[i * m + j] += 0.25 * change / DIFFERENCE
                self.K[j * m + i] += 0.25 * change / DIFFERENCE

    def bend(self, length: float) -> float:
        """Return by what share of itself the slope changes within a length, at most."""
        slope = singular_equations.length_of(self.g, self.m)
        size = singular_equations.length_of(self.K, self.m * self.m)
        return 2.0 * size * length / slope if slope > 0.0 else places.INFINITY

    def _add_product(self, factor: float, b: Flat, c: Flat) -> None:
        # Of two forms.
        m = self.m
        for i in range(m):
            for j in range(m):
                self.K[i * m + j] += 0.5 * factor * (b[i] * c[j] + c[i] * b[j])

    def _diagonalise(self) -> None:
        # Brings K to its axes, once.
        n = self.m
        if self.diagonal:
            return
        self.diagonal = True
        symmetric.diagonalise(self.K, self.Z, n, symmetric.NEGLIGIBLE)
        self.steep = 0
        for i in range(n):
            self.along[i] = arrays.dot(arrays.after(self.Z, i * n), self.g, n)
            if self.K[i * n + i] < self.K[self.steep * n + self.steep]:
                self.steep = i

    def write_nearest(self, other: bool, x: Flat) -> float:
        """
        Fill the least motion x (n,) to the quadric, and return its length: infinite without one.

        `other`: the one that is nearest on the other side of it.
        """
        arrays.fill(x, self.n, 0.0)
        n = self.m
        if not other and self._meets(self.step):
            for i in range(n):
                x[self.joints[i]] = self.step[i]
            return singular_equations.length_of(self.step, n)
        self._diagonalise()
        e = self.steep
        largest: float = 0.0
        for i in range(n):
            largest = max(largest, abs(self.K[i * n + i]))
        steepest = self.K[e * n + e]
        slope = singular_equations.length_of(self.along, n)
        low: float = max(-steepest, 0.0) + BOUND * largest
        # The multiplier's: the larger, the less x is, and the more of f is left.
        high: float = low + 2.0 * largest + (slope * slope / self.f if self.f > 0.0 else 0.0)
        left = self._left(low)
        if left < 0.0:
            left = self._meet(low, high)
        if steepest < 0.0:
            # Where nothing slopes towards the steepest direction both ways along it lead there.
            root = math.sqrt(self.x[e] * self.x[e] + max(left, 0.0) / -steepest)
            self.x[e] = root if self.x[e] >= 0.0 else -root
            if other:
                self.x[e] = -self.along[e] / steepest - self.x[e]
        elif other or left > 0.1 * self.f:
            return places.INFINITY
        for j in range(n):
            for i in range(n):
                x[self.joints[j]] += self.x[i] * self.Z[i * n + j]
        return singular_equations.length_of(self.x, n)

    def _meets(self, x: Flat) -> bool:
        # Fills the least motion where no direction is needed in which nothing slopes: the secant
        # method for the inverse of the multiplier, in which what is left of f is nearly linear.
        n = self.m
        slope = singular_equations.length_of(self.g, n)
        before, left_before = 0.0, self.f
        inverse: float = 2.0 * self.f / (slope * slope) if slope > 0.0 else 0.0
        for _ in range(SECANTS):
            if not 0.0 < inverse < places.INFINITY:
                return False
            if not symmetric.damped_step(n, self.K, self.g, 1.0 / inverse, self.Z, x):
                return False
            left, squares = self.f, 0.0
            for j in range(n):
                x[j] *= -0.5
                left += 0.5 * self.g[j] * x[j]
                squares += x[j] * x[j]
            left -= squares / inverse
            if abs(left) < MET * self.f:
                return True
            change = (inverse - before) / (left - left_before)
            before, left_before = inverse, left
            inverse -= change * left
        return False

    def _meet(self, low: float, high: float) -> float:
        # Fills x for the multiplier between two that leaves nothing of f: Newton's method, halfway
        # where it leads out of them; returns what is left.
        multiplier, left = high, self.f
        for _ in range(STEPS):
            left = self._left(multiplier)
            if abs(left) < EXACT * self.f:
                break
            if left < 0.0:
                low = multiplier
            else:
                high = multiplier
            multiplier -= left / self.rise
            if not low < multiplier < high:
                multiplier = 0.5 * (low + high)
        return left

    def _left(self, multiplier: float) -> float:
        # Fills x for a multiplier, and how fast what is left of f there rises; returns that.
        n, left, rise = self.m, self.f, 0.0
        for i in range(n):
            curved = self.K[i * n + i]
            x = -0.5 * self.along[i] / (multiplier + curved) if self.along[i] != 0.0 else 0.0
            left += (self.along[i] + curved * x) * x
            rise += x * x / (multiplier + curved) if x != 0.0 else 0.0
            self.x[i] = x
        self.rise = 2.0 * multiplier * rise
        return left
