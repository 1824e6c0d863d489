# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the singular set of an arm: families, ranks, impossible tool motions and crossings."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain, combinations, count

import numpy as np
import sympy

from ....kernel import Floats
from ....robot.robot import Robot
from . import singular_geometry
from .algebra.arithmetic import Arithmetic
from .algebra.factors import Factored, RealFactor, factored, stays_whole
from .algebra.laurent import Laurent
from .algebra.matrices import Matrix
from .algebra.names import Names
from .algebra.numeric import Numbers, poses_on
from .algebra.quotient import quotient_constant
from .algebra.zeros import Box, Zero, common_zero
from .family import Family, family_of
from .family_proofs import CommonZeros, proves_lost
from .frames import Frames
from .sampled_poses import POSES, PoseSampler
from .trigonometry import Writer

# Each minor is divided by the common factors of all minors. The common zeros of the quotients are
# computed only if each quotient has at most this number of terms. Longer results would be
# unreadable.
MAX_QUOTIENT_TERMS = 40
# A hitting set contains at least one factor of each quotient. If all factors in a hitting set are
# 0, all quotients are 0. The common zeros of the quotients are computed only if the number of
# minimal hitting sets is at most this.
MAX_HITTING_SETS = 20


@dataclass(frozen=True)
class SingularFactor:
    """
    A factor of the determinant (or of every minor) and its family of singular poses.

    Attributes
    ----------
    name
        The name of the factor in the robot file; otherwise a name by the geometry, such as elbow;
        otherwise the expression as text.
    expression
        A sympy expression; lengths in the file's unit, joint angles in rad.
    power
        Power of the factor in the determinant.
    irreducible
        Whether the factor is proved to be irreducible: it is not a product of two real polynomials
        with rational coefficients. The lengths are variables of the polynomials.
    family
        The joint positions at which the factor is 0.
    rank
        Rank of the task rows of J on the family; None if no configuration of the family was found.
    lost, idle
        Texts: the motion that the tool cannot make, and the joint motion in the null space.
    sampled
        Names among `rank`, `lost` and `idle` whose values hold at sampled configurations and are
        not proved for the whole family.
    within_limits
        Whether a configuration of the family is inside the joint limits, with the link lengths of
        the robot file; None if this is not decided.
    pose
        A configuration inside the limits, rad or the file's unit of length, within 1e-9 of the
        family.
    special
        Text about a configuration of the family at which J has a lower rank than `rank`. The rank
        is lower with the lengths of this file, but not with random lengths. None if no such
        configuration was found.
    """

    name: str
    expression: sympy.Expr
    power: int
    irreducible: bool
    family: Family
    rank: int | None
    lost: str | None
    idle: str | None
    sampled: tuple[str, ...]
    within_limits: bool | None
    pose: tuple[float, ...] | None
    special: str | None = None


@dataclass(frozen=True)
class FamilyCrossing:
    """
    A set of configurations at which several families meet.

    Attributes
    ----------
    names
        Names of the factors of these families.
    rank
        Rank of the task rows on the crossing; None if it is undecided whether the families meet.
    within_limits, pose
        As in `SingularFactor`.
    sampled
        Whether the crossing and its rank were only found at sampled configurations and are not
        proved.
    """

    names: tuple[str, ...]
    rank: int | None
    sampled: bool
    within_limits: bool | None
    pose: tuple[float, ...] | None


@dataclass(frozen=True)
class Determinant:
    """
    The determinant of the task rows, or the product of their singular values, in factored form.

    Attributes
    ----------
    square
        Whether `expression` is a determinant; otherwise it is the product of the singular values.
    expression
        A sympy expression: the constant times the factors, and times `remainder` if there are
        several minors.
    constant
        The factor without joint variables.
    remainder
        Each minor is divided by the common factors of all minors. The remainder is the square root
        of the sum of the squared quotients; it is 1 if `square`.
    view
        Text: axes and reference point of the Jacobian used.
    rows, columns
        The names of the task rows, and the joints whose columns are used.
    minors
        Number of the minors.
    identically_zero
        Whether the determinant is 0 at every configuration.
    split
        Whether every factor is proved to be irreducible. If there are several minors: whether it
        is proved that the minors have no further common factor.
    """

    square: bool
    rows: tuple[str, ...]
    expression: sympy.Expr | None = None
    constant: sympy.Expr | None = None
    remainder: sympy.Expr | None = None
    view: str = ''
    columns: tuple[str, ...] = ()
    minors: int = 0
    identically_zero: bool = False
    split: bool = False


