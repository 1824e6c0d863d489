# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a topic says of a report as an object, and all that a message says, bit for bit."""

import struct
from array import array

import numpy as np

from kinematics_service.node.messages.content import Built
from kinematics_service.node.messages.message_layout import MessageLayout


def built(topic, report):
    """Return the message of a topic, as a node without bytes builds it; None for none."""
    content = topic.content(report.settings)
    if isinstance(content, Built):
        return content.message(report)
    numbers = None if content is None else content.of(report)
    if numbers is None:
        return None
    layout = MessageLayout(topic.blank(report.settings))
    return layout.message(report.answer.stamp, np.ravel(numbers).astype(float))


def bits(value):
    """Return everything a message says, floats as their bits: a NaN is not equal to itself."""
    if hasattr(value, 'get_fields_and_field_types'):
        return [bits(getattr(value, name)) for name in value.get_fields_and_field_types()]
    if isinstance(value, float):
        return struct.pack('=d', value)
    if isinstance(value, (list, tuple, array, np.ndarray)):
        return [bits(item) for item in value]
    return value
