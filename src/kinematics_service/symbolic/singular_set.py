"""
The singular set of an arm: factors with names, families, ranks, what is lost, crossings.
"""

from collections.abc import Container, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import combinations, count
from typing import Any

import numpy as np
import sympy

from ..kernel import Floats
from ..robot.robot import Robot
from .algebra.arithmetic import Arithmetic
from .algebra.factors import Factored, RealFactor, stays_whole
from .algebra.laurent import Laurent
from .algebra.matrices import Matrix
from .algebra.names import Names
from .algebra.numeric import Numbers, poses_on
from .algebra.quotient import quotient_constant
from .algebra.zeros import Box, Zero, common_zero
from .family import Family, family_of
from .family_proofs import CommonZeros, proves_lost
from .frames import Frames
from .sampled_poses import PoseSampler
from .singular_geometry import (
    Idle,
    Lost,
    has_one_rank,
    idle_motion,
    lost_motion,
    name_of,
    rank_at,
)
from .trigonometry import Writer


@dataclass(frozen=True)
class SingularFactor:
    """
    A factor of the determinant (or of every minor) and its family of singular poses.

    Attributes
    ----------
    name
        The robot file's where it lists this factor, else from the geometry, else the expression.
    expression
        Sympy; the file's length unit, joint angles in rad.
    power
        How often it stands in the product.
    irreducible
        Whether it is proved that it cannot be split further into real factors with fractions as
        coefficients, its lengths being letters.
    family
        Where it is 0.
    rank
        Of the task rows on the family; None where no pose was found on it.
    lost, idle
        In words: the motion that cannot be made, and the joint motion that makes none.
    sampled
        Which of rank, lost and idle are seen at sampled poses of the family, with the lengths of
        the file, and not proved for all of it.
    within_limits
        Whether a pose of the family is inside the joint limits, with the lengths of the file,
        shown or proved; None where that is not decided.
    pose
        One that is, rad or the file's unit of length: within 1e-9 of a pose of the family.
    """

    name: str
    expression: Any
    power: int
    irreducible: bool
    family: Family
    rank: int | None
    lost: str | None
    idle: str | None
    sampled: tuple[str, ...]
    within_limits: bool | None
    pose: tuple[float, ...] | None


@dataclass(frozen=True)
class FamilyCrossing:
    """
    Where several families meet.

    Attributes
    ----------
    names
        Of their factors.
    rank
        Of the task rows there; None where no pose was found nor proved not to be.
    within_limits, pose
        As those of a factor.
    sampled
        Whether that they meet, and the rank, is seen at sampled poses and not proved.
    """

    names: tuple[str, ...]
    rank: int | None
    sampled: bool
    within_limits: bool | None
    pose: tuple[float, ...] | None


@dataclass(frozen=True)
class Determinant:
    """
    The determinant of the task rows, or what stands in its place, as a product.

    Attributes
    ----------
    square
        Whether there is a determinant; otherwise this is the product of the singular values.
    expression
        Sympy: constant times factors; times `remainder` where there are minors.
    constant
        What has no joint variable.
    remainder
        sqrt of the sum of the squared minors without their common factors; 1 where square.
    view
        In words: axes and point in which it was found.
    rows, columns
        The names of the task rows, and the joints whose columns are used.
    minors
        How many there are.
    identically_zero
        Whether it is 0 at every pose.
    split
        Whether it is proved that no factor is missing: where there are minors, that they have no
        other factor in common.
    """

    square: bool
    rows: tuple[str, ...]
    expression: Any = None
    constant: Any = None
    remainder: Any = None
    view: str = ''
    columns: tuple[str, ...] = ()
    minors: int = 0
    identically_zero: bool = False
    split: bool = False


@dataclass(frozen=True)
class SingularSet:
    """
    Everything that is known of it.

    Attributes
    ----------
    determinant
        What vanishes.
    factors
        One a family.
    crossings
        Of two or more families.
    generic_rank
        Of the task rows at most poses.
    dependent
        Joints whose motions cancel at every pose; empty for most arms.
    complete
        Whether the families are all there is; False where a remainder may vanish too, or where the
        product was not fully split.
    """

    determinant: Determinant
    factors: tuple[SingularFactor, ...]
    crossings: tuple[FamilyCrossing, ...]
    generic_rank: int
    dependent: tuple[str, ...]
    complete: bool


