# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Draw an arm at one configuration: links, joint axes and frames, computed from the DH table alone.
"""

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

# Lengths of the drawn parts, divided by the edge of the drawn cube.
FRAME_LENGTH = 0.06  # length of the axes of a link frame
TOOL_FRAME_LENGTH = 0.11  # length of the axes of the tool frame
# length of a joint axis, and of each arrow along a translation that the tool cannot make
AXIS_LENGTH = 0.24
# Legend entries of the x, y and z axes of all drawn frames; the thick axes are those of the tool.
FRAME_LABELS = ('x', 'y', 'z (thick: tool)')
# Gap between the arm and the faces of the drawn cube, divided by the edge of the cube.
MARGIN_RATIO = 0.08
# Elevation of the view, degrees.
ELEVATION = 22.0
# Possible azimuths of the view, degrees. If several azimuths are equally good, the function
# `azimuth_of` takes the first of them. No azimuth is along x or y, because the labels of two axes
# would overlap.
AZIMUTHS = (-55.0, *(float(a) for a in range(-175, 180, 10) if 10 < a % 90 < 80))


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
        axes = figure.add_axes((-0.03, 0.06, 1.0, 0.9), projection='3d')
        cube = cube_around([skeleton])
        set_space(axes, cube, azimuth_of(skeleton))
        draw_skeleton(axes, skeleton, cube, label_size=9.0)
        if near.level != Level.OK:
            _draw_lost(axes, skeleton.tool[:3, 3], near.lost_direction[:3], edge_of(cube))
        figure.suptitle(
            f'{words(robot.name)}: {words(robot.tool_frame)} in {words(robot.base_frame)}\n'
            f'{positions(robot, q, 90)}\n{nearness(robot, near)}',
            y=0.985,
        )
        handles, names = axes.get_legend_handles_labels()
        entries = dict(zip(names, handles))  # keep one legend entry for each name
        figure.legend(entries.values(), entries.keys(), loc='lower center', ncols=5, frameon=False)

    return draw


def cube_around(skeletons: Sequence[Skeleton], *others: Floats) -> Floats:
    """
    Return the corners of a cube that contains arms, their base and other points (3,), m.

    The result has the shape (3, 2): column 0 has the lowest x, y and z, column 1 the highest.
    """
    points = np.vstack([*(skeleton.points for skeleton in skeletons), *others])
    low, high = points.min(axis=0), points.max(axis=0)
    half = (0.5 + MARGIN_RATIO) * max(float(np.max(high - low)), 1e-3)
    middle = (low + high) / 2.0
    return np.stack([middle - half, middle + half], axis=1)


def edge_of(cube: Floats) -> float:
    """Return the length of a cube's edge, m."""
    return float(cube[0, 1] - cube[0, 0])


def azimuth_of(skeleton: Skeleton) -> float:
    """
    Return the azimuth from which an arm looks largest, degrees.

    The function compares the areas of the projected ellipsoid of inertia of the links.
    """
    if not skeleton.segments:
        return AZIMUTHS[0]
    ends = np.array([(segment.start, segment.end) for segment in skeleton.segments])
    along, middles = ends[:, 1] - ends[:, 0], ends.mean(axis=1)
    lengths = np.linalg.norm(along, axis=1)
    middles -= np.average(middles, axis=0, weights=lengths)
    # M has the second moments of the links about the common centre of all links. Each link is
    # taken as a thin rod. M is scaled to trace 1.
    M = (lengths * middles.T) @ middles + (lengths * along.T) @ along / 12.0
    M /= np.trace(M)
    a, e = np.radians(AZIMUTHS), np.radians(ELEVATION)
    ones = np.ones(len(a))
    to_viewer = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e) * ones])
    # M, the second moments of the links, describes an ellipsoid. Let n be the unit vector to the
    # viewer (`to_viewer`), and P the projection along n. The squared area of the projected
    # ellipsoid is proportional to det(P M P^T) = n^T adj(M) n.
    adjugate = M @ M - M + (1.0 - np.trace(M @ M)) / 2.0 * np.eye(3)
    areas = np.einsum('in,ij,jn->n', to_viewer, adjugate, to_viewer)
    # The ellipsoid of a straight arm is a line, and its projected area is 0 in every view. So,
    # among equal areas, choose the view with the longest projection.
    lost = np.einsum('in,ij,jn->n', to_viewer, M, to_viewer)
    # Round areas and lengths, so that the first of several equally good views is taken in spite of
    # round-off.
    best = np.lexsort((lost.round(9), -areas.round(9)))[0]
    return float(AZIMUTHS[best])


