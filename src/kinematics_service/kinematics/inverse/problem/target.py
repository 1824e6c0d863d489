# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Check a target of inverse kinematics: pose, prescribed pose components, and tolerance."""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .... import kernel
from ....errors import TargetError
from ....kernel import Floats
from ....robot.robot import Robot
from ....robot.task import ROW_NAMES
from ...arguments import number_or_nan, numbers_of, rows_in_order

IDENTITY = np.eye(4)


# Accepted shapes of a target: a pose and a position.
SHAPES = ((4, 4), (3,))
TOOL_AXES = ('x', 'y', 'z')
# Largest residual of an exact solution, in m. It is larger than the round-off of forward
# kinematics of usual arms.
EXACT_ERROR = 1e-10
# If the reach of an arm is below 1 mm, this number times the reach replaces EXACT_ERROR. The
# product is smaller than EXACT_ERROR.
SMALL_ARM_ERROR_RATIO = 1e-7
# If the reach of an arm is above 1 km, this number times the reach replaces EXACT_ERROR. The
# product is larger than EXACT_ERROR.
LARGE_ARM_ERROR_RATIO = 1e-13


class IkTarget(NamedTuple):
    """
    A checked target of inverse kinematics: pose, prescribed pose components, and tolerance.

    Attributes
    ----------
    rows
        The prescribed components of the pose, some of x y z rx ry rz, in the axes of the table's
        frame 0. The tool may differ from `pose` in the other components.
    axis
        The axis of the tool, x, y or z, whose direction the target gives; empty if the target
        gives no direction.
    pose : shape (4, 4)
        The wanted pose of the tool in the base frame. If the target is a position, the rotation is
        the identity.
    residual
        The kernel's object that computes the error of the tool's pose for this target.
    tolerance
        Largest position error (m) and largest rotation error (rad).
    bound
        The residual, m, of a pose whose position error and rotation error equal their tolerances.
    exact
        Largest residual of an exact solution, m.
    proved
        Largest residual of an accepted solution, m: `exact`, or `bound` if the target accepts
        every solution within the tolerance (see the method `within_tolerance`).
    """

    rows: tuple[str, ...]
    axis: str
    pose: Floats
    residual: kernel.Residual
    tolerance: float
    bound: float
    exact: float
    proved: float

    @property
    def equations(self) -> int:
        """
        Return the number of equations of the target.

        Each pose component in `rows` is one equation. The direction of a tool axis adds two
        equations.
        """
        return len(self.rows) + (2 if self.axis else 0)

    @property
    def words(self) -> str:
        """
        Return a text that names what the target prescribes: `x y z, direction of tool axis z`.
        """
        return ' '.join(self.rows) + (f', direction of tool axis {self.axis}' if self.axis else '')

    def is_reached_at(self, q: Floats, residual: float) -> bool:
        """
        Return whether joint positions q (n,), whose residual is `residual` (m), are a solution.
        """
        if residual < self.exact:
            return True
        return residual < self.proved and self.is_near_at(q)

    def is_near_at(self, q: Floats) -> bool:
        """
        Return whether the tool is within the tolerance of the target at joint positions q (n,).
        """
        return max(kernel.parts_of_error(self.residual, np.array(q))) <= self.tolerance

    def within_tolerance(self) -> 'IkTarget':
        """
        Return the target with a larger bound `proved`, so that solutions are accepted that are not
        exact but within the tolerance.
        """
        return self._replace(proved=max(self.bound, self.exact))


