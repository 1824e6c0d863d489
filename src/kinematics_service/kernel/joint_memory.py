# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define two classes: the memory of the last position and velocity of each joint, and the joint state
of one message.
"""

from typing import Any, NamedTuple

import numpy as np

from .layout import arrays, places
from .layout.arrays import Floats, Integers, Nanoseconds, Public


class JointColumns(NamedTuple):
    """
    The arrays of a `JointMemory`, of shape (n,) if no other shape is given.

    Attributes
    ----------
    position, before, velocity : rad or m, rad/s or m/s
        Present position, previous position, and velocity; NaN if unknown.
    differenced, known, stamped, wraps
        1 (true) or 0. differenced: the velocity was computed from a difference of positions.
        known: a message has reported the joint. stamped: the last message of the joint had a
        stamp. wraps: the joint turns without limits.
    stamp, arrival : ns
        Times of the last message. stamp: the stamp of the message, or the time of receipt if it
        had no stamp. arrival: the time of receipt on the steady clock.
    jump_count
        Number of jumps of each joint's reported position.
    jumps : shape (n, JUMPS_KEPT), ns
        Times of the last jumps on the steady clock, in a ring buffer.
    last_quaternion : shape (4,)
        The quaternion of the last tool state.
    closed : shape (Closure.width,)
        The values that describe the closed loops in the last tool state. `Closure` defines the
        order of the values.
    """

    position: Floats
    before: Floats
    velocity: Floats
    differenced: Integers
    known: Integers
    stamped: Integers
    wraps: Integers
    stamp: Integers
    arrival: Integers
    jump_count: Integers
    jumps: Integers
    last_quaternion: Floats
    closed: Floats


def _empty_columns(joints: int, closure: int) -> JointColumns:
    numbers = np.zeros((3, joints))
    integers = np.zeros((7, joints), dtype=np.int64)
    jumps = np.zeros((joints, places.JUMPS_KEPT), dtype=np.int64)
    return JointColumns._make([*numbers, *integers, jumps, np.zeros(4), np.zeros(closure)])


class JointMemory:
    """
    The last position, velocity and times of each joint, which an estimator keeps between messages.

    Parameters
    ----------
    joints
        Number of joints n.
    closure
        Number of values that describe the closed loops of the arm at one pose (`Closure.width`); 0
        if the arm has no loops.

    Attributes
    ----------
    columns
        The arrays of the memory. `JointMemory` also has one field for each array, with the same
        name. The kernel uses the array through this field, as a flat array. In the compiled kernel
        these fields are pointers, which Python code cannot read.
    timeout : ns
        A joint is missing if no message has reported it for longer than this. If a stamp steps
        back by more than this, all joints are forgotten.
    velocity_source
        AUTO, FROM_MESSAGE or FROM_DIFFERENCE.
    is_new_tool
        Whether no quaternion has been computed yet. If true, the next quaternion may have either
        sign.
    is_closed
        Whether the loops closed at the last joint positions.
    """

    def __init__(self, joints: int, closure: int = 0) -> None:
        columns = _empty_columns(joints, closure)
        self.columns: JointColumns = columns
        self.joints, self.closure = joints, closure
        self.is_closed: Public[bool] = False
        self.timeout: Public[Nanoseconds] = 0
        self.velocity_source: Public[int] = places.AUTO
        self.is_new_tool: Public[bool] = True
        self.position = arrays.results(columns.position, joints)
        self.before = arrays.results(columns.before, joints)
        self.velocity = arrays.results(columns.velocity, joints)
        self.differenced = arrays.whole_results(columns.differenced, joints)
        self.known = arrays.whole_results(columns.known, joints)
        self.stamped = arrays.whole_results(columns.stamped, joints)
        self.wraps = arrays.whole_results(columns.wraps, joints)
        self.stamp = arrays.whole_results(columns.stamp, joints)
        self.arrival = arrays.whole_results(columns.arrival, joints)
        self.jump_count = arrays.whole_results(columns.jump_count, joints)
        self.jumps = arrays.whole_results(columns.jumps, places.JUMPS_KEPT * joints)
        self.last_quaternion = arrays.results(columns.last_quaternion, 4)
        self.closed = arrays.results(columns.closed, closure)
        clear(self)


class OurJoints:
    """
    The indices of an arm's joints in messages that have a given list of joint names.

    Parameters
    ----------
    joints, places_of
        One number for each joint of the arm that the messages name. `joints` has the index of the
        joint in the arm. `places_of` has the index of the joint's name in the list of names.

    Attributes
    ----------
    table
        The arrays `joints` and `places_of`.
    count
        Number of joints of the arm that the messages name.
    joint, place
        The arrays `joints` and `places_of`, flat, for the kernel.
    joints_needed, places_needed
        Smallest number of joints of an arm for which all indices in `joints` are valid, and
        smallest number of positions in a message for which all indices in `places_of` are valid.
    """

    def __init__(self, joints: Integers, places_of: Integers) -> None:
        if min(joints.min(initial=0), places_of.min(initial=0)) < 0:
            raise ValueError('joints and their places are counted from 0')
        self.table: tuple[Any, ...] = (joints, places_of)
        self.count = arrays.size(joints)
        self.joints_needed: int = int(joints.max(initial=-1)) + 1
        self.places_needed: int = int(places_of.max(initial=-1)) + 1
        self.joint = arrays.whole(joints, 0)
        self.place = arrays.whole(places_of, self.count)


class ReportedJoints:
    """
    The joint positions and velocities of one message, with its times.

    Parameters
    ----------
    ours
        The joints of the arm that the message names.
    positions, velocities : rad or m, rad/s or m/s
        The numbers of the message. Velocities are used if there are as many velocities as
        positions.
    stamp : ns
        Time of the measurement, ROS clock; 0 if the message has no stamp.
    received, arrival : ns
        Time of receipt on the ROS clock, and on the steady clock.
    """

    def __init__(
        self,
        ours: OurJoints,
        positions: Floats,
        velocities: Floats,
        stamp: Nanoseconds,
        received: Nanoseconds,
        arrival: Nanoseconds,
    ) -> None:
        self.ours, self.stamp, self.received, self.arrival = ours, stamp, received, arrival
        self.has_velocities = arrays.size(velocities) == arrays.size(positions)
        self.positions = arrays.numbers(positions, ours.places_needed)
        self.velocities = arrays.numbers(velocities, 0)


def clear(memory: JointMemory) -> None:
    """
    Delete the stored positions of all joints. Only the kernel calls this function; Python code
    calls `forget`.
    """
    memory.is_closed = False
    for j in range(memory.joints):
        memory.position[j] = places.NAN
        memory.before[j] = places.NAN
        memory.velocity[j] = places.NAN
        memory.differenced[j] = 0
        memory.known[j] = 0
        memory.stamped[j] = 0
        memory.jump_count[j] = 0


def forget(memory: JointMemory) -> None:
    """Delete the stored positions, velocities and jumps of all joints."""
    clear(memory)
