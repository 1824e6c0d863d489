# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw random configurations and lengths, so that formulas are not equal by coincidence."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from .....errors import FormulaError
from .....kinematics.tool_state import evaluate
from .....robot.closed_poses import closes_at
from .....robot.file.parts.convention_table import QUANTITIES
from .....robot.file.text.expression_syntax import postorder
from .....robot.robot import Robot
from ...arm.numbers import DEGREE, Evaluation, Floats
from ...arm.world import World
from ..arm.quantities import quantity_of, refusal_of, value_of
from ..text.build import build, is_matrix, number
from ..text.file import Raw, Settings
from ..text.syntax import PARTS
from .names import ANGLE_IN_PLANE, POINT, ROTATION, FormulaNames

SEED = 20240523
POSES = 8
# Range of random constants, m (rad for named angles). With this range, constants are of similar
# size and never 0.
LENGTH_RANGE = (0.3, 1.3)
# If a prismatic joint has no upper limit, its position is drawn from a range of this length, m.
SLIDE_RANGE = 1.0
# An arm is planar if the z axis of the tool always equals the z axis of the base. Two axes are
# taken as equal if `1 - cos(angle)` is below this tolerance.
AXIS_TOLERANCE = 1e-9
# Number of random configurations at which closing the loops is tried.
CLOSURE_SAMPLES = 2000


@dataclass(frozen=True)
class Poses:
    """
    N configurations, and the values of all symbols at these configurations.

    Parameters
    ----------
    values
        N numbers for each symbol, SI units.
    randomised
        Names of the constants that got random values.
    chosen
        Names of the joints whose values the line `at: ...` of the formula file gives.
    coupling : shape (N, P, n)
        Rates of the P passive joints per rate of the n active joints; None without closed loops.
    """

    count: int
    values: Mapping[sp.Symbol, Floats]
    randomised: tuple[str, ...]
    chosen: tuple[str, ...]
    coupling: Floats | None = None


def poses_for(
    robot: Robot,
    names: FormulaNames,
    settings: Settings,
    symbols: frozenset[sp.Symbol],
    fixed: Sequence[tuple[sp.Symbol, sp.Expr]] = (),
    count: int = POSES,
) -> Poses:
    """
    Draw random joint positions, and random values of the constants in a formula, to evaluate the
    formula numerically.

    Parameters
    ----------
    symbols
        Symbols in the formula. Constants among them get random values, unless `fixed` or the line
        `at: ...` of the formula file gives them a value. An arm with closed loops keeps its own
        constants, for which the loops close.
    fixed
        Constants to which the formula file gives a value, and these values.

    Raises
    ------
    FormulaError
        The line `at: ...` or `point: ...` of the formula file has an unknown name, or closed loops
        do not close with the given values.
    """
    table, rng = names.table, np.random.default_rng(SEED)
    pairs = [(symbol, _number(value)) for symbol, value in reversed(fixed)]
    pairs += [_given(raw, settings, names) for raw in settings.at]
    given = {symbol: np.full(count, value) for symbol, value in pairs}
    values = {sp.Symbol(f'{name}_i'): rng.uniform(*LENGTH_RANGE, count) for name in QUANTITIES}
    randomised = []
    for symbol in table.constants:
        if symbol in given:
            values[symbol] = given[symbol]
        elif symbol in table.derived:
            values[symbol] = Evaluation(values, count).of(table.derived[symbol])
        elif symbol in symbols and not table.passive:
            values[symbol] = np.full(count, rng.uniform(*LENGTH_RANGE))
            randomised.append(symbol.name)
        else:
            values[symbol] = np.full(count, table.given[symbol])
    for k, symbol in enumerate(table.variables[: table.joints]):
        values[symbol] = given.get(symbol, _drawn(robot, k, rng, count))
    coupling = _close(robot, names, values, given, count) if table.passive else None
    located = _with_coordinates(values, names, settings, count)
    if ANGLE_IN_PLANE in symbols and np.isnan(located[ANGLE_IN_PLANE]).any():
        message = 'phi: the tool does not turn about z alone; define phi, as in phi = q1 + q2'
        raise FormulaError(message, code='unknown-name')
    chosen = tuple(s.name for s in table.variables if s in given)
    return Poses(count, located, tuple(randomised), chosen, coupling)


