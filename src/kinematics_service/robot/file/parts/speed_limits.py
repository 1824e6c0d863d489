"""The speed limits of a robot file: how fast the tool and its points may move."""

import math
from collections.abc import Sequence
from typing import Any

from ..text.entries import checked, checked_mapping, choice
from ..text.fault_report import number, quoted
from ..text.yaml_document import Path
from .description import PointDescription, SpeedLimit
from .quantities import DEGREES, METRES, MILLIMETRES, Quantities
from .schema import SpeedLimitEntry

PATH: Path = ('speed_limits',)
# No tool of an arm is as fast, and none is meant to be as slow: m/s, rad/s.
FAST, SLOW, SPINNING = 20.0, 0.002, 25.0


def read_speed_limits(
    data: Any, points: Sequence[PointDescription], quantities: Quantities
) -> tuple[SpeedLimit, ...]:
    """
    Return the speed limits in the order of the file, without those that have faults.

    Parameters
    ----------
    data
        The mapping as the file has it; None where there is none.
    points
        Those of the file without faults.
    quantities
        What the names in expressions mean.
    """
    report = quantities.report
    given = checked_mapping(
        data, PATH, report, 'the tool or a point to {linear, angular, reduced}'
    )
    found = [_limit(name, value, points, quantities) for name, value in given.items()]
    return tuple(limit for limit in found if limit is not None)


def _limit(
    name: str, data: Any, points: Sequence[PointDescription], quantities: Quantities
) -> SpeedLimit | None:
    report, path = quantities.report, (*PATH, name)
    before = report.fault_count
    known = ('tool', *(point.name for point in points))
    if name not in known:
        report.fault(path, f'there is no point {quoted(name)}{choice(known)}')
    entry = checked(SpeedLimitEntry, data, path, report)
    given = (
        quantities.above_zero(entry.linear, 'length', (*path, 'linear')),
        quantities.above_zero(entry.angular, 'angle', (*path, 'angular')),
        quantities.above_zero(entry.reduced, 'length', (*path, 'reduced')),
    )
    if report.fault_count > before:
        return None
    if not any(given):
        report.fault(path, 'says no limit: give linear, angular or reduced, a second')
        return None
    limit = SpeedLimit(name, *(math.inf if one is None else one for one in given))
    if math.isfinite(limit.reduced) and limit.reduced > limit.linear:
        report.fault(
            (*path, 'reduced'),
            f'must be at most linear, {entry.linear}, not {entry.reduced}: it is the slower of '
            'the two',
        )
        return None
    _warn_of_units(limit, path, quantities)
    return limit


def _warn_of_units(limit: SpeedLimit, path: Path, quantities: Quantities) -> None:
    units, warn = quantities.units, quantities.report.warn
    for key, speed in (('linear', limit.linear), ('reduced', limit.reduced)):
        if units.length == 'm' and FAST < speed < math.inf:
            warn((*path, key), f'a speed of {number(speed)} m/s: {MILLIMETRES}')
        if units.length == 'mm' and speed < SLOW:
            warn((*path, key), f'a speed of {number(speed * 1e3)} mm/s: {METRES}')
    if units.angle == 'rad' and SPINNING < limit.angular < math.inf:
        warn((*path, 'angular'), f'a speed of {number(limit.angular)} rad/s: {DEGREES}')
