"""What is known of each joint, and which of them messages name."""

from typing import NamedTuple

import numpy as np

from . import arrays, places
from .arrays import Floats, Integers


class JointColumns(NamedTuple):
    """
    The arrays of a memory: a number for each joint, unless said otherwise.

    Attributes
    ----------
    position, before, velocity : rad or m, rad/s or m/s
        Now, and the position before that; NaN where not known.
    differenced, known, stamped, wraps
        Whether the velocity is a difference, the joint has been heard, that with a stamp, and
        turns without end: 1 or 0.
    stamp, arrival : ns
        When it was last heard: by the stamp, or the receipt where there was none; steady clock.
    jump_count
        How often it has jumped.
    jumps : shape (n, JUMPS_KEPT), ns
        When, steady clock: the last ones, going round.
    last_quaternion : shape (4,)
        Source of the velocities of the last answer.
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


def _empty_columns(joints: int) -> JointColumns:
    numbers = np.zeros((3, joints))
    integers = np.zeros((7, joints), dtype=np.int64)
    return JointColumns(
        position=numbers[0],
        before=numbers[1],
        velocity=numbers[2],
        differenced=integers[0],
        known=integers[1],
        stamped=integers[2],
        wraps=integers[3],
        stamp=integers[4],
        arrival=integers[5],
        jump_count=integers[6],
        jumps=np.zeros((joints, places.JUMPS_KEPT), dtype=np.int64),
        last_quaternion=np.zeros(4),
    )


class JointMemory:
    """
    What an estimator knows of each joint: all that lasts from message to message.

    Parameters
    ----------
    joints
        Their number.

    Attributes
    ----------
    columns
        Its arrays. The kernel has the same ones, flat and under the same names; to the compiled
        kernel they are addresses that Python does not see.
    timeout : ns
        A joint without a position for longer is missing; stamps that step back by more start a new
        time.
    velocity_source
        AUTO, FROM_MESSAGE or FROM_DIFFERENCE.
    is_new_tool
        Whether the next quaternion has any sign.
    """

    def __init__(self, joints: int) -> None:
        columns = _empty_columns(joints)
        self.columns = columns
        self.joints = joints
        self.timeout = 0
        self.velocity_source = places.AUTO
        self.is_new_tool = True
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
        clear(self)


class OurJoints:
    """
    Joints of an arm that messages with certain names have.

    Parameters
    ----------
    joints, places_of
        Which they are, and where in the messages each stands.

    Attributes
    ----------
    table
        Both arrays, as they are given.
    count
        How many.
    joint, place
        Their number in the arm, and in the message.
    joints_needed, places_needed
        How many the arm, and a message, must have at least.
    """

    def __init__(self, joints: Integers, places_of: Integers) -> None:
        if min(joints.min(initial=0), places_of.min(initial=0)) < 0:
            raise ValueError('joints and their places are counted from 0')
        self.table = (joints, places_of)
        self.count = arrays.size(joints)
        self.joints_needed = int(joints.max(initial=-1)) + 1
        self.places_needed = int(places_of.max(initial=-1)) + 1
        self.joint = arrays.whole(joints, 0)
        self.place = arrays.whole(places_of, self.count)


def clear(memory: JointMemory) -> None:
    """Do what `forget` does."""
    for j in range(memory.joints):
        memory.position[j] = places.NAN
        memory.before[j] = places.NAN
        memory.velocity[j] = places.NAN
        memory.differenced[j] = 0
        memory.known[j] = 0
        memory.stamped[j] = 0
        memory.jump_count[j] = 0


def forget(memory: JointMemory) -> None:
    """Know nothing of any joint any more."""
    arrays.given(memory)
    clear(memory)
