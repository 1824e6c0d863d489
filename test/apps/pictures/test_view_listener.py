# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the live view hears of a running node, and what it says to one."""

import threading
import time

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from ros_harness import DEADLINE, START, Arm, joint_state
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

import kinematics_service as ks
from kinematics_service.apps.pictures.view.gauges import gauges_of
from kinematics_service.apps.pictures.view.view_listener import ViewListener
from kinematics_service.node.drawing.scene import scene_of
from kinematics_service.robot.measures import Level

NEEDS_VISER = "needs viser: pip install '.[view]'"
CLOSE = 1e-9


@pytest.fixture
def viewing(arm):
    """Return a function that starts a node and a view of it."""
    open_ones = []

    def start(robot='ur5e', shown=None, **options):
        one = arm(robot, **options)
        view = ViewListener(one.context, one.node.get_fully_qualified_name())
        open_ones.append(view)
        # The asking waits in an executor of its own: the node answers meanwhile.
        asked = threading.Event()

        def answer():
            while not asked.is_set():
                one.executor.spin_once(timeout_sec=0.01)

        node = threading.Thread(target=answer)
        node.start()
        try:
            assert view.ask(10.0) is not None
        finally:
            asked.set()
            node.join()
        view.show(ks.load_robot(shown or robot))
        return one, view

    yield start
    for view in open_ones:
        view.close()


def together(one, view, true, what):
    def turn():
        view.listen(0.005)
        return true()

    one.spin_until(turn, what)


def came(view, *outputs):
    return all(getattr(view.outputs, name).count > 0 for name in outputs)


def test_it_shows_what_the_node_says(viewing):
    one, view = viewing()
    assert view.observation() is None
    assert 'no joint states arrive on' in view.status
    q, qdot = [0.3, -1.2, 1.1, 0.4, 0.8, 0.2], [0.1, 0.0, -0.2, 0.0, 0.3, 0.0]
    one.attach(listeners=2)
    together(
        one,
        view,
        lambda: (
            bool(one.send(q, qdot))
            and view.outputs.distance.count > 0
            and view.outputs.frames.count > 0
        ),
        'answers',
    )
    seen = view.observation()
    robot = one.robot
    assert seen.q == pytest.approx(q)
    assert seen.pose == pytest.approx(ks.forward_kinematics(robot, q), abs=CLOSE)
    assert seen.frames == pytest.approx(ks.link_frames(robot, q), abs=CLOSE)
    assert seen.jacobian == pytest.approx(ks.jacobian(robot, q), abs=CLOSE)
    assert seen.twist == pytest.approx(ks.twist(robot, q, qdot), abs=CLOSE)
    assert seen.singularity.distance == pytest.approx(ks.singularity(robot, q).distance)
    assert seen.singularity.time_to_warning == pytest.approx(
        ks.singularity(robot, q, qdot).time_to_warning
    )
    assert view.status.startswith('live from /kinematics')
    scene_of(seen)


def test_the_scale_of_commands_is_shown_with_its_cause(viewing):
    one, view = viewing('planar_2r')
    one.attach(listeners=2)
    together(one, view, lambda: bool(one.send((0.3, 0.06))) and came(view, 'pose'), 'poses')
    assert view.observation().scale is None  # nobody asks for anything
    commands = one.speaker(one.topic('command'), kind=JointState)
    commands.publish(joint_state(one.names, (), (0.0, -1.0)))
    together(
        one,
        view,
        lambda: bool(one.send((0.3, 0.06))) and came(view, 'scale', 'reason'),
        'scale',
    )
    seen = view.observation()
    # 0.03 rad are left to the distance `stop`, for a reaction of 0.1 s at 1 rad/s.
    assert seen.scale == (pytest.approx(0.3), 'singularity', Level.WARN)
    (gauge,) = (gauge for gauge in gauges_of(seen) if gauge.name == 'scale')
    assert (gauge.text, gauge.fraction) == ('0.30: singularity', pytest.approx(0.3))


def test_other_axes_and_orders_are_turned_back(viewing):
    one, view = viewing(
        parameter_overrides=[
            Parameter('jacobian_frame', value='tool'),
            Parameter('twist_frame', value='tool'),
            Parameter('row_order', value='angular_first'),
            Parameter('joint_prefix', value='left_'),
        ]
    )
    q, qdot = [0.3, -1.2, 1.1, 0.4, 0.8, 0.2], [0.1, 0.0, -0.2, 0.0, 0.3, 0.0]
    one.attach(listeners=2)
    together(
        one,
        view,
        lambda: (
            bool(one.send(q, qdot))
            and view.outputs.jacobian.count > 0
            and view.outputs.twist.count > 0
        ),
        'answers',
    )
    seen = view.observation()
    assert seen.jacobian == pytest.approx(ks.jacobian(one.robot, q), abs=CLOSE)
    assert seen.twist == pytest.approx(ks.twist(one.robot, q, qdot), abs=CLOSE)


