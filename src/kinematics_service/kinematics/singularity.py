# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute how near an arm is to a singular pose.

The results include the distance to the nearest singular pose, the tool direction that is lost
there, the joint motion that leads away (way out), and the level OK, WARN or ERROR.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, Generic, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..kernel import Floats, Integers
from ..notebook import as_html
from ..robot.factors import motions_to_zeros
from ..robot.measure_places import MeasurePlaces
from ..robot.measures import MEASURES, Level, why_unsearched
from ..robot.robot import AnyRobot, Robot, as_robot
from . import singularity_rates as measure_rates
from .clearance import clearances
from .one_or_many import Grade, Index, Number, Pose
from .tool_state import ToolState, evaluate


@dataclass(frozen=True, eq=False)
class FactorMeasures(Generic[Index]):
    """
    The values and gradients of the singular factors of the robot file, at one pose or many. A
    factor is a named function of the joint positions that is zero at singular poses.

    Attributes
    ----------
    names
        F names, as in the robot file.
    estimates : shape (..., F)
        First-order estimate of the joint motion to the nearest zero of each factor, rad, 0 to pi.
        The factor of a closed loop is zero where the loop equations are singular. If the search
        has found such joint positions, the distance to them replaces the estimate.
    results : shape (..., F, 1 + n)
        Value and gradient of each factor.
    column_scales : shape (..., n)
        Joint motions are divided by these scales: 1 for a revolute joint, the characteristic
        length (m) for a prismatic joint.
    """

    names: tuple[str, ...]
    estimates: Floats
    results: Floats
    column_scales: Floats

    def __eq__(self, other: object) -> bool:
        """Compare every value exactly; NaN equals NaN."""
        return _same_values(self, other) if isinstance(other, FactorMeasures) else NotImplemented

    @property
    def values(self) -> Floats:
        """Return the values of the F singular factors of the arm, shape (..., F)."""
        return self.results[..., 0]

    @property
    def motions(self) -> Floats:
        """
        Return the joint motions that bring each singular factor to zero, to first order.

        The shape is (..., F, n), rad or m. A factor is a function of the joint positions that is
        zero at singular poses.
        """
        return motions_to_zeros(self.results, self.column_scales[..., None, :])

    @property
    def nearest(self) -> Index:
        """
        Return the index of the singular factor with the smallest number in `estimates`.

        This factor becomes zero after the smallest joint motion, to first order. The index is an
        int for one pose, an array (...) for many.
        """
        indices = self.estimates.argmin(axis=-1)
        index: Index = indices if indices.ndim else indices.item()
        return index


def _same_values(result: Any, other: Any) -> bool:
    """Return whether the fields of two results hold equal values; NaN equals NaN."""

    def same(a: Any, b: Any) -> bool:
        if isinstance(a, np.ndarray | float) and isinstance(b, np.ndarray | float):
            return np.array_equal(a, b, equal_nan=True)
        return type(a) is type(b) and bool(a == b)

    return all(same(getattr(result, f.name), getattr(other, f.name)) for f in fields(result))