@dataclass(frozen=True)
class _Meaning:
    # What a factor means at poses of its family.
    poses: Floats
    within: Zero
    geometric: str | None = None
    rank: int | None = None
    lost: Lost | None = None
    idle: Idle | None = None


@dataclass(frozen=True)
class FamilySearch:
    """
    An arm in numbers, and what its factors mean.

    Attributes
    ----------
    sampler, arithmetic
        The arm.
    """

    sampler: PoseSampler
    arithmetic: Arithmetic

    def numbers(self, value: Laurent) -> Numbers:
        """Return a factor as a function of size 1."""
        return Numbers(value, self.arithmetic).scaled_to(self.sampler.random())

    def meaning(self, value: Laurent) -> _Meaning:
        """Return what a factor means where it is 0."""
        sampler, arithmetic = self.sampler, self.arithmetic
        numbers = self.numbers(value)
        poses = self.poses([numbers])
        within = self.zero_within_limits([numbers])
        if not len(poses) and within.pose is not None:
            poses = within.pose[None]
        if not len(poses):
            return _Meaning(poses, within)
        arm = sampler.arm(poses)
        variables = arithmetic.names.variables
        joints = [k for k, v in enumerate(variables) if arithmetic.derivative(value, v)]
        rank, angular = rank_at(arm.J_t), any(i >= 3 for i in sampler.rows)
        scales = sampler.robot.task.row_scales
        lost = lost_motion(arm, sampler.rows, rank, sampler.generic_rank, scales)
        name = name_of(arm, sampler.elsewhere, joints, angular)
        return _Meaning(poses, within, name, rank, lost, idle_motion(arm, rank))

    def is_one_family(self, factor: RealFactor) -> bool:
        """Return whether both its halves, if it has any, have the same rank."""
        if not factor.halves:
            return True
        poses = self.poses([self.numbers(factor.value)])
        return not len(poses) or has_one_rank(self.sampler.arm(poses).J_t)

    def poses(self, functions: Sequence[Numbers]) -> Floats:
        """
        Return seeded poses where all functions vanish; few or none where they have no common zero.
        """
        sampler, starts = self.sampler, self.sampler.random()
        scaled = [f.scaled_to(starts) for f in functions]
        scale = np.where(sampler.slides, sampler.robot.task.length / sampler.to_si, 1.0)
        return poses_on(scaled, starts, scale)

    @property
    def _periods(self) -> Floats:
        # After which the frames of each joint repeat, rad.
        units = self.arithmetic.units
        return 2 * np.pi * np.array([units[v] for v in self.arithmetic.names.variables])

    def zero_within_limits(self, functions: Sequence[Numbers]) -> Zero:
        """Return whether functions vanish together inside the joint limits."""
        box = self.sampler.limits(self._periods)
        return common_zero(functions, box, self.sampler.random(within=True))

    def zero_anywhere(self, functions: Sequence[Numbers]) -> Zero:
        """Return whether functions vanish together at any joint positions, limits or none."""
        half = np.where(self.sampler.slides, np.inf, self._periods / 2)
        return common_zero(
            functions, Box(-half, half), np.clip(self.sampler.random(), -half, half)
        )


def families_of(product: Factored, search: FamilySearch) -> Factored | None:
    """
    Return a product whose factors are one family each; None where that takes half angles.

    The halves of a factor are one family where they have the same rank, as those of sin q in most
    arms: stretched and folded.
    """
    found: list[RealFactor] = []
    constant = product.constant
    for factor in product.factors:
        whole = not factor.alone and search.is_one_family(factor)
        if not whole and search.arithmetic.ring.parts == 1:
            return None
        if whole or not factor.halves:
            found.append(factor)
            continue
        found += [RealFactor(half, factor.power) for half in factor.halves]
        # sin q = 2 sin q/2 cos q/2.
        split = reduce(Laurent.__mul__, factor.halves)
        ratio = quotient_constant(factor.value, split, search.arithmetic)
        assert ratio is not None
        constant = reduce(Laurent.__mul__, [ratio] * factor.power, constant)
    return Factored(constant.reduced(), tuple(found), product.complete)


