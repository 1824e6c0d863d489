"""Choose colours and dashes of singular sets: the same for a factor in every picture."""

import zlib
from collections.abc import Sequence

from .picture import DASHES, GREEN, ORANGE, PURPLE, SKY, VERMILION, YELLOW, Dashes

# Colours that are visible on maps and workspaces, which go from dark blue to yellow.
COLORS = (VERMILION, SKY, PURPLE, GREEN, ORANGE, YELLOW, '#FFFFFF')
# Names of factors in robot files; each has the place of its index.
FACTOR_NAMES = ('elbow', 'shoulder', 'wrist', 'det J', 'boom_length', 'boom_vertical', 'loop')


def set_styles(names: Sequence[str]) -> dict[str, tuple[str, Dashes]]:
    """
    Return colour and dashes by name.

    The place of another name is a checksum of its letters. If two names of a picture get the same
    place, the later name takes the next free place.
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
