# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command line, as a user meets it: what it prints, where, and with which exit code."""

import ast
import fcntl
import inspect
import json
import math
import os
import re
import subprocess
import sys
import types
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import typer.completion

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.cli import commands
from kinematics_service.cli.arguments import join_numbers, split_ros_arguments
from kinematics_service.cli.commands import TYPER_WORDS
from kinematics_service.robot.bundled import GROUPS, grouped_robots

COMMANDS = ('check', 'fk', 'jacobian', 'robots', 'demo', 'echo', 'set', 'reload')
EVERY_COMMAND = ', '.join(commands.COMMANDS)
ROBOTS = tuple(ks.bundled_robots())
NARROW = 80

TWO_FAULTS = """\
robot: bad
convention: standard
joints:
  - {name: q1, type: revolute}
links:
  - {a: L1, alpha: 0, d: 0, theta: q1}
  - {a: 1, alpha: 0, d: 0, theta: q2}
"""
FINE = """\
robot: fine
convention: standard
joints:
  - {name: q1, type: revolute}
links:
  - {a: 1, alpha: 0, d: 0, theta: q1}
known_poses:
  - {q: [0], xyz: [1, 0, 0], rpy: [0, 0, 0]}
"""


@pytest.fixture
def narrow(monkeypatch):
    monkeypatch.setenv('COLUMNS', str(NARROW))


def answer(capsys, *argv):
    code = main(argv)
    assert code == 0, capsys.readouterr().err
    out, err = capsys.readouterr()
    assert err == ''
    return out


def refusal(capsys, *argv, code):
    assert main(argv) == code
    err = capsys.readouterr().err
    assert 'Traceback' not in err
    return err


def middle(robot):
    bounded = np.isfinite(robot.limits).all(axis=1)
    return np.where(bounded, np.where(bounded[:, None], robot.limits, 0.0).mean(axis=1), 0.3)


def joined(q):
    return ','.join(repr(float(value)) for value in q)


@pytest.mark.parametrize('command', COMMANDS)
def test_each_command_explains_itself_by_an_example_that_fits(capsys, narrow, command):
    text = answer(capsys, command, '--help')
    assert f'kinematics_service {command}' in text
    assert max(map(len, text.splitlines())) <= NARROW


@pytest.mark.parametrize('command', commands.COMMANDS)
def test_the_whole_help_has_every_option_and_the_short_one_less(capsys, command):
    short, whole = (answer(capsys, command, option) for option in ('--help', '--help-all'))
    of_file = commands.RENAMED.get(command, command.replace('-', '_'))
    module = import_module(f'{commands.home_of(command)}.{of_file}')
    for line in inspect.cleandoc(getattr(module, of_file).__doc__).splitlines():
        assert line.strip('\b ') in ' '.join(whole.split()) or line.strip('\b ') in whole
    first, every = (
        set(re.findall(r'^  (?:-h, )?(--[a-z-]+)', text, re.MULTILINE)) for text in (short, whole)
    )
    assert every - first == every & commands.RARE_OPTIONS
    assert {'--help', '--help-all'} <= first


def test_every_rare_option_is_one():
    group = commands.command_group()
    context = group.make_context('program', [], resilient_parsing=True)
    members = [group, *(group.get_command(context, name) for name in commands.COMMANDS)]
    names = {name for member in members for option in member.params for name in option.opts}
    assert names >= commands.RARE_OPTIONS


def test_an_error_is_also_json_with_its_code_where_json_is_printed(capsys, tmp_path):
    file = tmp_path / 'bad.yaml'
    file.write_text(TWO_FAULTS)
    assert main(['fk', '--robot', str(file), '--q', '0', '--json']) == 1
    out, err = capsys.readouterr()
    error = json.loads(out)['error']
    assert (error['code'], error['message']) == ('robot-file', err.rstrip('\n'))
    places = [(fault['line'], fault['where']) for fault in error['faults']]
    assert places == [(6, 'links[0].a'), (7, 'links[1].theta')]
    assert all(fault['code'] for fault in error['faults'])
    # The JSON of these goes into a file.
    words = ['audit', str(tmp_path / 'none.csv'), '--robot', str(file)]
    assert main([*words, '--json', str(tmp_path / 'out.json')]) == 1
    assert capsys.readouterr().out == ''


@pytest.mark.parametrize(
    ('words', 'named'),
    [
        (['--q', '1'], '6 joints'),
        (['--nosuch'], '--nosuch'),
        ([], "Missing option '--q'"),
    ],
)
def test_wrong_usage_is_json_too_where_json_is_printed(capsys, words, named):
    assert main(['fk', 'ur5e', *words, '--json']) == 2
    out, err = capsys.readouterr()
    error = json.loads(out)['error']
    assert error['code'] == 'wrong-usage'
    assert named in error['message']
    assert error['message'] in err
    for unknown in (['nosuch', '--json'], ['--json']):
        assert main(unknown) == 2
        assert capsys.readouterr().out == ''


def test_the_help_without_a_command_names_every_command(capsys, narrow):
    text = answer(capsys, '--help')
    assert all(re.search(rf'^  {command} ', text, re.MULTILINE) for command in COMMANDS)
    assert '--install-completion' not in text
    assert '--install-completion' in answer(capsys, '--help-all')
    assert max(map(len, text.splitlines())) <= NARROW


@pytest.mark.parametrize(
    ('words', 'offered'),
    [
        ('d', ['demo', 'derive']),
        ('fk --ro', ['--robot']),
        ('fk --robot ur5', ['ur5e']),
        ('demo --robot pum', ['puma560']),
        ('check pum', ['puma560']),
        ('derive pum', ['puma560']),
        ('plot no_such', []),
    ],
)
def test_a_shell_completes_commands_options_and_robots(capsys, monkeypatch, words, offered):
    monkeypatch.setenv('_KINEMATICS_SERVICE_COMPLETE', 'complete_bash')
    monkeypatch.setenv('COMP_WORDS', f'kinematics_service {words}')
    monkeypatch.setenv('COMP_CWORD', str(len(words.split())))
    assert main([]) == 0
    assert sorted(capsys.readouterr().out.split()) == offered


