"""
Proof that a factor has no zero within a radius of a pose, or a motion to where its sign changed.

Boxes that cover the ball are cut in two until in each a bound of the factor is above zero: by its
value, slope and curvature in the middle, and by what its third derivatives are at most.
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats
from ..measures import factors
from ..measures.factors import Tape
from ..measures.task_rows import TaskRows
from . import singular_equations

# Joints of a factor at most, and boxes that wait at most.
MOST, WAITING = 6, 64
# Of the largest value of a factor, as a share.
ROUND_OFF = 1e-14
# Where that much less of the third order is enough, it is bounded once more.
LESS = 0.7


class FactorProof:
    """
    Room for the proof of one factor after the other.

    Derivatives are by the joints that a factor depends on, as `column_scales` counts them: of a
    step of the tape value, slope, and second derivatives are side by side, those of each pair of
    joints once; behind them, of what bounds them, the third derivatives, of each triple once.

    Parameters
    ----------
    tape, task
        The factors.

    Attributes
    ----------
    pieces
        Boxes looked at, since it was set to 0.
    """

    def __init__(self, tape: Tape, task: TaskRows) -> None:
        self.tape, self.task, self.pieces = tape, task, 0
        n, steps = self.task.joints, self.tape.steps
        self.operations, self.constants = self.tape.operations, self.tape.constants
        self.m, self.f, self.start, self.end, self.width, self.waiting = 0, -1, 0, 0, 0, 0
        self.pairs, self.triples, self.sign, self.cubic, self.tiny = 0, 0, 1.0, 0.0, 0.0
        pairs = MOST * (MOST + 1) // 2
        whole = 1 + MOST + pairs + pairs * (MOST + 2) // 3
        self.steps, self.bounds = arrays.rooms(steps * whole, steps * whole)
        self.q, self.values = arrays.rooms(n, steps * (n + 1))
        self.place, self.kinds, self.joints = arrays.whole_rooms(n, steps, MOST)
        self.first, self.second, self.third = arrays.whole_rooms(whole, whole, whole)
        self.middle, self.half, self.weights = arrays.rooms(MOST, MOST, MOST)
        self.overall, self.stack = arrays.rooms(whole, 2 * WAITING * MOST)

    def begin(self, f: int, counts: Flat, q: Flat, radius: float) -> bool:
        """
        Prepare the proof of a factor within a radius of q (n,); returns whether it can be bounded.

        `counts` (n,) is above zero for joints that it depends on.
        """
        n = self.task.joints
        self.f, self.m, self.waiting = f, 0, 0
        self.start, self.end = self.tape.begins[f], self.tape.ends[f]
        for j in range(n):
            self.q[j], self.place[j] = q[j], -1
            if counts[j] > 0.0:
                if self.m == MOST:
                    return False
                self.joints[self.m] = j
                self.place[j] = self.m
                self.m += 1
        m = self.m
        self.pairs = m * (m + 1) // 2
        self.triples = self.pairs * (m + 2) // 3
        self.width = 1 + m + self.pairs + self.triples
        self._number()
        if not self._find_kinds():
            return False
        arrays.fill(self.middle, m, 0.0)
        self._expand()
        step = arrays.after(self.steps, self.end * self.width)
        self.sign = 1.0 if step[0] > 0.0 else -1.0
        arrays.fill(self.half, m, radius)
        self._bound(radius)
        bound = arrays.after(self.bounds, self.end * self.width)
        self.tiny = ROUND_OFF * bound[0]
        arrays.copy(self.overall, self.triples, arrays.after(bound, 1 + m + self.pairs))
        arrays.fill(self.stack, m, 0.0)
        arrays.fill(arrays.after(self.stack, m), m, radius)
        self.waiting = 1
        return True

    def _number(self) -> None:
        # The joints of each pair and of each triple.
        k = 0
        for i in range(self.m):
            for j in range(i, self.m):
                self.first[k], self.second[k] = i, j
                k += 1
        for i in range(self.m):
            for j in range(i, self.m):
                for l in range(j, self.m):
                    self.first[k], self.second[k], self.third[k] = i, j, l
                    k += 1

    def _pair(self, i: int, j: int) -> int:
        # Where a pair stands, the smaller first.
        return i * self.m - i * (i - 1) // 2 + j - i

    def _orders(self, k: int) -> float:
        # In how many orders a triple can be written.
        i, j, l = (
            self.first[self.pairs + k],
            self.second[self.pairs + k],
            self.third[self.pairs + k],
        )
        if i == l:
            return 1.0
        return 3.0 if i == j or j == l else 6.0

    def _find_kinds(self) -> bool:
        # Which steps the factor needs: 0 none, 1 constant, 2 those that vary; whether all of those
        # have derivatives everywhere, by joints that count.
        for i in range(self.start, self.end):
            self.kinds[i] = 0
        self.kinds[self.end] = 1
        for i in range(self.end, self.start - 1, -1):
            if self.kinds[i] and self.operations[3 * i] > places.JOINT:
                self.kinds[self.operations[3 * i + 1]] = 1
                self.kinds[self.operations[3 * i + 2]] = 1
        factors.run_factor(self.tape, self.f, self.task.joints, self.q, self.values)
        for i in range(self.start, self.end + 1):
            if not self.kinds[i]:
                continue
            operation = self.operations[3 * i]
            first, second = self.operations[3 * i + 1], self.operations[3 * i + 2]
            if operation == places.JOINT:
                self.kinds[i] = 2
                if self.place[first] < 0:
                    return False
            elif operation > places.JOINT:
                self.kinds[i] = max(self.kinds[first], self.kinds[second])
            if self.kinds[i] == 1:
                value = self.values[i * (self.task.joints + 1) + self.task.joints]
                for table in range(2):
                    step = arrays.after(self.bounds if table else self.steps, i * self.width)
                    arrays.fill(step, self.width, 0.0)
                    step[0] = abs(value) if table else value
            elif operation == places.QUOTIENT:
                if self.kinds[second] == 2:
                    return False
            elif operation > places.COSINE:
                return False
        return self.kinds[self.end] == 2

    def _expand(self) -> None:
        # Value, slope and second derivatives of each step at the middle.
        count = 1 + self.m + self.pairs
        for i in range(self.start, self.end + 1):
            if self.kinds[i] != 2:
                continue
            operation, number = self.operations[3 * i], self.constants[i]
            first = self.operations[3 * i + 1]
            s = arrays.after(self.steps, i * self.width)
            if operation == places.JOINT:
                arrays.fill(s, count, 0.0)
                scale, j = self.task.column_scale[first], self.place[first]
                s[0] = number * (self.q[first] + scale * self.middle[j])
                s[1 + j] = number * scale
                continue
            a = arrays.after(self.steps, first * self.width)
            b = arrays.after(self.steps, self.operations[3 * i + 2] * self.width)
            if operation == places.PRODUCT:
                self._multiply(a, b, s)
            elif operation == places.SINE:
                self._turn(number, math.sin(number * a[0]), math.cos(number * a[0]), a, s)
            elif operation == places.COSINE:
                self._turn(number, math.cos(number * a[0]), -math.sin(number * a[0]), a, s)
            else:
                _combine(operation, count, a, b, s)

    def _turn(self, number: float, value: float, slope: float, a: Flat, s: Flat) -> None:
        # `value`, `slope`: of the sine or cosine, by its angle.
        once, twice = number * slope, -number * number * value
        s[0] = value
        for j in range(1, 1 + self.m):
            s[j] = once * a[j]
        for k in range(self.pairs):
            i, j, at = self.first[k] + 1, self.second[k] + 1, 1 + self.m + k
            s[at] = once * a[at] + twice * a[i] * a[j]

    def _multiply(self, a: Flat, b: Flat, s: Flat) -> None:
        m = self.m
        s[0] = a[0] * b[0]
        for j in range(1, 1 + m):
            s[j] = a[0] * b[j] + a[j] * b[0]
        for k in range(self.pairs):
            i, j, at = self.first[k] + 1, self.second[k] + 1, 1 + m + k
            s[at] = a[0] * b[at] + a[at] * b[0] + a[i] * b[j] + a[j] * b[i]

    def _bound(self, size: float) -> None:
        # What value and derivatives of each step are at most, in the box at the middle, no farther
        # from there than a size.
        for i in range(self.start, self.end + 1):
            if self.kinds[i] != 2:
                continue
            operation, number = self.operations[3 * i], abs(self.constants[i])
            first, here = self.operations[3 * i + 1], abs(self.steps[i * self.width])
            s = arrays.after(self.bounds, i * self.width)
            if operation == places.JOINT:
                arrays.fill(s, self.width, 0.0)
                scale, j = self.task.column_scale[first], self.place[first]
                s[0] = here + number * scale * self.half[j]
                s[1 + j] = number * scale
                continue
            a = arrays.after(self.bounds, first * self.width)
            b = arrays.after(self.bounds, self.operations[3 * i + 2] * self.width)
            if operation >= places.SINE:
                change = min(number * self._change(a, size), 1.0)
                other = math.sqrt(max(1.0 - here * here, 0.0))
                self._bound_turn(number, min(here + change, 1.0), min(other + change, 1.0), a, s)
                continue
            if operation == places.PRODUCT:
                self._multiply(a, b, s)
                self._multiply_cubes(a, b, s)
            else:
                _combine_sizes(operation, self.width, a, b, s)
            s[0] = min(s[0], here + self._change(s, size))

    def _change(self, bound: Flat, size: float) -> float:
        # By how much a step changes at most, by the bound of its slope.
        slope = arrays.after(bound, 1)
        along = arrays.dot(slope, self.half, self.m)
        return min(along, singular_equations.length_of(slope, self.m) * size)

    def _multiply_cubes(self, a: Flat, b: Flat, s: Flat) -> None:
        m = self.m
        for k in range(self.triples):
            i, j = self.first[self.pairs + k], self.second[self.pairs + k]
            l, at = self.third[self.pairs + k], 1 + m + self.pairs + k
            ij, il, jl = (
                1 + m + self._pair(i, j),
                1 + m + self._pair(i, l),
                1 + m + self._pair(j, l),
            )
            s[at] = a[0] * b[at] + a[at] * b[0]
            s[at] += a[1 + i] * b[jl] + a[1 + j] * b[il] + a[1 + l] * b[ij]
            s[at] += b[1 + i] * a[jl] + b[1 + j] * a[il] + b[1 + l] * a[ij]

    def _bound_turn(self, number: float, value: float, slope: float, a: Flat, s: Flat) -> None:
        # `value`, `slope`: of the sine or cosine at most, by its angle.
        m, once, cubed = self.m, number * slope, number * number * number * slope
        twice = number * number * value
        s[0] = value
        for j in range(1, 1 + m):
            s[j] = once * a[j]
        for k in range(self.pairs):
            i, j = self.first[k], self.second[k]
            s[1 + m + k] = once * a[1 + m + k] + twice * a[1 + i] * a[1 + j]
        for k in range(self.triples):
            i, j = self.first[self.pairs + k], self.second[self.pairs + k]
            l, at = self.third[self.pairs + k], 1 + m + self.pairs + k
            ij, il, jl = (
                1 + m + self._pair(i, j),
                1 + m + self._pair(i, l),
                1 + m + self._pair(j, l),
            )
            s[at] = once * a[at] + cubed * a[1 + i] * a[1 + j] * a[1 + l]
            s[at] += twice * (a[1 + i] * a[jl] + a[1 + j] * a[il] + a[1 + l] * a[ij])

    def go_on(self, radius: float, budget: int, d: Flat) -> int:
        """
        Go on with the proof, within a radius that may have become less.

        Returns `PROVED`, `OPEN` after so many pieces, or `CHANGED`: then d (n,) is a motion to
        where the sign is another.
        """
        m = self.m
        while self.waiting > 0:
            top = arrays.after(self.stack, 2 * m * (self.waiting - 1))
            squares, nearest = 0.0, 0.0
            for j in range(m):
                self.middle[j], self.half[j] = top[j], top[m + j]
                squares += top[j] * top[j]
                beyond: float = max(abs(top[j]) - top[m + j], 0.0)
                nearest += beyond * beyond
            if nearest >= radius * radius:
                self.waiting -= 1
                continue
            if self.pieces >= budget or self.waiting == WAITING:
                return places.OPEN
            self.pieces += 1
            self._expand()
            size = radius if squares == 0.0 else singular_equations.length_of(self.half, m)
            low = self._lowest(radius, squares, size, self.overall)
            if low <= 0.0 < low + LESS * self.cubic:
                # What bounds the third derivatives is less in the box alone.
                self._bound(size)
                third = self.end * self.width + 1 + m + self.pairs
                low = self._lowest(radius, squares, size, arrays.after(self.bounds, third))
            if low > 0.0:
                self.waiting -= 1
                continue
            self._cut(top)
            value = self.sign * self.steps[self.end * self.width]
            if value <= 0.0 and squares < radius * radius:
                arrays.fill(d, self.task.joints, 0.0)
                for j in range(m):
                    d[self.joints[j]] = self.middle[j]
                return places.CHANGED
        return places.PROVED

    def changes_at(self, share: float, d: Flat) -> bool:
        """Return whether the sign is another after a share of a motion d (n,)."""
        for j in range(self.m):
            self.middle[j] = share * d[self.joints[j]]
        self._expand()
        return self.sign * self.steps[self.end * self.width] <= 0.0

    def _lowest(self, radius: float, squares: float, size: float, third: Flat) -> float:
        # At most the least value in the box at the middle, where that is in the ball.
        value: float
        cubic: float
        mixed: float
        low: float
        lowest: float
        m, step, h = self.m, arrays.after(self.steps, self.end * self.width), self.half
        cubic, cubes = 0.0, 0.0
        slope = singular_equations.length_of(arrays.after(step, 1), m)
        arrays.fill(self.weights, m, 0.0)
        for k in range(self.triples):
            i, j = self.first[self.pairs + k], self.second[self.pairs + k]
            l = self.third[self.pairs + k]
            cubes += self._orders(k) * third[k] * third[k]
            value = self._orders(k) * third[k] * h[i] * h[j] * h[l] / 6.0
            cubic += value
            self.weights[i] += value
            self.weights[j] += value
            self.weights[l] += value
        cubic = min(cubic, math.sqrt(cubes) * size * size * size / 6.0)
        self.cubic = cubic
        mixed = 0.0
        for i in range(m):
            for j in range(i + 1, m):
                value = abs(step[1 + m + self._pair(i, j)]) * h[i] * h[j]
                mixed += value
                self.weights[i] += value
                self.weights[j] += value
        rest, lowest = self.sign * step[0] - cubic - self.tiny, -places.INFINITY
        for turn in range(2):
            # With a multiplier of what a motion leaves of the radius: the ball is round.
            multiplier = slope / radius if turn == 0 else 0.0
            low = rest - mixed + 0.5 * multiplier * (squares - radius * radius)
            for j in range(m):
                along = abs(self.sign * step[1 + j] + multiplier * self.middle[j])
                bent = self.sign * step[1 + m + self._pair(j, j)] + multiplier
                if bent > 0.0 and along < bent * h[j]:
                    value = 0.5 * along * along / bent
                else:
                    value = along * h[j] - 0.5 * bent * h[j] * h[j]
                low -= value
                if turn == 0:
                    self.weights[j] += value
            lowest = max(lowest, low)
        return lowest

    def _cut(self, top: Flat) -> None:
        # The box on top in two, across the joint that its bound suffers from most.
        m, widest = self.m, 0
        for j in range(1, m):
            if self.weights[j] > self.weights[widest]:
                widest = j
        other = arrays.after(top, 2 * m)
        top[m + widest] *= 0.5
        arrays.copy(other, 2 * m, top)
        top[widest] -= top[m + widest]
        other[widest] += top[m + widest]
        self.waiting += 1


def _combine(operation: int, count: int, a: Flat, b: Flat, s: Flat) -> None:
    # The operations that are linear: a quotient's divisor is constant.
    for k in range(count):
        if operation == places.SUM:
            s[k] = a[k] + b[k]
        elif operation == places.DIFFERENCE:
            s[k] = a[k] - b[k]
        else:
            s[k] = -a[k] if operation == places.NEGATIVE else a[k] / b[0]


def _combine_sizes(operation: int, count: int, a: Flat, b: Flat, s: Flat) -> None:
    # Of what they are at most.
    for k in range(count):
        if operation == places.SUM or operation == places.DIFFERENCE:
            s[k] = a[k] + b[k]
        else:
            s[k] = a[k] if operation == places.NEGATIVE else a[k] / b[0]


def prove_factor(
    tape: Tape, task: TaskRows, f: int, counts: Floats, q: Floats, radius: float, boxes: int
) -> int:
    """
    Return what so many boxes say of a factor within a radius of q (n,).

    `counts` (n,) as `FactorProof.begin` has it.
    """
    n = task.joints
    if not 0 <= f < tape.factors or tape.joints > n:
        raise TypeError('the arrays of a proof do not go together')
    counted, positions = arrays.numbers(counts, n), arrays.numbers(q, n)
    proof = FactorProof(tape, task)
    way = arrays.scratch(n)
    state = places.OPEN
    if proof.begin(f, counted, positions, radius):
        state = proof.go_on(radius, boxes, way)
    arrays.give_back(way)
    return state
