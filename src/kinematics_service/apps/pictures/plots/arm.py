"""The picture of an arm in a pose: links, joint axes and frames from its table alone."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....kernel import Floats
from ....kinematics.singularity import singularity
from ....robot.measures import Level
from ....robot.robot import Robot
from .artists import Axes3D, Figure
from .captions import nearness, positions, short
from .labels import Label, place_labels
from .picture import AXIS_COLORS, BLACK, GREY, LIGHT, ORANGE, PURPLE, Draw, with_unit, words
from .skeleton import Skeleton, skeleton_of

# Lengths as shares of the drawn cube's edge.
FRAME, AXIS, TOOL_FRAME, LOST = 0.06, 0.24, 0.11, 0.22
MARGIN = 0.08
# Elevation and azimuths of the view, degrees: never along x or y, whose labels would overlap. The
# first of equally good ones is taken.
ELEVATION = 22.0
AZIMUTHS = (-55.0, *(float(a) for a in range(-175, 180, 10) if 10 < a % 90 < 80))
# Number of points of a link that count for the view.
ALONG = 9
# Weight of the arm's length on paper beside its area: an arm in a line has no area.
LENGTH_SHARE = 0.1


def arm_picture(robot: Robot, q: Floats) -> Draw:
    """
    Return the picture of an arm at joint positions (n,), rad or m.

    Raises
    ------
    JointVectorError
        `q` has not n finite numbers.
    """
    skeleton, near = skeleton_of(robot, q), singularity(robot, q)

    def draw(figure: Figure) -> None:
        figure.set_size_inches(7.5, 7.4)
        axes = figure.add_axes((-0.03, 0.035, 1.0, 0.925), projection='3d')
        cube = cube_around([skeleton])
        set_space(axes, cube, azimuth_of(skeleton))
        draw_skeleton(axes, skeleton, cube, label_size=9.0)
        if near.level != Level.OK:
            _draw_lost(axes, skeleton.tool[:3, 3], near.lost_direction[:3], edge_of(cube))
        figure.suptitle(
            f'{words(robot.name)}: {words(robot.tool_frame)} in {words(robot.base_frame)}\n'
            f'{positions(robot, q, 90)}\n{nearness(robot, near)}',
            fontsize=10.5,
            y=0.985,
        )
        _draw_legend(figure, axes)

    return draw


def cube_around(skeletons: Sequence[Skeleton], *others: Floats) -> Floats:
    """Return the cube that holds arms, their base and other points (3,), shape (3, 2), m."""
    points = np.vstack([*(skeleton.points for skeleton in skeletons), *others])
    low, high = points.min(axis=0), points.max(axis=0)
    half = (0.5 + MARGIN) * max(float(np.max(high - low)), 1e-3)
    middle = (low + high) / 2.0
    return np.stack([middle - half, middle + half], axis=1)


def edge_of(cube: Floats) -> float:
    """Return the length of a cube's edge, m."""
    return float(cube[0, 1] - cube[0, 0])


def azimuth_of(skeleton: Skeleton) -> float:
    """
    Return the azimuth from which an arm looks largest, degrees. Its size is the area over which
    its links spread on paper: the product of the spreads along the principal directions there.
    """
    segments = skeleton.segments
    if not segments:
        return AZIMUTHS[0]
    shares = np.linspace(0.0, 1.0, ALONG)[:, None]
    points = np.vstack([s.start + shares * (s.end - s.start) for s in segments])
    weights = np.repeat([np.linalg.norm(s.end - s.start) for s in segments], ALONG)
    points = points - np.average(points, axis=0, weights=weights)
    moments = points.T @ (points * (weights / np.sum(weights))[:, None])
    return max(AZIMUTHS, key=lambda azimuth: _size_on_paper(moments, azimuth))


def _size_on_paper(moments: Floats, azimuth: float) -> float:
    # From the second moments (3, 3), over those of the arm itself.
    a, e = np.radians([azimuth, ELEVATION])
    across = [-np.sin(a), np.cos(a), 0.0]
    up = [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]
    paper = np.array([across, up])
    small, large = np.linalg.eigvalsh(paper @ moments @ paper.T) / np.trace(moments)
    # Rounded, so that equal views are equal and the first one is taken.
    return round(float(np.sqrt(max(small, 0.0) * large) + LENGTH_SHARE * large), 9)


def set_space(axes: Axes3D, cube: Floats, azimuth: float, small: bool = False) -> None:
    """Give axes in space equal scales, units and a view; `small` for one of many panels."""
    size = 8.0 if small else 10.0
    axes.set(xlim=cube[0], ylim=cube[1], zlim=cube[2])
    axes.set_box_aspect((1.0, 1.0, 1.0))
    axes.computed_zorder = False  # axes in front of links, labels in front of all
    axes.view_init(elev=ELEVATION, azim=azimuth)
    for name, color, axis in zip('xyz', AXIS_COLORS, (axes.xaxis, axes.yaxis, axes.zaxis)):
        axis.set_label_text(with_unit(name, 'm'), fontsize=size, color=color)
        axis.labelpad = -2.5 if small else 3.0
        axis.set_tick_params(labelsize=size - 1.0, pad=-1.5 if small else 0.0)
        axis.set_pane_color('#FAFAFA')
        axis.get_major_locator().set_params(nbins=3 if small else 5)