@pytest.mark.parametrize('shell', ['bash', 'zsh', 'fish'])
def test_the_completion_shown_is_that_of_the_installed_program(capsys, monkeypatch, shell):
    if not hasattr(typer.completion, '_get_shell_name'):
        pytest.skip('an older typer asks another library for the shell')
    monkeypatch.setattr('typer.completion._get_shell_name', lambda: shell)
    text = answer(capsys, '--show-completion')
    assert 'COMPLETE=complete_' in text
    assert 'python -m' not in text


@pytest.mark.parametrize('command', commands.COMMANDS)
def test_an_option_of_several_values_has_as_many_where_it_is_not_given(command):
    # typer before 0.10 cannot turn None into a tuple, and every call of the command fails.
    of_file = commands.RENAMED.get(command, command.replace('-', '_'))
    module = import_module(f'{commands.home_of(command)}.{of_file}')
    for name, parameter in inspect.signature(getattr(module, of_file)).parameters.items():
        if 'tuple[' in str(parameter.annotation).lower():
            default = getattr(parameter.default, 'default', parameter.default)
            assert default is not None, name


def test_the_version_is_that_of_the_package(capsys):
    assert answer(capsys, '--version') == f'kinematics_service {ks.__version__}\n'


def test_robots_are_listed_a_line_each_in_groups_that_fit_a_terminal(capsys, monkeypatch, narrow):
    text = answer(capsys, 'robots')
    header, *lines = text.splitlines()
    assert header.split() == ['robot', 'dof', 'joints', 'convention', 'source']
    assert sorted(line.split()[0] for line in lines if line and line not in GROUPS) == list(ROBOTS)
    assert max(map(len, lines)) <= NARROW
    (rrp,) = (line for line in lines if line.startswith('rrp_elementary'))
    assert rrp.split()[1:4] == ['3', 'RRP', 'elementary']
    listed = {
        title: [row.split()[0] for row in rows]
        for title, *rows in map(str.splitlines, text.split('\n\n')[1:])
    }
    assert listed == {title: list(names) for title, names in GROUPS.items()}
    # A robot that is added is listed, whether or not somebody thought of a group for it.
    fewer = {title: names[1:] for title, names in GROUPS.items()}
    monkeypatch.setattr('kinematics_service.robot.bundled.GROUPS', fewer)
    *_, (title, others) = grouped_robots().items()
    assert title == 'Others'
    assert list(others) == sorted(names[0] for names in GROUPS.values())


def test_robots_for_a_program(capsys):
    found = {one['name']: one for one in json.loads(answer(capsys, 'robots', '--json'))['robots']}
    assert sorted(found) == list(ROBOTS)
    rrp = found['rrp_elementary']
    assert (rrp['dof'], rrp['joints'], rrp['convention']) == (3, 'RRP', 'elementary')
    assert (rrp['group'], rrp['source'].split()[0]) == ('Textbook and course arms', 'RRP')
    assert ks.load_robot(rrp['file']).name == 'rrp_elementary'


@pytest.mark.slow
@pytest.mark.parametrize('name', ['xarm7', 'flexpicker'])
def test_a_check_of_a_bundled_robot_fits_a_terminal(capsys, narrow, name):
    robot = ks.load_robot(name)
    text = answer(capsys, 'check', name)
    lines = text.splitlines()
    # A path is as long as it is: the first line names the file.
    assert max(map(len, lines[2:])) <= NARROW
    assert all(joint in text for joint in robot.joint_names)
    assert f'{len(robot.description.known_poses)} agree' in text
    assert '…' not in text
    assert not any(line.endswith(' ') for line in lines)


def test_check_prints_the_table_of_the_textbook(capsys):
    text = answer(capsys, 'check', 'craig_3r')
    assert 'modified (Craig), T = Rx(alpha) Tx(a) Rz(theta) Tz(d)' in text
    assert re.search(r'i +a\(i-1\) \[m\] +alpha\(i-1\) \[rad\] +d \[m\] +theta \[rad\]', text)
    assert re.search(r'2 +L1 +-pi/2 +0 +q2', text)


def test_check_says_which_joints_work_against_each_other_at_every_pose(capsys):
    text = answer(capsys, 'check', 'six_joint_dh')
    structure = next(line for line in text.splitlines() if 'against each other' in line)
    assert 'theta1' in structure
    assert 'theta2' in structure
    assert 'theta3' not in structure
    assert 'rank 5 of 6' in structure


def test_check_reports_all_faults_of_all_files_and_still_checks_the_others(capsys, tmp_path):
    bad, fine = tmp_path / 'bad.yaml', tmp_path / 'fine.yaml'
    bad.write_text(TWO_FAULTS)
    fine.write_text(FINE)
    missing = tmp_path / 'missing.yaml'
    assert main(['check', str(bad), str(missing), 'nosuch', str(fine)]) == 1
    out, err = capsys.readouterr()
    assert [line.partition(': ')[0] for line in err.splitlines()] == [
        f'{bad}:6',
        f'{bad}:7',
        str(missing),
        "no robot 'nosuch'",
    ]
    assert '1 of 1 agree' in out
    assert out.endswith('4 files checked, 3 of them with faults\n')


DOUBTFUL = """\
robot: doubtful
source: a datasheet in millimetres
convention: standard
joints:
  - {name: arm/waist, variable: q1, type: revolute, limits: [-165, 165]}
  - {name: arm/spare, variable: q2, type: revolute, unused: true}
links:
  - {a: 310, alpha: 0, d: 0.1, theta: q1}
"""


