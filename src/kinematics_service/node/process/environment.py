# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find reasons why a node must not start with the present environment variables and packages."""

import os
import sys
from pathlib import Path

import rclpy

# Folders for ROS's log files, in the order in which rcl tries the folders. Each entry has an
# environment variable, and a folder below the variable's value.
LOGS = (('ROS_LOG_DIR', ''), ('ROS_HOME', 'log'), ('HOME', '.ros/log'))


def security_refusal() -> str | None:
    """
    Return the reason not to start if ROS_SECURITY_ENABLE requests security that is not installed.

    If ROS was installed from Python wheels (pip), Fast DDS is built without DDS security. With
    ROS's default strategy, Permissive, the node would start unsecured without a message.
    """
    if os.environ.get('ROS_SECURITY_ENABLE', '').lower() != 'true' or not rclpy_is_a_wheel():
        return None
    return (
        'ROS_SECURITY_ENABLE: true, but the installed rclpy has no DDS security; unset it, or '
        'start the node unsecured with --allow-unsecured'
    )


def rclpy_is_a_wheel() -> bool:
    """Return whether rclpy was installed by pip and not by a ROS installation."""
    folder = Path(rclpy.__file__).resolve().parent.parent
    return any(folder.glob('ros_rclpy-*.dist-info'))


def mixture_refusal() -> str | None:
    """
    Return the reason not to start if rclpy comes from wheels and a ROS installation is sourced.
    """
    origin = Path(rclpy.__file__).resolve()
    version = f'python{sys.version_info.major}.{sys.version_info.minor}'
    prefixes = [Path(p) for p in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if p]
    if any(origin.is_relative_to(prefix.resolve()) for prefix in prefixes):
        return None
    for prefix in prefixes:
        if (prefix / 'lib' / version / 'site-packages' / 'rclpy').exists() or (
            prefix / 'lib' / 'librcl.so'
        ).exists():
            return (
                f'two ROS installations are mixed: rclpy comes from {origin.parent.parent}, but '
                f'{prefix} is sourced, so which libraries are loaded is left to chance; use a '
                'terminal without the sourced one, or an environment without the rclpy wheels '
                '(--allow-mixed-ros starts anyway)'
            )
    return None


def log_refusal() -> str | None:
    """
    Return the reason why ROS cannot write a log file; None if ROS can.

    ROS would not start without a log file, for example on a read-only file system, or if no
    variable names the home folder.
    """
    # Search as rcl does: the first variable that is set names the folder.
    folders = [Path(os.environ[name], below) for name, below in LOGS if os.environ.get(name)]
    if not folders:
        return 'neither ROS_LOG_DIR, ROS_HOME nor HOME is set'
    try:
        folders[0].mkdir(parents=True, exist_ok=True)
    except OSError as error:
        return f'{error.filename}: {error.strerror}'
    return None if os.access(folders[0], os.W_OK) else f'{folders[0]} cannot be written to'
