"""Whether what was found is a calibration: what remains, and which rows were left out."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...formats.recordings.block import Flags
from ...kernel import Floats
from ...robot.robot import Robot
from ..frame_check.errors import (
    EXPLAINED,
    Errors,
    PoseLimit,
    angle_in_words,
    length_in_words,
)
from ..frame_check.judgement import FrameLimits
from .fitting import Noise

# A larger share of the rows are no outliers: they contradict the arm.
FEW_OUTLIERS = 0.1
# Rows left out are told by a joint where so by chance in one of as many calibrations; fewer rows
# never are.
BY_CHANCE, FEWEST = 1e-3, 3
# What remains of an instrument of known noise, times that.
BEYOND = 1.5


class JudgedFit(NamedTuple):
    """
    What a fit left.

    Attributes
    ----------
    q : shape (N, n), rad or m
    out : shape (N,)
        Rows that were left out.
    after : shape (N, 2, 3), m and rad
        What remains of position and rotation.
    row
        What a row is, in a word.
    without, with_outliers
        What remains of the rows that were used, and of all.
    positions
        Whether these are positions alone.
    whole
        Whether all numbers of the table were fitted.
    instrument
        Its noise, if it is known.
    """

    robot: Robot
    q: Floats
    out: Flags
    after: Floats
    row: str
    without: Errors
    with_outliers: Errors
    positions: bool
    whole: bool
    instrument: Noise | None

    @property
    def limit(self) -> PoseLimit:
        """Return what remains of no calibration: what `audit` warns of, unless more is meant."""
        limit = FrameLimits().warn if self.whole else EXPLAINED
        left = (BEYOND * math.sqrt(3.0) * one for one in self.instrument or (0.0, 0.0))
        return PoseLimit(*map(max, zip(limit, left)))

    @property
    def contradicting(self) -> Flags:
        """Return which of the rows left out are farther off (N,) than `limit`."""
        return np.asarray(
            self.out & np.any(np.linalg.norm(self.after, axis=2) > self.limit, axis=1)
        )

    @property
    def many_out(self) -> bool:
        """Return whether more rows were left out than outliers may be."""
        return int(np.sum(self.out)) > FEW_OUTLIERS * len(self.out)


def refusals_of(fit: JudgedFit) -> tuple[str, ...]:
    """Return why what was found is no calibration, a sentence each; none if it is one."""
    contradicted = list(_contradicted(fit))
    errors = fit.with_outliers if contradicted or fit.many_out else fit.without
    return (*contradicted, *_remaining(fit, errors))


def noise_remarks(fit: JudgedFit) -> Iterator[str]:
    """Yield that the noise of the instrument may explain the rows that were left out."""
    if fit.many_out and not np.any(fit.contradicting):
        position, angle = (one / math.sqrt(3.0) for one in fit.with_outliers.rms)
        turned = '' if fit.positions else f',{math.degrees(angle):.1g}deg'
        yield (
            f'{int(np.sum(fit.out))} of {len(fit.out)} {fit.row}s are left out, though audit '
            f'accepts each: --noise {1e3 * position:.1g}mm{turned} takes them in'
        )


def _contradicted(fit: JudgedFit) -> Iterator[str]:
    left, count = int(np.sum(fit.contradicting)), len(fit.out)
    if left > FEW_OUTLIERS * count:
        yield (
            f'{left} of {count} {fit.row}s contradict the arm: that is more than a tenth, too '
            'many for outliers'
        )
    if by_joint := _by_joint(fit):
        yield by_joint


def _remaining(fit: JudgedFit, errors: Errors) -> Iterator[str]:
    limit = fit.limit
    if errors.position_rms >= limit.position:
        yield (
            f'{length_in_words(errors.position_rms)} remain (rms), where less than '
            f'{length_in_words(limit.position)} is required'
        )
    if not fit.positions and errors.rotation_rms >= limit.angle:
        yield (
            f'{angle_in_words(errors.rotation_rms)} remain (rms), where less than '
            f'{angle_in_words(limit.angle)} is required'
        )


def _by_joint(fit: JudgedFit) -> str:
    # The rows that are highest, lowest or farthest from the middle in a joint, up to each one that
    # was left out: how many of them were left out, and how likely as many are by chance.
    out = fit.contradicting
    left, count = int(np.sum(out)), len(out)
    if left < FEWEST or left == count:
        return ''
    likeliest = (BY_CHANCE, '')
    tests = 3 * fit.q.shape[1] * left
    for j, name in enumerate(fit.robot.joint_names):
        q, middle = fit.q[:, j], float(np.median(fit.q[:, j]))
        words = length_in_words if fit.robot.prismatic[j] else angle_in_words
        for side, values in (('above', q), ('below', -q), ('away', np.abs(q - middle))):
            for value in np.unique(values[out]).tolist():
                beyond = values >= value
                chance = tests * _by_chance(
                    count, left, int(np.sum(beyond)), int(np.sum(beyond & out))
                )
                if chance < likeliest[0]:
                    where = f'{side} {words(-value if side == "below" else value)}'
                    if side == 'away':
                        where = f'{words(value)} or more from {words(middle)}'
                    own = f'{int(np.sum(beyond & out))} of {int(np.sum(beyond))}'
                    likeliest = chance, f'where joint {name} is {where}: {own}'
    if not likeliest[1]:
        return ''
    return f'{fit.row}s contradict the arm {likeliest[1]} such {fit.row}s were left out'


def _by_chance(count: int, left: int, drawn: int, found: int) -> float:
    # How likely as many or more of `left` among `count` are in a draw: hypergeometric.
    every = math.comb(count, drawn)
    most = min(left, drawn)
    ways = (
        math.comb(left, k) * math.comb(count - left, drawn - k) for k in range(found, most + 1)
    )
    return sum(ways) / every
