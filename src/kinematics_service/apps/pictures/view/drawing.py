# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw a scene with viser: each object is created once, later only changes are sent."""

from collections import deque
from collections.abc import Set
from typing import Any

import numpy as np
import viser

from ....kernel import Floats
from ....node.drawing import scene as look
from ....node.drawing.scene import Scene

# Largest number of points of the tool's trail.
TRAIL_POINTS = 300
# Smallest distance between two successive points of the trail, divided by the arm's size.
TRAIL_STEP = 0.004
# Opacity of an ellipsoid, 0 to 1.
ELLIPSOID_OPACITY = 0.3
# Radii of the lines along motions that the tool cannot make, divided by the arm's size.
LOST_RADII = {'linear': 0.012, 'angular': 0.007}
# The points of a hidden line: a segment of length 0.
NOWHERE = np.zeros((1, 2, 3), dtype=np.float32)


class Drawing:
    """
    The objects of one arm in a viser server.

    Parameters
    ----------
    server
        The server whose pages show the arm.
    scene
        The first scene; later scenes have the same numbers of links, frames and axes.
    """

    def __init__(self, server: viser.ViserServer, scene: Scene) -> None:
        size = scene.size
        self._trail: deque[Floats] = deque(maxlen=TRAIL_POINTS)
        self._values: dict[tuple[int, str], Any] = {}
        add = server.scene
        add.add_grid(
            '/grid', 4 * size, 4 * size, cell_size=_round_length(size / 10), section_size=0
        )
        add.add_frame('/base', axes_length=0.16 * size, axes_radius=0.006 * size)
        radius = look.LINK_RADIUS * size
        self._links, self._balls, self._joints = [], [], []
        for k in range(len(scene.links)):
            self._links.append(add.add_cylinder(f'/links/{k}', 1.0, 1.0, look.LINK_COLOUR))
            self._balls.append(add.add_icosphere(f'/links/ball{k}', radius, look.LINK_COLOUR))
        for k, (axis, label) in enumerate(zip(scene.axes, scene.axis_labels)):
            colour = look.SLIDING_COLOUR if axis.slides else look.TURNING_COLOUR
            radius = (0.8 if axis.slides else 1.0) * look.JOINT_RADIUS * size
            length = look.JOINT_LENGTH * size
            barrel = add.add_cylinder(f'/joints/{k}', radius, length, look.JOINT_COLOUR)
            radius, length = look.AXIS_RADIUS * size, look.AXIS_LENGTH * size
            line = add.add_cylinder(f'/axes/{k}', radius, length, colour)
            words = add.add_label(f'/axes/label{k}', label, anchor='bottom-center')
            self._joints.append((barrel, line, words))
        axes = {'axes_length': 0.09 * size, 'axes_radius': 0.0035 * size, 'origin_radius': 0.0}
        self._frames = [add.add_frame(f'/frames/{k}', **axes) for k in range(len(scene.frames))]
        self._tool = add.add_frame(
            '/tool', axes_length=0.13 * size, axes_radius=0.006 * size, origin_radius=0.012 * size
        )
        glass = {'opacity': ELLIPSOID_OPACITY, 'cast_shadow': False}
        self._ellipsoids = {
            'linear': add.add_icosphere('/ellipsoid/linear', 1.0, look.LINEAR_COLOUR, **glass),
            'angular': add.add_icosphere('/ellipsoid/angular', 1.0, look.ANGULAR_COLOUR, **glass),
        }
        head = {
            'shaft_radius': 0.009 * size,
            'head_radius': 0.022 * size,
            'head_length': 0.05 * size,
        }
        self._velocity = add.add_arrows('/arrows/velocity', NOWHERE, look.VELOCITY_COLOUR, **head)
        self._rotation = add.add_arrows('/arrows/rotation', NOWHERE, look.ROTATION_COLOUR, **head)
        self._lost = {
            name: add.add_cylinder(f'/lost/{name}', 1.0, 1.0, look.LOST_COLOUR)
            for name in LOST_RADII
        }
        self._ring = add.add_line_segments(
            '/lost/ring', NOWHERE, look.LOST_COLOUR, thickness=0.012 * size
        )
        self._words = add.add_label('/lost/words', '', anchor='bottom-left')
        self._path = add.add_line_segments(
            '/trail', NOWHERE, look.TRAIL_COLOUR, thickness=0.006 * size
        )

    def clear_trail(self) -> None:
        """Remove all points of the tool's trail."""
        self._trail.clear()

    def draw(self, scene: Scene, shown: Set[str]) -> None:
        """
        Draw a scene, with the groups of objects that are switched on.

        Parameters
        ----------
        scene
            The scene.
        shown
            Names of the visible groups: linear, angular, frames, axes, trail, velocity.
        """
        for link, ball, ends in zip(self._links, self._balls, scene.links):
            self._stretch(link, ends, look.LINK_RADIUS * scene.size, scene.size)
            self._set(ball, position=ends[1])
        for (barrel, line, label), axis in zip(self._joints, scene.axes):
            along = {'position': axis.point, 'wxyz': _wxyz_along(axis.direction)}
            self._set(barrel, **along)
            self._set(line, **along, visible='axes' in shown)
            end = axis.point + axis.direction * (0.5 * look.AXIS_LENGTH * scene.size)
            self._set(label, position=end, visible='axes' in shown)
        for handle, T in zip(self._frames, scene.frames):
            self._set(handle, **_place(T), visible='frames' in shown)
        self._set(self._tool, **_place(scene.tool))
        for name, handle in self._ellipsoids.items():
            self._set(handle, visible=name in shown)
            if name in shown:
                ellipsoid, T = getattr(scene, name), np.array(scene.tool)
                T[:3, :3] = ellipsoid.axes
                radii = scene.drawn_radii(ellipsoid, getattr(scene.scales, name))
                self._set(handle, **_place(T), scale=tuple(radii.tolist()))
        self._draw_lines(self._velocity, scene.velocity, 'velocity' in shown)
        self._draw_lines(self._rotation, scene.rotation, 'velocity' in shown)
        self._draw_lost(scene)
        tool = scene.tool[:3, 3]
        step = TRAIL_STEP * scene.size
        if not self._trail or float(np.linalg.norm(tool - self._trail[-1])) > step:
            self._trail.append(np.array(tool))
        trail = np.array(self._trail)
        self._draw_lines(self._path, np.stack([trail[:-1], trail[1:]], axis=1), 'trail' in shown)

    def _set(self, handle: Any, **values: Any) -> None:
        # Assign only changed values, because viser sends every assigned value.
        for name, value in values.items():
            key = (id(handle), name)
            if key not in self._values or not np.array_equal(self._values[key], value):
                self._values[key] = value
                setattr(handle, name, value)

    def _draw_lines(self, handle: Any, points: Floats | None, shown: bool = True) -> None:
        # Show line segments (2, 3) or (k, 2, 3), m; hide the object if there are no segments.
        if points is None or not len(points) or not shown:
            self._set(handle, visible=False)
        else:
            points = points.reshape(-1, 2, 3).astype(np.float32)
            self._set(handle, visible=True, points=points)

    def _stretch(self, handle: Any, ends: Floats | None, radius: float, size: float) -> None:
        # Show a cylinder between two points; hide it if the points are missing or coincide.
        length = 0.0 if ends is None else float(np.linalg.norm(ends[1] - ends[0]))
        visible = length > look.MIN_ARROW_LENGTH * size
        self._set(handle, visible=visible)
        if ends is not None and visible:
            along = _wxyz_along((ends[1] - ends[0]) / length)
            scale = radius, radius, length
            self._set(handle, position=ends.mean(axis=0), wxyz=along, scale=scale)

    def _draw_lost(self, scene: Scene) -> None:
        lost, size = scene.lost, scene.size
        lines = {name: lost and getattr(lost, name) for name in self._lost}
        for name, ends in lines.items():
            self._stretch(self._lost[name], ends, LOST_RADII[name] * size, size)
        turn = lines['angular']
        self._draw_lines(self._ring, None if turn is None else look.ring(turn, size))
        self._set(self._words, visible=lost is not None)
        if lost is not None:
            ends = turn if lost.linear is None else lost.linear
            at = scene.tool[:3, 3] if ends is None else ends[1]
            self._set(self._words, text=lost.name or lost.words, position=at)


def _wxyz_along(direction: Floats) -> Floats:
    x, y, z, w = look.quaternion_along(direction)
    return np.array([w, x, y, z])


def _place(T: Floats) -> dict[str, Floats]:
    return {'position': T[:3, 3], 'wxyz': viser.transforms.SO3.from_matrix(T[:3, :3]).wxyz}


def _round_length(length: float) -> float:
    # Return the length rounded to 1, 2 or 5 times a power of ten.
    power = 10.0 ** np.floor(np.log10(length))
    return float(min((1, 2, 5, 10), key=lambda k: abs(k * power - length)) * power)
