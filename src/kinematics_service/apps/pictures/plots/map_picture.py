# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw the map of the distance to a singular pose over two joints, with the singular sets."""

import math
import textwrap
from fractions import Fraction
from typing import Any

import numpy as np

from ....kernel import Floats
from ....robot.robot import Robot
from .artists import Artist, Axes, Figure
from .captions import positions, short
from .distance_colours import ColourScale, draw_distances
from .distance_map import DistanceMap
from .picture import Draw, with_unit, words
from .ranges import not_all_closed
from .set_styles import set_styles

# A singular factor is taken as zero at a point on the border of the map if its absolute value
# there is at most this ratio times its largest absolute value on the map.
ZERO_RATIO = 1e-9
QUARTER = math.pi / 4.0
# Colour of the part of the map where a closed loop does not close.
OPEN = '#8A8D93'


def map_picture(robot: Robot, numbers: DistanceMap) -> Draw:
    """Return the picture of a map: the distance to a singular pose over two joints."""

    def draw(figure: Figure) -> None:
        figure.set_size_inches(7.6, 7.4)
        figure.set_layout_engine('constrained')
        axes = figure.subplots()
        x, y = numbers.horizontal, numbers.vertical
        across, up = (v[1] - v[0] for v in (x, y))
        largest = max(float(np.nanmax(numbers.distance)), 1e-3)
        extent = x[0] - across / 2, x[-1] + across / 2, y[0] - up / 2, y[-1] + up / 2
        scale, label = ColourScale(0.0, largest), 'distance to singularity'
        farther = draw_distances(figure, axes, numbers.distance, extent, scale, label)
        axes.set_aspect('auto')
        axes.grid(False)
        entries = _draw_sets(axes, numbers) + _draw_thresholds(axes, robot, numbers)
        entries += farther + _draw_open(axes, robot, numbers)
        for axis, joint in zip((axes.xaxis, axes.yaxis), numbers.joints):
            _label(axis, robot, joint)
        axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
        if not np.any(robot.prismatic[list(numbers.joints)]):
            axes.set_box_aspect(1.0 if np.ptp(x) == np.ptp(y) else None)
        figure.suptitle(_title(robot, numbers))
        if entries:
            figure.legend(
                handles=entries, loc='outside lower center', ncols=3, facecolor='#45484F',
                labelcolor='white', framealpha=1.0, edgecolor='none', handlelength=3.0,
            )  # fmt: skip

    return draw


def _draw_sets(axes: Axes, numbers: DistanceMap) -> list[Artist]:
    from matplotlib.lines import Line2D

    entries: list[Artist] = []
    styles = set_styles(tuple(numbers.functions))
    for name, function in numbers.functions.items():
        values = with_border_crossed(function)
        if name in numbers.everywhere or np.nanmin(values) > 0.0 or np.nanmax(values) < 0.0:
            continue
        color, style = styles[name]
        # `clip_on=False` draws a curve on the border in its full width.
        axes.contour(
            numbers.horizontal, numbers.vertical, values, levels=[0.0],
            colors=[color], linewidths=2.2, linestyles=[style], clip_on=False, zorder=3,
        )  # fmt: skip
        label = f'{words(name)} = 0'
        entries.append(Line2D([], [], color=color, linestyle=style, linewidth=2.2, label=label))
    return entries


def with_border_crossed(values: Floats) -> Floats:
    """
    Return the values (rows, columns) of a singular factor on the map, without zeros on the border.

    Each zero on the border is replaced by a tiny number. If the neighbour inside the map is
    positive, the tiny number is negative, and the other way round. The reason: matplotlib draws
    the zero curve of the factor only between values of different signs. With the tiny numbers, it
    draws the curve also along a border on which the factor is zero, for example sin(q) at pi.
    """
    crossed = np.array(values)
    for turned in (crossed, crossed[::-1], crossed.T, crossed.T[::-1]):
        border, inside = turned[0], turned[1]
        zero = np.abs(border) <= ZERO_RATIO * np.nanmax(np.abs(values))
        border[zero] = -np.copysign(ZERO_RATIO * np.abs(inside), inside)[zero]
    return crossed


def _draw_thresholds(axes: Axes, robot: Robot, numbers: DistanceMap) -> list[Artist]:
    from matplotlib.lines import Line2D

    limits, entries = robot.singularity.thresholds, list[Artist]()
    if limits.measure != 'distance':
        return entries
    for value, name, style in ((limits.warn, 'warn', '-'), (limits.stop, 'stop', ':')):
        if not np.nanmin(numbers.distance) < value < np.nanmax(numbers.distance):
            continue
        axes.contour(
            numbers.horizontal, numbers.vertical, numbers.distance, levels=[value],
            colors=['white'], linewidths=0.9, linestyles=[style],
        )  # fmt: skip
        label = f'{name}: distance {value:g} rad'
        entries.append(Line2D([], [], color='white', linestyle=style, linewidth=0.9, label=label))
    return entries


def _draw_open(axes: Axes, robot: Robot, numbers: DistanceMap) -> list[Artist]:
    # Hatch the background, which is visible where closed loops do not close.
    from matplotlib.patches import Patch

    if numbers.open_share == 0.0:
        return []
    style: dict[str, Any] = {
        'facecolor': OPEN,
        'edgecolor': 'white',
        'hatch': '//',
        'linewidth': 0.0,
    }
    axes.patch.set(**style)
    label = f'{words(not_all_closed(robot.loop_names))}: {100.0 * numbers.open_share:.3g} %'
    return [Patch(**style, label=label)]


def _label(axis: Any, robot: Robot, joint: int) -> None:
    from matplotlib.ticker import FuncFormatter, MultipleLocator

    axis.set_label_text(with_unit(short(robot.variables[joint]), robot.units[joint]))
    low, high = axis.get_view_interval()
    if not robot.prismatic[joint] and high - low > math.pi:
        step = QUARTER if high - low <= 1.25 * math.pi else 2.0 * QUARTER
        axis.set_major_locator(MultipleLocator(step))
        axis.set_major_formatter(FuncFormatter(lambda value, _: _in_pi(value)))


def _in_pi(value: float) -> str:
    top, bottom = Fraction(round(value / QUARTER), 4).as_integer_ratio()
    if top == 0:
        return '0'
    text = f'{top}π/{bottom}'.removesuffix('/1').replace('-', '\N{MINUS SIGN}')
    return text if abs(top) > 1 else text.replace('1π', 'π')


def _title(robot: Robot, numbers: DistanceMap) -> str:
    rows = ' '.join(robot.singularity.task.rows)
    text = f'{words(robot.name)}: distance to singularity (task {rows})'
    if robot.dof > 2:
        text += f'\nthe other joints at {positions(robot, numbers.q, 80, skip=numbers.joints)}'
    if numbers.everywhere:
        names = ', '.join(numbers.everywhere)
        held = f'the whole map is singular: {words(names)} = 0 because of the joints that are held'
        text += '\n' + textwrap.fill(held, 90)
    return text
