# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""A recording of an arm with closed loops is judged; what does not close is counted."""

import json
import math

import linkages
import numpy as np
import parallel_machines as machines
import pytest

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.recordings.audit.auditing import audit
from kinematics_service.apps.recordings.audit.verdict import verdict_of
from kinematics_service.apps.recordings.readers.open_file import open_source
from kinematics_service.apps.recordings.readers.source import Selection


def test_positions_at_which_a_loop_does_not_close_are_counted_and_left_out(tmp_path, capsys):
    # A five-bar whose elbows come too far apart for its rods, again and again.
    text = ks.bundled_robots()['five_bar'].read_text(encoding='utf-8').split('known_poses')[0]
    text = text.replace('distal: 0.4', 'distal: 0.3').replace('[0, 2*pi/3]', '[0, pi]')
    robot = tmp_path / 'short.yaml'
    robot.write_text(text.replace('psi1: -1.27, psi2: 1.27', 'psi1: -1.51, psi2: 1.51'))
    lines = ['stamp,position.left,position.right']
    opened = 0
    for k in range(160):
        x = 0.9 * abs(math.sin(0.04 * k))
        opened += 0.15 + 0.25 * math.sin(x) > 0.3  # half the way between the elbows, and a rod
        lines.append(f'{100 + 0.01 * k:.3f},{math.pi / 2 + x},{math.pi / 2 - x}')
    recording = tmp_path / 'recording.csv'
    recording.write_text('\n'.join(lines) + '\n')
    main(['audit', str(recording), '--robot', str(robot)])
    said = capsys.readouterr().out
    assert f'{opened} messages' in said
    assert f'loop does not close ({opened})' in said
    assert 'a singularity (rods)' in said


PLAN = """joint_names: [q1, q2]
points:
  - {positions: [1.57, 1.57], time_from_start: {sec: 0}}
  - {positions: [2.47, 0.67], time_from_start: {sec: 1}}
"""


@pytest.mark.slow
def test_a_plan_is_refuted_where_a_loop_does_not_close(tmp_path, capsys):
    robot, plan = tmp_path / 'short.yaml', tmp_path / 'plan.yaml'
    robot.write_text(linkages.SHORT_FIVE_BAR)
    plan.write_text(PLAN)
    page, document = tmp_path / 'plan.html', tmp_path / 'plan.json'
    arguments = ['audit', str(plan), '--robot', str(robot), '--speed-limit', '1']
    arguments += ['--html', str(page), '--json', str(document)]
    assert main(arguments) == 1
    said = ' '.join(capsys.readouterr().out.split())
    assert "Refuted: at 0.715 s, after points[0], the loop 'rods' of short_five_bar does" in said
    assert 'no limits and no speeds of joints' in said
    assert 'Refuted: the tool' in said
    assert 'the loop rods closes' in page.read_text()
    found = json.loads(document.read_text())['plans'][0]
    assert found['closure']['verdict'] == found['verdict'] == 'refuted'
    assert found['closure']['loop'] == 'rods'
    plan.write_text(PLAN.replace('2.47, 0.67', '1.6, 1.55'))
    arguments = ['audit', str(plan), '--robot', str(robot), '--speed-limit', '2']
    assert main([*arguments, '--json', str(document)]) == 1
    said = ' '.join(capsys.readouterr().out.split())
    assert 'close at 3 sampled positions' in said
    found = json.loads(document.read_text())['plans'][0]
    assert found['closure']['verdict'] == found['speeds'][0]['verdict'] == 'not decided'
    assert found['closure']['samples'] == 3


def closes(robot, q):
    try:
        ks.forward_kinematics(robot, q)
    except ks.LoopError:
        return False
    return True


@pytest.mark.slow
def test_an_audit_names_loops_that_are_closed_together(tmp_path, capsys):
    robot, plan = tmp_path / 'planar.yaml', tmp_path / 'plan.yaml'
    robot.write_text(machines.planar_text())
    middle = machines.planar_joints(np.array([0.25, 0.144]), 0.0)
    ends = [middle, [1.5664, -2.5686, -0.9196], [1.6, -2.55, -0.9]]
    points = [
        f'  - {{positions: {list(map(float, q))}, time_from_start: {{sec: {k}}}}}\n'
        for k, q in enumerate(ends[:2])
    ]
    plan.write_text('joint_names: [left, right, top]\npoints:\n' + ''.join(points))
    page, document = tmp_path / 'plan.html', tmp_path / 'plan.json'
    arguments = ['audit', str(plan), '--robot', str(robot)]
    assert main([*arguments, '--html', str(page), '--json', str(document)]) == 1
    said = ' '.join(capsys.readouterr().out.split())
    both = 'loops right_arm and top_arm together'
    assert f'the {both} of planar_3rrr' in said
    assert f'(a flat position of the {both})' in said
    assert f'the {both} close' in page.read_text()
    found = json.loads(document.read_text())['plans'][0]['closure']
    assert found['loop'] == 'right_arm + top_arm'
    # Of a recording what does not close is counted.
    recording = tmp_path / 'recording.csv'
    rows = np.concatenate([np.linspace(a, b, 8) for a, b in zip(ends, ends[1:])])
    lines = [
        ','.join([f'{100 + 0.01 * k:.3f}', *map(str, q)]) for k, q in enumerate(rows.tolist())
    ]
    recording.write_text(
        'stamp,position.left,position.right,position.top\n' + '\n'.join(lines) + '\n'
    )
    arm = ks.load_robot(robot)
    with open_source(recording, Selection(arm)) as source:
        judged = verdict_of(audit(source, arm, 'recording.csv'))
    said = ' '.join(one.text for one in judged)
    open_ = sum(not closes(arm, q) for q in rows)
    assert 4 < open_ < 12
    assert f'loop does not close ({open_})' in said
    assert 'a singularity (right_arm + top_arm)' in said


def test_of_a_plan_with_loops_no_more_is_said_than_of_its_samples(tmp_path, capsys):
    plan = tmp_path / 'plan.yaml'
    lines = ['joint_names: [theta1, theta2, theta3]', 'points:']
    for seconds, positions in ((0, [0, 0, 0]), (2, [0.04, 0.02, 0.01])):
        time = f'time_from_start: {{sec: {seconds}, nanosec: 0}}'
        lines.append(f'  - {{positions: {positions}, {time}}}')
    plan.write_text('\n'.join(lines) + '\n')
    assert main(['audit', str(plan), '--robot', 'flexpicker']) == 1
    out = capsys.readouterr().out
    assert 'at its 5 samples' in out
    assert 'keeps away' not in out
