"""What a topic says of a report as an object, and all that a message says, bit for bit."""

import struct
from array import array

import numpy as np

from kinematics_service.node.messages.message_layout import MessageLayout


def built(topic, report):
    """Return the message of a topic, as a node without bytes builds it; None for none."""
    if topic.build is not None:
        return topic.build(report)
    numbers = topic.numbers(report.settings)
    if numbers is None or topic.of_motion and not report.answer.state.moving:
        return None
    layout = MessageLayout(topic.template(report.settings))
    return layout.message(report.answer.stamp, numbers.of(report))


def bits(value):
    """Return everything a message says, floats as their bits: a NaN is not equal to itself."""
    if hasattr(value, 'get_fields_and_field_types'):
        return [bits(getattr(value, name)) for name in value.get_fields_and_field_types()]
    if isinstance(value, float):
        return struct.pack('=d', value)
    if isinstance(value, (list, tuple, array, np.ndarray)):
        return [bits(item) for item in value]
    return value
