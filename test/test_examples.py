# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The scripts of examples/ run, and do what they say."""

import copy
import json
import runpy
from pathlib import Path

import numpy as np
import pytest

import kinematics_service as ks

EXAMPLES = Path(__file__).parent.parent / 'examples'
SINGULAR = [0.1, -1.2, 1.4, -1.6, 0.0, 0.2]  # of the ur5e, at the wrist
RENEW = 'python docs/from_code.py renews it'
FREE = [0.1, -1.2, 1.4, -1.6, -1.2, 0.2]


def run(name):
    return runpy.run_path(str(EXAMPLES / f'{name}.py'), run_name='__main__')


def test_there_is_a_test_for_every_example():
    names = {path.stem for path in EXAMPLES.iterdir() if path.is_file()}
    assert names == {
        *('library', 'batch', 'inverse_kinematics', 'own_node', 'audit_gate', 'notebook'),
        'scaled_controller',
    }


def test_notebook(monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLES.parent / 'docs'))
    import from_code

    written = json.loads((EXAMPLES / 'notebook.ipynb').read_text('utf-8'))
    now = copy.deepcopy(written)
    from_code.run_notebook(now)
    cells = [cell for cell in written['cells'] if cell['cell_type'] == 'code']
    again = [cell for cell in now['cells'] if cell['cell_type'] == 'code']
    assert len(cells) > 4
    for cell, one in zip(cells, again):
        (shown,), (found,) = cell['outputs'], one['outputs']
        assert shown['data']['text/plain'] == found['data']['text/plain'], RENEW
        assert shown['data'].keys() == found['data'].keys(), RENEW
        assert len(found['data']) == 2


def test_library(capsys):
    names = run('library')
    robot, q = names['robot'], names['q']
    step = 1e-6
    moved = ks.forward_kinematics(robot, np.stack([q + step * names['qdot'], q]))[:, :3, 3]
    assert (moved[0] - moved[1]) / step == pytest.approx(names['state'].twist[:3], abs=1e-5)
    assert 'nearest: wrist' in capsys.readouterr().out


@pytest.mark.slow
def test_batch(tmp_path, capsys):
    # A tenth of the poses: for each of them the example does the same.
    text = (EXAMPLES / 'batch.py').read_text('utf-8')
    assert text.count('10_000') == 1
    (tmp_path / 'batch.py').write_text(text.replace('10_000', '1_000'), 'utf-8')
    names = runpy.run_path(str(tmp_path / 'batch.py'), run_name='__main__')
    one = ks.singularity(names['robot'], names['q'][123])
    assert names['near'].distance[123] == one.distance
    assert '% of 1000 random poses' in capsys.readouterr().out


def test_inverse_kinematics(capsys):
    names = run('inverse_kinematics')
    assert len(names['result']) > 1
    for solution in names['result']:
        reached = ks.forward_kinematics(names['robot'], solution.q)
        assert reached == pytest.approx(names['target'], abs=1e-9)
    assert names['refused'].status == 'unreachable'
    assert 'unreachable: ' in capsys.readouterr().out


@pytest.mark.slow
def test_a_plan_through_a_singular_pose_fails_the_gate(tmp_path, capsys):
    gate = runpy.run_path(str(EXAMPLES / 'audit_gate.py'))['main']
    folders = [tmp_path / name for name in ('free', 'singular')]
    for folder in folders:
        folder.mkdir()
    write_plan(folders[0] / 'far.yaml', FREE, np.add(FREE, [0.3, 0, 0, 0, 0, 0]))
    write_plan(folders[1] / 'near.yaml', FREE, np.negative(FREE) * [-1, -1, -1, -1, 1, -1])
    # Each plan is a process.
    assert [gate('ur5e', folder) for folder in folders] == [0, 1]
    printed = capsys.readouterr().out
    assert 'pass  far.yaml' in printed
    assert 'FAIL  near.yaml: Refuted: at 1.000 s' in printed


def test_an_empty_folder_fails_the_gate(tmp_path):
    assert runpy.run_path(str(EXAMPLES / 'audit_gate.py'))['main']('ur5e', tmp_path) == 1


def write_plan(file, *points):
    names = ', '.join(ks.load_robot('ur5e').joint_names)
    lines = [
        f'  - {{positions: [{", ".join(map(str, q))}], time_from_start: {2.0 * k}}}'
        for k, q in enumerate(points)
    ]
    file.write_text(f'joint_names: [{names}]\npoints:\n' + '\n'.join(lines) + '\n')


