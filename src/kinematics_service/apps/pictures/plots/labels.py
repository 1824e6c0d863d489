# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Place labels in 3D axes: try positions around each labelled point, and choose those that cover the
arm and other labels least.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....kernel import Floats
from .artists import Axes3D

# Directions in which a label may stand from the labelled place, and distances from the place to
# the label in typographic points (1/72 inch).
DIRECTIONS = [(np.cos(a), np.sin(a)) for a in np.arange(12) * np.pi / 6.0]
RADII = (9.0, 15.0, 23.0, 33.0)
# Width of a letter and height of a line, divided by the font size.
LETTER_WIDTH = 0.62  # mean width in the font DejaVu Sans
LINE_HEIGHT = 1.25  # contains the gap to the next line
# Points at these fractions of the length of each arm segment are tested for collisions with
# labels.
ALONG = np.linspace(0.0, 1.0, 25)[:, None]

Box = tuple[Floats, Floats]


@dataclass(frozen=True, eq=False)
class Label:
    """A text beside a point (3,), m."""

    point: Floats
    text: str
    color: str
    bold: bool = False


def place_labels(
    axes: Axes3D, labels: Sequence[Label], lines: Sequence[tuple[Floats, Floats]], size: float
) -> None:
    """
    Write labels into 3D axes whose view and limits are final.

    Parameters
    ----------
    axes
        Axes of matplotlib's toolkit mplot3d.
    labels
        The labels. Labels at one point of the picture become one text, separated by commas.
    lines
        Segments that labels should not cover: pairs of points (3,), m.
    size
        Font size, points.
    """
    axes.apply_aspect()
    scale = 72.0 / axes.figure.dpi
    seen = np.vstack([start + ALONG * (end - start) for start, end in lines])
    obstacles = _on_paper(axes, seen) * scale
    frame = axes.get_window_extent()
    room = frame.min * scale, frame.max * scale
    taken: list[Box] = []
    for label in _merged(axes, labels, 4.0 / scale):
        at = _on_paper(axes, label.point[None])[0] * scale
        half = np.array([LETTER_WIDTH * size * len(label.text), LINE_HEIGHT * size]) / 2.0
        offset, corners = _best(at, half, obstacles, taken, room)
        taken.append(corners)
        _write(axes, label, offset, size)


def _on_paper(axes: Axes3D, points: Floats) -> Floats:
    # Return the pixel coordinates (k, 2) of points (k, 3), m.
    homogeneous = np.column_stack([points, np.ones(len(points))]) @ axes.get_proj().T
    flat = homogeneous[:, :2] / homogeneous[:, 3:]
    return np.asarray(axes.transData.transform(flat))


def _merged(axes: Axes3D, labels: Sequence[Label], near: float) -> list[Label]:
    # Merge labels of one colour if their labelled points coincide in the picture.
    merged: list[Label] = []
    for label in labels:
        for k, other in enumerate(merged):
            at, other_at = _on_paper(axes, np.stack([label.point, other.point]))
            if other.color == label.color and np.hypot(*(at - other_at)) < near:
                merged[k] = replace(other, text=f'{other.text}, {label.text}')
                break
        else:
            merged.append(label)
    return merged


def _best(
    at: Floats, half: Floats, obstacles: Floats, taken: list[Box], room: Box
) -> tuple[Floats, Box]:
    # Return the best offset of a label from its point, and the box that the label covers. The
    # criteria are, in this order: fewest collisions with other labels and the border, fewest
    # covered points of the arm, smallest distance.
    choices = []
    for radius, direction in itertools.product(RADII, DIRECTIONS):
        # Place the box of the label so that its nearest edge is about `radius` from the labelled
        # point.
        offset = np.array(direction) * (radius + half * np.abs(direction) - half.min() / 2)
        low, high = at + offset - half, at + offset + half
        collisions = sum(bool(np.all((low < b) & (high > a))) for a, b in taken)
        collisions += bool(np.any(low < room[0]) or np.any(high > room[1]))
        covered = int(np.sum(np.all((obstacles > low - 1.0) & (obstacles < high + 1.0), axis=1)))
        choices.append((collisions, covered, radius, offset, (low, high)))
    return min(choices, key=lambda choice: choice[:3])[3:]


def _write(axes: Axes3D, label: Label, offset: Floats, size: float) -> None:
    from matplotlib.patheffects import withStroke
    from matplotlib.transforms import ScaledTranslation

    text = axes.text(*label.point, label.text, color=label.color, fontsize=size, zorder=20)
    text.set(ha='center', va='center', fontweight='bold' if label.bold else 'normal')
    text.set_path_effects([withStroke(linewidth=2.0, foreground='white')])
    across, up = offset / 72.0
    inches = ScaledTranslation(across, up, axes.figure.dpi_scale_trans)
    text.set_transform(axes.transData + inches)
