"""Elasticity of joints and drifts of sessions: found, and kept only where they help."""

import json

import numpy as np
import pytest
from arms import robot_of
from calibrated_arms import BASE, TOOL, positions_within, true_arm

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.diagnosis.calibration.report import sentences_of
from kinematics_service.errors import CalibrationError
from kinematics_service.rigid_motion import exponential, pose_of

# 6R, 7R, SCARA, with a sliding joint, coupled.
FIVE = ('ur5e', 'kuka_iiwa14', 'scara_hsr065', 'spherical_rrp', 'parallelogram_left')
# Of measured poses, m and rad.
NOISE = 5e-5
# Where nothing is to be found: 7R, SCARA, coupled.
THREE = (*FIVE[1:3], FIVE[4])
# Where the load is in the tool frame, and what it weighs.
AT, KG = (0.02, 0.0, 0.05), 5.0
# Of some fifty numbers one may be beyond three deviations; four deviations of their mean square.
WITHIN, MEAN_SQUARE = 0.97, 0.8


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


def in_sessions(name, seed, drift=0.0, moved=0.0, repeated=True, wobble=0.0, order=None):
    """Return rows of three sessions of twenty, and the drifts of the joints (3, n)."""
    robot, random = robot_of(name), np.random.default_rng([seed, 4])
    q = positions_within(robot, 20 if repeated else 60, seed)
    q = np.concatenate([q] * 3) if repeated else q
    marks = np.repeat(np.arange(3), 20)
    if order is not None:
        marks = marks[np.argsort(np.argsort(order(robot, q)))]
    drifts = drift * random.normal(size=(3, robot.dof))
    slides = np.array(robot.prismatic)
    off = drifts[marks] + wobble * np.sin(q + random.uniform(0.0, 6.0, robot.dof)) * ~slides
    return Rows(name, seed, q, marks, off, moved * random.normal(size=(3, 6))), drifts


def kept_of(found):
    return {one.kind for one in found.terms if one.kept}


def term(found, kind):
    return next(one for one in found.terms if one.kind == kind)


def test_compliances_are_found_within_their_deviations():
    errors = []
    for name in ('ur5e', 'kuka_iiwa14', 'spherical_rrp', 'parallelogram_left'):
        for seed in range(2):
            rows, masses, compliances = in_pairs(name, seed)
            found = rows.calibrated(loads=ks.ToolLoads(masses, AT))
            elasticity = term(found, 'elasticity')
            assert elasticity.kept
            assert elasticity.with_term.position_rms < elasticity.without.position_rms
            assert [one.name for one in elasticity.values] == list(rows.robot.joint_names)
            errors += [
                (one.value - true) / one.deviation
                for one, true in zip(elasticity.values, compliances)
                if one.identifiable
            ]
    assert len(errors) > 27
    assert np.mean(np.abs(errors) < 3.0) > WITHIN
    assert abs(np.mean(np.square(errors)) - 1.0) < MEAN_SQUARE


def test_the_table_is_that_of_the_arm_without_a_load():
    rows, masses, _ = in_pairs('ur5e', 1, size=5.0)
    found = rows.calibrated(loads=ks.ToolLoads(masses, AT))
    free = masses == 0.0
    alone = ks.calibrate(rows.robot, rows.q[free], rows.poses[free])
    loaded = rows.calibrated()

    def off(one):
        q = positions_within(rows.robot, 50, 9)
        true = ks.forward_kinematics(true_arm('ur5e', 1, 0.5)[2], q)
        poses = one.base_offsets[0] @ ks.forward_kinematics(one.calibrated, q)
        left = poses @ one.tool_offsets[0] - BASE @ true @ TOOL
        return float(np.sqrt(np.mean(np.sum(left[:, :3, 3] ** 2, axis=1))))

    assert off(found) < 1.2 * off(alone)
    assert off(loaded) > 1.5 * off(found)


