# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Convert the stamps of a table to ns; or compute them from row numbers and a rate, if the table has
none.
"""

import re
from typing import NamedTuple

import numpy as np

from ....errors import RecordingError
from .block import Times

# Exponent n of each unit of time: the unit is 10^n nanoseconds.
UNITS = {'s': 9, 'ms': 6, 'us': 3, 'ns': 0}
RATE = re.compile(r'(\d+\.?\d*|\.\d+)\s*[Hh][Zz]')
# Smallest and largest accepted rate of the rows of a table without stamps. The stamp of a row is
# computed from its number and the rate.
MIN_RATE = 0.01  # Hz
MAX_RATE = 1e6  # Hz
# Rate of rows, Hz, for `--stamps none`: the rows are poses in which the arm stood still, without
# times. At this low rate, no velocities are computed from the differences between rows.
STANDSTILL_RATE = 0.1
# A stamp is a plausible time if it is in this range, s since 1970: the years 2001 to 2096. The
# range is so small that a stamp is plausible in at most one unit.
MIN_EPOCH_TIME = 10**9
MAX_EPOCH_TIME = 4 * 10**9


class StampFormat(NamedTuple):
    """
    The unit of a table's stamps; or, if it has no stamps, the rate of its rows.

    Attributes
    ----------
    unit
        One of `UNITS`. Empty: the unit in which the stamps are plausible times since 1970, or
        seconds if there is no such unit.
    rate : Hz
        Rate of the rows, from which their stamps are computed; 0 if the table has stamps.
    """

    unit: str = ''
    rate: float = 0.0

    def of_rows(self, first: int, count: int) -> Times:
        """
        Return the stamps (count,), ns, of the `count` rows from number `first`. The stamp of row 0
        is one period, because a stamp of 0 would mean unstamped.
        """
        rows = np.arange(first + 1, first + count + 1)
        return np.asarray(np.rint(rows * (1e9 / self.rate)), dtype=np.int64)


def stamp_format(text: str) -> StampFormat:
    """
    Parse a stamp format: s, ms, us, ns, a rate like `30Hz`, or `none`.

    Raises
    ------
    RecordingError
        The text is not one of these formats.
    """
    word = text.strip()
    if word in UNITS:
        return StampFormat(word)
    if word == 'none':
        return StampFormat(rate=STANDSTILL_RATE)
    match = RATE.fullmatch(word)
    if match is None or not MIN_RATE <= float(match[1]) <= MAX_RATE:
        raise RecordingError(
            f'{word!r} is not accepted; give one of {", ".join(UNITS)}, a rate of rows like 30Hz, '
            'or none if the arm stands still in each row',
            code='unknown-unit',
        )
    return StampFormat(rate=float(match[1]))


def unit_of(stamp: float) -> str:
    """Return the unit in which a stamp is a plausible time since 1970, or s if no unit fits."""
    for unit, digits in UNITS.items():
        if MIN_EPOCH_TIME <= stamp * 10.0 ** (digits - 9) < MAX_EPOCH_TIME:
            return unit
    return 's'
