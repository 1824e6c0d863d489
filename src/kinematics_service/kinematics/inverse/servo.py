"""
Servo: joint velocities for a wanted twist of the tool, bounded wherever the arm stands.

The least squares of J_t qdot = twist, J_t the rows of the arm's task made comparable by its
characteristic length. Directions that the arm is about to lose are damped, the more the nearer it
is to losing them (Nakamura and Hanafusa 1986; Maciejewski and Klein 1988: each singular value for
itself, so the other directions stay exact). Then the velocities are shortened alike until none
exceeds its limit, and joints that would run into a limit of their position are held back while the
others make up for it.
"""

from __future__ import annotations

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
from ..arguments import check_positive, numbers_of, refused, rows_in_order
from ..task_jacobian import task_of
from ..tool_state import ToolState, evaluate

# Of a twist that is lost less than this share is made.
HARDLY = 0.05
# Of a twist that is followed no more than this share is missing.
ROUND_OFF = 1e-9


@dataclass(frozen=True)
class ServoSettings:
    """
    How a twist becomes joint velocities.

    Attributes
    ----------
    damping
        The damping at a singular pose, as a share of the arm's characteristic length.
    damped_below
        Singular values of the scaled J_t below this share of the length are damped. With half of
        it as damping no joint motion per tool motion exceeds 1.16 / damped_below.
    horizon
        In s: no joint nears its limit faster than what is left of the way over this time. It must
        not be less than the time until the next step.
    default_rate, default_speed
        Velocity limits, rad/s and m/s, of joints the robot file gives none for.
    rows
        Which of x y z rx ry rz (axes of the table's frame 0) are wanted; None: the arm's task.

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
        """Refuse invalid settings."""
        for name in ('damping', 'damped_below', 'horizon', 'default_rate', 'default_speed'):
            check_positive(ServoSettingsError, name, getattr(self, name))
        if self.rows is not None:
            rows_in_order(ServoSettingsError, self.rows)


@dataclass(frozen=True, eq=False)
class ServoStep(FrozenArrays):
    """
    Joint velocities, and the limits that kept them from the whole twist.

    Attributes
    ----------
    qdot : shape (n,), rad/s or m/s
        Always finite and inside the velocity limits; read-only.
    twist : shape (6,), m/s and rad/s
        The tool's twist from them, J qdot: vx vy vz wx wy wz in base axes; read-only.
    scale
        The share to which the velocities were shortened for their limits, in (0, 1].
    slowest
        Name of the joint whose velocity limit asked for that; empty for none.
    held
        Names of the joints slowed or stopped by a limit of their position.
    damping
        Of the largest damping the share in use: 0 away from singular poses, 1 at one.
    smallest_singular_value
        Of the scaled J_t, as a share of the length.
    followed
        The share of the wanted twist, along itself and in the rows of the task, that the arm can
        make before limits: 1 unless directions are damped, or lost at every pose.
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
        """Return whether the twist asks for hardly more than what a singular pose has lost."""
        return self.damping > 0.0 and self.followed < HARDLY

    @property
    def limited_by(self) -> tuple[str, ...]:
        """Return what limited the step, some of `singularity`, `velocity`, `position`."""
        causes = (
            ('singularity', self.damping > 0.0),
            ('velocity', bool(self.slowest)),
            ('position', bool(self.held)),
        )
        return tuple(name for name, limits in causes if limits)


DEFAULTS = ServoSettings()


@functools.lru_cache(maxsize=128)
def _servo_of(robot: Robot, settings: ServoSettings) -> kernel.Servo:
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
    Return the joint velocities for a twist of the tool.

    Parameters
    ----------
    robot
        The arm.
    state
        The state of one pose, with its Jacobian, or joint positions (n,), rad or m.
    twist : shape (6,), m/s and rad/s
        Wanted: vx vy vz wx wy wz at the tool's origin. Rows outside the task are free.
    settings
        Damping, limits, rows.
    axes
        The axes `twist` is in: `base` or `tool`.

    Raises
    ------
    TwistError
        `twist` is not six finite numbers, or `axes` neither `base` nor `tool`.
    JointVectorError
        The positions are not n finite numbers.
    """
    robot = as_robot(robot)
    if not isinstance(settings, ServoSettings):
        raise refused('settings', 'ServoSettings', settings, ServoSettingsError)
    servo = _servo_of(robot, settings)
    if not isinstance(state, ToolState):
        state = evaluate(robot, state)
    if state.numbers.ndim != 1:
        raise TwistError(
            f'one pose at a time, not {state.q.shape[:-1]} of them',
            'state',
            [(robot.dof,)],
            state.q.shape,
        )
    wanted = _twist(twist)
    if str(axes) == 'tool':
        turn = state.pose[:3, :3]
        wanted = np.concatenate([turn @ wanted[:3], turn @ wanted[3:]])
    elif str(axes) != 'base':
        raise TwistError(
            f"axes must be 'base' or 'tool', not {axes!r}", 'axes', ('base', 'tool'), axes
        )
    qdot = np.empty(robot.chain.dof)
    step = kernel.ServoOutput(servo, qdot)
    kernel.servo(step, state.q, state.numbers, wanted)
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


def _twist(twist: npt.ArrayLike) -> Floats:
    wanted = numbers_of('twist', twist, TwistError, [(6,)])
    if wanted.shape != (6,) or not np.all(np.isfinite(wanted)):
        raise TwistError(
            f'twist must be six finite numbers, vx vy vz wx wy wz, not {wanted.tolist()}',
            'twist',
            [(6,)],
            wanted.shape,
        )
    return wanted
