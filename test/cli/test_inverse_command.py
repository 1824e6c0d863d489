# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `ik`: what it prints, in words and as JSON, and its exit codes."""

import json

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.cli.command_line import run

Q = [0.3, -1.0, 1.0, 0.2, 0.7, 1.0]


def answer(capsys, *argv):
    code = run(['ik', *argv])
    return code, capsys.readouterr()


def pose_arguments(robot):
    T = ks.forward_kinematics(robot, Q)
    quaternion = ks.evaluate(robot, Q).quaternion_xyzw
    return (
        '--xyz=' + ','.join(map(repr, T[:3, 3].tolist())),
        '--quaternion=' + ','.join(map(repr, quaternion.tolist())),
    )


def test_json_has_every_solution(capsys):
    robot = ks.load_robot('ur5e')
    code, streams = answer(capsys, '--robot', 'ur5e', *pose_arguments(robot), '--json')
    document = json.loads(streams.out)
    assert code == 0
    assert document['status'] == 'solved'
    assert document['method'] == 'closed form'
    assert (document['complete'], document['roots']) == ('proved', None)
    assert [one['multiplicity'] for one in document['solutions']] == [1] * 8
    assert len(document['solutions']) == 8
    assert document['nearest'] is None
    assert min(np.max(np.abs(np.subtract(one['q'], Q))) for one in document['solutions']) < 1e-9
    assert {one['wrist'] for one in document['solutions']} == {'flip', 'no_flip'}


def test_a_table_for_people(capsys):
    code, streams = answer(
        capsys, '--robot', 'craig_3r', '--xyz', '0.4', '0.1', '-0.2', '--near', '0,0.5,0.5'
    )
    assert code == 0
    assert '4 solutions inside the limits;' in streams.out
    assert 'shoulder right, elbow up' in streams.out


@pytest.mark.parametrize(
    ('deg', 'unit', 'scale'), [((), 'rad', 1.0), (('--deg',), 'deg', 57.29578)]
)
@pytest.mark.parametrize('near', [(), ('--near', '0.3,-1,1,0.2,0.7,1')])
def test_a_table_fits_80_columns_in_one_unit_nearest_first(
    capsys, monkeypatch, deg, unit, scale, near
):
    robot = ks.load_robot('puma560')
    place = ('--xyz', '0.3,0.4,0.9', '--quaternion', '1,0,0,0')
    if near and deg:
        near = ('--near', ','.join(f'{57.29578 * x:.6f}' for x in Q))
    given = ('--robot', 'puma560', *place, *near, *deg, '--all')
    found = json.loads(answer(capsys, *given, '--json')[1].out)['solutions']
    monkeypatch.setenv('COLUMNS', '80')
    narrow = answer(capsys, *given)[1].out
    monkeypatch.setenv('COLUMNS', '200')
    wide = answer(capsys, *given)[1].out
    assert max(map(len, narrow.splitlines())) <= 80
    assert narrow.split() == wide.split()
    start = '--near' if near else 'the middle of the limits'
    heading, *lines = wide.partition('\n\n')[2].splitlines()
    assert heading.strip() == f'joints [{unit}], nearest to {start} first'
    shown = [[float(word) for word in line.split()[1:7]] for line in lines]
    np.testing.assert_allclose(shown, [scale * np.array(one['q']) for one in found], atol=6e-3)
    middle = np.array(Q) if near else robot.limits.mean(axis=1)
    away = [np.linalg.norm(np.array(one['q']) - middle) for one in found]
    assert away == sorted(away)
    assert sum('beyond the limits of' in line for line in lines) == sum(
        not one['feasible'] for one in found
    )


def test_roll_pitch_yaw_may_be_degrees(capsys):
    robot = ks.load_robot('puma560')
    code, streams = answer(
        capsys,
        '--robot',
        'puma560',
        '--xyz',
        '0.3,0.4,0.9',
        '--rpy',
        '10,20,30',
        '--deg',
        '--json',
    )
    assert code == 0
    q = json.loads(streams.out)['solutions'][0]['q']
    from kinematics_service.rigid_motion import roll_pitch_yaw

    found = np.degrees(roll_pitch_yaw(ks.forward_kinematics(robot, q)[:3, :3]))
    np.testing.assert_allclose(found, [10, 20, 30], atol=1e-9)


def test_unreachable_is_exit_code_1_with_the_nearest_pose(capsys):
    code, streams = answer(capsys, '--robot', 'craig_3r', '--xyz', '2,0,0')
    assert code == 1
    assert '1.18 m off in position' in streams.out


@pytest.mark.parametrize(
    ('rpy', 'asks'), [('180,0,0', True), ('pi,0,0', False), ('180°,0,0', False)]
)
def test_an_orientation_that_looks_like_degrees_is_asked_about(capsys, rpy, asks):
    _, streams = answer(capsys, '--robot', 'ur5e', '--xyz', '0.3,0.2,0.3', '--rpy', rpy)
    assert bool(streams.err) == asks
    assert asks == ('--rpy' in streams.err and '--deg' in streams.err)


def test_a_target_farther_than_squares_of_doubles_has_a_distance(capsys):
    code, streams = answer(capsys, '--robot', 'panda', '--xyz', '1e300,0,0')
    assert code == 1
    assert '1e+300 m off' in streams.out


def test_all_prints_what_is_beyond_the_limits(capsys):
    arguments = ('--robot', 'rrp_elementary', '--xyz', '0.2,0.1,0.5')
    code, streams = answer(capsys, *arguments)
    assert code == 1
    assert 'beyond the limits of d3' in streams.out
    code, streams = answer(capsys, *arguments, '--all', '--json')
    assert [one['beyond'] for one in json.loads(streams.out)['solutions']] == [['d3']] * 4


