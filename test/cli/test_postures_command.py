"""The command `postures`: what it prints, in words and as JSON, and its exit codes."""

import json

import pytest

import kinematics_service as ks
from kinematics_service.cli.command_line import run


def answer(capsys, *argv):
    code = run(['postures', *argv])
    return code, capsys.readouterr()


def test_json_has_what_the_library_returns(capsys):
    code, streams = answer(capsys, 'craig_3r', '--json')
    document, change = json.loads(streams.out), ks.posture_change('craig_3r')
    assert code == 0
    assert (document['verdict'], document['reason']) == ('no', change.reason)
    assert (document['aspects'], document['path'], document['clearance']) == (4, None, None)
    assert document['target'] == change.target.tolist()
    assert [(one['signs'], one['aspect'], one['q']) for one in document['groups']] == [
        (group.signs, group.aspect, group.q.tolist()) for group in change.groups
    ]


def test_a_path_is_printed(capsys, monkeypatch):
    monkeypatch.setenv('COLUMNS', '200')
    code, streams = answer(capsys, '--robot', 'offset_stanford_printed', '--distance', '0.001')
    assert code == 0
    lines = streams.out.splitlines()
    said = 'offset_stanford_printed changes its posture without meeting a singular pose'
    assert lines[0] == said
    assert 'joints [rad, m] of one target' in streams.out
    change = ks.posture_change('offset_stanford_printed', distance=0.001)
    start = next(k for k, line in enumerate(lines) if line.startswith('  path'))
    printed = [line.replace('path', '').split() for line in lines[start:]]
    assert printed == [[f'{x:.4f}' for x in q] for q in change.path.q.tolist()]


def test_degrees_are_of_the_joints_that_turn(capsys, monkeypatch):
    monkeypatch.setenv('COLUMNS', '200')
    _, streams = answer(capsys, 'spherical_rrp', '--deg')
    assert 'changes no posture without meeting a singular pose' in streams.out
    assert 'joints [deg, m] of one target' in streams.out
    (q,) = ks.posture_change('spherical_rrp').groups[0].q
    (line,) = [line for line in streams.out.splitlines() if 'boom_vertical < 0' in line]
    assert float(line.split()[-1]) == pytest.approx(q[2], abs=0.005)
    assert float(line.split()[-2]) == pytest.approx(q[1] * 57.29578, abs=0.005)


def test_an_arm_with_curves_of_postures_is_a_failure(capsys):
    code, streams = answer(capsys, 'panda')
    assert code == 1
    assert streams.err.startswith('panda has 7 joints, but moves the tool')
    code, streams = answer(capsys, 'ur5e', '--distance', '3')
    assert code == 1
    assert streams.err.startswith('distance must be above 0')
