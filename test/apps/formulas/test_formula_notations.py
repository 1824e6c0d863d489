# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
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

# Matrices that several formulas have, by the names of the tables below.
MATRICES = {
    'R36': '[[-s4*s6+c4*c5*c6, -s4*c6-s6*c4*c5, -s5*c4], [s5*c6, -s5*s6, c5], '
    '[-s4*c5*c6-s6*c4, s4*s6*c5-c4*c6, s4*s5]]',
    'J_XY_PHI': '[-L1*s1-L2*s12, -L2*s12; L1*c1+L2*c12, L2*c12; 1, 1]',
    'J_SPACE': '[0 0; 0 0; 1 1; 0 L1*s1; 0 -L1*c1; 0 0]',
    'J_BODY': '[0 0; 0 0; 1 1; L1*s2 0; L1*c2+L2 L2; 0 0]',
}

# Frames: two indices, superscripts before and behind, rotations between frames. Jacobians by
# name: plane, two rows, space, body, analytic, other axes. Axes and origins in the coordinates of
# a frame. Functions and products as they are printed.
AGREE = {
    'planar_2r': r"""
        H_02 = A_1*A_2
        H^0_2 = A^0_1 A^1_2
        \mathbf{T}^{0}_{2} = \mathbf{A}_{1}\mathbf{A}_{2}
        T_2^0 = A_1 A_2^1
        ⁰T₂ = A₁ A₂
        T_total = A_1*A_2
        R^0_2 = [c12 -s12 0; s12 c12 0; 0 0 1]
        R_12 = [c2 -s2 0; s2 c2 0; 0 0 1]
        {}^{1}R_{2} = \begin{pmatrix} c_2 & -s_2 & 0 \\ s_2 & c_2 & 0 \\ 0 & 0 & 1\end{pmatrix}
        R_21 = transpose(R^1_2)
        J = J_XY_PHI
        J_v = [-L1*s1-L2*s12, -L2*s12; L1*c1+L2*c12, L2*c12]
        J_P = [-L1*s1-L2*s12, -L2*s12; L1*c1+L2*c12, L2*c12; 0 0]
        J_\omega = [0 0; 0 0; 1 1]
        J_w = [1, 1]
        J_s = J_SPACE
        J_s = [0 L1*s1; 0 -L1*c1; 0 0; 0 0; 0 0; 1 1]
        J_b = J_BODY
        J_A = J_XY_PHI
        {}^2J = [L1*s2 0; L1*c2+L2 L2; 0 0; 0 0; 0 0; 1 1]
        J^0 = [-L1*s1-L2*s12, -L2*s12; L1*c1+L2*c12, L2*c12]
        x = L1c1 + L2c12
        cos(Atan2(s1, c1)) = c1
        cos(atan2[s1, c1]) = c1
        cos(math.atan2(s1, c1)) = c1
        x = L_1 c\theta_1 + L_2 c_{12}
        y = L1*sin(q1) + L2*s1c2 + L2c1s2
        y = L_1 \sin\left(\theta_1 + \frac\pi2 - \frac{\pi}2\right) + L_2 s_{12}
        x = \frac{2L_1 c_1}2 + \sqrt{L_2^2} c_{12}
        q2 = sign(sin(q2))*acos((x^2 + y^2 - L1^2 - L2^2)/(2*L1*L2))
        \cos^2\theta_1 + \sin^2 \theta_1 = \sqrt[3]{8} - 1
        x^2 + y^2 = L1**2 + L2**2 + 2*L1*L2*np.cos(q2)
        $x = L_1\cos(\theta_1) + L_2\cos(\theta_1 + \theta_2).$
        [x; y] = [L1*c1 + L2*c12; L1*s1 + L2*s12]
        [x y 0]^T = [L1*c1 + L2*c12, L1*s1 + L2*s12, 0]^T
        Matrix([x, y]) = Matrix([L1*cos(q1) + L2*cos(q1 + q2), L1*s1 + L2*s12])
        \begin{bmatrix} x \\ y \end{bmatrix}=\begin{bmatrix} L1c1+L2c12 \\ L1s1+L2s12 \end{bmatrix}
    """,
    'kr210': r"""
        R_36 = R36
        R3_6 = R36
        R^3_6 = R36
    """,
    'three_r': r"""
        z^0_1 = \begin{bmatrix} s_1 \\ -c_1 \\ 0 \end{bmatrix}
        o^0_2 = [a_2*c_1*c_2; a_2*s_1*c_2; d_1 + a_2*s_2]
        z_1^0 = [s1; -c1; 0]
        z^1_2 = [0; 0; 1]
        o^1_2 = [a2*c2; a2*s2; 0]
        p^2_3 = [a3*c3; a3*s3; 0]
        o^0_n = [c1*(a2*c2 + a3*c23); s1*(a2*c2 + a3*c23); d1 + a2*s2 + a3*s23]
        J = [z^0_0\times(o^0_3-o^0_0), z^0_1\times(o^0_3-o^0_1), z^0_2 \times (o^0_3 - o^0_2)]
    """,
    'wrist': r"""
        J_A = [-0.2*s1*s2 0.2*c1*c2 0; 0.2*c1*s2 0.2*s1*c2 0; 0 -0.2*s2 0; 1 0 0; 0 1 0; 0 0 1]
    """,
    'craig_3r': r"""
        \theta_1 = \operatorname{atan2}\left(y, x\right)
    """,
    'planar_3r': r"""
        q3 = phi - q1 - q2
    """,
}
AGREE_TOGETHER = [
    (
        'planar_2r',
        """
        A_1 = [c1 -s1 0 L1*c1; s1 c1 0 L1*s1; 0 0 1 0; 0 0 0 1]
        A_02 = A_1*A_2
        """,
    ),
    (
        'planar_2r',
        """
        rows: angular first
        J_s = J_SPACE
        """,
    ),
    (
        'three_r',
        """
        singular: sin(q3) = 0
        singular: a2*c2 + a3*c23 = 0
        """,
    ),
    (
        'planar_2r',
        """
        [[x], [y]] = [[u], [L1*s1 + L2*s12]]
        where u = L1*c1 + L2*c12
        """,
    ),
]

