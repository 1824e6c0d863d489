# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Robot files whose constants have no value: what works on letters, and what refuses them."""

import json

import pytest
from refusal import places

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.errors import RobotFileError
from kinematics_service.robot.file.reader import parse_robot

ARM = """\
robot: sym
source: homework
convention: standard
constants: {L1: , L2}
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
links:
  - {a: L1, alpha: 0, d: 0, theta: q1}
  - {a: L2, alpha: 0, d: 0, theta: q2}
"""
JACOBIAN = 'J = [-L1*s1-L2*s12, -L2*s12; L1*c1+L2*c12, L2*c12]\n'


@pytest.fixture
def file(tmp_path):
    path = tmp_path / 'sym.yaml'
    path.write_text(ARM)
    return path


def test_check_shows_letters_and_no_number_that_follows_from_them(file, capsys):
    assert main(['check', '--strict', str(file)]) == 0
    out, err = capsys.readouterr()
    assert not err
    assert 'L1 (no value), L2 (no value)' in out
    assert out.count('needs the values of L1, L2') == 2
    assert 'rank         2 of 2' in out
    assert main(['check', '--json', str(file)]) == 0
    (entry,) = json.loads(capsys.readouterr().out)['files']
    assert entry['reach'] is None
    assert entry['length'] is None
    assert entry['generic_rank'] == 2
    # Poses in numbers are neither met nor missed.
    file.write_text(f'{ARM}known_poses: [{{q: [0, 0], xyz: [1, 0, 0]}}]\n')
    assert main(['check', str(file)]) == 0
    assert 'known poses  needs the values of L1, L2' in capsys.readouterr().out


def test_derive_and_compare_work_on_letters(file, capsys, tmp_path):
    assert main(['derive', str(file)]) == 0
    out = capsys.readouterr().out
    assert 'Letters without a value: L1, L2' in out
    assert 'Numbers of the file' not in out
    assert str(ks.derive(file).determinant) == 'L1*L2*sin(q2)'
    formulas = tmp_path / 'formulas.txt'
    formulas.write_text(JACOBIAN)
    assert main(['compare', str(formulas), '--robot', str(file)]) == 0
    formulas.write_text(JACOBIAN.replace('-L2*s12;', '-L1*s12;'))
    assert main(['compare', str(formulas), '--robot', str(file)]) == 1
    assert main(['derive', str(file), '--code', 'numpy']) == 0
    code = capsys.readouterr().out
    assert 'Lengths of the file: L1, L2.' in code
    assert 'def pose(q, L1, L2):' in code
    assert main(['derive', str(file), '--format', 'json']) == 0
    assert json.loads(capsys.readouterr().out)['lengths'] == {'L1': None, 'L2': None}
    assert main(['derive', str(file), '--write']) == 0
    assert 'constants: {L1: , L2}' in file.read_text()
    assert 'singularity:' in file.read_text()


@pytest.mark.parametrize(
    'command',
    [
        ['fk', '--q', '0,0'],
        ['export', '--urdf', '-'],
    ],
)
def test_what_needs_numbers_names_the_letters(file, command, capsys):
    assert main([*command, '--robot', str(file)]) != 0
    assert 'L1, L2: no value;' in capsys.readouterr().err


def test_the_library_and_cells_refuse_letters(file, tmp_path):
    for use in (
        lambda: ks.load_robot(file),
        lambda: ks.forward_kinematics(file, [0.0, 0.0]),
        lambda: ks.robot_from_text(ARM),
    ):
        with pytest.raises(RobotFileError) as caught:
            use()
        assert places(caught.value) == [(0, 'constants', 'no-value')]
        assert 'L1, L2' in str(caught.value)
    cell = tmp_path / 'cell.yaml'
    cell.write_text('cell: two\narms:\n  left: {robot: planar_2r}\n  right: {robot: sym.yaml}\n')
    with pytest.raises(RobotFileError) as caught:
        ks.load_robot(cell)
    assert places(caught.value) == [(4, 'arms.right.robot', 'no-value')]
    assert 'L1, L2' in str(caught.value)
    numbers = ARM.replace('{L1: , L2}', '{L1: 0.5, L2: 0.3}')
    assert ks.forward_kinematics(ks.robot_from_text(numbers), [0, 0])[0, 3] == 0.8


def test_a_letter_in_an_angle_is_checked_and_not_derived(tmp_path, capsys):
    file = tmp_path / 'twist.yaml'
    file.write_text(ARM.replace('alpha: 0, d: 0, theta: q1', 'alpha: L2, d: 0, theta: q1'))
    assert main(['check', str(file)]) == 0
    assert main(['derive', str(file)]) == 1
    assert 'L2 ' in capsys.readouterr().err


@pytest.mark.parametrize('option', [['--path', 'q1=t'], ['--lock', 'q1=0']])
def test_numbers_of_a_derivation_need_values(file, option, capsys):
    assert main(['derive', str(file), *option]) == 2
    assert 'L1, L2 ' in capsys.readouterr().err


def test_letters_have_no_size_that_could_be_wrong():
    # In millimetres the numbers that stand in for them are no angles.
    text = ARM.replace('source', 'units: {length: mm}\nsource')
    text = text.replace('alpha: 0, d: 0, theta: q1', 'alpha: L2, d: 0, theta: q1')
    assert parse_robot(text, 'sym.yaml').warnings == ()
