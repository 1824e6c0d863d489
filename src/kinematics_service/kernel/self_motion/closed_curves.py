"""
All curves of solutions of seven joints that turn, with a closed form when the first is held.

Axes 2 and 3 meet in a point O, axes 5 to 7 in a point W, and those three are each across the next.
Held, joint 1 (angle t) says where joints 2 to 4 have to bring W: to v from O. The distance of O
and W, the square of which is rho = v . v, is what joint 4 alone changes:

    rho(t) = C + R cos(q4 - middle),    X = cos(q4 - middle), Y = sin(q4 - middle),

and joint 3 has to bring W to the height k = z2 . v along axis 2: two solutions where

    D(t, Y) = s^2 rho - k^2 + 2 c k h - h^2,    h = e + a X + b Y its height along axis 3,

is positive; c and s are of the angle of both axes. Joint 2, and the wrist but for its flip, are
unique. X is a trigonometric polynomial of first degree in t, D = P + Y Q, and where D vanishes so
does P^2 - (1 - X^2) Q^2, of fourth degree. Its roots and those of X = 1 and X = -1 are all places
where solutions become one. All of them are found, with bounds of their errors; between them are as
many solutions as at any place there. Where a root is not known to be real and single, or a number
between them to be positive or not, nothing is said.
"""

import math

from ..forward import vectors
from ..inverse import roots, targets
from ..layout import arrays, places
from ..layout.arrays import Flat, FlatIntegers, Floats, Integers, Numbers, Vector, WholeNumbers
from ..six_joints import trigonometric_roots
from . import curve_point
from .curve_point import CurvePoint

# Round-off of D as a share of the square of the arm's size, that of its product with its twin, and
# how much larger discs of roots are taken than they are: no mirror image is beyond them.
ROUND_OFF, OF_PRODUCT, MIRRORED = 3e-14, 8.0, 5.0
# A share that is none: where the distance does not change during the turn, or Y is not in D.
NOTHING = 1e-14
# What is no way, and what does not change it: R, as a share of the square of the arm's size.
LEAST = 1e-6
# Ends of pieces: none, of the range of joint 4, of that of joint 3.
NO_END, OF_FOUR, OF_THREE = 0, 1, 2
MOST_PIECES = 32
# Samples are not farther apart (rad), nor are their tangents: a cosine.
APART, ALIKE, SHORTEST = 0.1, 0.93, 1e-7
# What is looked for roots of.
OF_TWINS, OF_BOTH, OF_ONE = 0, 1, 2


