# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the command `export`, which writes a robot as URDF, or as a C++ or C header."""

import re
import sys
from pathlib import Path
from typing import Optional

from ....cli.options import (
    RobotArgument,
    WrongUsage,
    given_robot,
    option,
    refuse_robot_file,
)
from ....output_file import say_written, write_document
from ....robot.robot import Robot
from ....robot.urdf.writer import export_urdf, without_loops
from ....typography import counted
from ..header import header_of


def export(
    robot: RobotArgument,
    urdf: Optional[str] = option("Write URDF; '-': to the screen.", 'FILE'),
    cpp: Optional[str] = option("Write a C++17 header; '-': to the screen.", 'FILE'),
    c: Optional[str] = option("Write a C99 header; '-': to the screen.", 'FILE', name='--c'),
) -> None:
    """
    Write a robot for other programs: as URDF, or as a C++ or C header.

    \b
    Examples:
      kinematics_service export puma560 --urdf puma560.urdf
      kinematics_service export my_arm.yaml --urdf - | check_urdf /dev/stdin
      kinematics_service export ur5e --cpp ur5e.hpp

    URDF is for RViz, robot_state_publisher, MoveIt, Pinocchio and others. Every frame of the table
    and every point is a link, exact to 1e-12. Coupled and helical joints become mimic joints. The
    shapes only mark joints and links, so that you can see the arm. Inertia and collision shapes
    are not known and not written. Closed loops, which URDF does not have, are left out, and a
    sentence on standard error says so.

    A header is for controllers and firmware. It needs only the standard library, and allocates no
    memory. Its results have the bits of this package.
    """
    given = {'--urdf': urdf, '--cpp': cpp, '--c': c}
    files = {name: file for name, file in given.items() if file is not None}
    if len(files) != 1:
        raise WrongUsage('give one of --urdf FILE, --cpp FILE and --c FILE')
    ((name, file),) = files.items()
    arm = given_robot(robot)
    refuse_robot_file(name, Path(file), robot)
    if urdf is not None:
        _write_urdf(arm, urdf)
        return
    write_document(file, header_of(arm, cpp=cpp is not None))
    if file != '-':
        say_written(Path(file))


def _write_urdf(arm: Robot, file: str) -> None:
    text = export_urdf(arm)
    write_document(file, text)
    if arm.passive_joint_names:
        print(without_loops(arm), file=sys.stderr)
    if file != '-':
        links, joints = (len(re.findall(f'<{part} ', text)) for part in ('link', 'joint'))
        print(f'wrote {file}: {arm.name}, {counted(links, "link")}, {counted(joints, "joint")}')
