# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the measures of singularity: name, unit, and valid thresholds of each measure."""

import math
from dataclasses import dataclass

from .... import kernel


@dataclass(frozen=True)
class Measure:
    """
    A measure of singularity: its names, unit and thresholds. The kernel computes its value. A
    result `Singularity` has the value in the field with the name of the measure.

    Attributes
    ----------
    name, meaning
        The name in robot files, topics and parameters; the definition for the reference page of
        the documentation.
    column
        Index of the column in which `kernel.measure` writes the value in its result array.
    small_is_bad
        Whether the measure decreases toward a singular pose.
    unit
        The unit of the value and of the thresholds, as written in sentences.
    warn, stop
        Default thresholds; None if no default suits every arm.
    least, most
        A valid threshold is above `least` and at most `most`. For the measure `distance`, `most`
        is also the radius of the search for singular poses. If no singular pose is found, the
        value of this measure is `most`.
    of_square
        Whether the measure exists only for a square J_t. Such a measure may be negative; its
        absolute value is compared with the thresholds.
    of_volume
        Whether the measure is a product of singular values of the unscaled J_t, so that its unit
        depends on the arm.
    drawn_unit
        The unit as written in pictures and tables; if empty, `unit` is written.
    short, long, drawn
        Names for narrow tables (`short`), for titles (`long`), and for the axes of plots (`drawn`,
        in TeX).
    on_page
        Whether the HTML page of the command `audit` shows the measure even if the thresholds apply
        to another measure.
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
        """Return the name of the measure with spaces instead of underscores."""
        return self.name.replace('_', ' ')

    def refusal(self, threshold: float) -> str:
        """Return why a threshold is invalid, as text `must be ...`; '' for a valid threshold."""
        if math.isfinite(threshold) and self.least < threshold <= self.most:
            return ''
        upper = f' and at most {self._amount(self.most)}' if self.most < math.inf else ''
        return f'must be above {self.least:g}{upper}, not {self._amount(threshold)}'

    def farther(self, value: float) -> str:
        """
        Return a text such as `none found within 1 rad (57 deg)` if no singular pose was found,
        else ''.

        The measure `distance` is the distance to the nearest singular pose. If no singular pose
        was found, the value of this measure is `most`, the radius of the search (1 rad). For all
        other measures the result is ''.
        """
        if not value >= self.most < math.inf:
            return ''
        return f'none found within {self._amount(self.most)}'

    def _amount(self, value: float) -> str:
        if self.unit != 'rad' or not math.isfinite(value):
            return f'{value:g}'
        return f'{value:g} rad ({math.degrees(value):.0f} deg)'

    def ordered(self, warn: float, stop: float) -> bool:
        """
        Return whether two thresholds are in the right order: `warn` is farther from singular than
        `stop`.
        """
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
            warn=0.1,  # 0.1 rad is about 6 degrees; `stop`, 0.03 rad, is about 2 degrees
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
            # The default thresholds of MoveIt Servo: lower_singularity_threshold = 17 and
            # hard_stop_singularity_threshold = 30.
            warn=17.0,
            stop=30.0,
            least=1.0,
        ),
    )
}


def default_measure(joints: int) -> Measure:
    """Return the measure that the node watches if a robot file does not name a measure."""
    searched = joints <= kernel.MAX_SEARCHED_JOINTS
    return MEASURES['distance' if searched else 'condition_number']
