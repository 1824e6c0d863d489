# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Another tool, or the robot file read again, while the node runs."""

import json
import math
import os
import threading
import time

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.parameter import Parameter
from refusal import refused
from ros_harness import (
    BOTH_TRANSPORTS,
    LATCHED,
    SECOND,
    START,
    STEP,
    joint_state,
    level_of,
    nanoseconds,
    values_of,
)
from std_msgs.msg import Float64, Float64MultiArray, String
from std_srvs.srv import Trigger
from target_harness import Targets, pose_target
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service.errors import KinematicsError, SettingsError
from kinematics_service.node.parameters import settled_file
from kinematics_service.node.parameters.settings import defaults, settings_from

Q, QDOT = (0.3, 0.7), (0.5, -0.2)
TOOL = (0.2, -0.1, 0.05)
WARN, STALE = 1, 3
# The shortest arm, whose bound for lengths is the least, and arms of other kinds.
SMALL_AND_LARGE = ('crank_slider', 'flexpicker', 'puma560')
# Joint positions that are found for a pose, and velocities that are differences.
CLOSE = 1e-9


def text(L1=1.0, L2=1.0, names=('q1', 'q2'), more=''):
    """Return the file of a planar arm; its joints move the two links in their order."""
    first, second = names
    return f"""\
robot: two
convention: standard
joints:
  - {{name: {first}, variable: a, type: revolute}}
  - {{name: {second}, variable: b, type: revolute}}
links:
  - {{a: {L1}, alpha: 0, d: 0, theta: a}}
  - {{a: {L2}, alpha: 0, d: 0, theta: b}}
points: {{elbow: {{row: 1}}, plate: {{row: 0, xyz: [0, 0, 0.3]}}}}
{more}"""


def place(q, L1=1.0, L2=1.0, tool=(0.0, 0.0, 0.0)):
    """Return where the tool is by trigonometry, (3,), and J of x and y, (2, 2)."""
    a, ab, (x, y, z) = q[0], q[0] + q[1], tool
    along, across = L2 + x, y
    outer = np.array(
        [
            along * math.cos(ab) - across * math.sin(ab),
            along * math.sin(ab) + across * math.cos(ab),
        ]
    )
    inner = L1 * np.array([math.cos(a), math.sin(a)])
    whole = inner + outer
    J = np.array([[-whole[1], -outer[1]], [whole[0], outer[0]]])
    return np.array([*whole, z]), J


def xyz(pose):
    position = pose.pose.position
    return np.array([position.x, position.y, position.z])


def is_at(pose, *where, **lengths):
    return np.allclose(xyz(pose), place(*where, **lengths)[0], rtol=0, atol=ROUND_OFF)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / 'two.yaml'
    path.write_text(text())
    return path


def change(one, **values):
    """Set parameters at once, `__` for the dot, by the service; return the result."""
    request = SetParametersAtomically.Request(
        parameters=[
            Parameter(name.replace('__', '.'), value=value).to_parameter_msg()
            for name, value in values.items()
        ]
    )
    return one.call(
        SetParametersAtomically, '/kinematics/set_parameters_atomically', request
    ).result


def reload(one):
    return one.call(Trigger, '/kinematics/reload', Trigger.Request())


def described(one):
    return json.loads(one.call(Trigger, '/kinematics/describe', Trigger.Request()).message)


