# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the content of one JointState message as plain data."""

from collections.abc import Sequence
from typing import NamedTuple

from ..kernel import Floats


class JointSample(NamedTuple):
    """
    One JointState message: joint names, positions, velocities, efforts, and times.

    Attributes
    ----------
    names
        Joint names, as in the message.
    positions, velocities : rad or m, rad/s or m/s
        As in the message: any length and any numbers.
    stamp : ns
        Time of the measurement, ROS clock; 0 if the message has no stamp.
    received : ns
        Time of receipt, ROS clock.
    arrival : ns
        Time of receipt, steady clock.
    efforts : N m or N
        As in the message: any length and any numbers.
    """

    names: Sequence[str]
    positions: Sequence[float] | Floats
    velocities: Sequence[float] | Floats
    stamp: int
    received: int
    arrival: int
    efforts: Sequence[float] | Floats = ()

    @property
    def time(self) -> int:
        """Return the stamp, ns, or the time of receipt if the message has no stamp."""
        return self.stamp or self.received