def ik_target_of(
    robot: Robot,
    target: npt.ArrayLike,
    rows: Sequence[str] | None = None,
    axis: str | None = None,
    tolerance: float = 0.0,
) -> IkTarget:
    """
    Check a target of inverse kinematics and return it as `IkTarget`.

    Parameters
    ----------
    robot
        The arm.
    target : shape (4, 4) or (3,)
        Pose, or position (m), of the tool in the base frame.
    rows
        The prescribed components of the pose, some of x y z rx ry rz. Default: all for a pose; x y
        z for a position or with an axis.
    axis
        The axis of the tool, x, y or z, whose direction the arm must meet instead of the whole
        rotation.
    tolerance
        Largest position error (m) and rotation error (rad).

    Raises
    ------
    TargetError
        The target has another shape, is not finite or not a rigid motion. A row or an axis does
        not exist. The target is a position, but `axis` or a row of the rotation is given; or a row
        of the rotation is given together with `axis`. The tolerance is negative or not finite.
    """
    if not 0.0 <= number_or_nan(tolerance) < math.inf:
        accepted = '0 or a positive number (m and rad)'
        raise TargetError.refused('tolerance', accepted, tolerance, code='out-of-range')
    try:
        given = np.asarray(target, np.float64, 'C')
    except (TypeError, ValueError, OverflowError):
        sentence = 'target must be numbers: a pose (4, 4) or a position (3,)'
        raise TargetError(sentence, 'target', SHAPES, code='not-a-number') from None
    shape = given.shape
    if shape not in SHAPES:
        raise TargetError.wrong_shape('target', shape, SHAPES)
    if axis is not None and str(axis) not in TOOL_AXES:
        raise TargetError.unknown_name('axis', TOOL_AXES, axis)
    if axis is not None and shape != (4, 4):
        sentence = f'axis {axis} needs a pose (4, 4) as target, not a position (3,)'
        raise TargetError(sentence, 'axis', TOOL_AXES, axis, code='conflict')
    # The direction of a tool axis replaces the three rows of the rotation.
    known = ROW_NAMES if axis is None and shape == (4, 4) else ROW_NAMES[:3]
    ordered = known if rows is None else rows_in_order(TargetError, rows, known)
    counted = _counted(robot, ordered, axis or '')
    pose, exact = _rigid(given), counted.exact
    residual = residual_of(robot, pose, ordered, axis or '')
    bound = counted.off_by_one * tolerance
    return IkTarget(ordered, axis or '', pose, residual, tolerance, bound, exact, exact)


def poses_of(targets: npt.ArrayLike) -> Floats:
    """
    Check target poses of the tool and return them, shape (N, 4, 4), each with an orthogonal
    rotation.

    Raises
    ------
    TargetError
        A target is not a pose, or not finite.
    """
    given = numbers_of('targets', targets, TargetError, [('N', 4, 4)])
    if given.ndim != 3 or given.shape[1:] != (4, 4):
        raise TargetError.wrong_shape('targets', given.shape, [('N', 4, 4)], '(N, 4, 4)')
    return np.array([_rigid(pose) for pose in given]).reshape(-1, 4, 4)


def _rigid(given: Floats) -> Floats:
    # Returns the pose (4, 4) of a target, with its rotation made orthogonal to round-off.
    pose = IDENTITY.copy()
    state = kernel.take_target(given, pose)
    if state == kernel.FINE:
        return pose
    if state == kernel.NOT_FINE:
        sentence = f'target must be finite, not {given.tolist()}'
        raise TargetError(sentence, 'target', SHAPES, given.shape, code='not-finite')
    if state == kernel.NOT_RIGID:
        sentence = 'target must be a rigid motion; its rotation is not orthogonal, or a mirror'
        raise TargetError(sentence, 'target', SHAPES, given.shape, code='not-rigid')
    left, _, right = np.linalg.svd(given[:3, :3])
    pose[:3, :3] = left @ right
    return pose


class _Counted(NamedTuple):
    # The arguments of `kernel.Residual` for certain rows: weights of the rows, index of the tool's
    # axis or -1, and reach. `off_by_one` is the residual of a pose with errors of 1 m and 1 rad.
    # `exact` is the largest residual of an exact solution, m.
    weights: Floats
    tool_axis: int
    reach: float
    off_by_one: float
    exact: float


@functools.lru_cache(maxsize=128)
def _counted(robot: Robot, rows: tuple[str, ...], axis: str) -> _Counted:
    # If the reach is smaller than the characteristic length, use this length as reach, because a
    # tool that never leaves the origin of frame 0 has the reach 0.
    length = robot.singularity.task.length
    reach = max(robot.singularity.task.reach, length)
    names = rows + ROW_NAMES[3:] if axis else rows
    units = [1.0] * 3 + [length] * 3
    return _Counted(
        np.array([unit if name in names else 0.0 for unit, name in zip(units, ROW_NAMES)]),
        TOOL_AXES.index(axis) if axis else -1,
        reach,
        math.hypot(1.0, length),
        min(max(EXACT_ERROR, LARGE_ARM_ERROR_RATIO * reach), SMALL_ARM_ERROR_RATIO * reach),
    )


def residual_of(
    robot: Robot, pose: Floats, rows: tuple[str, ...], axis: str = ''
) -> kernel.Residual:
    """
    Return the kernel's `Residual`, the error of the tool against a pose (4, 4), for the given
    rows.
    """
    weights, tool_axis, reach, _, _ = _counted(robot, rows, axis)
    return kernel.Residual(
        robot.chain, pose, robot.singularity.task.rotation, weights, tool_axis, reach
    )