def test_the_level_is_the_node_s(viewing):
    one, view = viewing('planar_2r')
    one.attach(listeners=2)
    together(
        one,
        view,
        lambda: bool(one.send([0.1, 0.01])) and came(view, 'warning'),
        'warning',
    )
    together(one, view, lambda: view.observation() is not None, 'observation')
    assert view.observation().level == Level.ERROR
    # Left at 1.5 times the threshold only: at 0.14 the node still warns, the pose alone does not.
    together(
        one,
        view,
        lambda: bool(one.send([0.1, 0.14])) and view.observation().q[1] == pytest.approx(0.14),
        'next pose',
    )
    together(one, view, lambda: view.observation().level == Level.WARN, 'level WARN')
    assert ks.singularity(one.robot, [0.1, 0.14]).level == Level.OK


def test_another_robot_is_not_mixed_in(viewing):
    one, view = viewing('ur5e', shown='puma560')
    for words in ('/kinematics runs ur5e', 'puma560', '--robot ur5e'):
        assert words in view.status
    assert view.observation() is None


def test_without_a_node_joint_states_suffice(arm):
    one = arm('planar_2r')  # a node of another name than the view looks for
    view = ViewListener(one.context, '/elsewhere')
    try:
        view.show(ks.load_robot('planar_2r'))
        speaker = one.speaker('joint_states', listeners=2)
        stamp = START

        def heard():
            nonlocal stamp
            stamp += 10_000_000
            speaker.publish(joint_state(['q1', 'q2'], [0.2, 0.7], stamp=stamp))
            return view.observation() is not None

        together(one, view, heard, 'observation')
        assert view.observation().q == pytest.approx([0.2, 0.7])
        assert '/elsewhere does not run' in view.status
    finally:
        view.close()


def test_published_sliders_move_the_node_and_not_against_a_robot(viewing):
    one, view = viewing('planar_2r')
    poses = one.poses
    q = np.array([0.4, 0.9])
    together(one, view, lambda: view.publish(q) == '' and len(poses) > 0, 'pose')
    p = poses[-1].pose.position
    assert [p.x, p.y, p.z] == pytest.approx(ks.forward_kinematics(one.robot, q)[:3, 3])
    together(one, view, lambda: view.observation() is not None, 'the picture of it')
    assert view.observation().q == pytest.approx(q)
    one.attach(listeners=2)  # a robot begins to speak
    together(one, view, lambda: view.publish(q) != '', 'refusal')
    assert 'another publisher' in view.publish(q)


def test_an_arm_of_other_geometry_with_the_same_joint_names_is_not_mixed_in(viewing):
    one, view = viewing('ur10e', shown='ur5e')
    assert ks.load_robot('ur10e').joint_names == ks.load_robot('ur5e').joint_names
    assert view.status.startswith('/kinematics runs ur10e, ')
    assert view.observation() is None


# Several arms, and nodes that come, go and come back


class Thread:
    """The nodes of a test, turned by a thread of their own: the view waits for their answers."""

    def __init__(self, *arms):
        self._arms, self._ended = list(arms), threading.Event()
        self._thread = threading.Thread(target=self._turn)

    def _turn(self):
        while not self._ended.is_set():
            for one in self._arms:
                one.executor.spin_once(timeout_sec=0.005)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self._thread.join()


@pytest.fixture
def sessions():
    open_ones = []

    def start(context, robot=None, node=''):
        from kinematics_service.apps.pictures.view.view_session import ViewSession

        session = ViewSession(context, robot, 'puma560', node)
        open_ones.append(session)
        return session

    yield start
    for session in open_ones:
        session.close()


def until(session, true, what):
    deadline = time.monotonic() + 4.0 * DEADLINE
    while not true():
        assert time.monotonic() < deadline, f'{what}; {session.title}; {session.status}'
        session.listen(0.01)


