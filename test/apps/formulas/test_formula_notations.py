"""Formulas as textbooks, LaTeX, Matlab, Python and plain text write them: read, and judged."""

import functools

import pytest

import kinematics_service as ks
from kinematics_service.apps.formulas.compare import comparison
from kinematics_service.apps.formulas.compare.causes.explanation import Explained
from kinematics_service.apps.formulas.compare.comparison import compare

# The 3R arm of the RRR textbooks, a KR 210 by Craig's convention, and a spherical wrist.
ARMS = {
    'three_r': """
robot: three_r
convention: standard
constants: {d1: 0.1, a2: 0.2, a3: 0.3}
joints: [{name: q1, type: revolute}, {name: q2, type: revolute}, {name: q3, type: revolute}]
links:
  - {a: 0, alpha: pi/2, d: d1, theta: q1}
  - {a: a2, alpha: 0, d: 0, theta: q2}
  - {a: a3, alpha: 0, d: 0, theta: q3}
""",
    'kr210': """
robot: kr210
convention: modified
constants: {a1: 0.35, a2: 1.25, a3: -0.054, d1: 0.75, d4: 1.5, d7: 0.303}
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
  - {name: q3, type: revolute}
  - {name: q4, type: revolute}
  - {name: q5, type: revolute}
  - {name: q6, type: revolute}
links:
  - {alpha: 0, a: 0, d: d1, theta: q1}
  - {alpha: -pi/2, a: a1, d: 0, theta: q2 - pi/2}
  - {alpha: 0, a: a2, d: 0, theta: q3}
  - {alpha: -pi/2, a: a3, d: d4, theta: q4}
  - {alpha: pi/2, a: 0, d: 0, theta: q5}
  - {alpha: -pi/2, a: 0, d: 0, theta: q6}
  - {alpha: 0, a: 0, d: d7, theta: 0}
""",
    # Rows enough for a frame 12.
    'twelve': 'robot: twelve\nconvention: elementary\nlinks: [Rz(q1)'
    + ', Tx(0.1)' * 11
    + ']\njoints: [{name: q1, type: revolute}]\n',
    'wrist': """
robot: wrist
convention: standard
joints:
  - {name: phi, type: revolute}
  - {name: th, type: revolute, limits: [0.1, 3]}
  - {name: psi, type: revolute}
links:
  - {a: 0, alpha: -pi/2, d: 0, theta: phi}
  - {a: 0, alpha: pi/2, d: 0, theta: th}
  - {a: 0, alpha: 0, d: 0.2, theta: psi}
""",
}

R36 = (
    '[[-s4*s6 + c4*c5*c6, -s4*c6 - s6*c4*c5, -s5*c4], [s5*c6, -s5*s6, c5], '
    '[-s4*c5*c6 - s6*c4, s4*s6*c5 - c4*c6, s4*s5]]'
)
J_XY_PHI = '[-L1*s1-L2*s12, -L2*s12; L1*c1+L2*c12, L2*c12; 1, 1]'
J_SPACE = '[0 0; 0 0; 1 1; 0 L1*s1; 0 -L1*c1; 0 0]'
J_BODY = '[0 0; 0 0; 1 1; L1*s2 0; L1*c2+L2 L2; 0 0]'
A_1 = 'A_1 = [c1 -s1 0 L1*c1; s1 c1 0 L1*s1; 0 0 1 0; 0 0 0 1]\n'

