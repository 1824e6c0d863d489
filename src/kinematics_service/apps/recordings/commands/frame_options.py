# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the options of `audit` for tool poses that a second source measured."""

import math
import re
from typing import Annotated, Optional

from ....cli.options import WrongUsage, named
from ...checking.errors import PoseLimit
from ...checking.judgement import FrameLimits
from ..audit.frames import FrameSettings

LIMIT = re.compile(r'((?:[0-9]+[.]?[0-9]*|[.][0-9]+)(?:[eE][-+]?[0-9]+)?)\s*(mm|m|deg|rad)')
FACTORS = {'m': 1.0, 'mm': 1e-3, 'rad': 1.0, 'deg': math.radians(1.0)}
MAX_GAP = 3600.0  # Largest value of --pose-gap, s

GapOption = Annotated[
    Optional[float],
    named(
        '--pose-gap',
        'Longest time between the joint states around a pose that is compared; default: '
        'three usual intervals, within 0.05 and 0.5 s.',
        'SECONDS',
    ),
]


def given_frames(gap: float | None, warn: str, stop: str) -> FrameSettings:
    """
    Convert the values of --pose-gap, --pose-warn and --pose-stop to settings of the comparison of
    measured with computed poses.
    """
    if gap is not None and not 0.0 < gap <= MAX_GAP:
        raise WrongUsage(
            f'--pose-gap: {gap:g} s is not accepted; give above 0, at most {MAX_GAP:g} s'
        )
    limits = FrameLimits(given_limit('--pose-warn', warn), given_limit('--pose-stop', stop))
    if limits.bad.position < limits.warn.position or limits.bad.angle < limits.warn.angle:
        raise WrongUsage(f'--pose-stop: {stop} is less than --pose-warn {warn}; give more')
    return FrameSettings(gap, limits)


def given_limit(option: str, text: str) -> PoseLimit:
    """
    Return the limit of a pose difference from a text such as `4mm,0.5deg`: a length, an angle, or
    both. A missing length or angle becomes infinite.
    """
    limits = {'m': math.inf, 'rad': math.inf}
    for part in text.split(','):
        match = LIMIT.fullmatch(part.strip())
        if match is None or not 0.0 < float(match[1]) < math.inf:
            raise WrongUsage(
                f'{option}: {part.strip()!r} is no length or angle with its unit, above 0; write '
                'for instance 4mm,0.5deg'
            )
        limits['m' if match[2] in ('m', 'mm') else 'rad'] = float(match[1]) * FACTORS[match[2]]
    return PoseLimit(limits['m'], limits['rad'])