class ClosedCurves:
    """
    An arm of seven joints that has a closed form when the first is held, and room for its curves.

    Parameters
    ----------
    screws : shape (7, 7)
        Each joint at rest: its axis, a point on it, 0.
    crossing, meeting : shape (3,), m
        Where axes 2 and 3 meet, and axes 5 to 7.
    backwards
        Whether the screws are ordered from tool to base.
    error
        How far the arm's axes are from those: rad, and as a share of its size.
    """

    def __init__(
        self, screws: Floats, crossing: Floats, meeting: Floats, backwards: bool, error: float
    ) -> None:
        self.screws = arrays.numbers(screws, 49)
        self.crossing, self.meeting = arrays.numbers(crossing, 3), arrays.numbers(meeting, 3)
        self.backwards, self.error = backwards, error
        most = MOST_PIECES
        # Four ends of the range of joint 4, eight roots, seven positions.
        self.motion, self.goal, self.ends, self.roots, self.psi = arrays.rooms(16, 3, 4, 8, 7)
        self.begins, self.stops, self.sides = arrays.rooms(most, most, most)
        self.first, self.last, self.gone = arrays.whole_rooms(most, most, most)
        self.rows, self.pieces, self.most = self.motion, 0, 0
        z3 = vectors.axis_of(self.screws, 2)
        w = vectors.three(self.meeting, 0)
        o = vectors.three(self.crossing, 0)
        # Of joint 4: |u|^2 and z3 . u at three angles are what they are at all.
        square, height = [0.0] * 3, [0.0] * 3
        for i in range(3):
            u = vectors.plus(vectors.moved(self.screws, 3, 0.5 * places.PI * i, w), -1.0, o)
            square[i], height[i] = vectors.dot(u, u), vectors.dot(z3, u)
        self.C, self.e = 0.5 * (square[0] + square[2]), 0.5 * (height[0] + height[2])
        cosine, sine = 0.5 * (square[0] - square[2]), square[1] - self.C
        self.R, self.middle = math.sqrt(cosine * cosine + sine * sine), math.atan2(sine, cosine)
        s, c = math.sin(self.middle), math.cos(self.middle)
        cosine, sine = 0.5 * (height[0] - height[2]), height[1] - self.e
        self.a: float = cosine * c + sine * s
        self.b: float = sine * c - cosine * s
        self.c = vectors.dot(vectors.axis_of(self.screws, 1), z3)
        self.rho, self.rho_c, self.rho_s = 0.0, 0.0, 0.0
        self.noise, self.level, self.wrist, self.away = 0.0, 0.0, 0.0, 0.0

    def take(self, motion: Flat) -> bool:
        """Take the motion from rest to a target; return whether all its pieces are known."""
        M, w = self.motion, vectors.three(self.meeting, 0)
        for i in range(3):
            for j in range(3):
                M[4 * i + j] = motion[4 * j + i] if self.backwards else motion[4 * i + j]
        p = vectors.apart(motion, 3, 4)
        if self.backwards:
            p = vectors.plus((0.0, 0.0, 0.0), -1.0, vectors.times_vector(M, p))
        M[3], M[7], M[11] = p[0], p[1], p[2]
        goal = vectors.times_point(M, w)
        self.goal[0], self.goal[1], self.goal[2] = goal[0], goal[1], goal[2]
        at_0, at_2 = self._square(0.0), self._square(places.PI)
        self.rho, self.rho_c = 0.5 * (at_0 + at_2), 0.5 * (at_0 - at_2)
        self.rho_s = self._square(0.5 * places.PI) - self.rho
        size = self.rho + abs(self.rho_c) + abs(self.rho_s) + self.C + self.R
        self.noise = (ROUND_OFF + self.error + targets.off(motion)) * size
        self.pieces = 0
        return LEAST * size < self.R and self._write_pieces(size)

    def _reach(self, t: float) -> Vector:
        # v: from O to where joints 2 to 4 have to bring W.
        goal = vectors.moved(self.screws, 0, -t, vectors.three(self.goal, 0))
        return vectors.plus(goal, -1.0, vectors.three(self.crossing, 0))

    def _square(self, t: float) -> float:
        v = self._reach(t)
        return vectors.dot(v, v)

    def _parts(self, t: float) -> Vector:
        # P, Q and X.
        v = self._reach(t)
        rho, k = vectors.dot(v, v), vectors.dot(vectors.axis_of(self.screws, 1), v)
        X = (rho - self.C) / self.R
        level = self.e + self.a * X
        P = (1.0 - self.c * self.c) * rho - k * k + 2.0 * self.c * k * level - level * level
        P -= self.b * self.b * (1.0 - X * X)
        return (P, 2.0 * self.b * (self.c * k - level), X)

    def _is_flat(self) -> bool:
        # Whether the distance of O and W is the same at every angle.
        return abs(self.rho_c) + abs(self.rho_s) <= NOTHING * self.R

    def _write_pieces(self, size: float) -> bool:
        # Ranges of t, with a sign of Y, in which D is positive; False where that is not certain.
        found = [0.0] * 3
        P, Q, X = self._parts(0.0)
        count = 0
        if self._is_flat():
            if abs(abs(X) - 1.0) * self.R <= 8.0 * self.noise:
                return False
        else:
            for k in range(2):
                C = (1.0 - 2.0 * k) * self.R + self.C - self.rho
                more = roots.circle_roots(self.rho_c, self.rho_s, C, self.noise, found)
                if more < 0 or not found[2] < 1e-3:
                    return False
                for i in range(more):
                    self.ends[count] = found[i]
                    count += 1
        self.level = math.sqrt(max(1.0 - X * X, 0.0))
        if count == 0 and abs(X) > 1.0:
            return True
        small = self.b * self.b <= NOTHING * NOTHING * size
        way = OF_ONE if self._is_flat() else OF_BOTH if small else OF_TWINS
        known = 0
        for i in range(2):
            side = 1.0 - 2.0 * i
            if i == 0 or way == OF_ONE:
                known = self._find_roots(way, side, size)
            if known < 0 or not self._write_pieces_of(side, count, known, way):
                return False
        return True

    def _value(self, t: float, way: int, side: float) -> float:
        P, Q, X = self._parts(t)
        if way == OF_TWINS:
            return P * P - (1.0 - X * X) * Q * Q
        return P + side * self.level * Q if way == OF_ONE else P

    def _find_roots(self, way: int, side: float, size: float) -> int:
        # Writes the real roots; how many there are, -1 where that is not certain.
        c, z, bounds = [0.0] * 10, [0.0] * 16, [0.0] * 8
        degree = 4 if way == OF_TWINS else 2
        samples = 2 * degree + 1
        for i in range(samples):
            t = places.TAU * i / samples
            value = self._value(t, way, side) / samples
            for k in range(degree + 1):
                c[2 * k] += value * math.cos(k * t)
                c[2 * k + 1] -= value * math.sin(k * t)
        noise = self.noise if way != OF_TWINS else OF_PRODUCT * size * self.noise
        while degree > 0 and roots.absolute(c[2 * degree], c[2 * degree + 1]) <= noise:
            degree -= 1
        if degree == 0:
            return 0 if abs(c[0]) > 2.0 * samples * noise else -1
        count = trigonometric_roots.roots_on_plane(c, degree, z)
        trigonometric_roots.write_bounds(c, degree, MIRRORED * noise, z, bounds)
        known = 0
        for k in range(count):
            away = roots.absolute(z[2 * k], z[2 * k + 1])
            if abs(away - 1.0) <= bounds[k] * away:
                if not trigonometric_roots.is_alone(z, bounds, count, k) or bounds[k] > 1e-3:
                    return -1
                self.roots[known] = math.atan2(z[2 * k + 1], z[2 * k])
                known += 1
        return known

    def _write_pieces_of(self, side: float, ends: int, known: int, way: int) -> bool:
        # The pieces with a sign of Y.
        at, which = [0.0] * 14, [0] * 14
        count = 0
        for i in range(ends):
            at[count], which[count] = self.ends[i], OF_FOUR + 8 * i
            count += 1
        for i in range(known):
            P, Q, X = self._parts(self.roots[i])
            # Y = -P / Q there.
            if abs(X) < 1.0 and (way != OF_TWINS or (P * Q < 0.0) == (side > 0.0)):
                at[count], which[count] = self.roots[i], OF_THREE
                count += 1
        if count == 0:
            return self._add_piece(0.0, places.TAU, side, NO_END, NO_END) >= 0
        _sort(at, which, count)
        begun, before, first = self.pieces, 0, 0
        for i in range(count):
            stop = at[i + 1] if i + 1 < count else at[0] + places.TAU
            after = which[i + 1] if i + 1 < count else which[0]
            added = self._add_piece(at[i], stop, side, which[i], after)
            # A single root of D parts a piece from none. One that was put to the wrong sign of Y
            # does not: beside an end of the range of joint 4, where Y is nothing. To trace pieces
            # would be refused there, too, as far as was seen: the other sign has no piece there.
            if added < 0 or i > 0 and which[i] == OF_THREE and added == before:
                return False
            first, before = added if i == 0 else first, added
        return which[0] != OF_THREE or first != before and self.pieces > begun

    def _add_piece(self, a: float, b: float, side: float, first: int, last: int) -> int:
        # Adds a piece if D is positive; returns whether it is, -1 where that is not certain.
        P, Q, X = self._parts(0.5 * (a + b))
        if abs(X) > 1.0:
            return 0 if (abs(X) - 1.0) * self.R > self.noise else -1
        D = P + side * math.sqrt(1.0 - X * X) * Q
        if abs(D) <= self.noise or self.pieces == MOST_PIECES:
            return -1
        if D > 0.0:
            k = self.pieces
            self.begins[k], self.stops[k], self.sides[k] = a, b, side
            self.first[k], self.last[k], self.gone[k] = first, last, 0
            self.pieces += 1
            return 1
        return 0

    def _place(self, t: float, side: float, bent: float) -> None:
        # Writes the positions: the signs of Y and of what joint 3 has beside its middle.
        screws, psi, o = self.screws, self.psi, vectors.three(self.crossing, 0)
        z2, z3 = vectors.axis_of(screws, 1), vectors.axis_of(screws, 2)
        v = self._reach(t)
        psi[0] = t
        X = (vectors.dot(v, v) - self.C) / self.R
        Y = math.sqrt(max((1.0 - X) * (1.0 + X), 0.0))
        psi[3] = self.middle + side * math.atan2(Y, X)
        w = vectors.moved(screws, 3, psi[3], vectors.three(self.meeting, 0))
        u = vectors.plus(w, -1.0, o)
        h, k = vectors.dot(z3, u), vectors.dot(z2, v)
        flat = vectors.plus(u, -h, z3)
        A, B = vectors.dot(z2, flat), vectors.dot(z2, vectors.cross(z3, flat))
        C = k - self.c * h
        half = math.atan2(math.sqrt(max(A * A + B * B - C * C, 0.0)), C)
        psi[2] = math.atan2(B, A) + bent * half
        psi[1] = vectors.angle(z2, vectors.turned(z3, psi[2], u), v, 0.0)
        # The wrist.
        a, b = vectors.axis_of(screws, 4), vectors.axis_of(screws, 5)
        c = vectors.axis_of(screws, 6)
        goal = self._back(vectors.times_vector(self.motion, c))
        ab, bc = vectors.dot(a, b), vectors.dot(b, c)
        A, B = vectors.dot(a, c) - ab * bc, vectors.dot(a, vectors.cross(b, c))
        C = vectors.dot(a, goal) - ab * bc
        sine = math.sqrt(max(A * A + B * B - C * C, 0.0))
        self.wrist, self.away = math.atan2(B, A), math.atan2(sine, abs(C))
        psi[5] = self.wrist + math.atan2(sine, C)
        psi[4] = vectors.angle(a, vectors.turned(b, psi[5], c), goal, 0.0)
        across = vectors.across(c)
        rest = self._back(vectors.times_vector(self.motion, across))
        rest = vectors.turned(b, -psi[5], vectors.turned(a, -psi[4], rest))
        psi[6] = vectors.angle(c, across, rest, 0.0)

    def _back(self, v: Vector) -> Vector:
        # A direction before the first four joints turned it.
        for k in range(4):
            v = vectors.turned(vectors.axis_of(self.screws, k), -self.psi[k], v)
        return v

    def write_curve(self, point: CurvePoint, p: int, bent: float, rows: Flat, most: int) -> int:
        """Write the samples of the curve that begins with a piece; how many, -1 where singular."""
        self.rows, self.most = rows, most
        count, at, way, sign = 0, p, 1.0, bent
        for _ in range(2 * MOST_PIECES):
            count = self._write_piece(point, at, way, sign, count)
            if count < 0:
                return count
            self.gone[at] |= 1 if sign > 0.0 else 2
            end = self.last[at] if way > 0.0 else self.first[at]
            if end == OF_THREE:
                way, sign = -way, -sign
            elif end != NO_END:
                at = self._partner(at, end)
                if at < 0:
                    return -1
                way = 1.0 if self.first[at] == end else -1.0
            if at == p and sign == bent and way > 0.0:
                return count
        return -1

    def _partner(self, at: int, end: int) -> int:
        # The piece of the other sign of Y that has the same end.
        for k in range(self.pieces):
            if self.sides[k] != self.sides[at] and (self.first[k] == end or self.last[k] == end):
                return k
        return -1

    def _write_piece(self, point: CurvePoint, p: int, way: float, bent: float, count: int) -> int:
        # Writes samples from one end of a piece to the other; of later pieces not the first one.
        whole = self.first[p] == NO_END
        a, b = self.begins[p], self.stops[p]
        end = places.TAU if whole else places.PI
        x, step = 0.0, 0.05 * end
        if count == 0:
            self._place(a, self.sides[p], bent)
            if not self._write_row(point, not whole, 0):
                return -1
            count = 1
        away = self.away
        while x < end:
            to = min(x + step, end)
            t: float = a + to if whole else 0.5 * (a + b - way * (b - a) * math.cos(to))
            if not whole and to == end:
                t = b if way > 0.0 else a
            if count == self.most:
                return -2
            self._place(t, self.sides[p], bent)
            fine = self._write_row(point, not whole and to == end, count)
            size = self._way_to(count) if fine else 1.0
            if fine and size <= APART and self._is_next(count, away):
                away = self.away
                x, count = to, count + 1
                step *= min(2.0, max(0.5, 0.8 * APART / max(size, 1e-9)))
            else:
                step = 0.5 * (to - x)
                if step < SHORTEST:
                    return -1
        return count

    def _write_row(self, point: CurvePoint, at_end: bool, count: int) -> bool:
        # Writes the place and the tangent there; at an end, where square roots are, refined.
        row, before = self._row(count), self._row(max(count - 1, 0))
        for j in range(7):
            k = 6 - j if self.backwards else j
            angle = -self.psi[k] if self.backwards else self.psi[k]
            if count > 0:
                angle -= places.TAU * math.floor((angle - before[j]) / places.TAU + 0.5)
            point.psi[j] = angle
        if at_end and not point.improve(curve_point.ANY):
            return False
        if not at_end and not point.write_tangent(curve_point.ANY):
            return False
        along = 0.0
        for j in range(7):
            row[j] = point.psi[j]
            if count > 0:
                along += (row[j] - before[j]) * point.tangent[j]
        for j in range(7):
            row[7 + j] = -point.tangent[j] if along < 0.0 else point.tangent[j]
        return True

    def _row(self, count: int) -> Flat:
        return arrays.after(self.rows, 14 * count)

    def _way_to(self, count: int) -> float:
        # The longest way of a joint since the last row.
        row, before = self._row(count), self._row(count - 1)
        way: float = 0.0
        for j in range(7):
            way = max(way, abs(row[j] - before[j]))
        return way

    def _is_next(self, count: int, away: float) -> bool:
        # Whether the tangent is like the last one, and the wrist is not stretched on the way.
        along: float = 0.0
        ways: float = 0.0
        row, before = self._row(count), self._row(count - 1)
        for j in range(7):
            k = 6 - j if self.backwards else j
            along += row[7 + j] * before[7 + j]
            if k < 4:
                ways += abs(row[j] - before[j])
        if count == 1:
            # Nothing tells the direction of the first one.
            along = abs(along)
        return along >= ALIKE and 2.0 * ways <= away + self.away

    def write_flipped(self, count: int, flipped: Flat) -> None:
        """Write the last curve, of so many samples, with the wrist turned over."""
        rows = self.rows
        for i in range(count):
            for j in range(7):
                k = 6 - j if self.backwards else j
                at, slope = rows[14 * i + j], rows[14 * i + 7 + j]
                if k == 4 or k == 6:
                    at += places.PI
                elif k == 5:
                    middle = -self.wrist if self.backwards else self.wrist
                    at, slope = 2.0 * middle - at, -slope
                flipped[14 * i + j], flipped[14 * i + 7 + j] = at, slope


