"""Random poses and random lengths, at which what is equal by coincidence only is not equal."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp  # type: ignore[import-untyped]

from ....errors import FormulaError
from ....robot.file.convention_table import QUANTITIES
from ....robot.robot import Robot
from ..arm.numbers import DEGREE, Evaluation, Floats
from ..arm.quantities import numeric, quantity_of, why_out_of_range
from ..arm.world import World
from ..text.build import build, is_matrix
from ..text.file import Raw, Settings
from ..text.syntax import Node
from .names import FormulaNames, coordinates, reading_of, rotation_entries

SEED = 20240523
POSES = 8
LENGTHS = (0.3, 1.3)  # m, and rad for named angles
SLIDE = 1.0  # m of an unlimited prismatic joint


@dataclass(frozen=True)
class Poses:
    """
    N configurations and the value of every symbol at them.

    Parameters
    ----------
    values
        N numbers for each symbol, SI.
    randomised
        Names of the constants that got random values.
    chosen
        Names of the joints that `at` gives values.
    """

    count: int
    values: Mapping[Any, Floats]
    randomised: tuple[str, ...]
    chosen: tuple[str, ...]


def poses_for(
    robot: Robot,
    names: FormulaNames,
    settings: Settings,
    symbols: frozenset[Any],
    fixed: Sequence[tuple[Any, Any]] = (),
    count: int = POSES,
) -> Poses:
    """
    Return poses for a formula in which certain symbols stand.

    Parameters
    ----------
    symbols
        Constants among them get random values, unless `fixed` or the `at` line gives them one.
    fixed
        Constants and their values.

    Raises
    ------
    FormulaError
        The `at` or `point` line names what is not there.
    """
    table, rng = names.table, np.random.default_rng(SEED)
    given: dict[Any, Floats] = {}
    for raw in settings.at:
        symbol, value = _given(raw, settings, names)
        given[symbol] = np.full(count, value)
    for symbol, value in fixed:
        given.setdefault(symbol, np.full(count, _number(value)))
    values: dict[Any, Floats] = {}
    for name in QUANTITIES:
        values[sp.Symbol(f'{name}_i')] = rng.uniform(0.3, 1.3, count)
    randomised = []
    for symbol in table.constants:
        if symbol in given:
            values[symbol] = given[symbol]
        elif symbol in table.derived:
            values[symbol] = Evaluation(values, count).of(table.derived[symbol])
        elif symbol in symbols:
            values[symbol] = np.full(count, rng.uniform(*LENGTHS))
            randomised.append(symbol.name)
        else:
            values[symbol] = np.full(count, table.given[symbol])
    for k, symbol in enumerate(table.variables):
        drawn = _drawn(robot, k, rng, count)
        values[symbol] = given.get(symbol, drawn)
    located = _with_coordinates(values, names, settings, count)
    chosen = tuple(s.name for s in table.variables if s in given)
    return Poses(count, located, tuple(randomised), chosen)


def _drawn(robot: Robot, k: int, rng: np.random.Generator, count: int) -> Floats:
    low, high = robot.limits[k]
    turning = robot.joint_types[k] != 'prismatic'
    if turning:
        low, high = (low, high) if np.isfinite(high - low) else (-np.pi, np.pi)
    else:
        low = low if np.isfinite(low) else 0.0
        high = high if np.isfinite(high) else low + SLIDE
        low += 0.1 * (high - low)  # an arm that is not extended at all is a special case
    return rng.uniform(low, high, count)


def _with_coordinates(
    values: dict[Any, Floats], names: FormulaNames, settings: Settings, count: int
) -> dict[Any, Floats]:
    world = World(names.table, values, count)
    point = world.pose[:, :3, 3]
    if settings.point:
        quantity = quantity_of(settings.point)
        reading = reading_of(settings)
        if quantity is None or quantity.kind not in ('origin', 'vector', 'position'):
            raise FormulaError(f"point: {settings.point!r} is no point: write 'point: o_3'")
        rows, joints = len(names.table.rows), len(names.table.variables)
        if reason := why_out_of_range(quantity, rows, joints, reading):
            raise FormulaError(f'point: {reason}')
        point = numeric(quantity, world, reading)[:, :, 0]
    located = {symbol: point[:, k] for k, symbol in enumerate(coordinates())}
    for (i, j), symbol in rotation_entries().items():
        located[symbol] = world.pose[:, i, j]
    return {**located, **values}


def _given(raw: Raw, settings: Settings, names: FormulaNames) -> tuple[Any, float]:
    at = raw.left.at
    key = raw.left.text if raw.left.kind == 'name' else ''
    joint = names.joint(key)
    symbol = names.constant(key) if joint is None else names.table.variables[joint]
    if symbol is None:
        known = ', '.join(s.name for s in (*names.table.variables, *names.table.constants))
        message = f'at: {at.written!r} is neither a joint nor a constant (known: {known})'
        raise FormulaError(message, at.line, at.column)
    value = build(raw.right, lambda token: names.value(token, settings))
    if is_matrix(value) or not value.is_number:
        message = f'at: {at.written} must be a number'
        raise FormulaError(message, at.line, at.column)
    result = _number(value)
    turns = joint is not None and names.table.joint_types[joint] != 'prismatic'
    if turns and settings.degrees and not _has_unit(raw.right):
        result *= DEGREE
    return symbol, result


def _number(value: Any) -> float:
    return float(Evaluation({}, 1).of(value)[0])


def _has_unit(node: Node) -> bool:
    return node.kind == 'deg' or any(_has_unit(part) for part in node.parts)
