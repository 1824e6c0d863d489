"""A polynomial of third order in a joint motion, and what it is at least in a ball."""

from ..layout import arrays
from ..layout.arrays import Flat
from ..measures import symmetric
from . import directions
from .expansion import Expansion
from .norms import Norms

# Halvings of the multiplier of a minimum, which proves with any.
MULTIPLIER_HALVINGS = 20
# Times that what goes with a slope is taken away.
ROUNDS = 4
# No denominator of a minimum is smaller, as a share of the curvature and the slope.
TINY = 1e-14


class Cubic:
    """
    constant + g.d + d'Qd + T(d, d, d), of motions d of so many joints.

    Parameters
    ----------
    count
        Of joints.

    Attributes
    ----------
    constant, g, Q, T
        Its parts: a number, (d,), symmetric (d, d), and (d, d, d) the same in all orders of the
        indices.
    weight, l, M
        The polynomial of second order by which another was multiplied that has been added.
    size_of_l, size_of_M, size_of_Q, size_of_T
        Bounds of them for motions of length 1.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        d = self.count
        self.norms = Norms(max(d, 1), max(d * d * d, 1))
        self.constant, self.weight, self.size_of_l, self.size_of_M = 0.0, 0.0, 0.0, 0.0
        self.size_of_Q, self.size_of_T = 0.0, 0.0
        self.g, self.l, self.way = arrays.rooms(d, d, d)
        self.along, self.more, self.turned = arrays.rooms(d, d, d)
        self.Q, self.M, self.H = arrays.rooms(d * d, d * d, d * d)
        self.Z, self.half, self.T = arrays.rooms(d * d, d * d, d * d * d)

    def become(
        self, expansion: Expansion, F: Flat, shares: Flat, count: int, constant: float
    ) -> None:
        """Become a sum of so many rows of terms, as the expansion has them, with shares."""
        d, begins = self.count, expansion.begins
        self.constant, self.weight, self.size_of_l, self.size_of_M = constant, 0.0, 0.0, 0.0
        for a in range(d):
            self.g[a] = _sum(arrays.after(F, a), shares, count, expansion.terms)
            self.l[a] = 0.0
            for b in range(d):
                self.M[a * d + b] = 0.0
                at = begins[2] + expansion.pair[a * d + b]
                value = _sum(arrays.after(F, at), shares, count, expansion.terms)
                self.Q[a * d + b] = expansion.share[at] * value
                for c in range(d):
                    at = begins[3] + expansion.triple[(a * d + b) * d + c]
                    value = _sum(arrays.after(F, at), shares, count, expansion.terms)
                    self.T[(a * d + b) * d + c] = expansion.share[at] * value

    def take_away(self, other: 'Cubic') -> None:
        """
        Add another one, multiplied by what takes all away that has the direction of its slope.

        Where the other one vanishes, this one stays what it was.
        """
        d = self.count
        slope = directions.length_of(other.g, d)
        if not slope > 0.0:
            return
        for j in range(d):
            self.way[j] = other.g[j] / slope
        for _ in range(ROUNDS):
            self._divide(slope)
            self._add_product(other)
        self.size_of_l = directions.length_of(self.l, d)
        self.size_of_M = self._norm(self.M, d)
        if self.constant < 0.0:
            self.constant = -self.constant
            for j in range(d):
                self.g[j] = -self.g[j]
            for p in range(d * d):
                self.Q[p] = -self.Q[p]
            for p in range(d * d * d):
                self.T[p] = -self.T[p]

    def _divide(self, slope: float) -> None:
        # The weight (along[0], more, half) of a form slope way.d that takes away all of g, Q and T
        # that has its direction: what they lose where d loses its share of it.
        d, way, whole = self.count, self.way, 0.0
        for a in range(d):
            self.more[a], self.along[a] = 0.0, 0.0
            for b in range(d):
                self.more[a] += 2.0 * self.Q[a * d + b] * way[b]
                value = 0.0
                for c in range(d):
                    value += way[c] * self.T[(c * d + a) * d + b]
                self.half[a * d + b] = value
                self.along[a] += value * way[b]
            whole += self.along[a] * way[a]
        square = 0.0
        for a in range(d):
            square += 0.5 * self.more[a] * way[a]
            for b in range(d):
                both = way[a] * self.along[b] + self.along[a] * way[b]
                value = 3.0 * self.half[a * d + b] - 1.5 * both + whole * way[a] * way[b]
                self.half[a * d + b] = -value / slope
        value = 0.0
        for a in range(d):
            value += self.g[a] * way[a]
            self.more[a] = -(self.more[a] - square * way[a]) / slope
        self.along[0] = -value / slope

    def _add_product(self, other: 'Cubic') -> None:
        # Adds another one times the weight of `_divide`, up to the third order.
        d, one, more, half = self.count, self.along[0], self.more, self.half
        self.weight += one
        self.constant += one * other.constant
        for a in range(d):
            self.l[a] += more[a]
            self.g[a] += one * other.g[a] + other.constant * more[a]
            for b in range(d):
                p = a * d + b
                self.M[p] += half[p]
                both = more[a] * other.g[b] + other.g[a] * more[b]
                self.Q[p] += one * other.Q[p] + 0.5 * both + other.constant * half[p]
                for c in range(d):
                    value = more[a] * other.Q[b * d + c] + more[b] * other.Q[a * d + c]
                    value += more[c] * other.Q[p] + half[p] * other.g[c]
                    value += half[a * d + c] * other.g[b] + half[b * d + c] * other.g[a]
                    self.T[p * d + c] += one * other.T[p * d + c] + value / 3.0

    def write_sizes(self) -> None:
        """Fill the bounds of Q and T."""
        self.size_of_Q = self._norm(self.Q, self.count)
        self.size_of_T = self._norm(self.T, self.count * self.count)

    def _norm(self, matrix: Flat, length: int) -> float:
        # At least the largest singular value of a matrix (d, length).
        arrays.copy(self.norms.W, self.count * length, matrix)
        return self.norms.norm(self.count, length)

    def diagonalise(self) -> None:
        """Prepare `lowest`, after `write_sizes`."""
        d = self.count
        for p in range(d * d):
            self.H[p] = 2.0 * self.Q[p]
        symmetric.diagonalise(self.H, self.Z, d, symmetric.NEGLIGIBLE)
        for i in range(d):
            self.turned[i] = arrays.dot(arrays.after(self.Z, i * d), self.g, d)

    def lowest(self, r: float) -> float:
        """
        Return a lower bound of it over abs(d) <= r.

        Of g.d + d'Qd it is the Lagrange dual, which is one for any multiplier that makes
        2 Q + multiplier positive.
        """
        high: float
        low: float
        size: float
        d = self.count
        least, size = 0.0, 0.0
        for i in range(d):
            least = max(least, -self.H[i * d + i])
            size = max(size, abs(self.H[i * d + i]))
        whole = 2.0 * size + directions.length_of(self.turned, d) / r
        tiny = TINY * whole if whole > 0.0 else 1.0
        low, high = least, least + whole
        for _ in range(MULTIPLIER_HALVINGS):
            multiplier: float = 0.5 * (low + high)
            squares: float = 0.0
            for i in range(d):
                away: float = self.turned[i] / max(self.H[i * d + i] + multiplier, tiny)
                squares += away * away
            if squares > r * r:
                low = multiplier
            else:
                high = multiplier
        value: float = self.constant - self.size_of_T * r * r * r - 0.5 * high * r * r
        for i in range(d):
            value -= 0.5 * self.turned[i] * self.turned[i] / max(self.H[i * d + i] + high, tiny)
        return value


def _sum(terms: Flat, shares: Flat, count: int, apart: int) -> float:
    value = 0.0
    for i in range(count):
        value += shares[i] * terms[i * apart]
    return value
