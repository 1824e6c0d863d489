# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Prove statements about all configurations of a family by polynomial division. A polynomial is 0 on
the family if it is a multiple of the family's factor.

The rank of J is at most r if every minor of size r + 1 is 0. One configuration of rank r shows
that the rank is not below r at almost all configurations of the family.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product as cartesian

import numpy as np

from .algebra.arithmetic import Arithmetic
from .algebra.factors import factored
from .algebra.laurent import Laurent, Ring, Terms, from_terms, total
from .algebra.matrices import Matrix, inverse
from .algebra.numeric import Numbers
from .algebra.quotient import divided
from .frames import Frames
from .jacobian import about, axes_seen_from, geometric, in_axes_of
from .minors import minors
from .singular_geometry import Lost

# Maximum number of minors in a proof. A statement that needs more minors is only checked at
# sampled configurations.
MAX_MINORS = 250
MAX_TERMS = 3000


@dataclass(frozen=True)
class CommonZeros:
    """
    The set of configurations at which several polynomials are all 0.

    The methods prove statements about the exact Jacobian J on this set.

    Attributes
    ----------
    J
        The task rows of the Jacobian, m x n.
    generic_rank
        Rank r of J at almost all configurations of the arm. On the set, the rank of J is lower,
        because all r x r minors of J are 0 there.
    factors
        The polynomials that are all 0 on the set.
    """

    J: Matrix
    generic_rank: int
    factors: tuple[Laurent, ...]
    arithmetic: Arithmetic

    def has_rank_at_most(self, rank: int) -> bool:
        """
        Return whether it is proved that the rank of J is at most `rank` wherever all `factors` are
        0, because all larger minors of J are 0 there.
        """
        if rank + 1 >= self.generic_rank:
            return True
        return self.vanish(range(len(self.J)), range(len(self.J[0])), rank + 1)

    def depend(self, columns: Sequence[int]) -> bool:
        """
        Return whether it is proved that the columns `columns` of J are linearly dependent wherever
        all `factors` are 0.
        """
        return self.vanish(range(len(self.J)), columns, len(columns))

    def vanish(self, rows: Sequence[int], columns: Sequence[int], size: int) -> bool:
        """
        Return whether it is proved that all minors of size `size` in the rows `rows` and the
        columns `columns` of J are 0 wherever all `factors` are 0.
        """
        if math.comb(len(rows), size) * math.comb(len(columns), size) > MAX_MINORS:
            return False
        return self.are_zero(minors(self.J, rows, columns, size))

    def are_zero(self, values: Iterable[Laurent]) -> bool:
        """
        Return whether it is proved that the polynomials `values` are 0 wherever all `factors` are
        0.
        """
        branches = _branches(self.factors, self.arithmetic)
        return branches is not None and all(
            branch.vanishes(value) for value in values if value for branch in branches
        )


@dataclass(frozen=True)
class _Branch:
    # A part of the common zeros of several polynomials, as `_branches` finds it. Each element of
    # `replaced` solves one polynomial for one variable (generator), and inserts the solution into
    # the other polynomials. At the end, one equation remains: factor = 0. If `factor` is None, no
    # equation remains.
    replaced: tuple['_Replaced', ...]
    factor: Laurent | None

    def vanishes(self, value: Laurent) -> bool:
        for replaced in self.replaced:
            value = replaced.put_into(value)
        if not value or self.factor is None:
            return not value
        return len(value) <= MAX_TERMS and divided(value, self.factor) is not None


@dataclass(frozen=True)
class _Replaced:
    # The replacement of the generator `index`. If the generator is a length, its replacement is
    # `length`, a polynomial without this generator. If the generator belongs to an angle, the
    # replacement is a product of powers of other generators (exponents `turns`) and of i (exponent
    # `quarter`).
    index: int
    length: Laurent | None
    quarter: int = 0
    turns: tuple[int, ...] = ()

    def put_into(self, value: Laurent) -> Laurent:
        parts = value.by_power(self.index).items()
        return total(value.ring, [part * self._to(power, value.ring) for power, part in parts])

    def _to(self, power: int, ring: Ring) -> Laurent:
        if self.length is not None:
            return math.prod([self.length] * power, start=ring.number(1))
        turned = from_terms(ring, {tuple(power * t for t in self.turns): (1, 0)})
        return turned.times_i(self.quarter * power)


def _branches(factors: Sequence[Laurent], arithmetic: Arithmetic) -> list[_Branch] | None:
    # Split the set of common zeros of several polynomials into branches. Solve one polynomial for
    # a variable of the ring, and insert the solution into the other polynomials. Repeat until one
    # polynomial remains. Return None if no polynomial can be solved.
    if len(factors) < 2:
        return [_Branch((), next(iter(factors), None))]
    for k, factor in enumerate(factors):
        solutions = _solutions(factor, arithmetic)
        if solutions:
            others = [*factors[:k], *factors[k + 1 :]]
            return _with_solutions(solutions, others, arithmetic)
    return None


