# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw the measures of singularity along a path, with the thresholds of WARN and ERROR."""

import math
import textwrap
from typing import Any

import numpy as np

from ....kernel import Floats
from ....kinematics.singularity import Singularity, flat_loop, singularity
from ....robot.measure_units import measure_units
from ....robot.measures import MEASURES, Measure
from ....robot.robot import Robot
from .artists import Axes, Figure
from .motion import PlottedMotion
from .over_time import draw_curves, draw_legend, panels, shade
from .picture import GREY, VERMILION, Draw, with_unit, words

# Width of one letter in the name of a singular factor, divided by the width of the panel.
LETTER_WIDTH = 0.014
# At a minimum of the distance to singularity along the motion, the picture names the singular
# factor that is nearest to zero. It does so only if the minimum is below this ratio times the
# largest distance to singularity in the motion.
NAMED_RATIO = 0.3
# The vertical axis of condition numbers ends at most at 1.1 times this value. Larger values are
# not shown: at a singular pose the condition number is infinite, and the computed number depends
# on round-off only.
MAX_CONDITION = 1e4
# Maximum number of letters in a line of an axis label.
LABEL_LETTERS = 14


def measures_picture(robot: Robot, motion: PlottedMotion) -> Draw:
    """
    Return the picture of the singularity measures along a motion, one panel for each measure.

    The robot file sets thresholds for one of the measures. They are drawn in the panel of this
    measure. All panels are shaded where this measure is beyond a threshold.
    """
    near = singularity(robot, motion.q)
    units = measure_units(robot)
    drawn = [m for m in MEASURES.values() if getattr(near, m.name) is not None]

    def draw(figure: Figure) -> None:
        task = robot.singularity.task
        title = (
            f'{words(robot.name)}: singularity along {words(motion.described)}\n'
            f'task {" ".join(task.rows)}, length {task.length:.3g} m; '
            f'watched: {robot.singularity.thresholds.measure.replace("_", " ")}'
        )
        rows = panels(figure, [2.3] + [1.5] * (len(drawn) - 1), title)
        for measure, axes in zip(drawn, rows):
            values = np.asarray(getattr(near, measure.name))
            draw_curves(axes, motion, values[:, None], [''])
            axes.set_ylabel(_label(measure, units[measure.name]))
            if not measure.small_is_bad:
                _scale_without_end(axes, values, measure.least)
            else:
                axes.axhline(0.0, color=GREY, linewidth=0.8, zorder=1)
            if farther := measure.farther(float(np.max(values))):
                axes.axhline(measure.most, color=GREY, linestyle=':', label=farther, zorder=1)
                draw_legend(axes)
            if measure.name == robot.singularity.thresholds.measure:
                _draw_thresholds(axes, robot)
            axes.margins(x=0.0)
        _name_factors(robot, rows[0], motion, near)
        shade(figure, rows, motion, near.level, 'beyond a threshold')

    return draw


def _label(measure: Measure, unit: str) -> str:
    label = measure.drawn or '\n'.join(textwrap.wrap(measure.words, LABEL_LETTERS))
    base, _, power = unit.partition('^')
    raised = f'{base}$^{{{power}}}$' if power else base
    return with_unit(label, raised).replace(' (', '\n(')


def _draw_thresholds(axes: Axes, robot: Robot) -> None:
    limits = robot.singularity.thresholds
    measure = MEASURES[limits.measure]
    both = measure.of_square  # the measure may be negative, so draw thresholds with both signs
    for value, name, style in ((limits.warn, 'warn', '--'), (limits.stop, 'stop', '-')):
        for sign in (1.0, -1.0) if both else (1.0,):
            label = f'{name} {value:g}' if sign > 0 else None
            axes.axhline(sign * value, color=VERMILION, linestyle=style, label=label)
    if measure.small_is_bad and not both:
        axes.set_ylim(bottom=0.0)
    draw_legend(axes)


def _scale_without_end(axes: Axes, values: Floats, least: float) -> None:
    # Choose the limits and the scale (linear or logarithmic) of the vertical axis for a measure
    # that has no upper bound.
    largest = min(float(np.max(values[np.isfinite(values)], initial=least)), MAX_CONDITION)
    if least and largest >= 10.0:
        axes.set_yscale('log')
        axes.yaxis.set_major_formatter('{x:g}')
        axes.yaxis.set_minor_formatter('')
    axes.set_ylim(0.9 * least, 1.1 * max(largest, 1.1 * least))


def _name_factors(robot: Robot, axes: Axes, motion: PlottedMotion, near: Singularity) -> None:
    # Write the names of singular factors above the panel: at each minimum of the distance to
    # singularity, the factor that is nearest to zero. Start with the lowest minimum. Leave out a
    # name that would overlap another name.
    factors = near.factors
    if factors is None:
        return
    distance = np.asarray(near.distance)
    low = _valleys(distance)
    low = low[distance[low] < NAMED_RATIO * float(np.max(distance))]
    span = float(motion.times[-1] - motion.times[0])
    taken: list[tuple[float, float]] = []
    for k in low[np.argsort(distance[low], kind='stable')]:
        nearest = int(np.argmin(factors.estimates[k]))
        if robot.singularity.factors.is_loop(nearest) and not flat_loop(
            robot, singularity(robot, motion.q[k])
        ):
            continue  # this factor belongs to a closed loop that is not singular here
        t, name = float(motion.times[k]), factors.names[nearest]
        half = 0.5 * LETTER_WIDTH * span * (len(name) + 1)
        if any(t - half < b and t + half > a for a, b in taken):
            continue
        taken.append((t - half, t + half))
        axes.annotate(
            words(name),
            (t, distance[k]),
            xytext=(t, 1.02),
            textcoords=('data', 'axes fraction'),
            ha='center',
            arrowprops={'arrowstyle': '-', 'color': GREY, 'linestyle': ':'},
            annotation_clip=False,
        )


def _valleys(values: Floats) -> Any:
    padded = np.pad(values, 1, constant_values=math.inf)
    return np.flatnonzero((values <= padded[:-2]) & (values < padded[2:]))
