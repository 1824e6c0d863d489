"""A scene drawn with viser: every object is made once, and only what has changed is sent again."""

from collections import deque
from typing import Any

import numpy as np
import viser

from .... import kernel
from ....kernel import Floats
from ....node.drawing import scene as look
from ....node.drawing.ellipsoids import Ellipsoid
from ....node.drawing.scene import Scene

# Number of points of the trail, and their distance as a share of the arm's size.
TRAIL_POINTS, TRAIL_STEP = 300, 0.004
ELLIPSOID_OPACITY = 0.3
# Radii of the lines along lost motions, as shares of the size.
LOST_RADII = {'linear': 0.012, 'angular': 0.007}
NOWHERE = np.zeros((1, 2, 3), dtype=np.float32)


class Drawing:
    """
    The objects of one arm in a viser server.

    Parameters
    ----------
    server
        Where to draw.
    scene
        The first picture; later ones have as many links, frames and axes.

    Attributes
    ----------
    shown
        The groups that are switched on: linear, angular, frames, axes, trail, velocity.
    """

    def __init__(self, server: viser.ViserServer, scene: Scene) -> None:
        size = scene.size
        self.shown = {
            'linear': True,
            'angular': False,
            'frames': True,
            'axes': True,
            'trail': True,
            'velocity': True,
        }
        self._trail: deque[Floats] = deque(maxlen=TRAIL_POINTS)
        self._values: dict[tuple[int, str], Any] = {}
        add = server.scene
        add.add_grid(
            '/grid', 4 * size, 4 * size, cell_size=_round_length(size / 10), section_size=0
        )
        add.add_frame('/base', axes_length=0.16 * size, axes_radius=0.006 * size)
        self._links = [
            add.add_cylinder(f'/links/{k}', 1.0, 1.0, look.LINK_COLOUR)
            for k in range(len(scene.links))
        ]
        self._balls = [
            add.add_icosphere(f'/links/ball{k}', look.LINK_RADIUS * size, look.LINK_COLOUR)
            for k in range(len(scene.links))
        ]
        self._barrels, self._axes, self._labels = [], [], []
        for k, (axis, label) in enumerate(zip(scene.axes, scene.axis_labels)):
            colour = look.SLIDING_COLOUR if axis.slides else look.TURNING_COLOUR
            self._barrels.append(
                add.add_cylinder(
                    f'/joints/{k}',
                    (0.8 if axis.slides else 1.0) * look.JOINT_RADIUS * size,
                    look.JOINT_LENGTH * size,
                    look.JOINT_COLOUR,
                )
            )
            self._axes.append(
                add.add_cylinder(
                    f'/axes/{k}', look.AXIS_RADIUS * size, look.AXIS_LENGTH * size, colour
                )
            )
            self._labels.append(add.add_label(f'/axes/label{k}', label, anchor='bottom-center'))
        self._frames = [
            add.add_frame(
                f'/frames/{k}',
                axes_length=0.09 * size,
                axes_radius=0.0035 * size,
                origin_radius=0.0,
            )
            for k in range(len(scene.frames))
        ]
        self._tool = add.add_frame(
            '/tool', axes_length=0.13 * size, axes_radius=0.006 * size, origin_radius=0.012 * size
        )
        self._ellipsoids = {
            name: add.add_icosphere(
                f'/ellipsoid/{name}', 1.0, colour, opacity=ELLIPSOID_OPACITY, cast_shadow=False
            )
            for name, colour in (
                ('linear', look.LINEAR_COLOUR),
                ('angular', look.ANGULAR_COLOUR),
            )
        }
        head = {
            'shaft_radius': 0.009 * size,
            'head_radius': 0.022 * size,
            'head_length': 0.05 * size,
        }
        self._arrows = {
            name: add.add_arrows(f'/arrows/{name}', NOWHERE, colour, **head)
            for name, colour in (
                ('velocity', look.VELOCITY_COLOUR),
                ('rotation', look.ROTATION_COLOUR),
            )
        }
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
        """Forget the tool's path."""
        self._trail.clear()

    def draw(self, scene: Scene) -> None:
        """Show a scene."""
        shown = self.shown
        for link, ball, ends in zip(self._links, self._balls, scene.links):
            self._stretch(link, ends, look.LINK_RADIUS * scene.size, scene.size)
            self._set(ball, 'position', ends[1])
        for barrel, line, label, axis in zip(self._barrels, self._axes, self._labels, scene.axes):
            wxyz = _wxyz_along(axis.direction)
            for handle in (barrel, line):
                self._set(handle, 'position', axis.point)
                self._set(handle, 'wxyz', wxyz)
            end = axis.point + axis.direction * (0.5 * look.AXIS_LENGTH * scene.size)
            self._set(label, 'position', end)
            self._set(line, 'visible', shown['axes'])
            self._set(label, 'visible', shown['axes'])
        for handle, T in zip(self._frames, scene.frames):
            self._place(handle, T)
            self._set(handle, 'visible', shown['frames'])
        self._place(self._tool, scene.tool)
        self._draw_ellipsoid('linear', scene, scene.linear, scene.scales.linear)
        self._draw_ellipsoid('angular', scene, scene.angular, scene.scales.angular)
        self._draw_arrow('velocity', scene.velocity)
        self._draw_arrow('rotation', scene.rotation)
        self._draw_lost(scene)
        self._draw_trail(scene)

    def _set(self, handle: Any, name: str, value: Any) -> None:
        # viser sends every assigned value, even if it has not changed.
        key = (id(handle), name)
        if key in self._values and np.array_equal(self._values[key], value):
            return
        self._values[key] = value
        setattr(handle, name, value)

    def _place(self, handle: Any, T: Floats) -> None:
        self._set(handle, 'position', T[:3, 3])
        self._set(handle, 'wxyz', _wxyz(T))

    def _stretch(self, handle: Any, ends: Floats, radius: float, size: float) -> None:
        length = float(np.linalg.norm(ends[1] - ends[0]))
        visible = length > look.MIN_ARROW_LENGTH * size
        self._set(handle, 'visible', visible)
        if visible:
            self._set(handle, 'position', ends.mean(axis=0))
            self._set(handle, 'wxyz', _wxyz_along((ends[1] - ends[0]) / length))
            self._set(handle, 'scale', (radius, radius, length))

    def _draw_ellipsoid(self, name: str, scene: Scene, ellipsoid: Ellipsoid, scale: float) -> None:
        handle = self._ellipsoids[name]
        self._set(handle, 'visible', self.shown[name])
        if self.shown[name]:
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = ellipsoid.axes, scene.tool[:3, 3]
            self._place(handle, T)
            radii = scene.drawn_radii(ellipsoid, scale)
            self._set(handle, 'scale', tuple(radii.tolist()))

    def _draw_arrow(self, name: str, ends: Floats | None) -> None:
        handle = self._arrows[name]
        visible = ends is not None and self.shown['velocity']
        self._set(handle, 'visible', visible)
        if visible and ends is not None:
            self._set(handle, 'points', ends[None].astype(np.float32))

    def _draw_lost(self, scene: Scene) -> None:
        lost, size = scene.lost, scene.size
        lines = {'linear': lost and lost.linear, 'angular': lost and lost.angular}
        for name, ends in lines.items():
            handle = self._lost[name]
            self._set(handle, 'visible', ends is not None)
            if ends is not None:
                self._stretch(handle, ends, LOST_RADII[name] * size, size)
        self._set(self._ring, 'visible', lines['angular'] is not None)
        if lines['angular'] is not None:
            self._set(self._ring, 'points', look.ring(lines['angular'], size).astype(np.float32))
        self._set(self._words, 'visible', lost is not None)
        if lost is not None:
            ends = lost.linear if lost.linear is not None else lost.angular
            self._set(self._words, 'text', lost.name or lost.words)
            self._set(self._words, 'position', scene.tool[:3, 3] if ends is None else ends[1])

    def _draw_trail(self, scene: Scene) -> None:
        tool = scene.tool[:3, 3]
        step = TRAIL_STEP * scene.size
        if not self._trail or float(np.linalg.norm(tool - self._trail[-1])) > step:
            self._trail.append(np.array(tool))
        visible = self.shown['trail'] and len(self._trail) > 1
        self._set(self._path, 'visible', visible)
        if visible:
            points = np.array(self._trail, dtype=np.float32)
            self._set(self._path, 'points', np.stack([points[:-1], points[1:]], axis=1))


def _wxyz_along(direction: Floats) -> Floats:
    x, y, z, w = look.quaternion_along(direction)
    return np.array([w, x, y, z])


def _wxyz(T: Floats) -> Floats:
    xyzw = np.empty((1, 4))
    kernel.quaternions(np.ascontiguousarray(T)[None], xyzw)
    return xyzw[0, [3, 0, 1, 2]]


def _round_length(length: float) -> float:
    # 1, 2 or 5 times a power of ten.
    power = 10.0 ** np.floor(np.log10(length))
    return float(min((1, 2, 5, 10), key=lambda k: abs(k * power - length)) * power)
