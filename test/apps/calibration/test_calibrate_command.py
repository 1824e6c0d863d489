# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `calibrate`: tables read as an audit reads them, and robot files that go on."""

import json
import re

import numpy as np
import pytest
from calibrated_arms import measured_arm, positions_within, touching_arm
from recordings import recorded

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.calibration.collecting import CollectedPoses
from kinematics_service.apps.calibration.commands import calibrate_live
from kinematics_service.apps.calibration.corrections import corrected_robot
from kinematics_service.apps.calibration.output import calibration_run
from kinematics_service.apps.calibration.robot_text import CalibrationOrigin, calibrated_text
from kinematics_service.apps.checking.hypotheses import quaternions_of
from kinematics_service.apps.checking.known_poses import pose_errors
from kinematics_service.apps.recordings.readers import table_source
from kinematics_service.estimation.status_text import singularity_status
from kinematics_service.kinematics.uncertainty.parameters import parameters_of
from kinematics_service.robot.file.writing.new_robot import Units, new_robot_text

NOISE = 5e-5
MADE_UP = CalibrationOrigin('made up', '2026-01-01')


def run(capsys, *argv):
    code = main([*map(str, argv)])
    out, err = capsys.readouterr()
    assert 'Traceback' not in out + err
    return code, out, err


def table(file, robot, q, poses, rate=0.0, ends='x y z qx qy qz qw'):
    """Return the file of a table; without a rate it has no stamps, and no lag is looked for."""
    ends = [f'pose.{end}' for end in ends.split()]
    names = [*(f'position.{name}' for name in robot.joint_names), *ends]
    numbers = np.column_stack([poses[:, :3, 3], quaternions_of(poses)])[:, : len(ends)]
    rows = [','.join(map(repr, row)) for row in np.column_stack([q, numbers]).tolist()]
    lines = [','.join(names), *rows]
    if rate:
        stamps = ['stamp', *(f'{1.7e9 + k / rate:.6f}' for k in range(len(q)))]
        lines = [','.join(pair) for pair in zip(stamps, lines)]
    file.write_text('\n'.join(lines))
    return file


@pytest.mark.parametrize('task', ['', '-touch', '-zeros', '-camera', '-live', '-propose'])
def test_each_help_is_one_screen(task, capsys, monkeypatch):
    monkeypatch.setenv('COLUMNS', '100')
    _, out, _ = run(capsys, f'calibrate{task}', '--help')
    lines = out.splitlines()
    assert len(lines) <= 40
    assert max(map(len, lines)) <= 100
    assert (
        f'kinematics_service calibrate{task} ' in out.partition('Examples:')[2] or '-live' in task
    )


def test_a_table_without_stamps_is_of_standing_poses(tmp_path, capsys):
    arm = measured_arm('ur5e', 12, 3e-3)
    file = table(tmp_path / 'seen.csv', arm.robot, arm.q, arm.poses)
    fix = ['--robot', 'ur5e', '--fix', 'offsets,lengths,angles']
    code, out, err = run(capsys, 'calibrate', file, *fix)
    assert (code, err) == (0, '')
    assert f'12 poses of {file}' in out
    # No number is called part of a combination beside as many combinations as numbers.
    assert '12 independent combinations' in out
    assert 'not precise' in out
    assert 'in a combination' not in out
    degrees = table(tmp_path / 'deg.csv', arm.robot, np.degrees(arm.q), arm.poses)
    code, _, err = run(capsys, 'calibrate', degrees, '--robot', 'ur5e')
    assert code == 1
    assert err.startswith(f'{degrees}: the frame check ')
    assert err.rstrip('.\n').endswith('; add --joint-format deg')