def test_check_warns_of_other_units_and_strict_fails_for_it(capsys, tmp_path):
    file = tmp_path / 'doubtful.yaml'
    file.write_text(DOUBTFUL)
    for options, code in ([], 0), (['--strict'], 1):
        assert main(['check', *options, str(file), 'planar_2r']) == code
        out, err = capsys.readouterr()
        # For a person to read.
        assert err == (
            f'{file}:5: WARN joints[0].limits: limits of 26.2606 turns: '
            'are these degrees? (then: units: {angle: deg})\n'
            f'{file}:8: WARN links[0].a: a length of 310 m: '
            'are these millimetres? (then: units: {length: mm})\n'
        )
        assert out.endswith('2 files checked, no faults, 1 with warnings\n')


@pytest.mark.slow
def test_strict_has_nothing_against_bundled_robots(capsys):
    # That no file has a warning, and that known poses hold, `test_bundled` shows of each.
    assert main(['check', '--strict', *ROBOTS[::5], 'excavator']) == 0
    assert capsys.readouterr().err == ''


def test_check_heads_the_columns_by_the_keys_to_type(capsys, tmp_path):
    file = tmp_path / 'doubtful.yaml'
    file.write_text(DOUBTFUL.replace('310', '0.31').replace('165', '2.8'))
    text = answer(capsys, 'check', str(file))
    assert re.search(r'^ +joint +variable +type +limits ', text, re.MULTILINE)
    assert re.search(r'^ +arm/waist +q1 +revolute  ', text, re.MULTILINE)
    assert re.search(r'^ +arm/spare +q2 +revolute, unused ', text, re.MULTILINE)


def test_a_known_pose_without_rpy_is_checked_in_position(capsys, tmp_path):
    file = tmp_path / 'pendant.yaml'
    file.write_text(FINE.replace(', rpy: [0, 0, 0]', ''))
    assert 'known_poses[0]: 0 m (tolerance 1e-06)\n' in answer(capsys, 'check', str(file))
    file.write_text(FINE.replace('[1, 0, 0], rpy: [0, 0, 0]', '[1, 0, 0.003]'))
    assert main(['check', str(file)]) == 1
    err = capsys.readouterr().err
    assert err.startswith(f'{file}: known_poses[0]: ')
    assert '0.003 m (tolerance 1e-06)' in err


def test_a_pipe_for_a_robot_is_refused_at_once(capsys, tmp_path):
    pipe = tmp_path / 'arm.yaml'
    os.mkfifo(pipe)
    sentence = f'{pipe}: is a named pipe; give the robot file itself\n'
    assert refusal(capsys, 'fk', '--robot', str(pipe), '--q', '1', code=1) == sentence
    assert refusal(capsys, 'check', str(pipe), code=1) == sentence
    if find_spec('rclpy'):
        assert refusal(capsys, '--robot', str(pipe), code=1).endswith(sentence)


def test_a_known_pose_that_the_table_misses_is_a_fault(capsys, tmp_path):
    file = tmp_path / 'off.yaml'
    file.write_text(FINE.replace('xyz: [1, 0, 0]', 'xyz: [1, 0.01, 0]'))
    assert main(['check', str(file)]) == 1
    out, err = capsys.readouterr()
    assert err.startswith(f'{file}: known_poses[0]: ')
    assert '0.01 m (tolerance 1e-06), 0 rad (tolerance 1e-06)' in err
    assert '0 of 1 agree' in out


@pytest.mark.slow
@pytest.mark.parametrize('name', ['craig_3r', 'scara_hsr065', 'panda', 'five_bar'])
def test_fk_and_jacobian_in_json_are_what_the_library_says(capsys, name):
    robot = ks.load_robot(name)
    q, qdot = middle(robot), np.linspace(-0.5, 0.4, robot.dof)
    pose = json.loads(answer(capsys, 'fk', '--robot', name, '--q', joined(q), '--json'))
    assert pose['matrix'] == ks.forward_kinematics(robot, q).tolist()
    assert pose['position'] == [row[3] for row in pose['matrix'][:3]]
    assert pose['joint_names'] == list(robot.joint_names)

    arguments = ('--q', joined(q), '--qdot', joined(qdot), '--frame', 'tool', '--json')
    velocity = json.loads(answer(capsys, 'jacobian', '--robot', name, *arguments))
    assert velocity['jacobian'] == ks.jacobian(robot, q, 'tool').tolist()
    assert velocity['twist'] == ks.twist(robot, q, qdot, 'tool').tolist()
    assert velocity['singularity']['distance'] == ks.singularity(robot, q).distance
    assert velocity['singularity']['level'] in ('OK', 'WARN', 'ERROR')


@pytest.mark.parametrize('command', ['fk', 'jacobian'])
def test_every_key_of_the_json_is_documented(capsys, command):
    help_text = answer(capsys, command, '--help-all')
    text = answer(capsys, command, '--robot', 'planar_2r', '--q', '0,0', '--json')
    document = json.loads(text)
    documented = set(re.findall(r'\w+', help_text.partition('keys of --json')[2]))
    assert documented >= set(document) | set(document['singularity'])


def test_json_has_null_for_what_is_infinite(capsys):
    def refuse(constant):
        raise AssertionError(f'{constant} is not JSON')

    arguments = ['--robot', 'planar_2r', '--q', '0,1', '--qdot', '0,1', '--json']
    document = json.loads(answer(capsys, 'jacobian', *arguments), parse_constant=refuse)
    assert document['singularity']['time_to_warning'] is None
    assert document['singularity']['rate'] > 0.0


