# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Elasticity of joints and drifts of sessions: parameters with priors, as all others are."""

import json

import numpy as np
import pytest
from arms import robot_of
from calibrated_arms import BASE, TOOL, positions_within, true_arm
from refusal import refused

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.calibration.reading import MeasuredRecording, cells_beside
from kinematics_service.apps.calibration.report import sentences_of
from kinematics_service.errors import CalibrationError
from kinematics_service.rigid_motion import exponential, pose_of

# 6R, 7R, SCARA, with a sliding joint, coupled.
FIVE = ('ur5e', 'kuka_iiwa14', 'scara_hsr065', 'spherical_rrp', 'parallelogram_left')
# Of measured poses, m and rad.
NOISE = 5e-5
# Where the load is in the tool frame, and what it weighs.
AT, KG = (0.02, 0.0, 0.05), 5.0


class Rows:
    """
    Joint positions (N, n) with what the joints are off by, and measured poses (N, 4, 4).

    Parameters
    ----------
    marks : shape (N,)
        The session of each row, from 0.
    off : shape (N, n)
        Where the joints are, from where they say.
    moved : shape (S, 6)
        Where the instrument stands in each session, from where it is: m, rad.
    """

    def __init__(self, name, seed, q, marks, off=0.0, moved=None, noise=NOISE):
        self.robot, self.q, self.marks = robot_of(name), q, marks
        true = true_arm(name, seed, 0.5)[2]
        random = np.random.default_rng([seed, 11])
        moved = np.zeros((np.max(marks) + 1, 6)) if moved is None else moved
        base = np.array([BASE @ pose_of(six[:3], six[3:]) for six in moved])
        self.poses = base[marks] @ ks.forward_kinematics(true, q + off) @ TOOL
        self.poses[:, :3, 3] += noise * random.normal(size=(len(q), 3))
        turned = exponential(noise * random.normal(size=(len(q), 3)))
        self.poses[:, :3, :3] = turned @ self.poses[:, :3, :3]

    def calibrated(self, **options):
        return ks.calibrate(self.robot, self.q, self.poses, check=False, **options)


def torques_of(robot, q, masses, at=AT):
    """Return J^T F of the weights by differences of the height of their centre."""
    step, torques = 1e-6, np.empty_like(q)
    for j in range(robot.dof):
        heights = [
            ks.forward_kinematics(robot, q + way * step * np.eye(robot.dof)[j])
            for way in (1.0, -1.0)
        ]
        raised = [T[:, 2, :3] @ at + T[:, 2, 3] for T in heights]
        torques[:, j] = -9.80665 * masses * (raised[0] - raised[1]) / (2.0 * step)
    return torques


def in_pairs(name, seed, size=1.0, count=25, at=AT, wobble=0.0):
    """Return rows without a load and with one, their masses, and the compliances of the joints."""
    robot, random = robot_of(name), np.random.default_rng([seed, 3])
    positions = positions_within(robot, count, seed)
    q, masses = np.concatenate([positions, positions]), np.repeat([0.0, KG], count)
    slides = np.array(robot.prismatic)
    compliances = size * random.uniform(5e-6, 1e-5, robot.dof) * np.where(slides, 0.1, 1.0)
    off = compliances * torques_of(robot, q, masses, at)
    off = off + wobble * np.sin(q + random.uniform(0.0, 6.0, robot.dof)) * ~slides
    return Rows(name, seed, q, np.zeros(2 * count, dtype=int), off), masses, compliances


def in_sessions(name, seed, drift=0.0, moved=0.0, repeated=True, wobble=0.0):
    """Return rows of three sessions of twenty, and the drifts of the joints (3, n)."""
    robot, random = robot_of(name), np.random.default_rng([seed, 4])
    q = positions_within(robot, 20 if repeated else 60, seed)
    q = np.concatenate([q] * 3) if repeated else q
    marks = np.repeat(np.arange(3), 20)
    drifts = drift * random.normal(size=(3, robot.dof))
    slides = np.array(robot.prismatic)
    off = drifts[marks] + wobble * np.sin(q + random.uniform(0.0, 6.0, robot.dof)) * ~slides
    return Rows(name, seed, q, marks, off, moved * random.normal(size=(3, 6))), drifts


def own_of(found, group):
    return [one for one in found.parameters if one.group == group]


def deviations_off(found, group, true):
    """Return how far identifiable numbers of a group are off the truth, in their deviations."""
    own = own_of(found, group)
    assert len(own) == len(true)
    return [(one.correction - x) / one.deviation for one, x in zip(own, true) if one.identifiable]


