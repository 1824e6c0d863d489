# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read JointState messages from plain CDR bytes; leave other bytes to ROS's deserializer."""

from sensor_msgs.msg import JointState

from ...estimation.joint_sample import JointSample
from ...estimation.joint_state_form import JointStateForm, SerializedSample, doubles_of, form_of
from .message_check import read_message
from .messages import stamp_of

# Largest number of forms of messages (size, joint names, offsets of numbers) that the reader
# remembers. The number is above 1, because several drivers may publish on one topic.
MAX_FORMS = 8
# Largest size (bytes) of a message whose form is remembered. ROS's deserializer reads larger
# messages.
MAX_FORM_SIZE = 1 << 16


class JointStateReader:
    """
    Reads JointState messages from their bytes: faster than ROS's deserializer, with equal results.

    The reader remembers the forms of recent messages: size, joint names, and offsets of numbers.
    """

    def __init__(self) -> None:
        self._forms: list[JointStateForm] = []  # the most recently used form first

    def read(self, data: bytes) -> JointSample:
        """
        Return the content of a serialized JointState, but without the time of receipt.

        The reader remembers the forms of recent messages: size, joint names, and offsets of
        numbers. All messages of one form share one tuple of joint names. Numbers are read-only
        arrays.

        Raises
        ------
        WireError
            ROS's deserializer refuses the bytes.
        """
        form = self._form(data)
        if form is None:
            return self.read_officially(data)
        stamp = SerializedSample(form, data, 0).time
        numbers = form.positions, form.velocities, form.efforts
        return _sample(form.names, stamp, *(data[part] for part in numbers))

    def forms(self, size: int) -> list[JointStateForm]:
        """Return the remembered forms of messages of `size` bytes, the most recent first."""
        return [form for form in self._forms if form.size == size]

    def _form(self, data: bytes) -> JointStateForm | None:
        for age, form in enumerate(self._forms):
            if form.fits(data):
                if age:
                    self._forms.insert(0, self._forms.pop(age))
                return form
        new = form_of(data) if len(data) <= MAX_FORM_SIZE else None
        if new is not None:
            self._forms = [new, *self._forms][:MAX_FORMS]
        return new

    def read_officially(self, data: bytes) -> JointSample:
        """
        Return the content of a serialized JointState by ROS's deserializer, which takes longer
        than `read`.
        """
        message = read_message(data, JointState)
        numbers = message.position, message.velocity, message.effort
        return _sample(
            tuple(message.name), stamp_of(message), *(part.tobytes() for part in numbers)
        )


def _sample(
    names: tuple[str, ...], stamp: int, positions: bytes, velocities: bytes, efforts: bytes
) -> JointSample:
    q, qdot, torques = map(doubles_of, (positions, velocities, efforts))
    return JointSample(names, q, qdot, stamp, 0, 0, torques)