AGREE = [
    # Frames: two indices, superscripts before and behind, rotations between frames.
    ('planar_2r', A_1 + 'A_02 = A_1*A_2'),
    ('planar_2r', 'H_02 = A_1*A_2'),
    ('planar_2r', r'H^0_2 = A^0_1 A^1_2'),
    ('planar_2r', r'\mathbf{T}^{0}_{2} = \mathbf{A}_{1}\mathbf{A}_{2}'),
    ('planar_2r', 'T_2^0 = A_1 A_2^1'),
    ('planar_2r', '⁰T₂ = A₁ A₂'),
    ('planar_2r', 'T_total = A_1*A_2'),
    ('planar_2r', 'R^0_2 = [c12 -s12 0; s12 c12 0; 0 0 1]'),
    ('planar_2r', 'R_12 = [c2 -s2 0; s2 c2 0; 0 0 1]'),
    ('planar_2r', r'{}^{1}R_{2} = \begin{pmatrix} c_2 & -s_2 & 0 \\ s_2 & c_2 & 0 \\ 0 & 0 & 1'
                  r'\end{pmatrix}'),
    ('planar_2r', 'R_21 = transpose(R^1_2)'),
    ('kr210', f'R_36 = {R36}'),
    ('kr210', f'R3_6 = {R36}'),
    ('kr210', f'R^3_6 = {R36}'),
    # Axes and origins in the coordinates of a frame.
    ('three_r', r'z^0_1 = \begin{bmatrix} s_1 \\ -c_1 \\ 0 \end{bmatrix}'),
    ('three_r', r'o^0_2 = [a_2*c_1*c_2; a_2*s_1*c_2; d_1 + a_2*s_2]'),
    ('three_r', 'z_1^0 = [s1; -c1; 0]'),
    ('three_r', 'z^1_2 = [0; 0; 1]'),
    ('three_r', 'o^1_2 = [a2*c2; a2*s2; 0]'),
    ('three_r', 'p^2_3 = [a3*c3; a3*s3; 0]'),
    ('three_r', 'o^0_n = [c1*(a2*c2 + a3*c23); s1*(a2*c2 + a3*c23); d1 + a2*s2 + a3*s23]'),
    ('three_r', r'J = [z^0_0 \times (o^0_3 - o^0_0), z^0_1 \times (o^0_3 - o^0_1), '
                r'z^0_2 \times (o^0_3 - o^0_2)]'),
    # Jacobians by name: plane, two rows, space, body, analytic, other axes.
    ('planar_2r', f'J = {J_XY_PHI}'),
    ('planar_2r', 'J_v = [-L1*s1-L2*s12, -L2*s12; L1*c1+L2*c12, L2*c12]'),
    ('planar_2r', 'J_P = [-L1*s1-L2*s12, -L2*s12; L1*c1+L2*c12, L2*c12; 0 0]'),
    ('planar_2r', r'J_\omega = [0 0; 0 0; 1 1]'),
    ('planar_2r', 'J_w = [1, 1]'),
    ('planar_2r', f'J_s = {J_SPACE}'),
    ('planar_2r', 'J_s = [0 L1*s1; 0 -L1*c1; 0 0; 0 0; 0 0; 1 1]'),
    ('planar_2r', f'J_b = {J_BODY}'),
    ('planar_2r', f'J_A = {J_XY_PHI}'),
    ('planar_2r', r'{}^2J = [L1*s2 0; L1*c2+L2 L2; 0 0; 0 0; 0 0; 1 1]'),
    ('planar_2r', 'J^0 = [-L1*s1-L2*s12, -L2*s12; L1*c1+L2*c12, L2*c12]'),
    ('planar_2r', f'rows: angular first\nJ_s = {J_SPACE}'),
    ('wrist', 'J_A = [-0.2*s1*s2 0.2*c1*c2 0; 0.2*c1*s2 0.2*s1*c2 0; '
              '0 -0.2*s2 0; 1 0 0; 0 1 0; 0 0 1]'),
    # Functions and products as they are printed.
    ('craig_3r', 'theta1 = Atan2(y, x)'),
    ('craig_3r', 'theta1 = atan2[y, x]'),
    ('craig_3r', r'\theta_1 = \operatorname{atan2}\left(y, x\right)'),
    ('craig_3r', 'q1 = math.atan2(y, x)'),
    ('planar_2r', 'x = L1c1 + L2c12'),
    ('planar_2r', r'x = L_1 c\theta_1 + L_2 c_{12}'),
    ('planar_2r', 'y = L1*sin(q1) + L2*s1c2 + L2c1s2'),
    ('planar_2r', r'y = L_1 \sin\left(\theta_1 + \frac\pi2 - \frac{\pi}2\right) + L_2 s_{12}'),
    ('planar_2r', r'x = \frac{2L_1 c_1}2 + \sqrt{L_2^2} c_{12}'),
    ('planar_2r', 'q2 = sign(sin(q2))*acos((x^2 + y^2 - L1^2 - L2^2)/(2*L1*L2))'),
    ('planar_2r', r'\cos^2\theta_1 + \sin^2 \theta_1 = \sqrt[3]{8} - 1'),
    ('planar_2r', 'x^2 + y^2 = L1**2 + L2**2 + 2*L1*L2*np.cos(q2)'),
    ('planar_3r', 'q3 = phi - q1 - q2'),
    ('planar_2r', r'$x = L_1\cos(\theta_1) + L_2\cos(\theta_1 + \theta_2).$'),
    ('three_r', 'singular: sin(q3) = 0\nsingular: a2*c2 + a3*c23 = 0'),
    ('planar_2r', '[x; y] = [L1*c1 + L2*c12; L1*s1 + L2*s12]'),
    ('planar_2r', '[x y 0]^T = [L1*c1 + L2*c12, L1*s1 + L2*s12, 0]^T'),
    ('planar_2r', 'Matrix([x, y]) = Matrix([L1*cos(q1) + L2*cos(q1 + q2), L1*s1 + L2*s12])'),
    ('planar_2r', r'\begin{bmatrix} x \\ y \end{bmatrix} = \begin{bmatrix} L_1 c_1 + L_2 c_{12} '
                  r'\\ L_1 s_1 + L_2 s_{12} \end{bmatrix}'),
    ('planar_2r', '[[x], [y]] = [[u], [L1*s1 + L2*s12]]\nwhere u = L1*c1 + L2*c12'),
]  # fmt: skip

