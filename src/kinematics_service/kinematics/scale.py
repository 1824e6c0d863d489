"""
How much of a joint motion may be kept: 1 for all of it, 0 for a stop.

Every cause allows a speed v at a margin m, the way that is left to it: v T + v^2 / (2 a) = m, the
way of a reaction time T and of a stop at the deceleration a. So an arm that moves at a share of
its command stops at the margin, and never brakes harder than a. All joints are slowed alike, which
keeps the path: the one that brakes slowest says how long a stop takes.

It is no safety function: it knows positions and speeds as they are reported.
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
from .arguments import check_positive, refused
from .clearance import clearances
from .forward import twist
from .one_or_many import Number, Text
from .servo_rule import ServoRule, servo_shares
from .singularity import Singularities, singularity
from .singularity_rates import AT_REST
from .tool_state import ToolState, evaluate, velocities_of

SINGULARITY, POSITION, VELOCITY = 'singularity', 'position limit', 'velocity limit'
SPEED, TURNING = 'speed limit', 'turning limit'
# By MoveIt Servo's rule alone, which slows that as well.
LEAVING = 'leaving a singularity'
# Poses on the way of a stop from which singular poses are looked for, at most.
VIEWS = 16
# How exactly a search finds them, rad.
FOUND = 1e-3


class Constraint(NamedTuple):
    """
    What may slow a motion.

    Attributes
    ----------
    cause
        `singularity`, `position limit` or `velocity limit` of a joint, `speed limit` or `turning
        limit` of the tool or a point; by MoveIt Servo's rule `leaving a singularity`, too.
    of
        The joint, `tool` or the point; empty for the singularity.
    unit
        Of its margin.
    """

    cause: str
    of: str
    unit: str

    @property
    def words(self) -> str:
        """Return the cause and what it is of: `position limit of elbow`."""
        return f'{self.cause} of {self.of}' if self.of else self.cause


@dataclass(frozen=True, eq=False)
class MotionScale(FrozenArrays, Generic[Number, Text]):
    """
    How much of a joint motion may be kept, and why not all of it; no safety function.

    Numbers and texts for one motion, arrays for a batch. The least of `values` is the scale, and
    the first of its constraints is the cause.

    Attributes
    ----------
    value
        The share of the joint velocities, 0 to 1.
    cause, of
        As in `Constraint`; empty where the value is 1.
    margin
        What is left to the cause: joint motion to the distance `stop`, rad, or what is left of the
        condition number; way to the limit of position, rad or m; speed below its limit, negative
        above it. Where the value is 1, that of the constraint which comes first in time.
    time_left
        Seconds until it is used up at the full motion; infinite where it never is.
    constraints
        What has been looked at, K of them.
    values, margins, times : shape (..., K)
        The share, the margin and the time of each.
    proved : shape (...)
        Whether the clearance proves that no singular pose is on the way of a stop. If not, one
        may be ahead that was not found. False for every motion of closed loops.
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


# The result of a batch.
MotionScales: TypeAlias = MotionScale[Floats, npt.NDArray[np.str_]]


class _Shares(NamedTuple):
    """What some of the constraints ask for, shape (..., their number) each."""

    constraints: tuple[Constraint, ...]
    values: Floats
    margins: Floats
    times: Floats