def singular_factors(
    product: Factored, search: FamilySearch, writer: Writer, frames: Frames, J_t: Matrix
) -> tuple[SingularFactor, ...]:
    """Return the factors with their names and what their families mean."""
    sampler, arithmetic = search.sampler, search.arithmetic
    names, generic = arithmetic.names, sampler.generic_rank
    listed = file_factors(sampler.robot, names)
    found: list[SingularFactor] = []
    taken: set[str] = set()
    for factor in product.factors:
        family = family_of(factor.value, arithmetic, writer)
        seen = search.meaning(factor.value)
        sampled: tuple[str, ...] = ()
        if seen.rank is not None:
            zeros = CommonZeros(J_t, generic, (factor.value,), arithmetic)
            sampled = _sampled(zeros, frames, seen.rank, seen.lost, seen.idle)
        expression = writer.expression(factor.value)
        own = _listed_name(listed, search.numbers(factor.value), sampler, names)
        name = _free_name(own or seen.geometric, taken) or str(expression)
        taken.add(name)
        found.append(
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
                _as_tuple(seen.within.pose),
            )
        )
    return tuple(found)


def _free_name(name: str | None, taken: Container[str]) -> str | None:
    # Two sheets of one kind are told apart by numbers: elbow, elbow_2.
    if name is None:
        return None
    numbered = (f'{name}_{k}' for k in count(2))
    return name if name not in taken else next(n for n in numbered if n not in taken)


def _sampled(
    zeros: CommonZeros, frames: Frames, rank: int, lost: Lost | None, idle: Idle | None
) -> tuple[str, ...]:
    # That the rank is no less is seen at one pose; the rest needs proof.
    claims = {
        'rank': zeros.has_rank_at_most(rank),
        'lost': lost is None or proves_lost(lost, zeros, frames),
        'idle': idle is None or zeros.depend(idle.joints),
    }
    return tuple(claim for claim, proved in claims.items() if not proved)


def file_factors(robot: Robot, names: Names) -> dict[str, Any]:
    """Return the factors a robot file lists, as sympy expressions with joint angles in rad."""
    factors = robot.description.singularity.factors
    return {factor.name: names.expression(factor.text) for factor in factors}


def _listed_name(
    listed: dict[str, Any], numbers: Numbers, sampler: PoseSampler, names: Names
) -> str | None:
    # The same factor has the same ratio everywhere.
    q = sampler.random(20)
    ours = numbers(q)
    for name, expression in listed.items():
        theirs = evaluated(expression, names, q)
        ratio = theirs / ours
        if np.ptp(ratio) < 1e-9 * abs(float(ratio[0])):
            return name
    return None


def evaluated(expression: Any, names: Names, q: Floats) -> Floats:
    """Return the values of a sympy expression at poses (..., n), with the lengths of the file."""
    function = sympy.lambdify(names.variables, expression.subs(dict(names.values)), 'numpy')
    return np.broadcast_to(function(*np.moveaxis(q, -1, 0)), q.shape[:-1]).astype(float)


def crossings_of(
    product: Factored, factors: Sequence[SingularFactor], search: FamilySearch, J_t: Matrix
) -> tuple[FamilyCrossing, ...]:
    """Return where two families meet, and all of them where there are more."""
    count = len(factors)
    groups: list[tuple[int, ...]] = [*combinations(range(count), 2)]
    if count > 2:
        groups.append(tuple(range(count)))
    sampler = search.sampler
    # Each of size 1, so that a factor of large numbers hides no other.
    every = [search.numbers(f.value) for f in product.factors]
    found = []
    for group in groups:
        values = tuple(product.factors[k].value for k in group)
        functions = [every[k] for k in group]
        poses = search.poses(functions)
        names = tuple(factors[k].name for k in group)
        meet = None
        if len(poses) < 2:
            meet = search.zero_anywhere(functions)
            if meet.exists is None:
                found.append(FamilyCrossing(names, None, True, None, None))
            if not meet.exists:
                continue
            poses = np.array([meet.pose])
        rank = rank_at(sampler.arm(poses).J_t)
        within = search.zero_within_limits(functions)
        meet = meet or (within if within.exists else search.zero_anywhere(functions))
        zeros = CommonZeros(J_t, sampler.generic_rank, values, search.arithmetic)
        sampled = not meet.exists or not zeros.has_rank_at_most(rank)
        found.append(FamilyCrossing(names, rank, sampled, within.exists, _as_tuple(within.pose)))
    return tuple(found)


def _as_tuple(pose: Floats | None) -> tuple[float, ...] | None:
    return None if pose is None else tuple(pose.tolist())
