"""
The state of the tool: what one pass of the kernel says of joint positions and velocities.

"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from . import kernel
from .errors import JointVectorError
from .kernel import Floats
from .robot import Robot


class ToolState(NamedTuple):
    """
    Pose, Jacobian, twist and frames of an arm; holding one means the kernel has run on `q`.

    Attributes
    ----------
    robot
        The arm.
    q : shape (..., n), rad or m
        Joint positions.
    qdot : shape (..., n), rad/s or m/s, or None
        Joint velocities, where they are known.
    numbers : shape (..., width)
        The row of results the properties are read from.

    """

    robot: Robot
    q: Floats
    qdot: Floats | None
    numbers: Floats

    @property
    def pose(self) -> Floats:
        """
        Return the tool in the base frame, shape (..., 4, 4).

        """
        return self.numbers[..., :16].reshape(*self.numbers.shape[:-1], 4, 4)

    @property
    def position(self) -> Floats:
        """
        Return the tool's origin in the base frame, shape (..., 3), m.

        """
        return self.numbers[..., 3:12:4]

    @property
    def quaternion_xyzw(self) -> Floats:
        """
        Return the tool's orientation in the base frame as unit quaternion, w >= 0, shape (..., 4).

        """
        return self.numbers[..., kernel.QUATERNION_AT : kernel.QUATERNION_AT + 4]

    @property
    def jacobian(self) -> Floats:
        """
        Return J in base axes, reference point the tool's origin, shape (..., 6, n).

        Rows vx vy vz wx wy wz.

        """
        n = self.robot.chain.dof
        J = self.numbers[..., kernel.JACOBIAN_AT : kernel.JACOBIAN_AT + 6 * n]
        return J.reshape(*self.numbers.shape[:-1], 6, n)

    @property
    def twist(self) -> Floats:
        """
        Return J qdot in base axes, shape (..., 6): vx vy vz (m/s) wx wy wz (rad/s).

        Zero where `qdot` is None.

        """
        at = kernel.JACOBIAN_AT + 6 * self.robot.chain.dof
        return self.numbers[..., at : at + 6]

    @property
    def link_frames(self) -> Floats:
        """
        Return frame 0 and the frame after each row in the base frame, shape (..., rows + 1, 4, 4).

        There only where the state was evaluated with them.

        """
        frames = self.robot.chain.frames
        at = self.robot.chain.widths[kernel.JACOBIAN]
        return self.numbers[..., at:].reshape(*self.numbers.shape[:-1], frames, 4, 4)


def _joint_vector(robot: Robot, q: npt.ArrayLike, name: str) -> Floats:
    # A copy in the one form the kernel takes, doubles in C order, writable (read-only is another
    # type to numba): and the state keeps the numbers the kernel ran on, whatever the caller does.
    try:
        array = np.array(q, dtype=np.float64, order='C')
    except (TypeError, ValueError):
        raise JointVectorError(f'{name} must be numbers, shape (..., {robot.dof})') from None
    if array.ndim == 0 or array.shape[-1] != robot.chain.dof:
        raise JointVectorError(
            f'{name} has shape {array.shape}; {robot.name} has {robot.dof} joints '
            f'({", ".join(robot.joint_names)}), so it must be (..., {robot.dof})'
        )
    return array


def evaluate(
    robot: Robot,
    q: npt.ArrayLike,
    qdot: npt.ArrayLike | None = None,
    depth: int = kernel.JACOBIAN,
) -> ToolState:
    """
    Return the tool's state at joint positions q: one kernel call, whatever the leading dimensions.

    Parameters
    ----------
    robot
        The arm.
    q : shape (..., n), rad or m
        Joint positions.
    qdot : shape (..., n), rad/s or m/s
        Joint velocities; its leading dimensions broadcast against those of `q`.
    depth
        `kernel.POSE`, `kernel.JACOBIAN` (with the twist) or `kernel.ALL_FRAMES`.

    Raises
    ------
    JointVectorError
        The last dimension is not n, or a number is not finite.

    """
    chain = robot.chain
    q = _joint_vector(robot, q, 'q')
    if qdot is not None:
        qdot = _joint_vector(robot, qdot, 'qdot')
        if qdot.shape != q.shape:
            q, qdot = _broadcast(q, qdot)
    rates = qdot if qdot is not None else chain.at_rest
    width = chain.widths[depth]
    if q.ndim == 1:
        rows = np.empty(width)
        bad = kernel.evaluate_one(chain.integers, chain.numbers, q, rates, depth, rows)
    else:
        flat = q.reshape(-1, chain.dof)
        table = np.empty((len(flat), width))
        bad = kernel.evaluate(
            chain.integers, chain.numbers, flat, rates.reshape(-1, chain.dof), depth, table
        )
        rows = table.reshape(*q.shape[:-1], width)
    if bad >= 0:
        raise JointVectorError(
            'joint positions and velocities must be finite, and what follows too: '
            f'row {bad} is {q.reshape(-1, chain.dof)[bad].tolist()}'
        )
    return ToolState(robot, q, qdot, rows)


def _broadcast(q: Floats, qdot: Floats) -> tuple[Floats, Floats]:
    try:
        shape = np.broadcast_shapes(q.shape, qdot.shape)
    except ValueError:
        raise JointVectorError(
            f'q and qdot have shapes {q.shape} and {qdot.shape}, which do not go together'
        ) from None
    # A copy in C order: by itself numpy would keep the order of the repeated axis, and numba would
    # compile the kernel once more for it.
    return (
        np.array(np.broadcast_to(q, shape), order='C'),
        np.array(np.broadcast_to(qdot, shape), order='C'),
    )
