# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Detect missing, repeated and outlying frames. A frame is one row of joint positions; a step is the
joint motion from a frame to the next.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .....kernel import Floats
from .....robot.measures import Level
from .....typography import counted
from ..findings import Finding

# If frames are missing, the step over the gap is nearly an integer multiple of the steps before
# and after the gap. The multiple is the size of the step divided by the mean size of these two
# neighbours. It may differ from an integer by at most this tolerance.
MULTIPLE_TOLERANCE = 0.25
# Largest ratio of a step over missing frames to the mean size of the steps before and after it.
MAX_MULTIPLE = 6.0
# Least cosine of the angle, in joint space, between a step over missing frames and the mean of the
# steps before and after it. A person who moves the arm also makes sudden large steps. If a large
# step changes the direction of motion, no frames are reported as missing.
MIN_COSINE = 0.97
# Largest difference between the step before missing frames and the step after them, divided by the
# mean size of these two steps. In a motion whose steps vary more, a large step does not prove that
# frames are missing.
STEP_TOLERANCE = 0.4
# A step is examined only if the steps before and after it are at least this many times the noise
# of the joint positions.
MOTION_TO_NOISE = 6.0
# Least ratio of an outlier's size to the noise of the joint positions. An outlier is a row q[k] of
# joint positions; its size is |q[k] - (q[k - 1] + q[k + 1]) / 2|.
OUTLIER_TO_NOISE = 25.0
# Least size (rad or m) of an outlier, see OUTLIER_TO_NOISE.
MIN_OUTLIER = 0.02
# Least ratio of an outlier's size (see OUTLIER_TO_NOISE) to the joint motion from the row before
# the outlier to the row after the outlier.
OUTLIER_TO_STEP = 3.0
# Least number of steps of an examined motion. With fewer, the noise of the joint positions cannot
# be estimated.
MIN_STEPS = 12


class Breaks(NamedTuple):
    """
    Row numbers at which a motion is broken: rows before missing frames, rows that repeat the row
    before, and outliers.
    """

    missing: list[int]
    repeated: list[int]
    off: list[int]


def breaks_of(q: Floats) -> Breaks:
    """
    Find missing, repeated and outlying frames in a motion, and return row numbers.

    Missing frames have no row in `q`: the row before the missing frames is returned.

    Parameters
    ----------
    q : shape (N, n), rad or m
        Joint positions at equal intervals of time. Continuous joints must be unwrapped: no jumps
        by full turns.
    """
    steps = np.diff(q, axis=0)
    if len(steps) < MIN_STEPS:
        return Breaks([], [], [])
    before, step, after = steps[:-2], steps[1:-1], steps[2:]
    first, size, last = (np.linalg.norm(part, axis=1) for part in (before, step, after))
    around = 0.5 * (first + last)
    # Estimate the noise of the joint positions by the median difference between a step and the
    # mean of the steps before and after it. In smooth motion, only noise causes this difference.
    noise = float(np.median(np.linalg.norm(step - 0.5 * (before + after), axis=1)))
    with np.errstate(invalid='ignore', divide='ignore'):
        cosine = np.sum(step * (before + after), axis=1) / (2.0 * size * around)
        straight = np.sum(before * after, axis=1) / (first * last)
        times = np.where(around > 0.0, size / around, 0.0)
    clear = np.minimum(first, last) > MOTION_TO_NOISE * noise
    changes = np.linalg.norm(np.diff(steps, axis=0), axis=1)
    near = STEP_TOLERANCE * around + 2.0 * noise
    alike = np.linalg.norm(after - before, axis=1) < near
    # Frames are missing in step k only if steps k - 2 and k - 1 are nearly equal, and steps k + 1
    # and k + 2 are nearly equal. Exclude the first examined step, because step k - 2 is unknown,
    # and the last one, because step k + 2 is unknown.
    alike[:1] = alike[-1:] = False
    alike[1:-1] &= np.maximum(changes[:-3], changes[3:]) < near[1:-1]
    whole = (
        (times > 1.5)
        & (times < MAX_MULTIPLE)
        & (np.abs(times - np.rint(times)) < MULTIPLE_TOLERANCE)
    )
    missing = clear & alike & whole & (cosine > MIN_COSINE)
    repeated = clear & (size == 0.0) & (straight > MIN_COSINE)
    middle = np.linalg.norm(q[1:-1] - 0.5 * (q[:-2] + q[2:]), axis=1)
    chord = np.linalg.norm(q[2:] - q[:-2], axis=1)
    off = (middle > np.maximum(OUTLIER_TO_NOISE * noise, MIN_OUTLIER)) & (
        middle > OUTLIER_TO_STEP * chord
    )
    return Breaks(
        (np.flatnonzero(missing) + 1).tolist(),
        (np.flatnonzero(repeated) + 2).tolist(),
        (np.flatnonzero(off) + 1).tolist(),
    )


def break_findings(q: Floats, t: Floats) -> Iterator[Finding]:
    """Yield findings on missing, repeated and outlying frames; q (N, n), rad or m; t (N,), s."""
    breaks = breaks_of(q)
    for rows, singular, plural in (
        (breaks.missing, 'is missing', 'are missing'),
        (breaks.repeated, 'repeats the one before while the arm moves', 'repeat the one before'),
        (
            breaks.off,
            'is far from those before and after it',
            'are far from those before and after',
        ),
    ):
        if rows:
            words = singular if len(rows) == 1 else plural
            yield Finding(
                Level.WARN,
                f'{counted(len(rows), "frame")} {words}, by the steps of the joints; the first '
                f'at row {rows[0]}, {t[rows[0]]:.3f} s.',
            )