@dataclass(frozen=True)
class SingularSet:
    """
    The singular set of an arm.

    Attributes
    ----------
    determinant
        The determinant of the task rows of J, or the product of their singular values.
    factors
        The factors, one for each family.
    crossings
        Crossings of two or more families.
    generic_rank
        Rank of the task rows at almost all configurations, with random lengths.
    dependent
        Joints whose columns of J are linearly dependent at every configuration; empty for most
        arms.
    complete
        Whether the families are proved to be the whole singular set. False if the remainder of
        `determinant` may be 0, or if a factor may split further.
    remainder_zeros
        Sets of configurations at which `determinant.remainder` is 0. The field `names` of a set
        contains the expressions that are 0 in this set. None: not solved.
    special
        Text if the lengths of the robot file make the rank of the task rows smaller than
        `generic_rank` at every configuration; otherwise None.
    """

    determinant: Determinant
    factors: tuple[SingularFactor, ...]
    crossings: tuple[FamilyCrossing, ...]
    generic_rank: int
    dependent: tuple[str, ...]
    complete: bool
    remainder_zeros: tuple[FamilyCrossing, ...] | None = None
    special: str | None = None


@dataclass(frozen=True)
class _Meaning:
    # Results at the configurations where one factor of the determinant is zero. The name of the
    # singular poses (`geometric`, such as elbow), the rank, the impossible tool motion (`lost`)
    # and the joint motion in the null space (`idle`) are computed with random values of the named
    # constants. `within` has a configuration inside the joint limits, if one exists; `within` and
    # `special` are computed with the values in the robot file.
    within: Zero
    geometric: str | None = None
    rank: int | None = None
    lost: singular_geometry.Lost | None = None
    idle: singular_geometry.Idle | None = None
    special: str | None = None


