# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The arm as markers: what a reader of MarkerArrays that knows nothing of arms draws from them."""

import math
import os
from pathlib import Path

import numpy as np
import pytest
from arms import robot_of

pytest.importorskip('rclpy', reason='needs ROS 2: ros-jazzy-rclpy or a sourced Jazzy')
pytest.importorskip('visualization_msgs', reason='needs visualization_msgs')

from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation.estimator import EstimatorOutput
from kinematics_service.node.drawing.scene import RING_RADIUS, RING_SIDES, ring
from kinematics_service.node.messages.markers import markers_message
from kinematics_service.node.messages.messages import StateReport
from kinematics_service.node.parameters.settings import defaults, settings_from

STAMP = 12_345_678_901
# Turning, sliding and coupled joints, seven of them, and loops that are closed together.
DRAWN = ('craig_3r', 'rrp_elementary', 'parallelogram_left', 'panda', 'flexpicker')
# Markers are drawn from double precision numbers; colours are single precision.
CLOSE = 1e-9


def report_of(robot, q, qdot=None):
    state = ks.evaluate(robot, q, qdot, depth=kernel.ALL_FRAMES)
    answer = EstimatorOutput(state, STAMP, 'message')
    return StateReport(answer, settings_from(defaults(robot), robot))


def over_the_wire(message):
    return deserialize_message(serialize_message(message), type(message))


class Reader:
    """
    What RViz does with marker arrays: keeps markers by namespace and id, and makes points of them.
    """

    def __init__(self):
        self.markers = {}

    def take(self, array):
        seen = set()
        for marker in array.markers:
            key = (marker.ns, marker.id)
            assert key not in seen, f'{key} twice in an array'
            seen.add(key)
            if marker.action == Marker.DELETE:
                self.markers.pop(key, None)
            elif marker.action == Marker.DELETEALL:
                self.markers.clear()
            else:
                self.markers[key] = marker

    def of(self, namespace):
        return [marker for (ns, _), marker in sorted(self.markers.items()) if ns == namespace]


def transform(marker):
    p, o = marker.pose.position, marker.pose.orientation
    x, y, z, w = o.x, o.y, o.z, o.w
    assert math.hypot(x, y, z, w) == pytest.approx(1.0)
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    return R, np.array([p.x, p.y, p.z])


def scale(marker):
    return np.array([marker.scale.x, marker.scale.y, marker.scale.z])


def ends(marker):
    # A cylinder's: its height is along z.
    R, p = transform(marker)
    half = 0.5 * marker.scale.z * R[:, 2]
    return np.stack([p - half, p + half])


def points(marker):
    return np.array([[p.x, p.y, p.z] for p in marker.points])


def read(robot, q, qdot=None):
    reader = Reader()
    reader.take(over_the_wire(markers_message(report_of(robot, q, qdot))))
    return reader


def pose_of(robot):
    low = np.where(np.isfinite(robot.limits[:, 0]), robot.limits[:, 0], -1.0)
    high = np.where(np.isfinite(robot.limits[:, 1]), robot.limits[:, 1], 1.0)
    return low + (high - low) * (0.3 + 0.3 * np.linspace(0.0, 1.0, robot.dof))


@pytest.mark.parametrize('name', DRAWN)
def test_the_links_drawn_lead_from_the_base_to_the_tool(name):
    robot = robot_of(name)
    q = pose_of(robot)
    lines = [ends(marker) for marker in read(robot, q).of('links')]
    tool = ks.forward_kinematics(robot, q)[:3, 3]
    # Links of no length are not drawn.
    near = 1e-3 * robot.singularity.task.reach + CLOSE
    breaks = [k for k, (p, q) in enumerate(zip(lines, lines[1:])) if apart(p[1], q[0]) > near]
    arm, loops = lines, []
    if robot.chain.loops:  # their links come behind those that lead to the tool
        last = next(k for k, line in enumerate(lines) if apart(line[1], tool) < CLOSE)
        arm, loops = lines[: last + 1], lines[last + 1 :]
        assert loops
    assert arm[0][0] == pytest.approx(np.zeros(3), abs=CLOSE)
    assert arm[-1][1] == pytest.approx(tool, abs=CLOSE)
    assert not [k for k in breaks if k + 1 < len(arm)]
    for k, line in enumerate(loops, len(arm)):
        others = [point for one in (*lines[:k], *lines[k + 1 :]) for point in one]
        assert min(apart(line[0], point) for point in others) < near, k


def apart(p, q):
    return float(np.linalg.norm(np.subtract(p, q)))


