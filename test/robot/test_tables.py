# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Tables as people have them, read as robots: each form of the Puma, and what is refused."""

import io
import math
import re

import numpy as np
import pytest
from refusal import places

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.errors import RobotFileError
from kinematics_service.robot.tables.robot_table import read_table

ROUND_OFF = 1e-12  # m and rad; a dozen rotations of an arm of a metre

PUMA = (
    (0.0, 90, 26.45 * 0.0254),
    (0.4318, 0, 0.0),
    (0.0203, -90, 0.15005),
    (0.0, 90, 0.4318),
    (0.0, -90, 0.0),
    (0.0, 0, 0.0),
)


def read(text, **options):
    """Return the robot of a table, and the notes by code."""
    found = read_table(text, 'dh.txt', 'arm', **options)
    notes = {}
    for note in found.doubts:
        notes[note.code] = f'{notes.get(note.code, "")}\n{note.message}'.strip()
    return ks.robot_from_text(found.text), notes


def faults(text, **options):
    with pytest.raises(RobotFileError) as caught:
        read_table(text, 'dh.txt', 'arm', **options)
    return caught.value


def fault(text, **options):
    """Return the code and the message of the only fault."""
    (found,) = faults(text, **options).faults
    return found.code, found.message


def same(robot, other='puma560', **kwargs):
    other = ks.load_robot(other) if isinstance(other, str) else other
    assert robot.dof == other.dof
    for q in np.random.default_rng(24).uniform(-1.0, 1.0, (3, robot.dof)):
        mine, theirs = (ks.forward_kinematics(one, q) for one in (robot, other))
        assert np.abs(mine - theirs).max() < ROUND_OFF


def lines(head, row, end='', rows=PUMA):
    texts = (row(i, *values) for i, values in enumerate(rows, 1))
    return '\n'.join([head, *texts, end])


def radians(degrees):
    return {90: 'pi/2', -90: '-pi/2', 0: '0'}[degrees]


def comma(value):
    return repr(value).replace('.', ',')


