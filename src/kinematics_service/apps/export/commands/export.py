# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the command `export`, which writes a robot as URDF, as a header, or for ros2_control."""

import re
import sys
from pathlib import Path
from typing import Optional

from ....cli import options
from ....output_file import say_written, write_document
from ....robot.robot import Robot
from ....robot.urdf.writer import export_urdf, without_loops
from ....typography import counted
from ..header import header_of
from ..ros2_control import write_package


def export(
    robot: options.RobotArgument,
    urdf: Optional[str] = options.option("Write URDF; '-': to the screen.", 'FILE'),
    cpp: Optional[str] = options.option("Write a C++17 header; '-': to the screen.", 'FILE'),
    c: Optional[str] = options.option(
        "Write a C99 header; '-': to the screen.", 'FILE', name='--c'
    ),
    ros2_control: Optional[Path] = options.option(
        'Write a ROS 2 package with a kinematics_interface plugin (C++).', 'FOLDER'
    ),
    float: bool = options.flag('--float', 'Use float instead of double in the header.'),
) -> None:
    """
    Write a robot for other programs: as URDF, a C++ or C header, or a plugin for ros2_control.

    \b
    Examples:
      kinematics_service export puma560 --urdf puma560.urdf
      kinematics_service export my_arm.yaml --urdf - | check_urdf /dev/stdin
      kinematics_service export ur5e --cpp ur5e.hpp
      kinematics_service export ur5e --ros2-control src/kinematics_interface_ur5e

    URDF is for RViz, robot_state_publisher, MoveIt, Pinocchio and others. Every frame of the table
    and every point is a link, exact to 1e-12. Coupled and helical joints become mimic joints. The
    shapes only mark joints and links, so that you can see the arm. Inertia and collision shapes
    are not known and not written. Closed loops, which URDF does not have, are left out, and a
    sentence on standard error says so.

    A header is for controllers and firmware. It needs only the standard library, and allocates no
    memory. With double, poses and Jacobians from the header equal those of this package bit for
    bit.

    --ros2-control writes an ament package with such headers and a plugin for kinematics_interface,
    which controllers such as admittance_controller load. The links of the plugin are the base, the
    tool and the points of the robot file.
    """
    given = {'--urdf': urdf, '--cpp': cpp, '--c': c, '--ros2-control': ros2_control}
    files = {name: str(file) for name, file in given.items() if file is not None}
    if len(files) != 1:
        raise options.WrongUsage(
            'give one of --urdf FILE, --cpp FILE, --c FILE and --ros2-control FOLDER'
        )
    ((name, file),) = files.items()
    if float and not (cpp or c):
        raise options.WrongUsage('--float is for --cpp and --c; leave it out')
    arm = options.given_robot(robot)
    if ros2_control is not None:
        print(f'wrote {ros2_control}: package {write_package(arm, ros2_control)}')
        return
    options.refuse_robot_file(name, Path(file), robot)
    if urdf is not None:
        _write_urdf(arm, urdf)
        return
    write_document(file, header_of(arm, cpp is not None, float))
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
