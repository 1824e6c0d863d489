# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compare a measure of singularity with two thresholds; the result is OK, WARN or ERROR."""

import enum
import math
from dataclasses import dataclass

from .. import kernel
from ..errors import KinematicsError
from .file.parts.measure_table import MEASURES as MEASURES
from .file.parts.measure_table import Measure as Measure
from .file.parts.measure_table import default_measure
from .task import Task


class Level(enum.IntEnum):
    """The level of a measured value (OK to STALE), as in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


# Hysteresis: WARN or ERROR ends only if the measure is better than the threshold by this factor.
# Without hysteresis, noise near the threshold would cause many warnings.
HYSTERESIS = 1.5


@dataclass(frozen=True)
class Thresholds:
    """
    The name of the measure that the node watches, and the values of the measure at which WARN
    (`warn`) and ERROR (`stop`) begin.
    """

    measure: str
    warn: float
    stop: float

    def bounds_after(self, previous: Level = Level.OK) -> tuple[float, float]:
        """
        Return the thresholds of WARN and ERROR for a pose if the pose before it had the level
        `previous`.

        If the previous level is WARN or ERROR, the threshold of WARN is farther from singular by
        the factor HYSTERESIS. After ERROR the threshold of ERROR is farther by this factor, too.
        Both values are less than the largest value of the measure (1 rad for `distance`), so that
        the largest value is always OK.
        """
        measure = MEASURES[self.measure]
        factor = HYSTERESIS if measure.small_is_bad else 1.0 / HYSTERESIS
        warn, stop, last = self.warn, self.stop, math.nextafter(measure.most, 0.0)
        if previous in (Level.WARN, Level.ERROR):
            warn *= factor
        if previous == Level.ERROR:
            stop *= factor
        return min(warn, last), min(stop, last)

    def level(self, value: float, previous: Level = Level.OK) -> Level:
        """
        Return the level of a value of the measure (|det| for the determinant).

        The thresholds depend on the level `previous`, as `bounds_after` describes. The level of
        NaN is ERROR.
        """
        small_is_bad = MEASURES[self.measure].small_is_bad
        warn, stop = self.bounds_after(previous)
        for level, bound in ((Level.ERROR, stop), (Level.WARN, warn)):
            good = value > bound if small_is_bad else value < bound
            if not good:
                return level
        return Level.OK


def thresholds_for(
    task: Task, measure: str = '', warn: float | None = None, stop: float | None = None
) -> Thresholds:
    """
    Return the thresholds of a measure for an arm's task. Omitted arguments get default values.

    Raises
    ------
    KinematicsError
        The measure is unknown, the determinant does not exist or is always zero, the arm has too
        many joints for the measure `distance`, or the thresholds are missing or in the wrong
        order.
    """
    joints = len(task.column_scales)
    measure = measure or default_measure(joints).name
    if measure not in MEASURES:
        message = f'singularity measure {measure!r} is unknown (choose from {", ".join(MEASURES)})'
        raise KinematicsError(message, code='unknown-name')
    row = MEASURES[measure]
    if measure == 'distance' and (unsearched := why_unsearched(joints)):
        raise KinematicsError(
            f'{unsearched}; choose condition_number, manipulability or smallest_singular_value',
            code='too-many',
        )
    if row.of_square and not task.square:
        raise KinematicsError(
            f'the {row.words} needs a square Jacobian: the task has {len(task.rows)} rows '
            f'({" ".join(task.rows)}) for {joints} joints; '
            'choose distance or manipulability',
            code='not-square',
        )
    if row.of_square and task.structurally_deficient:
        raise KinematicsError(
            f'the {row.words} of this arm is zero at every pose '
            f'(generic rank {task.generic_rank} of {len(task.rows)}); choose distance',
            code='zero-measure',
        )
    warn = row.warn if warn is None else warn
    stop = row.stop if stop is None else stop
    if warn is None or stop is None:
        message = f'measure {measure} has no default thresholds: give warn and stop'
        raise KinematicsError(message, code='missing-key')
    for name, value in (('warn', warn), ('stop', stop)):
        if refusal := row.refusal(value):
            raise KinematicsError(f'{name} of {measure} {refusal}', code='out-of-range')
    if not row.ordered(warn, stop):
        side = 'below' if row.small_is_bad else 'above'
        message = f'stop ({stop:g}) of {measure} must be {side} warn ({warn:g})'
        raise KinematicsError(message, code='wrong-order')
    return Thresholds(measure, float(warn), float(stop))


def why_unsearched(joints: int, farthest: float = 0.0) -> str:
    """
    Return the reason, as text, why the kernel cannot search for singular poses of an arm; '' if
    the kernel can.

    Parameters
    ----------
    joints
        The number of joints of the arm.
    farthest
        The largest absolute joint position, rad.
    """
    text, limit = 'the distance to a singular pose is found', kernel.MAX_SEARCHED_JOINTS
    if joints > limit:
        return f'{text} for up to {limit} joints, not {joints}'
    if not farthest < kernel.LARGEST_REDUCED:
        return f'{text} up to positions of {kernel.LARGEST_REDUCED:g} rad, not {farthest:.3g}'
    return ''