def test_a_family_says_which_joints_are_free(capsys):
    code, streams = answer(capsys, '--robot', 'spherical_rrp', '--xyz', '0,0,0.9')
    assert code == 0
    assert 'a straight line; theta1 moves' in streams.out


def test_one_solution_is_enough(capsys):
    robot = ks.load_robot('ur5e')
    arguments = ('--robot', 'ur5e', *pose_arguments(robot), '--json')
    near = ('--near=' + ','.join(map(str, Q)),)
    code, streams = answer(capsys, *arguments, *near, '--one')
    [one] = json.loads(streams.out)['solutions']
    assert code == 0
    np.testing.assert_allclose(one['q'], Q, atol=1e-9)
    code, streams = answer(capsys, '--robot', 'craig_3r', '--xyz', '2,0,0', '--one')
    assert code == 1
    assert '1.18 m off in position' in streams.out


def test_rows_and_seed(capsys):
    arguments = ('--robot', 'scara_hsr065', '--xyz', '0.4,0.1,0.2', '--rpy', '0.1,0,0', '--json')
    code, streams = answer(capsys, *arguments)
    assert code == 1
    assert json.loads(streams.out)['status'] == 'unreachable'
    families = []
    for seed in ('0', '0', '7'):
        code, streams = answer(capsys, *arguments, '--rows', 'x y z', '--seed', seed)
        assert code == 0
        families.append(json.loads(streams.out)['families'])
    assert families[0] == families[1]
    assert {name for family in families[2] for name in family['joints']} == {'joint_4'}


def test_axis_and_tolerance(capsys):
    arguments = ('--robot', 'scara_hsr065', '--xyz', '0.4,0.1,0.2', '--rpy', '4e-7,0,0.3')
    code, streams = answer(capsys, *arguments)
    assert code == 0
    assert 'within the tolerance' in streams.out
    code, streams = answer(capsys, *arguments, '--tolerance', '0', '--json')
    assert code == 1
    assert json.loads(streams.out)['tolerance'] == 0.0
    code, streams = answer(capsys, *arguments, '--axis', 'z', '--tolerance', '0')
    assert code == 1
    assert 'tool axis z' in streams.out
    upright = (*arguments[:-1], '0,0,0.3')
    code, streams = answer(capsys, *upright, '--axis', 'z', '--tolerance', '0', '--json')
    document = json.loads(streams.out)
    assert code == 0
    assert document['axis'] == 'z'
    assert {name for family in document['families'] for name in family['joints']} == {'joint_4'}


@pytest.mark.parametrize(
    ('argv', 'sentence'),
    [
        (('--xyz', '1,2'), "--xyz: '1,2' is not 3"),
        (('--xyz', '1,2,x'), "--xyz: '1,2,x' is not 3"),
        (('--xyz', '1,2,3', '--rows', 'x,roll'), "--rows: unknown rows 'x,roll'"),
        (('--xyz', '1,2,3', '--rows', 'rx'), '(accepted: x y z)'),
        (('--xyz', '1,2,3', '--one', '--all'), '--one and --all'),
        (('--xyz', '1,2,3', '--one', '--family'), '--one and --family'),
        (('--xyz', '1,2,3', '--axis', 'z'), '--axis needs a rotation;'),
        (('--xyz', '1,2,3', '--rpy', '0,0,0', '--axis', 'w'), "--axis: unknown axis 'w'"),
        (('--xyz', '1,2,3', '--tolerance', '-1'), '--tolerance'),
        (('--xyz', '1,2,3', '--near', '0'), '--near: craig_3r has 3 joints'),
        (
            ('--xyz', '1,2,3', '--rpy', '0,0,0', '--quaternion', '0,0,0,1'),
            '--rpy and --quaternion',
        ),
        (('--xyz', '1,2,3', '--quaternion', '0,0,0,2'), 'length 1'),
    ],
)
def test_wrong_usage_is_exit_code_2(capsys, argv, sentence):
    code, streams = answer(capsys, '--robot', 'craig_3r', *argv)
    assert code == 2
    assert sentence in streams.err


SEVEN = ('--robot', 'kuka_iiwa14', '--xyz', '0.3,0.2,0.6', '--rpy', '170,10,30', '--deg')


def test_the_arcs_of_a_redundant_arm_are_printed_with_the_joints_that_end_them(capsys):
    code, streams = answer(capsys, *SEVEN, '--family')
    assert code == 0
    assert '17 arcs inside the limits' in ' '.join(streams.out.split())
    assert 'there may be others' in ' '.join(streams.out.split())
    ends = 'lower limit of joint_6', 'upper limit of joint_1'
    assert all(end in ' '.join(streams.out.split()) for end in ends)
    code, streams = answer(capsys, *SEVEN, '--family', '--json')
    document = json.loads(streams.out)
    assert (document['status'], document['complete']) == ('solved', 'found')
    arcs = [arc for family in document['families'] for arc in family['intervals']]
    assert len(arcs) == 17
    robot = ks.load_robot('kuka_iiwa14')
    for arc in arcs:
        for end, q in zip(arc['ends'], (arc['q'][0], arc['q'][-1])):
            j = robot.joint_names.index(end['joint'])
            limit = robot.limits[j][0 if end['limit'] == 'lower' else 1]
            assert abs(q[j] - limit) < 1e-9
        lowest = np.array(arc['ranges'])[:, 0]
        assert np.all(lowest < np.array(arc['largest_margin']) + 1e-12)


def test_without_the_family_one_posture_is_printed_as_ever(capsys):
    code, streams = answer(capsys, *SEVEN)
    assert code == 0
    assert 'joints free' in ' '.join(streams.out.split())
    assert 'arc 1' not in streams.out
