"""Profiles of Fast DDS: settings of the middleware besides ROS's quality of service."""

import os
import re
from collections.abc import MutableMapping
from importlib.util import find_spec
from pathlib import Path

# Fast DDS reads profiles from the file in this variable, and from a file in the working directory.
# Version 3 also reads the old variable, with a warning.
VARIABLES = {2: 'FASTRTPS_DEFAULT_PROFILES_FILE', 3: 'FASTDDS_DEFAULT_PROFILES_FILE'}
LOCAL = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')
# With this variable, ROS takes the memory policy of histories from the profiles.
MEMORY_BY_PROFILE = 'RMW_FASTRTPS_USE_QOS_FROM_XML'
# The profiles set the network flow of service requests to the value of this variable. Fast DDS has
# the ports `PORTS` on a host for it, a node takes nine, and it does not start if too few are free.
REQUESTS = 'KINEMATICS_SERVICE_REQUESTS'
OWN_PORTS, SHARED_PORT = 'fastdds.unique_network_flows', 'none'
PORTS = range(7000, 7400)
# Smallest number of free ports for ports of its own.
MIN_FREE_PORTS = 100
# Major version of rclpy in Kilted, the first distribution with Fast DDS 3.
RCLPY_VERSION_OF_FAST_DDS_3 = 9


def fast_dds() -> int:
    """
    Return the major version of Fast DDS for the installed rclpy.

    Raises
    ------
    LookupError
        The version of rclpy is unknown.
    """
    # The name of its metadata folder has the version: importlib.metadata would take 15 ms.
    rclpy = find_spec('rclpy')
    folder = Path(rclpy.origin).parents[1] if rclpy and rclpy.origin else Path()
    for name in os.listdir(folder):
        if version := re.match(r'rclpy-(\d+)\.', name):
            return 3 if int(version[1]) >= RCLPY_VERSION_OF_FAST_DDS_3 else 2
    raise LookupError(f'no version of rclpy in {folder}')


def profiles(version: int) -> Path:
    """Return the file of this package's profiles for a version of Fast DDS."""
    return Path(__file__).with_name(f'fastdds_{version}.xml')


def ports_are_free(table: Path = Path('/proc/net/udp')) -> bool:
    """Return whether enough ports for requests are free; False if this is unknown."""
    try:
        rows = table.read_text().splitlines()[1:]
    except OSError:
        return False
    taken = {int(row.split()[1].rsplit(':')[-1], 16) for row in rows}
    return len(taken.intersection(PORTS)) < len(PORTS) - MIN_FREE_PORTS


def take_profiles(environment: MutableMapping[str, str] = os.environ) -> bool:
    """
    Let Fast DDS read this package's profiles; return False if the user has other profiles.

    Call it before the first participant is created. It has no effect on another middleware.
    """
    if any(map(environment.get, VARIABLES.values())) or any(Path(name).exists() for name in LOCAL):
        return False
    try:
        version = fast_dds()
    except LookupError:  # the node also works without profiles
        return False
    environment[VARIABLES[version]] = str(profiles(version))
    environment.setdefault(REQUESTS, OWN_PORTS if ports_are_free() else SHARED_PORT)
    if version == 2:
        environment.setdefault(MEMORY_BY_PROFILE, '1')
    return True
