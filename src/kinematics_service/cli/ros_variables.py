# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check the environment variables of ROS before ROS is imported.

With some wrong values, a ROS library would end the process during the import of rclpy.
"""

import importlib.util
import os
import re
from pathlib import Path

# Largest ROS_DOMAIN_ID. DDS uses ports from 7400 + 250 * domain on, and ports must be below 65536.
MAX_DOMAIN = 232
DOMAIN = re.compile(r'0|[1-9][0-9]{0,2}')
# Folder in which a ROS installation lists its middlewares (implementations of ROS communication).
# Its entry CHOOSER is not a middleware but the layer that loads a middleware.
INDEX = Path('share/ament_index/resource_index/rmw_typesupport')
CHOOSER = 'rmw_implementation'


class RosVariableError(Exception):
    """An environment variable has a value with which ROS cannot start; the exit code is 2."""


def refuse_ros_variables() -> None:
    """
    Raise an error if ROS_DOMAIN_ID or RMW_IMPLEMENTATION has a wrong value.

    Raises
    ------
    RosVariableError
        ROS could not start with this value.
    """
    sentence = _wrong_domain() or _wrong_middleware()
    if sentence is not None:
        raise RosVariableError(sentence)


def _wrong_domain() -> str | None:
    # Check the value here, because ROS would accept wrong values: it reads 5x as 5, -1 as 0 and
    # 010 as 8.
    value = os.environ.get('ROS_DOMAIN_ID', '')
    number = value.strip()
    if not value or (DOMAIN.fullmatch(number) and int(number) <= MAX_DOMAIN):
        return None
    return (
        f'ROS_DOMAIN_ID is {value[:40]!a}: it must be a whole number from 0 to {MAX_DOMAIN}, '
        'or not be set'
    )


def _wrong_middleware() -> str | None:
    value, installed = os.environ.get('RMW_IMPLEMENTATION', ''), _middlewares()
    if not value or not installed or value in installed:
        return None
    return (
        f'RMW_IMPLEMENTATION is {value[:40]!a}, which is not installed here: it must be '
        f'{" or ".join(installed)}, or not be set'
    )


def _middlewares() -> list[str]:
    # Return the names of the middlewares of the ROS installation that contains rclpy. The result
    # is empty if the installation has no list.
    spec = importlib.util.find_spec('rclpy')
    if spec is None or spec.origin is None:
        return []
    origin = Path(spec.origin).resolve()
    sourced = [Path(p) for p in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if p]
    if not any(origin.is_relative_to(prefix.resolve()) for prefix in sourced):
        sourced = [parent for parent in origin.parents if (parent / INDEX).is_dir()][:1]
    names = {file.name for prefix in sourced for file in (prefix / INDEX).glob('*')}
    return sorted(names - {CHOOSER})
