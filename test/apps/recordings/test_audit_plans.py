# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What an audit says of plans between their points: sentences, JSON, page, exit code."""

import json

import numpy as np
import pytest
from arms import robot_of

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.recordings.audit.plan_findings import rounded_down, rounded_up
from kinematics_service.apps.recordings.audit.planned import _full_turns
from kinematics_service.apps.recordings.readers.between_points import PlannedTrajectory
from kinematics_service.robot.measures import Level

JOINTS = robot_of('ur5e').joint_names
START = [0.0, -1.2, 1.4, -1.6, 0.6, 0.0]


def trajectory(*points, names=JOINTS, **more):
    """Return a JointTrajectory as a mapping; a point is its time and changes of START by joint."""
    rows = []
    for k, (time, changes) in enumerate(points):
        positions = [changes.get(j, value) for j, value in enumerate(START)]
        row = {'positions': positions, 'time_from_start': time}
        rows.append(row | {key: values[k] for key, values in more.items()})
    return {'joint_names': list(names), 'points': rows}


def write(tmp_path, *trajectories):
    file = tmp_path / 'plan.json'
    file.write_text(json.dumps(list(trajectories) if len(trajectories) > 1 else trajectories[0]))
    return file


def audited(capsys, file, *options):
    """Return exit code, printed sentences and the document of an audit."""
    written = file.with_name('found.json')
    code = main(['audit', str(file), '--robot', 'ur5e', '--json', str(written), *options])
    return code, capsys.readouterr().out, json.loads(written.read_text())


def test_a_dip_that_samples_step_over_is_refuted(tmp_path, capsys):
    # A MoveIt plan: a point 4 ms from the others, through the wrist's singular pose.
    points = (0.0, {}), (5.001, {}), (5.005, {4: -0.3}), (5.009, {}), (10.0, {})
    plan = trajectory(*points)
    code, out, found = audited(capsys, write(tmp_path, {'joint_trajectory': plan}))
    assert code == 1
    assert 'ERROR  Refuted: at 5.00' in out.splitlines()[1]
    assert 'a singular pose (wrist) (0.03' in out
    (check,) = found['plans']
    told = check['singularity']
    assert (check['verdict'], told['verdict']) == ('refuted', 'refuted')
    nearest = np.array(told['nearest_singular'])
    assert np.linalg.norm(nearest - told['q']) == pytest.approx(told['distance_found'], abs=1e-12)
    assert told['distance_found'] < 0.03
    assert abs(nearest[4]) < 1e-6
    assert found['level'] == 'ERROR'
    assert found['verdict'][0]['sentence'].startswith('Refuted')


def test_a_plan_of_one_point_is_judged_at_it(tmp_path, capsys):
    code, out, found = audited(capsys, write(tmp_path, trajectory((0.0, {4: 0.25}))))
    assert code == 0
    assert 'its 1 sample: the nearest is distance 0.25 rad' in out
    assert (found['series']['t'], found['series']['qdot']) == ([0.0], [[0.0] * 6])


def test_an_ordinary_plan_is_proved(tmp_path, capsys):
    plan = trajectory((0.0, {}), (3.0, {0: 0.4, 4: 0.3}))
    code, out, found = audited(capsys, write(tmp_path, plan))
    assert code == 0
    told = found['plans'][0]['singularity']
    least = told['distance_proved']
    assert 0.03 < least <= 0.3
    assert f'keeps {rounded_down(least)} rad or more' in out
    assert {(one['limits'], one['speed']) for one in found['plans'][0]['joints']} == {
        ('proved', 'proved')
    }
    assert 'OK  Proved, between its points' in out
    robot = robot_of('ur5e')
    q = [point['positions'] for point in plan['points']]
    assert ks.check_plan(robot, [0.0, 3.0], q).singularity.lower == least


def test_what_is_proved_of_some_trajectories_is_said_of_no_others(tmp_path, capsys):
    fine = trajectory((0.0, {}), (3.0, {0: 0.4, 4: 0.3}))
    swings = trajectory((0.0, {}), (3.0, {0: 1e120}))
    file = write(tmp_path, swings, fine, fine)
    code, out, found = audited(capsys, file)
    assert code == 1
    said = ' '.join(out.split())
    assert 'ERROR Trajectory 1 of 3 is not checked' in said
    (refusal,) = (one for one in found['verdict'] if one['code'])
    assert (refusal['level'], refusal['code']) == ('ERROR', 'too-large')
    assert JOINTS[0] in refusal['sentence']
    proved = [line for line in out.splitlines() if 'Proved' in line]
    assert len(proved) == 2
    assert all(line.startswith('OK  Of 2 of 3') for line in proved)
    assert [plan['trajectory'] for plan in found['plans']] == [2, 3]
    code, out, _ = audited(capsys, file, '--speed-of', '3')
    assert 'Trajectory 2 of 3: The largest' in ' '.join(out.split())