@pytest.mark.slow
def test_one_chooses_among_the_arms_that_are_there(arm, sessions):
    pytest.importorskip('viser', reason=NEEDS_VISER)
    left = arm('planar_2r', namespace='/left')
    right = arm('craig_3r', namespace='/right')
    with Thread(left, right):
        session = sessions(left.context)
        until(session, lambda: len(session.nodes) == 2, 'two nodes')
        assert session.nodes == ('/left/kinematics', '/right/kinematics')
        # The first one is shown, and the page says so, before anybody has chosen.
        assert session.title == 'planar_2r of /left/kinematics'
        session.choose('/right/kinematics')
        assert session.robot.name == 'craig_3r'
        assert session.title == 'craig_3r of /right/kinematics'
        assert '/right/joint_states' in session.status
        session.choose('/left/kinematics')
        assert session.title == 'planar_2r of /left/kinematics'


@pytest.mark.slow
def test_it_follows_a_node_that_comes_late_and_comes_back_as_another(arm, sessions):
    pytest.importorskip('viser', reason=NEEDS_VISER)
    quiet = arm('planar_2r', namespace='/apart')
    session = sessions(quiet.context, node='/late/kinematics')
    assert session.title == 'puma560; no node /late/kinematics runs'
    first = Arm('planar_3r', namespace='/late')
    with Thread(first):
        until(session, lambda: session.robot.name == 'planar_3r', 'the late node')
        assert session.title == 'planar_3r of /late/kinematics'
        # Other frames while it runs.
        request = SetParameters.Request(
            parameters=[Parameter('jacobian_frame', value='tool').to_parameter_msg()]
        )
        service = '/late/kinematics/set_parameters'
        client = quiet.peer.create_client(SetParameters, service)
        quiet.spin_until(client.service_is_ready, service)
        future = client.call_async(request)
        quiet.spin_until(future.done, 'the new frame')
        until(session, lambda: session._listener.facts.axes[0] == 'tool', 'the new frame')
    first.close()
    again = arm('scara_hsr065', namespace='/late')
    with Thread(again):
        until(session, lambda: session.robot.name == 'scara_hsr065', 'the other robot')
        assert session.title == 'scara_hsr065 of /late/kinematics'
        assert session._listener.facts.axes == ('base', 'base')


@pytest.mark.slow
def test_it_draws_the_tool_and_the_edited_file_of_the_node(arm, sessions, tmp_path):
    pytest.importorskip('viser', reason=NEEDS_VISER)
    file = tmp_path / 'two.yaml'
    text = ks.bundled_robots()['planar_2r'].read_text(encoding='utf-8')
    file.write_text(text, encoding='utf-8')
    one = arm(str(file), namespace='/edited')
    with Thread(one):
        session = sessions(one.context)
        assert session.title == 'planar_2r of /edited/kinematics'
        q = [0.3, 0.4]

        def tool():
            return ks.forward_kinematics(session.robot, q)[:3, 3]

        def ask(kind, service, request):
            client = one.peer.create_client(kind, f'/edited/kinematics/{service}')
            answered = client.call_async(request)
            until(session, answered.done, service)
            return answered.result()

        tip = ks.link_frames(ks.load_robot('planar_2r'), q)[-1]
        value = Parameter('tool.xyz', value=[0.1, 0.2, 0.3]).to_parameter_msg()
        ask(SetParameters, 'set_parameters', SetParameters.Request(parameters=[value]))
        expected = tip[:3] @ [0.1, 0.2, 0.3, 1.0]
        until(session, lambda: tool() == pytest.approx(expected), 'the tool')
        drawn = session.robot
        file.write_text(text.replace('L2: 1', 'L2: 0.5'), encoding='utf-8')
        assert ask(Trigger, 'reload', Trigger.Request()).success
        until(session, lambda: session.robot is not drawn, 'the file')
        assert tool() == pytest.approx(expected - 0.5 * tip[:3, 0])
        # A file that the node has not read yet is told of where it is drawn.
        file.write_text(text, encoding='utf-8')
        session.choose('/edited/kinematics')
        one.attach(listeners=2)

        def told():
            one.send(q)
            return session.status.endswith('~/reload reads it again')

        until(session, told, 'the warning')


@pytest.mark.slow
def test_a_robot_that_was_asked_for_stays(arm, sessions):
    pytest.importorskip('viser', reason=NEEDS_VISER)
    one = arm('planar_3r', namespace='/mine')
    with Thread(one):
        session = sessions(one.context, robot=ks.load_robot('ur5e'))
        assert session.robot.name == 'ur5e'
        assert 'runs planar_3r, this is ur5e' in session.status
        session.choose('/mine/kinematics')
        assert session.robot.name == 'planar_3r'
