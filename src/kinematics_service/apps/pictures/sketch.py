# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw an arm as a small SVG for a notebook, without matplotlib."""

import math
from collections.abc import Callable, Iterator
from html import escape

import numpy as np

from ...kernel import Floats
from ...robot.robot import Robot
from .plots.skeleton import Skeleton, skeleton_of

# Size of the picture, pixels.
WIDTH = 260
HEIGHT = 220
MARGIN = 16
# Azimuth and elevation of the view, rad.
AZIMUTH = -0.9
ELEVATION = 0.4  # angle above the horizontal plane
RIGHT = -math.sin(AZIMUTH), math.cos(AZIMUTH), 0.0
DOWN = math.sin(ELEVATION) * RIGHT[1], -math.sin(ELEVATION) * RIGHT[0], -math.cos(ELEVATION)
VIEW = np.array([RIGHT, DOWN])
# Length of the axes of the tool, pixels.
AXES_LENGTH = 26
# Colours of the x, y and z axes, which people with any colour vision can distinguish.
COLOURS = ('#d55e00', '#00795a', '#0072b2')


def sketch(robot: Robot, q: Floats) -> str:
    """
    Return an SVG of an arm at joint positions (n,), rad or m.

    Circles are revolute joints, squares are prismatic joints. Three lines at the tool are the x, y
    and z axes of the tool frame.
    """
    skeleton = skeleton_of(robot, q)
    flat = skeleton.points @ VIEW.T
    low, high = flat.min(axis=0), flat.max(axis=0)
    room = np.array([WIDTH, HEIGHT]) - 2 * MARGIN
    scale = float(np.min(room / np.maximum(high - low, 1e-3 * robot.singularity.task.reach)))
    middle = 0.5 * (low + high)

    def at(point: Floats) -> tuple[float, float]:
        x, y = (scale * (VIEW @ point - middle) + 0.5 * np.array([WIDTH, HEIGHT])).tolist()
        return x, y

    return (
        f'<svg width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'aria-label="{escape(robot.name)}" fill="none" stroke="currentColor" '
        f'stroke-linecap="round">{"".join(_parts(skeleton, at, AXES_LENGTH / scale))}</svg>'
    )


def _parts(
    skeleton: Skeleton, at: Callable[[Floats], tuple[float, float]], length: float
) -> Iterator[str]:
    for segment in skeleton.segments:
        dashes = ' stroke-dasharray="7 4"' if segment.slides else ''
        yield _line(at(segment.start), at(segment.end), f'stroke-width="4"{dashes}')
    x, y = at(np.zeros(3))
    yield f'<path d="M{x - 9:.1f} {y:.1f}h18" stroke-width="3"/>'
    for axis in skeleton.axes:
        x, y = at(axis.point)
        shape = (
            f'<rect x="{x - 4:.1f}" y="{y - 4:.1f}" width="8" height="8"'
            if axis.slides
            else f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5"'
        )
        yield f'{shape} fill="#e69f00" stroke-width="1"/>'
    origin = skeleton.tool[:3, 3]
    for k, colour in enumerate(COLOURS):
        tip = origin + length * skeleton.tool[:3, k]
        yield _line(at(origin), at(tip), f'stroke="{colour}" stroke-width="2"')


def _line(p: tuple[float, float], q: tuple[float, float], style: str) -> str:
    return f'<line x1="{p[0]:.1f}" y1="{p[1]:.1f}" x2="{q[0]:.1f}" y2="{q[1]:.1f}" {style}/>'
