# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check the messages of a page before viser reads them.

A page may send its camera, and new values of the panel's sliders, boxes, buttons and lists. All
other messages of viser's clients are refused, for example those that change another attribute of a
panel element, send a file or share the page.
"""

import math
from collections.abc import Mapping
from typing import Any

import msgspec
from viser import GuiButtonHandle, GuiCheckboxHandle, GuiDropdownHandle, GuiSliderHandle

Three = tuple[float, float, float]
Four = tuple[float, float, float, float]
# Upper bound of the width and the height of a picture, pixels.
MAX_SIZE = 1e6


class Strict(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Base class of the parts of a message; it accepts only the declared fields."""


class Camera(Strict, frozen=True, tag='ViewerCameraMessage', tag_field='type'):
    """
    The message `ViewerCameraMessage`, with which a page in the browser tells viser its camera.
    """

    wxyz: Four
    position: Three
    fov: float
    near: float
    far: float
    image_height: float
    image_width: float
    look_at: Three
    up_direction: Three


class PanelValue(Strict, frozen=True):
    """The value of an element of the panel: the only attribute that a page may change."""

    value: bool | float | str


class PanelChange(Strict, frozen=True, tag='GuiUpdateMessage', tag_field='type'):
    """
    The message `GuiUpdateMessage`, with which a page in the browser tells viser the new value of
    an element of the panel.
    """

    uuid: str
    updates: PanelValue


DECODER = msgspec.msgpack.Decoder(Camera | PanelChange)


class MessageError(ValueError):
    """Raised for a message that viser's own page never sends."""


def is_taken(data: bytes | str, panel: Mapping[str, Any]) -> bool:
    """
    Return whether viser may read a message; False if the message is for an element of the panel
    that no longer exists.

    Parameters
    ----------
    data
        The received message.
    panel
        The elements of the panel by identifier.

    Raises
    ------
    MessageError
        The message has a form or a value that the page of viser never sends.
    """
    if not isinstance(data, bytes):
        raise MessageError('messages are binary')
    try:
        message = DECODER.decode(data)
    except (msgspec.DecodeError, RecursionError, OverflowError) as error:
        raise MessageError(str(error)) from None
    if isinstance(message, Camera):
        numbers = (*message.wxyz, *message.position, *message.look_at, *message.up_direction)
        if not all(map(math.isfinite, (*numbers, message.fov))):
            raise MessageError('the camera is nowhere')
        if not (0 <= message.image_height < MAX_SIZE and 0 <= message.image_width < MAX_SIZE):
            raise MessageError('no picture has that size')
        return True
    thing = panel.get(message.uuid)
    if thing is None or thing.disabled or not thing.visible:
        return False
    if not _fits(thing, message.updates.value):
        raise MessageError('not a value of that thing')
    return True


def _fits(thing: object, value: float | bool | str) -> bool:
    match thing:
        case GuiSliderHandle():
            return isinstance(value, float) and math.isfinite(value)
        case GuiCheckboxHandle() | GuiButtonHandle():
            return isinstance(value, bool)
        case GuiDropdownHandle():
            return value in thing.options
    return False
