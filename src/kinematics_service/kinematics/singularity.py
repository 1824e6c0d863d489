"""How near a pose is to a singular one, which motion is lost there, and which way leads out."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..kernel import Floats
from ..robot.measures import Level
from ..robot.robot import Robot
from . import singularity_rates as measure_rates
from .clearance import clearances
from .factor_distances import FactorMeasures
from .tool_state import ToolState, evaluate


@dataclass(frozen=True, eq=False)
class Singularity:
    """
    The measures of J_t, the task's rows of the Jacobian; numbers for one pose, arrays for a batch.

    Angular rows and prismatic columns of J_t are multiplied by the characteristic length for the
    singular values and what comes of them; determinant and manipulability are of the unscaled J_t.
    Where the arm is structurally deficient everything is taken over the first `generic_rank`
    singular values.

    Attributes
    ----------
    determinant
        det(J_t); None where it is not square.
    manipulability
        Product of the singular values: abs(det), or sqrt(det(J_t J_t^T)) for n > m.
    condition_number, smallest_singular_value, singular_values
        Of the scaled J_t; singular values in descending order, shape (..., min(m, n)).
    rank, generic_rank
        Rank here, and at random poses.
    distance
        Joint motion to the nearest singular pose, rad, 0 to pi (prismatic joints divided by the
        length): to `nearest_singular` where one was found, otherwise a first-order estimate, of
        the named factors where the robot file lists them.
    nearest_singular : shape (..., n), rad or m
        The singular pose nearest to this one, found by Newton's method and evaluated: None where
        none was found or looked for; in a batch, NaN. Limits of joints do not count.
    decided
        False where first or second order say that a singular pose may be near, and none was found.
        It is no proof that there is none.
    clearance
        Radius around this pose in which no pose is singular, rad, at most 1: proved by bounds of
        the Jacobian's change. Computed when it is first asked for.
    lost_direction : shape (..., 6)
        Unit vector of the tool motion that takes most joint motion, in base axes: linear, then
        angular times the length.
    joint_motion : shape (..., n)
        The joints that work against each other: a motion that moves the tool least, rad or m.
    way_out : shape (..., n)
        Joint motion that leads away fastest, rad or m; at a singular pose its opposite does too;
        zero where the first order knows none.
    rate
        Change of the watched measure along qdot, 1/s; None without qdot.
    time_to_warning
        Seconds to the threshold `warn` along qdot: 0 beyond it, inf when it is not approached;
        None without qdot.
    level
        OK, WARN or ERROR by the robot's thresholds, without hysteresis.
    factors
        The named factors, where the robot file lists some; otherwise None.
    """

    determinant: Any
    manipulability: Any
    condition_number: Any
    smallest_singular_value: Any
    singular_values: Floats
    rank: Any
    generic_rank: int
    distance: Any
    nearest_singular: Any
    decided: Any
    clearance: Any
    lost_direction: Floats
    joint_motion: Floats
    way_out: Floats
    rate: Any
    time_to_warning: Any
    level: Any
    factors: FactorMeasures | None


class _OnePose(Singularity):
    """The measures of one pose, each taken out of the kernel's row when it is first asked for."""

    _state: ToolState
    _row: Floats


class _ManyPoses(Singularity):
    """The measures of a batch; what takes long is computed when it is first asked for."""

    _state: ToolState
    _row: Floats


class _Field:
    """A field of one pose, or of many: taken once, and then kept in its place."""

    def __init__(self, name: str, take: Callable[[ToolState, Floats], Any]) -> None:
        self.name, self.take = name, take

    def __get__(self, found: _OnePose | _ManyPoses, owner: type[Singularity]) -> Any:
        value = found.__dict__[self.name] = self.take(found._state, found._row)
        return value


def watched_value(robot: Robot, singularity: Singularity) -> float:
    """Return the watched measure of one pose: |det| for the determinant."""
    return abs(float(getattr(singularity, robot.thresholds.measure)))


_LEVELS = tuple(Level)


def _scalar(column: int) -> Callable[[ToolState, Floats], float]:
    return lambda state, row: row.item(column)


def _read_only(vector: Floats) -> Floats:
    vector.setflags(write=False)
    return vector


def _vector(begin: str, end: str) -> Callable[[ToolState, Floats], Floats]:
    def take(state: ToolState, row: Floats) -> Floats:
        places = state.robot.measure_places
        return _read_only(row[getattr(places, begin) : getattr(places, end)])

    return take


def _determinant(state: ToolState, row: Floats) -> float | None:
    return row.item(kernel.DETERMINANT) if state.robot.task.square else None


def _level(state: ToolState, row: Floats) -> Level:
    return _LEVELS[int(row.item(state.robot.measure_places.judged + kernel.LEVEL))]


def _rate(state: ToolState, row: Floats) -> float | None:
    return float(measure_rates.rates(state, row[None])[0]) if state.moving else None


def _time_to_warning(state: ToolState, row: Floats) -> float | None:
    if not state.moving:
        return None
    rates = measure_rates.rates(state, row[None])
    return float(
        measure_rates.times_to_warning(
            state.robot, measure_rates.watched(state.robot, row[None]), rates
        )[0]
    )


def _nearest_singular(state: ToolState, row: Floats) -> Floats | None:
    pose = row[state.robot.measure_places.pose :]
    return None if math.isnan(pose[0]) else _read_only(pose)


def _decided(state: ToolState, row: Floats) -> bool:
    return row.item(state.robot.measure_places.judged + kernel.DECIDED) != 0.0