@dataclass(frozen=True)
class FamilySearch:
    """
    A search for the families of singular poses at which factors of the determinant vanish. It uses
    sampled configurations.

    Attributes
    ----------
    sampler
        The arm, with the constants of the robot file.
    generic
        The arm with random values of its named constants.
    """

    sampler: PoseSampler
    generic: tuple[PoseSampler, ...]

    @property
    def arithmetic(self) -> Arithmetic:
        """Return the polynomial ring of the arm, with the constants of the robot file."""
        return self.sampler.arithmetic

    @property
    def rank(self) -> int:
        """
        Return the rank of the task rows of J at almost all configurations, for almost all values
        of the named constants.
        """
        return max(sampler.generic_rank for sampler in self.generic)

    @lru_cache(maxsize=8)  # noqa: B019
    def arms(self, *values: Laurent) -> singular_geometry.ArmAtPoses | None:
        """
        Return the arm at sampled configurations at which all given polynomials are 0, or None if
        no such configuration is found.
        """
        arms = []
        for sampler in self.generic:
            numbers = [Numbers(value, sampler.arithmetic) for value in values]
            poses = self.poses(numbers, POSES // len(self.generic))
            arms += [sampler.arm(poses)] if len(poses) else []
        return singular_geometry.together(arms) if arms else None

    def numbers(self, value: Laurent) -> Numbers:
        """
        Return a factor as a numeric function. Its root mean square over sampled configurations is
        about 1.
        """
        return Numbers(value, self.arithmetic).scaled_to(self.sampler.random())

    def meaning(self, value: Laurent) -> _Meaning:
        """
        Describe the singular poses at which a factor of the determinant is 0.

        The result has a name of the poses by the geometry, such as elbow, and the rank of J at the
        poses. It also has the impossible tool motion, and the joint motion in the null space of J.
        """
        sampler, arithmetic = self.sampler, self.arithmetic
        numbers = self.numbers(value)
        within = self.zero_within_limits([numbers])
        arm = self.arms(value)
        if arm is None and within.pose is not None:
            arm = sampler.arm(np.array([within.pose]))
        if arm is None:
            return _Meaning(within)
        variables = arithmetic.names.variables
        joints = [k for k, v in enumerate(variables) if arithmetic.derivative(value, v)]
        rank, angular = singular_geometry.rank_at(arm.J_t), any(i >= 3 for i in sampler.rows)
        scales = sampler.robot.singularity.task.row_scales
        lost = singular_geometry.lost_motion(arm, sampler.rows, rank, self.rank, scales)
        name = singular_geometry.name_of(arm, self.generic[0].elsewhere, joints, angular)
        special = self._special(numbers, joints, rank)
        return _Meaning(
            within, name, rank, lost, singular_geometry.idle_motion(arm, rank), special
        )

    def _special(self, numbers: Numbers, joints: Sequence[int], rank: int) -> str | None:
        if not self.arithmetic.names.values or not len(poses := self.poses([numbers], POSES // 2)):
            return None
        ranks = singular_geometry.ranks_at(self.sampler.arm(poses).J_t)
        lowest = int(np.argmin(ranks))
        if ranks[lowest] >= rank:
            return None
        names = self.arithmetic.names
        place = ', '.join(f'{names.variables[k]} = {poses[lowest, k]:.4f}' for k in joints)
        lost = f'rank {ranks[lowest]} (to {singular_geometry.ZERO:g})'
        return f'with {numbers_in_words(names)} of this file: {lost} at {place}'

    def is_one_family(self, factor: RealFactor) -> bool:
        """
        Return whether the zeros of a factor are one family: J has equal rank at all sampled zeros.

        If a factor is the product of two half-angle factors (`halves`), as sin q is, the zeros of
        the two half-angle factors may be separate families. The zeros of any other factor are
        taken as one family.
        """
        if not factor.halves:
            return True
        arm = self.arms(factor.value)
        return arm is None or not np.ptp(singular_geometry.ranks_at(arm.J_t))

    def poses(self, functions: Sequence[Numbers], count: int = POSES) -> Floats:
        """
        Return sampled joint positions at which all functions vanish; empty if none is found.
        """
        sampler, starts = self.sampler, self.sampler.random(count)
        scaled = [f.scaled_to(starts) for f in functions]
        scale = np.where(
            sampler.slides, sampler.robot.singularity.task.length / sampler.to_si, 1.0
        )
        return poses_on(scaled, starts, scale)

    @property
    def _periods(self) -> Floats:
        # Return the change of each joint variable (rad) after which all frames repeat.
        units = self.arithmetic.units
        return 2 * np.pi * np.array([units[v] for v in self.arithmetic.names.variables])

    def zero_within_limits(self, functions: Sequence[Numbers]) -> Zero:
        """Return whether the functions have a common zero inside the joint limits."""
        box = self.sampler.limits(self._periods)
        return common_zero(functions, box, self.sampler.random(within=True))

    def zero_anywhere(self, functions: Sequence[Numbers]) -> Zero:
        """
        Return whether the functions have a common zero at any joint positions, ignoring the
        limits.
        """
        half = np.where(self.sampler.slides, np.inf, self._periods / 2)
        return common_zero(
            functions, Box(-half, half), np.clip(self.sampler.random(), -half, half)
        )


def families_of(product: Factored, search: FamilySearch) -> Factored | None:
    """
    Split each factor of the product into its half-angle factors if they are separate families.

    The half-angle factors are one family if J has equal rank at the zeros of all of them. An
    example is sin q = 2 sin q/2 cos q/2. The arm is stretched if sin q/2 = 0, and folded if
    cos q/2 = 0. In most arms, J has equal rank at stretched and folded arm, so sin q is not split.

    Return None if the split needs a ring with half angles.
    """
    factors: list[RealFactor] = []
    constant = product.constant
    for factor in product.factors:
        whole = not factor.alone and search.is_one_family(factor)
        if not whole and search.arithmetic.ring.parts == 1:
            return None
        if whole or not factor.halves:
            factors.append(factor)
            continue
        factors += [RealFactor(half, factor.power) for half in factor.halves]
        # The factor is a number times its half-angle factors, as in sin q = 2 sin q/2 cos q/2.
        # Multiply the constant of the product by this number.
        first, second = factor.halves
        ratio = quotient_constant(factor.value, first * second, search.arithmetic)
        assert ratio is not None
        constant = math.prod([ratio] * factor.power, start=constant)
    return Factored(constant.reduced(), tuple(factors), product.complete)


def without_integers(product: Factored, writer: Writer) -> Factored:
    """Move integers that divide a factor of the product to the constant of the product."""
    constant, factors = product.constant, []
    for factor in product.factors:
        content, _ = writer.expression(factor.value).as_content_primitive()
        n = int(content) if content.is_Integer else 1
        constant = constant.scaled(n**factor.power)
        factors.append(replace(factor, value=factor.value.scaled(1, n)) if n > 1 else factor)
    return replace(product, constant=constant.reduced(), factors=tuple(factors))


def singular_factors(
    product: Factored, search: FamilySearch, writer: Writer, frames: Frames, J_t: Matrix
) -> tuple[SingularFactor, ...]:
    """
    Return the factors of the determinant, each with a description of its singular poses.

    The singular poses of a factor are the poses at which the factor is 0.
    """
    arithmetic = search.arithmetic
    listed = file_factors(search.sampler.robot, arithmetic.names)
    factors: list[SingularFactor] = []
    taken: set[str] = set()
    for factor in product.factors:
        family = family_of(factor.value, arithmetic, writer)
        seen = search.meaning(factor.value)
        sampled: tuple[str, ...] = ()
        if seen.rank is not None:
            zeros = CommonZeros(J_t, search.rank, (factor.value,), arithmetic)
            # Prove only that the rank is not higher than `seen.rank`, because a sampled
            # configuration shows that the rank is not lower.
            proofs = {
                'rank': zeros.has_rank_at_most(seen.rank),
                'lost': seen.lost is None or proves_lost(seen.lost, zeros, frames),
                'idle': seen.idle is None or zeros.depend(seen.idle.joints),
            }
            sampled = tuple(claim for claim, proved in proofs.items() if not proved)
        expression = writer.expression(factor.value)
        label = next((n for n, e in listed.items() if _is_multiple(e, factor.value, search)), None)
        # Add a number to the name if another factor has this name, as in elbow_2.
        stem = label or seen.geometric or str(expression)
        numbered = chain([stem], (f'{stem}_{k}' for k in count(2)))
        name = next(name for name in numbered if name not in taken)
        taken.add(name)
        factors.append(
            SingularFactor(
                name,
                expression,
                factor.power,
                not factor.splits and (product.complete or stays_whole(factor.value, arithmetic)),
                family,
                seen.rank,
                seen.lost.text if seen.lost else None,
                seen.idle.text if seen.idle else None,
                sampled,
                seen.within.exists,
                seen.within.pose,
                seen.special,
            )
        )
    return tuple(factors)


def numbers_in_words(names: Names) -> str:
    """
    Return which lengths of the robot file are equal, as text such as `L2 = L3`.

    Return the text `the numbers` if no lengths are equal.
    """
    groups: dict[float, list[str]] = {}
    for symbol, value in names.values.items():
        group = groups.setdefault(abs(value), [])
        group.append(f'{"-" * (value < 0)}{symbol.name}')
    equal = [' = '.join(group) for group in groups.values() if len(group) > 1]
    return ' and '.join(equal) or 'the numbers'


def file_factors(robot: Robot, names: Names) -> dict[str, sympy.Expr]:
    """
    Return the factors that a robot file lists, as sympy expressions with joint angles in rad.
    """
    factors = robot.description.singularity.factors
    return {factor.name: names.expression(factor.text) for factor in factors}


def _is_multiple(expression: sympy.Expr, factor: Laurent, search: FamilySearch) -> bool:
    # Return whether an expression is a constant times a factor. It is, if their ratio is equal at
    # all sampled configurations.
    q = search.sampler.random(20)
    ratio = evaluated(expression, search.arithmetic.names, q) / search.numbers(factor)(q)
    return bool(np.ptp(ratio) < 1e-9 * abs(float(ratio[0])))


def evaluated(expression: sympy.Expr, names: Names, q: Floats) -> Floats:
    """Evaluate a sympy expression at q (..., n) with the link lengths of the robot file."""
    function = sympy.lambdify(names.variables, expression.subs(dict(names.values)), 'numpy')
    return np.broadcast_to(function(*np.moveaxis(q, -1, 0)), q.shape[:-1]).astype(float)


def crossings_of(
    product: Factored, factors: Sequence[SingularFactor], search: FamilySearch, J_t: Matrix
) -> tuple[FamilyCrossing, ...]:
    """
    Return the crossings of each pair of families, and of all families if there are more than two.
    """
    families = [(factor.value, named.name) for factor, named in zip(product.factors, factors)]
    groups = [*combinations(families, 2), *([tuple(families)] if len(families) > 2 else ())]
    crossings = (_crossing(group, search, J_t) for group in groups)
    return tuple(filter(None, crossings))


def _crossing(
    named: Sequence[tuple[Laurent, str]], search: FamilySearch, J_t: Matrix
) -> FamilyCrossing | None:
    # Return the set of configurations at which several factors of the determinant are all 0.
    # `named` has each factor with its name. Return None if it is proved that the set is empty.
    values, names = zip(*named)
    functions = [search.numbers(value) for value in values]
    poses, meet = search.poses(functions), None
    if len(poses) < 2:
        meet = search.zero_anywhere(functions)
        if meet.exists is None:
            return FamilyCrossing(names, None, True, None, None)
        if not meet.exists:
            return None
        poses = np.array([meet.pose])
    rank = singular_geometry.rank_at((search.arms(*values) or search.sampler.arm(poses)).J_t)
    within = search.zero_within_limits(functions)
    meet = meet or (within if within.exists else search.zero_anywhere(functions))
    zeros = CommonZeros(J_t, search.rank, values, search.arithmetic)
    sampled = not meet.exists or not zeros.has_rank_at_most(rank)
    return FamilyCrossing(names, rank, sampled, within.exists, within.pose)


def remainder_zeros(
    quotients: Sequence[Laurent], search: FamilySearch, writer: Writer, J_t: Matrix
) -> tuple[FamilyCrossing, ...] | None:
    """
    Return the configurations at which all elements of `quotients` are 0; None if not solved.

    An element of `quotients` is a minor, divided by the common factors of all minors. It is 0 if
    one of its factors is 0. A hitting set contains at least one factor of each element. So all
    elements are 0 if all factors in a hitting set are 0. Only minimal hitting sets are used.
    """
    arithmetic, pieces = search.arithmetic, list[Laurent]()
    hitting: list[frozenset[int]] = [frozenset()]
    for quotient in sorted(quotients, key=len):
        if len(quotient) > MAX_QUOTIENT_TERMS:
            return None
        of_this = set()
        for factor in factored(quotient, arithmetic).factors:
            known = (
                k
                for k, piece in enumerate(pieces)
                if quotient_constant(factor.value, piece, arithmetic) is not None
            )
            of_this.add(k := next(known, len(pieces)))
            pieces += [factor.value] if k == len(pieces) else []
        grown = {set_ if set_ & of_this else set_ | {k} for set_ in hitting for k in of_this}
        hitting = [set_ for set_ in grown if not any(other < set_ for other in grown)]
        if len(hitting) > MAX_HITTING_SETS:
            return None
    crossings: dict[frozenset[int], FamilyCrossing] = {}
    for set_ in hitting:
        kept = sorted(set_)
        for k in reversed(kept):
            others = tuple(pieces[j] for j in kept if j != k)
            if others and CommonZeros(J_t, search.rank, others, arithmetic).are_zero([pieces[k]]):
                kept.remove(k)
        named = [(pieces[k], str(writer.expression(pieces[k]))) for k in kept]
        crossing = _crossing(named, search, J_t)
        crossings |= {frozenset(kept): crossing} if crossing else {}
    return tuple(crossings.values())
