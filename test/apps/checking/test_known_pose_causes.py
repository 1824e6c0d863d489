# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
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


def only(found, *words):
    """Fail unless one mistake is found, and its sentence has these words."""
    (sentence,) = found
    assert [word for word in words if word not in sentence] == [], sentence


def with_row(k, **changes):
    names = ('a', 'alpha', 'd', 'theta')
    changed = tuple(changes.get(name, value) for name, value in zip(names, ROWS[k]))
    return (*ROWS[:k], changed, *ROWS[k + 1 :])


STANDARD, MODIFIED = ('standard', True), ('modified', False)


@pytest.mark.parametrize(
    ('rows', 'words', 'convention', 'turned'),
    [
        (with_row(1, alpha=0.4), ['alpha of links[1]', 'other sign'], *STANDARD),
        (with_row(1, alpha=0.4), ['alpha of links[1]', 'other sign'], *MODIFIED),
        (with_row(2, a=0.09), ['a of links[2]', 'other sign'], *MODIFIED),
        (with_row(4, d=0.08), ['d of links[4]', 'other sign'], *STANDARD),
        (with_row(3, theta=-0.3), ['theta of links[3]', 'other sign'], *MODIFIED),
        (with_row(2, theta=0.5 + math.pi / 2), ['zero of joint j3'], *STANDARD),
        (with_row(3, d=0.66), ['length', 'd of links[3] needs -50 mm'], *MODIFIED),
    ],
)
def test_a_wrong_number_of_a_table_is_named(rows, words, convention, turned):
    poses = known(text(convention=convention), turned=turned)
    only(causes(text(rows, convention=convention), poses), *words)


def test_the_other_convention_is_named():
    for here, there in (('standard', 'modified'), ('modified', 'standard')):
        found = causes(text(convention=here), known(text(convention=there)))
        only(found, f'is {there}', f'read as {here}')


@pytest.mark.parametrize('slide', [None, 2])
def test_units_of_the_poses_are_named_in_the_words_of_the_file(slide):
    arm = text(slide=slide)
    only(causes(arm, known(arm, unit=1000.0)), 'in millimetres, not metres')
    written = np.degrees(Q)
    if slide is not None:
        written[:, slide] = np.array(Q)[:, slide]
    only(causes(arm, known(arm, written=written)), 'joint positions', 'degrees, not radians')


def test_angles_of_the_poses_in_degrees_are_named():
    arm = text()
    poses = ks.forward_kinematics(ks.robot_from_text(arm), Q)
    for q, said in ((Q, 'rpy of the poses is'), (np.degrees(Q), 'q and rpy of')):
        lines = ''.join(
            f'  - {{q: {numbers(one)}, xyz: {numbers(T[:3, 3])}, '
            f'rpy: {numbers(np.degrees(exact_rpy(T[:3, :3])))}}}\n'
            for one, T in zip(q, poses)
        )
        only(causes(arm, lines), said, 'degrees, not radians')


def test_radians_and_metres_in_a_file_in_degrees_and_millimetres_are_named():
    units = 'units: {angle: deg, length: mm}\n'
    rows = [
        (1e3 * a, math.degrees(alpha), 1e3 * d, math.degrees(theta)) for a, alpha, d, theta in ROWS
    ]
    arm = text(rows, units=units, base=None, tool=None)
    true = ks.robot_from_text(arm)
    poses = ks.forward_kinematics(true, Q)
    for factor, unit, said in (
        (1.0, 1000.0, ['q of', 'radians, not degrees']),
        (180.0 / math.pi, 1.0, ['xyz of', 'metres, not millimetres']),
    ):
        lines = ''.join(
            f'  - {{q: {numbers(q, factor)}, xyz: {numbers(T[:3, 3], unit)}}}\n'
            for q, T in zip(Q, poses)
        )
        only(causes(arm, lines), *said)


