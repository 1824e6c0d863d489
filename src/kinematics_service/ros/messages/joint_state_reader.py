"""
JointState messages read straight from their bytes if they are plain CDR, else by ROS's
deserializer.
"""

from collections.abc import Iterator
from typing import NamedTuple

from sensor_msgs.msg import JointState

from ...estimation.cdr import STAMP, STAMP_AT
from ...estimation.joint_state_form import JointStateForm, doubles_of, form_of
from ...kernel import Floats
from .message_check import read_message
from .messages import SECOND, stamp_of

# Forms known at a time: a few drivers on one topic. Larger messages are read by ROS's
# deserializer.
MOST_FORMS = 8
LARGEST_KEPT = 1 << 16


class WireJointState(NamedTuple):
    """
    The content of a JointState, without its header's text.

    Attributes
    ----------
    names
        Joint names; while a form is known, the very same tuple for each of its messages.
    positions, velocities : rad or m, rad/s or m/s
        As in the message: of any length, with any number in them; read-only.
    stamp : ns
        0 if the message has none.
    efforts : N m or N
        As in the message, too.
    """

    names: tuple[str, ...]
    positions: Floats
    velocities: Floats
    stamp: int
    efforts: Floats


class JointStateReader:
    """
    Reads JointState messages from their bytes, as the official deserializer would, only faster.

    Its memory does not grow with time.
    """

    def __init__(self) -> None:
        self._forms: list[JointStateForm] = []  # the most recent first

    def read(self, data: bytes) -> WireJointState:
        """
        Return the content of a serialized JointState.

        Raises
        ------
        WireError
            The official deserializer refuses the bytes.
        """
        form = self._form(data)
        if form is None:
            return self._read_officially(data)
        seconds, nanoseconds = STAMP.unpack_from(data, STAMP_AT)
        return WireJointState(
            form.names,
            doubles_of(data[form.positions]),
            doubles_of(data[form.velocities]),
            seconds * SECOND + nanoseconds,
            doubles_of(data[form.efforts]),
        )

    def forms(self, size: int) -> Iterator[JointStateForm]:
        """Yield the known forms of messages of `size` bytes, the most recent first."""
        for form in self._forms:
            if form.size == size:
                yield form

    def _form(self, data: bytes) -> JointStateForm | None:
        for age, form in enumerate(self._forms):
            if form.fits(data):
                if age:
                    self._forms.insert(0, self._forms.pop(age))
                return form
        new = form_of(data) if len(data) <= LARGEST_KEPT else None
        if new is not None:
            self._forms = [new, *self._forms][:MOST_FORMS]
        return new

    def _read_officially(self, data: bytes) -> WireJointState:
        message = read_message(data, JointState)
        return WireJointState(
            tuple(message.name),
            doubles_of(message.position.tobytes()),
            doubles_of(message.velocity.tobytes()),
            stamp_of(message),
            doubles_of(message.effort.tobytes()),
        )