def test_place_and_orientation_of_a_tool_set_at_once_are_one_change(arm, file):
    one = arm(str(file))
    assert is_at(one.answer(Q, QDOT), Q)
    changes = []
    configure = one.node._outputs.configure
    one.node._outputs.configure = lambda settings: (changes.append(settings), configure(settings))
    result = change(one, tool__xyz=list(TOOL), tool__rpy=[0.0, 0.0, 0.4])
    assert result.successful, result.reason
    assert len(changes) == 1
    jacobians = one.hear('jacobian', Float64MultiArray)
    twists = one.hear('twist', TwistStamped)
    pose = one.answer(Q, QDOT)
    one.spin_until(lambda: jacobians and twists, 'J and twist')
    where, J = place(Q, tool=TOOL)
    np.testing.assert_allclose(xyz(pose), where, rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(
        np.reshape(jacobians[-1].data, (6, 2))[:2], J, rtol=0, atol=ROUND_OFF
    )
    linear = twists[-1].twist.linear
    np.testing.assert_allclose([linear.x, linear.y], J @ QDOT, rtol=0, atol=ROUND_OFF)
    half = 0.5 * (sum(Q) + 0.4)
    turn = pose.pose.orientation
    np.testing.assert_allclose(
        np.abs([turn.z, turn.w]), [math.sin(half), math.cos(half)], rtol=0, atol=ROUND_OFF
    )


def test_an_empty_list_is_the_tool_of_the_file(arm, file):
    file.write_text(text(more='tool: {xyz: [0.3, 0, 0], rpy: [0, 0, 0.2]}\n'))
    one = arm(str(file), ['-p', 'tool.xyz:=[0.1, 0.0, 0.0]', '-p', 'tool.rpy:=[]'])
    assert is_at(one.answer(Q), Q, tool=(0.1, 0.0, 0.0))
    # The place alone is another one: the orientation is the file's.
    assert described(one)['tool'] == {'xyz': [0.1, 0.0, 0.0], 'rpy': [0.0, 0.0, 0.2]}
    assert change(one, tool__xyz=[]).successful
    assert is_at(one.answer(Q), Q, tool=(0.3, 0.0, 0.0))
    assert change(one, tool__xyz=[0, 0, 1]).successful  # whole numbers are numbers
    assert is_at(one.answer(Q), Q, tool=(0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ('key', 'value', 'code', 'word'),
    [
        ('xyz', [0.1, 0.2], 'wrong-length', 'give 3 numbers'),
        ('xyz', [0.1, 0.2, math.nan], 'not-finite', 'nan'),
        ('xyz', [0.1, 0.2, 2e6], 'out-of-range', '1e+06'),
        ('xyz', ['0', '0', '1'], 'wrong-type', 'such as [0.0, 0.0, 0.1]'),
        ('xyz', '[0, 0, 0.1]', 'wrong-type', "'[0, 0, 0.1]'"),
        ('rpy', [0.0, 0.0, 7.0], 'out-of-range', '6.28319 rad'),
        ('rpy', [0.0, 0.0, 90.0], 'out-of-range', 'are these degrees? write 1.5708'),
        ('rpy', [0.0, math.inf, 90.0], 'not-finite', 'write 1.5708'),
    ],
)
def test_a_bad_tool_is_refused_with_its_cause(file, key, value, code, word):
    robot = ks.load_robot(file)
    with refused(SettingsError, code, f'parameter tool.{key}: ', word):
        settings_from(defaults(robot) | {f'tool.{key}': value}, robot)


def test_a_bad_tool_changes_nothing_and_is_not_half_applied(arm, file):
    one = arm(str(file))
    settings = one.node.settings
    result = change(one, tool__rpy=[0.0, 0.0, 0.4], tool__xyz=[0.1, 0.2])
    assert not result.successful
    assert result.reason == (
        'parameter tool.xyz: [0.1, 0.2] is not accepted; give 3 numbers of at most 1e+06, such as '
        '[0.0, 0.0, 0.1]'
    )
    assert one.node.settings is settings
    assert is_at(one.answer(Q), Q)
    assert change(one, tool__rpy=[0.0, 0.0, -math.pi]).successful


def test_another_tool_is_logged(arm, file, capfd):
    one = arm(str(file))
    assert change(one, tool__xyz=[0.0, 0.0, 0.15], tool__rpy=[0.0, 0.0, 0.5]).successful
    assert change(one, twist_frame='tool').successful
    logged = capfd.readouterr().err
    assert logged.count('the tool is now at') == 1
    assert '[0, 0, 0.15] m, rpy [0, 0, 0.5]' in logged


def test_a_tool_that_nothing_moves_is_refused_with_the_reason(arm, tmp_path):
    path = tmp_path / 'one.yaml'
    path.write_text(
        'robot: one\nconvention: standard\njoints: [{name: q1, type: revolute}]\n'
        'links: [{a: 1, alpha: 0, d: 0, theta: q1}]\nsingularity: {task: [x, y]}\n'
    )
    one = arm(str(path))
    result = change(one, tool__xyz=[-1.0, 0.0, 0.0])
    assert not result.successful
    assert 'no joint moves the tool' in result.reason


def test_factors_that_another_tool_makes_wrong_are_left_out(arm):
    one = arm('craig_3r')
    assert change(one, tool__xyz=[0.05, 0.02, 0.1]).successful
    robot = one.node.settings.robot
    assert robot.singularity.factors.names == ()
    # The distance is that of an arm whose file has the tool, and no factors.
    own = ks.bundled_robots()['craig_3r'].read_text()
    plain = own[: own.index('singularity:')] + 'tool: {xyz: [0.05, 0.02, 0.1]}\n'
    distances = one.hear('singularity/distance', Float64)
    q = (0.3, -0.4, 0.2)
    one.answer(q)
    one.spin_until(lambda: distances, 'distance')
    # The node searches for as long as each pose of a batch is searched.
    (expected,) = ks.singularity(ks.robot_from_text(plain), [q]).distance
    assert distances[-1].data == pytest.approx(expected, abs=ROUND_OFF)


def test_factors_that_no_tool_changes_stay(arm):
    one = arm('ur5e')
    before = one.node.settings.robot.singularity.factors
    assert change(one, tool__xyz=[0.05, 0.02, 0.1]).successful
    after = one.node.settings.robot.singularity.factors
    assert (after.names, after.complete) == (before.names, True)


def test_a_target_right_after_a_change_is_that_of_the_new_tool(arm, file):
    one = arm(str(file))
    targets = Targets(one)
    one.answer(Q)
    assert change(one, tool__xyz=list(TOOL)).successful
    # Where the tool is now, in its own frame: the present joint positions.
    status = targets.ask(pose_target(np.eye(4), 'tool0'))
    assert level_of(status) == 0, status.message
    one.spin_until(lambda: targets.joint_states, 'joint positions')
    np.testing.assert_allclose(targets.joint_states[-1].position, Q, rtol=0, atol=CLOSE)


def test_a_tool_in_millimetres_is_doubted_in_the_log_and_in_the_diagnostics(arm, capfd):
    one = arm('ur5e', ['-p', 'tool.xyz:=[0, 0, 150]'])

    def doubt():
        one.diagnose()
        statuses = one._diagnostics[-1].status
        return next((one for one in statuses if one.name == 'kinematics: parameters'), None)

    first = doubt()
    assert level_of(first) == WARN
    asked = 'tool.xyz: a length of 150 '
    assert asked in first.message
    assert first.message.endswith('write 0.15')
    assert capfd.readouterr().err.count(asked) == 1
    assert change(one, tool__xyz=[0.0, 0.0, -0.15]).successful
    assert doubt() is None
    # Twenty times the reach of a small arm is enough.
    assert change(one, tool__xyz=[0.0, 0.0, -15.0], reference__angle_stop=7.0).successful
    assert 'a length of -15 m' in doubt().message
    assert 'write -0.015' in doubt().message
    assert 'reference.angle_stop: 7 rad' in doubt().message
    log = capfd.readouterr().err
    assert (log.count('-15 m'), log.count('7 rad')) == (1, 1)


@pytest.mark.parametrize('name', SMALL_AND_LARGE)
def test_usual_tools_are_not_doubted(name):
    robot = ks.load_robot(name)
    values = {**defaults(robot), 'tool.xyz': [0.3, 0.0, -0.5], 'tool.rpy': [3.2, -1.6, 6.28]}
    assert settings_from(values, robot).doubts == ()


@BOTH_TRANSPORTS
def test_an_edited_file_comes_into_force_with_all_that_follows_from_it(arm, file):
    one = arm(str(file), ['-p', 'publish_robot_description:=true', '-p', 'points:=[elbow]'])
    assert is_at(one.answer(Q, QDOT), Q)
    assert is_at(one.answer(Q, QDOT), Q)
    before = described(one)
    jacobians = one.hear('jacobian', Float64MultiArray)
    elbows = one.hear('elbow/pose', PoseStamped)
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)
    urdf = one.listen('/robot_description', String, LATCHED)
    file.write_text(
        text(0.7, 0.4, names=('left', 'q2'), more='singularity: {measure: condition_number}\n')
    )
    response = reload(one)
    assert response.success, response.message
    assert response.message.startswith(f'{file} is in force: ')
    one.names = ['left', 'q2']
    del jacobians[:], elbows[:], warnings[:]
    pose = one.answer(Q, QDOT)
    where, J = place(Q, 0.7, 0.4)
    np.testing.assert_allclose(xyz(pose), where, rtol=0, atol=ROUND_OFF)
    one.spin_until(lambda: jacobians and elbows and warnings and urdf, 'all answers')
    assert jacobians[-1].layout.dim[1].label == 'left,q2'
    np.testing.assert_allclose(
        np.reshape(jacobians[-1].data, (6, 2))[:2], J, rtol=0, atol=ROUND_OFF
    )
    inner = (0.7 * math.cos(Q[0]), 0.7 * math.sin(Q[0]), 0.0)
    np.testing.assert_allclose(xyz(elbows[-1]), inner, rtol=0, atol=ROUND_OFF)
    assert values_of(warnings[-1])['measure'] == 'condition_number'
    assert 'name="left"' in urdf[-1].data
    after = described(one)
    assert [joint['name'] for joint in after['joints']] == ['left', 'q2']
    assert after['file']['sha256'] != before['file']['sha256']
    # The parameter follows the file, whose measure it was.
    request = GetParameters.Request(names=['singularity.measure'])
    values = one.call(GetParameters, '/kinematics/get_parameters', request).values
    assert values[0].string_value == 'condition_number'


def test_parameters_hold_for_an_edited_file(arm, file):
    one = arm(str(file), ['-p', 'singularity.warn:=0.3', '-p', 'tool.xyz:=[0.2, -0.1, 0.05]'])
    file.write_text(text(0.7, more='singularity: {warn: 0.2, stop: 0.1}\n'))
    assert reload(one).success
    thresholds = one.node.settings.robot.singularity.thresholds
    assert (thresholds.warn, thresholds.stop) == (0.3, 0.1)
    assert is_at(one.answer(Q), Q, L1=0.7, tool=TOOL)


def test_a_bad_file_is_refused_with_all_its_faults_and_the_old_arm_goes_on(arm, file):
    one = arm(str(file), ['-p', 'points:=[elbow]'])
    before, settings = described(one), one.node.settings
    bad = text(0.7).replace('theta: a', 'theta: c').replace('alpha: 0, d: 0, theta: b', 'd: 0')
    file.write_text(bad)
    with pytest.raises(ks.RobotFileError) as error:
        ks.load_robot(file)
    assert len(error.value.faults) > 1
    response = reload(one)
    assert not response.success
    assert response.message.startswith(str(error.value))
    # What the parameters ask for must be there, too.
    file.write_text(text(0.7).replace('elbow', 'knee'))
    response = reload(one)
    assert not response.success
    assert response.message.startswith("parameter points: 'elbow' ")
    assert 'knee, plate' in response.message
    file.unlink()
    assert reload(one).message.startswith(f'{file}: no such file')
    assert described(one) == before
    assert one.node.settings is settings
    assert is_at(one.answer(Q), Q)


def test_joints_that_keep_their_names_keep_their_memory(arm, file):
    one = arm(str(file))
    poses = one.poses
    one.publish(joint_state(['q1', 'q2'], Q, (), START))
    one.spin_until(lambda: poses, 'pose')
    # The joints change places, and one of them its name.
    file.write_text(text(0.7, names=('new', 'q1')))
    assert reload(one).success
    one.publish(joint_state(['new'], [0.2], (), START + STEP))
    one.spin_until(lambda: len(poses) == 2, 'pose')
    assert is_at(poses[-1], (0.2, Q[0]), L1=0.7)
    # A difference of positions reaches back before the change.
    twists = one.hear('twist', TwistStamped)
    one.publish(joint_state(['new', 'q1'], [0.3, Q[0] + 0.1], (), START + 2 * STEP))
    one.spin_until(lambda: twists, 'twist')
    rate = 0.1 / (STEP / SECOND)
    J = place((0.3, Q[0] + 0.1), 0.7)[1]
    linear = twists[-1].twist.linear
    np.testing.assert_allclose([linear.x, linear.y], J @ [rate, 0.5 * rate], rtol=0, atol=CLOSE)


def test_a_state_is_stale_where_a_new_joint_is_not_heard(arm, file):
    one = arm(str(file), ['-p', 'joint_state_timeout:=0.2'])
    one.answer(Q)
    file.write_text(text(names=('q1', 'wrist')))
    assert reload(one).success
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)

    def stale():
        return warnings and level_of(warnings[-1]) == STALE and 'wrist' in warnings[-1].message

    one.spin_until(stale, 'STALE')