class _Braking(NamedTuple):
    """Reaction time, s, and seconds (...) that a stop of the full motion takes."""

    horizon: float
    stopping: Floats


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
    Return how much of the joint velocities may be kept, and what asks for less.

    The causes are the singularity ahead (`distance`, down to the threshold `stop`), limits of
    joint positions with the way that a stop takes by `acceleration` of the robot file, limits of
    joint velocities, and `speed_limits` of the tool and of points. Motion that leads away from a
    singular pose or a limit is not slowed. It is no safety function.

    Parameters
    ----------
    robot
        The arm.
    q, qdot : shape (..., n), rad or m, rad/s or m/s
        Joint positions, and the velocities that are wanted.
    horizon
        Reaction time in s: not less than the time until the next step.
    reduced
        Whether the `reduced` speeds of the robot file hold.
    rule
        MoveIt Servo's rule in the place of the distance: `ks.ServoRule()` with its defaults. It
        slows what leads away from a singular pose as well.

    Raises
    ------
    JointVectorError
        The last dimension of `q` or `qdot` is not n, or a number is not finite.
    ServoSettingsError
        `horizon` is not above 0; `reduced` where the robot file gives no reduced speed; MoveIt
        Servo's rule for an arm with closed loops.

    Examples
    --------
    An arm that unbends by 1 rad/s is slowed before it is stretched, and not on its way back:

    >>> import kinematics_service as ks
    >>> found = ks.scale('planar_2r', [0, 0.06], [0, -1.0])
    >>> found.cause, round(found.value, 3), round(found.margin, 3)
    ('singularity', 0.3, 0.03)
    >>> ks.scale('planar_2r', [0, 0.06], [0, 1.0]).value
    1.0
    """
    robot = as_robot(robot)
    check_positive(ServoSettingsError, 'horizon', horizon)
    limits = robot.description.speed_limits
    if reduced and not any(np.isfinite(limit.reduced) for limit in limits):
        raise ServoSettingsError(
            f'{robot.name} has no reduced speed: give speed_limits with reduced', 'reduced'
        )
    if not isinstance(rule, ServoRule | None):
        raise refused('rule', 'a ServoRule or None', rule, ServoSettingsError)
    if rule is not None:
        rule.check(robot)
    state = evaluate(robot, q, qdot)
    rates = velocities_of(state)
    with np.errstate(invalid='ignore', divide='ignore', over='ignore'):
        stopping = np.max(np.abs(rates) / robot.acceleration_limits, axis=-1)
        braking = _Braking(horizon, stopping)
        found = [
            _singularity(robot, state, rates, braking) if rule is None else _by_rule(state, rule),
            *_joints(robot, state.q, rates, braking),
            *(_speeds(robot, state, rates, limit, reduced) for limit in limits),
        ]
    return _scale(found, _proved(robot, state, rates, braking))


def _scale(found: list[_Shares], proved: npt.NDArray[np.bool_]) -> MotionScale[Any, Any]:
    constraints = tuple(constraint for one in found for constraint in one.constraints)
    values, margins, times = (
        np.concatenate([one[k] for one in found], axis=-1) for k in (1, 2, 3)
    )
    value = np.min(values, axis=-1)
    k = np.where(value < 1.0, np.argmin(values, axis=-1), np.argmin(times, axis=-1))
    texts = np.array([(one.cause, one.of) for one in constraints])[k]
    texts = np.where((value < 1.0)[..., None], texts, '')
    margin, time_left = (
        np.take_along_axis(one, k[..., None], -1)[..., 0] for one in (margins, times)
    )
    shown = (value, texts[..., 0], texts[..., 1], margin, time_left)
    if not value.ndim:
        shown = tuple(one.item() for one in shown)
    return MotionScale(*shown, constraints, values, margins, times, proved)


def _braked(
    constraints: tuple[Constraint, ...], margins: Floats, times: Floats, braking: _Braking
) -> _Shares:
    # A share s of the motion is stopped within its time t: s T + s^2 S / 2 = t with the time S
    # that a stop of all of it takes, solved for s without cancellation.
    T, stopping = braking.horizon, braking.stopping[..., None]
    kept = 2.0 * times / (T + np.sqrt(T * T + 2.0 * times * stopping))
    values = np.where(np.isfinite(times), np.minimum(kept, 1.0), 1.0)
    return _Shares(constraints, values, margins, times)


def _times(margins: Floats, speeds: Floats) -> Floats:
    # Until margins are used up at speeds; they are not at rest, and not by what leads away.
    used = (speeds > AT_REST) & np.isfinite(margins)
    return np.where(used, np.maximum(margins, 0.0) / np.where(used, speeds, 1.0), np.inf)


def _bounded(constraints: tuple[Constraint, ...], limits: Floats, speeds: Floats) -> _Shares:
    # Of speeds that have a limit themselves.
    values = np.minimum(limits / np.maximum(speeds, np.finfo(float).tiny), 1.0)
    times = np.where(speeds > limits, 0.0, np.inf)
    return _Shares(constraints, values, limits - speeds, times)


def _joints(robot: Robot, q: Floats, qdot: Floats, braking: _Braking) -> tuple[_Shares, _Shares]:
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
) -> _Shares:
    V = twist(robot, state.q, qdot, of=limit.of)
    linear = min(limit.linear, limit.reduced) if reduced else limit.linear
    speeds = np.linalg.norm(V.reshape(*V.shape[:-1], 2, 3), axis=-1)
    both = Constraint(SPEED, limit.of, 'm/s'), Constraint(TURNING, limit.of, 'rad/s')
    return _bounded(both, np.array([linear, limit.angular]), speeds)


def _by_rule(state: ToolState, rule: ServoRule) -> _Shares:
    found = servo_shares(state, rule)
    margins = np.maximum(rule.hard_stop_singularity_threshold - found.condition, 0.0)
    times = np.where(found.rate > 0.0, margins / found.rate, np.inf)
    leaving = np.stack([~found.leaving, found.leaving], axis=-1)
    unit = 'of the condition number'
    return _Shares(
        (Constraint(SINGULARITY, '', unit), Constraint(LEAVING, '', unit)),
        np.where(leaving, found.values[..., None], 1.0),
        np.stack([margins, margins], axis=-1),
        np.stack([times, times], axis=-1),
    )


def _singularity(robot: Robot, state: ToolState, qdot: Floats, braking: _Braking) -> _Shares:
    # No singular pose is nearer than the distance, so the motion may go on by so much before it is
    # looked for again, up to the way of a stop. Seen from the last of these poses, the surface is
    # taken to be at right angles to the way to the nearest one.
    thresholds, scales = robot.singularity.thresholds, robot.singularity.task.column_scales
    stop = MEASURES['distance'].stop if thresholds.measure != 'distance' else thresholds.stop
    assert stop is not None  # the distance has thresholds of its own
    q, rates = (np.reshape(one, (-1, robot.dof)) for one in (state.q, qdot))
    speeds = np.linalg.norm(rates / scales, axis=-1)
    due = braking.horizon + 0.5 * np.ravel(braking.stopping)
    passed, times, margins = np.zeros(len(q)), np.full(len(q), np.inf), np.full(len(q), np.nan)
    left = np.arange(len(q))
    for _ in range(VIEWS):
        found, closes = _seen_from(robot, q[left] + passed[left, None] * rates[left])
        times[left[~closes]] = passed[left[~closes]]
        left = left[closes]
        speed, ahead = speeds[left], q[left] + passed[left, None] * rates[left]
        margin = found.distance - stop
        towards = _towards((ahead - found.nearest_singular) / scales, rates[left] / scales)
        times[left] = passed[left] + _times(margin, towards)
        margins[left] = np.where(passed[left] > 0.0, margins[left], margin)
        passed[left] += np.where(speed > AT_REST, np.abs(margin) / speed, np.inf)
        open_yet = (times[left] - passed[left]) * speed > FOUND
        left = left[open_yet & (passed[left] < due[left])]
        if not len(left):
            break
    shape = state.q.shape[:-1]
    margins, times = (x.reshape(*shape, 1) for x in (margins, times))
    return _braked((Constraint(SINGULARITY, '', 'rad'),), margins, times, braking)


def _proved(
    robot: Robot, state: ToolState, qdot: Floats, braking: _Braking
) -> npt.NDArray[np.bool_]:
    # Whether balls without a singular pose, one after the other, cover the way of a stop.
    q, rates = (np.reshape(one, (-1, robot.dof)) for one in (state.q, qdot))
    speeds = np.linalg.norm(rates / robot.singularity.task.column_scales, axis=-1)
    due = braking.horizon + 0.5 * np.ravel(braking.stopping)
    passed = np.where(speeds > AT_REST, 0.0, due)
    left = np.flatnonzero(passed < due)
    for _ in range(VIEWS if not robot.chain.loops else 0):
        if not len(left):
            break
        radii = clearances(robot, q[left] + passed[left, None] * rates[left])
        passed[left] += radii / speeds[left]
        left = left[(passed[left] < due[left]) & (radii > FOUND)]
    proved: npt.NDArray[np.bool_] = (passed >= due).reshape(state.q.shape[:-1])
    return proved


def _seen_from(robot: Robot, q: Floats) -> tuple[Singularities, npt.NDArray[np.bool_]]:
    # The poses (N, n) at which the closed loops close, and which these are: a search that misses
    # a flat position lets the motion go too far.
    closes = np.ones(len(q), bool)
    while True:
        try:
            return singularity(robot, q[closes]), closes
        except LoopError as error:
            closes[np.flatnonzero(closes)[error.row]] = False


def _towards(away: Floats, rates: Floats) -> Floats:
    # Speeds towards the nearest singular poses; not a number if none was found.
    normal = away / np.linalg.norm(away, axis=-1, keepdims=True)
    return np.asarray(-np.sum(rates * normal, axis=-1))