@pytest.mark.parametrize('name', DRAWN)
def test_the_ellipsoid_drawn_is_that_of_the_jacobian(name):
    robot = robot_of(name)
    q = pose_of(robot)
    (marker,) = read(robot, q).of('ellipsoid')
    R, centre = transform(marker)
    assert centre == pytest.approx(ks.forward_kinematics(robot, q)[:3, 3], abs=CLOSE)
    J = ks.jacobian(robot, q)[:3]
    sigma = np.zeros(3)
    sigma[: min(3, robot.dof)] = np.linalg.svd(J, compute_uv=False)[:3]
    radii = 0.5 * scale(marker)
    drawn = sigma > 0.05 * sigma[0]
    factor = radii[0] / sigma[0]
    assert radii[drawn] == pytest.approx(factor * sigma[drawn])
    matrix = R.T @ (J @ J.T) @ R
    assert matrix == pytest.approx(np.diag(np.diag(matrix)), abs=1e-9)


def test_the_level_is_written_below_the_tool():
    robot, q = robot_of('puma560'), pose_of(robot_of('puma560'))
    (marker,) = read(robot, q).of('status')
    x, y, z = transform(marker)[1] - ks.forward_kinematics(robot, q)[:3, 3]
    assert (x, y) == pytest.approx((0.0, 0.0), abs=CLOSE)
    assert z < -marker.scale.z  # the text is centred, and does not cover the tool


def test_every_marker_can_be_drawn_by_rviz():
    # RViz refuses zero scales, colours that cannot be seen, and quaternions of zero length.
    for name in DRAWN:
        robot = robot_of(name)
        other = np.zeros(robot.dof) if not robot.chain.loops else pose_of(robot)
        for q in (pose_of(robot), other):
            array = over_the_wire(markers_message(report_of(robot, q, np.full(robot.dof, 0.3))))
            for marker in array.markers:
                assert marker.header.frame_id == robot.base_frame
                assert marker.header.stamp.sec * 10**9 + marker.header.stamp.nanosec == STAMP
                if marker.action != Marker.ADD:
                    continue
                assert 0.2 < marker.color.a <= 1.0
                transform(marker)
                used = {
                    Marker.CYLINDER: 'xyz',
                    Marker.SPHERE: 'xyz',
                    Marker.ARROW: 'xyz',
                    Marker.LINE_LIST: 'x',
                    Marker.TEXT_VIEW_FACING: 'z',
                }[marker.type]
                assert all(getattr(marker.scale, axis) > 0.0 for axis in used), (name, marker)
                if marker.type == Marker.ARROW:
                    assert len(marker.points) == 2
                if marker.type == Marker.LINE_LIST:
                    assert len(marker.points) % 2 == 0


def test_markers_keep_their_ids_and_what_vanishes_is_deleted():
    robot = ks.load_robot('puma560')
    regular = np.array([0.3, -0.5, 0.4, 0.5, 0.9, 0.2])
    singular = regular.copy()
    singular[4] = 0.0  # wrist
    reader = Reader()
    keys = []
    for q, qdot in ((regular, None), (singular, np.full(6, 0.1)), (regular, None)):
        array = over_the_wire(markers_message(report_of(robot, q, qdot)))
        keys.append([(marker.ns, marker.id, marker.type) for marker in array.markers])
        reader.take(array)
        there = bool(reader.of('lost_direction'))
        assert there == (q is singular)
        assert bool(reader.of('twist')) == (qdot is not None)
        (status,) = (marker.text for marker in reader.of('status'))
        level, distance = status.split('\n')
        assert level == ks.singularity(robot, q).level.name
        expected = ks.singularity(robot, q).distance
        assert distance.startswith(f'distance {expected:.3f} rad')
        if there:
            (words,) = [m.text for m in reader.of('lost_direction') if m.text]
            assert words.startswith('wrist')
    assert keys[0] == keys[1] == keys[2]


def test_the_lost_rotation_of_a_wrist_is_drawn_square_to_both_axes():
    robot = ks.load_robot('puma560')
    q = np.array([0.3, -0.5, 0.4, 0.5, 0.0, 0.2])
    J = ks.jacobian(robot, q)
    reader = read(robot, q)
    axis = [points(m) for m in reader.of('lost_direction') if len(m.points) == 2][-1]
    line = (axis[1] - axis[0]) / np.linalg.norm(axis[1] - axis[0])
    # The wrist's joints 4 to 6 turn about two axes only: the third is lost.
    assert line @ J[3:, 3:] == pytest.approx(0.0, abs=1e-6)


def test_the_twist_arrows_show_the_twist():
    robot = ks.load_robot('ur5e')
    q, qdot = pose_of(robot), np.full(6, 0.1)
    velocity, rotation = (points(marker) for marker in read(robot, q, qdot).of('twist'))
    twist = ks.twist(robot, q, qdot)
    tool = ks.forward_kinematics(robot, q)[:3, 3]
    for arrow, vector in ((velocity, twist[:3]), (rotation, twist[3:])):
        assert arrow[0] == pytest.approx(tool)
        along = (arrow[1] - arrow[0]) / np.linalg.norm(arrow[1] - arrow[0])
        assert along == pytest.approx(vector / np.linalg.norm(vector))