def assert_normal(errors, least):
    """Assert that errors in deviations are such: four deviations of their mean square."""
    assert len(errors) > least
    assert np.max(np.abs(errors)) < 4.0
    assert abs(np.mean(np.square(errors)) - 1.0) < 4.0 * np.sqrt(2.0 / len(errors))


def test_compliances_are_found_within_their_deviations():
    errors = []
    for name in ('ur5e', 'kuka_iiwa14', 'spherical_rrp'):
        rows, masses, compliances = in_pairs(name, 0)
        found = rows.calibrated(loads=ks.ToolLoads(masses, AT))
        names = [f'compliance.{joint}' for joint in rows.robot.joint_names]
        assert [one.name for one in own_of(found, 'compliance')] == names
        errors += deviations_off(found, 'compliance', compliances)
    assert_normal(errors, 12)


def test_the_table_is_that_of_the_arm_without_a_load():
    rows, masses, _ = in_pairs('ur5e', 1, size=5.0)
    found = rows.calibrated(loads=ks.ToolLoads(masses, AT))
    loaded = rows.calibrated()

    def off(one):
        q = positions_within(rows.robot, 50, 9)
        true = ks.forward_kinematics(true_arm('ur5e', 1, 0.5)[2], q)
        poses = one.base_offsets[0] @ ks.forward_kinematics(one.calibrated, q)
        left = poses @ one.tool_offsets[0] - BASE @ true @ TOOL
        return float(np.sqrt(np.mean(np.sum(left[:, :3, 3] ** 2, axis=1))))

    assert off(loaded) > 1.5 * off(found)
    # No load turns the first joint: its compliance is not known, and is no combination of others.
    pan, *others = own_of(found, 'compliance')
    assert (pan.unit, pan.identifiable, pan.may_be_zero) == ('rad/Nm', False, True)
    assert not any(one.may_be_zero for one in others[:3])
    assert 'not identifiable: compliance.shoulder_pan_joint' in [
        one.sentence for one in found.combinations
    ]
    assert found.known == found.possible


def test_gravity_may_be_elsewhere():
    # An arm on a wall: the pull is along x of its base, and turns the first joint.
    robot = robot_of('ur5e')
    q = np.concatenate([positions_within(robot, 25, 3)] * 2)
    masses = np.repeat([0.0, KG], 25)
    pull = np.zeros((50, 6))
    pull[:, 0] = 9.80665 * masses
    off = 1e-5 * ks.joint_torques(robot, q, pull, at=AT)
    rows = Rows('ur5e', 3, q, np.zeros(50, dtype=int), off)
    found = rows.calibrated(loads=ks.ToolLoads(masses, AT, (2.0, 0.0, 0.0)))
    assert np.max(np.abs(deviations_off(found, 'compliance', [1e-5] * 6))) < 4.0
    assert own_of(found, 'compliance')[0].identifiable
    # A load that is taken to pull the other way has a sentence.
    found = rows.calibrated(loads=ks.ToolLoads(masses, AT, (-1.0, 0.0, 0.0)))
    assert any('is negative' in sentence for sentence in sentences_of(found))


def test_drifts_are_found_within_their_deviations():
    errors = []
    for name in FIVE[:3]:
        rows, drifts = in_sessions(name, 1, drift=3e-4)
        found = rows.calibrated(sessions=rows.marks)
        names = [f'{k}.{joint}' for k in (1, 2) for joint in rows.robot.joint_names]
        assert [one.name for one in own_of(found, 'zeros')] == names
        errors += deviations_off(found, 'zeros', (drifts[1:] - drifts[0]).ravel())
        beyond = [one.name for one in own_of(found, 'zeros') if not one.may_be_zero]
        words = f'two deviations from zero for {len(beyond)} of {len(names)} numbers ({beyond[0]}'
        assert any(words in sentence for sentence in sentences_of(found))
    assert_normal(errors, 20)


@pytest.mark.parametrize('repeated', [True, False])
def test_an_instrument_that_drifts_is_no_drift_of_the_joints(repeated):
    rows, _ = in_sessions('ur5e', 2, moved=3e-4, repeated=repeated)
    found = rows.calibrated(sessions=rows.marks)
    assert sum(not one.may_be_zero for one in own_of(found, 'placement')) > 6
    assert sum(not one.may_be_zero for one in own_of(found, 'zeros')) < 3
    assert found.held_out.position_rms < 2.5 * NOISE
    assert rows.calibrated().held_out.position_rms > 5.0 * NOISE
    elsewhere = [one for one in found.remarks if 'were measured nowhere else' in one]
    assert len(elsewhere) == (not repeated)
    # A set of its own base has that drift already.
    found = rows.calibrated(sessions=rows.marks, sets=rows.marks)
    assert not own_of(found, 'placement')


