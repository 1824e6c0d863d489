# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Import modules that need ROS; if ROS is missing, raise an error that says how to install it."""

from importlib import import_module
from types import ModuleType

from .ros_variables import refuse_ros_variables

WITHOUT_ROS = (
    'this needs ROS 2 and its rclpy, which cannot be imported here ({reason}): pip install '
    "'.[ros]' in its checkout, or source a ROS 2 Jazzy installation"
)


class RosMissingError(Exception):
    """ROS cannot be imported; the message says how to install ROS."""

    def __init__(self, reason: ImportError) -> None:
        super().__init__(WITHOUT_ROS.format(reason=reason))


def is_ours(error: ImportError) -> bool:
    """
    Return whether a module that could not be imported belongs to this package.

    An import error of such a module is a mistake in the package. The error must not be reported as
    a missing ROS.
    """
    return (error.name or '').startswith(__package__.partition('.')[0])


def ros_module(name: str) -> ModuleType:
    """
    Import a module of this package that needs ROS, given its name, and return the module.

    Raises
    ------
    RosMissingError
        rclpy or a message package cannot be imported.
    RosVariableError
        ROS cannot start with its environment variables.
    """
    refuse_ros_variables()
    try:
        return import_module(f'..{name}', __package__)
    except ImportError as error:
        raise error if is_ours(error) else RosMissingError(error) from error
