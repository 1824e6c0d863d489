# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw panels over one time axis, with the intervals near singular poses shaded."""

from collections.abc import Sequence
from itertools import cycle

import numpy as np

from ....kernel import Floats
from ....robot.measures import Level
from .artists import Axes, Figure
from .motion import PlottedMotion
from .picture import DASHES, SERIES, VERMILION, YELLOW

# Width of a picture, inches.
WIDTH = 8.5
# Height of the title and the legend of a picture, inches.
HEAD_HEIGHT = 1.3
# A curve is drawn as pixels, also in a vector picture, if its number of points exceeds this.
MAX_POINTS = 20_000
# Colour and opacity of the intervals that are shaded because their level is WARN or ERROR.
SHADES = {Level.WARN: (YELLOW, 0.45), Level.ERROR: (VERMILION, 0.30)}


def panels(
    figure: Figure, heights: Sequence[float], title: str, across: str = 'time (s)'
) -> list[Axes]:
    """
    Return the matplotlib axes of panels that are stacked vertically and share the horizontal axis.

    Parameters
    ----------
    figure
        An empty figure.
    heights
        Heights of the panels, inches.
    title
        Title of the picture.
    across
        Label of the horizontal axis.
    """
    figure.set_size_inches(WIDTH, sum(heights) + HEAD_HEIGHT)
    figure.set_layout_engine('constrained', h_pad=0.06)
    axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
    rows = [row[0] for row in axes]
    rows[-1].set_xlabel(across)
    figure.suptitle(title)
    figure.align_ylabels(rows)
    return rows


def draw_curves(
    axes: Axes,
    motion: PlottedMotion,
    values: Floats,
    names: Sequence[str],
    colors: Sequence[str] = SERIES,
) -> None:
    """
    Draw each column of values (N, k) over the times of a motion as a curve, with different colours
    and dashes.
    """
    lines = axes.plot(*motion.broken(values), zorder=3, rasterized=len(values) > MAX_POINTS)
    for line, name, color, dashes in zip(lines, names, cycle(colors), cycle(DASHES)):
        line.set(label=name, color=color, linestyle=dashes)


def draw_legend(axes: Axes) -> None:
    """Draw the legend beside the axes, so that it does not cover a curve."""
    axes.legend(loc='upper left', bbox_to_anchor=(1.005, 1.02), frameon=False, borderaxespad=0.2)


def shade(
    figure: Figure, rows: Sequence[Axes], motion: PlottedMotion, levels: Floats, meaning: str
) -> None:
    """
    Shade the intervals with the level WARN or ERROR in all panels. `levels` (N,) belong to the
    times of the motion; `meaning` is the title of the legend.
    """
    from matplotlib.patches import Patch

    times, changes = motion.times.tolist(), np.flatnonzero(np.diff(levels)) + 1
    least = 0.001 * (times[-1] - times[0])
    # An interval with one level ends at the first time with another level.
    starts, ends = [0, *changes.tolist()], [*changes.tolist(), len(times) - 1]
    for start, end in zip(starts, ends):
        level = Level(int(levels[start]))
        if level in SHADES:
            color, alpha = SHADES[level]
            until = max(times[end], times[start] + least)
            for axes in rows:
                axes.axvspan(
                    times[start], until, color=color, alpha=alpha, linewidth=0, zorder=0.5
                )
    entries = []
    for level, (color, alpha) in SHADES.items():
        if np.any(levels == level):
            entries.append(Patch(color=color, alpha=alpha, label=level.name))
    if entries:
        figure.legend(
            handles=entries, loc='outside lower left', ncols=2, frameon=False,
            title=meaning, alignment='left',
        )  # fmt: skip
