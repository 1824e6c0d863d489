"""The one mistake that explains why an arm misses the known poses of its file."""

import math

import numpy as np
import pytest
from arms import robot_of

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.checking.known_pose_causes import pose_causes
from kinematics_service.apps.checking.known_poses import pose_errors, pose_faults
from kinematics_service.rigid_motion import exact_rpy

DIGITS = 9  # of the poses in a file
# (a, alpha, d, offset of theta) of an arm without any symmetry, m and rad.
ROWS = (
    (0.11, 1.3, 0.42, 0.2),
    (0.53, -0.4, 0.07, -0.7),
    (-0.09, 1.1, 0.13, 0.5),
    (0.05, -1.2, 0.61, 0.3),
    (0.17, 0.9, -0.08, -0.4),
)
BASE = {'xyz': (0.2, -0.3, 0.4), 'rpy': (0.3, 0.1, -0.5)}
TOOL = {'xyz': (0.05, 0.02, 0.13), 'rpy': (-0.2, 0.4, 0.1)}
Q = ((0.3, -0.5, 0.7, 0.2, -0.9), (-0.6, 0.8, -0.2, 1.1, 0.4), (1.2, 0.1, 0.5, -0.7, 0.6))


def numbers(values, unit=1.0):
    return f'[{", ".join(f"{value * unit:.{DIGITS}f}" for value in values)}]'


def placed(end):
    return f'{{xyz: {numbers(end["xyz"])}, rpy: {numbers(end["rpy"])}}}' if end else '{}'


def text(rows=ROWS, convention='standard', base=BASE, tool=TOOL, units='', slide=None):
    """Return an arm's file without known poses; its joint `slide` slides."""
    kinds = ['prismatic' if j == slide else 'revolute' for j in range(len(rows))]
    lines = [
        f'robot: arm\nsource: a test\n{units}convention: {convention}\njoints:',
        *(f'  - {{name: j{j}, type: {kind}}}' for j, kind in enumerate(kinds, 1)),
        'links:',
    ]
    for j, (a, alpha, d, theta) in enumerate(rows, 1):
        d, theta = (f'{d} + j{j}', theta) if j - 1 == slide else (d, f'{theta} + j{j}')
        lines.append(f'  - {{a: {a}, alpha: {alpha}, d: {d}, theta: {theta}}}')
    return '\n'.join([*lines, f'base: {placed(base)}', f'tool: {placed(tool)}', ''])


def known(true, q=Q, written=None, poses=None, turned=True, unit=1.0):
    """Return known poses as a true arm takes them; `written` are the joint positions put down."""
    robot = ks.robot_from_text(true)
    lines = []
    poses = ks.forward_kinematics(robot, q) if poses is None else poses
    for q_written, T in zip(q if written is None else written, poses, strict=True):
        rpy = f', rpy: {numbers(exact_rpy(T[:3, :3]))}' if turned else ''
        lines.append(f'  - {{q: {numbers(q_written)}, xyz: {numbers(T[:3, 3], unit)}{rpy}}}\n')
    return ''.join(lines)


def causes(arm, poses):
    return pose_causes(ks.robot_from_text(f'{arm}known_poses:\n{poses}')).sentences


def with_row(k, **changes):
    names = ('a', 'alpha', 'd', 'theta')
    changed = tuple(changes.get(name, value) for name, value in zip(names, ROWS[k]))
    return (*ROWS[:k], changed, *ROWS[k + 1 :])


@pytest.mark.parametrize(('convention', 'turned'), [('standard', True), ('modified', False)])
@pytest.mark.parametrize(
    ('wrong', 'sentence'),
    [
        ({'rows': with_row(1, alpha=0.4)}, 'alpha of links[1] has the other sign'),
        ({'rows': with_row(2, a=0.09)}, 'a of links[2] has the other sign'),
        ({'rows': with_row(4, d=0.08)}, 'd of links[4] has the other sign'),
        (
            {'rows': with_row(3, theta=-0.3)},
            'the constant of theta of links[3] has the other sign',
        ),
        ({'rows': with_row(2, theta=0.5 + math.pi / 2)}, 'the zero of joint j3 is off: '),
        (
            {'rows': with_row(3, d=0.66)},
            'a length of the table is off: d of links[3] needs -50 mm',
        ),
    ],
)
def test_a_wrong_number_of_a_table_is_named(convention, turned, wrong, sentence):
    poses = known(text(convention=convention), turned=turned)
    found = causes(text(convention=convention, **wrong), poses)
    assert len(found) == 1
    assert found[0].startswith(sentence)


