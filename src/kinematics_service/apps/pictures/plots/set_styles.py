"""Colours and dashes of singular sets: the same factor looks the same in every picture."""

import zlib
from collections.abc import Sequence

from .picture import DASHES, GREEN, ORANGE, PURPLE, SKY, VERMILION, YELLOW, Dashes

# They stand out on the ground of maps and workspaces, which goes from dark blue to yellow.
COLORS = (VERMILION, SKY, PURPLE, GREEN, ORANGE, YELLOW, '#FFFFFF')
# The names that robot files use.
KNOWN = ('elbow', 'shoulder', 'wrist', 'det J', 'boom_length', 'boom_vertical', 'loop')


def set_styles(names: Sequence[str]) -> dict[str, tuple[str, Dashes]]:
    """
    Return colour and dashes by name.

    A name that is not known has a place by its letters; where two of one picture fall together,
    the later one takes the next free place.
    """
    places: dict[str, int] = {name: KNOWN.index(name) for name in names if name in KNOWN}
    for name in names:
        if name in places:
            continue
        place = zlib.crc32(name.encode())
        while len(places) < len(COLORS) and place % len(COLORS) in places.values():
            place += 1
        places[name] = place % len(COLORS)
    return {name: (COLORS[k], DASHES[k % len(DASHES)]) for name, k in places.items()}