@dataclass(frozen=True, eq=False)
class Singularity(Generic[Number, Index, Grade, Pose]):
    """
    The singularity measures of the task Jacobian J_t: numbers for one pose, arrays for a batch.

    For singular values and all that depends on them, angular rows and prismatic columns of J_t are
    multiplied by the characteristic length. Determinant and manipulability are of the unscaled
    J_t. If the arm is structurally deficient, all measures use the first `generic_rank` singular
    values.

    Attributes
    ----------
    determinant
        det(J_t); None if J_t is not square.
    manipulability
        Product of the singular values: abs(det), or sqrt(det(J_t J_t^T)) for n > m.
    condition_number, smallest_singular_value, singular_values
        Measures of the scaled J_t; singular values in descending order, shape (..., min(m, n)).
    rank, generic_rank
        Rank at this pose, and at random poses.
    distance
        Joint motion to `nearest_singular`, rad, 0 to 1 (prismatic motions are divided by the
        characteristic length); 1 means that the search found no singular pose within 1 rad. It is
        an upper bound of the true distance; `clearance` is a lower bound. If the arm has more than
        16 joints, or a position exceeds 1e5 rad, nothing is searched.
    nearest_singular : shape (..., n), rad or m
        The joint positions of the nearest singular pose that Newton's method found. If it found no
        pose or nothing was searched, the value is None, or NaN in a batch. Joint limits are
        ignored. In an arm with closed loops, a pose is also singular if the equations of a loop
        are singular (`flat_loop`).
    clearance
        Radius around this pose in which no pose is singular, rad, at most 1, proved by bounds of
        the Jacobian's change. It is computed at the first access. For arms with closed loops
        nothing is proved, and the radius is 0.
    lost_direction : shape (..., 6)
        Unit vector of the tool motion that needs the largest joint motion, in base axes: linear,
        then angular times the characteristic length.
    joint_motion : shape (..., n)
        The unit joint motion that moves the tool least, rad or m. At a singular pose it does not
        move the tool: the motions of the joints cancel each other.
    way_out : shape (..., n)
        Joint motion that leads away from singular poses fastest, rad or m. It follows the gradient
        of the manipulability (at a singular pose, of the smallest singular value), and is zero if
        this gradient is zero. At a singular pose the opposite motion leads away, too. In an arm
        with closed loops, the equations of a loop may be singular at the nearest singular pose
        (`flat_loop`). Then the motion follows the gradient of the size of their determinant
        instead. If the search found no singular pose, the nearest singular pose is estimated to
        first order.
    rate
        Change per second, along qdot, of the measure to which the robot's thresholds apply; None
        without qdot.
    time_to_warning
        Seconds along qdot until the measure to which the robot's thresholds apply reaches the
        threshold `warn`. 0 if the measure has already passed the threshold; inf if it does not
        approach the threshold; None without qdot.
    level
        OK, WARN or ERROR by the robot's thresholds, without hysteresis. Also WARN if the condition
        number exceeds 1e4 and the distance is above `warn`.
    factors
        The named factors of the robot file, then the closed loops with the determinants of their
        loop equations; None without factors and loops.
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
        measures: Singularity[Any, Any, Any, Any] = self
        if np.ndim(measures.level):
            counts = ((level.name, int(np.sum(measures.level == level))) for level in Level)
            words = ', '.join(f'{count} {name}' for name, count in counts if count)
            return f'Singularity({np.size(measures.level)} poses: {words or "none"})'
        distance = none_found(measures) or f'{measures.distance:.4g} rad'
        name, value = 'determinant', measures.determinant
        if value is None:
            name, value = 'manipulability', measures.manipulability
        return (
            f'Singularity({measures.level.name}, distance {distance}, {name} {value:.4g}, '
            f'rank {self.rank} of {self.generic_rank})'
        )

    _repr_html_ = as_html

    def __eq__(self, other: object) -> bool:
        """Compare every value exactly; NaN equals NaN."""
        return _same_values(self, other) if isinstance(other, Singularity) else NotImplemented

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Return the constructor and the values, so that copies and pickles leave out the arm."""
        return Singularity, tuple(getattr(self, field.name) for field in fields(self))


T = TypeVar('T')


class cached_property(Generic[T]):
    """
    A property that is computed once, like functools.cached_property. It has no lock, because the
    lock takes 1 us for each value before Python 3.12.
    """

    def __init__(self, compute: Callable[[Any], T]) -> None:
        self._compute = compute

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type) -> T:
        value = instance.__dict__[self._name] = self._compute(instance)
        return value


class _TakenMeasures(Singularity[Any, Any, Any, Any]):
    """
    Singularity measures that are computed from the kernel's results when an attribute is first
    read.

    Attributes
    ----------
    _first : shape (width,), or (..., width) for a batch
        The kernel's measures, one row for each pose. In a batch, the distance to a singular pose
        in `_first` is a first-order estimate. The search for the nearest singular poses starts
        when a measure that needs it is first read.
    """

    _state: ToolState
    _first: Floats

    @property
    def _robot(self) -> Robot:
        return self._state.robot

    @property
    def _places(self) -> MeasurePlaces:
        return self._state.robot.singularity.measure_places

    @cached_property
    def _searched(self) -> Floats:
        measures = measure_rates.searched(self._state, _flat(self._first))
        return measures.reshape(self._first.shape)

    @property
    def _watched(self) -> Floats:
        # Returns the array of measures that contains the final level (OK, WARN or ERROR). If the
        # robot's thresholds apply to the distance, this is the array after the search for the
        # nearest singular poses. Otherwise the level does not depend on the search, so `_first` is
        # returned.
        by_distance = self._robot.singularity.thresholds.measure == 'distance'
        return self._searched if by_distance else self._first

    def _shown(self, numbers: Floats) -> Any:
        # Returns `numbers` (N,), one for each pose, in the shape of the batch; for a single pose,
        # the number.
        leading = self._first.shape[:-1]
        return _read_only(numbers.reshape(leading)) if leading else numbers.item()

    @cached_property
    def determinant(self) -> Any:
        square = self._robot.singularity.task.square
        return _column(self._first, kernel.DETERMINANT) if square else None

    manipulability = cached_property(lambda self: _column(self._first, kernel.MANIPULABILITY))
    condition_number = cached_property(lambda self: _column(self._first, kernel.CONDITION_NUMBER))
    smallest_singular_value = cached_property(
        lambda self: _column(self._first, kernel.SMALLEST_SINGULAR_VALUE)
    )
    singular_values = cached_property(
        lambda self: _part(self._first, self._places.sigma, self._places.judged)
    )

    @cached_property
    def rank(self) -> Any:
        rank = _column(self._first, kernel.RANK)
        return int(rank) if self._first.ndim == 1 else _read_only(rank.astype(int))

    @cached_property
    def generic_rank(self) -> int:
        return self._robot.singularity.task.generic_rank

    distance = cached_property(lambda self: _column(self._searched, kernel.DISTANCE))

    @cached_property
    def nearest_singular(self) -> Floats | None:
        poses = _part(self._searched, self._places.pose, self._places.width)
        return None if poses.ndim == 1 and math.isnan(poses[0]) else poses

    @cached_property
    def clearance(self) -> Any:
        return self._shown(clearances(self._robot, np.array(_flat(self._state.q))))

    lost_direction = cached_property(
        lambda self: _part(self._first, self._places.lost, self._places.motion)
    )
    joint_motion = cached_property(
        lambda self: _part(self._first, self._places.motion, self._places.way)
    )
    way_out = cached_property(
        lambda self: _part(self._first, self._places.way, self._places.sigma)
    )

    @cached_property
    def rate(self) -> Any:
        if not self._state.moving:
            return None
        return self._shown(measure_rates.rates(self._state, _flat(self._watched)))

    @cached_property
    def time_to_warning(self) -> Any:
        if self.rate is None:
            return None
        values = measure_rates.watched(self._robot, _flat(self._watched))
        rates = np.reshape(self.rate, -1)
        return self._shown(measure_rates.times_to_warning(self._robot, values, rates))

    @cached_property
    def level(self) -> Any:
        k = self._places.judged + kernel.LEVEL
        if self._first.ndim == 1:
            return _LEVELS[int(self._first.item(k))]
        return _read_only(self._watched[..., k].astype(int))

    @cached_property
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