def test_requests_at_once_are_all_answered_and_the_last_file_is_in_force(arm, file):
    one = arm(str(file))
    client = one.peer.create_client(Trigger, '/kinematics/reload')
    one.spin_until(client.service_is_ready, 'service')
    futures = []
    for length in (0.5, 0.6, 0.7):
        edited = file.with_suffix('.new')
        edited.write_text(text(length))
        edited.replace(file)  # at once: a file half written is no robot
        futures.append(client.call_async(Trigger.Request()))
        one.spin_until(lambda: one.node._reload._answered, 'a reading')
    one.spin_until(lambda: all(future.done() for future in futures), 'responses')
    assert all(future.result().success for future in futures)
    assert is_at(one.answer(Q), Q, L1=0.7)


@BOTH_TRANSPORTS
def test_each_answer_is_of_one_arm_and_none_is_missing_while_it_changes(arm, file):
    one = arm(str(file), ['-p', 'points:=[plate]'])
    jacobians = one.hear('jacobian', Float64MultiArray)
    client = one.peer.create_client(Trigger, '/kinematics/reload')
    one.spin_until(client.service_is_ready, 'service')
    poses, sent, futures = one.poses, [], []
    for k in range(120):
        if k % 30 == 15:
            file.write_text(text(1.0 + 0.1 * (k // 30 + 1)))
            futures.append(client.call_async(Trigger.Request()))
        if k % 30 == 25:  # some are sent to the new arm with its old tool
            one.spin_until(lambda: all(future.done() for future in futures), 'response')
        if k % 30 == 29:
            tool = [0.001 * k, 0.0, 0.0]
            assert one.node.set_parameters([Parameter('tool.xyz', value=tool)])[0].successful
        sent.append(one.send((0.001 * k, 0.7), QDOT))
        one.executor.spin_once(timeout_sec=0.0)
    one.spin_until(lambda: len(jacobians) == len(poses) == len(sent), 'answers')
    assert one.stamps() == sent
    variants = [
        {'L1': 1.0 + 0.1 * length, 'tool': (tool, 0.0, 0.0)}
        for length in range(5)
        for tool in (0.0, 0.029, 0.059, 0.089, 0.119)
    ]
    used = []
    for k, (pose, message) in enumerate(zip(poses, jacobians)):
        q = (0.001 * k, 0.7)
        fitting = [v for v in variants if is_at(pose, q, **v)]
        assert len(fitting) == 1
        J = np.reshape(message.data, (6, 2))[:2]
        np.testing.assert_allclose(J, place(q, **fitting[0])[1], rtol=0, atol=ROUND_OFF)
        if not used or used[-1] != fitting[0]:
            used.append(fitting[0])
    assert len(used) >= 8


class Writer(threading.Thread):
    """Writes a file in pieces: a robot without its tool, comments, and the tool at the end."""

    def __init__(self, file, comments):
        super().__init__(daemon=True)
        self._file, self._comments = file, comments
        self.began, self.stop = threading.Event(), threading.Event()

    def run(self):
        with self._file.open('w', buffering=1) as stream:
            stream.write(text(0.7))
            self.began.set()
            for _ in range(self._comments):
                if self.stop.wait(0.03):
                    break
                stream.write('# a comment\n')
            stream.write('tool: {xyz: [0.3, 0, 0]}\n')


def test_a_file_that_is_still_being_written_comes_into_force_when_it_is_complete(arm, file):
    one = arm(str(file))
    tools = []
    configure = one.node._outputs.configure
    one.node._outputs.configure = lambda settings: (tools.append(settings), configure(settings))
    writer = Writer(file, 10)
    writer.start()
    assert writer.began.wait(10.0)
    response = reload(one)
    assert response.success, response.message
    assert is_at(one.answer(Q), Q, L1=0.7, tool=(0.3, 0.0, 0.0))
    assert len(tools) == 1


@pytest.mark.parametrize('age', [0.5, 2.0])
def test_half_a_file_that_just_changed_may_be_being_written(file, age):
    file.write_text(text()[:100])
    changed = time.time() - age
    os.utime(file, (changed, changed))
    with pytest.raises(KinematicsError) as refused:
        settled_file.read_settled(lambda: ks.load_robot(file), [file])
    assert str(refused.value).endswith('is it being written?') == (age < 1.0)


def test_a_file_that_is_written_for_too_long_is_refused(arm, file, monkeypatch):
    one = arm(str(file))
    monkeypatch.setattr(settled_file, 'SETTLING_TIMEOUT', 0.3)
    writer = Writer(file, 10_000)
    writer.start()
    assert writer.began.wait(10.0)
    response = reload(one)
    writer.stop.set()
    writer.join()
    assert not response.success
    assert 'after 0.3 s' in response.message
    assert is_at(one.answer(Q), Q)


def test_the_node_answers_while_a_file_is_read(arm, file, monkeypatch):
    one = arm(str(file))
    from kinematics_service.node.parameters import node_parameters

    held, load = threading.Event(), node_parameters.load_robot

    def slow(name):
        assert held.wait(10.0)
        return load(name)

    monkeypatch.setattr(node_parameters, 'load_robot', slow)
    client = one.peer.create_client(Trigger, '/kinematics/reload')
    one.spin_until(client.service_is_ready, 'service')
    file.write_text(text(0.7))
    future = client.call_async(Trigger.Request())
    one.spin_until(lambda: one.node._reload._answered, 'a reading')
    assert is_at(one.answer(Q), Q)
    # A parameter that is set meanwhile holds for both arms.
    assert change(one, tool__xyz=list(TOOL)).successful
    assert is_at(one.answer(Q), Q, tool=TOOL)
    assert not future.done()
    held.set()
    one.spin_until(future.done, 'response')
    assert future.result().success
    assert is_at(one.answer(Q), Q, L1=0.7, tool=TOOL)


def test_what_may_be_off_in_an_arm_is_found_while_its_file_is_read(arm, file, monkeypatch):
    from kinematics_service.kinematics.uncertainty import arm_errors

    one = arm(str(file))
    threads, found = [], arm_errors.pose_errors

    def noted(*given):
        threads.append(threading.current_thread())
        return found(*given)

    monkeypatch.setattr(arm_errors, 'pose_errors', noted)
    file.write_text(text(0.7, more='uncertainty: {encoder_noise: 1e-4}\n'))
    assert reload(one).success
    poses = one.hear('pose_with_covariance', PoseWithCovarianceStamped)
    one.answer(Q)
    one.spin_until(lambda: poses, 'pose with covariance')
    # By the thread that reads, and by nothing between two messages.
    assert len(threads) == 1
    assert threads[0] is not threading.main_thread()


def test_a_point_that_no_joint_moves_has_a_pose_and_a_jacobian_of_zeros(arm, file):
    one = arm(str(file), ['-p', 'points:=[plate]'])
    kinds = {'pose': PoseStamped, 'jacobian': Float64MultiArray, 'twist': TwistStamped}
    heard = {name: one.hear(f'plate/{name}', kind) for name, kind in kinds.items()}
    stamp = one.send(Q, QDOT)
    one.spin_until(lambda: all(heard.values()), 'messages of the plate')
    pose, J, twist = (messages[0] for messages in heard.values())
    assert xyz(pose).tolist() == [0.0, 0.0, 0.3]
    assert pose.pose.orientation.w == 1.0
    assert list(J.data) == [0.0] * 12
    assert J.layout.dim[1].label == 'q1,q2'
    linear, angular = twist.twist.linear, twist.twist.angular
    assert (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z) == (0.0,) * 6
    assert nanoseconds(twist.header.stamp) == stamp