@pytest.mark.slow
def test_a_table_of_poses_makes_a_robot_file_that_goes_on(tmp_path, capsys):
    arm = measured_arm('ur5e', 50, NOISE)
    file = table(tmp_path / 'tracker.csv', arm.robot, arm.q, arm.poses, 1.0)
    output, html = tmp_path / 'mine.yaml', tmp_path / 'mine.html'
    options = ['--output', output, '--html', html]
    code, out, err = run(capsys, 'calibrate', file, '--robot', 'ur5e', *options)
    assert (code, err) == (0, '')
    assert html.read_text().count('tracker.csv') == 1
    assert f'ur5e: 50 poses of {file}' in out
    assert 'd2 + d3 + d4' in out
    assert f'wrote {output}' in out
    text = output.read_text()
    assert text.startswith('# Calibrated by kinematics_service ')
    assert '# data: tracker.csv, 50 poses\n' in text
    assert 'a: a2 ' in text  # the nominal number, then its correction
    assert 'expression: sin(q3), approximate: true}' in text
    assert 'calibrated from tracker.csv' in text
    mine = ks.load_robot(output)
    assert mine.rows == arm.robot.rows + 2  # an extra angle on either side of the elbow
    code, out, err = run(capsys, 'check', '--strict', output)
    assert (code, err) == (0, '')
    assert '5 of 5 agree' in out
    target = ks.forward_kinematics(mine, [0.1, -1.2, 1.4, -1.6, -1.2, 0.2])
    solutions = ks.inverse_kinematics(mine, target)
    assert len(solutions) >= 8
    assert all(one.residual < 1e-9 for one in solutions)
    again = run(capsys, 'calibrate', file, '--robot', 'ur5e', '--output', output)
    assert again[0] == 2
    assert f'--output: {output} exists' in ' '.join(again[2].split())


@pytest.mark.parametrize('options', [(), ('--sessions', 'stamp')])
def test_a_calibration_that_makes_other_poses_worse_is_not_written(options, tmp_path, capsys):
    arm = measured_arm('ur5e', 3, NOISE)
    file = table(tmp_path / 'three.csv', arm.robot, arm.q, arm.poses, 1.0)
    output = tmp_path / 'new.yaml'
    options = ['--robot', 'ur5e', *options]
    code, out, err = run(capsys, 'calibrate', file, *options, '--output', output)
    assert (code, err) == (1, '')
    assert not output.exists()
    first = ' '.join(out.partition('\n\n')[0].split())
    assert re.fullmatch(
        r'This is no calibration: the calibration makes other poses worse: held-out errors are '
        r'11\.\d mm with base and tool fitted alone, and 1[12]\.\d mm with the calibrated table; '
        r'measure more poses, far apart \(calibrate-propose\), or fit less \(--fit\); no robot '
        r'file is written without --anyway\.',
        first,
    )
    if options[2:]:
        return
    # More poses are what helps, and they can be proposed.
    code, _, _ = run(capsys, 'calibrate-propose', file, '--robot', 'ur5e', '--count', '2')
    assert code == 0
    code, _, _ = run(capsys, 'calibrate', file, *options, '--output', output, '--anyway')
    assert (code, output.exists()) == (0, True)


@pytest.mark.parametrize('kind', ['', ',position'])
def test_metres_that_are_called_millimetres_are_named(kind, tmp_path, capsys):
    arm = measured_arm('ur5e', 20, NOISE)
    file = table(tmp_path / 'tracker.csv', arm.robot, arm.q, arm.poses)
    options = ['--robot', 'ur5e', '--pose-format', f'mm{kind}']
    code, _, err = run(capsys, 'calibrate', file, *options)
    assert code == 1
    assert 'in metres, not millimetres: ' in err
    assert err.endswith('mm out of --pose-format\n')
    assert 'lengths of the table' not in err


def test_a_camera_that_is_not_placed_is_asked_for_in_a_sentence(capsys):
    code, _, err = run(capsys, 'calibrate-camera', 'seen.csv', '--robot', 'ur5e')
    assert code == 2
    assert '--camera' in err
    assert '..' not in err.replace('...', '')


def angles_table(file, robot, q, poses, order):
    """Return the file of a table whose orientations are three angles, rad."""
    from scipy.spatial.transform import Rotation

    angles = Rotation.from_matrix(poses[:, :3, :3]).as_euler(order)
    names = [*(f'position.{name}' for name in robot.joint_names)]
    names += [f'pose.{end}' for end in ('x', 'y', 'z', 'roll', 'pitch', 'yaw')]
    rows = np.column_stack([q, poses[:, :3, 3], angles])
    lines = [','.join(names)]
    file.write_text('\n'.join([*lines, *(','.join(map(repr, row)) for row in rows.tolist())]))
    return file


