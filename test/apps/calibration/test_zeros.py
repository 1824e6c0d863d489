# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The zeros of joints by touches of a printed sheet: what is found, and what is not known."""

import functools
import json
import math
import re

import numpy as np
import pytest
from arms import robot_of
from calibrated_arms import sheet_touches
from refusal import refused

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.calibration.output.sheet import SHEETS
from kinematics_service.apps.calibration.zeros import calibrate_zeros, zeros_of
from kinematics_service.errors import CalibrationError
from kinematics_service.rigid_motion import pose_of

# Where the sheet lies before an SO-101, hardly turned.
PLACE = pose_of([0.0, -0.25, 0.0], (0.0, 0.0, 0.1))
# A touch (m, of each number: 1 mm in all), and the play of the joints.
TOUCH, PLAY = 6e-4, np.radians(0.5)
# Without noise zeros (rad) are found but for the pull of priors of 10 degrees.
EXACT = 1e-5


def run(capsys, *argv):
    code = main([*map(str, argv)])
    out, err = capsys.readouterr()
    assert 'Traceback' not in out + err
    return code, out, err


@functools.cache
def touches_of(seed, each=2, noise=TOUCH, play=PLAY, **options):
    return sheet_touches(robot_of('so101'), PLACE, each, noise, play, seed, **options)


@functools.cache
def found_by(seed):
    """Return touches whose play nothing tells, and what is found by them."""
    touches = touches_of(seed)
    return touches, calibrate_zeros(touches.robot, touches.q, touches.points)


@pytest.fixture(scope='module')
def exact():
    return touches_of(1, noise=0.0, play=0.0, size=np.radians(9.0))


def known_errors(touches, found):
    """Return how far the zeros that are known are off, in rad (m), and in their deviations."""
    pairs = [(one, true) for one, true in zip(zeros_of(found), touches.zeros) if one.known]
    errors = np.array([one.correction - true for one, true in pairs])
    return errors, errors / np.array([one.deviation for one, _ in pairs])


def test_without_noise_zeros_are_found_and_what_the_sheet_hides_stays(exact):
    found = calibrate_zeros(exact.robot, exact.q, exact.points)
    assert found.accepted
    zeros = zeros_of(found)
    assert [one.known for one in zeros] == [False, True, True, True, False]
    # The sheet may be turned about the first axis, and the tip about the last one.
    assert zeros[0].correction == zeros[4].correction == 0.0
    errors, _ = known_errors(exact, found)
    assert np.abs(errors).max() < EXACT
    assert 'shoulder_pan: the zero is not' in zeros[0].sentence


@pytest.mark.parametrize(
    ('name', 'place', 'each', 'known'),
    [
        ('scara_hsr065', [0.4, 0.1, 0.3], 2, 1),
        # Rows that turn by several joints: nothing is claimed.
        ('parallelogram_left', [0.4, 0.0, 0.0], 1, 0),
    ],
)
def test_a_zero_that_is_called_known_is_right(name, place, each, known):
    robot = robot_of(name)
    size = np.where(robot.prismatic, 0.01, np.radians(3.0))
    sheet = pose_of(place, (0.0, 0.0, 0.3))
    touches = sheet_touches(robot, sheet, each, 0.0, 0.0, 2, size)
    found = calibrate_zeros(robot, touches.q, touches.points)
    errors, _ = known_errors(touches, found)
    assert len(errors) >= known
    assert np.abs(errors).max(initial=0.0) < EXACT


@pytest.mark.slow
def test_zeros_are_as_sure_as_they_say():
    """24 touches, 0.5 degrees of backlash that nothing tells, 1 mm of touch."""
    errors, shares = [], []
    for seed in (1, 2, 4):
        off, share = known_errors(*found_by(seed))
        errors.extend(off)
        shares.extend(share)
    assert len(errors) >= 8
    assert np.degrees(np.sqrt(np.mean(np.square(errors)))) < 0.3
    assert np.abs(shares).max() < 4.0
    assert 0.4 < np.mean(np.square(shares)) < 1.4


