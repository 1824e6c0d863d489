# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""`--of`, `--at` and `--axes` of `fk` and `jacobian`: the library's numbers, and refusals."""

import json

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.__main__ import main

Q, QDOT = [0.1, -0.2, 0.3], [1.0, 0.5, -0.4]
POINTED = """\
points:
  elbow: {row: 2}
  camera: {row: 3, xyz: [0, 0, 0.1], rpy: [0.3, 0, 0]}
  plate: {row: 0}
"""


@pytest.fixture(scope='module')
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp('points') / 'arm.yaml'
    path.write_text(ks.bundled_robots()['craig_3r'].read_text(encoding='utf-8') + POINTED)
    return str(path)


def joined(values):
    return ','.join(map(str, values))


def document(capsys, *arguments):
    assert main([*arguments, '--json']) == 0
    return json.loads(capsys.readouterr().out)


def test_fk_prints_the_pose_of_a_point_and_judges_it(file, capsys):
    robot = ks.load_robot(file)
    found = document(capsys, 'fk', '--robot', file, f'--q={joined(Q)}', '--of', 'elbow')
    expected = ks.forward_kinematics(robot, Q, of='elbow')
    assert (found['tool_frame'], found['matrix']) == ('elbow', expected.tolist())
    s = ks.singularity(robot.ending_at('elbow'), Q)
    assert found['singularity']['manipulability'] == s.manipulability


def test_fk_at_a_place_of_a_row(file, capsys):
    robot = ks.load_robot(file)
    arguments = ('--of', '2', '--at=0.1,-0.2,0.3')
    found = document(capsys, 'fk', '--robot', file, f'--q={joined(Q)}', *arguments)
    expected = ks.forward_kinematics(robot, Q, of=2, at=(0.1, -0.2, 0.3))
    np.testing.assert_allclose(found['matrix'], expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize('option', ['--axes', '--frame'])
def test_jacobian_of_a_point_in_the_axes_of_another(file, capsys, option):
    robot = ks.load_robot(file)
    arguments = ('--of', 'camera', option, 'elbow', '--at=0,0,0.1', f'--qdot={joined(QDOT)}')
    found = document(capsys, 'jacobian', '--robot', file, f'--q={joined(Q)}', *arguments)
    wanted = {'of': 'camera', 'at': (0, 0, 0.1), 'axes': 'elbow'}
    np.testing.assert_allclose(
        found['jacobian'], ks.jacobian(robot, Q, **wanted), rtol=0, atol=1e-15
    )
    np.testing.assert_allclose(
        found['twist'], ks.twist(robot, Q, QDOT, **wanted), rtol=0, atol=1e-15
    )
    assert found['frame'] == 'elbow'


def test_the_titles_name_point_place_and_axes(file, capsys):
    arguments = ['--q', joined(Q), '--qdot', joined(QDOT), '--of', 'camera', '--axes', '2']
    assert main(['jacobian', '--robot', file, *arguments, '--at', '0,0,0.1']) == 0
    printed = capsys.readouterr().out
    assert 'Jacobian of (0,0,0.1) of camera, axes of row 2' in printed
    assert 'Twist of (0,0,0.1) of camera, axes of row 2' in printed


def test_audit_judges_a_recording_at_a_point(file, tmp_path, capsys):
    recording, robot = tmp_path / 'run.csv', ks.load_robot(file)
    t = np.linspace(0.0, 2.0, 60)
    q = 0.5 * np.sin(np.outer(t, [1.0, 0.7, 0.9]))
    names = ','.join(f'position.{name}' for name in robot.joint_names)
    rows = (','.join(map(repr, map(float, row))) for row in np.column_stack([t, q]))
    recording.write_text('\n'.join([f'stamp,{names}', *rows]))
    assert main(['audit', str(recording), '--robot', file, '--of', 'elbow', '--json', '-']) == 0
    found = json.loads(capsys.readouterr().out)
    assert found['robot'] == 'craig_3r_elbow'
    s = ks.singularity(robot.ending_at('elbow'), q)
    told = found['series']['distance']
    np.testing.assert_allclose(told, s.distance, rtol=0, atol=1e-6)


def test_plot_draws_the_arm_to_a_point(file, tmp_path, monkeypatch, capsys):
    pytest.importorskip('matplotlib')
    monkeypatch.chdir(tmp_path)
    assert main(['plot', file, 'arm', '--of', 'camera']) == 0
    assert capsys.readouterr().out == 'wrote craig_3r_camera_arm.png\n'
    assert (tmp_path / 'craig_3r_camera_arm.png').stat().st_size > 1000


def test_view_of_a_point_needs_its_robot(capsys):
    assert main(['view', '--of', 'elbow']) == 2
    err = capsys.readouterr().err
    assert '--of' in err
    assert '--robot' in err


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (['fk', '--of', 'elbo'], ("--of: unknown point 'elbo'", 'elbow', 'rows 0 to 4')),
        # More digits than Python makes a number of.
        (['fk', '--of', '1' * 5000], ("--of: unknown point '1",)),
        (['fk', '--of', 'plate'], ("--of: no joint moves 'plate'",)),
        (['jacobian', '--at', '1,2'], ("--at: '1,2'", '--at=0.1,0.1,0.1')),
        (['jacobian', '--axes', '9'], ('--axes: axes must', 'camera', 'not 9')),
    ],
)
def test_what_does_not_exist_is_wrong_usage(file, capsys, arguments, words):
    assert main([*arguments, '--robot', file, '--q', joined(Q)]) == 2
    err = capsys.readouterr().err
    assert all(word in err for word in words)