def test_the_other_convention_is_named():
    for here, there in (('standard', 'modified'), ('modified', 'standard')):
        found = causes(text(convention=here), known(text(convention=there)))
        assert found == (f'the table is {there}, and is read as {here}',)


@pytest.mark.parametrize('slide', [None, 2])
def test_units_of_the_poses_are_named_in_the_words_of_the_file(slide):
    arm = text(slide=slide)
    assert causes(arm, known(arm, unit=1000.0)) == ('the poses are in millimetres, not metres',)
    written = np.degrees(Q)
    if slide is not None:
        written[:, slide] = np.array(Q)[:, slide]
    found = causes(arm, known(arm, written=written))
    assert found == ('the joint positions are in degrees, not radians',)


def test_angles_of_the_poses_in_degrees_are_named():
    arm = text()
    poses = ks.forward_kinematics(ks.robot_from_text(arm), Q)
    for q, said in ((Q, 'rpy of the poses is'), (np.degrees(Q), 'q and rpy of the poses are')):
        lines = ''.join(
            f'  - {{q: {numbers(one)}, xyz: {numbers(T[:3, 3])}, '
            f'rpy: {numbers(np.degrees(exact_rpy(T[:3, :3])))}}}\n'
            for one, T in zip(q, poses)
        )
        assert causes(arm, lines) == (f'{said} in degrees, not radians',)


def test_radians_and_metres_in_a_file_in_degrees_and_millimetres_are_named():
    units = 'units: {angle: deg, length: mm}\n'
    rows = [
        (1e3 * a, math.degrees(alpha), 1e3 * d, math.degrees(theta)) for a, alpha, d, theta in ROWS
    ]
    arm = text(rows, units=units, base=None, tool=None)
    true = ks.robot_from_text(arm)
    poses = ks.forward_kinematics(true, Q)
    for factor, unit, said in (
        (1.0, 1000.0, 'q of the poses is in radians, not degrees'),
        (180.0 / math.pi, 1.0, 'xyz of the poses is in metres, not millimetres'),
    ):
        lines = ''.join(
            f'  - {{q: {numbers(q, factor)}, xyz: {numbers(T[:3, 3], unit)}}}\n'
            for q, T in zip(Q, poses)
        )
        assert causes(arm, lines) == (said,)


@pytest.mark.parametrize('end', ['base', 'tool'])
def test_a_base_or_a_tool_that_is_left_out_is_named(end):
    bare = {end: None}
    # Left out of the poses, or out of the file: then there are numbers to write.
    found = causes(text(), known(text(**bare)))
    assert any(one.startswith('the poses are') and 'without' in one for one in found)
    found = causes(text(**bare), known(text()))
    wanted = {'base': BASE, 'tool': TOOL}[end]
    xyz, rpy = (', '.join(f'{x:.6g}' for x in wanted[key]) for key in ('xyz', 'rpy'))
    assert found == (f'the {end} is at xyz [{xyz}] m, rpy [{rpy}] rad',)


def test_a_quaternion_of_the_other_order_is_named():
    poses = np.array(ks.forward_kinematics(ks.robot_from_text(text()), Q))
    from kinematics_service.apps.checking.hypotheses import quaternions_of
    from kinematics_service.rigid_motion import rotation_of_quaternion

    x, y, z, w = quaternions_of(poses).T
    poses[:, :3, :3] = rotation_of_quaternion(np.stack([w, x, y, z], axis=1))
    found = causes(text(), known(text(), poses=poses))
    assert found == ('the quaternions are w x y z, and are read as x y z w',)


def test_joints_that_count_the_other_way_or_are_swapped_are_named():
    for change, said in (
        (lambda q: [q[0], -q[1], *q[2:]], 'joint j2 counts the other way round'),
        (lambda q: [q[1], q[0], *q[2:]], 'joints j1 and j2 are swapped'),
    ):
        assert causes(text(), known(text(), written=[change(q) for q in Q])) == (said,)


# Poses with few digits, as people write them down.


@pytest.fixture(params=[3, 4, 5])
def digits(request, monkeypatch):
    monkeypatch.setitem(globals(), 'DIGITS', request.param)
    return request.param


def test_a_mistake_is_named_though_the_poses_are_rounded(digits):
    poses = known(text(), turned=digits == 4)
    for wrong, sentence in (
        ({'rows': with_row(1, alpha=0.4)}, 'alpha of links[1] has the other sign'),
        ({'rows': with_row(2, a=0.09)}, 'a of links[2] has the other sign'),
        ({'convention': 'modified'}, 'the table is standard, and is read as modified'),
    ):
        assert causes(text(**wrong), poses) == (sentence,)
    assert causes(text(), known(text(), unit=1000.0)) == (
        'the poses are in millimetres, not metres',
    )


