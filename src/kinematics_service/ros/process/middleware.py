"""Fast DDS profiles: settings of the middleware beyond ROS's quality of service."""

import os
import re
from collections.abc import MutableMapping
from importlib.util import find_spec
from pathlib import Path

# Where Fast DDS looks for profiles: the file named by a variable, and one in the working directory
# unless it is told to skip that. Version 3 looks at the old variable, too, and complains of it.
VARIABLES = {2: 'FASTRTPS_DEFAULT_PROFILES_FILE', 3: 'FASTDDS_DEFAULT_PROFILES_FILE'}
LOCAL = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')
# With it ROS leaves to the profiles how histories take memory.
MEMORY_BY_PROFILE = 'RMW_FASTRTPS_USE_QOS_FROM_XML'
# The rclpy of Kilted, the first distribution with Fast DDS 3.
RCLPY_WITH_3 = 9


def fast_dds() -> int:
    """
    Return the major version of Fast DDS that goes with this rclpy.

    Raises
    ------
    LookupError
        rclpy does not say its version.
    """
    # By a name of a file: importlib.metadata costs 15 ms of the node's start.
    rclpy = find_spec('rclpy')
    folder = Path(rclpy.origin).parents[1] if rclpy and rclpy.origin else Path()
    for name in os.listdir(folder):
        if version := re.match(r'rclpy-(\d+)\.', name):
            return 3 if int(version[1]) >= RCLPY_WITH_3 else 2
    raise LookupError(f'no version of rclpy in {folder}')


def profiles(version: int) -> Path:
    """Return the file of our profiles, in the words of that version of Fast DDS."""
    return Path(__file__).with_name(f'fastdds_{version}.xml')


def take_profiles(environment: MutableMapping[str, str] = os.environ) -> bool:
    """
    Let Fast DDS read this package's profiles; return False if the user has profiles, which stay.

    It must be called before the first participant is made, and has no effect on another
    middleware.
    """
    if any(map(environment.get, VARIABLES.values())) or any(Path(name).exists() for name in LOCAL):
        return False
    try:
        version = fast_dds()
    except LookupError:  # profiles are not worth a complaint
        return False
    environment[VARIABLES[version]] = str(profiles(version))
    if version == 2:
        environment.setdefault(MEMORY_BY_PROFILE, '1')
    return True