def test_degrees_are_for_joints_that_turn(capsys):
    text = answer(capsys, 'fk', '--robot', 'spherical_rrp', '--deg', '--q', '90,-45,0.5', '--json')
    assert json.loads(text)['q'] == [math.pi / 2, -math.pi / 4, 0.5]


@pytest.mark.slow
@pytest.mark.parametrize(
    'written',
    [
        ['--q', '-0.1,0.2,3e-1'],
        ['--q=-0.1,0.2,3e-1'],
        ['--q', '-0.1, +.2 0.3'],
        ['--q', '-0.1', '0.2', '0.3'],
        ['--q', '-0.1,', '0.2,', '0.3'],
        ['--q', '-0.1', ',', '0.2', ',', '0.3'],
        ['--q=', '-0.1', '0.2', '0.3'],
        ['--q', '[-0.1, 0.2, 0.3]'],
    ],
)
def test_positions_may_be_written_as_people_write_them(capsys, written):
    text = answer(capsys, 'fk', '--robot', 'craig_3r', *written, '--json')
    assert json.loads(text)['q'] == [-0.1, 0.2, 0.3]


def test_numbers_are_joined_after_options_that_take_them_and_nowhere_else():
    assert join_numbers(['check', '1', '2']) == ['check', '1', '2']
    assert join_numbers(['--q', '1', '--deg', '2']) == ['--q', '1', '--deg', '2']
    assert join_numbers(['--q', '1', '2', '--qdot', '-3', '4']) == ['--q', '1 2', '--qdot', '-3 4']


@pytest.mark.parametrize(
    ('robot', 'q', 'level', 'last'),
    [
        ('ur5e', '0,-1.2,1.5,-1,0.3,0', 'OK: distance 0.3 rad', 'weakest direction'),
        ('planar_2r', '0,0', 'ERROR: distance 0 rad', 'lost direction'),
        (
            'so101',
            '0,0,0,1,0',
            'OK: distance: none found within 1 rad (57 deg)',
            'weakest direction',
        ),
        ('fr3', '0,0,0,-1,0,1,0', 'OK: distance 0.533 rad', 'weakest direction'),
    ],
)
def test_fk_prints_at_most_eight_lines(capsys, narrow, robot, q, level, last):
    lines = answer(capsys, 'fk', '--robot', robot, '--q', q).splitlines()
    assert len(lines) <= 8
    assert re.fullmatch(rf'  singularity +{re.escape(level)}, WARN below.*', lines[4])
    assert any(line.startswith(f'  {last}') for line in lines)
    determinant = ks.singularity(
        ks.load_robot(robot), [float(x) for x in q.split(',')]
    ).determinant
    assert any(line.startswith('  determinant') for line in lines) == (determinant is not None)


@pytest.mark.parametrize(('q', 'level'), [('-0.93,-0.42,2.8', 'WARN'), ('2.14,-2.8,1.38', 'OK')])
def test_fk_names_a_loop_that_is_nearly_flat_only_near_it(capsys, q, level):
    text = answer(capsys, 'fk', '--robot', 'four_bar_arm', f'--q={q}')
    assert re.search(rf'singularity +{level}:', text)
    assert bool(re.search(r'^  near +.*four_bar', text, re.MULTILINE)) == (level == 'WARN')


def test_fk_says_how_near_the_pose_is_in_words(capsys):
    text = answer(capsys, 'fk', '--robot', 'planar_2r', '--deg', '--q', '0,3', '--all')
    assert 'level WARN' in text
    assert '3 deg of joint motion' in text
    assert re.search(r'q2 +0\.0524 rad +3\.00 deg ', text)
    assert 'lost direction' in text
    text = answer(capsys, 'fk', '--robot', 'planar_2r', '--q', '0,0', '--all')
    assert 'level ERROR' in text
    assert 'this pose is singular' in text
    assert re.search(r'rank +1 of 2', text)
    assert re.search(r'lost direction +motion along x\n', text)
    assert re.search(r'q2 .* -?1\.000 ', text)
    assert 'leads away fastest (or its opposite)' in text


def test_jacobian_says_when_a_motion_comes_to_a_warning(capsys):
    # planar_2r warns at q2 = 0.1 rad: 0.4 rad away, at 0.5 rad/s.
    arguments = ('jacobian', '--robot', 'planar_2r', '--q', '0,0.5', '--qdot')
    words = r'along qdot +distance changes by -0\.5 per second: WARN in 0\.8 s\n'
    assert re.search(words, answer(capsys, *arguments, '0,-0.5'))
    words = r'along qdot +distance changes by 0\.5 per second: not approaching'
    assert re.search(words, answer(capsys, *arguments, '0,0.5'))


@pytest.mark.parametrize(
    ('elbow', 'words', 'none'),
    [
        ('0.9', r'distance +0\.9 rad: 51\.6 deg', False),
        ('1.4', r'distance +none found within 1 rad', True),
        ('-1.7', r'distance +none found within 1 rad', True),
    ],
)
def test_fk_says_a_distance_that_a_hand_finds_too_or_that_it_is_farther(
    capsys, elbow, words, none
):
    arguments = ('fk', '--robot', 'planar_2r', '--q', f'0,{elbow}')
    text = answer(capsys, *arguments, '--all')
    assert re.search(words, text)
    assert 'about' not in text
    # Only what was found has a column.
    assert ('singular  way out' in text) != none
    found = json.loads(answer(capsys, *arguments, '--json'))['singularity']
    assert found['distance'] == pytest.approx(min(abs(float(elbow)), 1.0), abs=1e-9)
    assert list(found)[4:6] == ['distance', 'determinant']


