"""A target and its rows that count, checked."""

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...errors import TargetError
from ...kernel import Floats
from ...robot.robot import Robot
from ...robot.task import ROW_NAMES

IDENTITY = np.eye(4)


# Of a pose and of a position.
SHAPES = ((4, 4), (3,))


class IkTarget(NamedTuple):
    """
    A target.

    Attributes
    ----------
    rows
        The rows that count, a part of x y z rx ry rz: axes of the table's frame 0.
    pose : shape (4, 4)
        The tool in the base frame; for a position its rotation is the identity.
    residual
        The residual of the tool against the target.
    """

    rows: tuple[str, ...]
    pose: Floats
    residual: kernel.Residual


def ik_target_of(
    robot: Robot, target: npt.ArrayLike, rows: Sequence[str] | None = None
) -> IkTarget:
    """
    Return a checked target.

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
        given = np.array(target, dtype=np.float64, order='C')
    except (TypeError, ValueError):
        raise TargetError(
            'target must be numbers: a pose (4, 4) or a position (3,)', 'target', SHAPES
        ) from None
    known: tuple[str, ...] = ROW_NAMES
    if given.shape == (3,):
        known = ROW_NAMES[:3]
    elif given.shape != (4, 4):
        raise TargetError(
            f'target has shape {given.shape}; it must be (4, 4) or (3,)',
            'target',
            SHAPES,
            given.shape,
        )
    if rows is None:
        ordered = known
    else:
        if not rows or set(rows) - set(known):
            raise TargetError(
                f'rows must be some of {" ".join(known)}, not {" ".join(rows)!r}',
                'rows',
                known,
                rows,
            )
        ordered = tuple(name for name in ROW_NAMES if name in rows)
    pose = IDENTITY.copy()
    state = kernel.take_target(given, pose)
    if state != kernel.FINE:
        if state == kernel.NOT_FINE:
            raise TargetError(
                f'target must be finite: {given.tolist()}', 'target', SHAPES, given.shape
            )
        if state == kernel.NOT_RIGID:
            raise TargetError(
                'target is no rigid motion: its rotation is not orthogonal, or a mirror',
                'target',
                SHAPES,
                given.shape,
            )
        left, _, right = np.linalg.svd(given[:3, :3])
        pose[:3, :3] = left @ right
    return IkTarget(ordered, pose, residual_of(robot, pose, ordered))


def residual_of(robot: Robot, pose: Floats, rows: tuple[str, ...]) -> kernel.Residual:
    """Return the residual of the tool against a pose (4, 4), in the rows that count."""
    weights = _weights(robot.task.length, rows)
    return kernel.Residual(robot.chain, pose, robot.task.rotation, weights)


@functools.lru_cache(maxsize=128)
def _weights(length: float, rows: tuple[str, ...]) -> Floats:
    return np.array(
        [(1.0 if i < 3 else length) if name in rows else 0.0 for i, name in enumerate(ROW_NAMES)]
    )
