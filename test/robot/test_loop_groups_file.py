# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Loops in a robot file that need each other: what is read, what is refused, what `check` says."""

import math

import numpy as np
import parallel_machines as machines
import pytest

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.errors import DerivationError

APART = """\
  - name: between
    passive: [idler]
    links: [Rz(idler)]
    meets: {row: 1}
    rows: [rz]
    assembled: {q: [Q1, Q2, Q3], idler: Q1}
  - name: top_arm
"""


def faults_of(text):
    with pytest.raises(ks.RobotFileError) as caught:
        ks.robot_from_text(text, 'machine.yaml')
    return caught.value.faults


def fault(text, where, code):
    """Return the message of the fault with a key and a code."""
    (message,) = (one.message for one in faults_of(text) if (one.where, one.code) == (where, code))
    return message


def at(text):
    """Return a text with the joints of the planar machine in its middle."""
    for k, value in enumerate(machines.planar_joints((0.25, 0.144), 0.0), 1):
        text = text.replace(f'Q{k}', str(value))
    return text


def test_loops_of_a_group_stand_together():
    text = machines.planar_text().replace('  - name: top_arm\n', at(APART))
    text = text.replace('Rz(elbow1), Tx(b)', 'Rz(elbow1), Tx(b), Rz(0*idler)')
    assert 'loops[0] and loops[2]' in fault(text, 'loops[0]', 'wrong-order')


def test_a_group_that_does_not_close_says_how_far_apart_each_end_is():
    text = machines.planar_text().replace('xyz: [0.25, 0.433, 0]', 'xyz: [0.25, 0.933, 0]')
    message = fault(text, 'loops[0].assembled', 'open-loop')
    assert 'right_arm: x 0, y 0; top_arm: x 0, y 0.5' in message


def test_a_group_that_is_flat_is_refused():
    # All three rods point to the middle of the platform, which may turn about it.
    a, b = machines.PLANAR_RODS
    outward = [corner / np.linalg.norm(corner) for corner in machines.PLANAR_CORNERS]
    elbows = [corner + b * way for corner, way in zip(machines.PLANAR_CORNERS, outward)]
    rods = [math.atan2(-way[1], -way[0]) for way in outward]
    q = [rod + 1.0 for rod in rods]
    bases = [e - a * np.array([math.cos(t), math.sin(t)]) for e, t in zip(elbows, q)]
    text = machines.PLANAR
    for k in range(3):
        text = text.replace(f'Q{k + 1}', str(q[k])).replace(f'BENT{k + 1}', '-1')
        x, y = bases[k] - bases[0]
        was = ', '.join(f'{number:g}' for number in machines.PLANAR_BASES[k])
        text = text.replace(
            f'from: {{row: 0, xyz: [{was}, 0]}}', f'from: {{xyz: [{x}, {y}, 0], row: 0}}'
        )
    text = text.replace('PLATFORM', str(-rods[0]))
    message = fault(text, 'loops[0].assembled', 'flat-loop')
    assert "'right_arm' and 'top_arm'" in message
    assert 'elbow1, elbow2, platform, elbow3 is 0' in message


def test_rows_of_another_plane_are_refused_in_a_group():
    text = machines.planar_text()
    head, tail = text.split('  - name: top_arm\n')
    text = head + '  - name: top_arm\n' + tail.replace('rows: [x, y]', 'rows: [x, z]')
    assert 'moves z;' in fault(text, 'loops[1].rows', 'no-effect')


def test_so_many_rows_are_closed_together_and_no_more():
    text = machines.hexapod_text()
    assert ks.robot_from_text(text).chain.closure.first.count == 18
    # A seventh leg that the platform's ways pull into the group.
    text = text.replace('Tx(x), ', 'Tx(x), Tx(0*tilt7 + 0), ').replace('row: 6', 'row: 7')
    seventh = text[text.index('  - name: leg6') :].replace('leg6', 'leg7')
    seventh = seventh.replace('tilt6', 'tilt7').replace('lean6', 'lean7')
    seventh = seventh.replace('lean7, roll]', 'lean7, more]').replace('roll: 0.0', 'more: 0.0')
    seventh = seventh.replace('Tz(c6)]', 'Tz(c6), Rz(more)]')
    text = text.replace('Tz(c1)]', 'Tz(c1), Rz(more)]') + seventh
    message = fault(text, 'loops[0]', 'too-many')
    assert message.startswith('21 rows')
    assert 'loops[5], loops[6]); at most 18' in message


def test_a_group_that_moves_nothing_is_refused():
    two = """\
robot: idle
convention: elementary
joints:
  - {name: q, type: revolute}
links: [Rz(q), Tx(1)]
loops:
  - name: one
    passive: [a]
    links: [Rz(q + a + b)]
    meets: {row: 1}
    rows: [rz]
    assembled: {q: [0], a: 0}
  - name: other
    passive: [b]
    links: [Rz(q + a - b)]
    meets: {row: 1}
    rows: [rz]
    assembled: {q: [0], b: 0}
"""
    assert "'a' or 'b'" in fault(two, 'loops[0].passive', 'no-effect')


def test_check_tells_a_group_and_its_other_branches(capsys):
    assert main(['check', 'flexpicker']) == 0
    text = ' '.join(capsys.readouterr().out.split())
    assert 'arm1 + arm2 + arm3 ' in text
    assert 'sweep1 = 2.11475, swing1 = 0' in text
    assert '9 rows, 9 passive joints; closed to' in text
    assert 'det 2.207 other branches there: ' in text
    # The platform above the base too, and each pair of rods turned by half a turn both ways.
    assert 'z = 1.064' in text
    assert '; 11 more 3 degrees of freedom' in text


def test_the_derivation_does_not_take_groups():
    with pytest.raises(DerivationError) as caught:
        ks.derive('flexpicker')
    assert "('arm1', 'arm2', 'arm3')" in str(caught.value)


def test_a_urdf_of_a_group_names_its_loops(capsys, tmp_path):
    assert main(['export', 'flexpicker', '--urdf', str(tmp_path / 'arm.urdf')]) == 0
    said = capsys.readouterr().err
    assert "'arm1', 'arm2', 'arm3'" in said


def test_fk_names_the_group_that_is_near_flat(capsys):
    assert main(['fk', '--robot', 'flexpicker', '--q', '0.2,0.1,0.3', '--all']) == 0
    assert 'loops arm1, arm2 and arm3 together  ' in capsys.readouterr().out