# Type of the measures of a batch of poses.
Singularities: TypeAlias = Singularity[Floats, Integers, Integers, Floats]


def watched_value(robot: Robot, singularity: Singularity) -> float:
    """
    Return the value, at one pose, of the measure to which the robot's thresholds apply. If this
    measure is the determinant, return its absolute value.
    """
    return abs(float(getattr(singularity, robot.singularity.thresholds.measure)))


def unsearched(singularity: Singularity) -> str:
    """
    Return the reason why the kernel did not search singular poses near one pose, or '' if the
    kernel searched.
    """
    state: ToolState | None = singularity.__dict__.get('_state')
    farthest = 0.0
    if state is not None:
        farthest = float(np.max(np.abs(state.q / state.robot.singularity.task.column_scales)))
    return why_unsearched(len(singularity.joint_motion), farthest)


def none_found(singularity: Singularity) -> str:
    """
    Return the text that is shown instead of the distance if the search found no singular pose.

    Returns '' if it found one. `singularity` has the measures of one pose, not of a batch.
    """
    none = MEASURES['distance'].farther(singularity.distance)
    reason = none and unsearched(singularity)
    return f'unknown: {reason}' if reason else none


def nearest_factor(robot: Robot, singularity: Singularity) -> int | None:
    """
    Return the index of the factor that is zero at the nearest singular pose; None if no such
    factor is known.
    """
    factors = singularity.factors
    if factors is None or singularity.nearest_singular is None:
        return None
    k, named = factors.nearest, robot.singularity.factors
    near = named.may_name(k, float(factors.estimates[k]), float(singularity.distance))
    return k if near else None


def flat_loop(robot: Robot, singularity: Singularity) -> str:
    """
    Return the name of the closed loop whose equations are singular at the nearest singular pose;
    empty if the arm itself is singular.

    The equations of a loop have several solutions (branches): ways to assemble the loop. At joint
    positions with singular equations two branches meet, or a branch ends. The motors do not hold
    the passive joints there. The arm itself is not singular: the tool can move in every direction.
    """
    k = nearest_factor(robot, singularity)
    factors = robot.singularity.factors
    return factors.names[k] if k is not None and factors.is_loop(k) else ''


def measured(state: ToolState) -> ToolState:
    """
    Return the state of one pose with singularity measures; compute them if the state lacks them.
    """
    return state if state.measures is not None else state._replace(measures=_measure(state))


def _measure(state: ToolState) -> Floats:
    row = np.empty(state.robot.singularity.measure_places.width)
    kernel.measure_one(kernel.NearestSearch(state.robot.singularity.arm), state.row, row)
    return row


def singularity_of(state: ToolState) -> Singularity[Any, Any, Any, Any]:
    """Return the singularity measures of an evaluated state (depth JACOBIAN or more)."""
    alone, rows = state.joints is None, state.measures
    if rows is None:
        first = _measure(state) if alone else measure_rates.measures_of(state)
    else:
        first = rows
    first = first.reshape(*state.row.shape[:-1], first.shape[-1])
    result = _TakenMeasures.__new__(_TakenMeasures)
    result.__dict__.update(_state=state, _first=first)
    if alone or rows is not None:
        result.__dict__['_searched'] = first
    return result


def singularity(
    robot: AnyRobot, q: npt.ArrayLike, qdot: npt.ArrayLike | None = None
) -> Singularity[Any, Any, Any, Any]:
    """
    Return the singularity measures of an arm at joint positions q.

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
