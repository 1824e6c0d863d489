"""Right formulas in many forms are accepted, and what is wrong with wrong ones is named."""

import pytest

import kinematics_service as ks
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
RIGHT = [
    ('polar', 'p = [(B+w)*cos(u)*cos(v); (B+w)*sin(u)*cos(v); H-(B+w)*sin(v)]'),
    ('polar', 'det = -(B+w)^2*cos(v)'),
    ('polar', 'det = -(w^2 + 2*B*w + B^2)*sin(v + pi/2)'),
    ('polar', 'u = atan2(y, x)'),
    ('polar', 'u = atan2(-y, -x)'),
    ('polar', 'v = atan2(H - z, sqrt(x^2 + y^2))'),
    ('polar', 'v = atan2(H - z, -sqrt(x^2 + y^2))'),
    ('polar', 'w = sqrt(x^2 + y^2 + (z - H)^2) - B'),
    ('polar', 'w = -sqrt(x^2 + y^2 + (z - H)^2) - B'),
    ('polar', 'v = asin((H - z)/(B + w))'),
    ('plane', 'p = [A*cos(s) + B*cos(s+t); A*sin(s) + B*sin(s+t); 0]'),
    ('plane', 'det = A*B*sin(t)'),
    ('plane', 'det = 2*A*B*sin(t/2)*cos(t/2)'),
    ('plane', 't = acos((x^2 + y^2 - A^2 - B^2)/(2*A*B))'),
    ('plane', 't = -acos((x^2 + y^2 - A^2 - B^2)/(2*A*B))'),
    ('plane', 's = atan2(y, x) - atan2(B*sin(t), A + B*cos(t))'),
    ('column', 'd2 = z - H'),
    ('column', 'd3 = sqrt(x^2 + y^2) - R'),
    ('column', 'd3 = -sqrt(x^2 + y^2) - R'),
    ('column', 'det = d3 + R'),
    ('column', 'p = [-(d3+R)*sin(j1); (d3+R)*cos(j1); H + d2]'),
    ('column', 'j1 = atan2(-x, y)'),
    ('column', 'j1 = atan2(x, -y)'),
    ('elbow', 'det = F*G*sin(k3)*(E + F*cos(k2) + G*cos(k2+k3))*(-1)'),
    (
        'elbow',
        'p = [cos(k1)*(E+F*cos(k2)+G*cos(k2+k3)); '
        'sin(k1)*(E+F*cos(k2)+G*cos(k2+k3)); F*sin(k2)+G*sin(k2+k3)]',
    ),
    ('elbow', 'k1 = atan2(y, x)'),
    ('elbow', 'k1 = atan2(y, x) + pi'),
    ('elbow', 'k3 = acos(((sqrt(x^2+y^2)-E)^2 + z^2 - F^2 - G^2)/(2*F*G))'),
    ('elbow', 'k3 = -acos(((sqrt(x^2+y^2)-E)^2 + z^2 - F^2 - G^2)/(2*F*G))'),
    ('elbow', 'k3 = acos(((sqrt(x^2+y^2)+E)^2 + z^2 - F^2 - G^2)/(2*F*G))'),
]
WRONG = [
    ('polar', 'det = (B+w)^2*cos(v)', 'the sign is wrong'),
    ('polar', 'det = -(B+w)^2*sin(v)', 'sin(v) and cos(v) are exchanged'),
    ('polar', 'det = -w^2*cos(v)', 'B is missing'),
    ('polar', 'u = atan2(x, y)', 'the arguments of atan2 are exchanged'),
    ('polar', 'v = atan2(-z, sqrt(x^2 + y^2))', 'H is lost'),
    ('polar', 'w = sqrt(x^2 + y^2 + (z - H)^2)', 'B is lost'),
    ('polar', 'w = sqrt(x^2 + y^2 + z^2) - B', 'H is lost'),
    ('polar', 'v = asin((H - z)/w)', 'B is lost'),
    (
        'polar',
        'p = [(B+w)*cos(u*pi/180)*cos(v*pi/180); (B+w)*sin(u*pi/180)*cos(v*pi/180); '
        'H-(B+w)*sin(v*pi/180)]',
        'taken for degrees',
    ),
    ('polar', 'p = [(B+w)*cos(u)*cos(v); (B+w)*sin(u)*cos(v); H+(B+w)*sin(v)]', 'v is counted'),
    ('plane', 'det = -A*B*sin(t)', 'the sign is wrong'),
    ('plane', 'det = A*B*cos(t)', 'sin(t) and cos(t) are exchanged'),
    ('plane', 't = acos((x^2 + y^2 - A^2)/(2*A*B))', 'B**2 is lost'),
    ('plane', 't = acos((x^2 + y^2 - A^2 + B^2)/(2*A*B))', 'the term has the wrong sign: B**2'),
    ('plane', 't = asin((x^2 + y^2 - A^2 - B^2)/(2*A*B))', 'asin and acos exchanged'),
    (
        'plane',
        'p = [A*cos(s*pi/180) + B*cos((s+t)*pi/180); A*sin(s*pi/180) + B*sin((s+t)*pi/180); 0]',
        'taken for degrees',
    ),
    ('plane', 'p = [A*sin(s) + B*sin(s+t); A*cos(s) + B*cos(s+t); 0]', 'are exchanged'),
    (
        'plane',
        'J_v = [-A*cos(s)-B*cos(s+t), -B*cos(s+t); A*sin(s)+B*sin(s+t), B*sin(s+t); 0, 0]',
        'are exchanged',
    ),
    (
        'plane',
        's = atan2(y, x) + atan2(B*sin(t), A + B*cos(t))',
        'the first argument of atan2 has the wrong sign',
    ),
    ('plane', 's = atan2(y, x) - atan2(B*sin(t), B*cos(t))', 'A is lost'),
    ('column', 'd2 = z', 'H is lost'),
    ('column', 'd3 = sqrt(x^2 + y^2)', 'R is lost'),
    ('column', 'd3 = sqrt(x^2 + y^2) + R', 'the term has the wrong sign: R'),
    ('column', 'det = -(d3 + R)', 'the sign is wrong'),
    ('column', 'j1 = atan2(x, y)', 'the first argument of atan2 has the wrong sign'),
    ('elbow', 'det = F*G*sin(k3)*(E + F*cos(k2) + G*cos(k2+k3))', 'the sign is wrong'),
    ('elbow', 'det = -F*G*cos(k3)*(E + F*cos(k2) + G*cos(k2+k3))', 'cos(k3) stands'),
    ('elbow', 'det = -F*G*sin(k3)*(F*cos(k2) + G*cos(k2+k3))', 'E is missing'),
    ('elbow', 'det = -2*F*G*sin(k3)*(E + F*cos(k2) + G*cos(k2+k3))', 'a factor 2 is too many'),
    ('elbow', 'det = F*F*sin(k3)*(E + F*cos(k2) + G*cos(k2+k3))*(-1)', 'F stands where G belongs'),
    ('plane', 't = acos((x^2 + y^2 - A^2 - B^2)/(A*B))', 'a factor 2 is too many'),
    ('plane', 't = acos((x^2 + y^2 - A^2 - B^2)/(4*A*B))', 'a factor 2 is missing'),
    ('polar', 'det = -(w^2 + B*w + B^2)*cos(v)', 'twice -B*w belongs there'),
    ('polar', 'det = -(w^2 + 4*B*w + B^2)*cos(v)', 'half of -4*B*w belongs there'),
    ('elbow', 'k1 = atan2(-y, x)', 'the first argument of atan2 has the wrong sign'),
]


