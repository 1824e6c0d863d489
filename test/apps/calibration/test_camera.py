# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""A camera and a board calibrated with the arm: beside the closed form, in words, refused."""

import json
import re

import numpy as np
import pytest
from calibrated_arms import (
    board_errors,
    board_seen,
    by_closed_form,
    camera_arm,
    measured_arm,
    positions_within,
)
from refusal import refused

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.calibration.corrections import corrected_robot
from kinematics_service.apps.calibration.report import placed_camera, sentences_of
from kinematics_service.apps.checking.hypotheses import quaternions_of
from kinematics_service.errors import CalibrationError
from kinematics_service.kinematics.uncertainty.parameters import parameters_of
from kinematics_service.rigid_motion import inverses, pose_of

BOTH = ('on-tool', 'fixed')
# Without noise (m); what a fit at once is nearer by than the closed form, at the least.
EXACT, NEARER = 1e-9, 3.0


def run(capsys, *argv):
    code = main([*map(str, argv)])
    out, err = capsys.readouterr()
    assert 'Traceback' not in out + err
    return code, out, err


def table(file, arm, poses):
    names = [f'position.{name}' for name in arm.robot.joint_names]
    names += [f'pose.{end}' for end in ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')]
    rows = np.column_stack([arm.q, poses[:, :3, 3], quaternions_of(poses)])
    lines = [','.join(names), *(','.join(map(repr, row)) for row in rows.tolist())]
    file.write_text('\n'.join(lines) + '\n')
    return file


@pytest.mark.parametrize('where', BOTH)
def test_without_noise_the_board_is_where_it_is_seen(where):
    arm = camera_arm(where, 40, 3, noise=(0.0, 0.0))
    found = ks.calibrate(arm.robot, arm.q, arm.poses, camera=where, check=False)
    assert found.accepted
    assert found.known == found.possible == 30
    assert board_errors(arm, where, found)[0] < EXACT


@pytest.mark.parametrize('where', BOTH)
def test_without_errors_of_the_arm_the_closed_form_agrees(where):
    arm = camera_arm(where, 25, 3, noise=(0.0, 0.0), size=0.0)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, camera=where, check=False)
    on_tool, still = by_closed_form(arm, where)
    first, second = placed_camera(found)
    for one, closed, true in ((first, on_tool, arm.on_tool), (second, still, arm.still)):
        assert np.abs(one.pose - closed).max() < EXACT
        assert np.abs(one.pose - true).max() < EXACT


@pytest.mark.slow
@pytest.mark.parametrize('where', BOTH)
def test_at_once_is_nearer_than_the_closed_form_and_as_sure_as_it_says(where):
    ratios, squares, shares = [], [], []
    for seed in range(100, 104):
        arm = camera_arm(where, 25, seed)
        found = ks.calibrate(arm.robot, arm.q, arm.poses, camera=where, check=False)
        fitted, closed = board_errors(arm, where, found)
        ratios.append(closed / fitted)
        count = len(arm.errors)
        error = np.array([one.correction for one in found.parameters[:count]]) - arm.errors
        squares.append(error @ np.linalg.solve(found.covariance[:count, :count], error) / count)
        for one, true in zip(placed_camera(found), (arm.on_tool, arm.still)):
            shares.extend((one.pose - true)[:3, 3] / one.deviation[0])
    assert np.median(ratios) > NEARER
    assert 0.8 < np.mean(squares) < 1.25
    # Of places, by deviations in which the priors of the last row and the first one are.
    assert np.abs(shares).max() < 4.5
    assert 0.6 < np.sqrt(np.mean(np.square(shares))) < 1.4


def test_the_noise_is_that_of_the_board_in_the_camera():
    """Far from the board a turn of the camera is no noise of where the board is."""
    arm = camera_arm('on-tool', 80, 2, noise=(3e-4, 3e-3))
    found = ks.calibrate(arm.robot, arm.q, arm.poses, camera='on-tool', check=False)
    assert 0.8 < found.noise.position / 3e-4 < 1.25
    assert 0.8 < found.noise.rotation / 3e-3 < 1.25
    other = ks.calibrate(arm.robot, arm.q, inverses(arm.poses), check=False)
    assert other.noise.position > 3.0 * found.noise.position


def test_a_picture_that_is_far_off_is_an_outlier():
    arm = camera_arm('on-tool', 30, 6)
    poses = arm.poses.copy()
    poses[11, 0, 3] += 0.02
    found = ks.calibrate(arm.robot, arm.q, poses, camera='on-tool', check=False)
    assert found.outliers == (11,)


@pytest.mark.parametrize('where', BOTH)
def test_a_camera_that_is_elsewhere_is_refused(where):
    arm = camera_arm(where, 30, 7)
    other = BOTH[BOTH.index(where) - 1]
    with refused(CalibrationError, 'tool-axes', 'take calibrate-camera'):
        ks.calibrate(arm.robot, arm.q, arm.poses, camera=other)


PAN_TILT = """robot: pan_tilt
source: made up
convention: standard
units: {angle: deg, length: m}
joints:
  - {name: pan, type: revolute, limits: [-150, 150]}
  - {name: tilt, type: revolute, limits: [-80, 80]}
links:
  - {a: 0, alpha: 90, d: 0, theta: pan}
  - {a: 0, alpha: 0, d: 0, theta: tilt}
"""