@pytest.mark.slow
def test_the_way_joints_came_tells_the_backlash_and_sharpens_the_zeros():
    errors, plays = [], []
    for seed in (1, 2, 4):
        touches = touches_of(seed)
        found = calibrate_zeros(
            touches.robot, touches.q, touches.points, approach=7.0 * touches.approach
        )
        errors.extend(known_errors(touches, found)[0])
        play = found.parameters[-1]
        assert play.name == 'backlash'
        assert abs(play.correction - PLAY) < 4.0 * play.deviation
        plays.append(play.correction)
    assert np.mean(np.abs(np.degrees(errors)) < 0.3) > 0.9
    assert abs(np.mean(plays) - PLAY) < 0.1 * PLAY


def test_few_touches_do_not_pretend():
    touches = touches_of(3, each=1, crosses=('A1', 'C2', 'B3', 'A4'))
    found = calibrate_zeros(touches.robot, touches.q, touches.points)
    assert not any(one.known for one in zeros_of(found))


def test_what_is_no_matter_of_zeros_is_refused(exact):
    with refused(CalibrationError, 'wrong-unit', 'degrees, not radians'):
        calibrate_zeros(exact.robot, np.degrees(exact.q), exact.points)
    with refused(CalibrationError, 'another-robot', 'half of'):
        calibrate_zeros(exact.robot, exact.q, np.roll(exact.points, 4, axis=0))


def test_a_sheet_that_lies_the_other_way_round_makes_no_difference(exact):
    for points in (
        exact.points * [-1.0, -1.0, 1.0],
        exact.points @ pose_of([0] * 3, (0, 0, 2.0))[:3, :3],
    ):
        found = calibrate_zeros(exact.robot, exact.q, points)
        assert np.abs(known_errors(exact, found)[0]).max() < EXACT


def test_a_cross_that_was_not_meant_is_an_outlier():
    touches = touches_of(3)
    points = touches.points.copy()
    points[7] = SHEETS['a4'].points['C4']
    found = calibrate_zeros(touches.robot, touches.q, points)
    assert found.outliers == (7,)


def test_the_sheets_have_the_same_crosses_inside_the_paper():
    assert len(SHEETS['a4'].points) == 12
    assert SHEETS['a4'].points == SHEETS['letter'].points
    for sheet in SHEETS.values():
        for x, y, z in sheet.points.values():
            assert max(abs(x) - 5e-4 * sheet.width, abs(y) - 5e-4 * sheet.height) < -0.015
            assert z == 0.0
        assert f'width="{sheet.width:g}mm" height="{sheet.height:g}mm"' in sheet.page
        assert sheet.page.count('<text') == 12 + 5


def table(file, touches, velocities=False):
    names = touches.robot.joint_names
    header = ['point', *(f'position.{name}' for name in names)]
    rows = touches.q
    if velocities:
        header += [f'velocity.{name}' for name in names]
        rows = np.column_stack([rows, 0.1 * touches.approach])
    lines = [','.join([mark, *map(repr, row)]) for mark, row in zip(touches.names, rows.tolist())]
    file.write_text('\n'.join([','.join(header), *lines]) + '\n')
    return file


def servos(file, **changes):
    names = robot_of('so101').joint_names
    one = {'drive_mode': 0, 'homing_offset': 10, 'range_min': 800, 'range_max': 3300, **changes}
    content = {name: {'id': k + 1, **one} for k, name in enumerate((*names, 'gripper'))}
    file.write_text(json.dumps(content))
    return file


