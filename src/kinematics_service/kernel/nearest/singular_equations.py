"""What a pose must fulfil to be singular, linearised at another one."""

import math

from ..forward import chain_pass
from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat
from ..measures import singular_values, singularity
from ..measures.task_rows import TaskRows
from . import jacobian_changes

# A direction in which the equations change by less than this share of the most is none.
FLAT = 1e-5
# Poses at which two turns are compared, and the sine between them below which they are one.
POSES, SAME = 4, 1e-12
# Of a lost turn a share that is more than round-off.
TAKES_PART = 1e-6


class SingularEquations:
    """
    The equations of the singular poses near a pose, in motions d as `column_scales` counts them.

    Where J_t is singular its singular value s_k, k the generic rank, is zero: a' J_t B = 0 for its
    direction a and all others B that are lost with it or are idle anyway, one where J_t is square,
    more where a redundant arm has a null space: c + A d = 0 to first order, c = (s_k, 0, ...).

    Where no direction is lost everywhere, a and B are not those of singular values: elimination of
    all turns but one, by the largest pivots, leaves y and X for which y' J_t and J_t X are zero in
    all but the turn and the lines that are left. There c = 0 where J_t is singular, and changes by
    y' dJ_t X exactly (Griewank and Reddien, 1984). That costs much less than a decomposition.

    `lines` are the directions that there are max(m, n) of, `turns` those that there are min(m, n)
    of: of the joints and of the tool for a redundant arm, otherwise of the tool and of the joints.

    Attributes
    ----------
    n, rank, count
        Joints, generic rank, and equations.
    smallest, largest
        At least the singular value s_k, and at most the largest.
    """

    def __init__(self, chain: Chain, task: TaskRows) -> None:
        self.chain, self.task = chain, task
        n, m = self.chain.dof, self.task.count
        self.n, self.rank, self.wide = n, task.generic_rank, n > m
        self.turns: int = min(m, n)
        self.length: int = max(m, n)
        self.left_out = self.task.column_scale  # not read before `leave_out`
        self.width, self.count = self.turns + self.length, self.length - self.rank + 1
        self.smallest, self.largest, self.kept, self.first = 0.0, 0.0, 0, 0
        count, cells = self.count, self.turns * self.length
        self.q, self.still, self.row = arrays.rooms(n, n, self.chain.frames_at)
        self.W, self.sigma = arrays.rooms(self.length * self.width, self.turns)
        self.motion, self.weights, self.changes = arrays.rooms(n, 6, 6 * self.chain.entries)
        self.A, self.turned = arrays.rooms(count * n, count * (n + count))
        self.slopes, self.wanted, self.c = arrays.rooms(count, count, count)
        self.axes, self.M, self.B = arrays.rooms(3 * m, cells, cells)
        self.order, self.rows = arrays.whole_rooms(self.length, self.turns)
        (self.keeps,) = arrays.whole_rooms(self.turns)
        arrays.fill(self.still, n, 0.0)
        self._write_axes()
        self._keep_turns()

    def move_to(self, origin: Flat, d: Flat) -> None:
        """Evaluate the pose a motion d away from `origin`, and find the directions of its J_t."""
        for j in range(self.n):
            self.q[j] = origin[j] + self.task.column_scale[j] * d[j]
        chain_pass.write_jacobian(self.chain, self.q, self.row)
        self._write_scaled()
        if not (self.rank == self.kept and self._find_directions()):
            singularity.write_directions(self.n, self.task, self.row, self.W, self.sigma)
            self.complete()

    def _write_axes(self) -> None:
        # What the task's rows take of half a column of J.
        for i in range(self.task.count):
            axis = self.task.axis[i] if self.task.axis[i] < 3 else self.task.axis[i] - 3
            for k in range(3):
                along = self.task.rotation[3 * k + axis]
                self.axes[3 * i + k] = along * self.task.row_scale[i]

    def _keep_turns(self) -> None:
        # The turns that are eliminated: without one whose line in J_t is that of one before it at
        # each of some poses, as of two joints about one axis. What is left is as singular.
        self.kept = 0
        for r in range(self.turns):
            if self.wide or self.rank == self.turns or not self._follows(r):
                self.keeps[self.kept] = r
                self.kept += 1

    def leave_out(self, turns: Flat) -> bool:
        """
        Leave out the poses at which some turns alone, those (n,) above zero, are singular.

        They are eliminated before the others, which are singular besides them elsewhere. Returns
        False where there are none, or too few others: then none are left out.
        """
        first = 0
        for r in range(self.kept):
            first += 1 if turns[self.keeps[r]] > 0.0 else 0
        possible = first < self.rank and not self.wide
        self.first, self.left_out = first if possible else 0, turns
        return self.first > 0

    def mark_lost(self, turns: Flat) -> None:
        """Add 1 to each of the turns that take part in what is lost where they stand."""
        lost = arrays.after(self.W, (self.rank - 1) * self.width + self.length)
        for r in range(self.turns):
            if abs(lost[r]) > TAKES_PART:
                turns[r] += 1.0

    def _follows(self, turn: int) -> bool:
        # Whether a turn is a multiple of one that is kept, everywhere.
        for k in range(self.kept):
            same = True
            for pose in range(POSES):
                for j in range(self.n):
                    self.q[j] = (pose + 1.0) * (0.3 + 0.7 * j) * self.task.column_scale[j]
                chain_pass.write_jacobian(self.chain, self.q, self.row)
                self._write_scaled()
                same = same and self._sine_between(turn, self.keeps[k]) < SAME
            if same:
                return True
        return False

    def _sine_between(self, turn: int, other: int) -> float:
        # Of the directions of two turns in J_t.
        a, b = arrays.after(self.M, turn * self.length), arrays.after(self.M, other * self.length)
        squares, along = arrays.dot(b, b, self.length), arrays.dot(a, b, self.length)
        crossed = 0.0
        for i in range(self.length):
            left = a[i] - (along / squares * b[i] if squares > 0.0 else 0.0)
            crossed += left * left
        whole = length_of(a, self.length)
        return math.sqrt(crossed) / whole if whole > 0.0 else 1.0

    def _write_scaled(self) -> None:
        # J_t, its turns as rows of M, and how large it is.
        n, length, M, scale = self.n, self.length, self.M, self.task.column_scale
        squares = 0.0
        for i in range(self.task.count):
            axis = arrays.after(self.axes, 3 * i)
            half = 3 * n if self.task.axis[i] > 2 else 0
            x = arrays.after(self.row, places.JACOBIAN_AT + half)
            into = arrays.after(M, i * length if self.wide else i)
            step = 1 if self.wide else length
            for j in range(n):
                along = axis[0] * x[j] + axis[1] * x[n + j] + axis[2] * x[2 * n + j]
                along *= scale[j]
                squares += along * along
                into[step * j] = along
        self.largest = math.sqrt(squares / self.turns)

    def _find_directions(self) -> bool:
        # By elimination: the turn that those eliminated leave nothing of but in the lines left,
        # and for each of these the line that moves no eliminated turn. False without a pivot.
        if not self._eliminate():
            return False
        norm = self._write_lost(arrays.after(self.W, (self.rank - 1) * self.width + self.length))
        last, squares = self.rows[self.rank - 1] * self.length, 0.0
        for i in range(self.count):
            self.c[i] = self.B[last + self.order[self.rank - 1 + i]] / norm
            squares += self.c[i] * self.c[i]
            if not self._write_idle(i):
                return False
        self.smallest = math.sqrt(squares)
        return True

    def _eliminate(self) -> bool:
        # All turns but one, each by the largest pivot that is left, those that are left out first;
        # B holds the factors, rows and order say where each stands. False without a pivot.
        kept, length, M, order, rows = self.kept, self.length, self.B, self.order, self.rows
        arrays.copy(M, self.turns * length, self.M)
        for i in range(length):
            order[i] = i
        pivot, row, column = 0.0, 0, 0
        for r in range(kept):
            rows[r] = self.keeps[r]
            one = arrays.after(M, rows[r] * length)
            for i in range(length):
                if abs(one[i]) > pivot and self._may_be_next(0, r):
                    pivot, row, column = abs(one[i]), r, i
        for step in range(self.rank - 1):
            if not pivot > 0.0:
                return False
            rows[step], rows[row] = rows[row], rows[step]
            order[step], order[column] = order[column], order[step]
            chosen = arrays.after(M, rows[step] * length)
            inverse = 1.0 / chosen[order[step]]
            pivot, row, column = 0.0, step + 1, step + 1
            for r in range(step + 1, kept):
                one = arrays.after(M, rows[r] * length)
                factor = one[order[step]] * inverse
                one[order[step]] = factor
                for i in range(step + 1, length):
                    left = one[order[i]] - factor * chosen[order[i]]
                    one[order[i]] = left
                    if abs(left) > pivot and self._may_be_next(step + 1, r):
                        pivot, row, column = abs(left), r, i
        return True

    def _may_be_next(self, step: int, r: int) -> bool:
        # Whether a row may be eliminated in a step.
        return step >= self.first or self.left_out[self.rows[r]] > 0.0

    def _write_lost(self, lost: Flat) -> float:
        # The turn that the eliminated ones leave nothing of, of length 1; returns what it was.
        turns, length, M, order, rows = self.turns, self.length, self.B, self.order, self.rows
        first = self.rank - 1
        arrays.fill(lost, turns, 0.0)
        for r in range(first, -1, -1):
            share = 1.0 if r == first else 0.0
            for s in range(r + 1, self.kept):
                share -= M[rows[s] * length + order[r]] * lost[rows[s]]
            lost[rows[r]] = share
        norm = length_of(lost, turns)
        for r in range(turns):
            lost[r] /= norm
        return norm

    def _write_idle(self, i: int) -> bool:
        # The line that moves the eliminated turns in none, with the i-th of the others at 1; then
        # orthogonal to those before it, of length 1, and c with it. False where it is not finite.
        length, M, order, rows = self.length, self.B, self.order, self.rows
        first = self.rank - 1
        x = arrays.after(self.W, (first + i) * self.width)
        for k in range(length - 1, -1, -1):
            if k > first - 1:
                x[order[k]] = 1.0 if k == first + i else 0.0
                continue
            value = 0.0
            for m in range(k + 1, length):
                value -= M[rows[k] * length + order[m]] * x[order[m]]
            x[order[k]] = value / M[rows[k] * length + order[k]]
        for p in range(i):
            before = arrays.after(self.W, (first + p) * self.width)
            along = arrays.dot(x, before, length)
            for k in range(length):
                x[k] -= along * before[k]
            self.c[i] -= along * self.c[p]
        norm = length_of(x, length)
        if not norm > 0.0:
            return False
        for k in range(length):
            x[k] /= norm
        self.c[i] /= norm
        return True

    def take(self, row: Flat, W: Flat, sigma: Flat) -> None:
        """Stand at a pose that has been measured: its row, and what `measure_row` left in W."""
        arrays.copy(self.row, self.chain.frames_at, row)
        arrays.copy(self.W, self.turns * self.width, W)
        arrays.copy(self.sigma, self.turns, sigma)
        self.complete()

    def complete(self) -> None:
        """Add the directions that belong to no singular value, and fill c."""
        for i in range(self.turns, self.length):
            singular_values.write_orthogonal_row(self.W, i, self.length, self.width)
        arrays.fill(self.c, self.count, 0.0)
        self.c[0] = self.sigma[self.rank - 1]
        self.smallest, self.largest = self.c[0], self.sigma[0]

    def are_singular(self, share: float) -> bool:
        """Return whether s_k is below a share of the largest singular value."""
        return self.smallest < share * self.largest

    def hold_joints(self, direction: int) -> None:
        """Hold the joints' motion of a direction of J_t, and how the tool changes along it."""
        joints = arrays.after(self.W, direction * self.width + (0 if self.wide else self.length))
        for j in range(self.n):
            self.motion[j] = joints[j] * self.task.column_scale[j]
        jacobian_changes.write_changes(self.chain, self.row, self.motion, self.changes)

    def hold_tool(self, direction: int) -> None:
        """Hold the tool's motion of a direction of J_t, in base axes."""
        tool = arrays.after(self.W, direction * self.width + (self.length if self.wide else 0))
        arrays.fill(self.weights, 6, 0.0)
        for i in range(self.task.count):
            self.weights[self.task.axis[i]] = tool[i] * self.task.row_scale[i]
        singularity.to_base_axes(self.task, self.weights)

    def write_slope_held(self, slope: Flat) -> None:
        """Fill the gradient (n,) of J_t between the directions held."""
        jacobian_changes.write_slope(self.chain, self.changes, self.weights, slope)
        for j in range(self.n):
            slope[j] *= self.task.column_scale[j]

    def write_slope(self, turn: int, line: int, slope: Flat) -> None:
        """Fill the gradient (n,) of the form of a turn and a line, both of them held."""
        self.hold_joints(line if self.wide else turn)
        self.hold_tool(turn if self.wide else line)
        self.write_slope_held(slope)

    def write_curvature_held(self, H: Flat) -> None:
        """Fill the second derivative (n, n) of J_t between the directions held."""
        n, scale = self.n, self.task.column_scale
        jacobian_changes.write_curvature(
            self.chain, self.row, self.motion, self.changes, self.weights, H
        )
        for i in range(n):
            for j in range(n):
                H[i * n + j] *= scale[i] * scale[j]

    def linearise(self) -> None:
        """Fill A, and prepare it for `write_least`."""
        n, count, k = self.n, self.count, self.rank - 1
        width = n + count
        if not self.wide:
            self.hold_joints(k)
        for i in range(count):
            if self.wide:
                self.write_slope(k, k + i, arrays.after(self.A, i * n))
            else:
                self.hold_tool(k + i)
                self.write_slope_held(arrays.after(self.A, i * n))
        for i in range(count):
            arrays.copy(arrays.after(self.turned, i * width), n, arrays.after(self.A, i * n))
            for j in range(count):
                self.turned[i * width + n + j] = 1.0 if i == j else 0.0
        if count == 1:
            self.slopes[0] = length_of(self.A, n)
            return
        singular_values.orthogonalise(self.turned, count, n, width, 1)
        singular_values.sort_by_norm(self.turned, self.slopes, count, n, width, 1)

    def write_normals(self, normals: Flat) -> None:
        """Fill the unit normals (count, n) of the singular poses, zero where there is none."""
        n, count = self.n, self.count
        for i in range(count):
            slope = self.slopes[i]
            sees = slope > FLAT * self.slopes[0] and slope > 0.0
            for j in range(n):
                along = self.turned[i * (n + count) + j]
                normals[i * n + j] = along / slope if sees else 0.0

    def write_least(self, d: Flat) -> float:
        """
        Fill the least motion d (n,) with A d = `wanted`, and return its length.

        Directions in which A hardly changes are left out.
        """
        n, count = self.n, self.count
        arrays.fill(d, n, 0.0)
        for i in range(count):
            slope = self.slopes[i]
            if not slope > FLAT * self.slopes[0] or not slope > 0.0:
                break
            row = arrays.after(self.turned, i * (n + count))
            share = arrays.dot(arrays.after(row, n), self.wanted, count) / (slope * slope)
            for j in range(n):
                d[j] += share * row[j]
        return length_of(d, n)

    def write_step_onto(self, d: Flat) -> float:
        """Fill the least motion (n,) that fulfils the equations; infinite where none does."""
        for i in range(self.count):
            self.wanted[i] = -self.c[i]
        length = self.write_least(d)
        return length if self.slopes[0] > 0.0 else places.INFINITY

    def step_of(self, joint: int) -> float:
        """Return the motion of one joint that fulfils them best."""
        along, squares = 0.0, 0.0
        for i in range(self.count):
            slope = self.A[i * self.n + joint]
            along, squares = along + slope * self.c[i], squares + slope * slope
        return -along / squares if squares > 0.0 else places.INFINITY

    def are_fulfilled(self, d: Flat) -> bool:
        """
        Return whether a motion (n,) fulfils them but for less than half: more of them than joints
        that count are fulfilled by none.
        """
        squares = 0.0
        for i in range(self.count):
            left = self.c[i]
            for j in range(self.n):
                left += self.A[i * self.n + j] * d[j]
            squares += left * left
        return math.sqrt(squares) < 0.5 * length_of(self.c, self.count)

    def write_nearest(self, away: Flat, d: Flat) -> float:
        """
        Fill the least motion d (n,) from where this pose is `away`, to where they are fulfilled.

        Returns its length.
        """
        for i in range(self.count):
            along = arrays.dot(arrays.after(self.A, i * self.n), away, self.n)
            self.wanted[i] = along - self.c[i]
        return self.write_least(d)


def length_of(d: Flat, n: int) -> float:
    """Return the length of a motion d (n,)."""
    return math.sqrt(arrays.dot(d, d, n))


def apart(a: Flat, b: Flat, n: int) -> float:
    """Return how far two motions (n,) are from each other."""
    squares = 0.0
    for j in range(n):
        squares += (a[j] - b[j]) * (a[j] - b[j])
    return math.sqrt(squares)


def wrapped(value: float, period: float) -> float:
    """Return a value in the half-open period around zero."""
    if not period < places.INFINITY:
        return value
    return value - period * math.floor(value / period + 0.5)
