# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the factor, 0 to 1, by which joint velocities must be scaled to stop before singular poses
and limits.

A constraint is a limit or a singular pose ahead. The margin m of a constraint is the distance (rad
or m) that is left before it. The margin allows a speed v such that v T + v^2 / (2 a) = m. The left
side is the distance covered in the reaction time T and during a stop with the deceleration a. So
the scaled motion comes to rest when the margin is used up, and never brakes harder than a. All
joints are slowed by one factor, which keeps the path. The joint that brakes slowest determines the
time of a stop.

The factor is not a safety function, because it depends on the reported positions and speeds.
"""

from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ..errors import LoopError, ServoSettingsError
from ..kernel import Floats
from ..robot.chain import FrozenArrays
from ..robot.file.parts.description import SpeedLimit
from ..robot.measures import MEASURES
from ..robot.robot import AnyRobot, Robot, as_robot
from .arguments import check_positive
from .clearance import clearances
from .forward import twist
from .one_or_many import Number, Text
from .servo_rule import ServoRule, servo_factors
from .singularity import Singularities, singularity
from .singularity_rates import AT_REST
from .tool_state import ToolState, evaluate, velocities_of

SINGULARITY, POSITION, VELOCITY = 'singularity', 'position limit', 'velocity limit'
SPEED, TURNING = 'speed limit', 'turning limit'
# Cause of slowing that only MoveIt Servo's rule has: the rule also slows motion away from a
# singular pose.
LEAVING = 'leaving a singularity'
# Largest number of poses along a stopping motion at which the distance to a singular pose is
# computed.
MAX_SEARCHES = 16
# A search finds how far the joints can move until the distance to a singular pose has fallen to
# the threshold `stop`. This is the tolerance of the joint motion that is found, rad.
DISTANCE_TOLERANCE = 1e-3


class Constraint(NamedTuple):
    """
    A limit or a singular pose that may slow a motion.

    Attributes
    ----------
    cause
        `singularity`, `position limit` or `velocity limit` of a joint, `speed limit` or `turning
        limit` of the tool or a point; with MoveIt Servo's rule also `leaving a singularity`.
    of
        Name of the joint, `tool`, or name of the point; empty for the singularity.
    unit
        Unit of the margin, the distance that is left before the limit or singular pose.
    """

    cause: str
    of: str
    unit: str

    @property
    def words(self) -> str:
        """Return the constraint as text: `position limit of elbow`."""
        return f'{self.cause} of {self.of}' if self.of else self.cause


@dataclass(frozen=True, eq=False)
class MotionScale(FrozenArrays, Generic[Number, Text]):
    """
    The factor by which a joint motion is scaled, and the constraint behind it; not a safety
    function.

    The fields are numbers and texts for one motion, arrays for a batch. The scale is the smallest
    of `values`; the first constraint with this value is the cause.

    Attributes
    ----------
    value
        Factor of the joint velocities, 0 to 1.
    cause, of
        As in `Constraint`; empty if the value is 1.
    margin
        The distance that is left before the constraint `cause`. Singularity: distance to the
        nearest singular pose minus the threshold `stop`, rad. With MoveIt Servo's rule: the
        condition number at which the rule stops the arm, minus the present condition number.
        Position limit: distance from the limit, rad or m. Speed: limit minus speed. If `value` is
        1, `margin` belongs to the constraint with the smallest `times`.
    time_left
        Seconds until the unscaled motion has used up the margin; infinite if it never does.
    constraints
        The K constraints.
    values, margins, times : shape (..., K)
        Factor, margin and time of each constraint.
    proved : shape (...)
        Whether it is proved that the arm meets no singular pose while it reacts and brakes from
        the unscaled velocities to rest. If False, the search may have missed a singular pose.
        Always False for arms with closed loops.
    """

    value: Number
    cause: Text
    of: Text
    margin: Number
    time_left: Number
    constraints: tuple[Constraint, ...]
    values: Floats
    margins: Floats
    times: Floats
    proved: npt.NDArray[np.bool_]


# Type of the result of `scale` for a batch of motions.
MotionScales: TypeAlias = MotionScale[Floats, npt.NDArray[np.str_]]


class _Scales(NamedTuple):
    """
    Factors, margins and times, as in `MotionScale`, of some of the constraints on a motion. Each
    array has the shape (..., number of constraints).
    """

    constraints: tuple[Constraint, ...]
    values: Floats
    margins: Floats
    times: Floats


class _Braking(NamedTuple):
    """
    The times of a stop, s.

    `horizon` is the reaction time. `stopping` (...) is the time in which the arm brakes from the
    wanted velocities to rest. The arm covers a distance while it reacts and brakes. At constant
    velocities, it would cover this distance in the time `due` (N,) = horizon + stopping / 2.
    """

    horizon: float
    stopping: Floats
    due: Floats


def scale(
    robot: AnyRobot,
    q: npt.ArrayLike,
    qdot: npt.ArrayLike,
    *,
    horizon: float = 0.1,
    reduced: bool = False,
    rule: ServoRule | None = None,
) -> MotionScale[Any, Any]:
    """
    Return the factor by which joint velocities must be scaled, and its cause.

    The causes are singular poses ahead (the distance to them must not fall below the threshold
    `stop`), limits of joint positions, limits of joint velocities, and `speed_limits` of the tool
    and of points. The robot file gives the `acceleration` with which each joint can brake. Motion
    away from a singular pose or a limit is not slowed. The factor is not a safety function.

    Parameters
    ----------
    robot
        The arm.
    q, qdot : shape (..., n), rad or m, rad/s or m/s
        Joint positions, and the wanted velocities.
    horizon
        Reaction time in s: at least the time until the next step.
    reduced
        Whether the `reduced` speeds of the robot file apply.
    rule
        MoveIt Servo's rule instead of the distance: `ks.ServoRule()` with its defaults. It also
        slows motion away from a singular pose.

    Raises
    ------
    JointVectorError
        The last dimension of `q` or `qdot` is not n, or a number is not finite.
    ServoSettingsError
        `horizon` is not above 0; `reduced` without a reduced speed in the robot file; MoveIt
        Servo's rule for an arm with closed loops.

    Examples
    --------
    An elbow that moves with 1 rad/s is slowed before the arm is stretched, not on its way back:

    >>> import kinematics_service as ks
    >>> result = ks.scale('planar_2r', [0, 0.06], [0, -1.0])
    >>> result.cause, round(result.value, 3), round(result.margin, 3)
    ('singularity', 0.3, 0.03)
    >>> ks.scale('planar_2r', [0, 0.06], [0, 1.0]).value
    1.0
    """
    robot = as_robot(robot)
    check_positive(ServoSettingsError, 'horizon', horizon)
    limits = robot.description.speed_limits
    if reduced and not any(np.isfinite(limit.reduced) for limit in limits):
        advice = 'add reduced to speed_limits in the robot file'
        sentence = f'{robot.name} has no reduced speed; {advice}'
        raise ServoSettingsError(sentence, 'reduced', code='missing-key')
    if not isinstance(rule, ServoRule | None):
        raise ServoSettingsError.refused('rule', 'a ServoRule or None', rule, code='wrong-type')
    if rule is not None:
        rule.check(robot)
    state = evaluate(robot, q, qdot)
    rates = velocities_of(state)
    with np.errstate(invalid='ignore', divide='ignore', over='ignore'):
        stopping = np.max(np.abs(rates) / robot.acceleration_limits, axis=-1)
        braking = _Braking(horizon, stopping, horizon + 0.5 * np.ravel(stopping))
        groups = [
            _singularity(robot, state, rates, braking) if rule is None else _by_rule(state, rule),
            *_joints(robot, state.q, rates, braking),
            *(_speeds(robot, state, rates, limit, reduced) for limit in limits),
        ]
    return _scale(groups, _proved(robot, state, rates, braking))


def _scale(groups: list[_Scales], proved: npt.NDArray[np.bool_]) -> MotionScale[Any, Any]:
    constraints = tuple(constraint for group in groups for constraint in group.constraints)
    values, margins, times = (
        np.concatenate([group[k] for group in groups], axis=-1) for k in (1, 2, 3)
    )
    value = np.min(values, axis=-1)
    k = np.where(value < 1.0, np.argmin(values, axis=-1), np.argmin(times, axis=-1))
    texts = np.array([(constraint.cause, constraint.of) for constraint in constraints])[k]
    texts = np.where((value < 1.0)[..., None], texts, '')
    margin, time_left = (
        np.take_along_axis(numbers, k[..., None], -1)[..., 0] for numbers in (margins, times)
    )
    shown = (value, texts[..., 0], texts[..., 1], margin, time_left)
    if not value.ndim:
        shown = tuple(field.item() for field in shown)
    return MotionScale(*shown, constraints, values, margins, times, proved)


def _braked(
    constraints: tuple[Constraint, ...], margins: Floats, times: Floats, braking: _Braking
) -> _Scales:
    # Compute the factor s with which the scaled motion comes to rest at a limit or singular pose.
    # T is the reaction time. The unscaled motion would brake to rest in the time S (`stopping`).
    # Without braking, it would reach the limit or singular pose in the time t (`times`). The
    # factor solves s T + s^2 S / 2 = t; the code uses the form of the root without cancellation.
    T, stopping = braking.horizon, braking.stopping[..., None]
    kept = 2.0 * times / (T + np.sqrt(T * T + 2.0 * times * stopping))
    values = np.where(np.isfinite(times), np.minimum(kept, 1.0), 1.0)
    return _Scales(constraints, values, margins, times)


def _times(margins: Floats, speeds: Floats) -> Floats:
    # Returns the times in which motions with `speeds` use up the margins (distances before a limit
    # or singular pose); infinite at rest and for motion away.
    used = (speeds > AT_REST) & np.isfinite(margins)
    return np.where(used, np.maximum(margins, 0.0) / np.where(used, speeds, 1.0), np.inf)


def _bounded(constraints: tuple[Constraint, ...], limits: Floats, speeds: Floats) -> _Scales:
    # Returns the factors by which speeds must be scaled to stay within speed limits.
    values = np.minimum(limits / np.maximum(speeds, np.finfo(float).tiny), 1.0)
    times = np.where(speeds > limits, 0.0, np.inf)
    return _Scales(constraints, values, limits - speeds, times)


def _joints(robot: Robot, q: Floats, qdot: Floats, braking: _Braking) -> tuple[_Scales, _Scales]:
    lower, upper = robot.limits.T
    margins, speeds = np.where(qdot > 0.0, upper - q, q - lower), np.abs(qdot)
    named = tuple(zip(robot.joint_names, robot.units))
    positions = tuple(Constraint(POSITION, name, unit) for name, unit in named)
    velocities = tuple(Constraint(VELOCITY, name, f'{unit}/s') for name, unit in named)
    return (
        _braked(positions, margins, _times(margins, speeds), braking),
        _bounded(velocities, robot.velocity_limits, speeds),
    )


def _speeds(
    robot: Robot, state: ToolState, qdot: Floats, limit: SpeedLimit, reduced: bool
) -> _Scales:
    V = twist(robot, state.q, qdot, of=limit.of)
    linear = min(limit.linear, limit.reduced) if reduced else limit.linear
    speeds = np.linalg.norm(V.reshape(*V.shape[:-1], 2, 3), axis=-1)
    both = Constraint(SPEED, limit.of, 'm/s'), Constraint(TURNING, limit.of, 'rad/s')
    return _bounded(both, np.array([linear, limit.angular]), speeds)


def _by_rule(state: ToolState, rule: ServoRule) -> _Scales:
    servo = servo_factors(state, rule)
    margins = np.maximum(rule.hard_stop_singularity_threshold - servo.condition, 0.0)
    times = np.where(servo.rate > 0.0, margins / servo.rate, np.inf)
    leaving = np.stack([~servo.leaving, servo.leaving], axis=-1)
    unit = 'of the condition number'
    return _Scales(
        (Constraint(SINGULARITY, '', unit), Constraint(LEAVING, '', unit)),
        np.where(leaving, servo.values[..., None], 1.0),
        np.stack([margins, margins], axis=-1),
        np.stack([times, times], axis=-1),
    )


def _singularity(robot: Robot, state: ToolState, qdot: Floats, braking: _Braking) -> _Scales:
    # Returns the factor of the velocities that stops the arm before the distance to a singular
    # pose falls below `stop`. Sphere tracing finds the place on the path at which the distance is
    # `stop`: compute the distance, advance by (distance - `stop`), and repeat. No such place is
    # passed over, because a joint motion changes the distance by at most the length of the motion.
    # The tracing ends, at the latest, where the arm would stop if it braked from the unscaled
    # velocities. After the last traced pose, a plane replaces the curved set of singular poses:
    # the plane through the nearest singular pose, normal to the direction toward this pose.
    thresholds, scales = robot.singularity.thresholds, robot.singularity.task.column_scales
    stop = MEASURES['distance'].stop if thresholds.measure != 'distance' else thresholds.stop
    assert stop is not None  # the threshold `stop` of a distance is always a number
    q, rates = (np.reshape(rows, (-1, robot.dof)) for rows in (state.q, qdot))
    speeds = np.linalg.norm(rates / scales, axis=-1)
    passed, times, margins = np.zeros(len(q)), np.full(len(q), np.inf), np.full(len(q), np.nan)
    active = np.arange(len(q))
    for _ in range(MAX_SEARCHES):
        measures, closes = _seen_from(robot, q[active] + passed[active, None] * rates[active])
        times[active[~closes]] = passed[active[~closes]]
        active = active[closes]
        speed, ahead = speeds[active], q[active] + passed[active, None] * rates[active]
        margin = measures.distance - stop
        # Compute the speeds towards the nearest singular poses; NaN if no singular pose was found.
        away = (ahead - measures.nearest_singular) / scales
        normal = away / np.linalg.norm(away, axis=-1, keepdims=True)
        towards = -np.sum(rates[active] / scales * normal, axis=-1)
        times[active] = passed[active] + _times(margin, towards)
        margins[active] = np.where(passed[active] > 0.0, margins[active], margin)
        passed[active] += np.where(speed > AT_REST, np.abs(margin) / speed, np.inf)
        open_yet = (times[active] - passed[active]) * speed > DISTANCE_TOLERANCE
        active = active[open_yet & (passed[active] < braking.due[active])]
        if not len(active):
            break
    shape = state.q.shape[:-1]
    margins, times = (x.reshape(*shape, 1) for x in (margins, times))
    return _braked((Constraint(SINGULARITY, '', 'rad'),), margins, times, braking)


def _proved(
    robot: Robot, state: ToolState, qdot: Floats, braking: _Braking
) -> npt.NDArray[np.bool_]:
    # Returns whether it is proved that the arm meets no singular pose while it reacts and brakes
    # from the unscaled velocities to rest. The proof covers the path with balls in joint space.
    # Each ball is proved to contain no singular pose (see `clearances`).
    q, rates = (np.reshape(rows, (-1, robot.dof)) for rows in (state.q, qdot))
    speeds = np.linalg.norm(rates / robot.singularity.task.column_scales, axis=-1)
    passed = np.where(speeds > AT_REST, 0.0, braking.due)
    active = np.flatnonzero(passed < braking.due)
    for _ in range(MAX_SEARCHES if not robot.chain.loops else 0):
        if not len(active):
            break
        radii = clearances(robot, q[active] + passed[active, None] * rates[active])
        passed[active] += radii / speeds[active]
        active = active[(passed[active] < braking.due[active]) & (radii > DISTANCE_TOLERANCE)]
    return (passed >= braking.due).reshape(state.q.shape[:-1])


def _seen_from(robot: Robot, q: Floats) -> tuple[Singularities, npt.NDArray[np.bool_]]:
    # Returns singularity measures and a mask (N,) for joint positions q (N, n). The mask is True
    # where all loops close; the measures are only for these joint positions. A loop may be unable
    # to close at joint positions beyond a pose with singular loop equations. The search for
    # singular poses may have missed this pose.
    closes = np.ones(len(q), bool)
    while True:
        try:
            return singularity(robot, q[closes]), closes
        except LoopError as error:
            closes[np.flatnonzero(closes)[error.row]] = False
