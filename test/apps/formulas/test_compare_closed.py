# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Formulas of arms with closed loops against the robot, where the loops close."""

import linkages
import pytest

import kinematics_service as ks
from kinematics_service.apps.formulas.compare.comparison import compare

SLIDER = """
s = crank*sin(q)/rod
slider = crank*cos(q) + rod*sqrt(1 - s^2)
psi = -q - asin(s)
crank*sin(q) + rod*sin(q + psi) = 0
J_v = [-crank*sin(q) - crank*sin(q)*cos(q)*(crank/rod)/sqrt(1 - s^2); 0; 0]
det = crank*sin(psi)/cos(q + psi)
T = [1 0 0 slider; 0 1 0 0; 0 0 1 0; 0 0 0 1]
"""
# Tsai's A xdot = B qdot of a planar five-bar, solved.
FIVE_BAR = """
p = [proximal*cos(q1) + distal*cos(q1+psi1); proximal*sin(q1) + distal*sin(q1+psi1); 0]
D + proximal*cos(q2) + distal*cos(q2+psi2) = proximal*cos(q1) + distal*cos(q1+psi1)
e = sin(q2 + psi2 - q1 - psi1)
J_v = [proximal*sin(psi1)*sin(q2+psi2)/e, -proximal*sin(psi2)*sin(q1+psi1)/e
      -proximal*sin(psi1)*cos(q2+psi2)/e,  proximal*sin(psi2)*cos(q1+psi1)/e; 0, 0]
det = proximal^2*sin(psi1)*sin(psi2)/e
"""


@pytest.mark.parametrize(('name', 'text'), [('crank_slider', SLIDER), ('five_bar', FIVE_BAR)])
def test_formulas_of_a_closed_arm_agree(name, text):
    comparison = compare(ks.load_robot(name), text)
    assert comparison.faults == ()
    assert comparison.agrees, comparison.verdicts
    assert len(comparison.verdicts) >= 4
    assert comparison.randomised == ()


@pytest.mark.parametrize(
    ('right', 'wrong', 'differs'),
    [
        ('+ rod*sqrt', '- rod*sqrt', 'slider'),
        ('psi = -q - asin', 'psi = -q + asin', 'psi'),
        ('rod*sin(q + psi)', 'rod*sin(q - psi)', 'crank sin(q) + rod sin(q - psi)'),
        ('J_v = [-crank*sin(q) - ', 'J_v = [-crank*sin(q) + ', 'J_v'),
        ('det = crank', 'det = rod', 'det'),
    ],
)
def test_a_wrong_formula_of_a_closed_arm_differs(right, wrong, differs):
    assert right in SLIDER
    comparison = compare(ks.load_robot('crank_slider'), SLIDER.replace(right, wrong))
    verdicts = {verdict.name: verdict for verdict in comparison.verdicts}
    assert verdicts[differs].status == 'differs'
    assert verdicts[differs].causes == ()


@pytest.mark.parametrize(
    ('text', 'code', 'word'),
    [
        ('q1 = 3*x', 'unsupported', 'passive joints'),
        ('singular: q1 = k*pi', 'unsupported', 'closed loops'),
        ('J_v = J_2', 'unsupported', "'J_2'"),
        ('at: D=0.2\np = [1;2;3]', 'unsupported', 'D is a constant'),
        ('at: psi1=1\np = [1;2;3]', 'unsupported', 'values of q1, q2'),
        ('J_3 = [1;2;3;4;5;6]', 'out-of-range', 'joint 3'),
    ],
)
def test_what_is_not_compared_is_said(text, code, word):
    (fault,) = compare(ks.load_robot('five_bar'), text).faults
    assert fault.code == code
    assert word in fault.message


@pytest.mark.slow
def test_a_position_at_which_the_loops_do_not_close_is_not_compared():
    robot = ks.robot_from_text(linkages.SHORT_FIVE_BAR)
    (fault,) = compare(robot, 'at: q1=3, q2=0\np = [1;2;3]').faults
    assert (fault.line, fault.code) == (2, 'open-loop')
    assert 'short_five_bar' in fault.message


def test_one_position_of_a_closed_arm():
    robot = ks.load_robot('five_bar')
    text = 'at: q1=2, q2=1\np = [0.174806; 0.514111; 0]'
    assert compare(robot, text).agrees
    assert not compare(robot, text.replace('0.5141', '0.5142')).agrees