def test_the_command_writes_the_sheet_the_arm_and_its_servos(tmp_path, capsys):
    sheet = tmp_path / 'sheet.html'
    given = ['calibrate-zeros', '--robot', 'so101']
    code, out, err = run(capsys, *given, '--sheet', 'letter', '--html', sheet)
    assert (code, out, err) == (0, f'wrote {sheet}\n', '')
    assert 'LETTER' in sheet.read_text()
    touches = touches_of(4)
    file, document = tmp_path / 'touches.csv', tmp_path / 'found.json'
    table(file, touches, velocities=True)
    old, new, arm = servos(tmp_path / 'old.json'), tmp_path / 'new.json', tmp_path / 'mine.yaml'
    options = ['--stamps', 'none', '--motors', old, new, '--output', arm, '--json', document]
    code, out, err = run(capsys, *given, file, *options)
    assert (code, err) == (0, '')
    assert 'shoulder_pan: the zero is not' in out
    assert re.search(r'of the joints is 0\.\d+ deg', out)
    assert re.search(r'elbow_flex: to be added is [+-][\d.]+ deg', out)
    zeros = json.loads(document.read_text())['zeros']
    assert [one['known'] for one in zeros] == [False, True, True, True, False]
    found = [one['correction'] for one in zeros]
    assert np.abs(found[1:4] - touches.zeros[1:4]).max() < np.radians(0.5)
    before, after = (json.loads(one.read_text()) for one in (old, new))
    ticks = [after[name]['homing_offset'] - before[name]['homing_offset'] for name in before]
    expected = -touches.zeros[1:4] * 4095 / math.tau
    assert np.abs(ticks[1:4] - expected).max() < np.radians(0.5) * 4095 / math.tau
    assert ticks[0] == ticks[4] == ticks[5] == 0
    # What the servos report then is right with the nominal arm: its zeros are those of the file.
    moved = ks.forward_kinematics(ks.load_robot(arm), touches.q)
    right = ks.forward_kinematics('so101', touches.q - np.r_[ticks[:5]] * math.tau / 4095)
    assert np.abs(moved - right).max() < 5e-4
    code, out, err = run(capsys, 'check', '--strict', arm)
    assert (code, err) == (0, '')


def test_a_servo_that_counts_the_other_way_is_moved_the_other_way(tmp_path, capsys):
    file = table(tmp_path / 'touches.csv', touches_of(4))
    given = ['calibrate-zeros', '--robot', 'so101', '--stamps', 'none', file]
    offsets = []
    for mode in (0, 1):
        new = tmp_path / f'new{mode}.json'
        old = servos(tmp_path / 'old.json', drive_mode=mode, homing_offset=0)
        assert run(capsys, *given, '--motors', old, new)[0] == 0
        offsets.append([one['homing_offset'] for one in json.loads(new.read_text()).values()])
    assert any(offsets[0])
    assert np.array_equal(offsets[0], np.negative(offsets[1]))


def test_no_sheet_is_made_for_an_arm_with_closed_loops(tmp_path, capsys):
    sheet = tmp_path / 'sheet.html'
    code, _, err = run(capsys, 'calibrate-zeros', '--robot', 'excavator', '--html', sheet)
    assert (code, sheet.exists()) == (1, False)
    assert 'excavator has closed loops' in ' '.join(err.split())


def test_wrong_options_of_zeros_are_sentences(tmp_path, capsys):
    file = table(tmp_path / 'touches.csv', touches_of(4))
    new = tmp_path / 'new.json'
    old = servos(tmp_path / 'old.json', homing_offset=2047)
    bad = tmp_path / 'bad.json'
    bad.write_text('{"elbow_flex": {}}')
    zeros = [file, '--stamps', 'none']
    for code, sentence, *options in (
        (2, 'No such option: --fit', *zeros, '--fit', 'offsets'),
        (2, 'give FILE with touches'),
        (2, 'exists; give another name', *zeros, '--motors', old, old),
        (1, 'not a calibration of servos', *zeros, '--motors', bad, new),
        (1, 'homing_offset would be', *zeros, '--motors', old, new),
        (1, "no column 'hole'", *zeros, '--point', 'hole'),
    ):
        found, _, err = run(capsys, 'calibrate-zeros', '--robot', 'so101', *options)
        assert (found, sentence in ' '.join(err.split())) == (code, True), err
    file.write_text(file.read_text().replace('B2', 'D2', 1))
    found, _, err = run(capsys, 'calibrate-zeros', '--robot', 'so101', *zeros)
    assert found == 1
    assert "'D2'; the sheet has A1" in ' '.join(err.split())
