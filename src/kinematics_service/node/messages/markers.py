# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Make a MarkerArray of the arm, for viewers such as RViz and Foxglove.

Each message has every marker of an arm, by namespace and id. A marker that has no shape at present
is marked as deleted. So a viewer needs no earlier message, and the picture does not flicker.
"""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Quaternion, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from ... import kernel
from ...kernel import Floats
from ..drawing import scene as look
from ..drawing.observation import observation_of
from ..drawing.scene import LostDirection, Scene, distance_text, scene_of
from .messages import StateReport, time_message

Colour = tuple[int, int, int]
# Opacity of the velocity ellipsoid, 1 for opaque.
ELLIPSOID_OPACITY = 0.35
# Diameters of shaft and head of an arrow, and length of the head, divided by the arm's size.
ARROW_SIZES = (0.018, 0.044, 0.06)
# Width of the line along the direction in which the tool cannot move at a singular pose, divided
# by the arm's size.
LOST_LINE_WIDTH = 0.02
# Height of texts, divided by the arm's size.
TEXT_HEIGHT = 0.05

# Namespaces of the markers, which viewers list.
LINKS, JOINTS, AXES, NAMES = 'links', 'joints', 'axes', 'joint_names'
ELLIPSOID, TWIST, LOST, STATUS = 'ellipsoid', 'twist', 'lost_direction', 'status'


def markers_message(report: StateReport) -> MarkerArray:
    """
    Return the markers of an arm: links, joints, axes, ellipsoid, twist, null direction and texts.
    """
    # Compute the singularity level without hysteresis, because markers keep no memory of the last
    # level.
    seen = observation_of(report.answer.state, report.singularity)
    scene = scene_of(seen)
    maker = _Maker(time_message(report.answer.stamp), report.settings.base_frame)
    _links(maker, scene)
    _axes(maker, scene)
    _ellipsoid(maker, scene)
    _twist(maker, scene)
    _lost(maker, scene)
    # Write this text below the tool, because the text about the null direction is above the tool.
    at = scene.tool[:3, 3] - [0.0, 0.0, 0.12 * scene.size]
    words = f'{seen.level.name}\ndistance {distance_text(seen)}'
    maker.text(STATUS, at, words, TEXT_HEIGHT * scene.size, look.LEVEL_COLOURS[seen.level])
    return MarkerArray(markers=maker.markers)


class _Maker:
    # Makes markers with the fields that all markers have, and numbers the markers of each
    # namespace.
    def __init__(self, stamp: Time, frame: str) -> None:
        self.markers: list[Marker] = []
        self._header = Header(stamp=stamp, frame_id=frame)
        self._next: Counter[str] = Counter()

    def add(
        self, namespace: str, kind: int, visible: bool, colour: Colour, alpha: float = 1.0
    ) -> Marker:
        """
        Append a marker that draws a shape if `visible` is true, or else deletes the shape. The
        caller sets the size of the shape.
        """
        r, g, b = colour
        marker = Marker(
            header=self._header,
            ns=namespace,
            id=self._next[namespace],
            type=kind,
            action=Marker.ADD if visible else Marker.DELETE,
            color=ColorRGBA(r=r / 255.0, g=g / 255.0, b=b / 255.0, a=alpha),
        )
        marker.pose.orientation.w = 1.0
        self._next[namespace] += 1
        self.markers.append(marker)
        return marker

    def cylinder(
        self, namespace: str, ends: Floats, radius: float, colour: Colour, shortest: float
    ) -> None:
        """
        Append a cylinder between two ends (2, 3), m. A cylinder that is shorter than `shortest`
        (m) is marked as deleted.
        """
        line = ends[1] - ends[0]
        length = math.sqrt(float(line @ line))
        marker = self.add(namespace, Marker.CYLINDER, length >= shortest, colour)
        if length >= shortest:
            _set_vector(marker.scale, np.array([2.0 * radius, 2.0 * radius, length]))
            _set_vector(marker.pose.position, 0.5 * (ends[0] + ends[1]))
            _set_quaternion(marker.pose.orientation, look.quaternion_along(line / length))

    def points(
        self,
        namespace: str,
        kind: int,
        points: Floats | None,
        scale: tuple[float, float, float],
        colour: Colour,
    ) -> None:
        """
        Append an arrow or a list of lines through points (k, 3), m. If `points` is None, the
        marker is marked as deleted.
        """
        marker = self.add(namespace, kind, points is not None, colour)
        if points is not None:
            _set_vector(marker.scale, np.array(scale))
            marker.points = [Point(x=x, y=y, z=z) for x, y, z in points.tolist()]

    def text(
        self, namespace: str, at: Floats | None, words: str, height: float, colour: Colour
    ) -> None:
        """Append a text at the point `at`, (3,), m. If `at` is None, the text is deleted."""
        marker = self.add(namespace, Marker.TEXT_VIEW_FACING, at is not None, colour)
        if at is not None:
            _set_vector(marker.pose.position, at)
            marker.scale.z = float(height)
            marker.text = words


def _links(maker: _Maker, scene: Scene) -> None:
    size = scene.size
    for ends in scene.links:
        radius = look.LINK_RADIUS * size
        maker.cylinder(LINKS, ends, radius, look.LINK_COLOUR, look.MIN_ARROW_LENGTH * size)


def _axes(maker: _Maker, scene: Scene) -> None:
    size = scene.size
    for axis, label in zip(scene.axes, scene.axis_labels):
        colour = look.SLIDING_COLOUR if axis.slides else look.TURNING_COLOUR
        for namespace, radius, length, shade in (
            (JOINTS, look.JOINT_RADIUS, look.JOINT_LENGTH, look.JOINT_COLOUR),
            (AXES, look.AXIS_RADIUS, look.AXIS_LENGTH, colour),
        ):
            half = 0.5 * length * size * axis.direction
            ends = np.stack([axis.point - half, axis.point + half])
            maker.cylinder(namespace, ends, radius * size, shade, 0.0)
        end = axis.point + 0.55 * look.AXIS_LENGTH * size * axis.direction
        maker.text(NAMES, end, label, TEXT_HEIGHT * size, look.JOINT_COLOUR)


def _ellipsoid(maker: _Maker, scene: Scene) -> None:
    diameters = 2.0 * scene.drawn_radii(scene.linear, scene.scales.linear)
    marker = maker.add(ELLIPSOID, Marker.SPHERE, True, look.LINEAR_COLOUR, ELLIPSOID_OPACITY)
    _set_vector(marker.scale, diameters)
    T = np.eye(4)
    T[:3, :3] = scene.linear.axes
    xyzw = np.empty((1, 4))
    kernel.quaternions(T[None], xyzw)
    _set_vector(marker.pose.position, scene.tool[:3, 3])
    _set_quaternion(marker.pose.orientation, xyzw[0].tolist())


def _twist(maker: _Maker, scene: Scene) -> None:
    shaft, head, length = (ratio * scene.size for ratio in ARROW_SIZES)
    sizes = shaft, head, length
    maker.points(TWIST, Marker.ARROW, scene.velocity, sizes, look.VELOCITY_COLOUR)
    maker.points(TWIST, Marker.ARROW, scene.rotation, sizes, look.ROTATION_COLOUR)


def _lost(maker: _Maker, scene: Scene) -> None:
    lost, size = scene.lost or LostDirection(None, None, '', ''), scene.size
    ring = None if lost.angular is None else look.ring(lost.angular, size).reshape(-1, 3)
    width = LOST_LINE_WIDTH * size
    for points, scale in ((lost.linear, 1.0), (lost.angular, 0.5), (ring, 0.5)):
        maker.points(LOST, Marker.LINE_LIST, points, (scale * width, 0.0, 0.0), look.LOST_COLOUR)
    at = scene.tool[:3, 3] + [0.0, 0.0, 0.12 * size] if scene.lost else None
    words = '\n'.join(filter(None, (lost.name, lost.words)))
    maker.text(LOST, at, words, TEXT_HEIGHT * size, look.LOST_COLOUR)


def _set_quaternion(orientation: Quaternion, xyzw: Sequence[float]) -> None:
    orientation.x, orientation.y, orientation.z, orientation.w = xyzw


def _set_vector(vector: Point | Vector3, values: Floats) -> None:
    vector.x, vector.y, vector.z = values.tolist()
