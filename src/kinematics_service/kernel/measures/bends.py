"""How J_t bends at a pose: its second derivative between directions of singular values."""

import math

from ..forward import vectors
from ..forward.chain import Chain
from ..layout import arrays
from ..layout.arrays import Floats, Integers, Vector
from . import singularity
from .norms import Norms
from .singular_equations import SingularEquations
from .task_rows import TaskRows


class Bends:
    """
    The second derivative of the scaled J_t along the joints that count, and room for it.

    It is kept for each pair of these joints, `turns` rows of `length` numbers, as
    `SingularEquations` has J_t.

    Parameters
    ----------
    chain, task
        The arm.
    moving
        The joints that count, from 0.
    known
        Whether there is room: with many joints it would be large.
    """

    def __init__(self, chain: Chain, task: TaskRows, moving: Integers, known: bool) -> None:
        n, m, d = chain.dof, task.count, arrays.size(moving)
        self.chain, self.task, self.count = chain, task, d
        self.wide = n > m
        self.turns, self.length = min(m, n), max(m, n)
        self.pairs = d * (d + 1) // 2
        few, pairs = 0, 0
        if known:
            few, pairs = self.turns, self.pairs
        self.norms = Norms(max(few, d, 1), max(few * few * d * d, few * few * pairs, 1))
        self.room = arrays.scratch(n + pairs * (m * n + few * few))
        self.place = arrays.as_whole(self.room)
        self.K = arrays.after(self.room, n)
        self.F = arrays.after(self.K, pairs * m * n)
        for j in range(n):
            self.place[j] = -1
        for j in range(d):
            self.place[moving[j]] = j

    def __dealloc__(self) -> None:
        """Give the room back."""
        arrays.give_back(self.room)

    def write(self, row: Floats) -> None:
        """
        Fill the second derivative at an evaluated row.

        Of three entries in the order of the chain, a, b, c, the tool's velocity changes by
        w_a x (w_b x v_c), whichever of them is the column; the axis of a column by
        w_a x (w_b x w_i), where a and b are before it.
        """
        entries, joint = self.chain.entries, self.chain.joint
        v = arrays.after(row, self.chain.screws_at)
        w = arrays.after(v, 3 * entries)
        for k in range(self.pairs * self.turns * self.length):
            self.K[k] = 0.0
        for f in range(entries):
            for g in range(f, entries):
                a, b = self.place[joint[f]], self.place[joint[g]]
                if a < 0 or b < 0:
                    continue
                # Two entries of one joint count in both orders.
                share = 2.0 if a == b and f != g else 1.0
                share *= self.task.column_scale[joint[f]]
                share *= self.task.column_scale[joint[g]]
                wf, wg = vectors.apart(w, f, entries), vectors.apart(w, g, entries)
                for i in range(entries):
                    first, last = min(f, i), max(g, i)
                    moved = vectors.cross(
                        vectors.apart(w, f + g + i - first - last, entries),
                        vectors.apart(v, last, entries),
                    )
                    moved = vectors.cross(vectors.apart(w, first, entries), moved)
                    turned = (0.0, 0.0, 0.0)
                    if g < i:
                        turned = vectors.apart(w, i, entries)
                        turned = vectors.cross(wf, vectors.cross(wg, turned))
                    self._add(self._pair(a, b), joint[i], share, moved, turned)

    def _pair(self, a: int, b: int) -> int:
        low, high = min(a, b), max(a, b)
        return low * self.count - low * (low - 1) // 2 + high - low

    def _add(self, pair: int, i: int, share: float, moved: Vector, turned: Vector) -> None:
        # A change of column i of J, in base axes, by a pair of joints.
        share *= self.task.column_scale[i]
        K = arrays.after(self.K, pair * self.turns * self.length)
        for r in range(self.task.count):
            value = share * singularity.task_component(self.task, r, moved, turned)
            K[r * self.length + i if self.wide else i * self.length + r] += value

    def of_block(self, equations: SingularEquations, count: int) -> float:
        """Return a bound of the bend between the larger `count` directions, in units of theirs."""
        for a in range(count):
            for b in range(count):
                self._write_form(equations, a, b, a * count + b, True)
        return self._norm(count, count)

    def of_turns(self, equations: SingularEquations, count: int) -> float:
        """Return a bound of the bend between the larger directions and the lost line."""
        for a in range(count):
            self._write_form(equations, a, count, a, False)
        return self._norm(count, 1)

    def of_lines(self, equations: SingularEquations, count: int) -> float:
        """Return a bound of the bend between the lost turn and the larger directions."""
        for a in range(count):
            self._write_form(equations, count, a, a, False)
        return self._norm(count, 1)

    def _write_form(
        self, equations: SingularEquations, turn: int, line: int, at: int, both: bool
    ) -> None:
        # F[at]: for each pair of joints, the bend between a turn and a line, over the roots of
        # the larger singular values of the two.
        few = arrays.after(equations.W, turn * equations.width + self.length)
        many = arrays.after(equations.W, line * equations.width)
        share = equations.sigma[min(turn, line)]
        if both:
            share *= equations.sigma[max(turn, line)]
        for pair in range(self.pairs):
            K = arrays.after(self.K, pair * self.turns * self.length)
            value = 0.0
            for r in range(self.turns):
                along = 0.0
                for i in range(self.length):
                    along += K[r * self.length + i] * many[i]
                value += few[r] * along
            self.F[at * self.pairs + pair] = value / math.sqrt(share)

    def _norm(self, outer: int, inner: int) -> float:
        # At least the longest F[d, d] with |d| = 1, as a matrix (outer, inner): the least of the
        # flattenings.
        d, pairs, W = self.count, self.pairs, self.norms.W
        root = math.sqrt(2.0)
        for a in range(d):
            for b in range(d):
                pair = self._pair(a, b)
                for k in range(outer * inner):
                    W[(a * d + b) * outer * inner + k] = self.F[k * pairs + pair]
        least = self.norms.norm(d, d * outer * inner)
        for turned in range(2 if inner > 1 else 1):
            for k in range(outer):
                for p in range(inner):
                    F = arrays.after(self.F, (k * inner + p) * pairs)
                    at = (p * outer + k if turned else k * inner + p) * pairs
                    for a in range(d):
                        for b in range(a, d):
                            pair = self._pair(a, b)
                            W[at + pair] = F[pair] if a == b else root * F[pair]
            if turned:
                least = min(least, self.norms.norm(inner, outer * pairs))
            else:
                least = min(least, self.norms.norm(outer, inner * pairs))
        return least
