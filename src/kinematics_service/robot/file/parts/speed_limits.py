# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the speed limits of a robot file: the largest speeds of the tool and of points."""

import math
from collections.abc import Sequence

from ..text.entries import checked, checked_mapping, choice
from ..text.fault_report import Place, number, quoted
from ..text.yaml_document import Yaml
from .description import PointDescription, SpeedLimit
from .quantities import DEGREES, Kind, Quantities
from .schema import SpeedLimitEntry

KINDS: dict[str, Kind] = {'linear': 'length', 'angular': 'angle', 'reduced': 'length'}
# Warn of a speed limit in the file that is not between the smallest and the largest usual speed,
# because it is probably in another unit.
LARGEST_USUAL_SPEED = 20.0  # m/s
SMALLEST_USUAL_SPEED = 0.002  # m/s
LARGEST_USUAL_ROTATION = 25.0  # rad/s


def read_speed_limits(
    data: Yaml, points: Sequence[PointDescription], quantities: Quantities
) -> tuple[SpeedLimit, ...]:
    """
    Read the speed limits in the order of the file; report faults, and leave out faulty limits.

    Parameters
    ----------
    data
        The value of the key `speed_limits`; None if the file does not have the key.
    points
        The points without faults.
    quantities
        The meaning of the names in expressions.
    """
    at = quantities.top['speed_limits']
    given = checked_mapping(data, at, 'the tool or a point to {linear, angular, reduced}')
    known = ('tool', *(point.name for point in points))
    limits = [_limit(name, value, known, quantities) for name, value in given.items()]
    return tuple(limit for limit in limits if limit is not None)


def _limit(
    name: str, data: Yaml, known: tuple[str, ...], quantities: Quantities
) -> SpeedLimit | None:
    at = quantities.top['speed_limits', name]
    if name not in known:
        at.fault(f'there is no point {quoted(name)}{choice(known)}', 'unknown-name')
    entry = checked(SpeedLimitEntry, data, at)
    given = [
        quantities.above_zero(getattr(entry, key), kind, at[key]) or math.inf
        for key, kind in KINDS.items()
    ]
    if not at.intact:
        return None
    if min(given) == math.inf:
        message = 'has no limit; write linear (per second), angular or reduced'
        at.fault(message, 'missing-key')
        return None
    limit = SpeedLimit(name, *given)
    if math.isfinite(limit.reduced) and limit.reduced > limit.linear:
        message = f'must be at most linear, {entry.linear}, not {entry.reduced}'
        at['reduced'].fault(message, 'wrong-order')
        return None
    _warn_of_units(limit, at, quantities)
    return limit


def _warn_of_units(limit: SpeedLimit, at: Place, quantities: Quantities) -> None:
    smallest, largest, words = SMALLEST_USUAL_SPEED, LARGEST_USUAL_SPEED, 'a speed of {}/s'
    for key, speed in (('linear', limit.linear), ('reduced', limit.reduced)):
        quantities.warn_of_length(speed, smallest, largest, words, at[key])
    if quantities.units.angle == 'rad' and LARGEST_USUAL_ROTATION < limit.angular < math.inf:
        at['angular'].warn(f'a speed of {number(limit.angular)} rad/s: {DEGREES}', 'wrong-unit')