@pytest.mark.slow
def test_what_is_no_calibration_is_not_written(tmp_path, capsys):
    arm = measured_arm('ur5e', 12, NOISE, seed=3)
    file = angles_table(tmp_path / 'tracker.csv', arm.robot, arm.q, arm.poses, 'XYZ')
    output, html = tmp_path / 'mine.yaml', tmp_path / 'mine.html'
    options = ['--robot', 'ur5e', '--output', output]
    code, out, err = run(capsys, 'calibrate', file, *options)
    assert code == 1
    assert not output.exists()
    assert '--pose-format XYZ' in err
    # Whoever wants it anyway is told, and the file does not agree with itself.
    code, out, err = run(capsys, 'calibrate', file, *options, '--anyway', '--html', html)
    assert (code, err) == (0, '')
    first = out.partition('\n')[0]
    assert first.startswith('This is no calibration: ')
    assert first.endswith('deg is required; written anyway.')
    assert output.read_text().startswith('# NO CALIBRATION, written anyway: ')
    page = html.read_text()
    assert 'verdict ERROR"><p class="first">This is' in page
    assert max(error.share for error in pose_errors(ks.load_robot(output))) > 1.0


def test_the_noise_of_an_instrument_has_both_units(capsys, tmp_path):
    code, _, err = run(capsys, 'calibrate', 'a.csv', '--robot', 'ur5e', '--noise', '2mm')
    assert code == 2
    assert '--noise:' in err
    assert '2mm,0.3deg' in err


@pytest.mark.slow
@pytest.mark.parametrize(
    'name', ['panda', 'scara_hsr065', 'rrp_elementary', 'offset_stanford_shape']
)
def test_the_text_says_what_was_found_in_every_convention(name):
    arm = measured_arm(name, 20)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    text = ks.bundled_robots()[name].read_text()
    made = calibrated_text(
        found, text, arm.q, arm.poses, CalibrationOrigin('made up', '2026-01-01')
    )
    read = ks.robot_from_text(made)
    assert read.convention == arm.robot.convention
    measured = found.base_offsets[0] @ ks.forward_kinematics(read, arm.q) @ found.tool_offsets[0]
    assert np.abs(measured - arm.poses).max() < 1e-9
    known = read.description.known_poses
    reached = ks.forward_kinematics(read, [one.q for one in known])
    assert len(known) == 5
    assert max(np.abs(T - one.motion.matrix).max() for T, one in zip(reached, known)) < 1e-8


SCREW = """
robot: screw
source: test
convention: standard
units: {angle: deg, length: mm}
joints:
  - {name: j1, variable: q1, type: revolute}
  - {name: j2, variable: q2, type: helical}
links:
  - {a: 300, alpha: 90, d: 100, theta: 30 - q1}
  - {a: 0, alpha: 0, d: 5*q2/360, theta: q2}
"""


@pytest.mark.slow
@pytest.mark.parametrize('name', ['panda', 'rrp_elementary', 'offset_stanford_shape', 'screw'])
def test_gear_ratios_stand_in_the_text_beside_the_nominal_ones(name):
    text = SCREW if name == 'screw' else ks.bundled_robots()[name].read_text()
    robot = ks.robot_from_text(text)
    table = parameters_of(robot, gears=True).table
    q = positions_within(robot, 30, 0)
    true = corrected_robot(robot, table, np.linspace(-1e-3, 2e-3, len(table)))
    measured = ks.forward_kinematics(true, q)
    found = ks.calibrate(robot, q, measured, fit=['all'], fix=['base', 'tool'], check=False)
    made = calibrated_text(found, text, q, measured, MADE_UP)
    assert np.abs(ks.forward_kinematics(ks.robot_from_text(made), q) - measured).max() < 1e-9
    if name == 'screw':
        assert 'theta: 30 - q1 - 0.00' in made
        assert re.search(r'd: 5\*q2/360 [-+] [-0-9.e]+\*q2', made)


@pytest.mark.slow
@pytest.mark.parametrize('convention', ['standard', 'modified', 'elementary', 'shape'])
def test_degrees_and_millimetres_of_a_file_are_kept(convention):
    text = new_robot_text('mine', 6, convention, Units('deg', 'mm'))
    robot = ks.robot_from_text(text)
    q = positions_within(robot, 20, 0)
    measured = ks.forward_kinematics(robot, q + np.radians([0.1, 0.3, -0.2, 0.1, 0.2, 0.1]))
    found = ks.calibrate(robot, q, measured, check=False)
    for frames in ('robot', 'measured'):
        made = calibrated_text(
            found, text, q, measured, CalibrationOrigin('made up', '2026'), frames
        )
        read = ks.robot_from_text(made)
        assert 'units: {angle: deg, length: mm}' in made
        X, Y = np.eye(4), np.eye(4)
        if frames == 'robot':
            X, Y = found.base_offsets[0], found.tool_offsets[0]
        assert np.abs(X @ ks.forward_kinematics(read, q) @ Y - measured).max() < 1e-9


