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
# What the profiles ask for the requests of services. Fast DDS has these ports for that on a host,
# the node takes nine of them, and does not start where it asks and there are too few.
REQUESTS = 'KINEMATICS_SERVICE_REQUESTS'
OWN_PORTS, SHARED_PORT = 'fastdds.unique_network_flows', 'none'
PORTS, LEFT_FREE = range(7000, 7400), 100
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


def ports_are_free(table: Path = Path('/proc/net/udp')) -> bool:
    """Return whether many ports are free for requests; False where the system does not say."""
    try:
        rows = table.read_text().splitlines()[1:]
    except OSError:
        return False
    taken = {int(row.split()[1].rsplit(':')[-1], 16) for row in rows}
    return len(taken.intersection(PORTS)) < len(PORTS) - LEFT_FREE


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
    environment.setdefault(REQUESTS, OWN_PORTS if ports_are_free() else SHARED_PORT)
    if version == 2:
        environment.setdefault(MEMORY_BY_PROFILE, '1')
    return True
