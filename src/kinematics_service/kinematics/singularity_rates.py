# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute singularity measures of many poses. For the measure to which the robot's thresholds apply,
also compute its rate along qdot, and the time until it reaches the threshold `warn`.
"""

import numpy as np

from .. import kernel
from ..kernel import Floats
from ..robot.robot import Robot
from .threads import in_parts
from .tool_state import ToolState, evaluate

# Step of the forward difference along qdot, rad of the fastest joint. The step is far above the
# noise of the measures near a singular pose (1e-10 rad), and far below the joint motion over which
# the measures change considerably (1e-2 rad).
STEP = 1e-5

# Several threads share the poses of a batch for the search of singular poses. Each thread gets at
# least this number of poses, which take about 30 ms.
ROWS_PER_THREAD = 100

# A joint is taken as at rest if its speed is at most this, rad/s or m/s. The bound is above the
# noise of encoders. It is also above denormal speeds, for which STEP / speed would be infinite.
AT_REST = 1e-9


def measures_of(state: ToolState) -> Floats:
    """
    Return one row of measures for each pose of a state, in the layout of `kernel.measure`.

    The distance to a singular pose in these rows is a first-order estimate.
    """
    robot = state.robot
    rows, q = _rows(state)
    measures = np.empty((len(rows), robot.singularity.measure_places.width))

    def part(begin: int, end: int) -> int:
        kernel.measure(robot.singularity.arm, rows[begin:end], q[begin:end], measures[begin:end])
        return -1

    in_parts(len(rows), part)
    return measures


def searched(state: ToolState, measures: Floats) -> Floats:
    """
    Search the nearest singular pose of each pose, and return the measures with the results.

    `measures` is an array from `measures_of`, with one row for each pose. The result is a copy in
    which the distance and the nearest singular pose come from the search.
    """
    rows, q = _rows(state)
    result = measures.copy()

    def part(begin: int, end: int) -> int:
        search = kernel.NearestSearch(state.robot.singularity.arm)
        kernel.find_nearest(search, rows[begin:end], q[begin:end], result[begin:end], False)
        return -1

    in_parts(len(rows), part, ROWS_PER_THREAD)
    return result


def measured_in_order(state: ToolState, search: kernel.NearestSearch) -> ToolState:
    """
    Return a state with the singularity measures of all its poses, which are in order of time.

    `search` continues from the singular poses that it found for earlier poses.
    """
    measures = measures_of(state)
    kernel.find_nearest(search, *_rows(state), measures, True)
    return state._replace(measures=measures)


def measured_before(state: ToolState, distance: Floats, nearest_singular: Floats) -> ToolState:
    """
    Return a state with singularity measures. The distances and the nearest singular poses are the
    arguments; no search computes them.

    `distance` (N,) is in rad, and `nearest_singular` (N, n) has joint positions, rad or m. The
    level (OK, WARN or ERROR) in the measures still follows from the first-order estimate of the
    distance.
    """
    measures, judged = measures_of(state), state.robot.singularity
    measures[:, kernel.DISTANCE] = distance
    measures[:, judged.measure_places.pose :] = nearest_singular
    if judged.thresholds.measure == 'distance':
        watched(state.robot, measures)[:] = distance
    return state._replace(measures=measures)


def _rows(state: ToolState) -> tuple[Floats, Floats]:
    numbers = state.numbers
    q = np.ascontiguousarray(state.q).reshape(-1, state.robot.dof)
    return numbers.reshape(-1, numbers.shape[-1]), q


def watched(robot: Robot, measures: Floats) -> Floats:
    """
    Return the values (N,) of the measure to which the robot's thresholds apply; absolute values if
    this measure is the determinant.
    """
    return measures[:, robot.singularity.measure_places.judged + kernel.WATCHED]


def rates(state: ToolState, measures: Floats) -> Floats:
    """
    Return the rate of the measure to which the robot's thresholds apply, shape (N,), 1/s.

    The rate is the change of the measure per second, along qdot. If the measure is the distance to
    the nearest singular pose, the rate is the exact derivative of the distance, or 0 if the search
    found no singular pose. The rate of any other measure is a forward difference.
    """
    robot, (_, q) = state.robot, _rows(state)
    qdot = np.ascontiguousarray(state.qdot).reshape(-1, robot.dof)
    speed = np.max(np.abs(qdot), axis=1)
    moving = speed > AT_REST
    if robot.singularity.thresholds.measure == 'distance':
        distance = watched(robot, measures)
        poses = measures[:, robot.singularity.measure_places.pose :]
        valid = np.isfinite(poses[:, 0]) & (distance > 0.0) & moving
        scales = robot.singularity.task.column_scales
        away = (poses[valid] - q[valid]) / scales
        along = np.sum(away * (qdot[valid] / scales), axis=1)
        result = np.zeros(len(q))
        result[valid] = -along / np.sqrt(np.sum(away**2, axis=1))
        return result
    step = np.where(moving, STEP / np.where(moving, speed, 1.0), 0.0)
    ahead = evaluate(robot, q + step[:, None] * qdot)
    end = watched(robot, measures_of(ahead))
    start = watched(robot, measures)
    # Set the change to 0 if the measure is equal at both ends of the step, so that an infinite
    # condition number that stays infinite has the rate 0.
    change = np.subtract(end, start, out=np.zeros_like(start), where=end != start)
    return np.divide(change, step, out=np.zeros_like(change), where=moving)


def times_to_warning(robot: Robot, values: Floats, rates: Floats) -> Floats:
    """
    Return the time (N,), s, until a measure reaches the threshold `warn` of the robot.

    `values` (N,) and `rates` (N,) belong to the measure to which the robot's thresholds apply. The
    time is 0 if the measure has already passed the threshold, and inf if the rate is zero or leads
    away from the threshold.
    """
    thresholds = robot.singularity.thresholds
    worsening = np.sign(thresholds.stop - thresholds.warn) * rates
    margin = np.sign(thresholds.warn - thresholds.stop) * (values - thresholds.warn)
    times = np.full_like(values, np.inf)
    np.divide(margin, worsening, out=times, where=worsening > 0.0)
    times[~(margin > 0.0)] = 0.0
    return times