def test_fk_names_joints_beyond_their_limits(capsys):
    arguments = ('fk', '--robot', 'puma560', '--deg', '--q', '0,0,0,0,101,0')
    assert re.search(
        r'^ +j5 .*beyond its limit$', answer(capsys, *arguments, '--all'), re.MULTILINE
    )
    assert answer(capsys, *arguments).endswith('beyond limits       j5\n')
    assert json.loads(answer(capsys, *arguments, '--json'))['beyond_limits'] == ['j5']


@pytest.mark.slow
@pytest.mark.parametrize(
    ('command', 'robot', 'q', 'asks'),
    [
        ('fk', 'planar_3r', '20,-45,70', True),  # without limits: more than a turn
        ('jacobian', 'scara_hsr065', '30,-50,0.05,10', True),
        ('fk', 'planar_3r', '6.2,-6.2,0', False),
        ('fk', 'puma560', '0,0,0,0,3,0', False),  # beyond its limit, and no degrees
        ('fk', 'puma560', '1e3,0,0,0,0,0', False),  # nothing in degrees either
    ],
)
def test_positions_that_look_like_degrees_are_asked_about(capsys, command, robot, q, asks):
    question = '--q is read in radians and looks like degrees: did you mean --deg?\n'
    assert main([command, '--robot', robot, '--q', q, '--json']) == 0
    out, err = capsys.readouterr()
    assert err == (question if asks else '')
    assert json.loads(out)['robot'] == robot
    if asks:
        answer(capsys, command, '--robot', robot, '--deg', '--q', q)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['panda', 'craig_3r'])
@pytest.mark.parametrize('command', ['fk', 'jacobian'])
def test_poses_and_jacobians_fit_a_terminal_uncut(capsys, narrow, command, name):
    robot = ks.load_robot(name)
    text = answer(capsys, command, '--robot', name, '--q', joined(middle(robot)))
    assert max(map(len, text.splitlines())) <= NARROW
    assert '…' not in text


def test_a_jacobian_too_wide_for_the_terminal_goes_on_below(capsys, narrow):
    robot = ks.load_robot('panda')
    q = middle(robot)
    text = answer(capsys, 'jacobian', '--robot', 'panda', '--q', joined(q))
    shown = [line.split()[1:] for line in text.splitlines() if line.startswith('  vx ')]
    assert np.allclose(
        [float(entry) for block in shown for entry in block],
        ks.jacobian(robot, q)[0],
        atol=0.6e-5,  # five decimals are shown
    )


def test_the_labelled_jacobian_and_twist_are_the_librarys(capsys):
    arguments = ('--robot', 'craig_3r', '--q', '0.1,0.2,0.3', '--qdot', '1,0,0')
    lines = answer(capsys, 'jacobian', *arguments).splitlines()
    assert lines[1].split() == ['q1', 'q2', 'q3']
    assert [line.split()[0] for line in lines[2:8]] == ['vx', 'vy', 'vz', 'wx', 'wy', 'wz']
    robot = ks.load_robot('craig_3r')
    J = ks.jacobian(robot, [0.1, 0.2, 0.3])
    shown = [[float(entry) for entry in line.split()[1:]] for line in lines[2:8]]
    assert np.allclose(shown, J, atol=0.6e-5)
    assert '  wz  1.000000 rad/s  57.2958 deg/s' in lines


@pytest.mark.parametrize(
    ('argv', 'words'),
    [
        (['fk', '--robot', 'craig_3r', '--q', '1,2'], ('--q: craig_3r has 3', 'q1, q2, q3')),
        (['fk', '--robot', 'craig_3r', '--q', '1,2,q3'], ("--q: 'q3' ", '--q=0.1,0.1,0.1')),
        (['jacobian', '--robot', 'craig_3r', '--q', '1,2,3', '--qdot', 'nan,0,0'],
         ("--qdot: 'nan' ", '--qdot=0.1,0.1,0.1')),
        (['fk', '--robot', 'craig', '--q', '1'],
         ("--robot: no robot 'craig':", "'craig_3r'?")),
        (['fk', '--robot', 'no/such.yaml', '--q', '1'],
         ('--robot: no/such.yaml: no such file;', 'kinematics_service robots')),
        (['demo', '--robot', 'nosuch'], ("--robot: no robot 'nosuch'",)),
        (['--robot', 'puma560', 'robots'], ("after 'robots'",)),
        (['robots', '--ros-args', '-p', 'a:=1'], ('robots takes no --ros-args',)),
        (['fk', '--q', '1'], ("option '--robot'. A robot file,",)),
        (['export', 'ur5e'], ('give one of --urdf FILE, --cpp FILE, --c FILE and',)),
        (['new'], ("argument 'NAME'. Name of",)),
        (['frobnicate'], ("command 'frobnicate'", EVERY_COMMAND)),
        (['chek', 'ur5e'], ("'chek', did you mean 'check'?", EVERY_COMMAND)),
        (['fk', '--robt', 'ur5e'], ('--robot',)),
        (['demo', '--duration', 'nan'], ('--duration',)),
        (['echo', 'everything'], ("'everything'", "'jacobian', 'pose', 'twist'")),
        (['echo', '--timeout', 'abc'], ("'--timeout': ",)),
        (['new', 'arm', '--dof', 'two'], ("'--dof': ",)),
        (['fk', '--robot', 'craig_3r', '--q', '0,1,0,2,0,3'], ('points: --q=0.1,0.2,0.3',)),
        (['demo', '--replay', 'no_such.csv'], ('no_such.csv',)),
    ],
)  # fmt: skip
def test_wrong_usage_is_refused_in_a_sentence(capsys, argv, words):
    said = refusal(capsys, *argv, code=2)
    assert all(word in said for word in words)
    assert not any(phrase in said for phrase in TYPER_WORDS)