def test_limits_that_a_file_does_not_give_are_not_kept(tmp_path, capsys):
    points = [{'positions': [0.1 * k, 1.0], 'time_from_start': float(k)} for k in range(3)]
    file = tmp_path / 'plan.json'
    file.write_text(json.dumps({'joint_names': ['q1', 'q2'], 'points': points}))
    assert main(['audit', str(file), '--robot', 'planar_2r']) == 0
    out = capsys.readouterr().out
    assert 'keep their' not in out
    assert 'no limits and no speeds of joints' in out
    assert 'at its 21 samples' in out


def test_what_is_not_decided_fails_unless_it_is_allowed(tmp_path, capsys):
    plan = write(tmp_path, trajectory((0.0, {4: 0.0300001}), (3.0, {0: 0.4, 4: 0.0300001})))
    code, out, found = audited(capsys, plan)
    assert code == 1
    assert 'WARN  Not decided in 1 interval (3 s)' in out
    assert found['plans'][0]['singularity']['undecided'] == [[0.0, 3.0]]
    assert audited(capsys, plan, '--fail-on', 'stop')[0] == 0
    assert audited(capsys, plan, '--fail-on', 'undecided')[0] == 1
    assert audited(capsys, plan, '--fail-on', 'never')[0] == 0


def test_fail_on_warn_decides_at_that_threshold(tmp_path, capsys):
    plan = write(tmp_path, trajectory((0.0, {4: 0.4}), (3.0, {0: 0.4, 4: 0.09})))
    code, _, found = audited(capsys, plan)
    assert (code, found['plans'][0]['singularity']['distance_asked']) == (0, 0.03)
    code, _, found = audited(capsys, plan, '--fail-on', 'warn')
    told = found['plans'][0]['singularity']
    assert (code, told['verdict'], told['distance_asked']) == (1, 'refuted', 0.1)


def test_speeds_of_tool_frames_and_joints_have_a_limit(tmp_path, capsys):
    plan = write(tmp_path, trajectory((0.0, {}), (3.0, {0: 0.4, 1: -1.3})))
    code, out, found = audited(
        capsys, plan, '--speed-limit', '0.25', '--speed-of', 'elbow_joint,3'
    )
    assert code == 0
    for point in ('the tool', 'elbow_joint', 'frame 3'):
        assert f'OK  Proved: {point} keeps below' in out
    tool, elbow, _ = found['plans'][0]['speeds']
    assert (tool['of'], tool['limit'], elbow['of']) == ('tool', 0.25, 'elbow_joint')
    sampled = max(np.linalg.norm(twist[:3]) for twist in found['series']['twist'])
    assert tool['lower'] <= sampled * 1.001
    assert sampled <= tool['upper'] <= 1.0101 * tool['lower']
    too_fast = str(0.99 * tool['lower'])
    code, out, _ = audited(capsys, plan, '--speed-limit', too_fast)
    assert code == 1
    assert 'ERROR  Refuted: the tool' in out
    assert audited(capsys, plan, '--speed-limit', too_fast, '--fail-on', 'stop')[0] == 0
    assert audited(capsys, plan, '--speed-limit', too_fast, '--fail-on', 'speed')[0] == 1
    # Without a limit the bracket is told for what is asked.
    code, out, _ = audited(capsys, plan, '--speed-of', '3')
    assert code == 0
    assert 'largest speed of frame 3 is' in out


def test_limits_and_joint_speeds_are_those_between_the_points(tmp_path, capsys):
    rates = [[0.0, 0.0, 2.0, 0.0, 0.0, 0.0], [0.0, 0.0, -2.0, 0.0, 0.0, 0.0]]
    # The cubic is 1e-3 beyond the limit for a moment.
    away = 2.0 * 0.1 / 4.0 - 1e-3
    elbow = robot_of('ur5e').limits[2, 1] - away
    points = (0.0, {2: elbow}), (0.1, {2: elbow})
    code, out, found = audited(
        capsys, write(tmp_path, trajectory(*points, velocities=rates)), '--fail-on', 'limits'
    )
    assert code == 1
    assert 'ERROR  Beyond its limits: elbow_joint.' in out
    told = found['plans'][0]['joints'][2]
    assert (told['limits'], told['speed']) == ('refuted', 'proved')
    assert told['greatest']['value'] == pytest.approx(robot_of('ur5e').limits[2, 1] + 1e-3)
    assert told['greatest']['t'] == pytest.approx(0.05)


def test_each_trajectory_of_a_file_has_its_verdict(tmp_path, capsys):
    fine = trajectory((0.0, {}), (3.0, {0: 0.4}))
    # Other joints and another order, as from a plan for an arm with its gripper.
    names = ('gripper', *JOINTS[::-1])
    bad = {
        'joint_names': list(names),
        'points': [
            {'positions': [0.0, *START[::-1]], 'time_from_start': 0.5},
            {'positions': [0.1, 0.0, -0.6, *START[3::-1]], 'time_from_start': 1.5},
        ],
    }
    code, out, found = audited(capsys, write(tmp_path, fine, bad, fine))
    assert code == 1
    assert [plan['verdict'] for plan in found['plans']] == ['proved', 'refuted', 'proved']
    assert 'ERROR  Trajectory 2 of 3: Refuted' in out
    assert found['plans'][1]['singularity']['point'] == 0
    assert found['plans'][1]['singularity']['t'] == pytest.approx(1.0, abs=1e-3)


