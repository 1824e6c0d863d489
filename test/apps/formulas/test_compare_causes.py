# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Right formulas in many forms are accepted, and what is wrong with wrong ones is named."""

import functools

import pytest
import sympy

import kinematics_service as ks
from kinematics_service.apps.formulas.compare.causes.edits import arguments
from kinematics_service.apps.formulas.compare.comparison import compare

ARMS = {
    # A polar arm: waist, shoulder, telescope.
    'polar': """
robot: polar
convention: elementary
constants: {H: 0.6, B: 0.25}
joints:
  - {name: u, type: revolute}
  - {name: v, type: revolute}
  - {name: w, type: prismatic}
links: [Rz(u), Tz(H), Ry(v), Tx(B), Tx(w)]
singularity: {task: [x, y, z]}
""",
    # Two links in the plane, their lengths unlike.
    'plane': """
robot: plane
convention: modified
constants: {A: 0.7, B: 0.45}
joints:
  - {name: s, type: revolute}
  - {name: t, type: revolute}
links:
  - {a: 0, alpha: 0, d: 0, theta: s}
  - {a: A, alpha: 0, d: 0, theta: t}
  - {a: B, alpha: 0, d: 0, theta: 0}
singularity: {task: [x, y]}
""",
    # A column that turns and rises, with an arm that slides out of it.
    'column': """
robot: column
convention: standard
constants: {H: 0.31, R: 0.17}
joints:
  - {name: j1, type: revolute}
  - {name: d2, type: prismatic}
  - {name: d3, type: prismatic}
links:
  - {a: 0, alpha: 0, d: H, theta: j1}
  - {a: 0, alpha: -pi/2, d: d2, theta: 0}
  - {a: 0, alpha: 0, d: d3 + R, theta: 0}
singularity: {task: [x, y, z]}
""",
    # Waist, shoulder and elbow with a link between waist and shoulder.
    'elbow': """
robot: elbow
convention: modified
constants: {E: 0.11, F: 0.52, G: 0.37}
joints:
  - {name: k1, type: revolute}
  - {name: k2, type: revolute}
  - {name: k3, type: revolute}
links:
  - {a: 0, alpha: 0, d: 0, theta: k1}
  - {a: E, alpha: pi/2, d: 0, theta: k2}
  - {a: F, alpha: 0, d: 0, theta: k3}
  - {a: G, alpha: 0, d: 0, theta: 0}
singularity: {task: [x, y, z]}
""",
}
RIGHT = {
    'polar': """
        p = [(B+w)*cos(u)*cos(v); (B+w)*sin(u)*cos(v); H-(B+w)*sin(v)]
        det = -(w^2 + 2*B*w + B^2)*sin(v + pi/2)
        u = atan2(y, x)
        u = atan2(-y, -x)
        v = atan2(H - z, sqrt(x^2 + y^2))
        w = sqrt(x^2 + y^2 + (z - H)^2) - B
        w = -sqrt(x^2 + y^2 + (z - H)^2) - B
        v = asin((H - z)/(B + w))
    """,
    'plane': """
        p = [A*cos(s) + B*cos(s+t); A*sin(s) + B*sin(s+t); 0]
        det = 2*A*B*sin(t/2)*cos(t/2)
        t = -acos((x^2 + y^2 - A^2 - B^2)/(2*A*B))
    """,
    'column': """
        d2 = z - H
        d3 = sqrt(x^2 + y^2) - R
        det = d3 + R
        p = [-(d3+R)*sin(j1); (d3+R)*cos(j1); H + d2]
        j1 = atan2(x, -y)
    """,
    'elbow': """
        det = F*G*sin(k3)*(E + F*cos(k2) + G*cos(k2+k3))*(-1)
        k1 = atan2(y, x) + pi
        k3 = acos(((sqrt(x^2+y^2)-E)^2 + z^2 - F^2 - G^2)/(2*F*G))
        k3 = acos(((sqrt(x^2+y^2)+E)^2 + z^2 - F^2 - G^2)/(2*F*G))
    """,
}
# The comment of a formula is in the sentence of its cause.
WRONG = {
    'polar': """
        det = (B+w)^2*cos(v)  # sign is wrong
        det = -(B+w)^2*sin(v)  # sin(v) and cos(v) are exchanged
        det = -w^2*cos(v)  # B is missing
        u = atan2(x, y)  # arguments of atan2 are exchanged
        v = atan2(-z, sqrt(x^2 + y^2))  # H is lost
        w = sqrt(x^2 + y^2 + (z - H)^2)  # B is lost
        p = [(B+w)*cos(u)*cos(v), (B+w)*sin(u)*cos(v), H+(B+w)*sin(v)]  # v is counted
        det = -(w^2 + B*w + B^2)*cos(v)  # twice -B*w belongs there
        det = -(w^2 + 4*B*w + B^2)*cos(v)  # half of -4*B*w belongs there
    """,
    'plane': """
        t = acos((x^2 + y^2 - A^2)/(2*A*B))  # B**2 is lost
        t = acos((x^2 + y^2 - A^2 + B^2)/(2*A*B))  # wrong sign: B**2
        t = asin((x^2 + y^2 - A^2 - B^2)/(2*A*B))  # asin and acos exchanged
        t = acos((x^2 + y^2 - A^2 - B^2)/(A*B))  # factor 2 is too many
        t = acos((x^2 + y^2 - A^2 - B^2)/(4*A*B))  # factor 2 is missing
        p = [A*cosd(s)+B*cosd(s+t), A*sind(s)+B*sind(s+t), 0]  # taken for degrees
        p = [A*sin(s) + B*sin(s+t), A*cos(s) + B*cos(s+t), 0]  # are exchanged
        J = [-A*sin(s)-B*sin(s-t), B*sin(s-t); A*cos(s)+B*cos(s-t), -B*cos(s-t)]  # t is counted
        det = -A*B*sin(s)  # s and t are exchanged
        s = atan2(y, x) + atan2(B*sin(t), A + B*cos(t))  # first argument of atan2
        s = atan2(y, x) - atan2(B*sin(t), B*cos(t))  # A is lost
    """,
    'column': """
        d3 = sqrt(x^2 + y^2) + R  # wrong sign: R
        j1 = atan2(x, y)  # first argument of atan2
    """,
    'elbow': """
        det = -F*G*cos(k3)*(E + F*cos(k2) + G*cos(k2+k3))  # cos(k3) stands
        det = -F*G*sin(k3)*(F*cos(k2) + G*cos(k2+k3))  # E is missing
        det = -2*F*G*sin(k3)*(E + F*cos(k2) + G*cos(k2+k3))  # factor 2 is too many
        det = F*F*sin(k3)*(E + F*cos(k2) + G*cos(k2+k3))*(-1)  # F stands where G belongs
    """,
}
robot_of = functools.cache(ks.robot_from_text)


