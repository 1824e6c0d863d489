"""Options of `audit` that concern a second source of the tool's pose."""

import math
import re
from typing import Annotated, Optional

from ....cli.options import WrongUsage, named
from ...checking.errors import PoseLimit
from ...checking.judgement import FrameLimits
from ..audit.frames import FrameSettings

LIMIT = re.compile(r'([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(mm|m|deg|rad)')
FACTORS = {'m': 1.0, 'mm': 1e-3, 'rad': 1.0, 'deg': math.radians(1.0)}
LONGEST_GAP = 3600.0

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
    """Return how poses are matched and judged."""
    if gap is not None and not 0.0 < gap <= LONGEST_GAP:
        raise WrongUsage(f'--pose-gap: {gap:g} is not within 0 and {LONGEST_GAP:g} s')
    limits = FrameLimits(given_limit('--pose-warn', warn), given_limit('--pose-stop', stop))
    if limits.bad.position < limits.warn.position or limits.bad.angle < limits.warn.angle:
        raise WrongUsage(f'--pose-stop: {stop} is less than --pose-warn {warn}')
    return FrameSettings(gap, limits)


def given_limit(option: str, text: str) -> PoseLimit:
    """Return a length, an angle, or both; one that is not given is infinite."""
    found = {'m': math.inf, 'rad': math.inf}
    for part in text.split(','):
        match = LIMIT.fullmatch(part.strip())
        number = _number(match[1]) if match else None
        if match is None or number is None:
            raise WrongUsage(
                f'{option}: {part.strip()!r} is no length or angle with its unit, above 0; write '
                f'for instance 4mm,0.5deg'
            )
        found['m' if match[2] in ('m', 'mm') else 'rad'] = number * FACTORS[match[2]]
    return PoseLimit(found['m'], found['rad'])


def _number(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) and number > 0.0 else None
