"""The singular poses near a pose where either of its two least singular values may vanish."""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat
from ..measures import symmetric
from . import singular_equations
from .singular_equations import SingularEquations

# Directions between the two that are tried, all around.
ANGLES = 16
# A direction in which the equations change by less than this share of the most is none.
FLAT = 1e-5


class SingularPencil:
    """
    The motions after which a direction between those of the two least singular values is lost.

    Of a direction at an angle to that of the least one there is one more equation than in
    `SingularEquations`: neither of the two others' is moved by it. The motions to first order are
    a family over the angle, and where they are shortest sheets of singular poses are near that the
    least singular value alone does not tell of.

    Parameters
    ----------
    n, count
        Joints, and equations of the directions of the least singular value.

    Attributes
    ----------
    angles
        How many there are.
    lengths : shape (angles,)
        Of the motions of each, infinite where there is none.
    """

    def __init__(self, n: int, count: int) -> None:
        self.n, self.size, self.angles = n, count + 1, ANGLES
        self.least, self.second = 0.0, 0.0
        size, cells = self.size, self.size * self.n
        self.ofleast, self.ofsecond, self.A = arrays.rooms(cells, cells, cells)
        self.G, self.L = arrays.rooms(size * size, size * size)
        self.wanted, self.shares, self.lengths = arrays.rooms(size, size, ANGLES)

    def stand_at(self, equations: SingularEquations, d: Flat) -> None:
        """Take the first order of equations that are decomposed; d (n,) is room."""
        k = equations.rank - 1
        self.least, self.second = equations.sigma[k], equations.sigma[k - 1]
        for i in range(self.size):
            line, at = k - 1 + i, i * self.n
            equations.write_slope(k, line, arrays.after(self.ofleast, at))
            equations.write_slope(k - 1, line, arrays.after(self.ofsecond, at))
        for angle in range(ANGLES):
            self.lengths[angle] = self.write_motion(angle, d)

    def is_shortest(self, angle: int) -> bool:
        """Return whether the motions of the angles on both sides are no shorter."""
        length = self.lengths[angle]
        before, behind = (angle + ANGLES - 1) % ANGLES, (angle + 1) % ANGLES
        return length <= self.lengths[before] and length < self.lengths[behind]

    def write_motion(self, angle: int, d: Flat) -> float:
        """Fill the least motion d (n,) of an angle; returns its length, infinite without one."""
        n, size = self.n, self.size
        turned: float = angle * places.PI / ANGLES
        least, second = math.cos(turned), math.sin(turned)
        for k in range(size * n):
            self.A[k] = least * self.ofleast[k] + second * self.ofsecond[k]
        arrays.fill(self.wanted, size, 0.0)
        self.wanted[0], self.wanted[1] = -second * self.second, -least * self.least
        traces = 0.0
        for i in range(size):
            row = arrays.after(self.A, i * n)
            for j in range(i + 1):
                self.G[i * size + j] = arrays.dot(row, arrays.after(self.A, j * n), n)
            traces += self.G[i * size + i]
        damping = FLAT * FLAT * traces
        if not symmetric.damped_step(size, self.G, self.wanted, damping, self.L, self.shares):
            return places.INFINITY
        left = damping * singular_equations.length_of(self.shares, size)
        if not left < 0.5 * singular_equations.length_of(self.wanted, size):
            return places.INFINITY
        for k in range(n):
            d[k] = 0.0
            for i in range(size):
                d[k] += self.shares[i] * self.A[i * n + k]
        return singular_equations.length_of(d, n)
