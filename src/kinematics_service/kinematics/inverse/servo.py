# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute joint velocities for a wanted twist of the tool, by damped least squares with limits.

One step solves J_t qdot = twist, where J_t is the task Jacobian scaled by the characteristic
length. Only singular values below a bound are damped, and the smallest singular values are damped
most. So directions with larger singular values stay exact (Nakamura and Hanafusa 1986; Maciejewski
and Klein 1988). Then all velocities are scaled down by one factor, so that no velocity exceeds its
limit. Joints near a position limit are slowed, and the other joints compensate.
"""

import functools
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...errors import ServoSettingsError, TwistError
from ...kernel import Floats
from ...robot.chain import FrozenArrays
from ...robot.robot import AnyRobot, Robot, as_robot
from ...robot.task import TWIST_ROWS
from ..arguments import check_positive, finite_vector, rows_in_order
from ..task_jacobian import task_of
from ..tool_state import ToolState, evaluate

# A twist is lost if `followed` is below this number. `followed` is the component of the resulting
# twist along the wanted twist, divided by the size of the wanted twist.
LOST_FRACTION = 0.05
# A twist is taken as completely followed if `followed >= 1 - FOLLOWED_ROUND_OFF`. `followed` is
# the component of the resulting twist along the wanted twist, divided by the size of the wanted
# twist. The number is the round-off of the least squares.
FOLLOWED_ROUND_OFF = 1e-9


@dataclass(frozen=True)
class ServoSettings:
    """
    Settings of `joint_velocity`, which computes joint velocities from a twist.

    Attributes
    ----------
    damping
        The damping of a singular value of 0 is `damping * L`; L is the characteristic length.
    damped_below
        Singular values of the scaled J_t below `damped_below * L` are damped; L is the
        characteristic length. If `damping` is half of `damped_below`, then joint motion (rad) <=
        1.16 / damped_below * (tool motion / L).
    horizon
        Time, s. No joint approaches its limit faster than its distance from the limit divided by
        this time. The time must be at least the time until the next step.
    default_rate, default_speed
        Velocity limits, rad/s and m/s, of joints without a limit in the robot file.
    rows
        The rows that the servo follows, some of x y z rx ry rz (axes of the table's frame 0);
        None: the arm's task.

    Raises
    ------
    ServoSettingsError
        A number is not positive and finite, or a row does not exist.
    """

    damping: float = 0.025
    damped_below: float = 0.05
    horizon: float = 0.1
    default_rate: float = math.pi
    default_speed: float = 1.0
    rows: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        """Raise ServoSettingsError for invalid settings."""
        for name in ('damping', 'damped_below', 'horizon', 'default_rate', 'default_speed'):
            check_positive(ServoSettingsError, name, getattr(self, name))
        if self.rows is not None:
            rows_in_order(ServoSettingsError, self.rows)


@dataclass(frozen=True, eq=False)
class ServoStep(FrozenArrays):
    """
    The joint velocities for a twist, and the limits that changed the velocities.

    Attributes
    ----------
    qdot : shape (n,), rad/s or m/s
        The joint velocities, always finite and inside the velocity limits; read-only.
    twist : shape (6,), m/s and rad/s
        The tool's twist J qdot: vx vy vz wx wy wz in base axes; read-only.
    scale
        Factor that brings all velocities inside the velocity limits, in (0, 1].
    slowest
        Name of the joint whose velocity limit gave `scale`; empty if `scale` is 1.
    held
        Names of the joints slowed or stopped by a position limit.
    damping
        The damping in use, relative to the largest damping: 0 away from singular poses, 1 at a
        singular pose.
    smallest_singular_value
        Smallest singular value of the scaled J_t, divided by the characteristic length.
    followed
        How much of the wanted twist the arm produces, before velocity limits and position limits
        change the velocities: the component of the produced twist along the wanted twist, divided
        by the size of the wanted twist. Only the rows of the task count. The value is below 1 if
        the velocities are damped near a singular pose, or if the arm can never produce a part of
        the wanted twist.
    """

    qdot: Floats
    twist: Floats
    scale: float
    slowest: str
    held: tuple[str, ...]
    damping: float
    smallest_singular_value: float
    followed: float

    @property
    def lost(self) -> bool:
        """Return whether a singular pose prevents more than 95 % of the wanted twist."""
        return self.damping > 0.0 and self.followed < LOST_FRACTION

    @property
    def limited_by(self) -> tuple[str, ...]:
        """Return which causes limited the velocities: `singularity`, `velocity`, `position`."""
        causes = (
            ('singularity', self.damping > 0.0),
            ('velocity', bool(self.slowest)),
            ('position', bool(self.held)),
        )
        return tuple(name for name, limits in causes if limits)


DEFAULTS = ServoSettings()


@functools.lru_cache(maxsize=128)
def _servo_of(robot: Robot, settings: ServoSettings) -> 'kernel.Servo':
    task = task_of(robot, settings.rows)
    otherwise = np.where(robot.prismatic, settings.default_speed, settings.default_rate)
    given = np.isfinite(robot.velocity_limits)
    return kernel.Servo(
        task.kernel_rows,
        settings.damping,
        settings.damped_below,
        task.length,
        settings.horizon,
        robot.limits,
        np.where(given, robot.velocity_limits, otherwise),
    )


def joint_velocity(
    robot: AnyRobot,
    state: ToolState | npt.ArrayLike,
    twist: npt.ArrayLike,
    settings: ServoSettings = DEFAULTS,
    axes: Literal['base', 'tool'] = 'base',
) -> ServoStep:
    """
    Return the joint velocities that move the tool with a wanted twist.

    Parameters
    ----------
    robot
        The arm.
    state
        The state of one pose, with its Jacobian, or joint positions (n,), rad or m.
    twist : shape (6,), m/s and rad/s
        The wanted twist vx vy vz wx wy wz at the tool's origin. Rows outside the task are free.
    settings
        Damping, limits, rows.
    axes
        The axes in which `twist` is given: `base` or `tool`.

    Raises
    ------
    TwistError
        `twist` is not six finite numbers, or `axes` neither `base` nor `tool`.
    JointVectorError
        The positions are not n finite numbers.
    """
    robot = as_robot(robot)
    if not isinstance(settings, ServoSettings):
        raise ServoSettingsError.refused('settings', 'ServoSettings', settings, code='wrong-type')
    servo = _servo_of(robot, settings)
    if not isinstance(state, ToolState):
        state = evaluate(robot, state)
    if state.numbers.ndim != 1:
        shape = state.q.shape
        sentence = f'state must be one pose, not {shape[:-1]} of them; call it for each pose'
        raise TwistError(sentence, 'state', [(robot.dof,)], shape, code='wrong-shape')
    target_twist = finite_vector(TwistError, 'twist', twist, TWIST_ROWS)
    if str(axes) == 'tool':
        turn = state.pose[:3, :3]
        target_twist = np.concatenate([turn @ target_twist[:3], turn @ target_twist[3:]])
    elif str(axes) != 'base':
        raise TwistError.unknown_name('axes', ('base', 'tool'), axes)
    qdot = np.empty(robot.chain.dof)
    step = kernel.ServoOutput(servo, qdot)
    kernel.servo(step, state.q, state.numbers, target_twist)
    return ServoStep(
        qdot=qdot,
        twist=state.jacobian @ qdot,
        scale=step.shortened,
        slowest=robot.joint_names[step.slowest] if step.slowest >= 0 else '',
        held=tuple(name for j, name in enumerate(robot.joint_names) if step.is_held(j)),
        damping=step.damping,
        smallest_singular_value=step.least_singular_value,
        followed=step.followed,
    )
