# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the covariances of tool pose and twist from those of joint positions and table, by linear
error propagation.
"""

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...errors import CalibrationError
from ...kernel import Floats, PoseErrors
from ...kinematics.acceleration import jacobian_rate
from ...kinematics.arguments import numbers_of
from ...kinematics.forward import BASE, cross, in_axes_of
from ...kinematics.tool_state import ToolState, evaluate, velocities_of
from ...kinematics.uncertainty.arm_errors import covariances, pose_errors, table_errors_of
from ...robot.points import TOOL
from ...robot.robot import AnyRobot, Robot, as_robot
from .checking import check_known
from .identified_table import IdentifiedTable


def pose_covariance(
    robot: AnyRobot,
    q: npt.ArrayLike,
    *,
    joints: npt.ArrayLike | None = None,
    calibration: IdentifiedTable | None = None,
) -> Floats:
    """
    Return the covariance of the tool's pose in the base frame, shape (..., 6, 6), m and rad.

    Rows and columns are those of geometry_msgs/PoseWithCovariance: x y z, then the rotations about
    the X, Y and Z axes of the base, which stand still. The covariance is of first order: exact for
    small errors. If the arm has closed loops, only errors of the joints with a motor are taken
    into account, and propagated through the loops.

    Parameters
    ----------
    robot
        The arm. If `calibration` is given: the calibrated arm, read from its written file or taken
        from `Calibration.calibrated`.
    q : shape (..., n), rad or m
        Joint positions.
    joints : shape (n,) or one number, rad or m
        Standard deviations of the joint positions, for example of encoders. The errors of the
        joints are independent. Default: those of the robot file.
    calibration
        The covariance of the table from this calibration is used instead of the uncertainty of the
        robot file. Numbers that the calibration did not identify have their priors. Base and tool
        of the calibration are not included, because they belong to the measuring device.

    Raises
    ------
    CalibrationError
        A standard deviation is negative or infinite; the calibration is of another arm, or of one
        with closed loops; or nothing is given, and the robot file has no `uncertainty`.
    JointVectorError
        The last dimension is not n, or a number is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> import kinematics_service as ks
    >>> robot = ks.load_robot('planar_2r')
    >>> np.sqrt(ks.pose_covariance(robot, [0.0, 0.0], joints=1e-3)[5, 5]).round(6).item()
    0.001414
    """
    robot = as_robot(robot)
    if robot.description.loops:
        deviations = _of_joints_alone(robot, joints, calibration)
        return _products(evaluate(robot, q).jacobian * deviations)
    state = evaluate(robot, q, depth=kernel.ALL_FRAMES)
    return covariances(_errors(robot, state.q, joints, None, calibration), state)[..., 0, :, :]


def twist_covariance(
    robot: AnyRobot,
    q: npt.ArrayLike,
    qdot: npt.ArrayLike,
    axes: str = BASE,
    *,
    joints: npt.ArrayLike | None = None,
    velocities: npt.ArrayLike | None = None,
    calibration: IdentifiedTable | None = None,
) -> Floats:
    """
    Return the covariance of the tool's twist, shape (..., 6, 6), m/s and rad/s.

    Rows and columns are those of geometry_msgs/TwistWithCovariance: linear x y z, angular x y z. J
    propagates the noise of the velocities. The derivatives of J qdot propagate the errors of
    positions and table. The covariance is of first order: exact for small errors.

    Parameters
    ----------
    robot, q, joints, calibration
        As in `pose_covariance`.
    qdot : shape (..., n), rad/s or m/s
        Joint velocities.
    axes
        Axes of the twist's numbers: `base` or `tool`. Errors of the pose turn the tool axes, so
        with `tool` these errors also change the numbers of the twist.
    velocities : shape (n,) or one number, rad/s or m/s
        Standard deviations of the joint velocities; their errors are independent. Default: those
        of the robot file.

    Raises
    ------
    CalibrationError
        As in `pose_covariance`; or no standard deviations of the velocities are given; or `axes`
        is neither `base` nor `tool`.

    Examples
    --------
    >>> import numpy as np
    >>> import kinematics_service as ks
    >>> robot = ks.load_robot('planar_2r')
    >>> S = ks.twist_covariance(robot, [0.0, 0.0], [1.0, 0.0], joints=1e-3, velocities=0.01)
    >>> np.sqrt(S[5, 5]).round(6).item()
    0.014142
    """
    robot = as_robot(robot)
    check_known('axes', axes, (BASE, TOOL))
    uncertainty = robot.description.uncertainty
    if velocities is None:
        if uncertainty is None or uncertainty.velocity_noise is None:
            message = f'the file of {robot.name} has no velocity_noise: give velocities'
            raise CalibrationError(message, code='missing-uncertainty')
        velocities = uncertainty.velocity_noise
    if robot.description.loops:
        deviations = _of_joints_alone(robot, joints, calibration)
        noise = _each('velocities', velocities, robot.dof)
        by_q, by_qdot = _twist_derivatives(robot, evaluate(robot, q, qdot), axes)
        return _products(np.concatenate([by_q * deviations, by_qdot * noise], axis=-1))
    state = evaluate(robot, q, qdot, depth=kernel.ALL_FRAMES)
    errors = _errors(robot, state.q, joints, velocities, calibration)
    return covariances(errors, state, axes)[..., 1, :, :]


def _of_joints_alone(
    robot: Robot, joints: npt.ArrayLike | None, calibration: IdentifiedTable | None
) -> Floats:
    # Return the standard deviations of the joints of an arm with closed loops. Raise an error if a
    # calibration is given, because errors of table numbers are not propagated through closed
    # loops.
    if calibration is not None or joints is None:
        raise CalibrationError(
            f'{robot.name} has closed loops, where errors of the table are not known; give '
            'joints, and no calibration',
            code='closed-loop',
        )
    return _each('joints', joints, robot.dof)


def _products(moved: Floats) -> Floats:
    return np.asarray(moved @ np.swapaxes(moved, -1, -2))


def _twist_derivatives(robot: Robot, state: ToolState, axes: str) -> tuple[Floats, Floats]:
    # Return the derivatives of the twist (v, w) by q and by qdot, (..., 6, n) each, for any arm,
    # with or without loops. Let w_k be the angular part of column k of J. The derivative of v by
    # q_k is the linear part of column k of dJ/dt. The derivative of w by q_k is the angular part
    # of column k of dJ/dt plus w_k x w, since rotations do not commute. If the twist is in tool
    # axes, a change of q_k also turns the tool axes, at the rate w_k. So subtract w_k x v from the
    # derivative of v, and w_k x w from that of w.
    J, V = state.jacobian, state.twist[..., None]
    by_q = jacobian_rate(robot, state.q, velocities_of(state))
    by_q[..., 3:, :] += cross(J[..., 3:, :], V[..., 3:, :])
    if axes == BASE:
        return by_q, J
    by_q[..., :3, :] -= cross(J[..., 3:, :], V[..., :3, :])
    by_q[..., 3:, :] -= cross(J[..., 3:, :], V[..., 3:, :])
    return in_axes_of(state.pose, by_q), in_axes_of(state.pose, J)


def _errors(
    robot: Robot,
    q: Floats,
    joints: npt.ArrayLike | None,
    velocities: npt.ArrayLike | None,
    calibration: IdentifiedTable | None,
) -> PoseErrors:
    uncertainty = robot.description.uncertainty
    if calibration is not None and not isinstance(calibration, IdentifiedTable):
        raise CalibrationError(
            f'calibration must be a Calibration, not {calibration!r:.80}', code='wrong-type'
        )
    silent = uncertainty is None or not (uncertainty.of_pose or velocities is not None)
    if silent and joints is None and calibration is None:
        raise CalibrationError(
            f'the file of {robot.name} does not say how far its poses may be off: give joints or '
            'a calibration, or write its section uncertainty',
            code='missing-uncertainty',
        )
    of_joints: npt.ArrayLike = 0.0 if uncertainty is None else uncertainty.joint_deviations
    if joints is not None:
        of_joints = joints
    if calibration is not None:
        table, floor = calibration.table_errors(robot, q), (0.0, 0.0)
    else:
        table = table_errors_of(robot, uncertainty)
        floor = (uncertainty.floor_xyz, uncertainty.floor_rpy) if uncertainty else (0.0, 0.0)
    joints = _each('joints', of_joints, robot.dof)
    velocities = _each('velocities', 0.0 if velocities is None else velocities, robot.dof)
    return pose_errors(robot, table, joints, velocities, floor)


def _each(name: str, given: npt.ArrayLike, count: int) -> Floats:
    deviations = numbers_of(name, given)
    usable = np.isfinite(deviations) & (deviations >= 0.0)
    if deviations.shape not in ((), (count,)) or not usable.all():
        message = f'{name} must be one standard deviation or {count}, finite and none below 0'
        raise CalibrationError(message, code='out-of-range')
    return np.array(np.broadcast_to(deviations, count))
