"""
What is aimed at: a target and the rows of it that count, checked and packed for the kernel.

"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..chain import FrozenArrays
from ..errors import KinematicsError
from ..kernel import Floats
from ..rigid_motion import rotation_vector
from ..robot import Robot
from ..task import ROW_NAMES

# A rotation matrix written with four digits is still meant as one; what is nearest to it is taken.
NEARLY_ROTATION = 1e-3
ROTATION = 1e-13


class TargetError(KinematicsError, ValueError):
    """
    A target that is neither a pose nor a position, or not finite; rows that do not exist.

    """


@dataclass(frozen=True, eq=False)
class Aim(FrozenArrays):
    """
    A target.

    Attributes
    ----------
    pose : shape (4, 4)
        Tool in the base frame; the rotation is the identity for a position.
    rows
        Which rows count, a part of x y z rx ry rz: axes of the table's frame 0.
    numbers : shape (kernel.AIM_SIZE,)
        The same, packed for the kernel.

    """

    READ_ONLY: ClassVar = ('pose',)

    pose: Floats
    rows: tuple[str, ...]
    numbers: Floats


def aim_at(robot: Robot, target: npt.ArrayLike, rows: Sequence[str] | None = None) -> Aim:
    """
    Return the aim of a target.

    Parameters
    ----------
    robot
        The arm.
    target : shape (4, 4) or (3,)
        Pose, or position (m), of the tool in the base frame.
    rows
        Which rows count; default: all of a pose, x y z of a position.

    Raises
    ------
    TargetError
        The target is of another shape, not finite or no rigid motion; a row does not exist.

    """
    try:
        given = np.array(target, dtype=np.float64)
    except (TypeError, ValueError):
        raise TargetError('target must be numbers: a pose (4, 4) or a position (3,)') from None
    if given.shape not in ((4, 4), (3,)):
        raise TargetError(f'target has shape {given.shape}; it must be (4, 4) or (3,)')
    if not np.all(np.isfinite(given)):
        raise TargetError(f'target must be finite: {given.tolist()}')
    pose = np.eye(4)
    if given.shape == (3,):
        pose[:3, 3] = given
    else:
        pose[:3, 3] = given[:3, 3]
        pose[:3, :3] = _rotation(given)
    known = ROW_NAMES if given.shape == (4, 4) else ROW_NAMES[:3]
    if rows is None:
        rows = known
    if not rows or set(rows) - set(known):
        raise TargetError(f'rows must be some of {" ".join(known)}, not {" ".join(rows)!r}')
    ordered = tuple(name for name in ROW_NAMES if name in rows)
    return Aim(pose, ordered, _packed(robot, pose, ordered))


def _rotation(given: Floats) -> Floats:
    off = kernel.off_rotation(given)
    if off > NEARLY_ROTATION or given[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        raise TargetError('target is no rigid motion: its rotation is not orthogonal, or a mirror')
    if off <= ROTATION:
        return given[:3, :3]
    left, _, right = np.linalg.svd(given[:3, :3])
    return np.asarray(left @ right)


def _packed(robot: Robot, pose: Floats, rows: tuple[str, ...]) -> Floats:
    numbers = np.zeros(kernel.AIM_SIZE)
    numbers[:16] = pose.ravel()
    numbers[kernel.AIM_AXES : kernel.AIM_AXES + 9] = robot.task.numbers[:9]
    numbers[kernel.AIM_WEIGHTS :] = [
        (1.0 if i < 3 else robot.task.length) if name in rows else 0.0
        for i, name in enumerate(ROW_NAMES)
    ]
    return numbers


def parts_of_error(aim: Aim, pose: Floats) -> tuple[float, float]:
    """
    Return the norms of the position error (m) and rotation error (rad) of a pose, rows that count.

    """
    numbers = aim.numbers
    axes = numbers[kernel.AIM_AXES : kernel.AIM_AXES + 9].reshape(3, 3)
    weights = numbers[kernel.AIM_WEIGHTS : kernel.AIM_WEIGHTS + 6] > 0.0
    linear = axes.T @ (aim.pose[:3, 3] - pose[:3, 3])
    angular = axes.T @ rotation_vector(aim.pose[:3, :3] @ pose[:3, :3].T)
    return float(np.linalg.norm(linear[weights[:3]])), float(np.linalg.norm(angular[weights[3:]]))