DIFFER = [
    ('planar_2r', 'A_02 = A_2*A_1*A_1'),
    ('planar_2r', 'H^0_2 = A^0_1'),
    ('planar_2r', 'R_12 = [c2 s2 0; -s2 c2 0; 0 0 1]'),
    ('planar_2r', 'R^1_2 = [c12 -s12 0; s12 c12 0; 0 0 1]'),
    ('kr210', f'R_36 = transpose({R36})'),
    ('kr210', f'R_35 = {R36}'),
    ('three_r', 'z^0_1 = [-s1; c1; 0]'),
    ('three_r', 'z^1_2 = [s1; -c1; 0]'),
    ('three_r', 'o^1_2 = [a2*c2; a2*s2; d1]'),
    ('three_r', r'J = [z^0_0 \times (o^0_3 - o^0_0), z^0_1 \times (o^0_3 - o^0_0), '
                r'z^0_2 \times (o^0_3 - o^0_2)]'),
    ('planar_2r', J_XY_PHI.replace('[', 'J = [').replace('1, 1]', '1, 0]')),
    ('planar_2r', J_XY_PHI.replace('[', 'J = [').replace('-L2*s12;', 'L2*s12;')),
    ('planar_2r', 'J_v = [-L1*s1-L2*s12, L2*s12; L1*c1+L2*c12, L2*c12]'),
    ('planar_2r', 'J_w = [1, 0]'),
    ('planar_2r', f'J_s = {J_BODY}'),
    ('planar_2r', f'J_b = {J_SPACE}'),
    ('planar_2r', 'J_s = [0 0; 0 0; 1 1; 0 -L1*s1; 0 L1*c1; 0 0]'),
    ('planar_2r', f'rows: linear first\nJ_s = {J_SPACE}'),
    ('planar_2r', f'J_A = {J_XY_PHI.replace("1, 1]", "0, 1]")}'),
    ('planar_2r', '{}^1J = [L1*s2 0; L1*c2+L2 L2; 0 0; 0 0; 0 0; 1 1]'),
    ('craig_3r', 'theta1 = Atan2(x, y)'),
    ('craig_3r', 'theta1 = atan2[x, y]'),
    ('planar_2r', 'x = L1c1 + L2s12'),
    ('planar_2r', r'x = L_1 c\theta_2 + L_2 c_{12}'),
    ('planar_2r', r'y = L_1 \sin(\theta_1 + \frac\pi2) + L_2 s_{12}'),
    ('planar_2r', 'q2 = sign(sin(q2))*asin((x^2 + y^2 - L1^2 - L2^2)/(2*L1*L2))'),
    ('planar_3r', 'q3 = phi + q1 + q2'),
    ('planar_2r', '[x; y] = [L1*c1 + L2*c12; L1*s1 - L2*s12]'),
    ('planar_2r', '[x y]^T = [L1*s1 + L2*s12, L1*c1 + L2*c12]^T'),
    ('three_r', 'singular: a2*c2 + a3*c23 = 0'),
    ('three_r', 'singular: a2*s2 + a3*s23 = 0'),
]  # fmt: skip

