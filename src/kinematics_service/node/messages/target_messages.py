# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Convert messages with targets to poses and twists in the base frame, and convert the answers (joint
positions and velocities) to messages.
"""

import math
from array import array
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from geometry_msgs.msg import PoseStamped, TwistStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from ...errors import RefusedTargetError
from ...kernel import Floats
from ...kinematics.inverse.problem.plan import plan_for
from ...kinematics.inverse.problem.target import ik_target_of
from ...kinematics.inverse.result import IkFamily, IkResult, IkSolution
from ...kinematics.inverse.search import errors_at
from ...kinematics.inverse.self_motion.best_posture import BestPosture, best_posture
from ...robot.robot import Robot
from ..parameters.settings import NodeSettings
from .messages import time_message
from .output_topics import matrix_message
from .readings import TWIST, in_base_axes, matrix_of, numbers_of

# Largest accepted difference of a quaternion's norm from 1. Quaternions with three printed digits
# are accepted.
QUATERNION_NORM_TOLERANCE = 1e-3


class Choice(NamedTuple):
    """
    The joint positions inside the limits that answer a target pose, ordered by distance from the
    present joint positions.

    Attributes
    ----------
    answers
        Isolated solutions, and one posture of each family (curve) of solutions.
    best
        The best point on the solution curve of the first answer, by the criterion that
        `ik.redundancy` selects. None if no criterion is selected.
    """

    answers: tuple[IkSolution | IkFamily, ...]
    best: BestPosture | None = None

    @property
    def q(self) -> Floats | None:
        """Return the nearest joint positions; None if no answer is within the joint limits."""
        return self.answers[0].q if self.answers else None


def choice_of(result: IkResult, robot: Robot, near: Floats) -> Choice:
    """
    Return the solutions inside the joint limits. They include one posture of each family that has
    a posture inside the limits. The solution nearest to `near` is first.
    """
    scales = robot.singularity.task.column_scales

    def distance(answer: IkSolution | IkFamily) -> float:
        return float(np.linalg.norm((answer.q - near) / scales))

    answers: list[IkSolution | IkFamily] = [*result.solutions, *result.families]
    return Choice(tuple(sorted((answer for answer in answers if answer.feasible), key=distance)))


def best_choice(choice: Choice, T: Floats, settings: NodeSettings) -> Choice:
    """
    Return a choice whose first answer is the best posture by the criterion `ik.redundancy`.

    The solutions of a redundant arm form curves. The first answer of `choice` is moved along its
    curve. If the criterion is `near`, or the first answer is not on a curve, `choice` is returned.
    """
    robot, near = settings.robot, choice.answers[0] if choice.answers else None
    if settings.redundancy == 'near' or not isinstance(near, IkFamily):
        return choice
    target = ik_target_of(robot, T, settings.target_rows, settings.target_axis)
    best = best_posture(robot, target, near.q, settings.redundancy, settings.redundancy_step)
    if best is None:
        return choice
    residual = float(errors_at(target, plan_for(robot, target.rows, target.axis), best.q[None])[0])
    first = replace(near, q=best.q, residual=residual, margin=float(best.arc.margin(best.q)))
    return Choice((first, *choice.answers[1:]), best)


def pose_of(message: PoseStamped) -> Floats:
    """
    Return the pose in a message as a matrix (4, 4), in the frame that the message names.

    Raises
    ------
    RefusedTargetError
        A number is not finite, or the quaternion is not of unit length.
    """
    quaternion = numbers_of(message.pose.orientation)
    _check_finite('position', numbers_of(message.pose.position))
    _check_finite('orientation', quaternion)
    norm = math.hypot(*quaternion)
    if abs(norm - 1.0) > QUATERNION_NORM_TOLERANCE:
        raise RefusedTargetError(
            f'orientation: {_listed(quaternion)} (x y z w) has length {norm:.4g}; give a unit '
            'quaternion',
            code='not-normalized',
        )
    return matrix_of(message.pose)


def twist_of(message: TwistStamped) -> Floats:
    """
    Return the twist in a message, (6,) linear first, in the axes of the frame that the message
    names.

    Raises
    ------
    RefusedTargetError
        A number is not finite.
    """
    parts = TWIST.of(message).vectors
    for name, part in parts.items():
        _check_finite(f'{name} velocity', part)
    return np.concatenate([*parts.values()])


def pose_in_base(T: Floats, frame: str, tool: Floats, settings: NodeSettings) -> Floats:
    """
    Return a pose in the base frame, converted from the base or the tool frame.

    `tool` is the pose of the tool.

    Raises
    ------
    RefusedTargetError
        The frame is neither base nor tool.
    """
    return T if _is_base(frame, settings) else tool @ T


def twist_in_base(twist: Floats, frame: str, tool: Floats, settings: NodeSettings) -> Floats:
    """
    Return a twist of the tool's origin in base axes, converted from base or tool axes.

    Raises
    ------
    RefusedTargetError
        The frame is neither base nor tool.
    """
    return twist if _is_base(frame, settings) else in_base_axes(twist, tool)


def _is_base(frame: str, settings: NodeSettings) -> bool:
    if frame == settings.base_frame:
        return True
    if frame == settings.tool_frame:
        return False
    raise RefusedTargetError(
        f'header.frame_id: {ascii(frame)} is not a frame of this arm; give {settings.base_frame} '
        f'or {settings.tool_frame}',
        code='unknown-name',
    )


def _check_finite(name: str, values: Floats) -> None:
    if not all(map(math.isfinite, values)):
        raise RefusedTargetError(
            f'{name}: {_listed(values)}; give finite numbers', code='not-finite'
        )


def _listed(values: Floats) -> str:
    return ' '.join(f'{value:g}' for value in values)


def joint_message(stamp: int, settings: NodeSettings, **numbers: Floats) -> JointState:
    """
    Return a JointState message of all joints, with positions or velocities, each of shape (n,).
    """
    doubles = {name: array('d', values.tobytes()) for name, values in numbers.items()}
    message = JointState(name=settings.joint_names, **doubles)
    message.header.stamp = time_message(stamp)
    return message


def solutions_message(choice: Choice, settings: NodeSettings) -> Float64MultiArray:
    """
    Return all answers as a message: a row for each solution, a column for each joint, and labels.

    The label of the rows is one text. The text lists the postures of all rows in their order,
    separated by commas, as in `left/up/no_flip,...`. For a row without a named posture, the text
    has the word `solution`. If the solutions form a curve (a family), the row is one solution of
    the curve, and its posture ends with `family`.
    """
    rows = ','.join(map(_row_label, choice.answers))
    joints = ','.join(settings.joint_names), settings.robot.dof
    message = matrix_message((rows, len(choice.answers)), joints)
    message.data = array('d', b''.join(answer.q.tobytes() for answer in choice.answers))
    return message


def _row_label(answer: IkSolution | IkFamily) -> str:
    posture = answer.posture
    words = [word for word in (posture.shoulder, posture.elbow, posture.wrist) if word]
    if isinstance(answer, IkFamily):
        words.append('family')
    return '/'.join(words) or 'solution'