def cases(table):
    """Return each line of a table, and its comment, with its arm."""
    return [
        (arm, *line.strip().split('  # '))
        for arm, lines in table.items()
        for line in lines.strip().splitlines()
    ]


def verdict_of(arm, formula):
    """Return the verdict on one formula."""
    (verdict,) = compare(robot_of(ARMS[arm]), formula).verdicts
    return verdict


@pytest.mark.slow
@pytest.mark.parametrize(('arm', 'formula'), cases(RIGHT))
def test_a_right_formula_agrees(arm, formula):
    assert verdict_of(arm, formula).status == 'agrees'


@pytest.mark.slow
@pytest.mark.parametrize(('arm', 'formula', 'cause'), cases(WRONG))
def test_the_cause_of_a_wrong_formula_is_named(arm, formula, cause):
    verdict = verdict_of(arm, formula)
    assert verdict.status == 'differs'
    assert verdict.causes, 'no cause'
    assert cause in verdict.causes[0].sentence


@pytest.mark.slow
def test_a_wrong_formula_whose_cause_is_not_found_differs_all_the_same():
    # E is lost under the root of x^2 + y^2, where no sum has a place for it.
    verdict = verdict_of('elbow', 'k3 = acos((x^2+y^2+z^2-F^2-G^2)/(2*F*G))')
    assert verdict.status == 'differs'
    assert not verdict.causes


def test_another_branch_is_said_to_be_one():
    verdict = verdict_of('column', 'd3 = -sqrt(x^2+y^2) - R')
    assert verdict.status == 'agrees'
    (remark,) = verdict.remarks
    assert remark.startswith('gives another branch: ')


@pytest.mark.slow
def test_a_branch_outside_the_limits_of_a_length_is_wrong():
    free = 'name: d3, type: prismatic'
    limited = ARMS['column'].replace(free, f'{free}, limits: [0, 1]')
    (verdict,) = compare(ks.robot_from_text(limited), 'd3 = -sqrt(x^2+y^2) - R').verdicts
    assert verdict.status == 'differs'


@pytest.mark.parametrize(
    ('name', 'formula', 'cause'),
    [
        ('elbow', 'z = F*cos(k2)+G*sin(k2+k3)', 'cos(k2) stands where sin(k2) belongs'),
        (
            'plane',
            'J_v = [-A*sin(s)-B*sin(s+t), -B*sin(s+t); A*cos(s)+B*cos(s+t), B*sin(s+t); 0, 0]',
            'sin(s + t) stands where cos(s + t) belongs',
        ),
    ],
)
def test_a_cause_is_named_once(name, formula, cause):
    (found,) = verdict_of(name, formula).causes
    assert (found.sentence, found.also) == (cause, ())


def test_each_quotient_in_a_formula_is_tried_upside_down():
    x, y, z = sympy.symbols('x y z')
    turned = [edit for edit in arguments(x + y / z, ()) if 'upside down' in edit.sentence]
    assert [(edit.part, (x + y / z).args[edit.path[0]]) for edit in turned] == [(z / y, y / z)]
