# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Start the node beside a robot: ros2 launch kinematics.launch.py robot:=my_arm.yaml

`parameters` is a parameter file, such as one_arm.yaml beside this one. The node runs as a Python
module, so it need not be built with colcon.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration

ARGUMENTS = {
    'robot': ('puma560', 'a robot file, or the name of a bundled robot'),
    'namespace': ('/', 'namespace of the node'),
    'joint_states': ('joint_states', 'topic on which the joint states come'),
    'parameters': ('', 'parameter file; empty: the defaults'),
}


def command(robot, namespace, joint_states, parameters):
    """Return the command line of the node."""
    words = ['python3', '-m', 'kinematics_service', '--robot', robot, '--ros-args']
    words += ['-r', f'__ns:={namespace}', '-r', f'joint_states:={joint_states}']
    return words + (['--params-file', parameters] if parameters else [])


def node(context):
    """Return the node as a process."""
    given = [LaunchConfiguration(name).perform(context) for name in ARGUMENTS]
    return [ExecuteProcess(cmd=command(*given), output='screen')]


def generate_launch_description():
    """Return the arguments and the node."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=node)])
