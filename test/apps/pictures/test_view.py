# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
What the live view shows, without a browser: the picture as data, the panel's words, its address.
"""

import json
import math
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from arms import DISTINCT_BUNDLED, DISTINCT_MACHINES, robot_of
from folders import CONFIG
from refusal import refused
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.pictures.view.computed import observe
from kinematics_service.apps.pictures.view.gauges import gauges_of, headline, joint_readings
from kinematics_service.apps.pictures.view.panel import (
    facts_html,
    gauges_html,
    jacobian_html,
    joints_html,
)
from kinematics_service.kinematics.loop_links import carried_rows
from kinematics_service.kinematics.singular_poses import singular_poses
from kinematics_service.node.drawing.axes import axes_of
from kinematics_service.node.drawing.ellipsoids import ellipsoid_of, ellipsoid_scales
from kinematics_service.node.drawing.scene import (
    LEVEL_COLOURS,
    MAX_ARROW_LENGTH,
    VELOCITY_ARROW_TIME,
    quaternion_along,
    ring,
    scene_of,
    short_names,
    size_of,
)
from kinematics_service.robot.measures import Level

RANDOM = np.random.default_rng(11)
# Differences of two poses with this step (rad or m) know a direction to about its square root.
STEP, COARSE = 1e-6, 1e-5


def pose_of(robot, share=0.3):
    low = np.where(np.isfinite(robot.limits[:, 0]), robot.limits[:, 0], -1.0)
    high = np.where(np.isfinite(robot.limits[:, 1]), robot.limits[:, 1], 1.0)
    return low + (high - low) * (share + 0.3 * np.linspace(0.0, 1.0, robot.dof))


def singular_view(name='ur5e'):
    robot = robot_of(name)
    ranges = np.where(np.isfinite(robot.limits), robot.limits, [-math.pi, math.pi])
    q = singular_poses(robot, ranges)[0]
    return observe(robot, q)


@pytest.mark.parametrize('name', DISTINCT_MACHINES)
def test_the_ellipsoid_is_the_image_of_the_unit_ball_of_joint_velocities(name):
    robot = robot_of(name)
    J = ks.jacobian(robot, pose_of(robot))
    rates = RANDOM.normal(size=(500, robot.dof))
    rates /= np.linalg.norm(rates, axis=1, keepdims=True)
    for block in (J[:3], J[3:]):
        ellipsoid = ellipsoid_of(block)
        assert ellipsoid.axes.T @ ellipsoid.axes == pytest.approx(np.eye(3), abs=ROUND_OFF)
        assert np.linalg.det(ellipsoid.axes) == pytest.approx(1.0)
        # Radii from another road: square roots of the eigenvalues of J J^T along the axes.
        matrix = block @ block.T
        assert ellipsoid.axes.T @ matrix @ ellipsoid.axes == pytest.approx(
            np.diag(ellipsoid.radii**2), abs=1e-10
        )
        # Velocities of the unit ball stay inside, and come close to the longest radius.
        inside = rates @ block.T @ ellipsoid.axes
        reach = ellipsoid.radii > 1e-9 * max(ellipsoid.radii[0], 1e-300)
        scaled = inside[:, reach] / ellipsoid.radii[reach]
        assert np.all(np.sum(scaled**2, axis=1) <= 1.0 + 1e-9)
        assert inside[:, ~reach] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize('name', DISTINCT_BUNDLED)
def test_a_joint_turns_the_tool_about_the_axes_drawn_for_it(name):
    robot = robot_of(name)
    q = pose_of(robot)
    seen = observe(robot, q)
    tool = seen.pose[:3, 3]
    alone = [axis for axis in seen.axes if len(axis.joints) == 1]
    coupled = {j for axis in seen.axes if len(axis.joints) > 1 for j in axis.joints}
    for axis in alone:
        (j,) = axis.joints
        if j in coupled:
            continue
        dq = np.zeros(robot.dof)
        dq[j] = STEP
        ahead, behind = ks.forward_kinematics(robot, np.stack([q + dq, q - dq]))
        v = (ahead[:3, 3] - behind[:3, 3]) / (2.0 * STEP)
        R = ahead[:3, :3] @ behind[:3, :3].T
        w = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4.0 * STEP)
        assert np.linalg.norm(axis.direction) == pytest.approx(1.0)
        if axis.slides:
            assert robot.joint_types[j] == 'prismatic'
            assert v == pytest.approx(axis.direction * np.linalg.norm(v), abs=COARSE)
            continue
        assert w == pytest.approx(axis.direction * np.linalg.norm(w), abs=COARSE)
        # A point of the axis stands still: v = w x (tool - point), but for a helical joint.
        if robot.joint_types[j] == 'revolute':
            assert np.cross(w, tool - axis.point) == pytest.approx(v, abs=COARSE)
    assert {j for axis in seen.axes for j in axis.joints} == set(range(robot.dof))


@pytest.mark.parametrize('name', DISTINCT_MACHINES)
def test_axes_are_drawn_beside_the_links(name):
    robot = robot_of(name)
    seen = observe(robot, pose_of(robot))
    origins = np.concatenate([seen.frames[:, :3, 3], seen.loops.reshape(-1, 3)])
    for axis in seen.axes:
        assert np.min(np.linalg.norm(origins - axis.point, axis=1)) < 1e-9


def test_the_coupled_rows_of_a_parallelogram_have_axes_of_their_own():
    robot = ks.load_robot('parallelogram_left')
    axes = [*axes_of(ks.evaluate(robot, [0.3, 0.4, 1.3], depth=2))]
    assert [axis.joints for axis in axes] == [(0,), (1,), (1, 2), (1, 2)]
    y = axes[0].direction
    for axis in axes[1:]:
        assert abs(axis.direction @ y) < ROUND_OFF


@pytest.mark.parametrize('name', DISTINCT_MACHINES)
def test_links_are_a_line_from_the_base_to_the_tool(name):
    robot = robot_of(name)
    q = pose_of(robot)
    seen = observe(robot, q)
    drawn, loops = scene_of(seen).links, len(seen.loops)
    line = drawn[: len(drawn) - loops]
    assert drawn[len(line) :] == pytest.approx(seen.loops)
    assert line[0, 0] == pytest.approx(np.zeros(3))
    assert line[-1, 1] == pytest.approx(ks.forward_kinematics(robot, q)[:3, 3])
    if not any(carried_rows(robot)):
        assert len(line) == robot.rows + 2
        assert line[1:, 0] == pytest.approx(line[:-1, 1])
        assert line[:-1, 1] == pytest.approx(ks.link_frames(robot, q)[:, :3, 3])


def test_the_velocity_arrow_ends_where_the_tool_would_be():
    robot = ks.load_robot('ur5e')
    q, qdot = pose_of(robot), np.full(6, 0.05)
    scene = scene_of(observe(robot, q, qdot))
    v = ks.twist(robot, q, qdot)[:3]
    assert scene.velocity[1] - scene.velocity[0] == pytest.approx(VELOCITY_ARROW_TIME * v)
    fast = scene_of(observe(robot, q, 1e6 * qdot))
    length = np.linalg.norm(fast.velocity[1] - fast.velocity[0])
    assert length == pytest.approx(MAX_ARROW_LENGTH * size_of(robot))
    assert scene_of(observe(robot, q)).velocity is None
    assert scene_of(observe(robot, q, np.zeros(6))).velocity is None


def test_what_is_lost_is_drawn_near_a_singular_pose_only():
    assert scene_of(observe(ks.load_robot('ur5e'), pose_of(ks.load_robot('ur5e')))).lost is None
    seen = singular_view()
    lost = scene_of(seen).lost
    # At a singular pose J has no velocity along the lost direction, whatever the length scale.
    direction = seen.singularity.lost_direction
    scaled = np.concatenate([direction[:3], direction[3:] * seen.robot.singularity.task.length])
    assert scaled @ seen.jacobian == pytest.approx(0.0, abs=1e-5)
    for line, part in ((lost.linear, direction[:3]), (lost.angular, direction[3:])):
        if line is not None:
            assert line.mean(axis=0) == pytest.approx(seen.pose[:3, 3])
            assert np.linalg.norm(np.cross(line[1] - line[0], part)) < 1e-9
    assert lost.words.startswith('lost: ')


def test_the_name_of_the_factor_is_said():
    robot = ks.load_robot('puma560')
    names = robot.singularity.factors.names
    seen = singular_view('puma560')
    assert seen.level == Level.ERROR
    assert headline(seen).startswith('AT A SINGULARITY: ')
    assert headline(seen).removeprefix('AT A SINGULARITY: ') in names
    assert scene_of(seen).lost.name in names


@pytest.mark.slow
@pytest.mark.parametrize('name', DISTINCT_BUNDLED)
def test_every_robot_can_be_seen_everywhere(name):
    robot = robot_of(name)
    poses = [pose_of(robot), np.zeros(robot.dof), np.full(robot.dof, 0.5)]
    for q in poses:
        for qdot in (None, np.full(robot.dof, 0.2)):
            seen = observe(robot, q, qdot)
            scene = scene_of(seen)
            radii = scene.drawn_radii(scene.linear, scene.scales.linear)
            assert np.all(radii > 0.0)
            assert np.all(radii < 3.0 * scene.size)
            for gauge in gauges_of(seen):
                assert 0.0 <= gauge.fraction <= 1.0
                assert all(0.0 <= place <= 1.0 for place, _ in gauge.marks)
            text = gauges_html(seen, 'y', 'x') + facts_html(seen, scene) + joints_html(seen)
            assert not re.search(r'\b(nan|inf)\b', text)


def test_scales_do_not_change_while_the_arm_moves():
    robot = ks.load_robot('ur5e')
    assert ellipsoid_scales(robot, 1.0) is ellipsoid_scales(robot, 1.0)


@pytest.mark.parametrize('direction', [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.6, -0.48, 0.64)])
def test_the_quaternion_along_a_direction_turns_z_into_it(direction):
    x, y, z, w = quaternion_along(np.array(direction, dtype=float))
    turned = (2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y))
    assert turned == pytest.approx(direction, abs=ROUND_OFF)
    assert math.hypot(x, y, z, w) == pytest.approx(1.0)


def test_a_ring_is_round_and_square_to_its_axis():
    ends = np.array([[1.0, 2.0, 3.0], [1.5, 1.0, 3.2]])
    points = ring(ends, 2.0)
    spokes = points[:, 0] - ends.mean(axis=0)
    assert spokes @ (ends[1] - ends[0]) == pytest.approx(0.0, abs=1e-12)
    assert np.ptp(np.linalg.norm(spokes, axis=1)) < 1e-12
    assert points[-1, 1] == pytest.approx(points[0, 0])


# Gauges


def test_the_time_gauge_counts_down_towards_a_singular_pose():
    robot = ks.load_robot('planar_2r')
    # det = L1 L2 sin q2: at q2 = 1, falling by 0.5 rad/s, it is some two seconds to q2 = 0.1.
    gauges = {g.name: g for g in gauges_of(observe(robot, [0.0, 0.6], [0.0, -0.1]))}
    assert re.fullmatch(r'\d\.\d s at this velocity', gauges['time'].text)
    seconds = float(gauges['time'].text.split()[0])
    assert 3.0 < seconds < 7.0
    away = {g.name: g for g in gauges_of(observe(robot, [0.0, 0.6], [0.0, 0.1]))}
    assert away['time'].text == 'not approaching'
    still = {g.name: g for g in gauges_of(observe(robot, [0.0, 0.6]))}
    assert still['time'].text == 'unknown: no velocity'
    there = {g.name: g for g in gauges_of(observe(robot, [0.0, 0.01], [0.0, 0.1]))}
    assert there['time'].text == 'beyond it already'
    assert there['measure'].level == Level.ERROR


def test_the_gauge_of_a_command_that_is_stopped_is_empty():
    seen = observe(ks.load_robot('planar_2r'), [0.0, 0.6])
    seen = replace(seen, scale=(0.0, 'singularity', Level.ERROR))
    gauge = gauges_of(seen)[-1]
    assert (gauge.name, gauge.text, gauge.fraction) == ('scale', '0.00: singularity', 0.0)


def test_a_gauge_of_what_was_not_found_says_that_it_is_farther():
    robot = ks.load_robot('planar_2r')
    seen = observe(robot, [0.0, 1.4])
    seen = replace(seen, singularity=replace(seen.singularity, distance=1.0))
    gauge = gauges_of(seen)[0]
    assert (gauge.text.split(' (')[0], gauge.fraction) == ('none found within 1 rad', 1.0)
    near = gauges_of(observe(robot, [0.0, 0.15]))[0]
    assert near.text == '0.150 rad = 8.6°'


def test_a_condition_number_fills_its_gauge_the_other_way_round():
    text = (CONFIG / 'ur5e.yaml').read_text(encoding='utf-8')
    robot = ks.robot_from_text(
        text.replace('singularity:', 'singularity:\n  measure: condition_number')
    )
    good = gauges_of(observe(robot, pose_of(robot)))
    assert [gauge.name for gauge in good] == ['measure', 'distance', 'time']
    marks = [place for place, _ in good[0].marks]
    assert marks[0] < marks[1]  # ERROR is further left than WARN


def test_limits_are_told_in_words():
    robot = ks.load_robot('puma560')
    low, high = robot.limits[0]
    q = np.zeros(6)
    for value, remark in (
        (low + 0.01, 'near lower limit'),
        (high - 0.01, 'near upper limit'),
        (high + 0.01, 'beyond upper limit'),
        (0.5 * (low + high), ''),
    ):
        q[0] = value
        assert joint_readings(observe(robot, q))[0].remark == remark


# The panel


class Cells(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.rows, self._cell, self.tags = [], None, []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        if tag == 'tr':
            self.rows.append([])
        if tag in ('td', 'th'):
            self.rows[-1].append('')
            self._cell = True

    def handle_endtag(self, tag):
        if tag in ('td', 'th'):
            self._cell = None

    def handle_data(self, data):
        if self._cell:
            self.rows[-1][-1] += data


def test_the_jacobian_is_a_labelled_table():
    robot = ks.load_robot('ur5e')
    seen = observe(robot, pose_of(robot))
    head, *rows = Cells(jacobian_html(seen)).rows
    assert head == ['', 'shoulder_pan', 'shoulder_lift', 'elbow', 'wrist_1', 'wrist_2', 'wrist_3']
    assert [row[0] for row in rows] == ['vx', 'vy', 'vz', 'wx', 'wy', 'wz']
    shown = [[float(cell.replace('\N{MINUS SIGN}', '-')) for cell in row[1:]] for row in rows]
    assert shown == pytest.approx(ks.jacobian(robot, seen.q), abs=5.1e-4)


def test_names_from_a_robot_file_cannot_become_markup():
    text = (CONFIG / 'planar_2r.yaml').read_text(encoding='utf-8')
    evil = '<img/src=x/onerror=alert(1)>'
    robot = ks.robot_from_text(text.replace('name: q1', f'name: "{evil}", variable: q1'))
    assert robot.joint_names[0] == evil
    seen = observe(robot, [0.3, 0.0])
    for html in (
        gauges_html(seen, evil, evil),
        facts_html(seen, scene_of(seen)),
        jacobian_html(seen),
        joints_html(seen),
    ):
        assert 'img' not in Cells(html).tags


def test_short_names():
    assert short_names(['a_joint', 'b_joint']) == ('a', 'b')
    assert short_names(['a_joint', 'b']) == ('a_joint', 'b')
    assert short_names(['_joint', 'b_joint']) == ('_joint', 'b_joint')


def test_the_colours_of_the_levels_differ_in_brightness_or_along_blue_and_yellow():
    # People who confuse red and green see blue against yellow, and brightness. Matrix of a
    # deuteranope: Vienot, Brettel, Mollon 1999, in linear RGB.
    simulate = np.array([[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1]])
    seen = {
        level: simulate @ (np.array(colour) / 255.0) ** 2.2
        for level, colour in LEVEL_COLOURS.items()
        if level != Level.STALE
    }
    levels = list(seen)
    for k, one in enumerate(levels):
        for other in levels[k + 1 :]:
            assert np.linalg.norm(seen[one] - seen[other]) > 0.2, (one, other)


# The address


def test_a_taken_port_and_a_foreign_host_are_told():
    pytest.importorskip('viser', reason="needs viser: pip install '.[view]'")
    from kinematics_service.apps.pictures.view.address import check_address
    from kinematics_service.errors import ViewError

    with socket.socket() as taken:
        taken.bind(('127.0.0.1', 0))
        taken.listen()
        port = taken.getsockname()[1]
        with refused(ViewError, 'port-in-use', f'--port {port}: ', f'--port {port + 1}'):
            check_address('127.0.0.1', port)
    check_address('127.0.0.1', 0)
    with refused(ViewError, 'unknown-name', '--host no such: '):
        check_address('no such', 0)
    with refused(ViewError, 'wrong-address', '--host 192.0.2.1: ', '0.0.0.0'):
        check_address('192.0.2.1', 0)


# The command


def command(*arguments, **options):
    return subprocess.Popen(
        [sys.executable, '-m', 'kinematics_service', 'view', *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


@pytest.mark.slow
def test_the_command_serves_a_page_here_only_and_ends_cleanly(capsys):
    pytest.importorskip('viser', reason="needs viser: pip install '.[view]'")
    process = command('--sliders', '--robot', 'planar_2r', '--port', '0')
    try:
        line = process.stdout.readline()
        address = re.match(r'(http://127\.0\.0\.1:(\d+)) shows planar_2r', line)
        assert address, line + process.stderr.read()
        with urllib.request.urlopen(address[1], timeout=10) as answer:
            assert b'<html' in answer.read()[:2000].lower()
        # A second one at the same port says so.
        assert main(['view', '--sliders', '--port', address[2]]) == 1
        err = capsys.readouterr().err
        assert err.startswith(f'--port {address[2]}: another program')
        assert len(err.splitlines()) == 1
        process.send_signal(signal.SIGINT)
        time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=20)
        assert process.returncode == 0, err
        assert 'Traceback' not in err
        assert not err
    finally:
        process.kill()
        process.wait()


def test_sliders_and_publish_do_not_go_together(capsys):
    assert main(['view', '--sliders', '--publish']) == 2
    assert 'give one of them' in ' '.join(capsys.readouterr().err.split())


@pytest.mark.slow
def test_without_viser_the_command_says_how_to_get_it():
    code = (
        "import sys; sys.modules['viser'] = None\n"
        'from kinematics_service.cli.command_line import run\n'
        "sys.exit(run(['view', '--sliders']))"
    )
    result = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, timeout=60
    )
    assert result.returncode == 1
    assert "pip install '.[view]'" in result.stderr
    assert len(result.stderr.splitlines()) == 1


# Layouts for other viewers


def topics_of_the_node():
    topics = pytest.importorskip('kinematics_service.node.messages.topics')
    output_topics = pytest.importorskip('kinematics_service.node.messages.output_topics')
    names = {topic.name for topic in output_topics.TOPICS} | {topics.WARNING, topics.DIAGNOSTICS}
    resolved = {name.replace('~', '/kinematics') for name in names}
    return resolved | {'/kinematics/markers', '/robot_description'}


def test_the_foxglove_layout_names_topics_and_panels_that_are_there():
    layout = json.loads((CONFIG / 'foxglove.json').read_text(encoding='utf-8'))
    panels = layout['configById']

    def leaves(tree):
        if isinstance(tree, str):
            return [tree]
        assert tree['direction'] in ('row', 'column')
        assert 0 < tree['splitPercentage'] < 100
        return leaves(tree['first']) + leaves(tree['second'])

    assert sorted(leaves(layout['layout'])) == sorted(panels)
    named = set(panels['3D!arm']['topics'])
    for name, panel in panels.items():
        kind = name.partition('!')[0]
        if kind == 'Plot':
            paths = [path['value'] for path in panel['paths']]
            named |= {path.partition('.')[0] for path in paths if path.startswith('/')}
        elif kind.startswith('Diagnostic'):
            named.add(panel['topicToRender'])
        elif kind == 'RawMessages':
            named.add(panel['topicPath'])
        else:
            assert kind == '3D'
    assert named <= topics_of_the_node()
    assert {'/kinematics/markers', '/kinematics/singularity/distance', '/diagnostics'} <= named


def test_the_fields_the_foxglove_layout_plots_are_there():
    output_topics = pytest.importorskip('kinematics_service.node.messages.output_topics')
    types = {t.name.replace('~', '/kinematics'): t.type for t in output_topics.TOPICS}
    layout = json.loads((CONFIG / 'foxglove.json').read_text(encoding='utf-8'))
    for name, panel in layout['configById'].items():
        for path in panel.get('paths', []) if name.startswith('Plot') else []:
            if not path['value'].startswith('/'):
                float(path['value'])
                continue
            topic, *fields = path['value'].split('.')
            value = types[topic]()
            for field in fields:
                value = getattr(value, field)
            assert isinstance(value, float)


def test_the_rviz_layout_names_topics_and_namespaces_that_are_there():
    import yaml

    text = (CONFIG / 'kinematics.rviz').read_text(encoding='utf-8')
    layout = yaml.safe_load(text)['Visualization Manager']
    assert layout['Global Options']['Fixed Frame'] == 'base_link'
    displays = {display['Class'].partition('/')[2]: display for display in layout['Displays']}
    assert {'MarkerArray', 'TF', 'RobotModel', 'PoseArray'} <= set(displays)
    named = {
        display[key]['Value']
        for display in layout['Displays']
        for key in ('Topic', 'Description Topic')
        if key in display
    }
    assert named <= topics_of_the_node()
    markers = pytest.importorskip('kinematics_service.node.messages.markers')
    assert set(displays['MarkerArray']['Namespaces']) == {
        markers.LINKS,
        markers.JOINTS,
        markers.AXES,
        markers.NAMES,
        markers.ELLIPSOID,
        markers.TWIST,
        markers.LOST,
        markers.STATUS,
    }


def test_layouts_are_no_robots():
    assert not {'foxglove', 'kinematics'} & set(ks.bundled_robots())