def _clearance(state: ToolState, row: Floats) -> float:
    return clearances(state.robot, np.array(state.q[None])).item(0)


def _clearances(state: ToolState, row: Floats) -> Floats:
    q = np.ascontiguousarray(state.q)
    radii = clearances(state.robot, q.reshape(-1, state.robot.dof))
    return _read_only(radii.reshape(q.shape[:-1]))


def _factors(state: ToolState, row: Floats) -> FactorMeasures | None:
    robot = state.robot
    names = robot.factors.names
    if not names:
        return None
    places = robot.measure_places
    return FactorMeasures(
        names=names,
        distances=_read_only(row[places.distances : places.results]),
        results=_read_only(row[places.results : places.pose].reshape(len(names), 1 + robot.dof)),
        column_scales=robot.task.column_scales,
    )


# How each field is taken out of the row of one pose.
_FIELDS: Mapping[str, Callable[[ToolState, Floats], Any]] = {
    'determinant': _determinant,
    'manipulability': _scalar(kernel.MANIPULABILITY),
    'condition_number': _scalar(kernel.CONDITION_NUMBER),
    'smallest_singular_value': _scalar(kernel.SMALLEST_SINGULAR_VALUE),
    'singular_values': _vector('sigma', 'judged'),
    'rank': lambda state, row: int(row.item(kernel.RANK)),
    'generic_rank': lambda state, row: state.robot.task.generic_rank,
    'distance': _scalar(kernel.DISTANCE),
    'nearest_singular': _nearest_singular,
    'decided': _decided,
    'clearance': _clearance,
    'lost_direction': _vector('lost', 'motion'),
    'joint_motion': _vector('motion', 'way'),
    'way_out': _vector('way', 'sigma'),
    'rate': _rate,
    'time_to_warning': _time_to_warning,
    'level': _level,
    'factors': _factors,
}


# What of a batch is computed only when it is asked for.
_LATER: Mapping[str, Callable[[ToolState, Floats], Any]] = {'clearance': _clearances}


for _kind, _fields in ((_OnePose, _FIELDS), (_ManyPoses, _LATER)):
    for _name, _take in _fields.items():
        setattr(_kind, _name, _Field(_name, _take))


def measured(state: ToolState) -> ToolState:
    """Return the state of one pose with its measures there."""
    if state.measures is not None:
        return state
    row = np.empty(state.robot.measure_places.width)
    kernel.measure_one(state.robot.arm, state.row, row)
    return state._replace(measures=row)


def singularity_of(state: ToolState) -> Singularity:
    """Return the measures of an evaluated state (depth JACOBIAN or more)."""
    if state.joints is not None:
        return _of_batch(state)
    if state.measures is None:
        state = measured(state)
    found = _OnePose.__new__(_OnePose)
    kept = found.__dict__
    kept['_state'], kept['_row'] = state, state.measures
    return found


def _of_batch(state: ToolState) -> Singularity:
    robot, n = state.robot, state.robot.dof
    leading = state.row.shape[:-1]
    places = robot.measure_places
    measures = measure_rates.measures_of(state)
    values = measure_rates.watched(robot, measures)
    rates = times = None
    if state.moving:
        rates = measure_rates.rates(state, measures)
        times = measure_rates.times_to_warning(robot, values, rates).reshape(leading)
        rates = rates.reshape(leading)
    measures.setflags(write=False)
    table = measures.reshape(*leading, measures.shape[-1])
    names = robot.factors.names
    factors = None
    if names:
        factors = FactorMeasures(
            names=names,
            distances=table[..., places.distances : places.results],
            results=table[..., places.results : places.pose].reshape(*leading, len(names), 1 + n),
            column_scales=np.broadcast_to(robot.task.column_scales, (*leading, n)),
        )
    found = _ManyPoses.__new__(_ManyPoses)
    found.__dict__.update(
        _state=state,
        _row=measures,
        determinant=table[..., kernel.DETERMINANT] if robot.task.square else None,
        manipulability=table[..., kernel.MANIPULABILITY],
        condition_number=table[..., kernel.CONDITION_NUMBER],
        smallest_singular_value=table[..., kernel.SMALLEST_SINGULAR_VALUE],
        singular_values=table[..., places.sigma : places.judged],
        rank=table[..., kernel.RANK].astype(int),
        generic_rank=robot.task.generic_rank,
        distance=table[..., kernel.DISTANCE],
        nearest_singular=table[..., places.pose :],
        decided=table[..., places.judged + kernel.DECIDED] != 0.0,
        lost_direction=table[..., places.lost : places.motion],
        joint_motion=table[..., places.motion : places.way],
        way_out=table[..., places.way : places.sigma],
        rate=rates,
        time_to_warning=times,
        level=table[..., places.judged + kernel.LEVEL].astype(np.int64),
        factors=factors,
    )
    return found


def singularity(robot: Robot, q: npt.ArrayLike, qdot: npt.ArrayLike | None = None) -> Singularity:
    """
    Return how near joint positions q are to a singular pose.

    Parameters
    ----------
    robot
        The arm; its task, characteristic length and thresholds come from the robot file.
    q : shape (..., n), rad or m
        Joint positions.
    qdot : shape (..., n), rad/s or m/s
        Joint velocities, for `rate` and `time_to_warning`.

    Raises
    ------
    JointVectorError
        The last dimension of `q` or `qdot` is not n, or a number is not finite.
    """
    return singularity_of(evaluate(robot, q, qdot, measured=True))


__all__ = ['FactorMeasures', 'Level', 'Singularity', 'singularity', 'singularity_of']