FORMS = {
    'csv': lines('a,alpha,d,theta', lambda i, a, al, d: f'{a!r},{al},{d!r},q{i}'),
    'another order, empty theta, rad': lines(
        'i,theta,d,a,alpha', lambda i, a, al, d: f'{i},,{d!r},{a!r},{radians(al)}'
    ),
    'decimal commas, mm and deg in the heads': lines(
        'Link;a_i [mm];alpha_i [°];d_i [mm];theta_i [°]',
        lambda i, a, al, d: f'{i};{comma(a * 1000)};{al},0;{comma(d * 1000)};θ{i}*',
    ),
    'tabs of a spreadsheet, with a typographic minus': lines(
        'θ\tα\ta\td', lambda i, a, al, d: f'θ_{i}\t{al}°\t{a!r}\t{d!r}'.replace('-', '−')
    ),
    'columns by spaces': lines(
        'a       alpha   d   theta', lambda i, a, al, d: f'{a!r}   {al}   {d!r}   0 + q{i}'
    ),
    'markdown': lines(
        '| joint | $a_i$ | $\\alpha_i$ | $d_i$ | **θᵢ** |\n|---|:-:|--:|---|---|',
        lambda i, a, al, d: f'| {i} | {a!r} | {al} | {d!r} | $\\theta_{i}^*$ |',
    ),
    'latex': lines(
        '\\begin{tabular}{|c|*{4}{c|}} \\hline % the arm\n'
        'Link & $a_i$ & $\\alpha_i$ & $d_i$ & $\\theta_i$ \\\\ \\hline\\hline',
        lambda i, a, al, d: (
            f'{i} & {a!r} & ${radians(al)}$ & {d!r} & $\\theta_{{{i}}}$ \\\\[2pt] \\hline'
        ).replace('pi/2', '\\frac{\\pi}{2}'),
        '\\end{tabular}',
    ),
    'latex in degrees': lines(
        'i & $\\alpha_i$ & $a_i$ & $\\theta_i$ & $d_i$ \\\\',
        lambda i, a, al, d: f'{i} & ${al}^{{\\circ}}$ & ${a!r}$ & $q_{{{i}}}^{{*}}$ & {d!r} \\\\',
    ),
    'matlab links': lines(
        'clear; % Puma\nd1 = 26.45*0.0254; a2 = 0.4318; deg = pi/180;',
        lambda i, a, al, d: (
            f"L({i}) = Link('d', {'d1' if i == 1 else d}, 'a', {'a2' if i == 2 else a}, "
            f"'alpha', {al}*deg, 'qlim', [-160 160]*deg);"
        ),
        "robot = SerialLink(L, 'name', 'Puma 560');",
    ),
    'matlab vectors': lines(
        'L = [',
        lambda i, a, al, d: f'  Link([0, {d!r} {a!r}  {radians(al)} 0 0])',
        "]; R = SerialLink(L, 'name', 'Puma')",
    ),
    'matlab classes': lines(
        '',
        lambda i, a, al, d: (
            f"L{i} = Revolute('a', {a!r}, 'd', {d!r}, 'alpha', deg2rad({al}), 'm', 2, "
            "'I', [0.1, 0.2, 0.3]);"
        ),
        'p = SerialLink([L1 L2 L3 L4 L5 L6]);',
    ),
    'python': lines(
        'from math import pi\nimport numpy as np\nrobot = rtb.DHRobot([  # the arm',
        lambda i, a, al, d: (
            f'    RevoluteDH(d={d!r}, a={a!r}, alpha={radians(al)}, '
            'qlim=np.array([-2.7, 2.7]), G=-62.6111),'
        ),
        "], name='Puma')",
    ),
    'python, DHLink': lines(
        '', lambda i, a, al, d: f'L{i} = rtb.DHLink(d={d!r}, alpha=np.{radians(al)}, a={a!r})'
        if al == 90 else f'L{i} = rtb.DHLink(d={d!r}, alpha={radians(al)}, a={a!r})',
    ),
    'box of the toolbox for python': lines(
        'DHRobot: Puma, 6 joints\n┌──┬──┬──┐\n│ θⱼ │ dⱼ │ aⱼ │ ⍺ⱼ │ q⁻ │ q⁺ │\n├──┼──┤',
        lambda i, a, al, d: f'│ q{i} │ {d!r} │ {a!r} │ {al}.0° │ -160.0° │ 160.0° │',
        '└──┴──┴──┘\n\n┌──┬──┐\n│ tool │ t = 0, 0, 0.1 │\n└──┴──┘',
    ),
    'box of the toolbox for matlab': lines(
        '+---+----+---+---+\n| j | theta | d | a | alpha | offset |\n+---+----+---+---+',
        lambda i, a, al, d: f'| {i}| q{i}| {d!r}| {a!r}| {math.radians(al)!r}| 0|',
        '+---+----+---+---+',
    ),
}  # fmt: skip


@pytest.mark.parametrize('form', FORMS)
def test_each_form_is_the_same_arm(form):
    robot, _ = read(FORMS[form])
    same(robot)


@pytest.mark.parametrize('end', ['\r\n', '\r', '\n\n'])
def test_ends_of_lines_and_blank_lines_mean_nothing(end):
    same(read(FORMS['csv'].replace('\n', end))[0])


def test_a_comma_in_one_line_separates_nothing():
    table = lines('a alpha d theta', lambda i, a, al, d: f'{a!r} {al} {d!r} q{i}')
    error = faults(table.replace('0.4318 0 ', '0,4318 0 ', 1))
    assert places(error) == [(3, 'row 2, column a', 'decimal-comma')]
    assert "'0,4318'" in str(error)


def test_a_matrix_is_read_with_columns():
    rows = [f'0 {d!r} {a!r} {al}' for a, al, d in PUMA]
    matlab = '; '.join(rows)
    python = ',\n'.join(f'[{row.replace(" ", ", ")}]' for row in rows)
    for text in (
        f'[{matlab}]',
        f'dh = [ {";".join(rows[:3])};\n{";".join(rows[3:])} ];\n',
        f"robot = SerialLink([{matlab}], 'name', 'puma');",
        f'DH = [\n{python}]',
        f'np.array([{python}])',
    ):
        robot, notes = read(text, columns='theta,d,a,alpha')
        same(robot)
        assert 'offsets' in notes
        assert 'angles are read in deg, because 90 rad' in notes['assumed-unit']