def test_a_joint_that_no_load_turns_is_not_known():
    rows, masses, _ = in_pairs('ur5e', 0)
    values = term(rows.calibrated(loads=ks.ToolLoads(masses, AT)), 'elasticity').values
    pan = values[0]
    assert (pan.name, pan.identifiable, pan.unit) == ('shoulder_pan_joint', False, 'rad/Nm')
    assert all(one.identifiable for one in values[1:5])


def test_gravity_may_be_elsewhere():
    # An arm on a wall: the pull is along x of its base.
    robot = robot_of('ur5e')
    q = np.concatenate([positions_within(robot, 25, 3)] * 2)
    masses = np.repeat([0.0, KG], 25)
    pull = np.zeros((50, 6))
    pull[:, 0] = 9.80665 * masses
    off = 1e-5 * ks.joint_torques(robot, q, pull, at=AT)
    rows = Rows('ur5e', 3, q, np.zeros(50, dtype=int), off)
    found = rows.calibrated(loads=ks.ToolLoads(masses, AT, (2.0, 0.0, 0.0)))
    values = [one for one in term(found, 'elasticity').values if one.identifiable]
    assert all(abs(one.value - 1e-5) < 4.0 * one.deviation for one in values)
    # The first joint is turned by it.
    assert values[0].name == 'shoulder_pan_joint'
    # A load that is taken to pull the other way has a sentence.
    found = rows.calibrated(loads=ks.ToolLoads(masses, AT, (-1.0, 0.0, 0.0)))
    assert any('is negative' in sentence for sentence in sentences_of(found))


@pytest.mark.parametrize(
    ('name', 'seed', 'wobble'),
    [(name, *((0, 0.0), (1, 3e-4))[k % 2]) for k, name in enumerate(THREE)],
)
def test_loads_that_bend_nothing_do_not_help(name, seed, wobble):
    # With gears that are not round the arm is off by more than its table says, with and without
    # the load.
    rows, masses, _ = in_pairs(name, seed, size=0.0, wobble=wobble)
    found = rows.calibrated(loads=ks.ToolLoads(masses, AT))
    assert not kept_of(found)
    plain = rows.calibrated()
    assert found.corrections == plain.corrections
    assert np.array_equal(found.covariance, plain.covariance)
    assert found.held_out == plain.held_out


def test_drifts_are_found_within_their_deviations():
    errors = []
    for name in FIVE[1:]:
        rows, drifts = in_sessions(name, 1, drift=3e-4)
        found = rows.calibrated(sessions=rows.marks)
        assert kept_of(found) == {'zeros'}
        values = term(found, 'zeros').values
        true = (drifts - np.mean(drifts, axis=0)).ravel()
        assert [one.session for one in values[:: rows.robot.dof]] == ['0', '1', '2']
        errors += [
            (one.value - own) / one.deviation for one, own in zip(values, true) if one.identifiable
        ]
    assert len(errors) > 50
    assert np.mean(np.abs(errors) < 3.0) > WITHIN
    assert abs(np.mean(np.square(errors)) - 1.0) < MEAN_SQUARE


@pytest.mark.parametrize('repeated', [True, False])
def test_an_instrument_that_drifts_is_no_drift_of_the_joints(repeated):
    rows, _ = in_sessions('ur5e', 2, moved=3e-4, repeated=repeated)
    found = rows.calibrated(sessions=rows.marks)
    assert kept_of(found) == {'placement'}
    assert found.held_out.position_rms < 2.5 * NOISE
    assert rows.calibrated().held_out.position_rms > 5.0 * NOISE
    # A set of its own base has that drift already.
    found = rows.calibrated(sessions=rows.marks, sets=rows.marks)
    assert [one.kind for one in found.terms] == ['zeros']
    assert not kept_of(found)


def test_load_and_session_are_told_apart():
    rows, masses, compliances = in_pairs('kuka_iiwa14', 5)
    random = np.random.default_rng(0)
    marks = random.integers(0, 2, len(masses))
    drifts = 5e-4 * random.normal(size=(2, 7))
    off = compliances * torques_of(rows.robot, rows.q, masses) + drifts[marks]
    rows = Rows('kuka_iiwa14', 5, rows.q, marks, off)
    found = rows.calibrated(sessions=marks, loads=ks.ToolLoads(masses, AT))
    assert kept_of(found) == {'zeros', 'elasticity'}