def test_what_does_not_differ_lies_within_two_deviations():
    # Of one number in twenty zero is farther by chance.
    own = []
    for name in FIVE[::4]:
        rows, _ = in_sessions(name, 0)
        found = rows.calibrated(sessions=rows.marks)
        own += [*own_of(found, 'placement'), *own_of(found, 'zeros')]
        rows, masses, _ = in_pairs(name, 0, size=0.0)
        own += own_of(rows.calibrated(loads=ks.ToolLoads(masses, AT)), 'compliance')
    assert np.mean([one.may_be_zero for one in own]) > 0.9


def test_load_and_session_are_told_apart():
    rows, masses, compliances = in_pairs('kuka_iiwa14', 5)
    random = np.random.default_rng(0)
    marks = random.integers(0, 2, len(masses))
    drifts = 5e-4 * random.normal(size=(2, 7))
    off = compliances * torques_of(rows.robot, rows.q, masses) + drifts[marks]
    rows = Rows('kuka_iiwa14', 5, rows.q, marks, off)
    found = rows.calibrated(sessions=marks, loads=ks.ToolLoads(masses, AT))
    first = marks[0]
    errors = deviations_off(found, 'zeros', drifts[1 - first] - drifts[first])
    errors += deviations_off(found, 'compliance', compliances)
    assert_normal(errors, 8)


def test_loads_at_other_joint_positions_are_remarked_on():
    # What bends with the posture and what an arm is off by there are alike.
    robot = robot_of('ur5e')
    q, masses = positions_within(robot, 60, 0), np.tile([0.0, KG], 30)
    rows = Rows('ur5e', 0, q, np.zeros(60, dtype=int))
    found = rows.calibrated(loads=ks.ToolLoads(masses, AT))
    assert found.remarks[0].startswith('Most joint positions of the smaller')


@pytest.mark.parametrize(
    ('loads', 'code', 'words'),
    [
        ([2.0] * 50, 'no-variation', ['2 kg']),
        ([0.0] * 25 + [2000.0] * 25, 'wrong-unit', ['2,000 kg', 'not g']),
        ([0.0] * 25 + [-1.0] * 25, 'out-of-range', ['below 0']),
        ([0.0] * 49, 'wrong-shape', ['50 masses', '(49,)']),
        ([0.0] * 49 + [float('nan')], 'out-of-range', ['finite']),
    ],
)
def test_loads_that_cannot_be_are_refused(loads, code, words):
    rows, _, _ = in_pairs('ur5e', 0)
    with refused(CalibrationError, code, 'loads', *words):
        rows.calibrated(loads=ks.ToolLoads(loads))


def test_what_cannot_be_meant_is_refused():
    rows, masses, _ = in_pairs('ur5e', 0)
    for at, gravity in (((0, 0), (0, 0, -1)), ((0, 0, 0), (0, 0, 0)), ((0, 0, np.nan), (0, 0, 1))):
        with refused(CalibrationError, 'out-of-range', 'three finite numbers'):
            rows.calibrated(loads=ks.ToolLoads(masses, at, gravity))
    with refused(CalibrationError, 'no-variation', "'a'"):
        rows.calibrated(sessions=['a'] * 50)
    with refused(CalibrationError, 'wrong-length', '50 rows', '2'):
        rows.calibrated(sessions=['a', 'b'])
    for name in ('base', 'tool2', 'compliance', '', 'a\nlinks:'):
        with refused(CalibrationError, 'reserved-name', f'session {name!r}'):
            rows.calibrated(sessions=['a', name] * 25)
    with refused(CalibrationError, 'conflict', 'same_point'):
        ks.calibrate(rows.robot, rows.q, same_point=['a'] * 50, sessions=['a'] * 50)


def run(capsys, *argv):
    code = main([*map(str, argv)])
    out, err = capsys.readouterr()
    assert 'Traceback' not in out + err
    return code, out, err