STANFORD = """\
robot: s
convention: standard
units: {angle: deg}
joints:
  - {name: q1, type: revolute, limits: [-170, 170]}
  - {name: q2, type: revolute}
  - {name: q3, type: prismatic, limits: [0.3, 1.27]}
links:
  - {a: 0, alpha: -90, d: 0.412, theta: q1}
  - {a: 0, alpha: 90, d: 0.154, theta: q2 + 10}
  - {a: 0.02, alpha: 0, d: q3, theta: -90}
"""
SLIDING = {
    'a variable in d': 'alpha,a,d,theta\n-90,0,0.412,q1\n90,0,0.154,q2 + 10°\n0,0.02,d3*,-90\n',
    'd without a number': 'alpha,a,d,theta\n-90,0,0.412,\n90,0,0.154,θ+10\n0,0.02,,-90\n',
    'a type': 'type,a,alpha,d,theta\nR,0,-90,0.412,0\nR,0,90,0.154,10\nP,0.02,0,0,-90\n',
    'sigma and offset': 'sigma,a,alpha,d,theta,offset\n0,0,-90,0.412,,0\n0,0,90,0.154,θ,10\n'
    '1,0.02,0,0,-90,0\n',
    'toolbox': "L1 = Link('d',0.412,'alpha',-pi/2);\n"
    "L2 = Link('revolute', 'd',0.154, 'alpha',pi/2, 'offset', 10*pi/180)\n"
    "L3 = Link('theta', -pi/2, 'a', 0.02, 'alpha', 0, 'qlim', [0.3 1.27]);",
    'vectors': 'Link([0 0.412 0 -pi/2 0])\nLink([0 0.154 0 pi/2 0 10*pi/180])\n'
    'Link([-pi/2 0 0.02 0 1])',
    'python': 'RevoluteDH(d=0.412,alpha=-pi/2), RevoluteDH(d=0.154,alpha=pi/2,offset=np.pi/18),\n'
    'PrismaticDH(theta=-pi/2, a=0.02)',
}


@pytest.mark.parametrize('form', SLIDING)
def test_a_joint_slides_where_the_variable_stands_in_d(form):
    robot, _ = read(SLIDING[form])
    assert robot.joint_types == ('revolute', 'revolute', 'prismatic')
    same(robot, ks.robot_from_text(STANFORD))


def test_limits_in_their_forms():
    expected = [math.radians(-170), math.radians(170)]
    for cell in ('"[-170, 170]"', '-170..170', '−170 to 170', '-170 170', '"-170,0; 170,0"'):
        text = f'a,alpha,d,theta,range\n0,0,0,q1,{cell}\n10,0,0,q2,{cell}\n'
        robot, _ = read(text, units=['deg'])
        assert np.array_equal(robot.limits, [expected, expected]), cell
    robot, _ = read('a,alpha,d,theta,min,max\n0,90,0,q1,-170,170\n1,0,0,q2,,\n')
    assert robot.limits.tolist() == [expected, [-math.inf, math.inf]]
    for text in (
        "Link('d', 0, 'a', 1, 'alpha', 0, 'qlim', pi/180*[-170 170])",
        'L(1) = Link([0 0 1 0]);\nL(1).qlim = [-170 170]*pi/180; R = SerialLink(L);',
        'RevoluteDH(a=1, qlim=np.array([-17, 17]) * np.pi / 18)',
    ):
        assert read(text)[0].limits[0] == pytest.approx(expected, rel=4e-16)


CRAIG = 'convention: modified\n' + STANFORD.replace('convention: standard\n', '')


