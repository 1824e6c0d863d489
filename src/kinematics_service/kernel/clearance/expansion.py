# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Expand the task Jacobian J_t to third order in joint motions, in the bases of its singular vectors.
"""

import math

from ..forward import vectors
from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat, Integers, Vector
from ..measures import singularity
from ..measures.task_rows import TaskRows
from .directions import Directions
from .norms import Norms

# Highest order of the Taylor expansion of J_t.
MAX_ORDER = 3


class Expansion:
    """
    The Taylor expansion of the scaled task Jacobian J_t, to third order in the motions of some
    joints.

    A term is a product of one, two or three motions of joints. The terms are sorted by order:
    first, second, third. The number of joints in `moving` is d.

    Parameters
    ----------
    chain, task
        The arm.
    moving
        Indices, from 0, of the joints whose motions are variables.
    orders
        The highest order of the terms, 1 or 3. The number of terms of third order grows as d^3.

    Attributes
    ----------
    terms
        Number of terms.
    begins, sizes : shape (4,)
        For each order: the index of its first term, and its number of terms.
    pair, triple : shape (d, d), (d, d, d)
        pair[a, b] is the index of the product of joint motions a and b among the terms of second
        order. triple[a, b, c] is the index of the product of joint motions a, b and c among the
        terms of third order.
    share : shape (terms,)
        1 divided by the number of orders in which the factors of the term can be written. For
        example, the term a b can be written as a b or b a, so its share is 1/2. The array `root`
        has the square roots of `share`.
    G : shape (rank, lines, terms)
        Coefficients of the Taylor terms of J_t in the bases of its singular vectors. J_t has two
        sets of singular vectors: joint motions and tool motions. The vectors of the larger set are
        called lines, the vectors of the smaller set turns (see `Directions`). In the bases, row a
        of J_t belongs to turn a, and column b belongs to line b. G[a, b] has the coefficients in
        row a and column b, divided by sqrt(s_a s_b). Here s_a is the singular value of turn a, and
        s_b the singular value of line b. The divisor has 1 in place of the smallest singular
        value. If line b is in the null space, s_b is 1.
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
        self.begins, self.sizes = arrays.whole_rooms(MAX_ORDER + 1, MAX_ORDER + 1)
        self.place, self.chosen = arrays.whole_rooms(n, MAX_ORDER)
        self.pair, self.triple = arrays.whole_rooms(d * d, d * d * d)
        self.share, self.root, self.half = arrays.rooms(self.terms, self.terms, cells)
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
        for k in range(self.terms):
            self.root[k] = math.sqrt(self.share[k])

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
        Fill K (terms, min(m, n), max(m, n)) with the coefficients of the Taylor terms of J_t.

        `row` has the results of `evaluate` at the joint positions of the expansion. An entry is a
        pair: an element of the chain, and a joint that moves the element (see `ChainTable`). If
        the joint moves the element of entry i at unit velocity, the tool has the linear velocity
        v_i and the angular velocity w_i. Together v_i and w_i are the screw of entry i. Column j
        of J is the sum of the screws of all entries with joint j.

        Let a, b, ..., c be several entries, in the order from base to tool. Choose one of the
        entries, and differentiate its linear velocity with respect to the motions of the other
        entries. The derivative is w_a x (w_b x ... v_c), whichever entry was chosen. Differentiate
        w_i with respect to the motions of a, b, ..., c. If entry i is nearer to the tool than c,
        the derivative is w_a x (w_b x ... (w_c x w_i)). Otherwise it is 0.
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
                scale = self._scale(f) * self._scale(g)
                at = self.begins[2] + self.pair[a * d + b]
                self._add(at, 2, 0.5 * scale if f == g else scale, row)
                for h in range(g, entries):
                    c = self.place[joint[h]]
                    if c < 0:
                        continue
                    self.chosen[2] = h
                    weight = scale * self._scale(h)
                    if f == g and g == h:
                        weight /= 6.0
                    elif f == g or g == h:
                        weight *= 0.5
                    self._add(self.begins[3] + self.triple[(a * d + b) * d + c], 3, weight, row)

    def _scale(self, entry: int) -> float:
        return self.task.column_scale[self.chain.joint[entry]]

    def _add(self, term: int, order: int, weight: float, row: Flat) -> None:
        # An entry is a pair: an element of the chain, and a joint that moves the element. Computes
        # the derivative of J with respect to the variables of the entries chosen[0] to
        # chosen[order - 1]. Adds `weight` times the derivative to term number `term` of K.
        entries = self.chain.entries
        v = arrays.after(row, self.chain.screws_at)
        w = arrays.after(v, 3 * entries)
        K = arrays.after(self.K, term * self.turns * self.length)
        for i in range(entries):
            # Differentiate the linear velocity of entry i with respect to the motions of the
            # chosen entries. Let a, b, ..., c be entry i and the chosen entries, in the order from
            # base to tool. Entry c is `last`. The derivative `moved` is w_a x (w_b x ... v_c) (see
            # `write`).
            last = max(i, self.chosen[order - 1])
            moved = vectors.apart(v, last, entries)
            pending = i < last
            k = order - 1 if i == last else order - 2
            while pending or k >= 0:
                if pending and (k < 0 or i >= self.chosen[k]):
                    moved = vectors.cross(vectors.apart(w, i, entries), moved)
                    pending = False
                else:
                    moved = vectors.cross(vectors.apart(w, self.chosen[k], entries), moved)
                    k -= 1
            turned: Vector = (0.0, 0.0, 0.0)
            if self.chosen[order - 1] < i:
                turned = vectors.apart(w, i, entries)
                for k in range(order - 1, -1, -1):
                    turned = vectors.cross(vectors.apart(w, self.chosen[k], entries), turned)
            j = self.chain.joint[i]
            scale = weight * self.task.column_scale[j]
            for r in range(self.task.count):
                value = scale * singularity.task_component(self.task, r, moved, turned)
                K[r * self.length + j if self.wide else j * self.length + r] += value

    def turn(self, directions: Directions) -> None:
        """
        Fill G: transform the Taylor terms K to the bases of the singular vectors in `directions`.
        """
        turns, length, rank, terms = self.turns, self.length, self.rank, self.terms
        for k in range(terms):
            K = arrays.after(self.K, k * turns * length)
            for a in range(rank):
                few = arrays.after(directions.W, a * directions.width + length)
                scale = 1.0 / math.sqrt(directions.sigma[a]) if a < rank - 1 else 1.0
                half = arrays.after(self.half, a * length)
                arrays.fill(half, length, 0.0)
                for r in range(turns):
                    weight = scale * few[r]
                    for i in range(length):
                        half[i] += weight * K[r * length + i]
            for b in range(length):
                many = arrays.after(directions.W, b * directions.width)
                scale = 1.0 / math.sqrt(directions.sigma[b]) if b < rank - 1 else 1.0
                for a in range(rank):
                    value = arrays.dot(arrays.after(self.half, a * length), many, length)
                    self.G[(a * length + b) * terms + k] = scale * value

    def change(self) -> float:
        """Return an upper bound of the first-order change of J_t by a joint motion of length 1."""
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
        Return an upper bound of the norm of a matrix whose entries are sums of Taylor terms.

        All terms have the same order, and the bound holds for all joint motions of length 1. The
        matrix has `outer` rows and `inner` columns. The coefficient of term k in row a and column
        b is terms[a * step + b * stride + k * apart]. These coefficients form a tensor with the
        axes a, b and k. The tensor is unfolded to a matrix in two ways: with row index a and
        columns (b, k), and with row index b and columns (a, k). If `order` is 1, it is also
        unfolded with row index k and columns (a, b). The norm of each unfolded matrix is a bound;
        the function returns the smallest bound.
        """
        count, W = self.sizes[order], self.norms.W
        root = arrays.after(self.root, self.begins[order])
        least: float = places.INFINITY
        for rows in range(3 if order == 1 else 2):
            if rows == 1 and inner == 1:
                continue
            # Write the unfolded tensor to W, a matrix with `number` rows and `length` columns. The
            # element (a, b, k) of the tensor is in W at the index
            # a * by_outer + b * by_inner + k * by_term.
            number, length = outer, inner * count
            by_outer, by_inner, by_term = length, count, 1
            if rows == 1:
                number, length = inner, outer * count
                by_outer, by_inner = count, length
            elif rows == 2:
                number, length = count, outer * inner
                by_outer, by_inner, by_term = inner, 1, length
            for a in range(outer):
                for b in range(inner):
                    cell = arrays.after(terms, a * step + b * stride)
                    into = arrays.after(W, a * by_outer + b * by_inner)
                    for k in range(count):
                        into[k * by_term] = root[k] * cell[k * apart]
            least = min(least, self.norms.norm(number, length))
        return least
