"""How near a pose is to a singular one, which motion is lost there, and which way leads out."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, Generic, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..kernel import Floats, Integers
from ..notebook import as_html
from ..robot.measure_places import MeasurePlaces
from ..robot.measures import MEASURES, Level, why_unsearched
from ..robot.robot import AnyRobot, Robot, as_robot
from . import singularity_rates as measure_rates
from .clearance import clearances
from .factor_distances import FactorMeasures, same_values
from .one_or_many import Grade, Index, Number, Pose
from .tool_state import ToolState, evaluate


@dataclass(frozen=True, eq=False)
class Singularity(Generic[Number, Index, Grade, Pose]):
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
        Joint motion to the nearest singular pose that was found, rad, 0 to 1 (prismatic joints
        divided by the length): to `nearest_singular`; 1 means that none was found within 1 rad. It
        is an upper bound of the true distance; `clearance` is a lower bound. Above 16 joints, and
        for positions beyond 1e5 rad, no search is made.
    nearest_singular : shape (..., n), rad or m
        The singular pose nearest to this one, found by Newton's method and evaluated: None where
        none was found or looked for; in a batch, NaN. Limits of joints do not count. Of an arm
        with closed loops it may be where a loop is flat (`flat_loop`).
    clearance
        Radius around this pose in which no pose is singular, rad, at most 1: proved by bounds of
        the Jacobian's change. Computed when it is first asked for. 0 for arms with closed loops,
        of which nothing is proved.
    lost_direction : shape (..., 6)
        Unit vector of the tool motion that takes most joint motion, in base axes: linear, then
        angular times the length.
    joint_motion : shape (..., n)
        The joints that work against each other: a motion that moves the tool least, rad or m.
    way_out : shape (..., n)
        Joint motion that leads away fastest, rad or m; at a singular pose its opposite does too;
        zero where the first order knows none. Near a flat position of a closed loop (`flat_loop`)
        it leads away from there; of such an arm where none was found, from what the first order
        says to be nearest.
    rate
        Change of the watched measure along qdot, 1/s; None without qdot.
    time_to_warning
        Seconds to the threshold `warn` along qdot: 0 beyond it, inf when it is not approached;
        None without qdot.
    level
        OK, WARN or ERROR by the robot's thresholds, without hysteresis. It is also WARN where the
        condition number exceeds 1e4 though the distance is above `warn`.
    factors
        The named factors, where the robot file lists some, and behind them the closed loops, by
        the determinants of their closure; otherwise None.
    """

    determinant: Number | None
    manipulability: Number
    condition_number: Number
    smallest_singular_value: Number
    singular_values: Floats
    rank: Index
    generic_rank: int
    distance: Number
    nearest_singular: Pose
    clearance: Number
    lost_direction: Floats
    joint_motion: Floats
    way_out: Floats
    rate: Number | None
    time_to_warning: Number | None
    level: Grade
    factors: FactorMeasures[Index] | None

    def __repr__(self) -> str:
        one: Singularity[Any, Any, Any, Any] = self
        if np.ndim(one.level):
            counts = ((level.name, int(np.sum(one.level == level))) for level in Level)
            words = ', '.join(f'{count} {name}' for name, count in counts if count)
            return f'Singularity({np.size(one.level)} poses: {words or "none"})'
        distance = none_found(one) or f'{one.distance:.4g} rad'
        name, value = 'determinant', one.determinant
        if value is None:
            name, value = 'manipulability', one.manipulability
        return (
            f'Singularity({one.level.name}, distance {distance}, {name} {value:.4g}, '
            f'rank {self.rank} of {self.generic_rank})'
        )

    _repr_html_ = as_html

    def __eq__(self, other: object) -> bool:
        """Compare every value exactly; what is no number equals itself."""
        return same_values(self, other) if isinstance(other, Singularity) else NotImplemented

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Copy and pickle the values alone, and not the arm they are of."""
        return Singularity, tuple(getattr(self, field.name) for field in fields(self))


T = TypeVar('T')


class _cached(Generic[T]):
    """functools.cached_property without the lock that costs 1 us a value before Python 3.12."""

    def __init__(self, take: Callable[[Any], T]) -> None:
        self._take = take

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, found: Any, owner: type) -> T:
        value = found.__dict__[self._name] = self._take(found)
        return value


class _TakenMeasures(Singularity[Any, Any, Any, Any]):
    """
    Measures that are taken out of the kernel's rows when they are first asked for.

    Made of keywords it has their values: so `dataclasses.replace` makes one.

    Attributes
    ----------
    _first : shape (width,), or (..., width) for a batch
        Those of a batch are by first order: its singular poses are looked for when something is
        asked that needs them.
    """

    _state: ToolState
    _first: Floats

    def __init__(
        self,
        state: ToolState | None = None,
        first: Floats | None = None,
        found: Floats | None = None,
        **values: Any,
    ) -> None:
        if state is None:
            super().__init__(**values)
        else:
            kept = self.__dict__
            kept['_state'], kept['_first'] = state, first
            if found is not None:
                kept['_found'] = found

    @property
    def _robot(self) -> Robot:
        return self._state.robot

    @property
    def _places(self) -> MeasurePlaces:
        return self._state.robot.singularity.measure_places

    @_cached
    def _found(self) -> Floats:
        found = measure_rates.searched(self._state, _flat(self._first))
        return found.reshape(self._first.shape)

    @property
    def _watched(self) -> Floats:
        # What the level depends on.
        return (
            self._found
            if self._robot.singularity.thresholds.measure == 'distance'
            else self._first
        )

    def _shown(self, numbers: Floats) -> Any:
        # Of a number for each pose, (N,).
        leading = self._first.shape[:-1]
        return _read_only(numbers.reshape(leading)) if leading else numbers.item()

    @_cached
    def determinant(self) -> Any:
        square = self._state.robot.singularity.task.square
        return _column(self._first, kernel.DETERMINANT) if square else None

    manipulability = _cached(lambda one: _column(one._first, kernel.MANIPULABILITY))
    condition_number = _cached(lambda one: _column(one._first, kernel.CONDITION_NUMBER))
    smallest_singular_value = _cached(
        lambda one: _column(one._first, kernel.SMALLEST_SINGULAR_VALUE)
    )
    singular_values = _cached(lambda one: _part(one._first, one._places.sigma, one._places.judged))

    @_cached
    def rank(self) -> Any:
        rank = _column(self._first, kernel.RANK)
        return int(rank) if self._first.ndim == 1 else _read_only(rank.astype(int))

    @_cached
    def generic_rank(self) -> int:
        return self._robot.singularity.task.generic_rank

    distance = _cached(lambda one: _column(one._found, kernel.DISTANCE))

    @_cached
    def nearest_singular(self) -> Floats | None:
        poses = _part(self._found, self._places.pose, self._places.width)
        return None if poses.ndim == 1 and math.isnan(poses[0]) else poses

    @_cached
    def clearance(self) -> Any:
        return self._shown(clearances(self._robot, np.array(_flat(self._state.q))))

    lost_direction = _cached(lambda one: _part(one._first, one._places.lost, one._places.motion))
    joint_motion = _cached(lambda one: _part(one._first, one._places.motion, one._places.way))
    way_out = _cached(lambda one: _part(one._first, one._places.way, one._places.sigma))

    @_cached
    def rate(self) -> Any:
        if not self._state.moving:
            return None
        return self._shown(measure_rates.rates(self._state, _flat(self._watched)))

    @_cached
    def time_to_warning(self) -> Any:
        if self.rate is None:
            return None
        values = measure_rates.watched(self._robot, _flat(self._watched))
        rates = np.reshape(self.rate, -1)
        return self._shown(measure_rates.times_to_warning(self._robot, values, rates))

    @_cached
    def level(self) -> Any:
        k = self._state.robot.singularity.measure_places.judged + kernel.LEVEL
        if self._first.ndim == 1:
            return _LEVELS[int(self._first.item(k))]
        return _read_only(self._watched[..., k].astype(int))

    @_cached
    def factors(self) -> FactorMeasures[Any] | None:
        robot, places, first = self._robot, self._places, self._first
        names, leading = robot.singularity.factors.names, first.shape[:-1]
        if not names:
            return None
        results = _part(first, places.results, places.pose)
        return FactorMeasures(
            names=names,
            estimates=_part(first, places.distances, places.results),
            results=results.reshape(*leading, len(names), 1 + robot.dof),
            column_scales=np.broadcast_to(
                robot.singularity.task.column_scales, (*leading, robot.dof)
            ),
        )


def _column(measures: Floats, k: int) -> Any:
    return measures.item(k) if measures.ndim == 1 else _read_only(measures[..., k])


def _part(measures: Floats, begin: int, end: int) -> Floats:
    return _read_only(measures[..., begin:end])


def _flat(table: Floats) -> Floats:
    return table.reshape(-1, table.shape[-1])


_LEVELS = tuple(Level)


def _read_only(vector: Floats) -> Floats:
    vector.setflags(write=False)
    return vector


# The result of a batch.
Singularities: TypeAlias = Singularity[Floats, Integers, Integers, Floats]


def watched_value(robot: Robot, singularity: Singularity) -> float:
    """Return the watched measure of one pose: |det| for the determinant."""
    return abs(float(getattr(singularity, robot.singularity.thresholds.measure)))


def unsearched(singularity: Singularity) -> str:
    """Return why no singular pose was looked for near one pose; empty if it was."""
    state: ToolState | None = singularity.__dict__.get('_state')
    farthest = 0.0
    if state is not None:
        farthest = float(np.max(np.abs(state.q / state.robot.singularity.task.column_scales)))
    return why_unsearched(len(singularity.joint_motion), farthest)


def none_found(singularity: Singularity) -> str:
    """Return that no singular pose was found near one pose, or why; empty if one was found."""
    none = MEASURES['distance'].farther(singularity.distance)
    reason = none and unsearched(singularity)
    return f'unknown: {reason}' if reason else none


def nearest_factor(robot: Robot, singularity: Singularity) -> int | None:
    """
    Return the factor that is zero at the distance of one pose; None where none is known to be.
    """
    factors = singularity.factors
    if factors is None or singularity.nearest_singular is None:
        return None
    k = factors.nearest
    near = robot.singularity.factors.may_name(
        k, float(factors.estimates[k]), float(singularity.distance)
    )
    return k if near else None


def flat_loop(robot: Robot, singularity: Singularity) -> str:
    """
    Return the closed loop that is flat at the distance of one pose; empty where it is the arm that
    is singular there.

    At a flat position the branch of a loop ends or meets another, and the motors no longer hold
    what it moves: no direction of the tool is lost.
    """
    k = nearest_factor(robot, singularity)
    return (
        ''
        if k is None or not robot.singularity.factors.is_loop(k)
        else robot.singularity.factors.names[k]
    )


def measured(state: ToolState) -> ToolState:
    """Return the state of one pose with its measures there."""
    return state if state.measures is not None else state._replace(measures=_measure(state))


def measured_in_order(state: ToolState, search: kernel.NearestSearch) -> ToolState:
    """
    Return the poses of a motion with their measures there, `search` that of the poses before.
    """
    first = measure_rates.measures_of(state)
    return state._replace(measures=measure_rates.searched(state, first, search))


def measured_before(state: ToolState, distance: Floats, nearest_singular: Floats) -> ToolState:
    """
    Return poses with their measures there, what a search had found (N,), (N, n) kept of it.
    """
    measures = measure_rates.recalled(state, distance, nearest_singular)
    return state._replace(measures=measures)


def _measure(state: ToolState) -> Floats:
    row = np.empty(state.robot.singularity.measure_places.width)
    kernel.measure_one(kernel.NearestSearch(state.robot.singularity.arm), state.row, row)
    return row


def singularity_of(state: ToolState) -> Singularity[Any, Any, Any, Any]:
    """Return the measures of an evaluated state (depth JACOBIAN or more)."""
    measures = state.measures
    if state.joints is None:
        row = _measure(state) if measures is None else measures
        return _TakenMeasures(state, row, row)
    table = measure_rates.measures_of(state) if measures is None else measures
    table = table.reshape(*state.row.shape[:-1], table.shape[-1])
    return _TakenMeasures(state, table, None if measures is None else table)


def singularity(
    robot: AnyRobot, q: npt.ArrayLike, qdot: npt.ArrayLike | None = None
) -> Singularity[Any, Any, Any, Any]:
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
    robot = as_robot(robot)
    return singularity_of(evaluate(robot, q, qdot, measured=True))


__all__ = ['FactorMeasures', 'Level', 'Singularity', 'flat_loop', 'singularity', 'singularity_of']