def _sort(at: Numbers, which: WholeNumbers, count: int) -> None:
    for i in range(count):
        at[i] -= places.TAU * math.floor(at[i] / places.TAU)
    for i in range(1, count):
        for k in range(i, 0, -1):
            if at[k] < at[k - 1]:
                at[k], at[k - 1] = at[k - 1], at[k]
                which[k], which[k - 1] = which[k - 1], which[k]


def closed_curves(
    arm: ClosedCurves, point: CurvePoint, motion: Floats, samples: Floats, lengths: Integers
) -> int:
    """
    Write samples of all curves of solutions of a target; return how many curves there are.

    -1 where that is not certain, or a curve passes a singular pose; -2 where there are too many.

    Parameters
    ----------
    arm, point
        Of the arm; the point of the target, too.
    motion : shape (4, 4)
        From rest to the target.
    samples : shape (m, 14)
        Positions of the screws and the unit tangents, curve after curve. The last sample of each
        is the first one, full turns added.
    lengths : shape (k,)
        How many samples each curve has.
    """
    if point.n != 7:
        raise TypeError('these are curves of seven joints')
    most, room = arrays.extent(samples, 0), arrays.size(lengths)
    rows, counts = arrays.results(samples, 14 * most), arrays.whole_results(lengths, room)
    at = arrays.numbers(motion, 16)
    lock = arrays.let_go()
    found = _find(arm, point, at, rows, most, counts, room)
    arrays.take_back(lock)
    return found


