# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Formulas of the inverse kinematics: the whole pose decides where the point does not say enough.
"""

import functools

import pytest

import kinematics_service as ks
from kinematics_service.apps.formulas.compare import comparison
from kinematics_service.apps.formulas.compare.comparison import compare

# Three axes that meet, turned about z, y', z'': the tool's point says nothing about them.
WRIST = """\
robot: wrist
convention: standard
joints:
  - {name: u, type: revolute}
  - {name: v, type: revolute}
  - {name: w, type: revolute}
links:
  - {a: 0, alpha: -pi/2, d: 0, theta: u}
  - {a: 0, alpha: pi/2, d: 0, theta: v}
  - {a: 0, alpha: 0, d: 0.11, theta: w}
"""
# Four parallel axes, one more than the plane asks for.
SNAKE = """\
robot: snake
convention: standard
constants: {A: 0.31, B: 0.23, C: 0.17, D: 0.09}
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
  - {name: q3, type: revolute}
  - {name: q4, type: revolute}
links:
  - {a: A, alpha: 0, d: 0, theta: q1}
  - {a: B, alpha: 0, d: 0, theta: q2}
  - {a: C, alpha: 0, d: 0, theta: q3}
  - {a: D, alpha: 0, d: 0, theta: q4}
singularity: {task: [x, y, rz]}
"""
# A boom that never points backwards: of two solutions the first is that of every pose.
BOOM = """\
robot: boom
convention: standard
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute, limits: [-1.2, 1.2]}
  - {name: d3, type: prismatic, limits: [0.2, 0.5]}
links:
  - {a: 0, alpha: pi/2, d: 0, theta: q1}
  - {a: 0, alpha: pi/2, d: 0, theta: q2 + pi/2}
  - {a: 0, alpha: 0, d: d3, theta: 0}
