"""
The singular set of an arm: factors with names, sheets, ranks, what is lost, where sheets cross.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import sympy

from ..kernel import Floats
from ..robot.robot import Robot
from ..robot.task import ROW_NAMES
from .algebra.arithmetic import Arithmetic
from .algebra.factors import Factored
from .algebra.names import Names
from .algebra.numeric import Numbers, poses_on, typical_size
from .family import Family, family_of
from .sampled_poses import Bench
from .singular_geometry import idle_motion, lost_motion, name_of, rank_at
from .trigonometry import Writer


@dataclass(frozen=True)
class SingularFactor:
    """
    A factor of the determinant (or of every minor) and its sheet of singular poses.

    Attributes
    ----------
    name
        The robot file's where it lists this factor, else from the geometry, else the expression.
    expression
        Sympy; the file's length unit, joint angles in rad.
    power
        How often it stands in the product.
    irreducible
        Whether it cannot be split further, its lengths being letters.
    family
        Where it is 0.
    rank
        Of the task rows on the sheet; None where no pose was found on it.
    lost, idle
        In words: the motion that cannot be made, and the joint motion that makes none.
    within_limits
        Whether poses of the sheet are inside the joint limits, with the lengths of the file.
    """

    name: str
    expression: Any
    power: int
    irreducible: bool
    family: Family
    rank: int | None
    lost: str | None
    idle: str | None
    within_limits: bool


@dataclass(frozen=True)
class Crossing:
    """Where several sheets meet."""

    names: tuple[str, ...]
    rank: int
    within_limits: bool


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
    """

    square: bool
    expression: Any
    constant: Any
    remainder: Any
    view: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    minors: int
    identically_zero: bool


@dataclass(frozen=True)
class SingularSet:
    """
    Everything that is known of it.

    Attributes
    ----------
    determinant
        What vanishes.
    factors
        One a sheet.
    crossings
        Of two or more sheets.
    generic_rank
        Of the task rows at most poses.
    dependent
        Joints whose motions cancel at every pose; empty for most arms.
    complete
        Whether the sheets are all there is; False where a remainder may vanish too, or where the
        product was not fully split.
    """

    determinant: Determinant
    factors: tuple[SingularFactor, ...]
    crossings: tuple[Crossing, ...]
    generic_rank: int
    dependent: tuple[str, ...]
    complete: bool


def singular_factors(
    product: Factored, bench: Bench, arithmetic: Arithmetic, writer: Writer, names: Names
) -> tuple[SingularFactor, ...]:
    """Return the factors with their names and what their sheets mean."""
    robot = bench.robot
    listed = file_factors(robot, names)
    elsewhere = bench.arm(bench.random(200))
    generic = rank_at(elsewhere.J_t)
    found, taken = [], set()
    for factor in product.factors:
        numbers = Numbers(factor.value, arithmetic)
        family = family_of(factor.value, arithmetic, writer)
        poses = sheet_poses(bench, [numbers])
        joints = [
            k for k, v in enumerate(names.variables) if arithmetic.derivative(factor.value, v)
        ]
        rank = lost = idle = geometric = None
        if len(poses):
            arm = bench.arm(poses)
            rank = rank_at(arm.J_t)
            lost = lost_motion(arm, bench.rows, rank, generic, bench.row_scales)
            idle = idle_motion(arm, rank)
            angular = any(i >= 3 for i in bench.rows)
            geometric = name_of(arm, elsewhere, joints, angular)
        expression = writer.expression(factor.value)
        name = _listed_name(listed, numbers, bench, names) or geometric or str(expression)
        if name in taken:
            name = str(expression)
        taken.add(name)
        found.append(
            SingularFactor(
                name,
                expression,
                factor.power,
                product.complete,
                family,
                rank,
                lost,
                idle,
                bool(len(poses)) and bool(bench.inside(poses).any()),
            )
        )
    return tuple(found)


def file_factors(robot: Robot, names: Names) -> dict[str, Any]:
    """Return the factors a robot file lists, as sympy expressions with joint angles in rad."""
    in_file: dict[Any, Any] = {}
    if robot.description.angle_unit == 'deg':
        kinds = dict(zip(robot.variables, robot.joint_types))
        in_file = {v: v * 180 / sympy.pi for v in names.variables if kinds[v.name] != 'prismatic'}
    return {
        factor.name: names.expression(factor.text).subs(in_file)
        for factor in robot.description.singularity.factors
    }


def _listed_name(
    listed: dict[str, Any], numbers: Numbers, bench: Bench, names: Names
) -> str | None:
    # The same factor has the same ratio everywhere.
    q = bench.random(20)
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


def sheet_poses(bench: Bench, functions: Sequence[Numbers]) -> Floats:
    """
    Return seeded poses where all functions vanish; few or none where they have no common zero.
    """
    starts = bench.random()
    scaled = [
        Numbers(f.value.scaled(1, max(1, round(typical_size(f, starts)))), f.arithmetic)
        for f in functions
    ]
    slides = [bench.robot.joint_types[j] == 'prismatic' for j in bench.moving]
    scale = np.where(slides, bench.robot.task.length / bench.to_si, 1.0)
    return poses_on(scaled, starts, scale)


def crossings_of(
    product: Factored, factors: Sequence[SingularFactor], bench: Bench, arithmetic: Arithmetic
) -> tuple[Crossing, ...]:
    """Return where two sheets meet, and all of them where there are more."""
    count = len(factors)
    groups: list[tuple[int, ...]] = [*combinations(range(count), 2)]
    if count > 2:
        groups.append(tuple(range(count)))
    found = []
    for group in groups:
        functions = [Numbers(product.factors[k].value, arithmetic) for k in group]
        poses = sheet_poses(bench, functions)
        if len(poses) < 2:
            continue
        rank = rank_at(bench.arm(poses).J_t)
        within = bool(bench.inside(poses).any())
        found.append(Crossing(tuple(factors[k].name for k in group), rank, within))
    return tuple(found)


def row_names(rows: Sequence[int]) -> tuple[str, ...]:
    """Return names of task rows."""
    return tuple(ROW_NAMES[i] for i in rows)