@pytest.mark.parametrize('end', ['base', 'tool'])
def test_a_base_or_a_tool_that_is_left_out_is_named(end):
    bare = {end: None}
    # Left out of the poses, or out of the file: then there are numbers to write.
    found = causes(text(), known(text(**bare)))
    assert any(one.startswith('the poses are') and 'without' in one for one in found)
    wanted = {'base': BASE, 'tool': TOOL}[end]
    xyz, rpy = (', '.join(f'{x:.6g}' for x in wanted[key]) for key in ('xyz', 'rpy'))
    only(causes(text(**bare), known(text())), f'the {end} is', f'xyz [{xyz}]', f'rpy [{rpy}]')


def test_a_quaternion_of_the_other_order_is_named():
    poses = np.array(ks.forward_kinematics(ks.robot_from_text(text()), Q))
    from kinematics_service.apps.checking.hypotheses import quaternions_of
    from kinematics_service.rigid_motion import rotation_of_quaternion

    x, y, z, w = quaternions_of(poses).T
    poses[:, :3, :3] = rotation_of_quaternion(np.stack([w, x, y, z], axis=1))
    found = causes(text(), known(text(), poses=poses))
    only(found, 'quaternions are w x y z')


def test_joints_that_count_the_other_way_or_are_swapped_are_named():
    for change, said in (
        (lambda q: [q[0], -q[1], *q[2:]], ['joint j2', 'other way']),
        (lambda q: [q[1], q[0], *q[2:]], ['j1 and j2', 'swapped']),
    ):
        only(causes(text(), known(text(), written=[change(q) for q in Q])), *said)


# Poses with few digits, as people write them down.


@pytest.fixture(params=[3])
def digits(request, monkeypatch):
    monkeypatch.setitem(globals(), 'DIGITS', request.param)
    return request.param


def test_a_mistake_is_named_though_the_poses_are_rounded(digits):
    poses = known(text(), turned=False)
    for wrong, words in (
        ({'rows': with_row(1, alpha=0.4)}, ['alpha of links[1]', 'other sign']),
        ({'rows': with_row(2, a=0.09)}, ['a of links[2]', 'other sign']),
        ({'convention': 'modified'}, ['read as modified']),
    ):
        only(causes(text(**wrong), poses), *words)
    only(causes(text(), known(text(), unit=1000.0)), 'in millimetres')


def test_an_error_of_the_digits_is_no_mistake_and_told_as_that(digits, tmp_path, capsys):
    file = tmp_path / 'arm.yaml'
    file.write_text(f'{text()}known_poses:\n{known(text())}')
    assert main(['check', str(file)]) == 1
    said = capsys.readouterr().err.splitlines()
    assert len(said) == len(Q)
    for line in said:
        assert 'rounded digits' in line
        assert 'write tolerance: {xyz: ' in line
    tolerance = f'tolerance: {{xyz: {10.0 ** (1 - digits):g}, rpy: {10.0 ** (1 - digits):g}}}'
    poses = known(text()).replace(']}\n', f'], {tolerance}}}\n')
    file.write_text(f'{text()}known_poses:\n{poses}')
    assert main(['check', str(file)]) == 0
    # Less than what so few digits can show explains nothing.
    assert causes(text(with_row(3, d=0.61 + 2.0 * 10.0**-digits)), known(text())) == ()


def test_digits_count_in_the_units_of_the_file():
    units = 'units: {angle: deg, length: mm}\n'
    arm = 'robot: r\nsource: a test\nconvention: standard\n' + units
    arm += 'joints: [{name: q1, type: revolute}, {name: q2, type: revolute}]\n'
    arm += 'links: [{a: 300, alpha: %s, d: 0, theta: q1}, {a: 200, alpha: 0, d: 0, theta: q2}]\n'
    poses = '  - {q: [20.5, 35.25], xyz: [434, 162.3, 115.4]}\n'
    right = ks.robot_from_text(f'{arm % 90}known_poses:\n{poses}')
    (fault,) = pose_faults(right, pose_errors(right))
    assert (fault.where, fault.code) == ('known_poses[0]', 'known-pose')
    assert fault.message.endswith('tolerance: {xyz: 0.1}')
    joint, number = causes(arm % -90, poses)
    only([joint], 'q2', 'other way')
    only([number], 'alpha of links[0]', 'other sign')
    # Numbers of one digit, and of none, are exact.
    coarse = ks.robot_from_text(
        f'{arm % 90}known_poses:\n{poses.replace("162.3, 115.4", "162, 115")}'
    )
    (fault,) = pose_faults(coarse, pose_errors(coarse))
    assert 'digits' not in fault.message


