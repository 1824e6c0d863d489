# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the factory calibration of a Universal Robots arm as corrections of its nominal table.

A factory table may have lengths of hundreds of metres that cancel. The table written here has an
extra angle instead. Its corrections are fitted to poses computed from the factory's table.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import CalibrationError
from ...kernel import Floats
from ...kinematics.forward import forward_kinematics
from ...kinematics.uncertainty.parameters import parameters_of
from ...rigid_motion import apart, screw_z
from ...robot.file.parts.description import DhRow
from ...robot.file.parts.parameters import ENDS
from ...robot.robot import Robot
from ...robot.task import seeded_poses
from .calibration import calibrate
from .checking import ROUND_OFF
from .corrections import corrected_robot
from .robot_text import CalibrationOrigin, Frames, calibrated_text, placed_robot
from .ur_calibration import JOINTS, UrCalibration, read_ur_calibration

# Number of seeded poses that the corrections are fitted to. The other poses are held out, and test
# the corrections.
FITTED_POSES = 100


@dataclass(frozen=True, eq=False)
class FactoryImport:
    """
    The robot file of a factory calibration.

    Attributes
    ----------
    text
        The robot file.
    robot
        The robot with the corrections.
    configurations
        Number of random configurations at which `robot` is compared with the factory's table.
    position_error, rotation_error
        The largest differences of the poses of `robot` from those of the factory's table, m and
        rad.
    nominal_error
        The largest difference of the nominal positions from those of the factory's table, m.
    """

    text: str
    robot: Robot
    configurations: int
    position_error: float
    rotation_error: float
    nominal_error: float

    def __str__(self) -> str:
        """Return the largest differences from the factory's table as text."""
        return (
            f'{self.position_error:.1e} m and {self.rotation_error:.1e} rad from the factory '
            f'table at most, over {self.configurations} configurations; the nominal table is '
            f'{1000 * self.nominal_error:.2f} mm from it'
        )


def import_ur_calibration(path: Path, robot: Robot, text: str, date: str) -> FactoryImport:
    """
    Return the robot file of a Universal Robots arm with its factory calibration.

    Parameters
    ----------
    path
        `calibration.conf` of the controller, or the YAML of ur_calibration.
    robot, text
        The nominal robot, and its file.
    date
        The date that the certificate in the robot file has.

    Raises
    ------
    CalibrationError
        The file cannot be read, or is that of another robot.
    """
    given = read_ur_calibration(path)
    rows = [isinstance(link, DhRow) for link in robot.description.links]
    turning = robot.joint_types.count('revolute') == len(rows) == JOINTS
    if robot.convention != 'standard' or not turning:
        raise CalibrationError(
            f'{robot.name}: a factory calibration of Universal Robots belongs to a standard '
            'Denavit-Hartenberg table of six turning joints, as ur3e, ur5e and ur10e have it',
            code='unsupported',
        )
    q = np.clip(seeded_poses(robot.limits, [False] * JOINTS), -np.pi, np.pi)
    expected = _poses(given, robot, q)
    nominal = float(np.max(apart(forward_kinematics(robot, q), expected)[0]))
    some, rest = slice(0, FITTED_POSES), slice(FITTED_POSES, None)
    # First keep the frames of base and tool. If this fit is not exact, correct base and tool in a
    # second fit: the first or last joint axis of the factory may not be an axis of these frames.
    tried: tuple[tuple[tuple[str, ...], Frames], ...] = ((ENDS, 'robot'), ((), 'measured'))
    for fix, frames in tried:
        found = calibrate(robot, q[some], expected[some], fix=fix)
        mine = placed_robot(found, frames)
        distances, angles = apart(forward_kinematics(mine, q[rest]), expected[rest])
        position, rotation = float(np.max(distances)), float(np.max(angles))
        if max(position, rotation) < ROUND_OFF:
            break
    else:
        raise CalibrationError(
            f'{path}: the table found is {position:.1e} m and {rotation:.1e} rad from the '
            "factory's own: it is not written",
            code='mismatch',
        )
    origin = CalibrationOrigin(f'the factory calibration {path.name}', date)
    written = calibrated_text(found, text, q[some], expected[some], origin, frames)
    return FactoryImport(written, mine, len(distances), position, rotation, nominal)


def _poses(given: UrCalibration, robot: Robot, q: Floats) -> Floats:
    if given.deltas:
        table = parameters_of(robot).table
        added = [given.deltas.get(one.place, np.zeros(JOINTS))[one.row] for one in table]
        return forward_kinematics(corrected_robot(robot, table, np.array(added)), q)
    base, tool = (end.motion.matrix for end in (robot.description.base, robot.description.tool))
    T = np.broadcast_to(base, (len(q), 4, 4))
    for origin, joint in zip(given.origins, q.T):
        T = T @ origin @ np.array([screw_z(angle, 0.0) for angle in joint.tolist()])
    return np.asarray(T @ tool)