def test_the_messages_of_two_slips_on_the_command_line(capsys):
    # For a person to read.
    said = refusal(capsys, 'fk', '--robot', 'craig_3r', '--q', '1,2', code=2)
    assert said.endswith('Error: --q: craig_3r has 3 joints (q1, q2, q3), not 2\n')
    said = refusal(capsys, 'fk', '--robot', 'none.yaml', '--q', '1', code=2)
    assert said.endswith(
        'Error: --robot: none.yaml: no such file; give a robot file or a bundled robot '
        '(kinematics_service robots lists them)\n'
    )


def test_a_robot_file_with_faults_is_a_failure_not_wrong_usage(capsys, tmp_path):
    file = tmp_path / 'bad.yaml'
    file.write_text(TWO_FAULTS)
    err = refusal(capsys, 'fk', '--robot', str(file), '--q', '1', code=1)
    assert err.startswith(f'{file}:6: links[0].a: ')
    assert len(err.splitlines()) == 2


@pytest.mark.parametrize(
    ('argv', 'ours', 'ros'),
    [
        ([], [], []),
        (['--robot', 'x'], ['--robot', 'x'], []),
        (['--ros-args', '-p', 'a:=1'], [], ['--ros-args', '-p', 'a:=1']),
        (['a', '--ros-args', '-r', 'b:=c', '--', 'd'], ['a', 'd'],
         ['--ros-args', '-r', 'b:=c', '--']),
        (['--ros-args', '1', '--', 'a', '--ros-args', '2'], ['a'],
         ['--ros-args', '1', '--', '--ros-args', '2']),
        (['a', '--', 'b'], ['a', '--', 'b'], []),
    ],
)  # fmt: skip
def test_ros_arguments_are_cut_out_wherever_they_stand(argv, ours, ros):
    assert split_ros_arguments(argv) == (ours, ros)


def stand_in(monkeypatch, module, function, code):
    # A module that needs ROS, which only notes how it was called.
    calls = []
    fake = types.ModuleType(f'kinematics_service.{module}')

    def note(*arguments):
        calls.append(arguments)
        return code

    setattr(fake, function, note)
    monkeypatch.setitem(sys.modules, fake.__name__, fake)
    return calls


@pytest.mark.parametrize('code', [0, 2])
def test_without_a_command_the_node_runs_and_its_exit_code_is_ours(monkeypatch, code):
    calls = stand_in(monkeypatch, 'node.process.runner', 'run_node', code)
    assert main(['--ros-args', '-r', '__ns:=/left', '--', '--allow-mixed-ros']) == code
    assert main(['--robot', 'ur5e', '--allow-unsecured']) == code
    assert main(['--managed', '--robot', 'ur5e']) == code
    assert calls == [
        ([], ['--ros-args', '-r', '__ns:=/left', '--'], False, True, False),
        (['ur5e'], [], True, False, False),
        (['ur5e'], [], False, False, True),
    ]


# Starts of the node, and what only looks like one.
STARTS = (
    [],
    ['--robot', 'ur5e'],
    ['--robot=left=ur5e', '--allow-unsecured', '--robot', 'right=puma560', '--allow-mixed-ros'],
    ['--allow-mixed-ros', '--allow-mixed-ros'],
    ['--managed', '--robot', 'ur5e'],
    ['--robot='],
    ['--robot', ''],
    ['--robot', '--allow-unsecured'],
    ['--robot'],
    ['--robot', '-x'],
    ['--robot=-x'],
    ['--robots', 'ur5e'],
    ['--allow-unsecured=yes'],
    ['--robot', 'ur5e', 'robots'],
    ['robots', '--robot', 'ur5e'],
    ['--', '--robot', 'ur5e'],
    ['--help', '--robot', 'ur5e'],
    ['--robot', 'ur5e', '--version'],
    ['ur5e'],
    ['--allow-unsecured', '-'],
)


@pytest.mark.parametrize('argv', STARTS, ids=' '.join)
def test_a_start_of_the_node_means_the_same_to_typer(monkeypatch, capsys, argv):
    calls = stand_in(monkeypatch, 'node.process.runner', 'run_node', 0)
    code, said = main(argv), capsys.readouterr()
    monkeypatch.setattr('kinematics_service.cli.command_line.plain_options', lambda ours: None)
    assert (main(argv), capsys.readouterr()) == (code, said)
    assert len(calls) in (0, 2)
    assert calls[:1] == calls[1:]


def test_demo_and_echo_hand_on_what_they_were_told(monkeypatch, tmp_path):
    recording = tmp_path / 'recorded.csv'
    recording.write_text('')
    demos = stand_in(monkeypatch, 'apps.demo.demo', 'run_demo', 0)
    echoes = stand_in(monkeypatch, 'apps.demo.echo', 'run_echo', 0)
    assert main(['demo', '--ros-args', '-r', 'a:=b']) == 0
    assert main(['demo', '--duration', '2', '--trajectory', 'sine', '--robot', 'ur5e']) == 0
    assert main(['demo', '--replay', str(recording)]) == 0
    assert main(['echo', 'warning', '--once', '--json', '--node', '/left/kinematics']) == 0
    assert [(*call[:3], call[3] and str(call[3]), call[4]) for call in demos] == [
        (None, None, 'smooth', None, ['--ros-args', '-r', 'a:=b']),
        ('ur5e', 2.0, 'sine', None, []),
        (None, None, 'smooth', str(recording), []),
    ]
    assert echoes == [('warning', '/left/kinematics', True, True, 10.0, [])]


@pytest.mark.usefixtures('without_rclpy')
def test_without_ros_the_node_says_how_to_get_it(capsys):
    err = refusal(capsys, code=1)
    assert len(err.splitlines()) == 1
    assert "pip install '.[ros]'" in err
    assert 'source a ROS 2' in err


def fail_with(monkeypatch, error):
    def raise_error(*_):
        raise error

    monkeypatch.setattr('kinematics_service.cli.robots.grouped_robots', raise_error)