@pytest.mark.parametrize(
    ('name', 'repeated'), [(name, k % 2 == 0) for k, name in enumerate(THREE)]
)
def test_sessions_that_do_not_differ_do_not_help(name, repeated):
    rows, _ = in_sessions(name, 0, repeated=repeated, wobble=2e-4)
    found = rows.calibrated(sessions=rows.marks)
    assert not kept_of(found)
    plain = rows.calibrated()
    assert found.corrections == plain.corrections


@pytest.mark.parametrize('name', THREE)
def test_an_error_in_a_corner_is_no_drift_of_the_session_that_measured_it(name):
    places = (
        lambda robot, q: q[:, 0],
        lambda robot, q: ks.forward_kinematics(robot, q)[:, 0, 3],
    )
    for place in places:
        rows, _ = in_sessions(name, 0, repeated=False, wobble=3e-4, order=place)
        found = rows.calibrated(sessions=rows.marks)
        assert not kept_of(found)
    # Sessions in corners of their own cannot be told; what remains says how.
    rows, _ = in_sessions(name, 0, repeated=False, drift=3e-4, order=places[0])
    found = rows.calibrated(sessions=rows.marks)
    assert not kept_of(found)
    assert 'are in other places' in found.terms[0].doubt


def test_a_gain_of_less_than_two_of_its_deviations_is_chance():
    rows, _ = in_sessions('scara_hsr065', 1, drift=1.2e-5)
    found = rows.calibrated(sessions=rows.marks)
    for one in found.terms:
        assert 1.0 < one.gain < 2.0 * one.gain_deviation
    assert not kept_of(found)


def test_a_drift_is_found_though_the_arm_is_off_by_fifty_times_as_much():
    # What rows at the same joint positions have in common is no noise of theirs.
    rows, _ = in_sessions('scara_hsr065', 0, drift=6e-5, wobble=3e-3)
    assert kept_of(rows.calibrated(sessions=rows.marks)) == {'zeros'}


def test_few_rows_tell_no_drift_and_a_load_at_one_pose_no_elasticity():
    robot = robot_of('ur5e')
    rows = Rows('ur5e', 0, positions_within(robot, 6, 0), np.repeat([0, 1], 3))
    found = rows.calibrated(sessions=rows.marks)
    assert found.terms[0].doubt.startswith('3 joint positions are too few for session 0')
    q = positions_within(robot, 30, 0)
    q, masses = np.concatenate([q, q[[0] * 10]]), np.repeat([0.0, KG], [30, 10])
    off = 1e-4 * torques_of(robot, q, masses)
    rows = Rows('ur5e', 0, q, np.zeros(40, dtype=int), off)
    found = rows.calibrated(loads=ks.ToolLoads(masses, AT))
    assert found.terms[0].doubt.startswith('1 joint position is too few for the larger loads')


def test_loads_at_other_joint_positions_tell_no_elasticity():
    # What bends with the posture and what an arm is off by there are alike.
    robot = robot_of('ur5e')
    q, masses = positions_within(robot, 60, 0), np.tile([0.0, KG], 30)
    rows = Rows('ur5e', 0, q, np.zeros(60, dtype=int), 3e-5 * torques_of(robot, q, masses))
    found = rows.calibrated(loads=ks.ToolLoads(masses, AT))
    assert not kept_of(found)
    assert 'the smaller loads, the larger loads are not the same' in found.terms[0].doubt


def test_exact_poses_keep_nothing():
    q = np.concatenate([positions_within(robot_of('ur5e'), 20, 0)] * 2)
    rows = Rows('ur5e', 0, q, np.repeat([0, 1], 20), noise=0.0)
    loads = ks.ToolLoads(np.repeat([0.0, KG], 20), AT)
    assert not kept_of(rows.calibrated(sessions=rows.marks, loads=loads))