@pytest.mark.slow
def test_a_calibrated_file_goes_on_to_every_command(tmp_path, capsys):
    arm, mine = measured_arm('ur5e', 20, NOISE), tmp_path / 'mine.yaml'
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    text = ks.bundled_robots()['ur5e'].read_text()
    mine.write_text(calibrated_text(found, text, arm.q, arm.poses, MADE_UP))
    code, out, _ = run(capsys, 'check', '--strict', mine)
    assert code == 0
    assert 'elbow = sin(q3), approximate' in out
    q = [0.3, -1.2, 0.02, -1.4, -1.5, 0.2]
    robot = ks.load_robot(mine)
    found = ks.singularity(robot, q)
    # A search found the singular pose: the factor only names it.
    warning = singularity_status(robot, found, found.level, robot.base_frame)
    assert 'elbow (approximately): sin(q3) = 0.02' in warning.sentence
    assert dict(warning.values)['factor_approximate'] == 'true'
    nearest = found.nearest_singular
    values = ks.singularity(robot, nearest).singular_values
    assert values[-1] < 1e-9 * values[0]
    assert abs(found.distance - 0.02) > 1e-4
    code, _, err = run(capsys, 'derive', mine)
    assert code == 1
    assert 'derive the nominal robot file' in err


def test_factors_that_are_no_longer_near_are_left_out():
    robot = ks.load_robot('ur5e')
    parameters = parameters_of(robot).table
    near, far = (
        corrected_robot(robot, parameters, size * np.ones(len(parameters))) for size in (1e-3, 0.3)
    )
    assert near.singularity.factors.names == robot.singularity.factors.names
    assert near.singularity.factors.approximate == (True,) * len(near.singularity.factors.names)
    assert not near.singularity.factors.complete
    assert far.singularity.factors.names == ()


@pytest.mark.slow
def test_tolerances_of_a_robot_file_are_read_and_left_out_of_the_calibrated_one(tmp_path, capsys):
    arm = measured_arm('ur5e', 20, NOISE)
    file = table(tmp_path / 'tracker.csv', arm.robot, arm.q, arm.poses)
    robot, output = tmp_path / 'arm.yaml', tmp_path / 'mine.yaml'
    text = ks.bundled_robots()['ur5e'].read_text()
    robot.write_text(text + 'tolerance: {length: 0.4e-3, of: {d5: 0.2e-3, theta2: 1e-3}}\n')

    def priors(*options):
        options = ['--robot', robot, '--json', '-', '--anyway', *options]
        code, out, err = run(capsys, 'calibrate', file, *options)
        assert code == 0
        assert err.startswith(f'wrote {output}; ' if '--output' in options else '')
        return {one['name']: one['prior'] for one in json.loads(out)['parameters']}

    found = priors('--output', output)
    assert (found['a2'], found['d5'], found['theta2']) == (0.4e-3, 0.2e-3, 1e-3)
    assert found['alpha1'] == np.radians(0.2)
    found = priors('--tolerance', '2mm')
    assert (found['a2'], found['d5'], found['theta2']) == (2e-3, 0.2e-3, 1e-3)
    mine = ks.load_robot(output).description.tolerances
    assert (mine.length, mine.angle, mine.named) == (None, None, ())


@pytest.mark.slow
def test_points_of_the_arm_stay_where_they_are(tmp_path):
    text = ks.bundled_robots()['ur5e'].read_text()
    text += 'points: {elbow: {row: 2, xyz: [0, 0, 0.1]}, wrist: {row: 4, xyz: [0.05, 0, 0]}}\n'
    robot = ks.robot_from_text(text)
    arm = measured_arm('ur5e', 20)
    found = ks.calibrate(robot, arm.q, arm.poses, check=False)
    read = ks.robot_from_text(calibrated_text(found, text, arm.q, arm.poses, MADE_UP))
    for name, row in (('elbow', 2), ('wrist', 6)):
        after = next(one for one in read.description.points if one.name == name)
        assert after.row == row
    # Up to the corrections the points are where the nominal arm has them.
    frames, nominal = (ks.link_frames(one, arm.q[0]) for one in (read, robot))
    assert np.abs(frames[2] - nominal[2]).max() < 0.02
    assert np.abs(frames[6] - nominal[4]).max() < 0.02


