"""
A radius around a pose in which no pose is singular, proved.

J_t is brought into the bases of its singular values. Between the directions of the larger ones it
stays invertible as long as bounds of its change say so; then it has full rank where the Schur
complement of that block is not zero, whose change is known to second order, and bounded beyond.
All the changes that enter are those of the pose to second order, and bounded beyond.
"""

import math

from ..forward import chain_pass, vectors
from ..layout import arrays, places
from ..layout.arrays import Floats, Integers, Vector
from . import singular_equations, singularity, symmetric
from .arm import Arm
from .bends import Bends
from .norms import Norms
from .singular_equations import SingularEquations

# Halvings of the radius, and of the multiplier of a minimum, which proves with any.
HALVINGS, MULTIPLIER_HALVINGS = 32, 20
# Of lines that are lost or idle, so many from that with the least slope for its size to the last.
LINES, NEXT_LINE = 4, 1.0 / 3.0
# A pose is singular where a singular value is below this share of the largest, as for the search:
# lengths that are rounded leave one that is not zero.
SINGULAR = 1e-7
# No denominator of a minimum is smaller.
TINY = 1e-14


class Clearance:
    """
    What is known of an arm's J_t at every pose, and room to prove that no pose nearby is singular.

    Parameters
    ----------
    arm
        The arm.
    moving : the joints that can change the rank of J_t
        Counted from 0.
    point : shape (3,), m
        The point whose velocity is taken, in the axes of the tool and from its origin: where all
        rows of J count, the rank is the same for each.
    bend, twist
        Bounds of the second and third derivatives of the scaled J_t along a unit motion of
        the joints that count; infinite where they are not known.
    """

    def __init__(
        self, arm: Arm, moving: Integers, point: Floats, bend: float, twist: float
    ) -> None:
        arrays.given(arm)
        if arm.chain.loops > 0:
            raise TypeError('the bounds of a clearance do not know closed loops')
        if moving.min(initial=0) < 0 or moving.max(initial=-1) >= arm.chain.dof:
            raise TypeError('a joint that counts is none')
        self.arm = arm
        self.equations = SingularEquations(arm.chain, arm.task)
        self._arrays = moving, point
        self.count = arrays.size(moving)
        self.moving = arrays.whole(moving, self.count)
        self.point = arrays.numbers(point, 3)
        self.bend, self.twist, self.singular = bend, twist, 0.0
        self.bends = Bends(arm.chain, arm.task, moving, twist < places.INFINITY)
        self.complement, self.gradient, self.second = 0.0, 0.0, 0.0
        self.by_block, self.by_turns, self.by_lines = 0.0, 0.0, 0.0
        self.bend_of_block, self.bend_of_turns, self.bend_of_lines = 0.0, 0.0, 0.0
        n, m, d = arm.chain.dof, arm.task.count, self.count
        few, many, tensor, lines = min(m, n), max(m, n), d * m * n, self.equations.count
        self.norms = Norms(max(many, d), max(tensor, few * max(few, 1) * d))
        room = 3 * n + n * n + 2 * d + 2 * d * d + 2 * few * d + tensor + d * few * few
        self.room = arrays.scratch(room + lines * (2 * lines + d + many + 3))
        self.slope = self.room
        self.b = arrays.after(self.slope, n)
        self.c = arrays.after(self.b, n)
        self.H = arrays.after(self.c, n)
        self.g = arrays.after(self.H, n * n)
        self.turned = arrays.after(self.g, d)
        self.Q = arrays.after(self.turned, d)
        self.Z = arrays.after(self.Q, d * d)
        self.B = arrays.after(self.Z, d * d)
        self.C = arrays.after(self.B, few * d)
        self.D = arrays.after(self.C, few * d)
        self.P = arrays.after(self.D, tensor)
        self.lines = arrays.after(self.P, d * few * few)
        self.best = arrays.after(self.lines, lines * many)
        self.shares = arrays.after(self.best, lines)
        self.A = arrays.after(self.shares, lines)

    def __dealloc__(self) -> None:
        """Give the room back."""
        arrays.give_back(self.room)

    def radius(self, q: Floats) -> float:
        """Return the radius around q (n,) within which no pose is singular, rad."""
        k = self.arm.task.generic_rank
        self._stand_at(q)
        sigma = self.equations.sigma
        smallest, self.singular = sigma[k - 1], SINGULAR * sigma[0]
        if not smallest > self.singular:
            return 0.0
        self._write_changes()
        change = self._tensor_norm(self.D, self.arm.task.count, self.arm.chain.dof)
        radius = self._by_change(smallest, change)
        if k == 1 or not self.bend < places.INFINITY:
            return radius
        self._write_block()
        self._choose_line()
        for turn in range(LINES if self.equations.count > 1 else 1):
            self._take_line(max(0.0, 1.0 - NEXT_LINE * turn))
            radius = self._by_complement(radius)
        return radius

    def _stand_at(self, q: Floats) -> None:
        # Evaluates q, takes the velocities of the point, and decomposes J_t.
        n = self.arm.chain.dof
        for j in range(n):
            self.equations.q[j] = q[j]
        row = self.equations.row
        chain_pass.evaluate_row(
            self.arm.chain, self.equations.q, self.equations.still, places.JACOBIAN, row
        )
        px, py, pz = self.point[0], self.point[1], self.point[2]
        x = row[0] * px + row[1] * py + row[2] * pz
        y = row[4] * px + row[5] * py + row[6] * pz
        z = row[8] * px + row[9] * py + row[10] * pz
        entries = self.arm.chain.entries
        v = arrays.after(row, self.arm.chain.screws_at)
        w = arrays.after(v, 3 * entries)
        for e in range(entries):
            wx, wy, wz = w[e], w[e + entries], w[e + 2 * entries]
            v[e] += wy * z - wz * y
            v[e + entries] += wz * x - wx * z
            v[e + 2 * entries] += wx * y - wy * x
        if self.arm.chain.form == places.MIXED:
            chain_pass.add_up_screws(self.arm.chain, v, row)
        singularity.write_directions(n, self.arm.task, row, self.equations.W, self.equations.sigma)
        self.equations.complete()

    def _write_changes(self) -> None:
        # D[j] = dJ_t/du_j, scaled, of each joint that counts: what `write_of_screws` says.
        n, m, entries = self.arm.chain.dof, self.arm.task.count, self.arm.chain.entries
        v = arrays.after(self.equations.row, self.arm.chain.screws_at)
        w = arrays.after(v, 3 * entries)
        for k in range(self.count * m * n):
            self.D[k] = 0.0
        for j in range(self.count):
            for f in range(entries):
                if self.arm.chain.joint[f] != self.moving[j]:
                    continue
                for e in range(entries):
                    moved = vectors.cross(
                        vectors.apart(w, min(e, f), entries), vectors.apart(v, max(e, f), entries)
                    )
                    turned = (0.0, 0.0, 0.0)
                    if f < e:
                        turned = vectors.cross(
                            vectors.apart(w, f, entries), vectors.apart(w, e, entries)
                        )
                    self._add_change(j, self.arm.chain.joint[e], moved, turned)

    def _add_change(self, j: int, i: int, moved: Vector, turned: Vector) -> None:
        # A change of column i of J by joint `moving[j]`, in base axes.
        n, m = self.arm.chain.dof, self.arm.task.count
        scale = self.arm.task.column_scale[i] * self.arm.task.column_scale[self.moving[j]]
        for r in range(m):
            value = singularity.task_component(self.arm.task, r, moved, turned)
            self.D[(j * m + r) * n + i] += value * scale

    def _matrix_norm(self, M: Floats, count: int, length: int) -> float:
        few, many = min(count, length), max(count, length)
        for r in range(count):
            for i in range(length):
                self.norms.W[r * length + i if count == few else i * count + r] = M[r * length + i]
        return self.norms.norm(few, many)

    def _tensor_norm(self, T: Floats, rows: int, columns: int) -> float:
        # At least the largest |sum d_j T_j| with |d| = 1: the least of its three flattenings.
        d = self.count
        if d == 0:
            return 0.0
        least = self._matrix_norm(T, d, rows * columns)
        for j in range(d):
            for r in range(rows):
                for i in range(columns):
                    self.norms.W[(i * d + j) * rows + r] = T[(j * rows + r) * columns + i]
        least = min(least, self.norms.norm(columns, d * rows))
        for j in range(d):
            for r in range(rows):
                for i in range(columns):
                    self.norms.W[(r * d + j) * columns + i] = T[(j * rows + r) * columns + i]
        return min(least, self.norms.norm(rows, d * columns))

    def _by_change(self, smallest: float, change: float) -> float:
        # Weyl: no singular value falls faster than J_t changes.
        good, bad = 0.0, places.LARGEST_CLEARANCE
        for _ in range(HALVINGS):
            r = 0.5 * (good + bad)
            if smallest - change * r - 0.5 * self.bend * r * r > self.singular:
                good = r
            else:
                bad = r
        return good

    def _choose_line(self) -> None:
        # Keeps the lines that are lost or idle, and the shares of them in the one whose singular
        # value has the least slope for its size.
        d, count, k = self.count, self.equations.count, self.arm.task.generic_rank - 1
        length, width = self.equations.length, self.equations.width
        for i in range(count):
            line = arrays.after(self.equations.W, (k + i) * width)
            for p in range(length):
                self.lines[i * length + p] = line[p]
            self.best[i] = 1.0 if i == 0 else 0.0
        if count == 1:
            return
        gram = arrays.after(self.A, count * d)
        factor = arrays.after(gram, count * count)
        for i in range(count):
            self.equations.write_slope(k, k + i, self.slope)
            for j in range(d):
                self.A[i * d + j] = self.slope[self.moving[j]]
            self.shares[i] = self.best[i]
        trace = 0.0
        for i in range(count):
            for p in range(count):
                value = 0.0
                for j in range(d):
                    value += self.A[i * d + j] * self.A[p * d + j]
                gram[i * count + p] = value
            trace += gram[i * count + i]
        if not symmetric.damped_step(
            count, gram, self.shares, 1e-9 * trace, factor, self.best
        ) or not unit(self.best, count):
            for i in range(count):
                self.best[i] = 1.0 if i == 0 else 0.0

    def _take_line(self, share: float) -> None:
        # Makes the line of the least singular value one between the last and the best.
        count, k = self.equations.count, self.arm.task.generic_rank - 1
        length = self.equations.length
        for i in range(count):
            self.shares[i] = share * self.best[i]
        self.shares[0] += 1.0 - share
        unit(self.shares, count)
        line = arrays.after(self.equations.W, k * self.equations.width)
        for p in range(length):
            value = 0.0
            for i in range(count):
                value += self.shares[i] * self.lines[i * length + p]
            line[p] = value
        self.complement = self.shares[0] * self.equations.sigma[k]

    def _write_complement(self) -> None:
        # Gradient g and Hessian Q of the Schur complement, and its factors B and C, over the
        # joints that count.
        n, d, k = self.arm.chain.dof, self.count, self.arm.task.generic_rank - 1
        self.equations.write_second_order(self.slope, self.b, self.c, self.H)
        for i in range(d):
            self.g[i] = self.slope[self.moving[i]]
            for j in range(d):
                self.Q[i * d + j] = self.H[self.moving[i] * n + self.moving[j]]
        for r in range(k):
            share = 1.0 / math.sqrt(self.equations.sigma[r])
            self.equations.write_slope(r, k, self.b)
            self.equations.write_slope(k, r, self.c)
            for j in range(d):
                self.B[r * d + j] = share * self.b[self.moving[j]]
                self.C[r * d + j] = share * self.c[self.moving[j]]

    def _write_block(self) -> None:
        # P[j]: the change of the block of the larger singular values, in units of their own.
        n, m, k = self.arm.chain.dof, self.arm.task.count, self.arm.task.generic_rank - 1
        width, length = self.equations.width, self.equations.length
        for a in range(k):
            for b in range(k):
                tool = arrays.after(self.equations.W, a * width)
                joints = arrays.after(self.equations.W, b * width)
                if self.equations.wide:
                    tool = arrays.after(tool, length)
                else:
                    joints = arrays.after(joints, length)
                share = 1.0 / math.sqrt(self.equations.sigma[a] * self.equations.sigma[b])
                for j in range(self.count):
                    change = arrays.after(self.D, j * m * n)
                    value = 0.0
                    for r in range(m):
                        along = 0.0
                        for i in range(n):
                            along += change[r * n + i] * joints[i]
                        value += tool[r] * along
                    self.P[(j * k + a) * k + b] = share * value
        self.second = self.equations.sigma[k - 1]
        self.by_block = self._tensor_norm(self.P, k, k)
        if self.twist < places.INFINITY:
            self.bends.write(self.equations.row)
            self.bend_of_block = self.bends.of_block(self.equations, k)

    def _by_complement(self, best: float) -> float:
        # The largest radius within which the Schur complement is proved not to be zero, or what
        # is proved already.
        d, k = self.count, self.arm.task.generic_rank - 1
        self._write_complement()
        self.by_turns = self._matrix_norm(self.B, k, d)
        self.by_lines = self._matrix_norm(self.C, k, d)
        if self.twist < places.INFINITY:
            self.bend_of_turns = self.bends.of_turns(self.equations, k)
            self.bend_of_lines = self.bends.of_lines(self.equations, k)
        self.gradient = singular_equations.length_of(self.g, d)
        symmetric.diagonalise(self.Q, self.Z, d)
        for i in range(d):
            along = 0.0
            for j in range(d):
                along += self.Z[i * d + j] * self.g[j]
            self.turned[i] = along
        for order in range(1, 3):
            good, bad = best, places.LARGEST_CLEARANCE
            for _ in range(HALVINGS):
                r = 0.5 * (good + bad)
                if self._is_proved(r, order):
                    good = r
                else:
                    bad = r
            best = good
        return best

    def _is_proved(self, r: float, order: int) -> bool:
        # s + a(d) - c'(1 + P)^-1 b > 0 for all |d| <= r: a, b, c and P by their derivatives at the
        # pose, the rest by the bounds that hold at every pose. What a singular value may be counts
        # as a change: J_t stays regular with any that is as large.
        bent = 0.5 * self.bend * r * r + self.singular
        twisted = self.twist * r * r * r / 6.0 + self.singular
        half, root = 0.5 * r * r, math.sqrt(self.second)
        inside = self.by_block * r
        inside += min(bent / self.second, self.bend_of_block * half + twisted / self.second)
        if not inside < 1.0:
            return False
        before = self.by_turns * r
        before += min(bent / root, self.bend_of_turns * half + twisted / root)
        behind = self.by_lines * r
        behind += min(bent / root, self.bend_of_lines * half + twisted / root)
        both = before * behind
        if order == 1:
            left = self.complement - self.gradient * r - bent
            return left - both / (1.0 - inside) > 0.0
        if not self.twist < places.INFINITY:
            return False
        rest = both - self.by_turns * self.by_lines * r * r + both * inside / (1.0 - inside)
        return self.complement + self._lowest(r) - twisted - rest > 0.0

    def _lowest(self, r: float) -> float:
        # A lower bound of g.d + d'Qd / 2 over |d| <= r, Q diagonal: its Lagrange dual, which is
        # one for any multiplier that makes Q + multiplier positive.
        d = self.count
        least, size = 0.0, 0.0
        for i in range(d):
            least = max(least, -self.Q[i * d + i])
            size = max(size, abs(self.Q[i * d + i]))
        low = least
        high = low + singular_equations.length_of(self.turned, d) / r + 1e-12 + 2.0 * size
        for _ in range(MULTIPLIER_HALVINGS):
            multiplier = 0.5 * (low + high)
            squares = 0.0
            for i in range(d):
                away = self.turned[i] / max(self.Q[i * d + i] + multiplier, TINY)
                squares += away * away
            if squares > r * r:
                low = multiplier
            else:
                high = multiplier
        value = -0.5 * high * r * r
        for i in range(d):
            value -= 0.5 * self.turned[i] * self.turned[i] / max(self.Q[i * d + i] + high, TINY)
        return value


def unit(v: Floats, count: int) -> bool:
    """Make the first number of v (count,) positive and its length 1, where it has one."""
    size = singular_equations.length_of(v, count)
    if not size > 0.0:
        return False
    if v[0] < 0.0:
        size = -size
    for i in range(count):
        v[i] /= size
    return True


def clearances(clearance: Clearance, q: Floats, radii: Floats) -> None:
    """Fill `radii` (N,) with the radius around each q (N, n) in which no pose is singular, rad."""
    arrays.given(clearance)
    n, count = clearance.arm.chain.dof, arrays.extent(q, 0)
    positions, results = arrays.numbers(q, count * n), arrays.results(radii, count)
    for k in range(count):
        results[k] = clearance.radius(arrays.after(positions, k * n))