def _with_solutions(
    solutions: Sequence[_Replaced], others: Sequence[Laurent], arithmetic: Arithmetic
) -> list[_Branch] | None:
    branches: list[_Branch] = []
    for replaced in solutions:
        pieces = []
        for remainder in filter(None, (replaced.put_into(other) for other in others)):
            split = factored(remainder, arithmetic)
            if not split.factors or _may_vanish(split.constant, arithmetic):
                return None
            pieces.append([factor.value for factor in split.factors])
        for chosen in cartesian(*pieces):
            below = _branches(chosen, arithmetic)
            if below is None:
                return None
            branches += [_Branch((replaced, *branch.replaced), branch.factor) for branch in below]
    return branches


def _may_vanish(constant: Laurent, arithmetic: Arithmetic) -> bool:
    # Evaluate a constant with the link lengths of the robot file, and return whether it is 0 up to
    # round-off.
    number = Numbers(constant, arithmetic)
    still = np.zeros(len(arithmetic.names.variables))
    return bool(abs(number(still)) <= 1e-9 * number.magnitude(still))


def _solutions(factor: Laurent, arithmetic: Arithmetic) -> list[_Replaced]:
    # Solve factor = 0 for a generator. The factor must be a sine or cosine of a sum of angles, or
    # have a term that is a length times a number. Return no solution otherwise.
    ring, terms = arithmetic.ring, factor.terms()
    indices = sorted({k for e in terms for k, x in enumerate(e) if x})
    if len(terms) == 2 and all(ring.generators[k].kind != 'number' for k in indices):
        return _quarter_turns(terms)
    moving = set(arithmetic.names.variables)
    numbers = [k for k in indices if ring.generators[k].kind == 'number']
    for k in sorted(numbers, key=lambda k: ring.generators[k].meaning not in moving):
        alone = [(e, c) for e, c in terms.items() if e[k]]
        if len(alone) == 1 and sum(map(abs, alone[0][0])) == 1 and alone[0][1][1] == 0:
            ((_, (slope, _)),) = alone
            constant = from_terms(ring, {e: c for e, c in terms.items() if not e[k]})
            sign = -1 if slope > 0 else 1
            return [_Replaced(k, constant.scaled(sign, abs(slope)))]
    return []


def _quarter_turns(terms: Terms) -> list[_Replaced]:
    # Let z_1 to z_n be the generators, and z^e the product z_1^e_1 ... z_n^e_n. Let c and d be the
    # coefficients of the two terms. Solve c z^e + d z^-e = 0 for a generator z_k. This is possible
    # if c = d or c = -d, and if e_k is 1 or -1. Then z^e is a power of i, so z_k is a product of
    # powers of i and of the other generators. In all other cases, return no solution.
    (e, c), (opposite, d) = terms.items()
    k = next((k for k, x in enumerate(e) if abs(x) == 1), None)
    if k is None or any(x + y for x, y in zip(e, opposite)):
        return []
    quarters = (0, 2) if c == (-d[0], -d[1]) else (1, 3) if c == d else ()
    turns = tuple(0 if j == k else -x * e[k] for j, x in enumerate(e))
    return [_Replaced(k, None, quarter * e[k], turns) for quarter in quarters]


def proves_lost(lost: Lost, zeros: CommonZeros, frames: Frames) -> bool:
    """
    Return whether it is proved that the tool motion `lost` is impossible wherever the factors in
    `zeros` are 0.
    """
    if lost.axis is None:
        return False
    arithmetic = zeros.arithmetic
    if lost.point is None:
        J = in_axes_of(geometric(frames), frames.in_base[lost.frame])
    else:
        axes = axes_seen_from(frames, lost.point)
        J = about(frames, axes, np.full(3, arithmetic.ring.number(0)))
        T_base_point, T_base_frame = frames.in_base[lost.point], frames.in_base[lost.frame]
        J = in_axes_of(J, inverse(T_base_point) @ T_base_frame)
    if not lost.held:
        rows = [i for i in range(3) if (i == lost.axis) != lost.others]
        return zeros.are_zero(e for i in rows for e in J[i + 3 * lost.angular])
    # Let w be a wrench with J^T w = 0. The joints do no work against w, so the tool cannot make a
    # motion that does work against w. Let the tool rotate, and let the reference point of J not
    # move. This rotation does work against the moments of w only. Suppose that w has a moment
    # about `lost.axis`, but none about the two other axes of the frame. Then the rotation about
    # `lost.axis` does work against w, so it is lost. Entry i of w is, up to its sign, the 5 x 5
    # minor of J without row i. So prove that the minors of the two other moments are 0.
    whole = CommonZeros(J, zeros.generic_rank, zeros.factors, arithmetic)
    others = [i for i in (3, 4, 5) if i != lost.axis + 3]
    row_sets = [[i for i in range(6) if i != other] for other in others]
    return len(J[0]) == 6 and all(whole.vanish(rows, range(6), 5) for rows in row_sets)