def _find(
    arm: ClosedCurves,
    point: CurvePoint,
    motion: Flat,
    rows: Flat,
    most: int,
    counts: FlatIntegers,
    room: int,
) -> int:
    if not arm.take(motion):
        return -1
    found, used = 0, 0
    for p in range(arm.pieces):
        for side in range(2):
            bent = 1.0 - 2.0 * side
            if arm.gone[p] & (1 + side):
                continue
            curve = arrays.after(rows, 14 * used)
            count = arm.write_curve(point, p, bent, curve, most - used)
            if count < 0:
                return count
            if used + 2 * count > most or found + 2 > room:
                return -2
            _close(curve, count)
            arm.write_flipped(count, arrays.after(curve, 14 * count))
            counts[found], counts[found + 1] = count, count
            used += 2 * count
            found += 2
    return found


def _close(rows: Flat, count: int) -> None:
    # The first tangent in the direction of the curve; the last row is the first one but for turns.
    last, along = arrays.after(rows, 14 * (count - 1)), 0.0
    for j in range(7):
        along += (rows[14 + j] - rows[j]) * rows[7 + j]
    for j in range(7):
        if along < 0.0:
            rows[7 + j] = -rows[7 + j]
        turns = math.floor((last[j] - rows[j]) / places.TAU + 0.5)
        last[j], last[7 + j] = rows[j] + places.TAU * turns, rows[7 + j]
