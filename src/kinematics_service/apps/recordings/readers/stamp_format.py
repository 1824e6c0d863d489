"""The meaning of the stamps of a table: their unit, or a rate at which its rows were taken."""

import re
from typing import NamedTuple

import numpy as np

from ....errors import RecordingError
from .block import Times

# Decimal places of a second.
UNITS = {'s': 9, 'ms': 6, 'us': 3, 'ns': 0}
RATE = re.compile(r'(\d+\.?\d*|\.\d+)\s*[Hh][Zz]')
# Of rows that are numbered, Hz.
SLOWEST, FASTEST = 0.01, 1e6
# Of rows in which the arm stands still, Hz: so slow that the way between two of them is no speed.
STANDING = 0.1
# Stamps since 1970 of these years tell their unit: no other gives a time between them.
EARLIEST, LATEST = 10**9, 4 * 10**9


class StampFormat(NamedTuple):
    """
    The unit of stamps, or the rate of rows.

    Attributes
    ----------
    unit
        One of `UNITS`; empty: seconds, unless their size tells that they are ms, us or ns.
    rate : Hz
        Of rows that are numbered instead, 0 if stamps are read.
    """

    unit: str = ''
    rate: float = 0.0

    def of_rows(self, first: int, count: int) -> Times:
        """Return the stamps (count,), ns, of rows from one on; none is 0."""
        rows = np.arange(first + 1, first + count + 1)
        return np.asarray(np.rint(rows * (1e9 / self.rate)), dtype=np.int64)


def stamp_format(text: str) -> StampFormat:
    """
    Return the format of a word: s, ms, us, ns, a rate like `30Hz`, or `none`.

    Raises
    ------
    RecordingError
        It is another word.
    """
    word = text.strip()
    if word in UNITS:
        return StampFormat(word)
    if word == 'none':
        return StampFormat(rate=STANDING)
    match = RATE.fullmatch(word)
    if match is None or not SLOWEST <= float(match[1]) <= FASTEST:
        raise RecordingError(
            f'{word!r} is not one of {", ".join(UNITS)}, a rate of rows like 30Hz, or none, '
            'which means that the arm stands still in each row'
        )
    return StampFormat(rate=float(match[1]))


def unit_of(stamp: float) -> str:
    """Return the unit that the size of a stamp tells, s if it tells none."""
    for unit, digits in UNITS.items():
        if EARLIEST <= stamp * 10.0 ** (digits - 9) < LATEST:
            return unit
    return 's'