def test_an_unexpected_error_is_one_line(capsys, monkeypatch):
    fail_with(monkeypatch, RuntimeError('first\nsecond'))
    assert refusal(capsys, 'robots', code=1) == (
        'kinematics_service: RuntimeError: first second '
        '(set KINEMATICS_TRACEBACK=1 for the details)\n'
    )


def test_the_details_of_an_unexpected_error_are_there_when_asked_for(capsys, monkeypatch):
    monkeypatch.setenv('KINEMATICS_TRACEBACK', '1')
    fail_with(monkeypatch, RuntimeError('deep down'))
    assert main(['robots']) == 1
    assert 'Traceback (most recent call last)' in capsys.readouterr().err


def test_ctrl_c_ends_with_130_and_no_words(capsys, monkeypatch):
    fail_with(monkeypatch, KeyboardInterrupt())
    assert refusal(capsys, 'robots', code=130) == ''


@pytest.mark.parametrize(('typer', 'click', 'refused'), [
    ('0.9.0', '8.2.1', False), ('0.9.0', '8.3.0', True), ('0.12.5', '8.10.1', True),
    ('0.13.1', '8.3.1', False), ('1.0', '9.0.dev1', False),
])  # fmt: skip
def test_an_old_typer_with_a_new_click_is_refused(monkeypatch, capsys, typer, click, refused):
    monkeypatch.setattr('typer.__version__', typer)
    monkeypatch.setattr('importlib.metadata.version', lambda name: click)
    assert main(['robots']) == (1 if refused else 0)
    output = capsys.readouterr()
    assert ('typer>=0.13' in output.err) == refused == (not output.out)


def test_options_are_typed_as_the_oldest_typer_reads_them():
    package = Path(ks.__file__).parent
    for file in [*package.glob('cli/*.py'), *package.glob('apps/*/commands/*.py')]:
        for node in ast.walk(ast.parse(file.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Subscript) and ast.unparse(node.value) == 'Annotated':
                assert '|' not in ast.unparse(node.slice.elts[0]), f'{file}:{node.lineno}'


@pytest.mark.slow
def test_a_reader_that_leaves_early_is_no_error():
    reading, writing = os.pipe()
    fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, 4096)  # less than the command prints
    with subprocess.Popen(
        [sys.executable, '-m', 'kinematics_service', 'check', *ROBOTS[:5]],
        stdout=writing, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        os.close(writing)
        assert os.read(reading, 5) == ROBOTS[0][:5].encode()
        os.close(reading)
        assert process.stderr.read() == ''


def test_what_is_piped_has_no_colours_and_whole_lines(capsys, monkeypatch):
    monkeypatch.setenv('TERM', 'xterm-256color')
    text = answer(capsys, 'check', 'ur3e')
    assert '\x1b' not in text
    (source,) = (line for line in text.splitlines() if line.startswith('  source'))
    assert source.endswith(ks.load_robot('ur3e').source)


@pytest.mark.parametrize('command', [('derive', '--out'), ('export', '--urdf')])
def test_a_robot_file_is_not_replaced_by_what_is_made_from_it(capsys, tmp_path, command):
    name, option = command
    file = tmp_path / 'arm.yaml'
    text = ks.bundled_robots()['planar_2r'].read_text()
    file.write_text(text)
    assert main([name, str(file), option, str(file)]) == 2
    assert f'{option}: {file} is the robot file' in capsys.readouterr().err
    assert file.read_text() == text


def test_a_document_that_cannot_be_written_is_refused_before_the_derivation(capsys, tmp_path):
    assert main(['derive', 'ur5e', '--out', str(tmp_path / 'none' / 'ur5e.tex')]) == 2
    assert f'mkdir -p {tmp_path / "none"}' in capsys.readouterr().err


def test_a_page_in_a_folder_that_is_not_there_is_a_sentence(capsys, tmp_path):
    table = tmp_path / 'run.csv'
    table.write_text('stamp,position.q1,position.q2\n1,0.1,0.5\n2,0.2,0.6\n')
    page = tmp_path / 'none' / 'run.html'
    assert main(['audit', str(table), '--robot', 'planar_2r', '--html', str(page)]) == 1
    assert f'{page}: ' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('command', 'others', 'option'),
    [
        ('check', (), ('--robot', 'planar_2r')),
        ('check', (), ('--robot=planar_2r',)),
        ('export', ('--urdf', '-'), ('--robot', 'planar_2r')),
    ],
)
def test_a_robot_that_stands_alone_is_taken_by_its_option_too(
    capsys, tmp_path, monkeypatch, command, others, option
):
    monkeypatch.chdir(tmp_path)
    alone = answer(capsys, command, 'planar_2r', *others)
    assert answer(capsys, command, *option, *others) == alone
    assert answer(capsys, command, *others, *option) == alone


def test_a_robot_that_an_option_takes_may_stand_alone(capsys, tmp_path):
    for command, *others in (
        ('fk', '--q', '0.3,0.4'),
        ('jacobian', '--q', '0.3,0.4'),
        ('ik', '--xyz', '0.9,0.5,0'),
    ):
        named = answer(capsys, command, '--robot', 'planar_2r', *others)
        assert answer(capsys, command, 'planar_2r', *others) == named
    urdf = tmp_path / 'arm.urdf'
    assert main(['export', 'planar_2r', '--urdf', str(urdf)]) == 0
    capsys.readouterr()
    imports = []
    for words in ((str(urdf),), ('--urdf', str(urdf))):
        assert main(['import', *words]) == 0
        imports.append(capsys.readouterr())
    assert imports[0] == imports[1]
    for command in ('demo', *(['view'] if find_spec('viser') else [])):
        assert "no robot 'nosuch'" in refusal(capsys, command, 'nosuch', code=2)


