"""The measures of singularity, a row each, and the rules of their thresholds."""

import math
from dataclasses import dataclass

from .... import kernel


@dataclass(frozen=True)
class Measure:
    """
    One measure; `Singularity` has a field of its name, and the kernel computes its column.

    Attributes
    ----------
    name, meaning
        In robot files, topics and parameters; and what it is, for the reference.
    column
        Where it stands in the kernel's row of measures.
    small_is_bad
        On which side it is bad.
    unit
        Of its value and thresholds in sentences.
    warn, stop
        Default thresholds; None where there are none that suit every arm.
    least, most
        Its thresholds are above the one, and at most the other: a value there means at least that.
    of_square
        Whether it exists only where J_t is square; it may then be negative, and is judged by its
        absolute value.
    of_volume
        Whether it is a product of singular values of the unscaled J_t, so that its unit depends on
        the arm.
    drawn_unit
        Its unit in pictures and tables, where that is not `unit`.
    short, long, drawn
        Other words for it: in narrow tables, as a title, beside an axis (in TeX).
    on_page
        Whether the page of an audit shows it although it is not the one that is watched.
    """

    name: str
    meaning: str
    column: int
    small_is_bad: bool = True
    unit: str = ''
    warn: float | None = None
    stop: float | None = None
    least: float = 0.0
    most: float = math.inf
    of_square: bool = False
    of_volume: bool = False
    drawn_unit: str = ''
    short: str = ''
    long: str = ''
    drawn: str = ''
    on_page: bool = True

    @property
    def words(self) -> str:
        """Return its name as people write it."""
        return self.name.replace('_', ' ')

    def refusal(self, threshold: float) -> str:
        """Return why a number is no threshold of it, `must be ...`; empty for one that is."""
        if math.isfinite(threshold) and self.least < threshold <= self.most:
            return ''
        most = f' and at most {self._amount(self.most)}' if self.most < math.inf else ''
        return f'must be above {self.least:g}{most}, not {self._amount(threshold)}'

    def farther(self, value: float) -> str:
        """Return `none found within 1 rad (57 deg)` of the largest value; empty of others."""
        if not value >= self.most < math.inf:
            return ''
        return f'none found within {self._amount(self.most)}'

    def _amount(self, value: float) -> str:
        if self.unit != 'rad' or not math.isfinite(value):
            return f'{value:g}'
        return f'{value:g} rad ({math.degrees(value):.0f} deg)'

    def ordered(self, warn: float, stop: float) -> bool:
        """Return whether a value that becomes worse is at `warn` before it is at `stop`."""
        return stop < warn if self.small_is_bad else warn < stop


MEASURES = {
    measure.name: measure
    for measure in (
        Measure(
            'distance',
            'joint motion to the nearest singular pose that was found, rad; 1: none found within '
            '1 rad',
            kernel.DISTANCE,
            unit='rad',
            warn=0.1,  # about 6 and 2 degrees
            stop=0.03,
            most=kernel.FARTHEST,
            long='distance to a singular pose',
            drawn='distance to\nsingularity',
            on_page=False,
        ),
        Measure(
            'determinant',
            'det(J_t), signed; it exists where J_t is square',
            kernel.DETERMINANT,
            of_square=True,
            of_volume=True,
            short='det(J)',
            drawn='det($J_t$)',
            on_page=False,
        ),
        Measure(
            'manipulability',
            "Yoshikawa's: the product of the singular values of J_t",
            kernel.MANIPULABILITY,
            of_volume=True,
            on_page=False,
        ),
        Measure(
            'smallest_singular_value',
            'of the scaled J_t: tool speed per joint speed in the worst direction',
            kernel.SMALLEST_SINGULAR_VALUE,
            drawn_unit='m',
            short='smallest sigma',
        ),
        Measure(
            'condition_number',
            'of the scaled J_t: the largest singular value over the smallest',
            kernel.CONDITION_NUMBER,
            small_is_bad=False,
            # MoveIt Servo's lower_singularity_threshold and hard_stop_singularity_threshold.
            warn=17.0,
            stop=30.0,
            least=1.0,
        ),
    )
}


def default_measure(joints: int) -> Measure:
    """Return the measure that is watched if a robot file names none."""
    searched = joints <= kernel.MAX_SEARCHED_JOINTS
    return MEASURES['distance' if searched else 'condition_number']