"""
OWN = {'wrist': WRIST, 'snake': SNAKE, 'boom': BOOM}


@functools.cache
def arm(name):
    """Return a robot of this file, or a bundled one."""
    return ks.robot_from_text(OWN[name]) if name in OWN else ks.load_robot(name)


# The third column of R03^T R of the Puma: -cos q4 sin q5, -sin q4 sin q5, cos q5.
R13 = '(r13*c1*c23 + r23*s1*c23 + r33*s23)'
R23 = '(r23*c1 - r13*s1)'
R33 = '(r33*c23 - r13*c1*s23 - r23*s1*s23)'

WRONG = {
    'puma560': f"""
        q5 = q1 + q2 + q3
        q5 = acos({R13})
        q5 = acos(r33)
        q5 = 0.4
        q5 = acos(r11)*q2
        q4 = q1 - q3
        q4 = atan2({R13}, {R23})
        q4 = atan2(-{R23}, {R13})
        q6 = atan2(r32, r31)
        q6 = -q4
    """,
    'ur5e': """
        q6 = q1 + atan2(r21, r11)
        q6 = 0.7
        q5 = q1 + q2
        q5 = acos(x*s1 - y*c1)
    """,
    'scara_hsr065': """
        q4 = q1 + q2 + 0.3
        q4 = q1 + q2 + atan2(r21, r11)
        q4 = atan2(r21, r11) - q1 + q2
        q4 = acos(r11) - q1
        q4 = 0
    """,
    'wrist': """
        v = u + 0.2
        v = asin(r33)
        u = atan2(-r23, r13)
        w = atan2(r32, r31)
        w = atan2(y, x)
    """,
    # The other joints follow whatever q4 = 0.4 is.
    'snake': """
        q4 = atan2(r21, r11) + q1 + q2 + q3
        q4 = q3
        q4 = 0.4
        q3 = atan2(r21, r11) - q1 - q2
        q1 = atan2(r21, r11) - q2
    """,
}
RIGHT = {
    'puma560': f"""
        q1 = atan2(y, x) + atan2(d3, sqrt(x^2 + y^2 - d3^2))
        q4 = atan2({R23}, {R13})
        q4 = atan2(-{R23}, -{R13})
        q5 = -acos({R33})
    """,
    'scara_hsr065': """
        q4 = atan2(r21, r11) - q1 - q2
        q2 = acos((x^2 + y^2 - L1^2 - L2^2)/(2*L1*L2))
        d3 = z
    """,
    'wrist': """
        v = acos(r33)
        v = -acos(r33)
        u = atan2(r23, r13)
        u = atan2(-r23, -r13)
        u = atan2(y, x)
        w = atan2(r32, -r31)
    """,
    'snake': 'q4 = atan2(r21, r11) - q1 - q2 - q3\n',
    # Of the second the joints q2 and d3 are others; d3 stays inside its limits.
    'boom': """
        q1 = atan2(y, x)
        q1 = atan2(-y, -x)
    """,
}


def cases(table):
    """Return pairs of an arm and a formula."""
    return [
        (name, line.strip())
        for name, formulas in table.items()
        for line in formulas.strip().splitlines()
    ]


@pytest.fixture
def unexplained(monkeypatch):
    """Do not search for what is wrong with a formula: it takes longer, and is tested elsewhere."""
    monkeypatch.setattr(comparison, 'explain', lambda check: comparison.Explained((), ()))


@pytest.mark.slow
@pytest.mark.parametrize(('name', 'formula'), cases(WRONG))
def test_a_wrong_formula_of_a_wrist_or_of_a_redundant_joint_differs(name, formula, unexplained):
    (verdict,) = compare(arm(name), formula).verdicts
    assert verdict.status == 'differs'


@pytest.mark.slow
@pytest.mark.parametrize(('name', 'formula'), cases(RIGHT))
def test_a_right_one_agrees(name, formula):
    (verdict,) = compare(arm(name), formula).verdicts
    assert verdict.status == 'agrees'


D = '(x^2+y^2-L1^2-L2^2)/(2*L1*L2)'
INNER = 'acos((x^2+y^2+L1^2-L2^2)/(2*L1*sqrt(x^2+y^2)))'
LEFT, OTHER = f'q2 = acos({D})', f'q2 = -acos({D})'


@functools.cache
def agrees(name, formulas):
    """Return whether formulas agree with an arm."""
    return compare(arm(name), formulas).agrees


@pytest.mark.parametrize(
    ('name', 'formulas', 'fit'),
    [
        ('planar_2r', [LEFT, f'q1 = atan2(y,x)-{INNER}'], True),
        ('planar_2r', [LEFT, f'q1 = atan2(y,x)+{INNER}'], False),
        ('planar_2r', [OTHER, f'q1 = atan2(y,x)+{INNER}'], True),
        # Of q1 by q2 the value of the other formula counts.
        ('planar_2r', [LEFT, 'q1 = atan2(y,x)-atan2(L2*s2, L1+L2*c2)'], True),
        # Both branches of q2, and one of q1: one pair fits.
        ('planar_2r', [LEFT, OTHER, f'q1 = atan2(y,x)+{INNER}'], True),
        ('scara_hsr065', [LEFT, f'q1 = atan2(y,x)-{INNER}', 'd3 = z'], True),
        ('scara_hsr065', [LEFT, f'q1 = atan2(y,x)+{INNER}', 'd3 = z'], False),
        ('wrist', ['v = acos(r33)', 'u = atan2(-r23, -r13)'], False),
        ('wrist', ['v = -acos(r33)', 'u = atan2(-r23, -r13)', 'w = atan2(-r32, r31)'], True),
        ('wrist', ['v = -acos(r33)', 'u = atan2(-r23, -r13)', 'w = atan2(r32, -r31)'], False),
    ],
)
def test_formulas_of_one_file_belong_to_one_solution(name, formulas, fit):
    assert all(agrees(name, formula) for formula in formulas)
    found = compare(arm(name), '\n'.join(formulas))
    assert found.agrees == fit
    if not fit:
        assert any('different solutions' in ' '.join(v.remarks) for v in found.verdicts)


AT = 'at: q1=60 deg, q2=0\n'


@pytest.mark.parametrize(
    ('formula', 'agrees'),
    [
        ('y = 0.8660254*L1 + 0.8660254*L2', True),
        ('y = 0.866025*(L1 + L2)', True),
        ('y = 0.8660264*L1 + 0.8660254*L2', False),
        ('y = 0.8660254*L1 - 0.8660254*L2', False),
        ('y = 0.87*L1 + 0.87*L2', False),
        ('x = 0.5*L1 + 0.5*L2', True),
        ('x = 0.51*L1 + 0.5*L2', False),
    ],
)
def test_a_rounded_number_beside_a_letter_is_compared_to_its_last_digit(formula, agrees):
    assert compare(arm('planar_2r'), AT + formula).agrees == agrees


@pytest.mark.parametrize(
    ('formula', 'agrees'),
    [
        ('y = 2*0.8660254*L1/2 + 0.8660254*L2', True),
        ('y = 17*0.8660254*(L1+L2)-16*0.8660254*L1 - 16*0.8660254*L2', True),
        ('w = 3*0.2886751\ny = w*L1 + w*L2', True),
        ('w = 0.8660254\nv = 2*w\ny = (v*L1 + v*L2)/2', True),
        ('y = 1.7320508^2/4*(L1 + L2)/0.8660254', True),
        ('1.1547005*y = L1 + L2', True),
        ('1.1547012*y = L1 + L2', False),
        ('y = 2*0.8660252*L1/2 + 0.8660254*L2', False),
        ('w = 3*0.2886761\ny = w*L1 + w*L2', False),
        ('w = 0.8660254\ny = w*L1 + w*L2 + L1*L2/1000000', False),
        # 4 digits are good for 2e-4 of L1 here, not for 2e-3.
        ('y = 4*0.2165*L1 + 4*0.2165*L2', True),
        ('y = 4*0.2170*L1 + 4*0.2165*L2', False),
        # What cancels is no room: the same number on both sides moves nothing.
        ('y = 0.8660254*(L1+L2) + (0.1234567-0.1234567+0.000001)*L1', False),
    ],
)
def test_what_is_made_of_rounded_numbers_is_as_rough_as_they_are(formula, agrees):
    comparison = compare(arm('planar_2r'), AT + formula)
    assert not comparison.faults
    assert comparison.agrees is agrees


# Right at some poses, and at others neither the joint nor another branch.
PARTLY_RIGHT = {
    'planar_2r': """
        q1 = atan(y/x) - atan2(L2*s2, L1 + L2*c2)
        q2 = atan(r21/r11) - q1
    """,
    'scara_hsr065': 'q4 = acos(r11) - q1 - q2\n',
    'wrist': 'w = asin(r32/sin(v))',
}


@pytest.mark.parametrize(('name', 'formula'), cases(PARTLY_RIGHT))
def test_a_formula_that_is_right_at_some_poses_only_differs(name, formula, unexplained):
    (verdict,) = compare(arm(name), formula).verdicts
    assert verdict.status == 'differs'
    assert 'of the poses only' in ' '.join(verdict.remarks)
    assert ('atan2 can' in verdict.remarks[0]) == ('atan(' in formula)


# In other words than those of textbooks, and branches that the arm does not have at every pose.
UNUSUAL = {
    'planar_2r': f"""
        q2 = 2*atan(sqrt((1 - {D})/(1 + {D})))
        q2 = pi - acos(-{D})
        q2 = -atan2(r12, r22) - q1 + 4*pi
        q1 = atan2((L1 + L2*c2)*y - L2*s2*x, (L1 + L2*c2)*x + L2*s2*y)
    """,
    'wrist': """
        u = atan(r23/r13)
        v = atan2(r13*cos(u) + r23*sin(u), r33)
    """,
    'craig_3r': """
        q3 = -acos(((sqrt(x^2 + y^2) + L1)^2 + z^2 - L2^2 - L3^2)/(2*L2*L3))
        q2 = atan2(-z, x*c1 + y*s1 - L1) - atan2(L3*s3, L2 + L3*c3)
    """,
    'ur5e': 'q5 = -acos((x*s1 - y*c1 - d4)/d6)\n',
}


@pytest.mark.parametrize(('name', 'formula'), cases(UNUSUAL))
def test_a_right_formula_in_other_words_agrees(name, formula):
    (verdict,) = compare(arm(name), formula).verdicts
    assert verdict.status == 'agrees', verdict.remarks


def test_where_a_branch_is_none_is_said():
    (verdict,) = compare(arm('craig_3r'), 'q1 = atan2(-y, -x)').verdicts
    assert verdict.status == 'agrees'
    assert 'no solution at' in verdict.remarks[0]


def test_a_function_that_may_not_be_real_is_no_fault():
    # The absolute value of acos brings a conjugate into its square.
    formula = 'theta3 = abs(acos((y^2+y^2+z^2-L2^2-L3^2)/(2*L2*L3)))'
    (verdict,) = compare(arm('anthropomorphic_3r'), formula).verdicts
    assert verdict.status == 'differs'


def test_another_branch_that_is_off_by_a_little_is_none(unexplained):
    # The other elbow, and that with a bit more: nowhere does it bring the tool to its point.
    branch = f'q1 = atan2(y,x)+{INNER}'
    assert agrees('planar_2r', branch)
    for off in (1e-2, 1e-6):
        assert not compare(arm('planar_2r'), f'{branch} + {off:.6f}').agrees