# What must not be told.


def test_two_mistakes_at_once_are_explained_by_none():
    poses = known(text())
    for rows in ((*with_row(1, alpha=0.4)[:3], *with_row(4, d=0.08)[3:]),):
        assert causes(text(rows), poses) == ()


def test_noise_is_no_cause():
    noise = 1e-2
    random = np.random.default_rng(3)
    poses = np.array(ks.forward_kinematics(ks.robot_from_text(text()), Q))
    poses[:, :3, 3] += random.normal(0.0, noise, (3, 3))
    assert causes(text(), known(text(), poses=poses)) == ()
    # Nor does it hide one within a tolerance that allows for it.
    tolerance = f', tolerance: {{xyz: {10 * noise}}}}}'
    lines = known(text(), poses=poses).replace('}\n', tolerance + '\n')
    found = causes(text(with_row(1, alpha=0.4)), lines)
    assert any('alpha of links[1]' in one for one in found)


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
    assert 'joint q2 counts' in err
    assert 'alpha of links[0]' in err
    # A pose that tells them apart leaves one.
    more = known(true, [(0.7, -0.9), (1.1, 0.3)])
    file.write_text(file.read_text() + more)
    assert main(['check', str(file)]) == 1
    err = capsys.readouterr().err
    assert f'{file}: known_poses: one mistake of' in err
    assert err.endswith(': alpha of links[0] has the other sign\n')


@pytest.mark.parametrize('name', ['five_bar', 'scara_hsr065', 'kuka_iiwa14'])
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


@pytest.mark.parametrize(
    ('rows', 'words', 'convention', 'turned'),
    [
        (exchanged(2, 'a', 2, 'd'), ['a of links[2]', 'd of links[2]'], *STANDARD),
        (exchanged(1, 'a', 3, 'd'), ['a of links[1]', 'd of links[3]'], *MODIFIED),
        (exchanged(0, 'd', 3, 'd'), ['d of links[0]', 'd of links[3]'], *STANDARD),
        (exchanged(0, 'alpha', 4, 'alpha'), ['alpha of links[0]', 'alpha of links[4]'], *MODIFIED),
        (exchanged(1, 'theta', 2, 'theta'), ['theta of links[1]', 'theta of links[2]'], *STANDARD),
        (shifted('alpha', 1), ['column alpha', 'one row too low'], *MODIFIED),
        (shifted('a', -1), ['column a ', 'one row too high'], *STANDARD),
        (shifted('d', 1), ['column d ', 'one row too low'], *MODIFIED),
        (shifted('theta', -1), ['column theta', 'one row too high'], *STANDARD),
        (shifted('theta', -1), ['column theta', 'one row too high'], *MODIFIED),
    ],
)
def test_a_slip_of_the_pen_is_named_from_two_poses(rows, words, convention, turned):
    poses = known(text(convention=convention), Q[:2], turned=turned)
    only(causes(text(rows, convention=convention), poses), *words)


def test_slips_that_explain_as_well_are_all_named():
    # Of parallel axes it makes no difference which d is long.
    right = ((0.0, math.pi / 2, 0.4, 0), (0.35, 0, 0.05, 0), (0.3, 0, 0, 0), (0.1, 0.7, 0, 0))
    wrong = ((0.05, math.pi / 2, 0.4, 0), (0.35, 0, 0, 0), *right[2:])
    arm, q = {'base': None, 'tool': None}, [row[:4] for row in Q[:2]]
    found = causes(text(wrong, **arm), known(text(right, **arm), q))
    for row in (1, 2):
        assert any('a of links[0]' in one and f'd of links[{row}]' in one for one in found)
    # Two slips at once, or a number that was never in the table, are none of them.
    twice = exchanged(2, 'a', 2, 'd')
    twice = (*twice[:3], (twice[3][0], twice[4][1], *twice[3][2:]), *twice[4:])
    assert causes(text(twice), known(text())) == ()