def _close(
    robot: Robot,
    names: FormulaNames,
    values: dict[sp.Symbol, Floats],
    given: Mapping[sp.Symbol, Floats],
    count: int,
) -> Floats:
    # Draw positions of the active joints at which the closed loops close, and compute the
    # positions of the passive joints. Return the rates of the passive joints per rate of the
    # active joints.
    table, rng = names.table, np.random.default_rng(SEED)
    joints = table.variables[: table.joints]
    for symbol in given:
        if symbol not in joints:
            reason = 'follows from the joints' if symbol in table.variables else 'is a constant'
            accepted = ', '.join(joint.name for joint in joints)
            message = f'at: {symbol} {reason}; with closed loops give values of {accepted} only'
            raise FormulaError(message, code='unsupported')
    drawn = [_drawn(robot, k, rng, CLOSURE_SAMPLES) for k in range(table.joints)]
    q = np.stack([values[joint] for joint in joints], axis=1)
    for k, joint in enumerate(joints):
        drawn[k] = np.full(CLOSURE_SAMPLES, given[joint][0]) if joint in given else drawn[k]
    # Draw no further positions if the line `at: ...` of the formula file gives all joint
    # positions.
    tried = q if given.keys() >= set(joints) else np.concatenate([q, np.stack(drawn, axis=1)])
    good = tried[closes_at(robot.chain, tried)]
    if len(good) < count:
        raise FormulaError(
            f'the loops of {robot.name} close at {len(good)} of {len(tried)} random positions; '
            "give positions at which they close, such as 'at: q1=0.5, q2=1'"
            if not given
            else f'at: the loops of {robot.name} do not close there; give other positions',
            code='open-loop',
        )
    closure = evaluate(robot, good[:count]).closure
    assert closure is not None  # an arm with passive joints has a loop closure
    for k, joint in enumerate(joints):
        values[joint] = good[:count, k]
    for k, symbol in enumerate(table.variables[table.joints :]):
        values[symbol] = closure.passive[:, k]
    return closure.coupling


def _drawn(robot: Robot, k: int, rng: np.random.Generator, count: int) -> Floats:
    low, high = robot.limits[k]
    if robot.prismatic[k]:
        low = low if np.isfinite(low) else 0.0
        high = high if np.isfinite(high) else low + SLIDE_RANGE
        # Draw no positions near the lower limit. A retracted joint may have length 0, at which
        # formulas are undefined or equal by coincidence.
        low += 0.1 * (high - low)
    elif not np.isfinite(high - low):
        low, high = -np.pi, np.pi
    return rng.uniform(low, high, count)


def _with_coordinates(
    values: dict[sp.Symbol, Floats], names: FormulaNames, settings: Settings, count: int
) -> dict[sp.Symbol, Floats]:
    world = World(names.table, values, count)
    point = world.pose[:, :3, 3]
    if settings.point:
        quantity = quantity_of(settings.point)
        if quantity is None or quantity.kind not in ('origin', 'vector', 'position'):
            message = f'point: {settings.point!r} is not a point; write for example o_3'
            raise FormulaError(message, code='unknown-name')
        if refusal := refusal_of(quantity, names.table, settings):
            raise FormulaError(f'point: {refusal.message}', code=refusal.code)
        point = value_of(quantity, world, settings)[:, :, 0]
    located = {symbol: point[:, k] for k, symbol in enumerate(POINT)}
    located |= {symbol: world.pose[:, i, j] for (i, j), symbol in ROTATION.items()}
    R = world.pose[:, :3, :3].real
    in_plane = np.all(np.abs(R[:, 2, 2] - 1.0) < AXIS_TOLERANCE)
    located[ANGLE_IN_PLANE] = (
        np.arctan2(R[:, 1, 0], R[:, 0, 0]) if in_plane else R[:, 0, 0] * np.nan
    )
    return {**located, **values}


def _given(raw: Raw, settings: Settings, names: FormulaNames) -> tuple[sp.Symbol, float]:
    at = raw.left.at
    key = raw.left.text if raw.left.kind == 'name' else ''
    joint = names.joint(key)
    symbol = names.constants.get(key) if joint is None else names.table.variables[joint]
    if symbol is None:
        known = ', '.join(s.name for s in (*names.table.variables, *names.table.constants))
        message = f'at: {at.written!r} is neither a joint nor a constant (known: {known})'
        raise at.fault(message, 'unknown-name')
    value = build(raw.right, lambda token: names.value(token, settings), number)
    if is_matrix(value) or not value.is_number:
        message = f'at: {at.written} must be a number, such as {at.written}=0.5'
        raise at.fault(message, 'not-a-number')
    result = _number(value)
    turns = joint is not None and not names.table.slides[joint]
    has_unit = any(part.kind == 'deg' for part in postorder(raw.right, PARTS))
    return symbol, result * DEGREE if turns and settings.degrees and not has_unit else result


def _number(value: sp.Expr) -> float:
    return float(Evaluation({}, 1).of(value)[0])