@pytest.mark.parametrize(
    ('loads', 'sentence'),
    [
        ([2.0] * 50, 'the load is 2 kg in all rows'),
        ([0.0] * 25 + [2000.0] * 25, r'a load of 2,000 kg\? .* masses are in kg, not g'),
        ([0.0] * 25 + [-1.0] * 25, 'loads must be 50 masses in kg, finite and not below 0'),
        ([0.0] * 49, 'loads must be 50 masses'),
        ([0.0] * 49 + [float('nan')], 'loads must be 50 masses'),
    ],
)
def test_loads_that_cannot_be_are_refused(loads, sentence):
    rows, _, _ = in_pairs('ur5e', 0)
    with pytest.raises(CalibrationError, match=sentence):
        rows.calibrated(loads=ks.ToolLoads(loads))


def test_what_cannot_be_meant_is_refused():
    rows, masses, _ = in_pairs('ur5e', 0)
    for at, gravity in (((0, 0), (0, 0, -1)), ((0, 0, 0), (0, 0, 0)), ((0, 0, np.nan), (0, 0, 1))):
        with pytest.raises(CalibrationError, match='must be three finite numbers'):
            rows.calibrated(loads=ks.ToolLoads(masses, at, gravity))
    with pytest.raises(CalibrationError, match="all rows are of one session, 'a'"):
        rows.calibrated(sessions=['a'] * 50)
    with pytest.raises(CalibrationError, match='must name the session of each of 50 rows'):
        rows.calibrated(sessions=['a', 'b'])
    with pytest.raises(CalibrationError, match='same_point takes joint positions alone'):
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
    code, text, _ = run(capsys, 'calibrate', file, '--robot', 'ur5e', *options, *outputs)
    assert code == 0
    document = json.loads(found.read_text())
    terms = {one['kind']: one for one in document['terms']}
    assert {kind for kind, one in terms.items() if one['kept']} == {'elasticity'}
    own = ~np.isin(np.arange(50), skipped)
    same = ks.calibrate(
        rows.robot,
        rows.q[own],
        rows.poses[own],
        sessions=days[own],
        loads=ks.ToolLoads(masses[own], AT),
    )
    values = [one._asdict() for one in term(same, 'elasticity').values]
    assert terms['elasticity']['values'] == values
    assert 'compliance of elbow_joint' in page.read_text()
    text = ' '.join(text.split())
    assert 'Elasticity of the joints helps and is kept' in text
    assert 'from session to session, is not seen to help and is left out' in text
    assert 'compliance of elbow_joint' in text
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
        *('--sessions', 'file', '--json', '-'),
    )
    assert code == 0
    (zeros,) = json.loads(text)['terms']
    assert zeros['kind'] == 'zeros'
    assert zeros['kept']
    assert {one['session'] for one in zeros['values']} == {'day0.csv', 'day1.csv', 'day2.csv'}


@pytest.mark.parametrize(
    ('options', 'code', 'sentence'),
    [
        (('--load', 'mass'), 1, "there is no column 'mass'; the header has"),
        (('--load', 'day'), 1, "the column 'day' has masses in kg: could not convert"),
        (('--sessions', 'gap'), 1, "row 3, counted from 0, is empty in the column 'gap'"),
        (('--load-at', 0, 0, 1), 2, 'give --load COLUMN too'),
        (('--sessions', 'day', '--same-point', 'day'), 2, 'not for --same-point'),
        (('--sessions', 'day', '--zeros'), 2, '--zeros fits the offsets of the joints alone'),
        (('--sessions', 'file'), 1, 'all rows are of one session'),
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


def test_a_running_robot_has_no_columns(capsys):
    code, _, err = run(capsys, 'calibrate', '--robot', 'ur5e', '--live', 1, '--load', 'kg')
    assert code == 2
    assert '--sessions, --load' in ' '.join(err.split())