@pytest.mark.parametrize(
    ('name', 'where'),
    [*zip(['pan_tilt', 'planar_2r', 'scara_hsr065', 'so101'], [*BOTH, *BOTH])],
)
def test_no_size_of_the_board_is_doubted_that_is_right(name, where):
    robot = ks.robot_from_text(PAN_TILT) if name == 'pan_tilt' else ks.load_robot(name)
    for seed in (1,):
        random = np.random.default_rng([seed, 3])
        table = parameters_of(robot, False).table
        errors = np.array([one.scale for one in table]) * random.normal(size=len(table))
        q = positions_within(robot, 30, seed)
        on_tool = pose_of(random.uniform(-0.06, 0.06, 3), random.uniform(-0.5, 0.5, 3))
        still = pose_of([1.5, 0.3, 0.2], random.uniform(-1.0, 1.0, 3))
        poses = board_seen(corrected_robot(robot, table, errors), q, on_tool, still, where)
        poses[:, :3, 3] += 3e-4 * random.normal(size=(30, 3))
        found = ks.calibrate(robot, q, poses, camera=where)
        assert found.accepted
        assert not any(' times ' in one for one in found.remarks)


@pytest.mark.parametrize('where', BOTH)
def test_a_board_of_another_size_is_named_and_refused(where):
    arm = camera_arm(where, 30, 9)
    for size in (0.97, 1.3) if where == 'fixed' else (1.3,):
        poses = arm.poses.copy()
        poses[:, :3, 3] *= size
        try:
            found = ks.calibrate(arm.robot, arm.q, poses, camera=where)
            sentence = found.refusals[-1]
        except CalibrationError as error:
            sentence = str(error)
        ratio = re.match(r'the squares of the board \D*([0-9.]+) times', sentence)
        assert abs(float(ratio[1]) * size - 1.0) < 0.02


def test_zeros_that_drift_are_no_size_of_the_board():
    """The size is judged beside the drifts, and is found beside them."""
    where = 'on-tool'
    arm = camera_arm(where, 48, 1)
    sessions = np.random.default_rng(17).permutation(np.repeat(np.arange(3), 16))
    q = arm.q + 0.004 * np.random.default_rng(18).normal(size=(3, 6))[sessions]
    for size in (1.0, 0.97):
        poses = arm.poses.copy()
        poses[:, :3, 3] *= size
        options = {'camera': where, 'sessions': sessions}
        found = ks.calibrate(arm.robot, q, poses, **options)
        said = [one for one in (*found.remarks, *found.refusals) if ' times as large ' in one]
        assert len(said) == (size != 1.0)
        assert found.accepted == (size == 1.0)
        # Without the drifts the focal length would seem 0.6 % shorter.
        assert size != 1.0 or all('measured nowhere' in one for one in found.remarks)


def test_what_no_camera_measures_is_refused():
    arm = measured_arm('ur5e', 20)
    with refused(CalibrationError, 'no-orientations', 'camera: on-tool'):
        ks.calibrate(arm.robot, arm.q, arm.poses[:, :3, 3], camera='on-tool')
    with refused(CalibrationError, 'unknown-name', "'hand'", 'on-tool, fixed'):
        ks.calibrate(arm.robot, arm.q, arm.poses, camera='hand')
    with refused(CalibrationError, 'conflict', 'same_point', 'camera'):
        ks.calibrate(arm.robot, arm.q, same_point=20 * ['A'], camera='fixed')
    with refused(CalibrationError, 'conflict', 'qdot, approach'):
        ks.calibrate(arm.robot, arm.q, arm.poses, qdot=arm.q, approach=arm.q)
    assert placed_camera(ks.calibrate(arm.robot, arm.q, arm.poses)) == ()


@pytest.mark.parametrize('where', BOTH)
def test_the_command_says_where_camera_and_board_are(where, tmp_path, capsys):
    arm = camera_arm(where, 25, 8)
    file = table(tmp_path / 'seen.csv', arm, arm.poses)
    mine, found, page = (tmp_path / name for name in ('mine.yaml', 'found.json', 'found.html'))
    outputs = ['--output', mine, '--json', found, '--html', page]
    given = ['calibrate-camera', file, '--robot', 'ur5e', '--stamps', 'none', '--camera', where]
    code, out, err = run(capsys, *given, *outputs)
    assert (code, err) == (0, '')
    on_tool = 'camera' if where == 'on-tool' else 'board'
    assert f'The {on_tool} is at' in out
    assert 'deg in the tool frame;' in out
    assert 'as the camera sees it.' in out
    first, second = json.loads(found.read_text())['camera']
    assert (first['name'], first['frame'], second['frame']) == (on_tool, 'tool', 'base')
    assert np.abs(np.subtract(first['pose'], arm.on_tool)[:3, 3]).max() < 5e-3
    assert 'of the position by pose' in page.read_text()
    code, out, err = run(capsys, 'check', '--strict', mine)
    assert (code, err) == (0, '')
    assert '5 of 5 agree' in out


def test_wrong_options_of_a_camera_are_sentences(tmp_path, capsys):
    arm = camera_arm('on-tool', 25, 8)
    file = table(tmp_path / 'seen.csv', arm, arm.poses)
    given = [
        'calibrate-camera',
        file,
        '--robot',
        'ur5e',
        '--stamps',
        'none',
        '--camera',
        'on-tool',
    ]
    for code, sentence, *options in ((1, 'camera: on-tool needs', '--pose-format', 'position'),):
        found, _, err = run(capsys, *given, *options)
        assert (found, sentence in ' '.join(err.split())) == (code, True), err


def test_other_measurements_name_no_camera():
    arm = measured_arm('ur5e', 20)
    assert not any(
        'camera' in one
        for one in sentences_of(ks.calibrate(arm.robot, arm.q, arm.poses, check=False))
    )
