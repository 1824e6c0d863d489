# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Select this package's Fast DDS profiles: middleware settings that ROS's QoS does not have."""

import os
import re
from collections.abc import MutableMapping
from importlib.util import find_spec
from pathlib import Path

# Environment variable with the path of the profiles, by version of Fast DDS. Fast DDS also reads a
# file in the working directory, and version 3 reads the variable of version 2 with a warning.
VARIABLES = {2: 'FASTRTPS_DEFAULT_PROFILES_FILE', 3: 'FASTDDS_DEFAULT_PROFILES_FILE'}
LOCAL = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')
# If this variable is set, ROS takes the memory policy of Fast DDS's message histories from the
# profiles.
MEMORY_BY_PROFILE = 'RMW_FASTRTPS_USE_QOS_FROM_XML'
# Environment variable that the Fast DDS profiles read. With the value `OWN_PORTS`, each service of
# a node receives requests on a UDP port of its own, which Fast DDS picks from `PORTS`. A node
# needs nine such ports, and does not start if fewer are free. With the value `SHARED_PORT`,
# services share a port.
REQUESTS = 'KINEMATICS_SERVICE_REQUESTS'
OWN_PORTS, SHARED_PORT = 'fastdds.unique_network_flows', 'none'
PORTS = range(7000, 7400)
# `OWN_PORTS` is used only if the number of free ports in `PORTS` is above this.
MIN_FREE_PORTS = 100
# Major version of rclpy in Kilted, the first ROS distribution with Fast DDS 3.
RCLPY_VERSION_OF_FAST_DDS_3 = 9


def fast_dds() -> int:
    """
    Return the major version of Fast DDS that belongs to the installed rclpy.

    Raises
    ------
    LookupError
        The version of rclpy is unknown.
    """
    # Read the version from the name of the metadata folder, because importlib.metadata would take
    # 15 ms.
    rclpy = find_spec('rclpy')
    folder = Path(rclpy.origin).parents[1] if rclpy and rclpy.origin else Path()
    for name in os.listdir(folder):
        if version := re.match(r'rclpy-(\d+)\.', name):
            return 3 if int(version[1]) >= RCLPY_VERSION_OF_FAST_DDS_3 else 2
    raise LookupError(f'no version of rclpy in {folder}')


def profiles(version: int) -> Path:
    """Return the path of this package's profiles for a version of Fast DDS."""
    return Path(__file__).with_name(f'fastdds_{version}.xml')


def ports_are_free(table: Path = Path('/proc/net/udp')) -> bool:
    """
    Return whether more than MIN_FREE_PORTS of the UDP ports in `PORTS` are free; False if the free
    ports are unknown.
    """
    try:
        rows = table.read_text().splitlines()[1:]
    except OSError:
        return False
    taken = {int(row.split()[1].rsplit(':')[-1], 16) for row in rows}
    return len(taken.intersection(PORTS)) < len(PORTS) - MIN_FREE_PORTS


def take_profiles(environment: MutableMapping[str, str] = os.environ) -> bool:
    """
    Make Fast DDS read this package's profiles; return False if the user has profiles of his own.

    Call this function before the first participant is created. It has no effect on other
    middleware.
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
