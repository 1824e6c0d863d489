"""
JointState messages read straight from their bytes if they are plain CDR, else by ROS's
deserializer.
"""

from collections.abc import Iterator

from sensor_msgs.msg import JointState

from ...estimation.joint_sample import JointSample
from ...estimation.joint_state_form import JointStateForm, SerializedSample, doubles_of, form_of
from .message_check import read_message
from .messages import stamp_of

# Forms known at a time: a few drivers on one topic. Larger messages are read by ROS's
# deserializer.
MOST_FORMS = 8
LARGEST_KEPT = 1 << 16


class JointStateReader:
    """
    Reads JointState messages from their bytes, as the official deserializer would, only faster.

    Its memory does not grow with time.
    """

    def __init__(self) -> None:
        self._forms: list[JointStateForm] = []  # the most recent first

    def read(self, data: bytes) -> JointSample:
        """
        Return the content of a serialized JointState, without the times of its receipt.

        While a form is known, the names are the very same tuple for each of its messages; numbers
        are read-only arrays.

        Raises
        ------
        WireError
            The official deserializer refuses the bytes.
        """
        form = self._form(data)
        if form is None:
            return self.read_officially(data)
        stamp = SerializedSample(form, data, 0).time
        numbers = form.positions, form.velocities, form.efforts
        return _sample(form.names, stamp, *(data[part] for part in numbers))

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

    def read_officially(self, data: bytes) -> JointSample:
        """Return the same by ROS's deserializer, which takes longer."""
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
