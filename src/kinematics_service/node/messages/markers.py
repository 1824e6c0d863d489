"""
The arm as markers, for RViz, Foxglove and whatever else draws a MarkerArray.

Each message holds every marker an arm can have, by namespace and id: a marker without a shape now
is deleted, so a reader needs no memory, and nothing flickers.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from ... import kernel
from ...kernel import Floats
from ...robot.measures import Level
from ..drawing import scene as look
from ..drawing.observation import observation_of
from ..drawing.scene import Scene, distance_text, scene_of
from .messages import StateReport, time_message

Colour = tuple[int, int, int]
ELLIPSOID_OPACITY = 0.35
# Sizes of an arrow, as shares of the arm's size: shaft, head, length of the head.
ARROW = (0.018, 0.044, 0.06)
LOST_WIDTH, TEXT_HEIGHT = 0.02, 0.05

# Namespaces, as they stand in a viewer's list.
LINKS, JOINTS, AXES, NAMES = 'links', 'joints', 'axes', 'joint_names'
ELLIPSOID, TWIST, LOST, STATUS = 'ellipsoid', 'twist', 'lost_direction', 'status'


def markers_message(report: StateReport) -> MarkerArray:
    """
    Return links, joints, axes, velocity ellipsoid, twist, lost direction, level and distance.
    """
    # The level is that of the pose alone, without hysteresis: nothing is remembered here.
    seen = observation_of(report.answer.state, report.singularity)
    scene = scene_of(seen)
    maker = _Maker(time_message(report.answer.stamp), report.settings.base_frame)
    _links(maker, scene)
    _axes(maker, scene)
    _ellipsoid(maker, scene)
    _twist(maker, scene)
    _lost(maker, scene)
    # Below the tool: the name of the lost direction is above it.
    at = scene.tool[:3, 3] - [0.0, 0.0, 0.12 * scene.size]
    words = f'{seen.level.name}\ndistance {distance_text(seen)}'
    maker.text(STATUS, at, words, TEXT_HEIGHT * scene.size, look.LEVEL_COLOURS[seen.level])
    return MarkerArray(markers=maker.markers)


class _Maker:
    # Makes markers with the fields that all of them share, and numbers them within their
    # namespace.
    def __init__(self, stamp: Time, frame: str) -> None:
        self.markers: list[Any] = []
        self._stamp, self._frame = stamp, frame
        self._next: dict[str, int] = {}

    def add(self, namespace: str, there: bool) -> Any:
        """Return one more marker: to be drawn, or to be deleted."""
        marker = Marker()
        marker.header.stamp = self._stamp
        marker.header.frame_id = self._frame
        marker.ns = namespace
        marker.id = self._next.get(namespace, 0)
        marker.action = Marker.ADD if there else Marker.DELETE
        marker.pose.orientation.w = 1.0
        self._next[namespace] = marker.id + 1
        self.markers.append(marker)
        return marker

    def shape(self, namespace: str, kind: int, scale: Floats, colour: Colour, alpha: float) -> Any:
        """Return one more solid, its scale (3,) in m; its pose is to be set."""
        marker = self.add(namespace, True)
        marker.type = kind
        _set_vector(marker.scale, scale)
        marker.color = _colour(colour, alpha)
        return marker

    def cylinder(
        self, namespace: str, ends: Floats, radius: float, colour: Colour, shortest: float
    ) -> None:
        """Add a cylinder from end to end (2, 3), or delete it if it is too short."""
        line = ends[1] - ends[0]
        length = math.sqrt(float(line @ line))
        if length < shortest:
            self.add(namespace, False).type = Marker.CYLINDER
            return
        scale = np.array([2.0 * radius, 2.0 * radius, length])
        pose = self.shape(namespace, Marker.CYLINDER, scale, colour, 1.0).pose
        _set_vector(pose.position, 0.5 * (ends[0] + ends[1]))
        _set_quaternion(pose.orientation, look.quaternion_along(line / length))

    def points(
        self,
        namespace: str,
        kind: int,
        points: Floats | None,
        scale: tuple[float, float, float],
        colour: Colour,
    ) -> None:
        """
        Add an arrow or a list of lines through points (k, 3), or delete it if there are none.
        """
        marker = self.add(namespace, points is not None)
        marker.type = kind
        if points is None:
            return
        _set_vector(marker.scale, np.array(scale))
        marker.color = _colour(colour, 1.0)
        marker.points = [Point(x=x, y=y, z=z) for x, y, z in points.tolist()]

    def text(
        self, namespace: str, at: Floats | None, words: str, height: float, colour: Colour
    ) -> None:
        """Add words at a point (3,), or delete them."""
        marker = self.add(namespace, at is not None)
        marker.type = Marker.TEXT_VIEW_FACING
        if at is None:
            return
        _set_vector(marker.pose.position, at)
        marker.scale.z = float(height)
        marker.color = _colour(colour, 1.0)
        marker.text = words


def _links(maker: _Maker, scene: Scene) -> None:
    size = scene.size
    for ends in scene.links:
        radius = look.LINK_RADIUS * size
        maker.cylinder(LINKS, ends, radius, look.LINK_COLOUR, look.SHORTEST * size)


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
    marker = maker.shape(
        ELLIPSOID, Marker.SPHERE, diameters, look.LINEAR_COLOUR, ELLIPSOID_OPACITY
    )
    T = np.eye(4)
    T[:3, :3] = scene.linear.axes
    xyzw = np.empty((1, 4))
    kernel.quaternions(T[None], xyzw)
    _set_vector(marker.pose.position, scene.tool[:3, 3])
    _set_quaternion(marker.pose.orientation, xyzw[0].tolist())


def _twist(maker: _Maker, scene: Scene) -> None:
    shaft, head, length = (share * scene.size for share in ARROW)
    for ends, colour in (
        (scene.velocity, look.VELOCITY_COLOUR),
        (scene.rotation, look.ROTATION_COLOUR),
    ):
        maker.points(TWIST, Marker.ARROW, ends, (shaft, head, length), colour)


def _lost(maker: _Maker, scene: Scene) -> None:
    lost, size = scene.lost, scene.size
    linear = None if lost is None else lost.linear
    angular = None if lost is None else lost.angular
    ring = None if angular is None else look.ring(angular, size).reshape(-1, 3)
    width = LOST_WIDTH * size
    for points, thickness in ((linear, width), (angular, 0.5 * width), (ring, 0.5 * width)):
        maker.points(LOST, Marker.LINE_LIST, points, (thickness, 0.0, 0.0), look.LOST_COLOUR)
    at = None if lost is None else scene.tool[:3, 3] + [0.0, 0.0, 0.12 * size]
    words = '' if lost is None else '\n'.join(filter(None, (lost.name, lost.words)))
    colour = look.LEVEL_COLOURS[Level.ERROR]
    maker.text(LOST, at, words, TEXT_HEIGHT * size, colour)


def _set_quaternion(orientation: Any, xyzw: Sequence[float]) -> None:
    orientation.x, orientation.y, orientation.z, orientation.w = xyzw


def _set_vector(vector: Any, values: Floats) -> None:
    vector.x, vector.y, vector.z = values.tolist()


def _colour(colour: Colour, alpha: float) -> Any:
    r, g, b = colour
    return ColorRGBA(r=r / 255.0, g=g / 255.0, b=b / 255.0, a=alpha)
