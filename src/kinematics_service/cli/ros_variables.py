"""
Faults of the environment variables of ROS, found before ROS is imported.

Some of them would end the process while rclpy is imported, with a message of that library.
"""

import importlib.util
import os
import re
from pathlib import Path

# The ports of DDS end here: 7400 + 250 * domain and some more must be less than 65536.
LARGEST_DOMAIN = 232
DOMAIN = re.compile(r'0|[1-9][0-9]{0,2}')
# Where a ROS installation lists the middlewares it has, beside the layer that chooses one of them.
INDEX = Path('share/ament_index/resource_index/rmw_typesupport')
CHOOSER = 'rmw_implementation'


class RosVariableError(Exception):
    """An environment variable with which ROS cannot start: exit code 2."""


def refuse_ros_variables() -> None:
    """
    Look at the variables before ROS does.

    Raises
    ------
    RosVariableError
        ROS could not start with them.
    """
    sentence = _wrong_domain() or _wrong_middleware()
    if sentence is not None:
        raise RosVariableError(sentence)


def _wrong_domain() -> str | None:
    # ROS itself takes 5x for 5, -1 for 0 and 010 for 8.
    value = os.environ.get('ROS_DOMAIN_ID', '')
    number = value.strip()
    if not value or (DOMAIN.fullmatch(number) and int(number) <= LARGEST_DOMAIN):
        return None
    return (
        f'ROS_DOMAIN_ID is {value[:40]!a}: it must be a whole number from 0 to {LARGEST_DOMAIN}, '
        'or not be set'
    )


def _wrong_middleware() -> str | None:
    value, known = os.environ.get('RMW_IMPLEMENTATION', ''), _middlewares()
    if not value or not known or value in known:
        return None
    return (
        f'RMW_IMPLEMENTATION is {value[:40]!a}, which is not installed here: it must be '
        f'{" or ".join(known)}, or not be set'
    )


def _middlewares() -> list[str]:
    # As listed by the ROS installation that rclpy belongs to; empty if it lists none.
    spec = importlib.util.find_spec('rclpy')
    if spec is None or spec.origin is None:
        return []
    here = Path(spec.origin).resolve()
    sourced = [Path(p) for p in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if p]
    if not any(here.is_relative_to(prefix.resolve()) for prefix in sourced):
        sourced = [parent for parent in here.parents if (parent / INDEX).is_dir()][:1]
    found = {file.name for prefix in sourced for file in (prefix / INDEX).glob('*')}
    return sorted(found - {CHOOSER})
