"""The known poses of a robot file, against what the arm does."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import Fault
from ...kernel import Floats
from ...kinematics.forward import forward_kinematics
from ...rigid_motion import rotation_vector
from ...robot.file.parts.description import KnownPose
from ...robot.robot import Robot


@dataclass(frozen=True)
class PoseError:
    """
    How far the arm is from one known pose.

    Attributes
    ----------
    index
        Index of the pose in the file, from 0.
    distance, angle : m, rad
        Distance of the tools' origins, and angle of the rotation between them.
    """

    index: int
    known: KnownPose
    distance: float
    angle: float

    @property
    def share(self) -> float:
        """Return the error as a share of its tolerance: beyond 1 the pose is wrong."""
        shares = []
        for error, tolerance in (
            (self.distance, self.known.tolerance_xyz),
            (self.angle, self.known.tolerance_rpy),
        ):
            shares.append(error / tolerance if tolerance > 0.0 else np.inf if error else 0.0)
        return float(np.nanmax(shares)) if not np.isnan(shares).any() else np.inf

    def __str__(self) -> str:
        """
        Return the errors and their tolerances; of the position alone where nothing else is known.
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
    """Return the errors of poses (4, 4), one for each known pose, from those expected."""
    return tuple(
        PoseError(
            index,
            pose,
            float(np.linalg.norm(T[:3, 3] - wanted[:3, 3])),
            float(np.linalg.norm(rotation_vector(wanted[:3, :3].T @ T[:3, :3]))),
        )
        for index, (pose, T, wanted) in enumerate(zip(known, poses, expected))
    )


def pose_faults(robot: Robot, errors: Sequence[PoseError]) -> tuple[Fault, ...]:
    """Return a fault for each known pose that the arm misses by more than its tolerance."""
    return tuple(
        Fault(
            robot.description.file,
            0,
            f'known_poses[{error.index}]',
            f'the table puts the tool elsewhere: off by {error}',
        )
        for error in errors
        if error.share > 1.0
    )