@pytest.mark.parametrize('command', ['compare', 'derive', 'export', 'plot'])
def test_an_unknown_robot_is_refused_in_the_same_words_by_every_command(capsys, tmp_path, command):
    if command == 'plot' and not find_spec('matplotlib'):
        pytest.skip('needs matplotlib')
    mine = tmp_path / 'mine.txt'
    mine.touch()
    others = {'compare': (str(mine),), 'export': ('--urdf', '-')}.get(command, ())
    said = refusal(capsys, 'ik', '--robot', 'nosuch', '--xyz', '0,0,1', code=2).splitlines()[-1]
    assert said.startswith("Error: --robot: no robot 'nosuch'")
    for given in (('nosuch',), ('--robot', 'nosuch')):
        assert refusal(capsys, command, *given, *others, code=2).splitlines()[-1] == said


@pytest.mark.parametrize('end', [(), ('--verbose',)])
def test_the_option_of_a_robot_needs_one(capsys, end):
    said = refusal(capsys, 'compare', 'mine.txt', '--robot', *end, code=2)
    assert 'Error: --robot: write a robot file' in said


def test_a_command_loads_nothing_that_only_others_need():
    program = (
        'import sys\nfrom kinematics_service.__main__ import main\n'
        'for line in sys.argv[1:]:\n    main(line.split())\n    print("LOADED", *sys.modules)\n'
    )
    # One after the other: what is loaded stays.
    lines = ['--help', 'fk ur5e --q 0,0,0,0,0,0', 'robots', 'fk --help', 'check ur5e']
    done = subprocess.run(
        [sys.executable, '-c', program, *lines], capture_output=True, text=True, check=True
    )
    printed = [line.split() for line in done.stdout.splitlines() if line.startswith('LOADED')]
    assert len(printed) == len(lines)
    ours = [name.split('.') for name in printed[1] if name.startswith('kinematics_service.')]
    assert not {name[1] for name in ours} & {'apps', 'node'}
    assert not {tuple(name[1:3]) for name in ours} & {('robot', 'urdf'), ('robot', 'tables')}
    assert ['kinematics_service', 'cli', 'ik'] not in ours
    assert not {'rclpy', 'sympy', 'matplotlib'} & set(printed[-1])
    assert done.stderr == ''


def test_a_locked_joint_is_typed_with_a_degree_sign(capsys):
    typed, plain = (
        answer(capsys, 'derive', '--robot', 'planar_2r', '--lock', f'q2={value}')
        for value in ('−90°', '-pi/2')
    )
    assert typed == plain


@pytest.mark.slow
def test_every_command_that_writes_a_file_names_it(capsys, tmp_path):
    robot = tmp_path / 'arm.yaml'
    robot.write_text(ks.bundled_robots()['planar_2r'].read_text().split('singularity:')[0])
    written = {name: str(tmp_path / name) for name in ('a.md', 'a.urdf', 'b.yaml')}
    said = answer(capsys, 'derive', str(robot), '--out', written['a.md'])
    assert said == f'wrote {written["a.md"]}\n'
    assert answer(capsys, 'derive', str(robot), '--write') == (
        f'wrote {robot}: singularity.factors: elbow\n'
    )
    said = answer(capsys, 'export', str(robot), '--urdf', written['a.urdf'])
    assert said.startswith(f'wrote {written["a.urdf"]}')
    said = answer(capsys, 'import', '--urdf', written['a.urdf'], '--out', written['b.yaml'])
    assert said.endswith(f'\nwrote {written["b.yaml"]}\n')
    assert all(Path(written[name]).stat().st_size for name in ('a.md', 'a.urdf', 'b.yaml'))


def test_what_check_finds_is_data_too(capsys, tmp_path):
    good, wrong = tmp_path / 'good.yaml', tmp_path / 'wrong.yaml'
    text = ks.bundled_robots()['puma560'].read_text()
    good.write_text(text)
    wrong.write_text(text.replace('alpha: ', 'alfa: ', 1))
    assert main(['check', '--json', str(good), str(wrong), 'no_such_arm']) == 1
    out, err = capsys.readouterr()
    assert err == ''
    first, second, third = json.loads(out)['files']
    robot = ks.load_robot(good)
    assert first['faults'] == first['warnings'] == []
    assert (first['file'], first['robot'], first['dof']) == (str(good), 'puma560', 6)
    assert first['reach'] == robot.singularity.task.reach
    assert [pose['agrees'] for pose in first['known_poses']] == [True] * len(first['known_poses'])
    assert second['robot'] is third['robot'] is None
    (fault,) = (one for one in second['faults'] if 'alfa' in one['where'])
    assert wrong.read_text().splitlines()[fault['line'] - 1].strip().count('alfa') == 1
    assert third['faults'][0]['code'] == 'unknown-robot'
    assert "'no_such_arm'" in third['faults'][0]['message']
    keys = answer(capsys, 'check', '--help-all').partition('The keys of --json')[2]
    assert all(re.search(rf'\b{key}\b', keys) for key in (*first, *second['faults'][0]))


def test_a_known_pose_that_is_missed_is_so_in_the_data(capsys, tmp_path):
    file = tmp_path / 'arm.yaml'
    text = ks.bundled_robots()['planar_2r'].read_text().partition('known_poses')[0]
    file.write_text(
        f'{text}known_poses:\n  - {{q: [0, 0], xyz: [2, 0, 0]}}\n  - '
        '{q: [0, 0], xyz: [1, 0, 0]}\n'
    )
    assert main(['check', '--json', str(file)]) == 1
    (found,) = json.loads(capsys.readouterr().out)['files']
    assert [pose['agrees'] for pose in found['known_poses']] == [True, False]
    assert found['faults'][0]['where'] == 'known_poses[1]'
