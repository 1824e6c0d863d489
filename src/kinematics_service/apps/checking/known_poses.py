# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compare the known poses of a robot file with the poses that its table gives."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import Fault
from ...kernel import Floats
from ...kinematics.forward import forward_kinematics, jacobian
from ...rigid_motion import rotation_vector
from ...robot.file.parts.description import KnownPose
from ...robot.robot import Robot


@dataclass(frozen=True)
class PoseError:
    """
    The difference between one known pose of a robot file and the pose that the table gives.

    Attributes
    ----------
    index
        Index of the known pose in the file, from 0.
    known
        The known pose.
    distance, angle : m, rad
        Distance between the tool origins of the known pose and of the computed pose, and angle of
        the rotation between the two poses.
    """

    index: int
    known: KnownPose
    distance: float
    angle: float

    @property
    def share(self) -> float:
        """
        Return the larger of position and rotation error, each divided by its tolerance. Above 1
        the pose is wrong.
        """
        pairs = (self.distance, self.known.tolerance_xyz), (self.angle, self.known.tolerance_rpy)
        shares = [
            error / tolerance if tolerance > 0.0 else math.inf if error else 0.0
            for error, tolerance in pairs
        ]
        return math.inf if any(map(math.isnan, shares)) else max(shares)

    def __str__(self) -> str:
        """
        Return the errors and their tolerances as text; without an orientation, only the position.
        """
        position = f'{self.distance:.2g} m (tolerance {self.known.tolerance_xyz:g})'
        if math.isinf(self.known.tolerance_rpy):
            return position
        return f'{position}, {self.angle:.2g} rad (tolerance {self.known.tolerance_rpy:g})'


def pose_errors(robot: Robot) -> tuple[PoseError, ...]:
    """Return the error of each known pose of a robot, in the order of its file."""
    known = robot.description.known_poses
    if not known:
        return ()
    poses = forward_kinematics(robot, [pose.q for pose in known])
    return errors_between(known, poses, [pose.motion.matrix for pose in known])


def errors_between(
    known: Sequence[KnownPose], poses: Iterable[Floats], expected: Iterable[Floats]
) -> tuple[PoseError, ...]:
    """Return the errors of computed poses (4, 4) from expected poses, one for each known pose."""
    return tuple(
        PoseError(
            index,
            pose,
            float(np.linalg.norm(T[:3, 3] - T_expected[:3, 3])),
            float(np.linalg.norm(rotation_vector(T_expected[:3, :3].T @ T[:3, :3]))),
        )
        for index, (pose, T, T_expected) in enumerate(zip(known, poses, expected))
    )


def within_digits(robot: Robot) -> tuple[KnownPose, ...]:
    """
    Return the known poses with wider tolerances, which allow for the rounding of their digits.
    """
    known = robot.description.known_poses
    widened = []
    for pose, J in zip(known, jacobian(robot, [pose.q for pose in known])):
        q = pose.rounding.q or (0.0,) * robot.dof
        xyz, rpy = np.reshape(np.abs(J) @ q, (2, 3))
        xyz, rpy = xyz + pose.rounding.xyz, rpy + pose.rounding.rpy
        position = max(pose.tolerance_xyz, float(np.linalg.norm(xyz)))
        angle = max(pose.tolerance_rpy, float(np.linalg.norm(rpy)))
        widened.append(replace(pose, tolerance_xyz=position, tolerance_rpy=angle))
    return tuple(widened)


def pose_faults(robot: Robot, errors: Sequence[PoseError]) -> tuple[Fault, ...]:
    """Return a fault for each known pose whose error is larger than its tolerance."""
    missed = [error for error in errors if error.share > 1.0]
    allowed = within_digits(robot) if missed else ()
    faults = []
    for error in missed:
        message = f'the table puts the tool elsewhere: off by {error}'
        if replace(error, known=allowed[error.index]).share <= 1.0:
            tolerance = _tolerance(robot, error)
            message += f', as its rounded digits may be: write tolerance: {{{tolerance}}}'
        where = f'known_poses[{error.index}]'
        faults.append(Fault(robot.description.file, 0, where, message, 'known-pose'))
    return tuple(faults)


def _tolerance(robot: Robot, error: PoseError) -> str:
    # Return as text the tolerances (position, rotation) that the known pose needs to agree with
    # the table. They are in the units of the file, rounded up to powers of ten. Leave out a
    # tolerance that is large enough already.
    lengths = 1000.0 if robot.description.length_unit == 'mm' else 1.0
    angles = 180.0 / math.pi if robot.description.angle_unit == 'deg' else 1.0
    rows = [('xyz', error.distance * lengths, error.known.tolerance_xyz * lengths)]
    if not math.isinf(error.known.tolerance_rpy):
        rows.append(('rpy', error.angle * angles, error.known.tolerance_rpy * angles))
    return ', '.join(
        f'{key}: {10.0 ** math.ceil(math.log10(off)):g}' for key, off, limit in rows if off > limit
    )