DIFFER = {
    'planar_2r': r"""
        A_02 = A_2*A_1*A_1
        H^0_2 = A^0_1
        R_12 = [c2 s2 0; -s2 c2 0; 0 0 1]
        R^1_2 = [c12 -s12 0; s12 c12 0; 0 0 1]
        J = [-L1*s1-L2*s12, -L2*s12; L1*c1+L2*c12, L2*c12; 1, 0]
        J = [-L1*s1-L2*s12, L2*s12; L1*c1+L2*c12, L2*c12; 1, 1]
        J_v = [-L1*s1-L2*s12, L2*s12; L1*c1+L2*c12, L2*c12]
        J_w = [1, 0]
        J_s = J_BODY
        J_b = J_SPACE
        J_s = [0 0; 0 0; 1 1; 0 -L1*s1; 0 L1*c1; 0 0]
        J_A = [-L1*s1-L2*s12, -L2*s12; L1*c1+L2*c12, L2*c12; 0, 1]
        {}^1J = [L1*s2 0; L1*c2+L2 L2; 0 0; 0 0; 0 0; 1 1]
        x = L1c1 + L2s12
        cos(Atan2(c1, s1)) = c1
        cos(atan2[c1, s1]) = c1
        x = L_1 c\theta_2 + L_2 c_{12}
        y = L_1 \sin(\theta_1 + \frac\pi2) + L_2 s_{12}
        q2 = sign(sin(q2))*asin((x^2 + y^2 - L1^2 - L2^2)/(2*L1*L2))
        [x; y] = [L1*c1 + L2*c12; L1*s1 - L2*s12]
        [x y]^T = [L1*s1 + L2*s12, L1*c1 + L2*c12]^T
    """,
    'kr210': r"""
        R_36 = transpose(R36)
        R_35 = R36
    """,
    'three_r': r"""
        z^0_1 = [-s1; c1; 0]
        z^1_2 = [s1; -c1; 0]
        o^1_2 = [a2*c2; a2*s2; d1]
        J = [z^0_0\times(o^0_3-o^0_0), z^0_1\times(o^0_3-o^0_0), z^0_2 \times (o^0_3 - o^0_2)]
        singular: a2*c2 + a3*c23 = 0
        singular: a2*s2 + a3*s23 = 0
    """,
    'craig_3r': r"""
        \theta_1 = \operatorname{atan2}\left(x, y\right)
    """,
    'planar_3r': r"""
        q3 = phi + q1 + q2
    """,
}
DIFFER_TOGETHER = [('planar_2r', 'rows: linear first\nJ_s = J_SPACE')]

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


def cases(table):
    """Return each line of a table with its arm."""
    return [
        (name, line.strip())
        for name, lines in table.items()
        for line in lines.strip().splitlines()
    ]


@functools.cache
def arm(name):
    return ks.robot_from_text(ARMS[name]) if name in ARMS else ks.load_robot(name)


def judged(name, text):
    for matrix, entries in MATRICES.items():
        text = text.replace(matrix, entries)
    found = compare(arm(name), text)
    assert not found.faults, [(f.line, f.column, f.message) for f in found.faults]
    return found


@pytest.mark.parametrize(('name', 'text'), [*cases(AGREE), *AGREE_TOGETHER])
def test_a_right_formula_agrees(name, text):
    found = judged(name, text)
    assert found.agrees, found.verdicts


@pytest.mark.parametrize(('name', 'text'), [*cases(DIFFER), *DIFFER_TOGETHER])
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
    found = judged('planar_2r', f'{unused}\nJ = J_XY_PHI')
    assert found.agrees
    (fault,) = found.passed_over
    assert (fault.line, fault.code) == (1, code)
    assert name in fault.message


@pytest.mark.parametrize(
    ('text', 'words'),
    [('J = J_XY_PHI', 'vx vy wz'), ('J_b = J_BODY', 'wx wy wz vx')],
)
def test_the_meaning_of_a_jacobian_is_said(text, words):
    (verdict,) = judged('planar_2r', text).verdicts
    assert any(remark.startswith(f'rows {words}') for remark in verdict.remarks)
