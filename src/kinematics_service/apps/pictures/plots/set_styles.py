# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Choose the colour and the dashes of each singular set, so that it looks the same in every picture.
"""

import zlib
from collections.abc import Sequence

from .picture import DASHES, GREEN, ORANGE, PURPLE, SKY, VERMILION, YELLOW, Dashes

# Colours of singular sets. They are visible on maps and workspaces, whose colours go from dark
# blue to yellow.
COLORS = (VERMILION, SKY, PURPLE, GREEN, ORANGE, YELLOW, '#FFFFFF')
# Names of singular factors in robot files; the index of a name is the index of its style.
FACTOR_NAMES = ('elbow', 'shoulder', 'wrist', 'det J', 'boom_length', 'boom_vertical', 'loop')


def set_styles(names: Sequence[str]) -> dict[str, tuple[str, Dashes]]:
    """
    Return the colour and the dashes of each singular set, by the name of the singular factor that
    is zero on it.

    Names in FACTOR_NAMES have fixed styles. Other names get a style by a checksum of their
    letters. If two names of a picture get the same style, the later name takes the next free
    style.
    """
    places: dict[str, int] = {
        name: FACTOR_NAMES.index(name) for name in names if name in FACTOR_NAMES
    }
    for name in names:
        if name in places:
            continue
        place = zlib.crc32(name.encode())
        while len(places) < len(COLORS) and place % len(COLORS) in places.values():
            place += 1
        places[name] = place % len(COLORS)
    return {name: (COLORS[k], DASHES[k % len(DASHES)]) for name, k in places.items()}
