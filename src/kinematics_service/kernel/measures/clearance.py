"""
A radius around a pose in which no pose is singular, proved.

J_t is brought into the bases of its singular values. Between the directions of the larger ones it
stays invertible as long as bounds of its change say so; then it has full rank where the Schur
complement of that block is not zero, whose change is known to second order, and bounded beyond.
"""

import math

from ..forward import chain_pass
from ..layout import arrays, places
from ..layout.arrays import Floats, Integers, Numbers
from . import singular_equations, singular_values, singularity, symmetric
from .arm import Arm
from .singular_equations import SingularEquations

# Halvings of the radius, and of the multiplier of a minimum.
HALVINGS, MULTIPLIER_HALVINGS = 40, 40
# A pose is singular where a singular value is below this share of the largest, as for the search:
# lengths that are rounded leave one that is not zero.
SINGULAR = 1e-7
# Of a norm, as a share.
NORM_ROUND_OFF = 1e-12
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
        n, m, d = arm.chain.dof, arm.task.count, self.count
        few, tensor = min(m, n), d * m * n
        self.room = arrays.scratch(
            3 * n
            + n * n
            + 3 * d
            + 2 * d * d
            + 3 * few * d
            + 2 * tensor
            + d * few * few
            + max(d, max(m, n))
            + 2 * self.equations.count * (self.equations.count + d + 1)
        )
        self.slope = self.room
        self.b = arrays.after(self.slope, n)
        self.c = arrays.after(self.b, n)
        self.H = arrays.after(self.c, n)
        self.g = arrays.after(self.H, n * n)
        self.turned = arrays.after(self.g, d)
        self.Q = arrays.after(self.turned, 2 * d)
        self.Z = arrays.after(self.Q, d * d)
        self.B = arrays.after(self.Z, d * d)
        self.C = arrays.after(self.B, few * d)
        self.D = arrays.after(self.C, few * d)
        self.W = arrays.after(self.D, tensor)
        self.P = arrays.after(self.W, tensor + few * d)
        self.norms = arrays.after(self.P, d * few * few)
        self.A = arrays.after(self.norms, max(d, max(m, n)))

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
        complement = smallest * self._choose_line()
        self._write_complement()
        self._write_block()
        return max(radius, self._by_complement(complement))

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
        moved = [0.0] * 6
        for k in range(self.count * m * n):
            self.D[k] = 0.0
        for j in range(self.count):
            for f in range(entries):
                if self.arm.chain.joint[f] != self.moving[j]:
                    continue
                for e in range(entries):
                    first, last = min(e, f), max(e, f)
                    _write_cross(w, first, v, last, entries, moved, 0)
                    moved[3], moved[4], moved[5] = 0.0, 0.0, 0.0
                    if f < e:
                        _write_cross(w, f, w, e, entries, moved, 3)
                    self._add_change(j, self.arm.chain.joint[e], moved)

    def _add_change(self, j: int, i: int, moved: Numbers) -> None:
        # A change of column i of J by joint `moving[j]`, in base axes.
        n, m = self.arm.chain.dof, self.arm.task.count
        scale = self.arm.task.column_scale[i] * self.arm.task.column_scale[self.moving[j]]
        for r in range(m):
            axis = self.arm.task.axis[r]
            half = 0 if axis < 3 else 3
            component = axis - half
            value = 0.0
            for p in range(3):
                value += self.arm.task.rotation[3 * p + component] * moved[half + p]
            self.D[(j * m + r) * n + i] += value * self.arm.task.row_scale[r] * scale

    def _norm(self, count: int, length: int) -> float:
        # The largest singular value of W (count, length), which is overwritten.
        # With more rows than numbers in them Frobenius' norm is enough.
        if count > length:
            return singular_equations.length_of(self.W, count * length)
        singular_values.orthogonalise(self.W, count, length, length)
        singular_values.sort_by_norm(self.W, self.norms, count, length, length)
        return (1.0 + NORM_ROUND_OFF) * self.norms[0]

    def _matrix_norm(self, M: Floats, count: int, length: int) -> float:
        few, many = min(count, length), max(count, length)
        for r in range(count):
            for i in range(length):
                self.W[r * length + i if count == few else i * count + r] = M[r * length + i]
        return self._norm(few, many)

    def _tensor_norm(self, T: Floats, rows: int, columns: int) -> float:
        # At least the largest |sum d_j T_j| with |d| = 1: the least of its three flattenings.
        d = self.count
        if d == 0:
            return 0.0
        least = self._matrix_norm(T, d, rows * columns)
        for j in range(d):
            for r in range(rows):
                for i in range(columns):
                    self.W[(i * d + j) * rows + r] = T[(j * rows + r) * columns + i]
        least = min(least, self._norm(columns, d * rows))
        for j in range(d):
            for r in range(rows):
                for i in range(columns):
                    self.W[(r * d + j) * columns + i] = T[(j * rows + r) * columns + i]
        return min(least, self._norm(rows, d * columns))

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

    def _choose_line(self) -> float:
        # Of the lines that are lost or idle, the combination whose singular value has the least
        # slope for its size: it becomes the line of the least singular value. Its size.
        d, count, k = self.count, self.equations.count, self.arm.task.generic_rank - 1
        length, width = self.equations.length, self.equations.width
        if count == 1:
            return 1.0
        gram = arrays.after(self.A, count * d)
        factor = arrays.after(gram, count * count)
        right = arrays.after(factor, count * count)
        shares = arrays.after(right, count)
        for i in range(count):
            self.equations.write_slope(k, k + i, self.slope)
            right[i] = 1.0 if i == 0 else 0.0
            for j in range(d):
                self.A[i * d + j] = self.slope[self.moving[j]]
        trace = 0.0
        for i in range(count):
            for p in range(count):
                value = 0.0
                for j in range(d):
                    value += self.A[i * d + j] * self.A[p * d + j]
                gram[i * count + p] = value
            trace += gram[i * count + i]
        if not symmetric.damped_step(count, gram, right, 1e-9 * trace, factor, shares):
            return 1.0
        size = singular_equations.length_of(shares, count)
        if not size > 0.0:
            return 1.0
        if shares[0] < 0.0:
            size = -size
        line = arrays.after(self.equations.W, k * width)
        for p in range(length):
            value = 0.0
            for i in range(count):
                value += shares[i] / size * line[i * width + p]
            line[p] = value
        return shares[0] / size

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

    def _by_complement(self, complement: float) -> float:
        # The largest radius within which the Schur complement is proved not to be zero.
        d, k = self.count, self.arm.task.generic_rank - 1
        block = self._tensor_norm(self.P, k, k)
        b, c = self._matrix_norm(self.B, k, d), self._matrix_norm(self.C, k, d)
        slope = singular_equations.length_of(self.g, d)
        symmetric.diagonalise(self.Q, self.Z, d)
        for i in range(d):
            along = 0.0
            for j in range(d):
                along += self.Z[i * d + j] * self.g[j]
            self.turned[i] = along
        second = self.equations.sigma[k - 1]
        best = 0.0
        for order in range(1, 3):
            good, bad = best, places.LARGEST_CLEARANCE
            for _ in range(HALVINGS):
                r = 0.5 * (good + bad)
                if self._is_proved(r, order, complement, slope, b, c, block, second):
                    good = r
                else:
                    bad = r
            best = good
        return best

    def _is_proved(
        self,
        r: float,
        order: int,
        complement: float,
        slope: float,
        b: float,
        c: float,
        block: float,
        second: float,
    ) -> bool:
        # s + a(d) - c'(1 + P)^-1 b > 0 for all |d| <= r: a, b, c and P by their first derivatives,
        # the rest by the bounds of the second and third. What a singular value may be counts as a
        # change: J_t stays regular with any that is as large.
        bent = 0.5 * self.bend * r * r + self.singular
        inside = block * r + bent / second
        if not inside < 1.0:
            return False
        root = math.sqrt(second)
        both = (b * r + bent / root) * (c * r + bent / root)
        if order == 1:
            return complement - slope * r - bent - both / (1.0 - inside) > 0.0
        if not self.twist < places.INFINITY:
            return False
        rest = both - b * c * r * r + both * inside / (1.0 - inside)
        lowest = self._lowest(r)
        left = complement + lowest - self.twist * r * r * r / 6.0 - rest
        return left > self.singular

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


def _write_cross(
    a: Floats, i: int, b: Floats, j: int, entries: int, product: Numbers, at: int
) -> None:
    # a_i x b_j, vectors whose numbers are `entries` apart.
    ax, ay, az = a[i], a[i + entries], a[i + 2 * entries]
    bx, by, bz = b[j], b[j + entries], b[j + 2 * entries]
    product[at] = ay * bz - az * by
    product[at + 1] = az * bx - ax * bz
    product[at + 2] = ax * by - ay * bx


def clearances(clearance: Clearance, q: Floats, radii: Floats) -> None:
    """Fill `radii` (N,) with the radius around each q (N, n) in which no pose is singular, rad."""
    arrays.given(clearance)
    n, count = clearance.arm.chain.dof, arrays.extent(q, 0)
    positions, results = arrays.numbers(q, count * n), arrays.results(radii, count)
    for k in range(count):
        results[k] = clearance.radius(arrays.after(positions, k * n))