# What has two meanings, or none: place, code, and a word of the advice.
REFUSED = [
    ('planar_2r', 'T_1^2 = A_1', '1:4', 'unsupported', 'T_23'),
    ('planar_2r', 'L^2_1 = 4', '1:4', 'syntax', 'L_1^2'),
    ('planar_2r', 'R_37 = [1 0; 0 1]', '1:1', 'out-of-range', 'frame 3'),
    ('planar_2r', r'\dot{q}_1 = 3', '1:8', 'syntax', "'_'"),
    ('planar_2r', 'x = L1 ± L2', '1:8', 'ambiguous', "'±'"),
    ('planar_2r', 'y = 2\nq2 = \\pm\\arccos(x/L_1)', '2:6', 'ambiguous', r"'\pm'"),
    ('planar_2r', 'x = (L1 \\mp L2)', '1:9', 'ambiguous', r"'\mp'"),
    ('planar_2r', 'q2 = +-acos(x)', '1:6', 'ambiguous', '+ (-1)'),
    ('planar_2r', 'q2 = +/- acos(x)', '1:6', 'ambiguous', 'once with -'),
    ('planar_2r', 'T_01*T_12 = T_02', '1:5', 'wrong-shape', 'T_02 = T_01*T_12'),
    ('planar_2r', '[x; y] = [x, y]', '1:1', 'wrong-shape', 'one size'),
    ('planar_2r', 'q1 = atan(y, x)', '1:6', 'wrong-length', 'atan2(y, x)'),
    ('planar_2r', 'q1 = ArcTan[x, y]', '1:6', 'wrong-length', 'atan2(y, x)'),
    ('planar_2r', 'x = l1c1', '1:5', 'unknown-name', "'l1c1'"),
    ('three_r', 'x = phi', '1:1', 'unknown-name', 'about z alone'),
    ('planar_2r', 'R_21 = transpose(R_12)', '1:18', 'ambiguous', 'r_12 or R^1_2'),
    ('twelve', 'A_12 = [1 0; 0 1]', '1:1', 'ambiguous', 'T_012'),
]


@functools.cache
def arm(name):
    return ks.robot_from_text(ARMS[name]) if name in ARMS else ks.load_robot(name)


def judged(name, text):
    found = compare(arm(name), text)
    assert not found.faults, [(f.line, f.column, f.message) for f in found.faults]
    return found


@pytest.mark.parametrize(('name', 'text'), AGREE)
def test_a_right_formula_agrees(name, text):
    found = judged(name, text)
    assert found.agrees, found.verdicts


@pytest.mark.parametrize(('name', 'text'), DIFFER)
def test_a_wrong_formula_differs(name, text, monkeypatch):
    # Why it differs is tested elsewhere, and takes most of the time.
    monkeypatch.setattr(comparison, 'explain', lambda _: Explained((), ()))
    assert not judged(name, text).agrees


@pytest.mark.parametrize(('name', 'text', 'place', 'code', 'word'), REFUSED)
def test_what_has_no_single_meaning_is_refused(name, text, place, code, word):
    fault = compare(arm(name), text).faults[0]
    assert (f'{fault.line}:{fault.column}', fault.code) == (place, code)
    assert word in fault.message


@pytest.mark.parametrize(
    ('unused', 'code', 'name'),
    [
        ('D = (x^2+y^2-L1^2-L2^2)/(2 L1 L2)', 'unused', "'D'"),
        ('wz = qdot1 + qdot2', 'unknown-name', "'qdot1'"),
        ('v = J*[1; 1]', 'unused', "'v'"),
    ],
)
def test_a_definition_that_nothing_uses_is_passed_over(unused, code, name):
    found = judged('planar_2r', f'{unused}\nJ = {J_XY_PHI}')
    assert found.agrees
    (fault,) = found.passed_over
    assert (fault.line, fault.code) == (1, code)
    assert name in fault.message


@pytest.mark.parametrize(
    ('text', 'words'),
    [(f'J = {J_XY_PHI}', 'vx vy wz'), (f'J_b = {J_BODY}', 'wx wy wz vx')],
)
def test_the_meaning_of_a_jacobian_is_said(text, words):
    (verdict,) = judged('planar_2r', text).verdicts
    assert any(remark.startswith(f'rows {words}') for remark in verdict.remarks)