def test_a_controller_that_obeys_the_scale_stops_before_its_elbow_is_stretched(arm):
    own = runpy.run_path(str(EXAMPLES / 'scaled_controller.py'))['ScaledController']
    one = arm('planar_2r', ['-p', 'scale.horizon:=0.05'])
    controller = own(one.names, [0.0, 0.3], [0.0, -2.0], context=one.context)
    one.executor.add_node(controller)
    try:
        one.spin_until(lambda: controller.q[1] < 0.05, 'the elbow unbends')
        before = controller.q[1]
        one.spin_until(lambda: before - controller.q[1] > 0.01, 'it goes on')
    finally:
        one.executor.remove_node(controller)
        controller.destroy_node()
    assert 0.03 - 1e-3 <= controller.q[1] < 0.05


@pytest.mark.parametrize(('q', 'expected'), [(SINGULAR, 0.0), (FREE, 1.0)])
def test_own_node(ros_domain, q, expected):
    harness = pytest.importorskip('ros_harness')
    from std_msgs.msg import Float64

    own = runpy.run_path(str(EXAMPLES / 'own_node.py'))['SpeedScale']
    robot = ks.load_robot('ur5e')
    peer = harness.Peer()
    try:
        peer.add(own(robot, context=peer.context, use_global_arguments=False))
        heard = peer.listen('/speed_scale/speed_scale', Float64)
        speaker = peer.speaker('/joint_states', harness.BEST_EFFORT)  # as the sensor QoS
        message = harness.joint_state(robot.joint_names, q, stamp=harness.START)

        def is_answered():
            speaker.publish(message)  # the first ones may be lost
            return heard

        peer.spin_until(is_answered, 'speed scale')
        assert heard[0].data == expected
    finally:
        peer.close()


def test_a_jacobian_is_paired_with_its_own_stamp_whatever_is_lost():
    pytest.importorskip('rclpy', reason='needs ROS 2')
    from builtin_interfaces.msg import Time

    own = runpy.run_path(str(EXAMPLES / 'own_node.py'))['PairedJacobians']

    class Subscriber(own):
        def __init__(self):
            self.stamps, self.jacobians, self.pairs, self.found = [], [], {}, []

        def keep(self, stamp, jacobian):
            self.found.append((stamp.sec, jacobian))

    for seed in range(20):
        random, one, late = np.random.default_rng(seed), Subscriber(), []
        for k in range(200):
            lost = random.random(2) < (0.2 if k % 40 < 20 else 0.9)  # in bursts, too
            if not lost[0]:
                one.on_jacobian(k, {'source_timestamp': 10 * k, 'publication_sequence_number': k})
            if not lost[1]:
                late.append((Time(sec=k), {'source_timestamp': 10 * k + 3}))
            while late and random.random() < 0.5:
                one.on_stamp(*late.pop(0))
        assert len(one.found) > 20
        assert all(k == jacobian for k, jacobian in one.found)


def test_a_late_subscriber_pairs_jacobians_and_poses_by_stamp(ros_domain):
    harness = pytest.importorskip('ros_harness')
    from std_msgs.msg import Float64MultiArray

    own = runpy.run_path(str(EXAMPLES / 'own_node.py'))['PairedJacobians']
    pairs, sent = [], {}

    class Subscriber(own):
        def use(self, pose, jacobian):
            super().use(pose, jacobian)
            pairs.append((pose, jacobian))

    one = harness.Arm('planar_2r')
    try:

        def send():
            q = (0.01 * len(sent), 0.5)
            sent[one.send(q)] = q

        def is_paired(number):
            send()
            return len(pairs) >= number

        jacobians = one.hear('jacobian', Float64MultiArray)  # so its numbers are ahead
        one.spin_until(lambda: send() or len(jacobians) > 10, 'Jacobians')
        one.add(Subscriber(context=one.context, use_global_arguments=False))
        one.spin_until(lambda: is_paired(1), 'first pair')
        first = harness.nanoseconds(pairs[0][0].header.stamp)
        assert list(sent).index(first) > 10
        one.spin_until(lambda: is_paired(50), 'pairs')
    finally:
        one.close()
    for pose, jacobian in pairs:
        q = sent[harness.nanoseconds(pose.header.stamp)]
        np.testing.assert_allclose(
            np.reshape(jacobian.data, (6, 2)), ks.jacobian('planar_2r', q), atol=1e-12
        )
