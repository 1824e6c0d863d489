# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the six joint positions that belong to a root of the determinant of M(t), where t is the
angle of joint 3 (back substitution, Raghavan and Roth 1993).

The null vector of M(t) (pencils.py) contains successive powers of e^(i u4) and of e^(i u5), where
u4 and u5 are the angles of joints 4 and 5. The ratio of successive powers gives e^(i u4), and in
the same manner e^(i u5). The positions of joints 3, 4 and 5 are then known. Let A be the line to
which joints 5, 4 and 3 move axis 6, and B the line of axis 6 at the goal. Joints 2 and 1 must move
A to B. Six equations that do not contain joint 1 give the cosine and sine of joint 2 by least
squares. Let joint 2 move A to the line C. A line is represented by four vectors, for example its
direction and its moment (lines.py). If the origin is on axis 1, joint 1 must rotate each vector of
C onto the corresponding vector of B. So one of the four vectors gives the angle of joint 1. In the
same manner, a vector perpendicular to axis 6 gives the angle of joint 6.
"""

from ..forward import vectors
from ..layout import arrays
from ..layout.arrays import Flat, Numbers, Vector
from . import complex_motion, complex_numbers, lines, pairs
from .elimination import Elimination
from .pairs import Complex
from .pencils import Pencil
from .six_screws import SixScrews

# The equations of joint 2 have a column for its cosine and a column for its sine. The two columns
# are taken as dependent if the sine of the angle between them is at most this. The bound is the
# square root of round-off.
DEPENDENT_SINE = 1e-8


def _ratio(terms: Numbers, count: int, width: int) -> Complex:
    # Returns the common ratio of several geometric sequences, fitted by least squares. Each row of
    # `terms` (count, width) is one sequence.
    total, square = (0.0, 0.0), 0.0
    for k in range(count):
        for i in range(width - 1):
            a = pairs.pair(terms, width * k + i)
            b = pairs.pair(terms, width * k + i + 1)
            total = pairs.plus(total, 1.0, pairs.inner(a, b))
            square += pairs.square_of(a)
    if square == 0.0:
        return (0.0, 0.0)
    return (total[0] / square, total[1] / square)


def _rotated(a: Complex, b: Complex, sign: float) -> Complex:
    # Returns a + sign i b, where i is the imaginary unit.
    return (a[0] - sign * b[1], a[1] + sign * b[0])


def _multiplied_joint(x: Numbers, slides: bool) -> Complex:
    # The matrix M(t) was built from equations that were multiplied by functions of one joint,
    # joint 4 or 5 (pencils.py). Computes the position of this joint from x (4, 3), the null vector
    # of M(t). Returns e^(i u) for a revolute joint at angle u, the position for a prismatic joint.
    terms = [0.0] * 24
    for b in range(3):
        for i in range(4):
            value: Complex = pairs.pair(x, 3 * i + b)
            if not slides:
                # Let u be the angle of the joint, and w = e^(u times the imaginary unit). The
                # terms for i = 0, 1, 2, 3 are w^(-3/2), w^(-1/2), w^(1/2) and w^(3/2).
                k = 0 if i in (1, 2) else 2
                cosine, sine = pairs.pair(x, 3 * k + b), pairs.pair(x, 3 * k + 3 + b)
                value = _rotated(cosine, sine, -1.0 if i < 2 else 1.0)
            pairs.put(terms, 4 * b + i, value)
    return _ratio(terms, 3, 4)


def _last_joint(x: Numbers, slides: bool) -> Complex:
    # The matrix M(t) was built from equations that were multiplied either by functions of joint 4
    # or by functions of joint 5 (pencils.py). In the first case, computes the position of joint 5
    # from x (4, 3), the null vector of M(t). In the second case, computes the position of joint 4.
    # Returns e^(i u) for a revolute joint at angle u, the position for a prismatic joint.
    terms = [0.0] * 24
    for k in range(4):
        constant = pairs.pair(x, 3 * k)
        c, s = pairs.pair(x, 3 * k + 1), pairs.pair(x, 3 * k + 2)
        if slides:
            pairs.put(terms, 3 * k, constant)
            pairs.put(terms, 3 * k + 1, c)
            pairs.put(terms, 3 * k + 2, s)
        else:
            pairs.put(terms, 3 * k, _rotated(c, s, -1.0))
            pairs.put(terms, 3 * k + 1, constant)
            pairs.put(terms, 3 * k + 2, _rotated(c, s, 1.0))
    return _ratio(terms, 4, 3)


def _write_parts_of(t: Complex, slides: bool, three: Flat) -> None:
    # Writes three functions of a complex joint position t to `three`: 1, cos t and sin t for a
    # revolute joint; 1, t and t^2 for a prismatic joint.
    three[0], three[1] = 1.0, 0.0
    if slides:
        pairs.put(three, 1, t)
        pairs.put(three, 2, pairs.times(t, t))
        return
    complex_numbers.write_turn(t, arrays.after(three, 2))


class Positions:
    """
    Computes all joint positions from a root z = e^(i a), where a is the angle of joint 3.

    Attributes
    ----------
    t : shape (6,)
        Complex joint positions: angles in rad, prismatic positions in the loop's unit of length.
    """

    def __init__(self) -> None:
        self.x, self.line = arrays.rooms(24, 30)
        self.three, self.fourth, self.fifth = arrays.rooms(6, 6, 6)
        self.parts, self.parts_i, self.C = arrays.rooms(45, 45, 36)
        self.six, self.t = arrays.rooms(6, 12)
        self.moved, self.wanted = arrays.rooms(30, 15)

    def find(
        self, loop: SixScrews, elimination: Elimination, pencil: Pencil, swapped: bool, z: Complex
    ) -> bool:
        """
        Compute the six joint positions `self.t` from z = e^(i a), where a is the angle of joint 3.

        The matrix in `pencil` depends on the angle of joint 3. At the angle a, its determinant is
        0. Returns False if the imaginary part of a joint position is larger than MAX_IMAGINARY.
        """
        fifth: Complex
        fourth: Complex
        t = self.t
        third = complex_numbers.angle_of(z)
        if not complex_numbers.is_near(third):
            return False
        pencil.write_null_vector(z, self.x)
        multiplied, last = (4, 3) if swapped else (3, 4)
        slides = vectors.slides(loop.screws, multiplied)
        a: Complex = _multiplied_joint(self.x, slides)
        a = a if slides else complex_numbers.angle_of(a)
        slides = vectors.slides(loop.screws, last)
        b: Complex = _last_joint(self.x, slides)
        b = b if slides else complex_numbers.angle_of(b)
        if not complex_numbers.is_near(a) or not complex_numbers.is_near(b):
            return False
        fourth, fifth = (b, a) if swapped else (a, b)
        self._write_line(loop, elimination, third, fourth, fifth)
        second = self._second_joint(loop, elimination)
        if not complex_numbers.is_near(second):
            return False
        first = self._first_joint(loop, elimination, second)
        if not complex_numbers.is_near(first):
            return False
        pairs.put(t, 0, first)
        pairs.put(t, 1, second)
        pairs.put(t, 2, third)
        pairs.put(t, 3, fourth)
        pairs.put(t, 4, fifth)
        side = vectors.across(vectors.axis_of(loop.screws, 5))
        sixth = complex_motion.angle_left(loop, t, 5, side)
        pairs.put(t, 5, sixth)
        return complex_numbers.is_near(sixth)

    def _write_line(
        self, loop: SixScrews, elimination: Elimination, t3: Complex, t4: Complex, t5: Complex
    ) -> None:
        # Moves axis 6 by joints 5, 4 and 3. The moved line is a vector of 15 complex numbers
        # (lines.py). Writes to `self.line` the 15 real parts of these numbers, then the 15
        # imaginary parts.
        _write_parts_of(t3, False, self.three)
        _write_parts_of(t4, vectors.slides(loop.screws, 3), self.fourth)
        _write_parts_of(t5, vectors.slides(loop.screws, 4), self.fifth)
        arrays.fill(self.line, 30, 0.0)
        for h in range(3):
            for a in range(3):
                product = pairs.times(pairs.pair(self.three, h), pairs.pair(self.fourth, a))
                for b in range(3):
                    factor = pairs.times(product, pairs.pair(self.fifth, b))
                    parts = arrays.after(elimination.left, 15 * (9 * h + 3 * a + b))
                    re, im = factor[0], factor[1]
                    for i in range(15):
                        self.line[i] += re * parts[i]
                        self.line[15 + i] += im * parts[i]

    def _second_joint(self, loop: SixScrews, elimination: Elimination) -> Complex:
        # Solves joint 2. A line in space is represented by 15 numbers (lines.py). Six linear
        # combinations of the 15 numbers stay the same if joint 1 moves the line. These invariants
        # give six equations in the cosine and sine of joint 2.
        screws = loop.screws
        lines.write_parts(screws, 1, self.line, self.parts)
        lines.write_parts(screws, 1, arrays.after(self.line, 15), self.parts_i)
        # Fill C, the matrix of the six equations in joint 2. Columns 0 and 1 have the coefficients
        # of the unknowns: cosine and sine of the angle, or d and d^2 for a prismatic joint with
        # position d. Column 2 is the right side.
        for k in range(3):
            to = 2 if k == 0 else k - 1
            self._write_column(screws, arrays.after(self.parts, 15 * k), to, 0)
            self._write_column(screws, arrays.after(self.parts_i, 15 * k), to, 1)
        lines.write_invariants(screws, 0, elimination.goal, self.six)
        for i in range(6):
            self.C[24 + 2 * i] = self.six[i] - self.C[24 + 2 * i]
            self.C[24 + 2 * i + 1] = -self.C[24 + 2 * i + 1]
        return self._solve_pair(vectors.slides(screws, 1))

    def _write_column(self, screws: Flat, V: Flat, to: int, part: int) -> None:
        lines.write_invariants(screws, 0, V, self.six)
        for i in range(6):
            self.C[12 * to + 2 * i + part] = self.six[i]

    def _inner(self, a: int, b: int) -> Complex:
        # Returns the inner product conj(column a) . column b of C.
        total = (0.0, 0.0)
        for i in range(6):
            product = pairs.inner(pairs.pair(self.C, 6 * a + i), pairs.pair(self.C, 6 * b + i))
            total = pairs.plus(total, 1.0, product)
        return total

    def _solve_pair(self, slides: bool) -> Complex:
        # Solves the six equations of joint 2 by least squares. The two unknowns are the cosine and
        # sine of its angle, or d and d^2 for a prismatic joint with position d. Columns 0 and 1 of
        # the matrix C are the coefficients of the unknowns, and column 2 is the right side. The
        # method is Gram-Schmidt, which starts with the longer of columns 0 and 1. If columns 0 and
        # 1 are dependent, sets the unknown of the shorter column to 0.
        cosine: Complex
        sine: Complex
        longer = 0 if self._inner(0, 0)[0] >= self._inner(1, 1)[0] else 1
        shorter = 1 - longer
        square = self._inner(longer, longer)[0]
        if not complex_numbers.TINY < square < 1.0 / complex_numbers.TINY:
            return (0.0, 0.0)
        shared: Complex = self._inner(longer, shorter)
        shared = (shared[0] / square, shared[1] / square)
        component: Complex = self._inner(longer, 2)
        component = (component[0] / square, component[1] / square)
        # Let u be the longer column of coefficients, v the shorter column, and w the right side.
        # Make v and w perpendicular to u: subtract from each of the two its component along u.
        for i in range(6):
            u = pairs.pair(self.C, 6 * longer + i)
            v = pairs.pair(self.C, 6 * shorter + i)
            w = pairs.pair(self.C, 12 + i)
            pairs.put(self.C, 6 * shorter + i, pairs.plus(v, -1.0, pairs.times(shared, u)))
            pairs.put(self.C, 12 + i, pairs.plus(w, -1.0, pairs.times(component, u)))
        residual, y = self._inner(shorter, shorter)[0], (0.0, 0.0)
        if residual > DEPENDENT_SINE * DEPENDENT_SINE * square:
            y = self._inner(shorter, 2)
            y = (y[0] / residual, y[1] / residual)
        x = pairs.plus(component, -1.0, pairs.times(shared, y))
        cosine, sine = x if longer == 0 else y, y if longer == 0 else x
        return cosine if slides else complex_numbers.angle(cosine, sine)

    def _first_joint(self, loop: SixScrews, elimination: Elimination, second: Complex) -> Complex:
        # Solves joint 1. Joints 5 to 2 have already moved axis 6 to a known line. Joint 1 must
        # move this line to the line of axis 6 at the goal. Four vectors represent a line
        # (lines.py): its point p, direction l, moment m, and a vector h. The angle of joint 1 is
        # computed from only one of the four: the vector with the longest component perpendicular
        # to axis 1.
        screws, best = loop.screws, -1.0
        _write_parts_of(second, vectors.slides(screws, 1), self.three)
        axis, point = vectors.axis_of(screws, 0), vectors.point_of(screws, 0)
        for i in range(15):
            re, im = 0.0, 0.0
            for k in range(3):
                c, c_im = self.three[2 * k], self.three[2 * k + 1]
                x, y = self.parts[15 * k + i], self.parts_i[15 * k + i]
                re += c * x - c_im * y
                im += c * y + c_im * x
            self.moved[i], self.moved[15 + i] = re, im
            self.wanted[i] = elimination.goal[i]
        if vectors.slides(screws, 0):
            p, q = vectors.three(self.wanted, 1), vectors.three(self.moved, 1)
            q_i = vectors.three(self.moved, 16)
            return (vectors.dot(axis, p) - vectors.dot(axis, q), -vectors.dot(axis, q_i))
        back = (-point[0], -point[1], -point[2])
        lines.translate(self.moved, back)
        lines.translate(arrays.after(self.moved, 15), back)
        lines.translate(self.wanted, back)
        cosine, sine = (1.0, 0.0), (0.0, 0.0)
        for k in range(4):
            at = lines.vector_at(k)
            goal = _across(axis, vectors.three(self.wanted, at))
            size = vectors.dot(goal, goal)
            if size > best:
                best = size
                u, v = vectors.three(self.moved, at), vectors.three(self.moved, 15 + at)
                turned = vectors.cross(goal, axis)
                cosine = (vectors.dot(u, goal), vectors.dot(v, goal))
                sine = (vectors.dot(u, turned), vectors.dot(v, turned))
        return complex_numbers.angle(cosine, sine)


def _across(axis: Vector, v: Vector) -> Vector:
    return vectors.plus(v, -vectors.dot(axis, v), axis)