def set_space(axes: Axes3D, cube: Floats, azimuth: float, small: bool = False) -> None:
    """
    Set equal scales, units and the view direction of 3D axes. `small` means that the axes are one
    of many panels.
    """
    size = 8.0 if small else 10.0
    axes.set(xlim=cube[0], ylim=cube[1], zlim=cube[2])
    axes.set_box_aspect((1.0, 1.0, 1.0))
    axes.computed_zorder = False  # draw objects in the order of the calls
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
    """
    Draw an arm into 3D axes, with labels of joints and tool if `label_size` (points) is given.
    """
    edge, floor = edge_of(cube), cube[2, 0]
    thick = 1.0 if label_size else 0.7

    def line(start: Floats, end: Floats, width: float, color: str, **style: Any) -> None:
        axes.plot(*np.stack([start, end], axis=1), color=color, linewidth=width * thick, **style)

    for segment in skeleton.segments:
        start, end = (np.array([*point[:2], floor]) for point in (segment.start, segment.end))
        line(start, end, 2.5, LIGHT)
    for segment in skeleton.segments:
        color, label = (ORANGE, 'slide') if segment.slides else (GREY, 'link')
        line(segment.start, segment.end, 5.0, color, label=label)
    labels = []
    for axis in skeleton.axes:
        if axis.variables:  # a passive joint of a loop gets a marker, but no axis
            half = 0.5 * AXIS_LENGTH * edge * axis.direction
            end = axis.point + half
            line(axis.point - half, end, 1.2, BLACK, linestyle='-.', label='joint axis')
            labels.append(Label(end, ' '.join(map(short, axis.variables)), BLACK))
    for axis in skeleton.axes:
        marker, label = ('s', 'sliding joint') if axis.slides else ('o', 'joint')
        style = {'marker': marker, 'markersize': 7.0 * thick, 'markeredgecolor': BLACK}
        line(axis.point, axis.point, 0.0, 'white', label=label, **style)
    tool = skeleton.tool
    frames = [(frame, FRAME_LENGTH, 1.1) for frame in skeleton.frames]
    for frame, length, width in (*frames, (tool, TOOL_FRAME_LENGTH, 2.2)):
        tips = frame[:3, 3] + length * edge * frame[:3, :3].T
        for tip, name, color in zip(tips, FRAME_LABELS, AXIS_COLORS):
            line(frame[:3, 3], tip, width, color, label=name, gid='frame')
    if label_size:
        colored = zip(tips, 'xyz', AXIS_COLORS)
        labels += [Label(tip, name, color, bold=True) for tip, name, color in colored]
        lines = [(segment.start, segment.end) for segment in skeleton.segments]
        lines += [(tool[:3, 3], tip) for tip in tips]
        lines += [(axis.point, axis.point) for axis in skeleton.axes]
        place_labels(axes, labels, lines, label_size)


def _draw_lost(axes: Axes3D, point: Floats, direction: Floats, edge: float) -> None:
    # Draw arrows in both directions of a translation that the tool cannot make. An impossible
    # rotation gets no arrow.
    norm = float(np.linalg.norm(direction))
    if norm < 0.1:
        return
    arrow = AXIS_LENGTH * edge * direction / norm
    for tip in (arrow, -arrow):
        axes.quiver(*point, *tip, color=PURPLE, linestyle='--', label='lost translation', zorder=3)
