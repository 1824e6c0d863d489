# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw the reachable workspace in a plane, with its border and its singular curves."""

import collections

import numpy as np

from ....kernel import Floats
from ....robot.robot import Robot
from .artists import Axes, Figure
from .critical import CriticalPoints
from .distance_colours import ColourScale, draw_distances
from .picture import BLACK, Draw, words
from .ranges import not_all_closed
from .set_styles import set_styles
from .workspace import Workspace

# Largest number of singular sets that are drawn: those on which the search found the most points.
MAX_SETS = 4
# Length of the longer side of the drawn workspace, inches.
SIDE_LENGTH = 7.0
# Width of the colour bar with its labels, inches.
BAR_WIDTH = 1.6
# The colour scale ends at this percentile of the cells' distances to singularity, so that a few
# cells with large distances do not determine the scale.
HIGH_PERCENTILE = 98.0
# Smallest difference between upper and lower limit of a colour scale, rad.
MIN_SCALE = 1e-3


def workspace_picture(robot: Robot, space: Workspace, critical: CriticalPoints) -> Draw:
    """
    Return the picture of a workspace: its distances to singularity as colours, its border and its
    singular curves.
    """

    def draw(figure: Figure) -> None:
        rows, columns = space.best.shape
        scale = SIDE_LENGTH / max(rows, columns)
        figure.set_size_inches(max(columns * scale, 4.2) + BAR_WIDTH, max(rows * scale, 2.5) + 1.5)
        figure.set_layout_engine('constrained')
        axes = figure.subplots()
        low, high = space.corner, space.corner + space.size * np.array([columns, rows])
        extent = low[0], high[0], low[1], high[1]
        label = 'largest distance to singularity found there'
        farther = draw_distances(figure, axes, space.best, extent, scale_of(space.best), label)
        axes.set_aspect('equal')
        _draw_border(axes, space)
        _draw_critical(axes, critical)
        axes.plot(0.0, 0.0, marker='+', markersize=11, color=BLACK, markeredgewidth=1.5, zorder=7)
        margin = 0.04 * float(np.max(high - low))
        # If the workspace is narrow, for example a line, enlarge the margin beside the workspace.
        beside = max(margin, 0.1 * float(np.max(high - low)) - float(high[0] - low[0]))
        left = 0.0 if space.plane.half else low[0] - beside
        axes.set(
            xlim=(left, high[0] + beside), ylim=(low[1] - margin, high[1] + margin),
            xlabel=space.plane.labels[0], ylabel=space.plane.labels[1],
        )  # fmt: skip
        axes.locator_params(nbins=6)
        if high[0] - low[0] < 0.3 * (high[1] - low[1]):
            axes.locator_params(axis='x', nbins=2)
        figure.suptitle(
            f'{words(robot.name)}: where {words(robot.tool_frame)} gets\n'
            f'{space.plane.title} ({_poses(robot, space)})',
        )
        figure.legend(
            handles=axes.get_legend_handles_labels()[0] + farther,
            loc='outside lower center', ncols=2, frameon=False, markerscale=5.0,
        )  # fmt: skip

    return draw


def _poses(robot: Robot, space: Workspace) -> str:
    if not space.open_poses:
        return f'{space.poses:,} poses'
    names = words(not_all_closed(robot.loop_names))
    return f'{space.poses:,} poses; {names} at {space.open_poses:,} of them'


def scale_of(values: Floats) -> ColourScale:
    """
    Return the colour scale for distances to singularity in rad, some of which may be nan.

    The scale usually begins at 0. It begins at the smallest distance only if the smallest distance
    is above half of the scale's upper limit.
    """
    finite = values[np.isfinite(values)]
    low, high = float(np.min(finite)), float(np.percentile(finite, HIGH_PERCENTILE))
    low = low if high - low < 0.5 * high else 0.0
    high = max(high, low + MIN_SCALE)
    return ColourScale(low, high, high < float(np.max(finite)))


def _draw_border(axes: Axes, space: Workspace) -> None:
    # Draw the outline of the cells that the tool reached. Add a margin of empty cells, so that the
    # outline is closed.
    reached = np.pad(np.isfinite(space.best), 2).astype(float)
    if np.max(_blurred(reached)) < 1.0:
        return  # a workspace that is a line has no outline
    x = space.corner[0] + space.size * (np.arange(reached.shape[1]) - 1.5)
    y = space.corner[1] + space.size * (np.arange(reached.shape[0]) - 1.5)
    axes.contour(x, y, _blurred(reached), levels=[0.5], colors=[BLACK], linewidths=1.2, zorder=4)
    axes.plot([], [], color=BLACK, linewidth=1.2, label='border of what was reached')


def _blurred(values: Floats) -> Floats:
    padded = np.pad(values, 1)
    rows, columns = values.shape
    nine = [padded[i : i + rows, k : k + columns] for i in range(3) for k in range(3)]
    return np.asarray(np.mean(nine, axis=0))


def _draw_critical(axes: Axes, critical: CriticalPoints) -> None:
    names = np.array(critical.names)
    by_frequency = [name for name, _ in collections.Counter(names.tolist()).most_common()]
    styles = set_styles(by_frequency)
    for k, name in enumerate(by_frequency[:MAX_SETS]):
        points = critical.points[names == name]
        label = f'position singular: {words(name)}' if name else 'position singular'
        axes.plot(
            *points.T, linestyle='none', marker='.', markersize=2.6, markeredgewidth=0.0,
            color=styles[name][0], label=label, zorder=5 + 0.1 * k, rasterized=True,
        )  # fmt: skip
