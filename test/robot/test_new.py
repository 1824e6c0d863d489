# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The command `new`: what it writes is a robot file that `check` accepts, the same arm in each form.
"""

import os
import re

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.robot.file.parts.quantities import Units
from kinematics_service.robot.file.writing.new_robot import MAX_JOINTS, new_robot_text

ROUND_OFF = 1e-12  # m and rad; a dozen rotations of an arm of a metre
CONVENTIONS = ('standard', 'modified', 'elementary', 'shape')
UNITS = [Units(angle, length) for angle in ('rad', 'deg') for length in ('m', 'mm')]


@pytest.fixture(autouse=True)
def empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def refusal(capsys, *argv, code=2):
    assert main(['new', *argv]) == code
    out, err = capsys.readouterr()
    assert out == ''
    return err.splitlines()[-1]


@pytest.mark.slow
@pytest.mark.parametrize('dof', [1, 3, 6, MAX_JOINTS])
def test_a_new_robot_is_the_same_arm_in_each_convention_and_unit(dof):
    poses = []
    # With one of the units each; the next number of joints has them the other way round.
    for k, convention in enumerate(CONVENTIONS):
        units = UNITS[(k + dof) % len(UNITS)]
        text = new_robot_text('my_arm', dof, convention, units)
        assert max(map(len, text.splitlines())) <= 99
        robot = ks.robot_from_text(text)
        assert (robot.name, robot.dof, robot.convention) == ('my_arm', dof, convention)
        assert robot.description.warnings == ()
        assert robot.singularity.task.generic_rank == min(dof, len(robot.singularity.task.rows))
        poses.append(ks.forward_kinematics(robot, np.linspace(-1.1, 0.9, dof)))
    assert np.ptp(poses, axis=0).max() < ROUND_OFF


@pytest.mark.slow
@pytest.mark.parametrize('number', range(len(UNITS)), ids=CONVENTIONS)
def test_check_accepts_what_new_writes(capsys, number):
    convention, units, dof = CONVENTIONS[number], UNITS[number], (1, 4, 7, 6)[number]
    options = ['--dof', str(dof), '--convention', convention, '--units', ','.join(units)]
    assert main(['new', 'trial', *options]) == 0
    assert capsys.readouterr().out == (
        'wrote trial.yaml; next: python -m kinematics_service check trial.yaml\n'
    )
    assert main(['check', '--strict', 'trial.yaml']) == 0
    out, err = capsys.readouterr()
    assert err == ''
    assert 'none in the file' in out
    # The commented lines hold as they are: only the sign of a comment is to be taken away.
    with open('trial.yaml', encoding='utf-8') as file:
        text = file.read()
    text = re.sub(r'^# (known_poses:|  - \{q)', r'\1', text, flags=re.MULTILINE)
    with open('trial.yaml', 'w', encoding='utf-8') as file:
        file.write(text)
    assert main(['check', '--strict', 'trial.yaml']) == 0
    assert '1 of 1 agree' in capsys.readouterr().out


@pytest.mark.parametrize('convention', ['standard', 'modified'])
def test_the_comments_say_what_each_key_means(convention):
    text = new_robot_text('arm', 6, convention, Units())
    for key in ('name', 'variable', 'type', 'limits', 'velocity', 'theta', 'd', 'a', 'alpha'):
        assert re.search(rf'^#   {key} +\w', text, re.MULTILINE), key
    for key in ('base', 'tool', 'known_poses'):
        assert re.search(rf'^# .*{key}:', text, re.MULTILINE), key


@pytest.mark.slow
@pytest.mark.parametrize('source', ['ur5e', 'rrp_elementary'])
def test_a_copy_of_a_bundled_robot_is_that_arm(capsys, source):
    assert main(['new', 'mine', '--from', source, '--out', 'copy.yaml']) == 0
    assert capsys.readouterr().out.startswith('wrote copy.yaml; next: ')
    mine, theirs = ks.load_robot('copy.yaml'), ks.load_robot(source)
    assert mine.name == 'mine'
    assert mine.description.links == theirs.description.links
    assert mine.joint_names == theirs.joint_names


def test_a_file_that_is_there_is_left_alone(capsys):
    with open('arm.yaml', 'w', encoding='utf-8') as file:
        file.write('precious')
    # For a person to read.
    sentence = 'Error: arm.yaml exists already; give another name, --out, or --force'
    assert refusal(capsys, 'arm') == sentence
    with open('arm.yaml', encoding='utf-8') as file:
        assert file.read() == 'precious'
    assert main(['new', 'arm', '--dof', '2', '--force']) == 0
    assert ks.load_robot('arm.yaml').dof == 2


def test_the_screen_gets_the_file_alone(capsys):
    assert main(['new', 'shown', '--dof', '3', '--out', '-']) == 0
    assert ks.robot_from_text(capsys.readouterr().out).dof == 3
    assert os.listdir() == []


@pytest.mark.parametrize(
    ('argv', 'words'),
    [
        (['my arm'], ("NAME: 'my arm'",)),
        (['arm', '--dof', '0'], ('--dof: 0', '1 to 12')),
        (['arm', '--dof', '13'], ('--dof: 13', '1 to 12')),
        (['arm', '--units', 'deg,cm'], ("--units: unknown unit 'cm'", 'deg,mm')),
        (['arm', '--units', 'm,mm'], ('--units: m and mm',)),
        (['arm', '--from', 'ur5'], ("--from: no robot 'ur5': there", *ks.bundled_robots())),
        (['arm', '--from', 'other.yaml'], ('--from: other.yaml',)),
        (['arm', '--from', 'ur5e', '--dof', '6'], ('--from', '--dof')),
        (['arm', '--out', 'no/arm.yaml'], ('--out: there is no folder no', 'mkdir -p no')),
        (['arm', '--out', '.'], ('--out: . is a folder',)),
    ],
)  # fmt: skip
def test_wrong_usage_is_refused_in_a_sentence(capsys, argv, words):
    sentence = refusal(capsys, *argv)
    assert sentence.startswith(f'Error: {words[0]}')
    assert all(word in sentence for word in words)
    assert os.listdir() == []
