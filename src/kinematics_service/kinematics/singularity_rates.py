"""
How the watched measure changes along the joint velocities, and when it will be at its threshold.
"""

import numpy as np

from .. import kernel
from ..kernel import Floats
from ..robot.robot import Robot
from .threads import in_parts
from .tool_state import ToolState, evaluate

# Step of the difference along qdot, in rad (of the fastest joint): the measures carry some 1e-10
# of noise near a singular pose and change over 1e-2, so this is in the middle of both.
STEP = 1e-5

# Smallest number of rows that one thread searches: about 30 ms.
ROWS_PER_THREAD = 100

# Slower than this (rad/s or m/s) an arm stands still: encoder noise, and denormal numbers whose
# step would be infinite.
AT_REST = 1e-9


def measures_of(state: ToolState) -> Floats:
    """
    Return the measures of every pose of a state, one row each, as `kernel.measure` lays them out.

    The distance is of first order.
    """
    robot = state.robot
    rows, q = _rows(state)
    measures = np.empty((len(rows), robot.singularity.measure_places.width))

    def part(begin: int, end: int) -> int:
        kernel.measure(robot.singularity.arm, rows[begin:end], q[begin:end], measures[begin:end])
        return -1

    in_parts(len(rows), part)
    return measures


def searched(
    state: ToolState, measures: Floats, search: kernel.NearestSearch | None = None
) -> Floats:
    """
    Return what `measures_of` a state returned, with the singular poses that are found nearest.

    Parameters
    ----------
    state, measures
        The poses.
    search
        That of the poses before, for poses of a motion.
    """
    rows, q = _rows(state)
    found = measures.copy()
    if search is not None:
        kernel.find_nearest(search, rows, q, found, True)
        return found

    def part(begin: int, end: int) -> int:
        alone = kernel.NearestSearch(state.robot.singularity.arm)
        kernel.find_nearest(alone, rows[begin:end], q[begin:end], found[begin:end], False)
        return -1

    in_parts(len(rows), part, ROWS_PER_THREAD)
    return found


def recalled(state: ToolState, distance: Floats, nearest_singular: Floats) -> Floats:
    """
    Return the measures of a state, with distances (N,) and poses (N, n) that a search had found.

    The level is that of first order.
    """
    robot, measures = state.robot, measures_of(state)
    measures[:, kernel.DISTANCE] = distance
    measures[:, robot.singularity.measure_places.pose :] = nearest_singular
    if robot.singularity.thresholds.measure == 'distance':
        measures[:, robot.singularity.measure_places.judged + kernel.WATCHED] = distance
    return measures


def _rows(state: ToolState) -> tuple[Floats, Floats]:
    numbers = state.numbers
    q = np.ascontiguousarray(state.q).reshape(-1, state.robot.dof)
    return numbers.reshape(-1, numbers.shape[-1]), q


def watched(robot: Robot, measures: Floats) -> Floats:
    """
    Return the measure the robot's thresholds are about, shape (N,): |det| for the determinant.
    """
    return measures[:, robot.singularity.measure_places.judged + kernel.WATCHED]


def rates(state: ToolState, measures: Floats) -> Floats:
    """
    Return the change of the watched measure along qdot, shape (N,), 1/s.

    That of the distance is its exact derivative: what matters is the motion towards the pose that
    was found, which is the nearest; 0 where none was found. Of other measures it is a forward
    difference.
    """
    robot, n = state.robot, state.robot.dof
    q = np.ascontiguousarray(state.q).reshape(-1, n)
    qdot = np.ascontiguousarray(state.qdot).reshape(-1, n)
    speed = np.max(np.abs(qdot), axis=1)
    moving = speed > AT_REST
    if robot.singularity.thresholds.measure == 'distance':
        distance, poses = (
            watched(robot, measures),
            measures[:, robot.singularity.measure_places.pose :],
        )
        found = np.isfinite(poses[:, 0]) & (distance > 0.0) & moving
        scales = robot.singularity.task.column_scales
        away = (poses[found] - q[found]) / scales
        along = np.sum(away * (qdot[found] / scales), axis=1)
        result = np.zeros(len(q))
        result[found] = -along / np.sqrt(np.sum(away**2, axis=1))
        return result
    step = np.where(moving, STEP / np.where(moving, speed, 1.0), 0.0)
    ahead = evaluate(robot, q + step[:, None] * qdot)
    there = watched(robot, measures_of(ahead))
    here = watched(robot, measures)
    # A condition number that is and stays infinite does not change.
    change = np.subtract(there, here, out=np.zeros_like(here), where=there != here)
    return np.divide(change, step, out=np.zeros_like(change), where=moving)


def times_to_warning(robot: Robot, values: Floats, rates: Floats) -> Floats:
    """
    Return the seconds to the threshold `warn`, shape (N,): 0 beyond it, inf where it never comes.
    """
    thresholds = robot.singularity.thresholds
    worsening = np.sign(thresholds.stop - thresholds.warn) * rates
    margin = np.sign(thresholds.warn - thresholds.stop) * (values - thresholds.warn)
    times = np.full_like(values, np.inf)
    np.divide(margin, worsening, out=times, where=worsening > 0.0)
    times[~(margin > 0.0)] = 0.0
    return times