@pytest.mark.slow
def test_positions_alone_are_read_where_they_are_asked_for(tmp_path, capsys):
    arm = measured_arm('ur5e', 30, NOISE)
    file = table(tmp_path / 'points.csv', arm.robot, arm.q, arm.poses, 1.0, 'x y z')
    code, out, err = run(
        capsys, 'calibrate', file, '--robot', 'ur5e', '--pose-format', 'position', '--json', '-'
    )
    assert (code, err) == (0, '')
    document = json.loads(out)
    assert document['positions_only']
    assert (document['known'], document['possible']) == (27, 27)
    code, out, err = run(capsys, 'calibrate', file, '--robot', 'ur5e')
    assert code == 1
    assert 'no measured poses' in err
    code, out, err = run(capsys, 'audit', file, '--robot', 'ur5e', '--pose-format', 'position')
    assert code == 0
    assert 'positions without orientations' in out


def test_rows_that_lack_a_number_are_left_out_and_it_is_said(tmp_path, capsys):
    arm = measured_arm('puma560', 30, NOISE)
    q, poses = arm.q.copy(), arm.poses.copy()
    poses[7, 1, 3] = np.nan
    q[20, 2] = np.nan
    file = table(tmp_path / 'tracker.csv', arm.robot, q, poses)
    code, out, _ = run(capsys, 'calibrate', file, '--robot', 'puma560', '--anyway')
    assert code == 0
    assert 'puma560: 28 poses of' in out
    assert '1 of 30 poses are' in out
    assert '1 in rows without joint' in out
    assert 'evenly spread' not in out