@pytest.mark.parametrize(
    'text',
    [
        'i;α_{i-1};a_{i-1};d_i;θ_i\n1;-90;0;0.412;q1\n2;90;0;0.154;q2+10\n3;0;0.02;q3;-90\n',
        '│ aⱼ₋₁ │ ⍺ⱼ₋₁ │ θⱼ │ dⱼ │\n│0│-90°│q1│0.412│\n│0│90°│q2 + 10°│0.154│\n'
        '│0.02│0°│-90°│q3│\n└─',
        '$i$ & $\\alpha_{i-1}$ & $a_{i-1}$ & $d_i$ & $\\theta_i$ \\\\\n'
        '1 & $-90^\\circ$ & 0 & 0.412 & $\\theta_1$ \\\\\n2 & $90^\\circ$ & 0 & 0.154 & '
        '$\\theta_2 + 10^\\circ$ \\\\\n3 & 0 & 0.02 & $d_3$ & $-90^\\circ$ \\\\',
        "L(1)=Link([0 0.412 0 -pi/2],'modified'); L(2)=Link([0 0.154 0 pi/2 0 pi/18],'modified');"
        "L(3)=Link([-pi/2 0 0.02 0 1], 'modified');",
        'RevoluteMDH(d=0.412,alpha=-pi/2), RevoluteMDH(d=0.154,alpha=pi/2,offset=pi/18),\n'
        'PrismaticMDH(theta=-pi/2, a=0.02)',
    ],
)
def test_the_convention_of_craig_is_told_by_indices_and_calls(text):
    robot, notes = read(text)
    assert robot.convention == 'modified'
    same(robot, ks.robot_from_text(CRAIG))
    assert 'assumed-convention' not in notes
    code, message = fault(text, convention='standard')
    assert code == 'conflict'
    assert 'modified' in message


def test_a_joint_may_turn_the_other_way_round():
    robot, _ = read('RevoluteDH(a=1, flip=True, offset=pi/2), PrismaticDH(a=2, flip=True)')
    assert ks.forward_kinematics(robot, [0.1, 0.4]) == pytest.approx(
        ks.forward_kinematics(read(f'{HEAD}1,0,0,pi/2 - q1\n2,0,-q2,0\n')[0], [0.1, 0.4])
    )


def test_what_is_assumed_is_said():
    _, notes = read('a,alpha,d,theta\n1,0,0,q1\n1,0,0,q2\n')
    # For a person to read.
    assert list(notes.values()) == [
        'the standard convention is assumed (--convention modified is that of Craig)',
        'angles are read in rad (--units changes it)\nlengths are read in m (--units changes it)',
        'the columns are read as a, alpha, d, theta',
    ]
    text, given = 'a,alpha,d,theta,mass\n100,90,0,q1,3\n', ['deg', 'mm']
    _, notes = read(text, units=given, convention='standard')
    assert list(notes) == ['left-out', 'columns']
    assert "'mass'" in notes['left-out']
    assert notes['columns'].endswith('a, alpha, d, theta, -')
    assert 'row 2 is moved by q1' in read(f'{HEAD}1,0,0,q1\n1,0,0,q1\n')[1]['coupled-row']
    assert 'line 1: theta' in read('Link([pi/2 0 1 0])')[1]['left-out']


def test_a_row_without_a_variable_beside_others_is_said_to_be_fixed():
    robot, notes = read(f'{HEAD}1,0,0,q1\n1,0,0,2\n1,0,0,q2\n')
    assert robot.dof == 2
    assert 'row 2' in notes['fixed-row']
    # Bars at the ends of some lines alone move no column.
    same(read(FORMS['markdown'].replace('| joint', 'joint', 1))[0])


def test_titles_units_and_a_row_for_the_tool():
    table = lines(
        'Table 3.1,,,,\n,,,,\nlink,a_i,alpha_i,d_i,theta_i\n,(m),(deg),(m),(deg)',
        lambda i, a, al, d: f'{i},{a!r},{al},{d!r},q{i},,',
    )
    same(read(table)[0])
    text = 'joint,a,alpha,d,theta\n1,0,90,0,0\n2,0.5,0,0,0\ntool,0.1,0,0,0\n'
    robot, _ = read(text, units=['deg', 'm'])
    assert robot.dof == 2
    assert ks.forward_kinematics(robot, [0, 0])[0, 3] == pytest.approx(0.6, abs=ROUND_OFF)


