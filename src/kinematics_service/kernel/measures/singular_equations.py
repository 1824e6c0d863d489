"""What a pose must fulfil to be singular, linearised at another one."""

import math

from ..forward import chain_pass
from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Floats
from . import curvature, gradient, singular_values, singularity
from .task_rows import TaskRows

# A direction in which the equations change by less than this share of the most is none.
FLAT = 1e-5


class SingularEquations:
    """
    The equations of the singular poses near a pose, in motions d as `column_scales` counts them.

    Where J_t is singular its singular value s_k, k the generic rank, is zero: a' J_t B = 0 for its
    direction a and all others B that are lost with it or are idle anyway, one where J_t is square,
    more where a redundant arm has a null space: c + A d = 0 to first order, c = (s_k, 0, ...).

    `lines` are the directions that there are max(m, n) of, `turns` those that there are min(m, n)
    of: of the joints and of the tool for a redundant arm, otherwise of the tool and of the joints.

    Attributes
    ----------
    n, rank, count
        Joints, generic rank, and equations.
    """

    def __init__(self, chain: Chain, task: TaskRows) -> None:
        self.chain, self.task = chain, task
        n, m = chain.dof, task.count
        self.n, self.rank = n, task.generic_rank
        self.wide = n > m
        self.turns, self.length = min(m, n), max(m, n)
        self.width = self.turns + self.length
        self.count = self.length - self.rank + 1
        room = 2 * n + chain.frames_at + self.length * self.width + self.turns + 6 * n
        self.room = arrays.scratch(room + self.count * (2 * n + self.count + 2))
        self.q = self.room
        self.still = arrays.after(self.q, n)
        self.row = arrays.after(self.still, n)
        self.W = arrays.after(self.row, chain.frames_at)
        self.sigma = arrays.after(self.W, self.length * self.width)
        self.Y = arrays.after(self.sigma, self.turns)
        self.A = arrays.after(self.Y, 6 * n)
        self.turned = arrays.after(self.A, self.count * n)
        self.slopes = arrays.after(self.turned, self.count * (n + self.count))
        self.wanted = arrays.after(self.slopes, self.count)
        for j in range(n):
            self.still[j] = 0.0

    def __dealloc__(self) -> None:
        """Give the room back."""
        arrays.give_back(self.room)

    def move_to(self, origin: Floats, d: Floats) -> None:
        """Evaluate the pose a motion d away from `origin`, and decompose its J_t."""
        for j in range(self.n):
            self.q[j] = origin[j] + self.task.column_scale[j] * d[j]
        chain_pass.evaluate_row(self.chain, self.q, self.still, places.JACOBIAN, self.row)
        singularity.write_directions(self.n, self.task, self.row, self.W, self.sigma)
        self.complete()

    def take(self, row: Floats, W: Floats, sigma: Floats) -> None:
        """Stand at a pose that has been measured: its row, and what `measure_row` left in W."""
        for k in range(self.chain.frames_at):
            self.row[k] = row[k]
        for k in range(self.turns * self.width):
            self.W[k] = W[k]
        for k in range(self.turns):
            self.sigma[k] = sigma[k]
        self.complete()

    def complete(self) -> None:
        """Add the directions that belong to no singular value."""
        for i in range(self.turns, self.length):
            singular_values.write_orthogonal_row(self.W, i, self.length, self.width)

    def write_products(self, tool: Floats, joints: Floats) -> None:
        """
        Fill Y with the weights of J that `write_of_screws` takes for the form tool' J_t joints.
        """
        left = [0.0] * 6
        for i in range(6):
            left[i] = 0.0
        for i in range(self.task.count):
            left[self.task.axis[i]] = tool[i] * self.task.row_scale[i]
        singularity.to_base_axes(self.task, left)
        for j in range(self.n):
            right = joints[j] * self.task.column_scale[j]
            for i in range(6):
                self.Y[6 * j + i] = right * left[i]

    def write_form(self, turn: int, line: int) -> None:
        """Fill Y for the form of a turn and a line."""
        many = arrays.after(self.W, line * self.width)
        few = arrays.after(self.W, turn * self.width + self.length)
        if self.wide:
            self.write_products(few, many)
        else:
            self.write_products(many, few)

    def write_slope(self, turn: int, line: int, slope: Floats) -> None:
        """Fill the gradient (n,) of the form of a turn and a line, both of them held."""
        self.write_form(turn, line)
        screws = arrays.after(self.row, self.chain.screws_at)
        gradient.write_of_screws(self.chain, screws, self.Y, slope)
        for j in range(self.n):
            slope[j] *= self.task.column_scale[j]

    def linearise(self) -> None:
        """Fill A, and prepare it for `write_least`."""
        n, count, k = self.n, self.count, self.rank - 1
        width = n + count
        for i in range(count):
            self.write_slope(k, k + i, arrays.after(self.A, i * n))
        for i in range(count):
            for j in range(n):
                self.turned[i * width + j] = self.A[i * n + j]
            for j in range(count):
                self.turned[i * width + n + j] = 1.0 if i == j else 0.0
        singular_values.orthogonalise(self.turned, count, n, width)
        singular_values.sort_by_norm(self.turned, self.slopes, count, n, width)

    def write_least(self, d: Floats) -> float:
        """
        Fill the least motion d (n,) with A d = `wanted`, and return its length.

        Directions in which A hardly changes are left out.
        """
        n, count = self.n, self.count
        for j in range(n):
            d[j] = 0.0
        for i in range(count):
            slope = self.slopes[i]
            if not slope > FLAT * self.slopes[0] or not slope > 0.0:
                break
            row = arrays.after(self.turned, i * (n + count))
            share = 0.0
            for j in range(count):
                share += row[n + j] * self.wanted[j]
            share /= slope * slope
            for j in range(n):
                d[j] += share * row[j]
        return length_of(d, n)

    def write_step_onto(self, d: Floats) -> float:
        """Fill the least motion (n,) that fulfils the equations; infinite where none does."""
        for i in range(self.count):
            self.wanted[i] = 0.0
        self.wanted[0] = -self.sigma[self.rank - 1]
        length = self.write_least(d)
        return length if self.slopes[0] > 0.0 else places.INFINITY

    def are_fulfilled(self, d: Floats) -> bool:
        """
        Return whether a motion (n,) fulfils them but for less than half: more of them than joints
        that count are fulfilled by none.
        """
        squares = 0.0
        for i in range(self.count):
            left = self.sigma[self.rank - 1] if i == 0 else 0.0
            for j in range(self.n):
                left += self.A[i * self.n + j] * d[j]
            squares += left * left
        return math.sqrt(squares) < 0.5 * self.sigma[self.rank - 1]

    def write_nearest(self, away: Floats, d: Floats) -> float:
        """
        Fill the least motion d (n,) from where this pose is `away`, to where they are fulfilled.

        Returns its length.
        """
        for i in range(self.count):
            along = 0.0
            for j in range(self.n):
                along += self.A[i * self.n + j] * away[j]
            self.wanted[i] = along
        self.wanted[0] -= self.sigma[self.rank - 1]
        return self.write_least(d)

    def write_second_order(self, g: Floats, b: Floats, c: Floats, H: Floats) -> None:
        """
        Fill gradient g and Hessian H of the signed s_k, with what the larger ones take of it.

        It is the Schur complement of the larger ones in J_t between its directions (b, c: room).
        """
        n, k = self.n, self.rank - 1
        self.write_slope(k, k, g)
        curvature.write_curvature(self.chain, self.row, self.Y, H)
        scale = self.task.column_scale
        for i in range(n):
            for j in range(n):
                H[i * n + j] *= scale[i] * scale[j]
        for r in range(k):
            if not self.sigma[r] > places.RANK_TOLERANCE * self.sigma[0]:
                break
            self.write_slope(r, k, b)
            self.write_slope(k, r, c)
            share = 1.0 / self.sigma[r]
            for i in range(n):
                for j in range(n):
                    H[i * n + j] -= (b[i] * c[j] + c[i] * b[j]) * share


def length_of(d: Floats, n: int) -> float:
    """Return the length of a motion d (n,)."""
    squares = 0.0
    for j in range(n):
        squares += d[j] * d[j]
    return math.sqrt(squares)