def test_a_long_table_is_thinned_and_it_is_said(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(table_source, 'MAX_POSES', 25)
    arm = measured_arm('puma560', 30, NOISE)
    file = table(tmp_path / 'tracker.csv', arm.robot, arm.q, arm.poses)
    code, out, _ = run(capsys, 'calibrate', file, '--robot', 'puma560', '--anyway')
    assert code == 0
    assert '25 of 30 poses are used, evenly spread' in ' '.join(out.split())


@pytest.mark.slow
def test_several_files_have_bases_of_their_own(tmp_path, capsys):
    arm = measured_arm('puma560', 40, NOISE)
    other = arm.poses.copy()
    other[:, 0, 3] += 0.7
    one = table(tmp_path / 'one.csv', arm.robot, arm.q[:20], arm.poses[:20])
    two = table(tmp_path / 'two.csv', arm.robot, arm.q[20:], other[20:])
    output = tmp_path / 'mine.yaml'
    options = ['--robot', 'puma560', '--json', '-', '--output', output, '--anyway']
    code, out, err = run(capsys, 'calibrate', one, two, *options)
    assert code == 0
    document = json.loads(out)
    assert document['known'] == 36
    assert document['errors']['held_out']['position_rms'] < 3 * NOISE
    bases = np.array(document['base_offsets'])
    assert np.abs((bases[1] - bases[0])[:3, 3] - [0.7, 0, 0]).max() < 1e-3
    assert run(capsys, 'check', '--strict', output)[0] == 0


@pytest.mark.slow
def test_a_lag_is_undone_where_the_robot_moves(tmp_path, capsys):
    arm = measured_arm('ur5e', 4)
    t = np.arange(200) / 25.0
    wave = np.array([0.5, 0.7, 0.9, 1.1, 0.6, 0.8])

    def joints(t):
        return [0.2, -1.2, 1.3, -1.0, 1.0, 0.3] + 0.9 * np.sin(t[:, None] * wave + np.arange(6))

    poses = ks.forward_kinematics(arm.true, joints(t - 0.03))
    file = table(tmp_path / 'moving.csv', arm.robot, joints(t), poses, 25.0)
    code, out, err = run(capsys, 'calibrate', file, '--robot', 'ur5e', '--json', '-')
    assert (code, err) == (0, '')
    document = json.loads(out)
    assert any('states: undone' in remark for remark in document['reading'])
    assert document['errors']['held_out']['position_rms'] < 2e-5


def test_poses_are_proposed_among_those_of_a_table_and_in_sight(tmp_path, capsys):
    robot, many = ks.load_robot('ur5e'), tmp_path / 'many.csv'
    q = np.round(np.random.default_rng(2).uniform(-1.5, 1.5, (30, 6)), 4)
    rows = [','.join(['stamp', *(f'position.{name}' for name in robot.joint_names)])]
    rows += [','.join(map(str, [k, *row])) for k, row in enumerate(q.tolist())]
    many.write_text('\n'.join(rows))
    given = ['calibrate-propose', '--robot', 'ur5e', '--count']
    code, out, err = run(capsys, *given, '3', '--among', many)
    assert (code, err) == (0, '')
    chosen = np.array([line.split(',')[1:] for line in out.splitlines()[1:]], dtype=float)
    assert len(chosen) == 3
    assert all(np.any(np.all(q == row, axis=1)) for row in chosen)
    code, _, err = run(capsys, *given, '31', '--among', many)
    assert (code, err.count('\n')) == (1, 1)
    assert err.startswith('only 30 poses')
    code, out, _ = run(capsys, *given, '2', '--line-of-sight', '2,0,1,30deg,-x')
    assert code == 0
    for row in out.splitlines()[1:]:
        pose = ks.forward_kinematics(robot, [float(x) for x in row.split(',')[1:]])
        way = np.array([2.0, 0.0, 1.0]) - pose[:3, 3]
        assert -pose[:3, 0] @ way > np.cos(np.radians(30.1)) * np.linalg.norm(way)


@pytest.mark.slow
def test_proposed_poses_are_a_table_and_a_plan_that_audit_accepts(tmp_path, capsys):
    csv, yaml = tmp_path / 'next.csv', tmp_path / 'next.yaml'
    options = ['--robot', 'ur5e', '--count', '3', '--plan', csv, '--plan', yaml]
    code, out, err = run(capsys, 'calibrate-propose', *options)
    assert (code, err) == (0, '')
    assert out == f'wrote {csv}: 3 poses\nwrote {yaml}: 3 poses\n'
    for file in (csv, yaml):
        code, out, err = run(capsys, 'audit', file, '--robot', 'ur5e', '--fail-on', 'limits')
        assert (code, err) == (0, '')
    code, out, _ = run(capsys, 'calibrate-propose', '--robot', 'ur5e', '--count', '3')
    assert out == csv.read_text()
    code, _, err = run(capsys, 'calibrate', '--robot', 'ur5e')
    assert code == 2
    assert 'give FILE' in err
    assert 'calibrate-propose' in err
    code, _, err = run(capsys, 'calibrate-propose', *options)
    assert code == 2
    assert f'--plan: {csv} exists' in ' '.join(err.split())


def test_wrong_options_are_wrong_usage(tmp_path, capsys):
    arm = measured_arm('ur5e', 20, NOISE)
    file = table(tmp_path / 'tracker.csv', arm.robot, arm.q, np.array(arm.poses))
    code, _, err = run(capsys, 'calibrate', file, '--robot', 'ur5e', '--fix', 'bse')
    assert code == 2
    err = ' '.join(err.split())
    assert '--fit, --fix: ' in err
    assert "'bse'" in err
    assert 'offsets, lengths' in err
    code, _, err = run(capsys, 'calibrate', file, '--robot', 'ur5e', '--tolerance', '3')
    assert code == 2
    code, _, err = run(capsys, 'calibrate', tmp_path / 'none.csv', '--robot', 'ur5e')
    assert code == 1
    assert 'there is no such file' in err


@pytest.mark.usefixtures('without_rclpy')
def test_what_is_wrong_with_live_is_a_sentence(capsys):
    given = ['calibrate-live', '--robot', 'ur5e', '--seconds']
    code, _, err = run(capsys, *given, '-1')
    assert code == 2
    assert '--seconds: -1' in err
    assert '86,400' in err
    code, _, err = run(capsys, 'calibrate', 'a.csv', '--robot', 'ur5e', '--ros-args', '-r', 'a:=b')
    assert code == 2
    assert 'takes no --ros-args' in err
    code, _, err = run(capsys, *given, '10')
    assert code == 1
    assert 'needs ROS 2' in err


@pytest.mark.slow
def test_what_a_controller_knows_of_its_arm_is_found(tmp_path, capsys):
    file = recorded('ur3e_rad') / 'rad_ur3e_25hz.csv'
    output = tmp_path / 'my_ur3e.yaml'
    options = ['--robot', 'ur3e', '--fix', 'base', '--frames', 'measured', '--output', output]
    options += ['--anyway']
    code, out, err = run(capsys, 'calibrate', file, *options)
    assert (code, err) == (0, '')
    assert 'below 1e-6 mm, below 1e-6 deg' in out
    assert run(capsys, 'check', '--strict', output)[0] == 0
    code, out, _ = run(capsys, 'audit', file, '--robot', output, '--json', '-')
    # Now base and tool of the file are those of the controller, too.
    assert json.loads(out)['frames']['as_given']['position_rms'] < 2e-9


HOLES = (('A', (0.4, 0.2, 0.1)), ('B', (-0.3, 0.4, 0.3)))


def touches(file, arm, rows, more=()):
    header = ['stamp', *(f'position.{name}' for name in arm.robot.joint_names), 'hole']
    lines = [','.join(header)]
    lines += [','.join([str(k + 1.0), *map(repr, arm.q[k].tolist()), arm.marks[k]]) for k in rows]
    file.write_text('\n'.join([*lines, *more]) + '\n')
    return file


@pytest.mark.slow
def test_touched_points_make_a_robot_file_that_goes_on(tmp_path, capsys):
    arm = touching_arm('ur5e', HOLES, 20, NOISE)
    one = touches(tmp_path / 'one.csv', arm, range(15), ['', '99.0,1,1,1,1,1,1,'])
    two = touches(tmp_path / 'two.csv', arm, range(15, 40))
    output, document = tmp_path / 'mine.yaml', tmp_path / 'found.json'
    options = ['--robot', 'ur5e', '--point', 'hole', '--output', output]
    code, out, err = run(capsys, 'calibrate-touch', one, two, *options)
    assert (code, err) == (0, '')
    assert f'40 touches of {one}' in out
    assert '1 row names no point' in out
    assert 'The scale of the lengths' in out
    assert 'A, touched 20 times' in out
    text = output.read_text()
    assert 'one.csv, two.csv, 40 touches' in text
    assert 'known_poses:  # the tip' in text
    code, out, err = run(capsys, 'check', '--strict', output)
    assert (code, err) == (0, '')
    assert '5 of 5 agree' in out
    options += ['--force', '--distance', 'A,B=754.983mm', '--json', document]
    code, out, err = run(capsys, 'calibrate-touch', one, two, *options)
    assert (code, err) == (0, '')
    found = json.loads(document.read_text())
    assert (found['known'], found['possible']) == (27, 27)
    assert [point['touches'] for point in found['points']] == [20, 20]
    apart = np.subtract(*(point['position'] for point in found['points']))
    assert abs(np.linalg.norm(apart) - 0.754983) < 1e-5


@pytest.mark.slow
def test_wrong_options_of_touched_points_are_sentences(tmp_path, capsys):
    arm = touching_arm('ur5e', HOLES, 20, NOISE)
    file = touches(tmp_path / 'one.csv', arm, range(40))
    given = ['calibrate-touch', file, '--robot', 'ur5e']
    for code, sentence, *options in (
        (1, "no column 'hol'; the header", '--point', 'hol'),
        (2, 'write for instance A,B=0.25', '--point', 'hole', '--distance', 'A=3'),
        (1, 'touches point C', '--point', 'hole', '--distance', 'A,C=3'),
        (1, "no column 'point'", '--distance', 'A,B=0.25'),
    ):
        found, _, err = run(capsys, *given, *options)
        assert found == code
        assert sentence in ' '.join(err.split())
    few = touches(tmp_path / 'few.csv', arm, [0, 1, 2, 20, 21])
    code, _, err = run(capsys, 'calibrate-touch', few, '--robot', 'ur5e', '--point', 'hole')
    assert code == 1
    assert 'point B: 2 poses' in err
    hole = touches(tmp_path / 'hole.csv', arm, range(40), ['99.0,1,1,,1,1,1,A'])
    code, _, err = run(capsys, 'calibrate-touch', hole, '--robot', 'ur5e', '--point', 'hole')
    assert code == 1
    assert 'row 40, counted from 0,' in err
    bag = tmp_path / 'bag.mcap'
    bag.write_bytes(b'')
    code, _, err = run(capsys, 'calibrate-touch', bag, '--robot', 'ur5e', '--point', 'hole')
    assert code == 1
    assert "column 'hole'" in err


@pytest.mark.parametrize('option', ['--output', '--html', '--json'])
def test_an_output_that_cannot_be_written_is_refused_before_a_robot_is_heard(
    option, tmp_path, capsys
):
    given = ['calibrate-live', '--robot', 'ur5e', option]
    code, _, err = run(capsys, *given, tmp_path / 'none' / 'a.yaml')
    assert code == 2
    assert option in err
    assert str(tmp_path / 'none') in ' '.join(err.split())
    (tmp_path / 'folder.yaml').mkdir()
    code, _, err = run(capsys, *given, tmp_path / 'folder.yaml')
    assert code == 2
    assert 'folder.yaml is a folder' in ' '.join(err.split())


def test_the_measured_poses_are_not_overwritten(tmp_path, capsys):
    file = tmp_path / 'tracker.csv'
    file.write_text('measured')
    for option in ('--output', '--html', '--json'):
        code, _, err = run(capsys, 'calibrate', file, '--robot', 'ur5e', option, file, '--force')
        assert code == 2
        assert f'{option}: {file} is the recording' in ' '.join(err.split())
    assert file.read_text() == 'measured'


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (
            ['-touch', '--distance', 'A,B=755'],
            '755 m, farther|A,B=755mm',
        ),
        (['-touch', '--distance', 'A,B=0.7', '--distance', 'B,A=0.3'], '--distance: B,A'),
        (['', 'holes.csv'], 'FILE: holes.csv|twice'),
        (['', '--tolerance', '0mm'], "--tolerance: '0mm'"),
        (['', '--fit', ''], '--fit: empty'),
        (['', '--html', '-'], '--html: give a file|--json'),
        (['', '--output', '-'], '--output: give a file|--json'),
        (['-zeros', '--html', '-'], '--html: give a file'),
        (['-propose', '--count', '0'], '--count: 0|200'),
        (['', '--own', 'bas'], "--own: 'bas'|base, tool"),
        (
            ['-propose', '--count', '2', '--line-of-sight', '2,0,1'],
            "'2,0,1' is not accepted",
        ),
        (
            ['-propose', '--count', '2', '--line-of-sight', '2,0,1,0'],
            'write for instance 2.5,0,1.2,30',
        ),
        (
            ['-propose', '--count', '2', '--line-of-sight', '2,0,nan,9'],
            "'2,0,nan,9' is not accepted",
        ),
    ],
)
def test_what_cannot_be_meant_is_wrong_usage(options, words, capsys):
    command, *others = options
    given = [f'calibrate{command}', 'holes.csv', '--robot', 'ur5e']
    code, _, err = run(capsys, *given, *others)
    assert code == 2
    err = ' '.join(err.split())
    assert [word for word in words.split('|') if word not in err] == []