def written(file, rows, columns, skipped=()):
    """Write rows with further columns; those skipped have no pose."""
    names = [f'position.{name}' for name in rows.robot.joint_names]
    lines = [','.join([*names, *(f'pose.{k}' for k in range(16)), *columns])]
    for k, (q, pose) in enumerate(zip(rows.q.tolist(), rows.poses)):
        numbers = ['' if k in skipped else repr(x) for x in pose.ravel().tolist()]
        lines.append(','.join([*map(repr, q), *numbers, *(str(x[k]) for x in columns.values())]))
    file.write_text('\n'.join(lines) + '\n')
    return file


def test_columns_name_session_and_load_of_each_row(tmp_path, capsys):
    rows, masses, _ = in_pairs('ur5e', 0)
    days = np.where(np.random.default_rng(1).random(50) < 0.5, 'mon', 'tue')
    # Rows without a pose do not shift the others.
    skipped = (0, 30)
    file = written(tmp_path / 'loads.csv', rows, {'kg': masses, 'day': days}, skipped)
    out, found, page = (tmp_path / name for name in ('arm.yaml', 'found.json', 'found.html'))
    options = ('--stamps', 'none', '--load', 'kg', '--load-at', *AT, '--sessions', 'day')
    outputs = ('--json', found, '--html', page, '--output', out)
    outputs += ('--anyway',)  # without the frame check
    code, text, _ = run(capsys, 'calibrate', file, '--robot', 'ur5e', *options, *outputs)
    assert code == 0
    own = ~np.isin(np.arange(50), skipped)
    same = ks.calibrate(
        rows.robot,
        rows.q[own],
        rows.poses[own],
        sessions=days[own],
        loads=ks.ToolLoads(masses[own], AT),
        check=False,
    )
    document = json.loads(found.read_text())
    keys = ('name', 'group', 'correction', 'deviation', 'may_be_zero')
    assert [tuple(one[key] for key in keys) for one in document['parameters']] == [
        tuple(getattr(one, key) for key in keys) for one in same.parameters
    ]
    assert 'compliance.elbow_joint' in page.read_text()
    text = ' '.join(text.split())
    assert 'Compliances of the joints' in text
    # The file is that of the arm without a load.
    assert np.allclose(
        ks.forward_kinematics(ks.load_robot(str(out)), rows.q),
        ks.forward_kinematics(same.calibrated, rows.q),
        atol=1e-7,
    )


def test_each_file_may_be_a_session(tmp_path, capsys):
    rows, _ = in_sessions('ur5e', 1, drift=3e-4)
    files = []
    for k in range(3):
        own = Rows.__new__(Rows)
        own.robot, own.q = rows.robot, rows.q[rows.marks == k]
        own.poses = rows.poses[rows.marks == k]
        files.append(written(tmp_path / f'day{k}.csv', own, {}))
    code, text, _ = run(
        capsys,
        *('calibrate', *files, '--robot', 'ur5e', '--stamps', 'none'),
        *('--sessions', 'file', '--json', '-', '--anyway'),
    )
    assert code == 0
    groups = {one['name']: one['group'] for one in json.loads(text)['parameters']}
    assert groups['day2.csv.elbow_joint'] == 'zeros'
    # Each file has a base of its own: no other placement is fitted.
    assert 'placement' not in groups.values()


@pytest.mark.parametrize(('file', 'rows'), [('a.mcap', np.arange(2)), ('a.csv', None)])
def test_columns_are_those_of_a_table(file, rows):
    given = MeasuredRecording(file, np.zeros((2, 6)), np.zeros((2, 4, 4)), '', None, (), rows)
    with refused(CalibrationError, 'not-a-table', file, "'kg'"):
        cells_beside(given, 'kg')


@pytest.mark.parametrize(
    ('options', 'code', 'sentence'),
    [
        (('--load', 'mass'), 1, "no column 'mass'; the header"),
        (('--load', 'day'), 1, "column 'day': not a mass"),
        (('--sessions', 'gap'), 1, "column 'gap': row 3,"),
        (('--load-at', 0, 0, 1), 2, 'give --load COLUMN too'),
        (('--sessions', 'file'), 1, 'all rows are of session'),
    ],
)
def test_wrong_columns_are_sentences(options, code, sentence, tmp_path, capsys):
    rows, masses, _ = in_pairs('ur5e', 0)
    gap = ['' if k == 3 else 'a' for k in range(50)]
    columns = {'kg': masses, 'day': ['mon', 'tue'] * 25, 'gap': gap}
    file = written(tmp_path / 'loads.csv', rows, columns)
    found, _, err = run(capsys, 'calibrate', file, '--robot', 'ur5e', '--stamps', 'none', *options)
    assert found == code
    assert sentence in ' '.join(err.split())