def test_names_of_frames_follow_the_settings():
    robot = ks.load_robot('planar_2r')
    report = report_of(robot, [0.1, 0.2])
    settings = settings_from(defaults(robot) | {'frame_prefix': 'left_'}, robot)
    array = markers_message(report._replace(settings=settings))
    assert {marker.header.frame_id for marker in array.markers} == {'left_base_link'}


def draw(reader, axes):
    """Draw markers with matplotlib, each as its message says."""
    turn = np.linspace(0.0, 2.0 * np.pi, 25)
    for marker in reader.markers.values():
        colour = (marker.color.r, marker.color.g, marker.color.b, marker.color.a)
        if marker.type == Marker.CYLINDER:
            R, p = transform(marker)
            rim = np.stack([np.cos(turn), np.sin(turn)]) * 0.5
            height = np.array([[-0.5], [0.5]])
            local = np.stack(
                [
                    np.broadcast_to(rim[0], (2, 25)) * marker.scale.x,
                    np.broadcast_to(rim[1], (2, 25)) * marker.scale.y,
                    np.broadcast_to(height, (2, 25)) * marker.scale.z,
                ]
            )
            x, y, z = np.einsum('ij,jkl->ikl', R, local) + p[:, None, None]
            axes.plot_surface(x, y, z, color=colour)
        elif marker.type == Marker.SPHERE:
            R, p = transform(marker)
            polar = np.linspace(0.0, np.pi, 13)[:, None]
            local = np.stack(
                [
                    np.sin(polar) * np.cos(turn) * 0.5 * marker.scale.x,
                    np.sin(polar) * np.sin(turn) * 0.5 * marker.scale.y,
                    np.cos(polar) * np.ones_like(turn) * 0.5 * marker.scale.z,
                ]
            )
            x, y, z = np.einsum('ij,jkl->ikl', R, local) + p[:, None, None]
            axes.plot_surface(x, y, z, color=colour)
        elif marker.type == Marker.ARROW:
            start, end = points(marker)
            axes.quiver(*start, *(end - start), color=colour, linewidth=3)
        elif marker.type == Marker.LINE_LIST:
            for pair in points(marker).reshape(-1, 2, 3):
                axes.plot(*pair.T, color=colour, linewidth=3)
        elif marker.type == Marker.TEXT_VIEW_FACING:
            p = marker.pose.position
            axes.text(p.x, p.y, p.z, marker.text, color=colour, fontsize=8)
    axes.set_box_aspect(
        [np.ptp(axis.get_view_interval()) for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
    )
    axes.set_xlabel('x (m)')
    axes.set_ylabel('y (m)')
    axes.set_zlabel('z (m)')


def test_a_reader_draws_a_picture(tmp_path):
    pytest.importorskip('matplotlib', reason='needs matplotlib')
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    folder = Path(os.environ.get('KINEMATICS_SCREENSHOTS', tmp_path))
    folder.mkdir(parents=True, exist_ok=True)
    robot = ks.load_robot('puma560')
    figure = Figure(figsize=(13, 6.5))
    FigureCanvasAgg(figure)
    for k, (title, wrist) in enumerate((('regular', 0.9), ('wrist singular', 0.0))):
        axes = figure.add_subplot(1, 2, k + 1, projection='3d', title=f'puma560, {title}')
        q = np.array([0.3, -0.5, 0.4, 0.5, wrist, 0.2])
        draw(read(robot, q, np.array([0.2, 0.1, -0.2, 0.0, 0.3, 0.0])), axes)
    picture = folder / 'markers.png'
    figure.savefig(picture, dpi=80)
    assert picture.stat().st_size > 10_000


def test_a_ring_is_a_circle_normal_to_its_line():
    ends, size = np.array([[0.1, 0.2, 0.3], [0.5, -0.2, 0.9]]), 2.0
    segments = ring(ends, size)
    assert segments.shape == (RING_SIDES, 2, 3)
    np.testing.assert_array_equal(segments[1:, 0], segments[:-1, 1])
    spokes = segments.reshape(-1, 3) - ends.mean(axis=0)
    np.testing.assert_allclose(spokes @ (ends[1] - ends[0]), 0.0, rtol=0, atol=CLOSE)
    np.testing.assert_allclose(np.linalg.norm(spokes, axis=1), RING_RADIUS * size, rtol=CLOSE)
    np.testing.assert_allclose(segments[0, 0], segments[-1, 1], rtol=0, atol=CLOSE)