@pytest.mark.parametrize(
    ('robot', 'options', 'sentence'),
    [
        ('ur5e', ['--fit', 'theta9'], "'theta9' of ur5e"),
        ('ur5e', ['--fix', 'all'], 'fit, fix: '),
        ('five_bar', [], 'five_bar has closed loops'),
    ],
)
def test_what_no_poses_would_help_is_refused_before_they_are_heard(
    robot, options, sentence, capsys, monkeypatch
):
    def heard(*_):
        raise AssertionError('poses are heard')

    monkeypatch.setattr(calibrate_live, 'collected', heard)
    code, _, err = run(capsys, 'calibrate-live', '--robot', robot, *options)
    assert code == (2 if 'theta9' in options else 1)
    assert sentence in ' '.join(err.split())


@pytest.mark.slow
def test_poses_heard_are_kept_where_their_calibration_is_refused(tmp_path, capsys, monkeypatch):
    arm = measured_arm('ur5e', 20, NOISE)
    stamps = tuple(1_700_000_000_000_000_000 + 1_000_000_001 * k for k in range(20))
    monkeypatch.chdir(tmp_path)

    def heard(count):
        poses = CollectedPoses(
            arm.q[:count], np.zeros((count, 6)), arm.poses[:count], stamps[:count]
        )
        monkeypatch.setattr(calibrate_live, 'collected', lambda *arguments: poses)
        return run(capsys, 'calibrate-live', '--robot', 'ur5e', '--json', '-', '--anyway')

    code, out, _ = heard(20)
    assert code == 0
    assert not list(tmp_path.iterdir())
    with monkeypatch.context() as patch:
        patch.setattr(calibration_run, 'calibrate', interrupted)
        code, _, err = heard(20)
    assert code == 130
    (file,) = tmp_path.iterdir()
    assert '20 poses' in err
    assert f'kept in {file.name}' in err
    options = ['--robot', 'ur5e', '--json', '-', '--anyway']
    _, again, _ = run(capsys, 'calibrate', file.name, *options)
    parameters = [json.loads(text)['parameters'] for text in (out, again)]
    assert parameters[0] == parameters[1]
    file.unlink()
    code, out, err = heard(2)
    assert code == 1
    (file,) = tmp_path.iterdir()
    assert f'kept in {file.name}' in err
    file.unlink()
    with monkeypatch.context() as patch:
        patch.setattr(calibrate_live, 'Path', lambda name: tmp_path / 'no_folder' / name)
        _, _, again = heard(2)
    assert 'kept' not in again
    assert again == err.partition('\n')[2]  # why it was refused, and not why nothing was kept


def interrupted(*arguments, **options):
    raise KeyboardInterrupt
