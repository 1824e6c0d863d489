# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute a matrix M(t) and its determinant, where t is the angle of joint 3 (Raghavan and Roth
1993). If an inverse kinematics solution has the angle t of joint 3, M(t) is singular.

The dialytic step multiplies each of the six equations of `Elimination` by cos(u/2) and by
sin(u/2), where u is the angle of joint 4 or 5. This joint is called the multiplied joint. The
results are linear in twelve products: (cos u/2, sin u/2, cos 3u/2, sin 3u/2) of the multiplied
joint times (1, cos, sin) of the other of joints 4 and 5. Half angles replace the tangents of the
paper, which are infinite at 180 degrees. If the multiplied joint is prismatic with position d, the
equations are multiplied by 1 and d, and the products have (1, d, d^2, d^3).

The matrix of the equations is M(t) = M0 + cos(t) M1 + sin(t) M2. The determinant of M(t) is a
trigonometric polynomial, interpolated by a discrete Fourier transform (polynomials.py). The null
vector of M(t) at a root gives joints 4 and 5.
"""

import math

from ..forward import chain_pass, linear_equations
from ..layout import arrays, places
from ..layout.arrays import Numbers
from . import complex_numbers, pairs, polynomials
from .elimination import Elimination
from .pairs import Complex

# Number of rows and of columns of the matrix M. The null vector of M has an entry for each product
# f(u4) * g(u5), where u4 and u5 are the positions of joints 4 and 5. There are four functions f
# and three functions g (see the module's docstring), or three f and four g: twelve products.
SIZE = 12
# Number of entries of the matrix M: SIZE squared.
SQUARE = 144
# Degree of the determinant of M, a trigonometric polynomial, if `Elimination` gives six equations.
# A trigonometric polynomial of degree 8 has 16 roots, and a general arm has 16 solutions (Raghavan
# and Roth). If `Elimination` gives more than six equations, the degree can be up to SIZE.
DEGREE = 8
# Number of samples to interpolate the determinant, a trigonometric polynomial, if its degree is 8.
# It then has 17 coefficients, for the harmonics -8 to 8. Eight more samples measure the round-off.
SAMPLES = 25
# Number of samples to interpolate the determinant, a trigonometric polynomial, if its degree is
# 12. It then has 25 coefficients, for the harmonics -12 to 12. Seven more samples measure the
# round-off.
MAX_SAMPLES = 32


class Pencil:
    """
    The matrices M0, M1 and M2, and the determinant of M(t) = M0 + cos(t) M1 + sin(t) M2.

    Attributes
    ----------
    degree
        Degree of the determinant; 0 if there are fewer than six equations.
    coefficients : shape (13,)
        Complex coefficients c[0] to c[12] of the determinant. The determinant is the sum of
        c[k] e^(i k t) for k from -12 to 12, where c[-k] is the conjugate of c[k].
    noise
        Bound of the relative round-off of the determinant. It is the absolute round-off, divided
        by the largest absolute value of the determinant at the sampled angles t. If the
        determinant vanishes at every angle, `noise` is near 1.
    gap
        Second-last pivot of M(t), divided by the first pivot; the last pivot is taken as zero. If
        `gap` is near 0, the null vector of M(t) is inaccurate. `write_null_vector` sets it.
    count
        Number of equations. Each equation of `Elimination` is multiplied by two functions of joint
        4 or 5, which gives two equations. If there are more than twelve, they are combined into
        twelve, the rows of M.
    error
        Relative error of the equations from round-off.
    """

    def __init__(self) -> None:
        self.rows, self.M, self.columns = arrays.rooms(3 * 336, 3 * SQUARE, SIZE)
        self.work, self.coefficients = arrays.rooms(2 * SQUARE, 26)
        self.circle, self.samples = arrays.rooms(2 * MAX_SAMPLES, MAX_SAMPLES)
        (self.order,) = arrays.whole_rooms(SIZE)
        self.degree, self.count = 0, 0
        self.noise, self.gap, self.error = 0.0, 0.0, 0.0

    def build(self, elimination: Elimination, swapped: bool, slides: bool) -> None:
        """
        Fill the matrices M0, M1 and M2 from the equations in joints 3, 4 and 5.

        The equations are multiplied by functions of joint 4, or of joint 5 if `swapped` is set.
        `slides` says whether this joint is prismatic.
        """
        count = elimination.count
        self.degree, self.count, self.error = 0, 2 * count, elimination.error
        if 2 * count < SIZE:
            return
        for h in range(3):
            for r in range(count):
                self._write_two_rows(elimination, h, r, swapped, slides)
        if 2 * count == SIZE:
            self.degree = DEGREE
            for k in range(3):
                M = arrays.after(self.M, SQUARE * k)
                arrays.copy(M, SQUARE, arrays.after(self.rows, 336 * k))
        else:
            self.degree = SIZE
            self._compress(2 * count)
        self._balance()

    def _write_two_rows(
        self, elimination: Elimination, h: int, r: int, swapped: bool, slides: bool
    ) -> None:
        first = arrays.after(self.rows, 336 * h + 24 * r)
        second = arrays.after(first, SIZE)
        f = arrays.after(elimination.equations, 27 * r + 9 * h)
        step, across = (1, 3) if swapped else (3, 1)
        for b in range(3):
            f0, f1, f2 = f[across * b], f[across * b + step], f[across * b + 2 * step]
            if slides:
                first[b], first[3 + b], first[6 + b], first[9 + b] = f0, f1, f2, 0.0
                second[b], second[3 + b], second[6 + b], second[9 + b] = 0.0, f0, f1, f2
            else:
                half_1, half_2 = 0.5 * f1, 0.5 * f2
                first[b], first[3 + b] = f0 + half_1, half_2
                first[6 + b], first[9 + b] = half_1, half_2
                second[b], second[3 + b] = half_2, f0 - half_1
                second[6 + b], second[9 + b] = -half_2, half_1

    def _compress(self, count: int) -> None:
        # Combines the `count` equations into twelve: the first twelve rows of the discrete cosine
        # transform of the equations.
        arrays.fill(self.M, SQUARE * 3, 0.0)
        for i in range(SIZE):
            for r in range(count):
                _, factor = chain_pass.sincos(places.PI * i * (2 * r + 1) / (2 * count))
                for k in range(3):
                    for j in range(SIZE):
                        term = factor * self.rows[336 * k + SIZE * r + j]
                        self.M[SQUARE * k + SIZE * i + j] += term

    def _balance(self) -> None:
        # Scales the columns of M0, M1 and M2, then the rows. Column j of the three matrices is
        # taken as one long vector and scaled to length 1; rows likewise.
        M = self.M
        for j in range(SIZE):
            square = 0.0
            for k in range(3 * SIZE):
                square += M[SIZE * k + j] * M[SIZE * k + j]
            self.columns[j] = 1.0 / math.sqrt(square) if square > complex_numbers.TINY else 1.0
            for k in range(3 * SIZE):
                M[SIZE * k + j] *= self.columns[j]
        for i in range(SIZE):
            square = 0.0
            for k in range(3):
                for j in range(SIZE):
                    x = M[SQUARE * k + SIZE * i + j]
                    square += x * x
            scale = 1.0 / math.sqrt(square) if square > complex_numbers.TINY else 1.0
            for k in range(3):
                for j in range(SIZE):
                    M[SQUARE * k + SIZE * i + j] *= scale

    def sample(self) -> None:
        """
        Compute the coefficients and the noise of the determinant. Coefficients and noise are
        divided by the largest sample of the determinant.
        """
        count = SAMPLES if self.degree == DEGREE else MAX_SAMPLES
        polynomials.write_circle(count, self.circle)
        largest, minor = 0.0, 0.0
        for n in range(count):
            c, s = self.circle[2 * n], self.circle[2 * n + 1]
            for i in range(SQUARE):
                self.work[i] = self.M[i] + c * self.M[SQUARE + i] + s * self.M[2 * SQUARE + i]
            self.samples[n] = linear_equations.factorise(self.work, SIZE, self.order)
            largest = max(largest, abs(self.samples[n]))
            pivot: float = places.INFINITY
            for i in range(SIZE):
                pivot = min(pivot, abs(self.work[13 * i]))
            if pivot > 0.0:
                minor = max(minor, abs(self.samples[n]) / pivot)
        self.noise = 1.0
        if not complex_numbers.TINY < largest < 1.0 / complex_numbers.TINY:
            return
        noise = polynomials.write_coefficients(
            self.samples, count, self.circle, largest, self.degree, self.coefficients
        )
        # The harmonics above the degree of the determinant should be 0. The largest of them is
        # `noise`. But an error of an entry of M also changes the other harmonics, which do not
        # count in `noise`. The error changes the determinant by `error * minor of the entry`. So
        # increase `noise` to a bound of this change.
        error = max(self.error, complex_numbers.ROUND_OFF)
        self.noise = max(noise, error * minor / largest)

    def write_null_vector(self, z: Complex, x: Numbers) -> None:
        """
        Write to x (12 complex numbers) the null vector of M(t) at the angle t with e^(i t) = z.

        The null vector is proportional to the twelve products of functions of joints 4 and 5 (see
        the module's docstring).

        The method is Gaussian elimination with complete pivoting; the last pivot is taken as zero.
        """
        order = [0] * 12
        first, last = 0.0, 0.0
        self._fill(z)
        W = self.work
        for i in range(SIZE):
            order[i] = i
        for k in range(SIZE - 1):
            best, p, c = -1.0, k, k
            for i in range(k, SIZE):
                for j in range(k, SIZE):
                    at = 2 * (SIZE * i + j)
                    square = W[at] * W[at] + W[at + 1] * W[at + 1]
                    if square > best:
                        best, p, c = square, i, j
            if best <= 0.0:
                last = 0.0
                break
            if k == 0:
                first = best
            last = best
            self._exchange(k, p, c)
            order[k], order[c] = order[c], order[k]
            self._clear_column(k)
        self.gap = math.sqrt(last / first) if first > 0.0 else 0.0
        self._substitute()
        for i in range(SIZE):
            # Restore the order and the scale of the columns; the null vector is in the first
            # column of W.
            k = order[i]
            x[2 * k] = W[24 * i] * self.columns[k]
            x[2 * k + 1] = W[24 * i + 1] * self.columns[k]

    def residual(self, z: Complex, x: Numbers) -> float:
        """
        Return the relative residual of the original equations at a root z = e^(i t), |z| near 1.

        The twelve rows of M(t) are combinations of the original equations, and x is the null
        vector of M(t). The residual is large if x solves the twelve combinations, but not the
        original equations.
        """
        inverse = pairs.over((1.0, 0.0), z)
        c = (0.5 * (z[0] + inverse[0]), 0.5 * (z[1] + inverse[1]))
        s = (0.5 * (z[1] - inverse[1]), -0.5 * (z[0] - inverse[0]))
        longest, largest = 0.0, 0.0
        for j in range(SIZE):
            square = pairs.square_of(pairs.pair(x, j)) / (self.columns[j] * self.columns[j])
            longest = max(longest, square)
        for i in range(self.count):
            value, terms = (0.0, 0.0), 0.0
            for j in range(SIZE):
                at = SIZE * i + j
                A, B, C = self.rows[at], self.rows[336 + at], self.rows[672 + at]
                entry = (A + B * c[0] + C * s[0], B * c[1] + C * s[1])
                value = pairs.plus(value, 1.0, pairs.times(entry, pairs.pair(x, j)))
                terms += (abs(A) + abs(B) + abs(C)) * self.columns[j]
            if terms > 0.0:
                ratio: float = math.sqrt(pairs.square_of(value) / longest) / terms
                largest = max(largest, ratio)
        return largest

    def _fill(self, z: Complex) -> None:
        # Fills `work` with the matrix M(t) at the complex angle t with e^(i t) = z. If |cos t|
        # exceeds 1, which is possible for a complex t, the matrix is divided by |cos t|.
        inverse = pairs.over((1.0, 0.0), z)
        c_re, c_im = 0.5 * (z[0] + inverse[0]), 0.5 * (z[1] + inverse[1])
        s_re, s_im = 0.5 * (z[1] - inverse[1]), -0.5 * (z[0] - inverse[0])
        scale = 1.0 / max(1.0, math.sqrt(c_re * c_re + c_im * c_im))
        c_re, c_im, s_re, s_im = scale * c_re, scale * c_im, scale * s_re, scale * s_im
        for i in range(SQUARE):
            A, B, C = self.M[i], self.M[SQUARE + i], self.M[2 * SQUARE + i]
            self.work[2 * i] = scale * A + c_re * B + s_re * C
            self.work[2 * i + 1] = c_im * B + s_im * C

    def _exchange(self, k: int, p: int, c: int) -> None:
        W = self.work
        if p != k:
            for j in range(2 * SIZE):
                W[24 * k + j], W[24 * p + j] = W[24 * p + j], W[24 * k + j]
        if c != k:
            for i in range(SIZE):
                for e in range(2):
                    first, second = 24 * i + 2 * k + e, 24 * i + 2 * c + e
                    W[first], W[second] = W[second], W[first]

    def _clear_column(self, k: int) -> None:
        W = self.work
        row = arrays.after(W, 24 * k)
        inverse = pairs.over((1.0, 0.0), pairs.pair(W, 13 * k))
        for i in range(k + 1, SIZE):
            factor = pairs.times(pairs.pair(W, SIZE * i + k), inverse)
            pairs.subtract(arrays.after(W, 24 * i), row, k + 1, SIZE, factor)

    def _substitute(self) -> None:
        # Solves for the null vector x by back substitution with x[11] = 1; writes x[i] to W[i, 0].
        W = self.work
        pairs.put(W, SIZE * (SIZE - 1), (1.0, 0.0))
        for i in range(SIZE - 2, -1, -1):
            remainder = (0.0, 0.0)
            for j in range(i + 1, SIZE):
                term = pairs.times(pairs.pair(W, SIZE * i + j), pairs.pair(W, SIZE * j))
                remainder = pairs.plus(remainder, -1.0, term)
            pivot: Complex = pairs.pair(W, 13 * i)
            if pairs.square_of(pivot) == 0.0:
                pivot = (1.0, 0.0)
            pairs.put(W, SIZE * i, pairs.over(remainder, pivot))
