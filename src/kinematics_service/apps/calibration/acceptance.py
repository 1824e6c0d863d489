"""Whether what was found is a calibration: what remains, and which rows were left out."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..checking.diagnosis import LEAST
from ..checking.errors import EXPLAINED, Errors, PoseLimit, angle_in_words, length_in_words
from ..checking.judgement import FrameLimits
from ..recordings.readers.block import Flags
from .result import Calibration

# Largest share of rows that are outliers: more of them contradict the arm.
OUTLIER_SHARE = 0.1
# Level of the tests of all joints at once: of Fisher's exact test of whether the rows left out
# share positions of a joint, and of the score test of whether errors depend on them.
TEST_LEVEL = 1e-3
# Rows may be off by two deviations of the instrument's noise, if it is known.
NOISE_RATIO = 2.0


class JudgedFit(NamedTuple):
    """A calibration, and whether all numbers of its table were fitted, gear ratios apart."""

    found: Calibration
    whole: bool

    @property
    def limit(self) -> PoseLimit:
        """Return what remains of no calibration: what `audit` warns of, unless more is meant."""
        limit = FrameLimits().warn if self.whole else EXPLAINED
        left = (NOISE_RATIO * math.sqrt(3) * one for one in self.found.instrument or (0.0, 0.0))
        return PoseLimit(*map(max, zip(limit, left)))

    @property
    def contradicting(self) -> Flags:
        """Return which of the rows left out are farther off (N,) than `limit`."""
        return np.asarray(
            ~self.found.used
            & np.any(np.linalg.norm(self.found.remainders, axis=2) > self.limit, axis=1)
        )

    @property
    def many_out(self) -> bool:
        """Return whether more rows were left out than outliers may be."""
        return len(self.found.outliers) > OUTLIER_SHARE * self.found.count


def refusals_of(fit: JudgedFit) -> tuple[str, ...]:
    """Return why what was found is no calibration, a sentence each; none if it is one."""
    contradicted = list(_contradicted(fit))
    every = bool(contradicted) or fit.many_out
    errors = fit.found.with_outliers if every else fit.found.without
    reasons = (*contradicted, *_remaining(fit, errors.after))
    return reasons or ((fit.found.worse,) if fit.found.worse else ())


def noise_remarks(fit: JudgedFit) -> Iterator[str]:
    """Yield that the noise of the instrument may explain the rows that were left out."""
    if fit.many_out and not np.any(fit.contradicting):
        position, angle = (one / math.sqrt(3) for one in fit.found.with_outliers.after.rms)
        turned = '' if fit.found.positions else f',{math.degrees(angle):.1g}deg'
        yield (
            f'{len(fit.found.outliers)} of {fit.found.count} {fit.found.rows} are left out, '
            f'though audit accepts each: --noise {1000 * position:.1g}mm{turned} takes them in'
        )


def _contradicted(fit: JudgedFit) -> Iterator[str]:
    left, count = int(np.sum(fit.contradicting)), fit.found.count
    if left > OUTLIER_SHARE * count:
        yield (
            f'{left} of {count} {fit.found.rows} contradict the arm: that is more than a tenth, '
            'too many for outliers'
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
    if not fit.found.positions and errors.rotation_rms >= limit.angle:
        yield (
            f'{angle_in_words(errors.rotation_rms)} remain (rms), where less than '
            f'{angle_in_words(limit.angle)} is required'
        )


def _by_joint(fit: JudgedFit) -> str:
    # The rows that are highest, lowest or farthest from the middle in a joint, up to each one that
    # was left out: how many of them were left out, and how likely as many are by chance.
    out = fit.contradicting
    left, count = int(np.sum(out)), len(out)
    if left < LEAST or left == count:
        return ''
    likeliest = (TEST_LEVEL, '')
    tests = 3 * fit.found.q.shape[1] * left
    for j, name in enumerate(fit.found.robot.joint_names):
        q, middle = fit.found.q[:, j], float(np.median(fit.found.q[:, j]))
        words = length_in_words if fit.found.robot.prismatic[j] else angle_in_words
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
    return (
        f'{fit.found.rows} contradict the arm {likeliest[1]} such {fit.found.rows} were left out'
    )


def _by_chance(count: int, left: int, drawn: int, found: int) -> float:
    # How likely as many or more of `left` among `count` are in a draw: hypergeometric.
    every = math.comb(count, drawn)
    most = min(left, drawn)
    ways = (
        math.comb(left, k) * math.comb(count - left, drawn - k) for k in range(found, most + 1)
    )
    return sum(ways) / every