def test_the_page_shows_the_verdicts(tmp_path, capsys):
    page = tmp_path / 'plan.html'
    plan = write(tmp_path, trajectory((0.0, {}), (3.0, {4: -0.6})))
    main(['audit', str(plan), '--robot', 'ur5e', '--html', str(page), '--speed-limit', '2'])
    text = page.read_text()
    assert '<h2>Between the points</h2>' in text
    assert '&#9632; refuted</span>' in text
    assert 'the tool below 2 m/s' in text
    assert 'no safety function' in text
    capsys.readouterr()


@pytest.mark.parametrize(
    ('option', 'value', 'words'),
    [
        ('--speed-limit', '0', ('0 m/s',)),
        ('--speed-of', 'elbow', ("ur5e has no point 'elbow'", 'give tool')),
        ('--speed-of', '7', ('0 to 6',)),
        ('--fail-on', 'undecidable', ("'undecidable'", 'never, warn, stop, undecided')),
        ('--fail-on', 'never,stop', ("'never,stop'", 'never alone')),
    ],
)
def test_wrong_questions_are_refused(capsys, option, value, words):
    assert main(['audit', 'plan.json', '--robot', 'ur5e', option, value]) == 2
    said = ' '.join(capsys.readouterr().err.split())
    for word in (f'{option}: ', *words):
        assert word in said


def test_a_recording_is_asked_for_no_speeds(tmp_path, capsys):
    file = tmp_path / 'run.csv'
    names = ','.join(f'position.{name}' for name in JOINTS)
    rows = [f'{100 + 0.01 * k},' + ','.join(map(str, START)) for k in range(20)]
    file.write_text('\n'.join([f'stamp,{names}', *rows]))
    assert main(['audit', str(file), '--robot', 'ur5e', '--speed-limit', '1']) == 1
    assert f'{file}: --speed-limit' in capsys.readouterr().err
    code, out, found = audited(capsys, file)
    assert (code, found['plans']) == (0, [])
    assert 'roved' not in out


def test_numbers_of_proofs_are_rounded_to_the_safe_side():
    assert (rounded_down(0.123456), rounded_up(0.123411)) == ('0.1234', '0.1235')
    assert (rounded_down(0.0), rounded_up(float('inf'))) == ('0', 'inf')
    random = np.random.default_rng(0)
    for value in np.exp(random.uniform(-9.0, 9.0, 300)).tolist():
        assert float(rounded_down(value)) <= value * (1.0 + 1e-15)
        assert float(rounded_up(value)) >= value * (1.0 - 1e-15)


@pytest.mark.parametrize(
    ('points', 'joint', 'words'),
    [
        # A full turn in one step, over several, more than one needs, and back again.
        ([0.4, 0.4 - 2 * np.pi], 5, ('-360.0 deg', '0.000 to 2.000 s', 'ends where')),
        ([0.4, *(0.4 + np.linspace(0.5, 2 * np.pi, 9))], 5, ('by 360.0 deg', '0.000 to 18.000 s')),
        ([2.0, 2.3, -3.8, -3.9], 5, ('-349.5 deg', '2.000 to 4.000 s', ' 10.5 deg')),
        ([0.4, 3.4, 0.4, -2.6, 0.4], 5, ()),
        ([-1.5, 1.5], 0, ()),
        # The shorter way would leave the limits later on, or at once.
        ([-3.0, 3.1, 6.0], 5, ('by 349.5 deg', '0.000 to 2.000 s', '-10.5 deg')),
        ([-6.2, 0.0, 6.2], 5, ('by 355.2 deg', '0.000 to 2.000 s')),
        ([-6.2, 6.2, -6.2], 5, ()),
    ],
)
def test_a_useless_full_turn_is_remarked(points, joint, words):
    robot = robot_of('ur5e')
    q = np.tile(START, (len(points), 1))
    q[:, joint] = points
    plan = PlannedTrajectory(JOINTS, 2.0 * np.arange(len(points)), q, None, None)
    remarks = list(_full_turns(robot, plan, 'The plan'))
    assert [one.level for one in remarks] == ([Level.WARN] if words else [])
    for one in remarks:
        for word in (f'The plan turns {JOINTS[joint]} ', *words):
            assert word in one.text


def test_a_full_turn_is_a_finding(tmp_path, capsys):
    plan = trajectory((0.0, {5: 0.4}), (2.0, {5: 0.4 - 2 * np.pi}))
    _, out, _ = audited(capsys, write(tmp_path, plan), '--fail-on', 'never')
    assert f'WARN  The plan turns {JOINTS[5]} ' in out