def test_an_error_of_the_digits_is_no_mistake_and_told_as_that(digits, tmp_path, capsys):
    file = tmp_path / 'arm.yaml'
    file.write_text(f'{text()}known_poses:\n{known(text())}')
    assert main(['check', str(file)]) == 1
    said = capsys.readouterr().err.splitlines()
    assert len(said) == len(Q)
    for line in said:
        _, advice = line.split('as its rounded digits may be: write ')
        assert advice.startswith('tolerance: {xyz: ')
    tolerance = f'tolerance: {{xyz: {10.0 ** (1 - digits):g}, rpy: {10.0 ** (1 - digits):g}}}'
    poses = known(text()).replace(']}\n', f'], {tolerance}}}\n')
    file.write_text(f'{text()}known_poses:\n{poses}')
    assert main(['check', str(file)]) == 0
    # Less than what so few digits can show explains nothing; nor do two mistakes at once.
    for rows in (
        with_row(3, d=0.61 + 2.0 * 10.0**-digits),
        (*with_row(1, alpha=0.4)[:3], *with_row(4, d=0.08)[3:]),
    ):
        assert causes(text(rows), known(text())) == ()


def test_digits_count_in_the_units_of_the_file():
    units = 'units: {angle: deg, length: mm}\n'
    arm = 'robot: r\nsource: a test\nconvention: standard\n' + units
    arm += 'joints: [{name: q1, type: revolute}, {name: q2, type: revolute}]\n'
    arm += 'links: [{a: 300, alpha: %s, d: 0, theta: q1}, {a: 200, alpha: 0, d: 0, theta: q2}]\n'
    poses = '  - {q: [20.5, 35.25], xyz: [434, 162.3, 115.4]}\n'
    right = ks.robot_from_text(f'{arm % 90}known_poses:\n{poses}')
    (fault,) = pose_faults(right, pose_errors(right))
    assert fault.message.endswith('as its rounded digits may be: write tolerance: {xyz: 0.1}')
    assert causes(arm % -90, poses) == (
        'joint q2 counts the other way round',
        'alpha of links[0] has the other sign',
    )
    # Numbers of one digit, and of none, are exact.
    coarse = ks.robot_from_text(
        f'{arm % 90}known_poses:\n{poses.replace("162.3, 115.4", "162, 115")}'
    )
    (fault,) = pose_faults(coarse, pose_errors(coarse))
    assert 'digits' not in fault.message


# What must not be told.


def test_two_mistakes_at_once_are_explained_by_none():
    poses = known(text())
    for rows in (
        (*with_row(1, alpha=0.4)[:3], *with_row(4, d=0.08)[3:]),
        (*with_row(0, a=-0.11)[:2], *with_row(3, alpha=1.2)[2:]),
    ):
        assert causes(text(rows), poses) == ()
    assert causes(text(with_row(1, alpha=0.4)), known(text(), unit=1000.0)) == ()
    assert causes(text(convention='modified'), known(text(base=None))) == ()


@pytest.mark.parametrize('noise', [1e-4, 1e-2])
def test_noise_is_no_cause(noise):
    random = np.random.default_rng(3)
    poses = np.array(ks.forward_kinematics(ks.robot_from_text(text()), Q))
    poses[:, :3, 3] += random.normal(0.0, noise, (3, 3))
    assert causes(text(), known(text(), poses=poses)) == ()
    # Nor does it hide one within a tolerance that allows for it.
    tolerance = f', tolerance: {{xyz: {10 * noise}}}}}'
    lines = known(text(), poses=poses).replace('}\n', tolerance + '\n')
    found = causes(text(with_row(1, alpha=0.4)), lines)
    assert 'alpha of links[1] has the other sign' in found


def test_one_wrong_pose_among_right_ones_is_no_mistake_of_the_table():
    poses = np.array(ks.forward_kinematics(ks.robot_from_text(text()), Q))
    poses[1, 0, 3] += 0.1
    assert causes(text(), known(text(), poses=poses)) == ()


def test_a_single_pose_is_explained_by_no_fitted_number():
    # Any height of a flat arm is a length d.
    arm = 'robot: r\nconvention: standard\njoints: [{name: q1, type: revolute}]\n'
    arm += 'links: [{a: 1, alpha: 0, d: 0, theta: q1}]\n'
    assert causes(arm, '  - {q: [0], xyz: [1, 0, 0.003]}\n') == ()
    assert causes(
        arm,
        '  - {q: [0], xyz: [1, 0, 0.003]}\n  - {q: [1.5], xyz: [0.0707372, 0.997495, 0.003]}\n',
    ) == ('a length of the table is off: d of links[0] needs +3 mm',)


