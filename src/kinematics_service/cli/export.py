# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `export`: write a robot as URDF for other programs."""

import re
import sys
from pathlib import Path

from ..output_file import write_file
from ..robot.urdf.writer import export_urdf, without_loops
from ..typography import counted
from .options import RobotArgument, given_robot, option, refuse_robot_file


def export(
    robot: RobotArgument,
    urdf: str = option("Where to write it; '-': the screen.", 'FILE', default=...),
) -> None:
    """
    Write a robot as URDF, for RViz, robot_state_publisher, MoveIt, Pinocchio and others.

    \b
    Examples:
      kinematics_service export puma560 --urdf puma560.urdf
      kinematics_service export my_arm.yaml --urdf - | check_urdf /dev/stdin

    Every frame of the table and every point is a link, exact to 1e-12. Coupled and helical joints
    become mimic joints. The shapes only mark joints and links, so that you can see the arm.
    Inertia and collision shapes are not known and not written. Closed loops, which URDF does not
    have, are left out, and a sentence on standard error says so.
    """
    arm = given_robot(robot)
    refuse_robot_file('--urdf', Path(urdf), robot)
    text = export_urdf(arm)
    write_document(urdf, text)
    if arm.passive_joint_names:
        print(without_loops(arm), file=sys.stderr)
    if urdf != '-':
        links, joints = (len(re.findall(f'<{part} ', text)) for part in ('link', 'joint'))
        print(f'wrote {urdf}: {arm.name}, {counted(links, "link")}, {counted(joints, "joint")}')


def write_document(file: str, text: str) -> None:
    """
    Write a text to a file, or to standard output for `-`.

    Raises
    ------
    KinematicsError
        The file cannot be written.
    """
    if file == '-':
        sys.stdout.write(text)
    else:
        write_file(Path(file), text)
