# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Where an audit says that a motion would have been slowed, against the library state by state."""

import json

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.__main__ import main

ROBOT = """
robot: elbow
convention: standard
joints:
  - {name: a, variable: q1, type: revolute, velocity: 1.0, acceleration: 4.0}
  - {name: b, variable: q2, type: revolute, limits: [-0.6, 2.5], acceleration: 4.0}
links:
  - {a: 1, alpha: 0, d: 0, theta: q1}
  - {a: 1, alpha: 0, d: 0, theta: q2}
speed_limits: {tool: {linear: 3.0, reduced: 0.5}}
"""


@pytest.fixture
def files(tmp_path):
    (tmp_path / 'arm.yaml').write_text(ROBOT)
    t = np.arange(0.0, 6.0, 0.01)
    # The elbow is stretched through its singular pose, then the base turns too fast.
    q = np.stack([np.where(t > 4.0, 1.5 * (t - 4.0), 0.0), 0.9 - 0.4 * np.minimum(t, 3.5)], axis=1)
    rows = [f'{100 + s:.3f},{a!r},{b!r}' for s, (a, b) in zip(t, q.tolist())]
    (tmp_path / 'run.csv').write_text('\n'.join(['stamp,position.a,position.b', *rows, '']))
    return tmp_path


def audited(folder, capsys, *options):
    capsys.readouterr()
    command = ['audit', str(folder / 'run.csv'), '--robot', str(folder / 'arm.yaml'), *options]
    assert main([*command, '--json', '-']) == 0
    return json.loads(capsys.readouterr().out)


def test_every_state_is_what_the_library_says(files, capsys):
    document = audited(files, capsys, '--scale')
    series, robot = document['series'], ks.load_robot(files / 'arm.yaml')
    assert document['slowing']['unknown'] == 1  # the first has no velocity
    seen = set()
    for q, qdot, told in zip(series['q'], series['qdot'], series['scale']):
        if None in qdot:
            assert told is None
            continue
        found = ks.scale(robot, q, qdot)
        assert told == pytest.approx(found.value, abs=1e-12)
        if found.value < 1.0:
            seen.add(f'{found.cause} of {found.of}' if found.of else found.cause)
    assert seen == set(document['slowing']['seconds']) == {'singularity', 'velocity limit of a'}
    # 1.5 rad/s where 1.0 is the limit, for the last two seconds.
    last = document['slowing']['stretches'][-1]
    assert (last['cause'], last['value']) == ('velocity limit of a', pytest.approx(2 / 3))
    assert last['end'] - last['begin'] == pytest.approx(2.0, abs=0.03)
    # The elbow is slowed before it is stretched, and not on its way out.
    singular = [one for one in document['slowing']['stretches'] if one['cause'] == 'singularity']
    stretched = 0.9 / 0.4
    assert singular[0]['begin'] < stretched - 0.1
    assert max(one['end'] for one in singular) <= stretched + 0.02


def test_reduced_speeds_slow_more_and_are_refused_where_there_are_none(files, capsys):
    document = audited(files, capsys, '--reduced')
    assert document['slowing']['seconds']['speed limit of tool'] == pytest.approx(2.0, abs=0.03)
    arm = files / 'arm.yaml'
    arm.write_text(arm.read_text().replace(', reduced: 0.5', ''))
    assert main(['audit', str(files / 'run.csv'), '--robot', str(arm), '--reduced']) == 1
    assert 'elbow has no reduced speed' in capsys.readouterr().err


def test_the_rule_of_moveit_servo_is_a_choice(tmp_path, capsys):
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 2.0, 0.02)
    rows = [f'{100 + s:.2f},0.3,-1.0,1.2,-0.4,{0.3 - 0.3 * s:.4f},0.3' for s in t]
    head = ','.join(['stamp', *(f'position.{name}' for name in robot.joint_names)])
    (tmp_path / 'run.csv').write_text('\n'.join([head, *rows, '']))
    command = ['audit', str(tmp_path / 'run.csv'), '--robot', 'ur5e', '--servo', '--json', '-']
    main(command)
    document = json.loads(capsys.readouterr().out)
    series = document['series']
    for q, qdot, told in list(zip(series['q'], series['qdot'], series['scale']))[1:]:
        found = ks.scale(robot, q, qdot, rule=ks.ServoRule())
        assert told == pytest.approx(found.value, abs=1e-9)
    assert set(document['slowing']['seconds']) == {'singularity', 'leaving a singularity'}
    text = 'stamp,position.left,position.right\n100,1.9,1.0\n101,1.8,1.1\n'
    (tmp_path / 'run.csv').write_text(text)
    assert main([*command[:3], 'five_bar', '--servo']) == 1
    assert 'five_bar has closed loops' in capsys.readouterr().err


def test_the_sentence_and_the_page_say_it_and_without_the_option_nothing(files, capsys):
    page = files / 'page.html'
    command = ['audit', str(files / 'run.csv'), '--robot', str(files / 'arm.yaml')]
    assert main([*command, '--scale', '--html', str(page)]) == 0
    said = capsys.readouterr().out
    assert 'ks.scale would have slowed it' in said
    assert 'velocity limit of a 1.9' in said
    text = page.read_text()
    assert 'would have been slowed' in text
    assert 'It is no safety function.' in text
    assert main([*command, '--html', str(page)]) == 0
    assert 'ks.scale' not in capsys.readouterr().out
    assert 'slowed' not in page.read_text()
    assert audited(files, capsys)['slowing'] is None
    # At rest nothing slows it.
    rows = (files / 'run.csv').read_text().splitlines()[:1]
    rows += [f'{100 + 0.01 * k:.3f},0.1,0.9' for k in range(50)]
    (files / 'run.csv').write_text('\n'.join([*rows, '']))
    assert main([*command, '--scale']) == 0
    assert 'slowed it nowhere (50' in capsys.readouterr().out
