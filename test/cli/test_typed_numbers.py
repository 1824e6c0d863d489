# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Numbers on the command line as they are pasted: a typographic minus, degree signs, pi."""

import json
import math

import pytest

from kinematics_service.__main__ import main
from kinematics_service.apps.recordings.readers.table_rows import number_of


def q_of(capsys, *argv, robot='planar_2r'):
    assert main(['fk', '--robot', robot, '--json', *argv]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    'argv',
    [
        ['--q', '0,−90', '--deg'],
        ['--q', '0', '−90', '--deg'],
        ['--q', '0,–90°'],
        ['--q', '0 °, −90 °'],
        ['--q=0, -90º', '--deg'],
        ['--q', '0', '-pi/2'],
        ['--q=0,−π⁄2'],
        ['--q', '0', '−2·π/4'],
    ],
)
def test_a_quarter_turn_is_typed_in_many_ways(capsys, argv):
    assert q_of(capsys, *argv) == q_of(capsys, '--q', f'0,{-math.pi / 2!r}')


@pytest.mark.parametrize(
    ('argv', 'told'),
    [
        (['--q', '0,pi/2', '--deg'], '--q: pi/2 is in radians;'),
        (['--q', '0,1-2'], "--q: '1-2' is not a number;"),
        (['--q', '0,°'], "--q: '°' is accepted only"),
        (['--q', '0,pip'], "--q: unknown name 'pip'"),
        (['--q', '0,pi/0'], '--q: division by zero'),
    ],
)
def test_what_is_no_number_is_told(capsys, argv, told):
    assert main(['fk', '--robot', 'planar_2r', *argv]) == 2
    assert told in capsys.readouterr().err


def test_degrees_of_a_sliding_joint_are_refused(capsys):
    assert main(['fk', '--robot', 'spherical_rrp', '--q', '0,1,90°']) == 2
    assert "'90°' is an angle;" in capsys.readouterr().err


def test_a_target_is_typed_in_many_ways(capsys):
    def solution(*argv):
        assert main(['ik', '--robot', 'puma560', '--one', '--json', *argv]) == 0
        return json.loads(capsys.readouterr().out)

    pasted = solution('--xyz', '0.4,−0.1,0.2', '--rpy', '180°,0,−π/2')
    assert pasted == solution('--xyz', '0.4,-0.1,0.2', '--rpy', '180,0,-90', '--deg')


def test_cells_of_a_table_hold_a_typographic_minus():
    assert number_of('−0.25') == -0.25
    assert number_of('\u00a0–1e−3 ') == -1e-3
    for cell in ('−', '0,5', '90°', '½'):
        with pytest.raises(ValueError, match=cell):
            number_of(cell)


def test_a_recording_holds_a_typographic_minus(tmp_path, capsys):
    rows = [f'{1 + k / 100},{-0.1 * k:.3f},−{0.2 * k + 0.3:.3f}' for k in range(60)]
    text = '\n'.join(['stamp,position.q1,position.q2', *rows])
    for name, content in (('typed', text.replace('−', '-')), ('pasted', text)):
        (tmp_path / name).mkdir()
        (tmp_path / name / 'run.csv').write_text(content, encoding='utf-8')
    measures = []
    for name in ('typed', 'pasted'):
        file = str(tmp_path / name / 'run.csv')
        assert main(['audit', file, '--robot', 'planar_2r', '--fail-on', 'never']) == 0
        measures.append(capsys.readouterr().out.replace(name, ''))
    assert measures[0].partition('\n')[2] == measures[1].partition('\n')[2]