def test_of_a_symmetric_arm_every_mistake_that_explains_is_told(tmp_path, capsys):
    file = tmp_path / 'own.yaml'
    file.write_text(
        'robot: own\nsource: a test\nconvention: standard\n'
        'joints: [{name: q1, type: revolute}, {name: q2, type: revolute}]\n'
        'links: [{a: 0, alpha: -pi/2, d: 0.2, theta: q1}, {a: 0.3, alpha: 0, d: 0, theta: q2}]\n'
    )
    true = file.read_text().replace('-pi/2', 'pi/2')
    file.write_text(f'{file.read_text()}known_poses:\n' + known(true, [(0.0, 0.4)], turned=False))
    assert main(['check', str(file)]) == 1
    err = capsys.readouterr().err
    assert err.count('\n') == 2
    assert 'mistakes of' in err
    assert 'each alone; another pose may decide which: ' in err
    assert 'joint q2 counts the other way round' in err
    assert 'alpha of links[0] has the other sign' in err
    # A pose that tells them apart leaves one.
    more = known(true, [(0.7, -0.9), (1.1, 0.3)])
    file.write_text(file.read_text() + more)
    assert main(['check', str(file)]) == 1
    err = capsys.readouterr().err
    assert f'{file}: known_poses: one mistake of' in err
    assert err.endswith('explains them: alpha of links[0] has the other sign\n')


@pytest.mark.parametrize('name', ['five_bar', 'four_bar_arm', 'scara_hsr065', 'kuka_iiwa14'])
def test_arms_of_every_kind_are_asked(name):
    robot = robot_of(name)
    count = robot.dof
    assert count
    # Its own poses are met; each mistake that was undone makes them worse, or is none.
    found = pose_causes(robot)
    assert found.tried > 5
    assert all(isinstance(one, str) for one in found.sentences)


# Slips of a table that is copied by hand.


def exchanged(k, name, m, other):
    columns = ('a', 'alpha', 'd', 'theta')
    rows, i, j = [list(row) for row in ROWS], columns.index(name), columns.index(other)
    rows[k][i], rows[m][j] = rows[m][j], rows[k][i]
    return tuple(map(tuple, rows))


def shifted(name, step):
    column = ('a', 'alpha', 'd', 'theta').index(name)
    rows = np.array(ROWS)
    rows[:, column] = np.roll(rows[:, column], step)
    return tuple(map(tuple, rows.tolist()))


@pytest.mark.parametrize(('convention', 'turned'), [('standard', True), ('modified', False)])
@pytest.mark.parametrize(
    ('rows', 'sentence'),
    [
        (exchanged(2, 'a', 2, 'd'), 'a of links[2] and d of links[2] are exchanged'),
        (exchanged(1, 'a', 3, 'd'), 'a of links[1] and d of links[3] are exchanged'),
        (exchanged(0, 'd', 3, 'd'), 'd of links[0] and d of links[3] are exchanged'),
        (exchanged(0, 'alpha', 4, 'alpha'), 'alpha of links[0] and alpha of links[4] are exch'),
        (exchanged(1, 'theta', 2, 'theta'), 'theta of links[1] and theta of links[2] are exch'),
        (shifted('alpha', 1), 'column alpha of the table is one row too low'),
        (shifted('a', -1), 'column a of the table is one row too high'),
        (shifted('d', 1), 'column d of the table is one row too low'),
        (shifted('theta', -1), 'column theta of the table is one row too high'),
    ],
)
def test_a_slip_of_the_pen_is_named_from_two_poses(convention, turned, rows, sentence):
    poses = known(text(convention=convention), Q[:2], turned=turned)
    (found,) = causes(text(rows, convention=convention), poses)
    assert found.startswith(sentence)


def test_slips_that_explain_as_well_are_all_named():
    # Of parallel axes it makes no difference which d is long.
    right = ((0.0, math.pi / 2, 0.4, 0), (0.35, 0, 0.05, 0), (0.3, 0, 0, 0), (0.1, 0.7, 0, 0))
    wrong = ((0.05, math.pi / 2, 0.4, 0), (0.35, 0, 0, 0), *right[2:])
    arm, q = {'base': None, 'tool': None}, [row[:4] for row in Q[:2]]
    found = causes(text(wrong, **arm), known(text(right, **arm), q))
    assert 'a of links[0] and d of links[1] are exchanged' in found
    assert 'a of links[0] and d of links[2] are exchanged' in found
    # Two slips at once, or a number that was never in the table, are none of them.
    twice = exchanged(2, 'a', 2, 'd')
    twice = (*twice[:3], (twice[3][0], twice[4][1], *twice[3][2:]), *twice[4:])
    assert causes(text(twice), known(text())) == ()