def test_names_stand_for_what_they_are():
    robot, _ = read('joint,a,alpha,d,theta\nhip yaw,1,0,0,theta_1\nknee,1,0,0,theta2 - θ1\n')
    assert robot.joint_names == ('hip_yaw', 'knee')
    assert robot.variables == ('theta_1', 'theta2')
    # The first row has no name of its own, and must not take that of the second.
    robot, _ = read('type,a,alpha,d,theta\nR,1,0,0,\nR,1,0,0,q1\n')
    assert robot.variables == ('joint_q1', 'q1')
    # A name without a number is that of its row.
    for cell in ('theta', 'θ_i', 'q_i', 'θ*', '-', 'var'):
        robot, _ = read(f'a,alpha,d,theta\n1,0,0,{cell}\n1,0.5,0,{cell}\n')
        assert robot.variables == ('q1', 'q2'), cell
    robot, _ = read('a,alpha,d,theta\n1,0,0,θ_i + 90°\n1,0,0,θ_i\n')
    same(robot, read('a,alpha,d,theta\n1,0,0,q1 + 90°\n1,0,0,q2\n')[0])


def test_many_rows():
    rows = '\n'.join(f'0.1,{90 if i % 2 else -90},0,q{i}' for i in range(1, 41))
    robot, _ = read(f'a,alpha,d,theta\n{rows}\n')
    assert robot.dof == 40


HEAD = 'a,alpha,d,theta\n'


