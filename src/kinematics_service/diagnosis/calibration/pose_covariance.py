"""How uncertain the pose of the tool is: by its encoders, and by what a calibration left open."""

import numpy as np
import numpy.typing as npt

from ...errors import CalibrationError
from ...kernel import Floats
from ...kinematics.forward import forward_kinematics, jacobian
from ...robot.loops import refuse_loops
from ...robot.robot import Robot
from .calibration import Calibration
from .checking import apart
from .corrected_chain import pose_change
from .parameters import SIX, parameters_of, placement

# A robot is the calibrated one if its poses are (m, rad): its file has printed digits.
SAME = 1e-8


def pose_covariance(
    robot: Robot,
    q: npt.ArrayLike,
    *,
    joints: npt.ArrayLike | None = None,
    calibration: Calibration | None = None,
) -> Floats:
    """
    Return the covariance of the tool's pose in the base frame, shape (..., 6, 6), m and rad.

    Rows and columns are those of geometry_msgs/PoseWithCovariance: x y z, then the rotations about
    the X, Y and Z axes of the base, which stand still. Of first order: exact for small deviations.

    Parameters
    ----------
    robot
        The arm; with `calibration` its calibrated one, as written or as `calibrated`.
    q : shape (..., n), rad or m
        Joint positions.
    joints : shape (n,) or one number, rad or m
        Standard deviations of the joint positions, as of encoders; they are independent.
    calibration
        Its covariance of the table's numbers counts, what it left to the priors included. That of
        base and tool, which are those of the measuring device, does not.

    Raises
    ------
    CalibrationError
        A standard deviation is negative, or the calibration is one of another arm.

    Examples
    --------
    >>> import numpy as np
    >>> import kinematics_service as ks
    >>> robot = ks.load_robot('planar_2r')
    >>> np.sqrt(ks.pose_covariance(robot, [0.0, 0.0], joints=1e-3)[5, 5]).round(6).item()
    0.001414
    """
    refuse_loops(robot.description, 'the covariance of the pose')
    positions = np.asarray(q, dtype=np.float64)
    J = jacobian(robot, positions)
    result = np.zeros((*J.shape[:-1], 6))
    if joints is not None:
        deviations = np.asarray(joints, dtype=np.float64)
        if deviations.shape not in ((), (robot.dof,)) or not np.all(deviations >= 0.0):
            raise CalibrationError(
                f'joints must be one standard deviation or {robot.dof}, none below 0'
            )
        scaled = J * deviations
        result += scaled @ np.swapaxes(scaled, -1, -2)
    if calibration is not None:
        flat = positions.reshape(-1, robot.dof)
        result += _of_table(robot, flat, calibration).reshape(result.shape)
    return result


def _of_table(robot: Robot, q: Floats, calibration: Calibration) -> Floats:
    arm = parameters_of(calibration.robot)
    count = len(arm.table)
    base, tool = robot.description.base.motion.matrix, robot.description.tool.motion.matrix
    chain = placement(arm.chain, base, tool, (count, count + len(SIX)))
    values = np.zeros(count + 2 * len(SIX))
    names = [one.name for one in arm.table]
    fitted = [k for k, one in enumerate(calibration.parameters) if one.name in names]
    columns = [names.index(calibration.parameters[k].name) for k in fitted]
    values[columns] = [calibration.parameters[k].correction for k in fitted]
    if q.shape[1] != calibration.robot.dof:
        raise CalibrationError(f'the calibration is one of {calibration.robot.name}')
    change = pose_change(chain, values, q)
    lengths, angles = apart(change.pose, forward_kinematics(robot, q))
    if max(np.max(lengths, initial=0.0), np.max(angles, initial=0.0)) > SAME:
        raise CalibrationError(
            f'the calibration of {calibration.robot.name} is one of another arm: '
            'give the calibrated robot'
        )
    J = change.jacobian[:, :, columns]
    return np.asarray(J @ calibration.covariance[np.ix_(fitted, fitted)] @ np.swapaxes(J, 1, 2))