def draw_skeleton(
    axes: Axes3D, skeleton: Skeleton, cube: Floats, label_size: float | None
) -> None:
    """Draw an arm into axes in space; labels of joints and tool if a size of letters is given."""
    edge, floor = edge_of(cube), cube[2, 0]
    thick = 1.0 if label_size else 0.7
    for segment in skeleton.segments:
        ends = np.stack([segment.start, segment.end])
        axes.plot(
            ends[:, 0],
            ends[:, 1],
            np.full(2, floor),
            color=LIGHT,
            linewidth=2.5 * thick,
            solid_capstyle='round',
            zorder=1,
        )
    for segment in skeleton.segments:
        ends = np.stack([segment.start, segment.end]).T
        axes.plot(
            *ends,
            color=ORANGE if segment.slides else GREY,
            linewidth=5.0 * thick,
            solid_capstyle='round',
            zorder=5,
            gid='slide' if segment.slides else 'link',
        )
    labels = []
    for axis in skeleton.axes:
        if axis.variables:  # a passive joint of a loop is a point
            half = 0.5 * AXIS * edge * axis.direction
            ends = np.stack([axis.point - half, axis.point + half])
            axes.plot(
                *ends.T,
                color=BLACK,
                linewidth=1.2 * thick,
                linestyle=(0, (5, 1.5, 1, 1.5)),
                zorder=9,
                gid='axis',
            )
            labels.append(Label(ends[1], ' '.join(map(short, axis.variables)), BLACK))
        marker = 's' if axis.slides else 'o'
        axes.plot(
            *axis.point[:, None],
            marker=marker,
            markersize=7.0 * thick,
            color='white',
            markeredgecolor=BLACK,
            zorder=10,
            gid='joint',
        )
    _draw_frames(axes, skeleton, edge, thick)
    if label_size:
        tool = skeleton.tool
        tips = tool[:3, 3] + TOOL_FRAME * edge * tool[:3, :3].T
        labels += [
            Label(tip, name, color, bold=True)
            for tip, name, color in zip(tips, 'xyz', AXIS_COLORS)
        ]
        lines = [(segment.start, segment.end) for segment in skeleton.segments]
        lines += [(tool[:3, 3], tip) for tip in tips]
        lines += [(axis.point, axis.point) for axis in skeleton.axes]
        place_labels(axes, labels, lines or [(tool[:3, 3], tool[:3, 3])], label_size)


def _draw_frames(axes: Axes3D, skeleton: Skeleton, edge: float, thick: float) -> None:
    for frame, length, width in (
        *((frame, FRAME, 1.1) for frame in skeleton.frames),
        (skeleton.tool, TOOL_FRAME, 2.2),
    ):
        origin = frame[:3, 3]
        for k, color in enumerate(AXIS_COLORS):
            ends = np.stack([origin, origin + length * edge * frame[:3, k]])
            axes.plot(*ends.T, color=color, linewidth=width * thick, zorder=12, gid='frame')


def _draw_lost(axes: Axes3D, point: Floats, direction: Floats, edge: float) -> None:
    # Draws the lost translation, both ways; a lost rotation has no arrow.
    norm = float(np.linalg.norm(direction))
    if norm < 0.1:
        return
    for sign in (-1.0, 1.0):
        arrow = sign * LOST * edge * direction / norm
        axes.quiver(
            *point, *arrow, color=PURPLE, linewidth=2.0, linestyle='--', gid='lost', zorder=15
        )


def _draw_legend(figure: Figure, axes: Axes3D) -> None:
    from matplotlib.lines import Line2D

    seen = {line.get_gid() for line in axes.lines} | {
        collection.get_gid() for collection in axes.collections
    }
    slides = any(line.get_gid() == 'joint' and line.get_marker() == 's' for line in axes.lines)
    entries: dict[str, dict[str, Any]] = {
        'link': {'color': GREY, 'linewidth': 5},
        'joint and its axis': {
            'color': BLACK, 'linewidth': 1.1, 'linestyle': '-.', 'marker': 'o',
            'markerfacecolor': 'white', 'markersize': 7,
        },
    }  # fmt: skip
    if slides:
        entries['sliding joint'] = {
            'color': ORANGE, 'linewidth': 5, 'marker': 's', 'markerfacecolor': 'white',
            'markeredgecolor': BLACK, 'markersize': 7,
        }  # fmt: skip
    for name, color in zip(('x', 'y', 'z (thick: tool)'), AXIS_COLORS):
        entries[name] = {'color': color, 'linewidth': 2.2}
    if 'lost' in seen:
        entries['lost translation'] = {'color': PURPLE, 'linestyle': '--', 'linewidth': 2}
    handles = [Line2D([], [], label=label, **style) for label, style in entries.items()]
    figure.legend(
        handles=handles, loc='lower center', ncols=len(entries), frameon=False, columnspacing=1.2
    )