@pytest.mark.parametrize(
    ('text', 'place', 'word'),
    [
        ('', (0, '', 'missing-heads'), ''),
        ('1,2,3,4\n', (0, '', 'missing-heads'), ''),
        (HEAD, (0, '', 'empty'), ''),
        ('a,alpha,theta\n1,0,q1\n', (0, '', 'missing-heads'), ''),
        ('a,a_i,alpha,d\n1,1,0,q1\n', (0, '', 'ambiguous'), ''),
        (f'{HEAD}1,0,0,q1\n1,0,q2\n', (3, 'row 2', 'wrong-length'), '3'),
        (f'{HEAD}0,4,0,0,2,q1\n', (2, 'row 1', 'wrong-length'), '6'),
        (f'{HEAD}1,,0,q1\n', (2, 'row 1, column alpha', 'empty'), '0'),
        (f'{HEAD}1,0,0,q1\n1,0,0,\n', (3, 'row 2, column theta', 'empty'), ''),
        (f'{HEAD}1,0,0,q1\n1,0,,0\n', (3, 'row 2, column d', 'empty'), ''),
        (f'{HEAD}1,0,,q1\n', (2, 'row 1, column d', 'empty'), '0'),
        (f'{HEAD}1,0,0,q1 + q7\n', (2, 'row 1, column theta', 'ambiguous'), 'q1'),
        (f'{HEAD}1,0,0,q1\n1,0,0,2\n1,0,0,q3\n',
         (3, 'row 2, column theta', 'missing-variable'), '2'),
        (f'{HEAD}1,90°,90°,q1\n', (2, 'row 1, column d', 'wrong-unit'), "'90°'"),
        (f'{HEAD}1,0,q1,q1\n', (2, 'row 1, column d', 'wrong-joint-type'), "'q1'"),
        (f'type,{HEAD}X,1,0,0,0\n', (2, 'row 1, column type', 'unknown-name'), "'X'"),
        (f'offset,{HEAD}5,1,0,0,q1+3\n', (2, 'row 1, column offset', 'conflict'), ''),
        ('a;alpha;d;theta\n1,5;0;0.2;q1\n', (2, 'row 1, column a', 'decimal-comma'), "'1,5'"),
        ('a\talpha\td\ttheta\n1,250\t0\t0\tq1\n',
         (2, 'row 1, column a', 'decimal-comma'), "'1,250'"),
        (f'{HEAD[:-1]},range\n1,0,0,q1,160\n', (2, 'row 1, column limits', 'wrong-length'), ''),
        (f'{HEAD[:-1]},range\n1,0,0,q1,3..-3\n', (2, 'row 1, column limits', 'wrong-order'), ''),
        ('a & alpha & d & theta \\\\\n\\multirow{2}{*}{1} & 0 & 0 & q1 \\\\\n & 0 & 0 & q2 \\\\',
         (3, 'row 2, column a', 'empty'), '0'),
        ("Link([0 1 0 0]); Link([0 1 0 0], 'modified')", (0, '', 'conflict'), ''),
        ("L1=Link('d',1); L2.offset = pi/2;", (0, '', 'unknown-name'), 'L2.offset'),
        ("L1=Link('d',1); L2=Link('d',2); R=SerialLink([L2 L1])", (0, '', 'wrong-order'), ''),
        ("L(2)=Link('d',1); L(1)=Link('d',2);", (0, '', 'wrong-order'), ''),
        ("for i=1:3 L(i)=Link('d',0,'a',1); end", (0, '', 'unsupported'), ''),
        ('DHRobot([RevoluteDH(a=1) for _ in range(3)])', (0, '', 'unsupported'), ''),
        ("L(1)=Link('d',1); L(3)=Link('d',2);", (0, '', 'wrong-order'), ''),
        ('Link([0 1 0])', (1, '', 'wrong-length'), '3'),
        ('Link([0 1 0 0 0 0 7])', (1, '', 'wrong-length'), '7'),
        ('RevoluteDH(d=1, alhpa=2)', (1, '', 'syntax'), "'alhpa'"),
        ('RevoluteDH(d=1), RevoluteDH(a=2', (0, '', 'syntax'), ''),
        ('RevoluteDH(d=1), RevolutDH(d=2, alpha=2)', (0, '', 'syntax'), ''),
        ('RevoluteDH(0, 0.4)', (1, '', 'syntax'), "'0, 0.4'"),
        ("A=SerialLink(Link('d',1)); B=SerialLink(Link('d',2))", (0, '', 'several-tables'), ''),
        (f'{HEAD}1,0,0,"q1\n1,0,0,q2\n', (3, 'row 1, column theta', 'ambiguous'), '1'),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_named(text, place, word):
    error = faults(text)
    assert places(error) == [place]
    assert word in error.faults[0].message


def test_units_that_are_given_must_agree_with_the_heads():
    text = 'a [mm],alpha [deg],d [mm],theta\n100,90,0,q1\n'
    code, message = fault(text, units=['m'])
    assert code == 'conflict'
    assert 'm and in mm' in message
    robot, _ = read(text, units=['mm', 'deg'])
    assert robot.description.length_unit == 'mm'


def test_the_command_writes_and_checks(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'dh.csv').write_bytes(b'\xef\xbb\xbf' + FORMS['csv'].encode())
    assert main(['new', 'puma', '--table', 'dh.csv']) == 0
    out, err = capsys.readouterr()
    assert out.startswith('wrote puma.yaml\npuma (puma.yaml)\n')
    assert re.search(r'\n  1 +0.0 +90 +0.6718\d* +q1\n', out)
    assert 'dh.csv: the standard convention' in err
    same(ks.load_robot('puma.yaml'))
    (tmp_path / 'dh.txt').write_bytes(FORMS['csv'].encode('utf-16'))
    assert main(['new', 'puma', '--table', 'dh.txt', '--out', '-', '--units', 'deg,m']) == 0
    same(ks.robot_from_text(capsys.readouterr().out))
    pasted = FORMS['matlab vectors'].encode()
    monkeypatch.setattr('sys.stdin', io.TextIOWrapper(io.BytesIO(pasted)))
    assert main(['new', 'puma', '--table', '-', '--out', '-']) == 0
    out, err = capsys.readouterr()
    same(ks.robot_from_text(out))
    assert err == '<stdin>: lengths are read in m (--units changes it)\n'


@pytest.mark.parametrize(
    ('argv', 'words', 'code'),
    [
        (['--table', 'none.csv'], ('none.csv', 'No such file'), 2),
        (['--table', 'a.csv', '--columns', ''], ('a.csv: no column', '--columns'), 1),
        (['--table', 'a.csv', '--dof', '3'], ('--table', '--dof'), 2),
        (['--columns', 'a,d'], ('--columns', '--table'), 2),
        (['--table', 'a.csv', '--convention', 'shape'], ('--convention', 'shape'), 2),
        (['--table', 'a.csv', '--columns', 'a,alpha,d,theta'], ('a.csv:2: row 2, column a',), 1),
        (['--table', 'b.csv'], ('b.csv:1', 'UTF-8'), 2),
    ],
)
def test_the_command_refuses_in_a_sentence(tmp_path, monkeypatch, capsys, argv, words, code):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'a.csv').write_text('1,0,0,q1\n,0,0,q2\n')
    (tmp_path / 'b.csv').write_bytes(b'a,\xe1')
    assert main(['new', 'arm', *argv]) == code
    err = capsys.readouterr().err
    assert all(word in err for word in words)
    assert not (tmp_path / 'arm.yaml').exists()
