"""What is asked of the middleware beyond the quality of service that ROS knows."""

import os
from collections.abc import MutableMapping
from importlib import metadata
from pathlib import Path

# Where Fast DDS looks for profiles: the file named by a variable, and one in the working directory
# unless it is told to skip that. Version 3 looks at the old variable, too, and complains of it.
VARIABLES = {2: 'FASTRTPS_DEFAULT_PROFILES_FILE', 3: 'FASTDDS_DEFAULT_PROFILES_FILE'}
LOCAL = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')
# The rclpy of Kilted, the first distribution with Fast DDS 3.
RCLPY_WITH_3 = 9


def fast_dds() -> int:
    """Return the major version of Fast DDS that goes with this rclpy."""
    return 3 if int(metadata.version('rclpy').partition('.')[0]) >= RCLPY_WITH_3 else 2


def profiles(version: int) -> Path:
    """Return the file of our profiles, in the words of that version of Fast DDS."""
    return Path(__file__).with_name(f'fastdds_{version}.xml')


def take_profiles(environment: MutableMapping[str, str] = os.environ) -> bool:
    """
    Let Fast DDS read our profiles; return False where the user has profiles, which stand.

    To be called before the first participant is made; means nothing to another middleware.
    """
    if any(map(environment.get, VARIABLES.values())) or any(Path(name).exists() for name in LOCAL):
        return False
    try:
        version = fast_dds()
    except (metadata.PackageNotFoundError, ValueError):  # profiles are not worth a complaint
        return False
    environment[VARIABLES[version]] = str(profiles(version))
    return True