def verdict_of(arm, formula):
    """Return the verdict on one formula."""
    (verdict,) = compare(ks.robot_from_text(ARMS[arm]), formula).verdicts
    return verdict


@pytest.mark.slow
@pytest.mark.parametrize(('arm', 'formula'), RIGHT)
def test_a_right_formula_agrees(arm, formula):
    assert verdict_of(arm, formula).status == 'agrees'


@pytest.mark.slow
@pytest.mark.parametrize(('arm', 'formula', 'cause'), WRONG)
def test_the_cause_of_a_wrong_formula_is_named(arm, formula, cause):
    verdict = verdict_of(arm, formula)
    assert verdict.status == 'differs'
    assert verdict.causes, 'no cause'
    assert cause in verdict.causes[0].sentence


@pytest.mark.slow
def test_a_wrong_formula_whose_cause_is_not_found_differs_all_the_same():
    # E is lost under the root of x^2 + y^2, where no sum has a place for it.
    verdict = verdict_of('elbow', 'k3 = acos((x^2 + y^2 + z^2 - F^2 - G^2)/(2*F*G))')
    assert verdict.status == 'differs'
    assert not verdict.causes


def test_a_formula_by_other_joints_is_no_branch_of_other_values_of_them():
    right = verdict_of('plane', 's = atan2(y, x) - atan2(B*sin(t), A + B*cos(t))')
    wrong = verdict_of('plane', 's = atan2(y, x) + atan2(B*sin(t), A + B*cos(t))')
    assert (right.status, wrong.status) == ('agrees', 'differs')


def test_another_branch_is_said_to_be_one():
    verdict = verdict_of('column', 'd3 = -sqrt(x^2 + y^2) - R')
    assert verdict.remarks == (
        'gives another branch: with other values of the other joints the tool is there too',
    )


@pytest.mark.slow
def test_a_branch_outside_the_limits_of_a_length_is_wrong():
    free = 'name: d3, type: prismatic'
    limited = ARMS['column'].replace(free, f'{free}, limits: [0, 1]')
    (verdict,) = compare(ks.robot_from_text(limited), 'd3 = -sqrt(x^2 + y^2) - R').verdicts
    assert verdict.status == 'differs'


def test_no_cause_is_named_twice():
    verdict = verdict_of('elbow', 'z = F*cos(k2) + G*sin(k2 + k3)')
    (cause,) = verdict.causes
    assert cause.sentence == 'cos(k2) stands where sin(k2) belongs'
    assert cause.sentence not in cause.also


def test_a_cause_is_named_once():
    robot = ks.load_robot('planar_2r')
    text = 'J_v = [-L1 s1 - L2 s12, -L2 s12; L1 c1 + L2 c12, L2 s12; 0, 0]'
    (verdict,) = compare(robot, text).verdicts
    (cause,) = verdict.causes
    assert cause.sentence == 'sin(q1 + q2) stands where cos(q1 + q2) belongs'
    assert cause.also == ()
