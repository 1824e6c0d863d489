# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Bytes that the official deserializer refuses are not given to it, and no others."""

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from hostile_bytes import HostileBytes
from rclpy.serialization import deserialize_message

from kinematics_service.errors import CdrError
from kinematics_service.estimation.cdr import CdrReader
from kinematics_service.node.messages.message_check import WALKS

MESSAGES = 1_000


def is_taken(data, kind):
    """Return whether the official deserializer makes a message of bytes."""
    try:
        deserialize_message(data, kind)
    except Exception:  # whatever it raises
        return False
    return True


def is_whole(data, kind):
    """Return whether the walk over a message comes to its end."""
    try:
        WALKS[kind](CdrReader(data))
    except CdrError:
        return False
    return True


@pytest.mark.parametrize('kind', WALKS, ids=lambda kind: kind.__name__)
def test_bytes_of_every_encoding_are_refused_where_they_officially_are(kind, capfd):
    # The official one writes what it refuses to standard error: captured.
    hostile, accepted = HostileBytes(1), 0
    for _ in range(MESSAGES):
        data = hostile(kind)
        official = is_taken(data, kind)
        accepted += official
        assert is_whole(data, kind) == official, data.hex()
    assert MESSAGES // 5 < accepted < MESSAGES * 4 // 5
