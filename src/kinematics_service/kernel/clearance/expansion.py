"""J_t around a pose as a polynomial of the joints' motions, between its singular directions."""

import math

from ..forward import vectors
from ..forward.chain import Chain
from ..layout import arrays
from ..layout.arrays import Flat, Integers, Vector
from ..measures import singularity
from ..measures.task_rows import TaskRows
from .directions import Directions
from .norms import Norms

# The highest order.
ORDERS = 3


class Expansion:
    """
    The scaled J_t around a pose to third order in the motions of the joints that count.

    Its terms are the products of one of these motions, of two, and of three: first all of the
    first order, then of the second, then of the third.

    Parameters
    ----------
    chain, task
        The arm.
    moving
        The joints that count, from 0.
    orders
        1 or 3: with many joints the third order would be large.

    Attributes
    ----------
    terms
        How many there are.
    begins, sizes : shape (4,)
        The first term of each order, and how many terms it has.
    pair, triple : shape (d, d), (d, d, d)
        Where a product stands among those of its order.
    share : shape (terms,)
        1 over the number of orders in which the factors of each can be multiplied.
    G : shape (rank, lines, terms)
        The terms between each turn and each line of the equations, over the roots of the singular
        values of those before the last of the rank.
    """

    def __init__(self, chain: Chain, task: TaskRows, moving: Integers, orders: int) -> None:
        self.chain, self.task, self.orders = chain, task, orders
        self.count = arrays.size(moving)
        n, d = self.chain.dof, self.count
        self.wide, self.rank = n > task.count, task.generic_rank
        self.turns: int = min(task.count, n)
        self.length: int = max(task.count, n)
        pairs = d * (d + 1) // 2 if orders > 1 else 0
        triples = pairs * (d + 2) // 3
        self.terms = d + pairs + triples
        cells = self.turns * self.length
        largest = max(d, max(pairs, triples))
        self.norms = Norms(max(self.turns, max(self.length, d)), max(cells, d * d) * largest)
        self.begins, self.sizes = arrays.whole_rooms(ORDERS + 1, ORDERS + 1)
        self.place, self.chosen = arrays.whole_rooms(n, ORDERS)
        self.pair, self.triple = arrays.whole_rooms(d * d, d * d * d)
        self.share, self.half = arrays.rooms(self.terms, cells)
        self.K, self.G = arrays.rooms(self.terms * cells, self.terms * cells)
        for j in range(n):
            self.place[j] = -1
        for j in range(d):
            self.place[moving[j]] = j
            self.share[j] = 1.0
        self.begins[1], self.sizes[1] = 0, d
        self.begins[2], self.sizes[2] = d, pairs
        self.begins[3], self.sizes[3] = d + pairs, triples
        if orders > 1:
            self._number_pairs()
            self._number_triples()

    def _number_pairs(self) -> None:
        d, k = self.count, 0
        for a in range(d):
            for b in range(a, d):
                self.pair[a * d + b] = self.pair[b * d + a] = k
                self.share[self.begins[2] + k] = 1.0 if a == b else 0.5
                k += 1

    def _number_triples(self) -> None:
        d, k = self.count, 0
        for a in range(d):
            for b in range(a, d):
                for c in range(b, d):
                    self.triple[(a * d + b) * d + c] = self.triple[(a * d + c) * d + b] = k
                    self.triple[(b * d + a) * d + c] = self.triple[(b * d + c) * d + a] = k
                    self.triple[(c * d + a) * d + b] = self.triple[(c * d + b) * d + a] = k
                    orders = 6.0
                    if a == b and b == c:
                        orders = 1.0
                    elif a == b or b == c:
                        orders = 3.0
                    self.share[self.begins[3] + k] = 1.0 / orders
                    k += 1

    def write(self, row: Flat) -> None:
        """
        Fill the terms at an evaluated row.

        Of entries in the order of the chain, a, b, c, ..., the tool's velocity changes by
        w_a x (w_b x ... v_c), whichever of them is the column; the axis of a column by
        w_a x (w_b x ... w_i), where all others are before it.
        """
        d, entries, joint = self.count, self.chain.entries, self.chain.joint
        arrays.fill(self.K, self.terms * self.turns * self.length, 0.0)
        for f in range(entries):
            a = self.place[joint[f]]
            if a < 0:
                continue
            self.chosen[0] = f
            self._add(a, 1, self._scale(f), row)
            for g in range(f, entries if self.orders > 1 else 0):
                b = self.place[joint[g]]
                if b < 0:
                    continue
                self.chosen[1] = g
                share = self._scale(f) * self._scale(g)
                at = self.begins[2] + self.pair[a * d + b]
                self._add(at, 2, 0.5 * share if f == g else share, row)
                for h in range(g, entries):
                    c = self.place[joint[h]]
                    if c < 0:
                        continue
                    self.chosen[2] = h
                    one = share * self._scale(h)
                    if f == g and g == h:
                        one /= 6.0
                    elif f == g or g == h:
                        one *= 0.5
                    self._add(self.begins[3] + self.triple[(a * d + b) * d + c], 3, one, row)

    def _scale(self, entry: int) -> float:
        return self.task.column_scale[self.chain.joint[entry]]

    def _add(self, term: int, order: int, share: float, row: Flat) -> None:
        # The change of all columns of J by the entries chosen, of which there are `order`.
        entries = self.chain.entries
        v = arrays.after(row, self.chain.screws_at)
        w = arrays.after(v, 3 * entries)
        K = arrays.after(self.K, term * self.turns * self.length)
        for i in range(entries):
            # The last of the chain among the column and those chosen is moved by all others.
            last = max(i, self.chosen[order - 1])
            moved = vectors.apart(v, last, entries)
            left = i < last
            k = order - 1 if i == last else order - 2
            while left or k >= 0:
                if left and (k < 0 or i >= self.chosen[k]):
                    moved = vectors.cross(vectors.apart(w, i, entries), moved)
                    left = False
                else:
                    moved = vectors.cross(vectors.apart(w, self.chosen[k], entries), moved)
                    k -= 1
            turned: Vector = (0.0, 0.0, 0.0)
            if self.chosen[order - 1] < i:
                turned = vectors.apart(w, i, entries)
                for k in range(order - 1, -1, -1):
                    turned = vectors.cross(vectors.apart(w, self.chosen[k], entries), turned)
            j = self.chain.joint[i]
            scale = share * self.task.column_scale[j]
            for r in range(self.task.count):
                value = scale * singularity.task_component(self.task, r, moved, turned)
                K[r * self.length + j if self.wide else j * self.length + r] += value

    def turn(self, directions: Directions) -> None:
        """Fill G, from the terms and the directions of the pose."""
        turns, length, rank, terms = self.turns, self.length, self.rank, self.terms
        for k in range(terms):
            K = arrays.after(self.K, k * turns * length)
            for a in range(rank):
                few = arrays.after(directions.W, a * directions.width + length)
                share = 1.0 / math.sqrt(directions.sigma[a]) if a < rank - 1 else 1.0
                half = arrays.after(self.half, a * length)
                arrays.fill(half, length, 0.0)
                for r in range(turns):
                    weight = share * few[r]
                    for i in range(length):
                        half[i] += weight * K[r * length + i]
            for b in range(length):
                many = arrays.after(directions.W, b * directions.width)
                share = 1.0 / math.sqrt(directions.sigma[b]) if b < rank - 1 else 1.0
                for a in range(rank):
                    value = arrays.dot(arrays.after(self.half, a * length), many, length)
                    self.G[(a * length + b) * terms + k] = share * value

    def change(self) -> float:
        """Return at least the largest change of J_t to first order by a motion of length 1."""
        cells = self.turns * self.length
        return self.norm(self.K, self.turns, self.length, self.length, 1, cells, 1)

    def norm(
        self,
        terms: Flat,
        outer: int,
        step: int,
        inner: int,
        stride: int,
        apart: int,
        order: int,
    ) -> float:
        """
        Return at least the norm of a matrix of terms of one order, for motions of length 1.

        Its rows are `step` apart, its columns `stride`, its terms `apart`. It is the least norm of
        matrices whose rows are those, the columns, or the joints.
        """
        count, W = self.sizes[order], self.norms.W
        share = arrays.after(self.share, self.begins[order])
        for a in range(outer):
            for b in range(inner):
                cell = arrays.after(terms, a * step + b * stride)
                for k in range(count):
                    W[(a * inner + b) * count + k] = math.sqrt(share[k]) * cell[k * apart]
        least = self.norms.norm(outer, inner * count)
        if inner > 1:
            for a in range(outer):
                for b in range(inner):
                    cell = arrays.after(terms, a * step + b * stride)
                    for k in range(count):
                        W[(b * outer + a) * count + k] = math.sqrt(share[k]) * cell[k * apart]
            least = min(least, self.norms.norm(inner, outer * count))
        if order == 1:
            for a in range(outer):
                for b in range(inner):
                    cell = arrays.after(terms, a * step + b * stride)
                    for k in range(count):
                        W[(k * outer + a) * inner + b] = cell[k * apart]
            least = min(least, self.norms.norm(count, outer * inner))
        return least
