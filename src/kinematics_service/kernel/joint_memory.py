"""The state of each joint, and the joints that messages name."""

from typing import Any, NamedTuple

import numpy as np

from .layout import arrays, places
from .layout.arrays import Floats, Integers, Nanoseconds, Public


class JointColumns(NamedTuple):
    """
    The arrays of a memory: a number for each joint, unless said otherwise.

    Attributes
    ----------
    position, before, velocity : rad or m, rad/s or m/s
        Now, and the position before that; NaN if unknown.
    differenced, known, stamped, wraps
        1 or 0: whether the velocity is a difference, the joint is known, its message had a stamp,
        and it turns without end.
    stamp, arrival : ns
        Time of its last message: by the stamp, or the receipt if there was no stamp; steady clock.
    jump_count
        Number of its jumps.
    jumps : shape (n, JUMPS_KEPT), ns
        Times of the last jumps, steady clock: a ring buffer.
    last_quaternion : shape (4,)
        Of the last answer.
    closed : shape (width of the closure,)
        The closed loops of the last answer.
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
    An estimator's knowledge of each joint: all that it keeps from message to message.

    Parameters
    ----------
    joints
        Their number.
    closure
        Width of the arm's closure; 0 without loops.

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
        Whether the next quaternion may have any sign.
    is_closed
        Whether the loops closed at the last answer.
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
    Joints of an arm that messages with certain names have.

    Parameters
    ----------
    joints, places_of
        Their indices in the arm, and in the messages.

    Attributes
    ----------
    table
        Both arrays, as given.
    count
        How many.
    joint, place
        Their indices in the arm, and in the message.
    joints_needed, places_needed
        Least number of joints of the arm, and of a message.
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


def clear(memory: JointMemory) -> None:
    """Do the work of `forget`."""
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
    """Forget the states of all joints."""
    clear(memory)
