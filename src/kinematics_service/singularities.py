"""
How near a pose is to a singular one, which motion is lost there, and which way leads out.

"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import kernel, measure_table
from .factors import distances_to_zeros, motions_to_zeros
from .kernel import Floats
from .measures import Level
from .robot import Robot
from .tool_state import ToolState, evaluate

# Step of the difference along qdot, in rad (of the fastest joint): the measures carry some 1e-10
# of noise near a singular pose and change over 1e-2, so this is in the middle of both.
STEP = 1e-5

# Slower than this (rad/s or m/s) an arm stands still: encoder noise, and denormal numbers whose
# step would be infinite.
AT_REST = 1e-9


@dataclass(frozen=True, eq=False)
class FactorMeasures:
    """
    The named factors of the robot file at a pose; see `Singularity.factors`.

    Attributes
    ----------
    names
        F names, as in the robot file.
    distances : shape (..., F)
        First-order joint motion to each factor's zero, rad, 0 to pi.
    results : shape (..., F, 1 + n)
        Value and gradient of each factor.
    column_scales : shape (..., n)
        What a unit of each joint counts in rad.

    """

    names: tuple[str, ...]
    distances: Floats
    results: Floats
    column_scales: Floats

    @property
    def values(self) -> Floats:
        """
        Return the value of each factor, shape (..., F).

        """
        return self.results[..., 0]

    @property
    def motions(self) -> Floats:
        """
        Return the joint motion to each factor's zero by first order, shape (..., F, n), rad or m.

        """
        return motions_to_zeros(self.results, self.column_scales[..., None, :])

    @property
    def nearest(self) -> int:
        """
        Return the index of the factor nearest to its zero, for one pose.

        """
        return int(np.argmin(self.distances))


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
        Product of the singular values: |det|, or sqrt(det(J_t J_t^T)) for n > m.
    condition_number, smallest_singular_value, singular_values
        Of the scaled J_t; singular values in descending order, shape (..., min(m, n)).
    rank, generic_rank
        Rank here, and at random poses.
    distance
        First-order estimate of the joint motion to the nearest singular pose, rad, 0 to pi; of the
        named factors where the robot file lists them.
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
    lost_direction: Floats
    joint_motion: Floats
    way_out: Floats
    rate: Any
    time_to_warning: Any
    level: Any
    factors: FactorMeasures | None


_COLUMN = {
    'determinant': kernel.DETERMINANT,
    'manipulability': kernel.MANIPULABILITY,
    'condition_number': kernel.CONDITION_NUMBER,
    'smallest_singular_value': kernel.SMALLEST_SINGULAR_VALUE,
    'distance': kernel.DISTANCE,
}


def measure_rows(robot: Robot, rows: Floats) -> Floats:
    """
    Return the measures of evaluated rows (N, width), one row each, as `kernel.measure` lays out.

    """
    return measure_table.measure_rows(robot.chain, robot.task, rows)


def watched(robot: Robot, measures: Floats) -> Floats:
    """
    Return the measure the robot's thresholds are about, shape (...,): |det| for the determinant.

    """
    return np.abs(measures[..., _COLUMN[robot.thresholds.measure]])


def watched_value(robot: Robot, singularity: Singularity) -> float:
    """
    Return the watched measure of one pose: |det| for the determinant.

    """
    return abs(float(getattr(singularity, robot.thresholds.measure)))


def _measures_of(state: ToolState) -> tuple[Floats, FactorMeasures | None]:
    # Measures of every row, and the distances to the zeros of the factors where there are some:
    # they do not suffer between two singular sets, and where their product is the determinant
    # nothing else is needed.
    robot = state.robot
    measures = measure_rows(robot, state.numbers.reshape(-1, state.numbers.shape[-1]))
    if not robot.factors:
        return measures, None
    scales = robot.task.column_scales
    results = robot.factors.evaluate(state.q.reshape(-1, robot.dof))
    distances = distances_to_zeros(results, scales)
    nearest = distances.min(axis=1)
    estimate = measures[:, kernel.DISTANCE]
    if not robot.factors.complete:
        nearest = np.minimum(nearest, estimate)
    measures[:, kernel.DISTANCE] = np.where(estimate == 0.0, 0.0, nearest)
    leading = state.numbers.shape[:-1]
    factors = FactorMeasures(
        names=robot.factors.names,
        distances=distances.reshape(*leading, len(robot.factors.names)),
        results=results.reshape(*leading, *results.shape[1:]),
        column_scales=np.broadcast_to(scales, (*leading, robot.dof)),
    )
    return measures, factors


def _rates(state: ToolState, measures: Floats) -> Floats:
    # Forward difference along qdot of the watched measure, per second.
    robot, n = state.robot, state.robot.dof
    q = np.ascontiguousarray(state.q).reshape(-1, n)
    qdot = np.ascontiguousarray(state.qdot).reshape(-1, n)
    speed = np.max(np.abs(qdot), axis=1)
    moving = speed > AT_REST
    step = np.where(moving, STEP / np.where(moving, speed, 1.0), 0.0)
    ahead = evaluate(robot, q + step[:, None] * qdot)
    here, there = watched(robot, measures), watched(robot, _measures_of(ahead)[0])
    # A condition number that is and stays infinite does not change.
    change = np.subtract(there, here, out=np.zeros_like(here), where=there != here)
    return np.divide(change, step, out=np.zeros_like(change), where=moving)


def _times_to_warning(robot: Robot, values: Floats, rates: Floats) -> Floats:
    thresholds = robot.thresholds
    worsening = np.sign(thresholds.stop - thresholds.warn) * rates
    margin = np.sign(thresholds.warn - thresholds.stop) * (values - thresholds.warn)
    times = np.full_like(values, np.inf)
    np.divide(margin, worsening, out=times, where=worsening > 0.0)
    times[~(margin > 0.0)] = 0.0
    return times


def singularity_of(state: ToolState) -> Singularity:
    """
    Return the measures of an evaluated state (depth JACOBIAN or more).

    """
    robot, n = state.robot, state.robot.dof
    leading = state.numbers.shape[:-1]
    measures, factors = _measures_of(state)
    values = watched(robot, measures)
    rates = times = None
    if state.qdot is not None:
        rates = _rates(state, measures)
        times = _times_to_warning(robot, values, rates)
    levels = robot.thresholds.levels(values)

    def shaped(values: Any) -> Any:
        # One number for one pose, an array with the leading dimensions of q for a batch.
        return values[0] if not leading else values.reshape(leading)

    motion_at = kernel.LOST_AT + 6
    way_at = motion_at + n
    sigma_at = way_at + n
    scalars = [shaped(measures[:, k]) for k in range(kernel.LOST_AT)]
    if not leading:
        scalars = [float(scalar) for scalar in scalars]
    measures.setflags(write=False)
    vectors = measures.reshape(*leading, measures.shape[-1])
    return Singularity(
        determinant=scalars[kernel.DETERMINANT] if robot.task.square else None,
        manipulability=scalars[kernel.MANIPULABILITY],
        condition_number=scalars[kernel.CONDITION_NUMBER],
        smallest_singular_value=scalars[kernel.SMALLEST_SINGULAR_VALUE],
        singular_values=vectors[..., sigma_at:],
        rank=shaped(measures[:, kernel.RANK].astype(int)),
        generic_rank=robot.task.generic_rank,
        distance=scalars[kernel.DISTANCE],
        lost_direction=vectors[..., kernel.LOST_AT : motion_at],
        joint_motion=vectors[..., motion_at:way_at],
        way_out=vectors[..., way_at:sigma_at],
        rate=None if rates is None else shaped(rates),
        time_to_warning=None if times is None else shaped(times),
        level=shaped(levels) if leading else Level(int(levels[0])),
        factors=factors,
    )


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
    return singularity_of(evaluate(robot, q, qdot))


__all__ = ['Level', 'Singularity', 'singularity', 'singularity_of']
