# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Tables in the styles of programs, documents and books: each is read as the same arm."""

import math
from string import Template

import numpy as np
import pytest
from refusal import places

import kinematics_service as ks
from kinematics_service.errors import RobotFileError
from kinematics_service.robot.tables.robot_table import read_table

ROUND_OFF = 1e-12  # m and rad; a few rotations of an arm of a metre
# (a, alpha in degrees, d, offset in degrees) of an arm without symmetry, m.
ROWS = ((0.12, 90, 0.4, 0), (0.35, 0, 0.05, -90), (0.2, -90, 0, 30), (0, 45, 0.1, 180))
Q = np.random.default_rng(41).uniform(-2.0, 2.0, (3, 4))


def turn(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    i, j = {'x': (1, 2), 'z': (0, 1)}[axis]
    T = np.eye(4)
    T[i, i], T[i, j], T[j, i], T[j, j] = c, -s, s, c
    return T


def shift(x=0.0, z=0.0):
    T = np.eye(4)
    T[0, 3], T[2, 3] = x, z
    return T


def product(rows, q, modified=False):
    """Return the pose of a table, multiplied here."""
    T = np.eye(4)
    for (a, alpha, d, offset), angle in zip(rows, q):
        along_x = turn('x', math.radians(alpha)) @ shift(x=a)
        along_z = turn('z', angle + math.radians(offset)) @ shift(z=d)
        T = T @ (along_x @ along_z if modified else along_z @ along_x)
    return T


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


def same(robot, modified=False, rows=ROWS):
    assert robot.dof == len(rows)
    assert robot.convention == ('modified' if modified else 'standard')
    for q in Q:
        right = product(rows, q, modified)
        assert np.abs(ks.forward_kinematics(robot, q[: robot.dof]) - right).max() < ROUND_OFF


def pi(angle, sign=''):
    """Return degrees as a part of pi: -pi/2, pi/6."""
    over = {30: 'pi/6', 45: 'pi/4', 90: 'pi/2', 180: 'pi', 0: '0'}
    return ('-' if angle < 0 else sign) + over[abs(angle)]


def plus(name, offset):
    if offset == '0':
        return name
    return f'{name} - {offset[1:]}' if offset[0] == '-' else f'{name} + {offset}'


def fields(i, a, alpha, d, offset):
    """Return the numbers of a row in the ways that people write them."""
    return {
        'i': i, 'k': i - 1, 'a': a, 'd': d, 'al': alpha, 'o': offset,
        'mma': f'{1000 * a:g}', 'mmd': f'{1000 * d:g}', 'cma': f'{100 * a:g}',
        'cmd': f'{100 * d:g}', 'pa': pi(alpha), 'po': pi(offset), 'ra': math.radians(alpha),
        'ro': math.radians(offset), 'sum': plus(f'q{i}', pi(offset)), 'p': pi(offset, sign='+'),
        'star': f'{"−" if offset < 0 else "+"} {abs(offset)}°',
    }  # fmt: skip


def written(row, head='', end='', between='\n', word='pi', rows=ROWS):
    """Return a text with a line for each row; `word` is what the text calls pi."""
    made = [Template(row).substitute(fields(i, *values)) for i, values in enumerate(rows, 1)]
    return f'{head}{between.join(made).replace("pi", word)}{end}'


def column(name, word='pi', between=', '):
    return between.join(written(f'${name}', word=word).split('\n'))


ADT, TDA = {'columns': 'a,alpha,d,theta'}, {'columns': 'theta,d,a,alpha'}
RULE = '|---|---|---|---|\n'
STYLES = {
    'tuples of math': (
        written('    ($a, $pa, $d, $po),  # J$i', 'DH = [\n', '\n]\n', word='math.pi'),
        ADT,
    ),
    'rows of numpy': (
        written('[$po, $d, $a, $pa]', 'dh = np.array([', '])', ',\n   ', 'np.pi'),
        TDA,
    ),
    'a matrix of sympy': (
        written('[$sum, $d, $a, $pa]', "q1, q2 = sp.symbols('q1:3')\nDH = sp.Matrix([", '])',
                ', ', 'sp.pi'),
        TDA,
    ),
    'an array of C': (
        written('    {${a}f, $pa, ${d}f, $po}, // axis $i',
                '#include <math.h>\nstatic const double dh[4][4] = {\n', '\n};', word='M_PI'),
        ADT,
    ),
    'the constants of C': (
        written('{$a, $pa, $d, $po}', 'float t[][4] = {', '};', ',').replace('pi/', 'M_PI_')
        .replace('M_PI_6', 'M_PI/6').replace(' pi', ' M_PI'),
        ADT,
    ),
    'a matrix of MATLAB with comments': (
        written('  $a  $pa  $d  q($i)$p;  % joint $i', 'syms q1 q2\n% the arm\ndh = [\n', '\n];'),
        ADT,
    ),
    'a matrix of MATLAB with operators between blanks': (
        written('$a, $pa, $d, $sum', 'DH = [', '];', ';\n'),
        ADT,
    ),
    'rows of a matrix by lines': (written('\t$a\t$pa\t$d\t$po', 'dh = [', '];'), ADT),
    'heads in a comment': (
        written('[$po, $d, $a, $pa],', '# theta, d, a, alpha for each link\ndh = [\n', '\n]'),
        {},
    ),
    'heads behind the mark of a comment': (written('$a $pa $d $po', '# a alpha d theta\n'), {}),
    'remarks behind rows': (
        written('$a,$pa,$d,$po  # link $i', 'a,alpha,d,theta\n# from the drawing\n'),
        {},
    ),
    'deg2rad': (
        written('$a,np.deg2rad($al),$d,math.radians($o)', 'a,alpha,d,theta\n'),
        {},
    ),
    'factors that turn degrees': (
        written('[$a, $al*D2R, $d, $o * D2R]', 'dh = [', ']', ',\n'),
        ADT,
    ),
    'words for degrees': (
        written('| $a | $al deg | $d | $o degrees |', f'| a | alpha | d | theta |\n{RULE}'),
        {},
    ),
    'millimetres in cells': (written('$mma mm;$pa rad;$mmd mm;$po rad', 'a;alpha;d;theta\n'), {}),
    'metres in cells': (written('$a m\t$al°\t$d m\t$o°', 'a\talpha\td\ttheta\n'), {}),
    'centimetres in the heads': (
        written('$cma,$al,$cmd,$o', 'a (cm),alpha (deg),d (cm),theta (deg)\n'),
        {},
    ),
    'each column in its unit': (
        written('$a,$al,$mmd,$po', 'a [m],alpha [deg],d [mm],theta [rad]\n'),
        {},
    ),
    'parts of pi below a head in degrees': (
        written('$a,$pa,$d,$o', 'a,alpha (deg),d,theta (deg)\n'),
        {},
    ),
    'columns by blanks, with sums': (
        written('$i  $a  $pa  $d  $sum', 'Link  a  alpha  d  theta\n'),
        {},
    ),
    'one blank between, with sums': (written('$i $a $pa $d $sum', 'i a alpha d theta\n'), {}),
    'a heavy box': (
        written('│ $i │ $a │ $al° │ $d │ $o° │',
                '┏━━━┳━━━┳━━━┳━━━┳━━━┓\n┃ # ┃ a ┃ α ┃ d ┃ θ ┃\n┡━━━╇━━━╇━━━╇━━━╇━━━┩\n',
                '\n└───┴───┴───┴───┴───┘'),
        {},
    ),
    'a double box': (
        written('║ $a ║ $al° ║ $d ║ $o° ║', '╔═══╦═══╦═══╦═══╗\n║ a ║ α ║ d ║ θ ║\n╠═══╬═══╣\n',
                '\n╚═══╩═══╩═══╩═══╝'),
        {},
    ),
    'a frame of pandas': (written('$k  $a  $ra  $d  $ro', '      a   alpha    d   theta\n'), {}),
    'a frame of pandas with names': (
        written('axis$i  $a  $ra  $d  $ro', '      a     alpha     d     theta\n'),
        {},
    ),
    'a frame of pandas in Markdown': (
        written('|  $k | $a | $al | $d | $o |', f'|    |   a | alpha |   d | theta |\n|--:{RULE}'),
        {},
    ),
    'dictionaries': (
        written("    {'a': $a, 'alpha': $pa, 'd': $d, 'theta': $po},", 'links = [\n', '\n]\n',
                word='np.pi'),
        {},
    ),
    'calls of dict': (
        written('dict(alpha=$pa, a=$a, d=$d, offset=$po)', 'DH = [', ']', ',\n'),
        {},
    ),
    'attributes of a struct': (
        written('arm($i).a = $a; arm($i).alpha = $pa; arm($i).d = $d; arm($i).theta = $po;'),
        {},
    ),
    'vectors of MATLAB': (
        f'a = [{column("a", between=" ")}];\nalpha = [{column("pa", between=" ")}];\n'
        f'd = [{column("d", between=" ")}];\noffset = [{column("po", between=" ")}];',
        {},
    ),
    'vectors of Python': (
        f'alpha = [{column("pa", "math.pi")}]  # twists\na = [{column("a")}]\n'
        f'd = [{column("d")}]\ntheta = [{column("po", "math.pi")}]',
        {},
    ),
    'YAML with a mapping a row': (
        written('  - {a: $a, alpha: $pa, d: $d, theta: $po}', 'dh:\n'),
        {},
    ),
    'YAML in blocks': (
        written('  - a: $a\n    alpha: $pa\n    d: $d\n    theta: $po', 'dh_parameters:\n'),
        {},
    ),
    'YAML by joint': (written('joint_$i:\n  d: $d\n  a: $a\n  alpha: $pa\n  offset: $po'), {}),
    'YAML by columns': (
        ''.join(f'{name}:\n  - {column(field, between=f"{chr(10)}  - ")}\n'
                for name, field in (('a', 'a'), ('alpha', 'pa'), ('d', 'd'), ('theta', 'po'))),
        {},
    ),
    'YAML with a list a row': (written('  - [$a, $pa, $d, $po]', 'dh:\n'), ADT),
    'JSON with an object a row': (
        written('{"name": "joint_$i", "theta": $ro, "d": $d, "a": $a, "alpha": $ra}',
                '{"robot": "arm", "links": [', ']}', ',\n'),
        {},
    ),
    'JSON by columns': (
        f'{{"a": [{column("a")}], "d": [{column("d")}], "alpha": [{column("ra")}], '
        f'"theta": [{column("ro")}]}}',
        {},
    ),
    'JSON with an array a row': (written('[$a, $ra, $d, $ro]', '{"dh": [', ']}', ', '), ADT),
    'TOML with a table a row': (
        written('[[joint]]\na = $a\nalpha = $ra\nd = $d\ntheta = $ro\n', 'title = "arm"\n'),
        {},
    ),
    'TOML by columns': (
        f'[dh]\nalpha = [{column("ra")}]\na = [{column("a")}]\nd = [{column("d")}]\n'
        f'theta = [{column("ro")}]',
        {},
    ),
    'TOML with an array a row': (written('  [$a, $ra, $d, $ro],', '[arm]\ndh = [\n', '\n]'), ADT),
    'a table of HTML': (
        written('<tr><td>$i</td><td>$a</td><td>$al&deg;</td><td>$d</td>'
                '<td>&theta;<sub>$i</sub> + ($o&deg;)</td></tr>',
                '<table>\n<tr><th>i</th><th>a</th><th>&alpha;</th><th>d</th>'
                '<th>&theta;</th></tr>\n', '\n</table>'),
        {},
    ),
    'functions of time': (
        written('$a,$pa,$d,$sum', 'a,alpha,d,theta\n').replace('q', 'theta_')
        .replace('theta_1', 'theta_1(t)').replace('theta_2', 'theta_2(t)'),
        {},
    ),
    'indices in tags': (
        written('| $a | $pa | $d | q<sub>$i</sub> $p |',
                f'| a<sub>i</sub> | α<sub>i</sub> | d<sub>i</sub> | θ<sub>i</sub> |\n{RULE}',
                word='PI'),
        {},
    ),
    'stars of a book': (written('$i\t$a\t$al°\t$d\tθ$i* $star', 'Link\ta\tα\td\tθ\n'), {}),
    'stars of LaTeX': (
        written(r'$i & $a & $$$pa$$ & $d & $$\theta_$i^* $star$$ \\',
                'Link & $a_i$ & $\\alpha_i$ & $d_i$ & $\\theta_i$ \\\\\n', word=r'\pi')
        .replace(r'\pi/2', r'\frac\pi2').replace(r'\pi/4', r'\frac{\pi}{4}')
        .replace('°', r'^\circ'),
        {},
    ),
    'words for heads': (
        written('| $i | $sum | $d | $a | $pa |', '| Joint No. | Joint angle θ (rad) | '
                f'Link offset d (m) | Link length a (m) | Link twist α (rad) |\n|---{RULE}'),
        {},
    ),
    'a script of the toolbox with offsets of its robot': (
        written("L($i) = Link('d', $d, 'a', $a, 'alpha', $pa);",
                end="\nR = SerialLink(L, 'name', 'arm');\n"
                f'R.offset = [{column("po", between=" ")}];'),
        {},
    ),
    'a matrix of the toolbox': (
        written('0 $d $a $pa 0 $po', 'robot = SerialLink([', "], 'name', 'arm')", '; '),
        {},
    ),
    'a matrix of the toolbox by its name': (
        written('  0, $d, $a, $pa', 'clc; clear;\nmdl = [\n',
                f"\n];\nr = SerialLink(mdl, 'offset', [{column('po', between=' ')}]);", ';\n'),
        {},
    ),
    'values above the table': (
        written('a$i,$pa,d$i,$po', 'a1, a2, a3, a4 = 0.12, 0.35, 0.2, 0\n'
                'd1 = 0.4; d2 = 0.05; d3 = 0; d4 = 0.1\n\na,alpha,d,theta\n'),
        {},
    ),
    'elements of a vector': (
        written('[$pa, length[$k], $d, $po]', 'length = [0.12, 0.35, 0.2, 0]\ndh = [', ']', ',\n'),
        {'columns': 'alpha,a,d,theta'},
    ),
}  # fmt: skip


@pytest.mark.parametrize('style', STYLES)
def test_each_style_is_the_same_arm(style):
    text, options = STYLES[style]
    robot, _ = read(text, **options)
    same(robot)


KHALIL = ((0.0, 0, 0.3, 0), (0.12, 90, 0, 0), (0.4, 0, 0.05, 0), (0, -90, 0.35, 90))


@pytest.mark.parametrize(
    'head',
    [
        'j;σj;αj;dj;θj;rj',
        'j;ant;sigma;gamma;b;alpha;d;theta;r',
        'j;a(j);μj;σj;γj;bj;αj;dj;θj;rj',
        'j;alpha(i);d(i-1);theta(i);r(i)',
    ],
)
def test_khalil_writes_d_along_x(head):
    names = [word.strip('j(i-1)') or 'j' for word in head.split(';')]
    own = {'ant': 'a', 'σ': 'sigma', 'γ': 'gamma', 'α': 'alpha', 'θ': 'theta', 'μ': 'mu'}
    names = [own.get(name, name) for name in names]
    text = f'{head}\n'
    for i, (d, alpha, r, offset) in enumerate(KHALIL, 1):
        cells = {
            'j': i,
            'a': i - 1,
            'alpha': pi(alpha),
            'd': d,
            'r': r,
            'theta': plus(f'q{i}', pi(offset)),
        }
        text += ';'.join(str(cells.get(name, 0)) for name in names) + '\n'
    robot, notes = read(text)
    same(robot, modified=True, rows=KHALIL)
    assert 'khalil' in notes
    code, message = fault(text, convention='standard')
    assert code == 'conflict'
    assert 'modified' in message


def test_khalil_beside_others_is_asked_for_and_branches_are_refused():
    code, told = fault('θ,d,r,α\nq1,0.1,0,90\nq2,0,0.3,0\n')
    assert code == 'ambiguous'
    for way in ('--columns theta,a,d,alpha --convention modified', '--columns theta,d,a,alpha'):
        assert way in told
        columns = way.split()[1]
        read('θ,d,r,α\nq1,0.1,0,90\nq2,0,0.3,0\n', columns=columns)
    tree = 'j,ant,sigma,gamma,b,alpha,d,theta,r\n1,0,0,0,0,0,0,t1,1\n'
    tree += '2,1,0,0,0,0,1,t2,0\n3,1,0,0,0,0,1,t3,0\n'
    code, message = fault(tree)
    assert code == 'branches'
    assert '0, 1, 1' in message
    code, message = fault(tree.replace('3,1,0,0', '3,2,0,0.5'))
    assert code == 'branches'
    assert 'gamma' in message


@pytest.mark.parametrize(
    ('text', 'both'),
    [
        ('a,alpha,d,theta\n0,90,0.4,q1\n0.3,0,0,q2-pi/2\n', ('90 and q2-pi/2', 'deg', 'rad')),
        ('a,alpha,d,theta\n0,90,0.4,q1\n0.3,0,0,q2+1.5708\n', ('90 and 1.5708', 'deg', 'rad')),
        ('a,alpha,d,theta\n0,90°,0.4,q1\n0.3,0,0,q2+5\n', ('5 and 90°', 'deg', 'rad')),
        ('a,alpha,d,theta\n0,0,400 mm,q1\n0.3,0,0,q2\n', ('0.3 and 400 mm', 'm', 'mm')),
    ],
)  # fmt: skip
def test_numbers_of_two_units_are_refused_with_what_to_type(text, both):
    numbers, *units = both
    code, told = fault(text)
    assert code == 'ambiguous'
    assert numbers in told
    for unit in units:
        assert f'--units {unit}' in told
        read(text, units=[unit])


def test_plain_degrees_beside_parts_of_pi_are_read_as_told():
    text = 'a,alpha,d,theta\n0,90,0.4,q1\n0.3,0,0,q2 - pi/2\n'
    right = ((0, 90, 0.4, 0), (0.3, 0, 0, -90))
    same(read(text, units=['deg'])[0], rows=right)
    same(read(text.replace('90', '90°'))[0], rows=right)


HEAD = 'a,alpha,d,theta\n'
OBJECT = '{"a": 0, "alpha": 1, "d": 2}'
PAIRS = 'a = 0\nalpha = 1\nd = 1\n'
VECTORS = '{"a": [0, 1], "alpha": [1, 0], "d": [1, 2]}'
LINKS = "L(1)=Link('d',1);L(2)=Link('a',1);"


@pytest.mark.parametrize(
    ('text', 'place', 'word'),
    [
        (f'{HEAD}0,pi/2,0.4,q1\n0.3,0,0,q1\n0.2,0,0,q3\n',
         (3, 'row 2, column theta', 'duplicate-name'), 'q1'),
        (f'{HEAD}0,pi/2,q1,0.4\n0.3,0,q2,0\n',
         (2, 'row 1, column theta', 'wrong-column'), '0.4'),
        (f'{HEAD}9**9**9,0,0,q1\n', (2, 'row 1, column a', 'syntax'), "'**'"),
        (f'{HEAD}nan,0,0,q1\n', (0, 'constants.nan', 'reserved-name'), "'nan'"),
        (f"{HEAD}__import__('os'),0,0,q1\n", (2, 'row 1, column a', 'syntax'), ''),
        (f'{HEAD}290,0,1.5707963267948966,0\n0,270,0,90\n',
         (2, 'row 1, column d', 'wrong-column'), '1.5707963267948966'),
        (f'{HEAD}0.3,0,pi/2,0\n0,0.2,0,0\n', (2, 'row 1, column d', 'wrong-column'), 'pi/2'),
        (HEAD * 5000, (0, '', 'too-large'), ''),
        (f'{HEAD}θ1,0,0,0.3\n', (2, 'row 1, column a', 'wrong-column'), 'theta1'),
        ('theta,alpha,a,d\nd1,90,0,q1\n', (2, 'row 1, column theta', 'wrong-column'), 'd1'),
        (f'{HEAD}0,90,0.4,q1\n0.3,0,0,q2*-1\n',
         (3, 'row 2, column theta', 'ambiguous'), 'q2*-1'),
        (f'{HEAD}0,0,1,0\n1,90,0,q2-90\n1,0,0,0\n1,0,0,0\n',
         (2, 'row 1, column theta', 'missing-variable'), '0'),
        (f'{HEAD}0,90,d1,q1\na2,0,0,q2\n0,0,d3,0\n', (4, 'row 3, column d', 'ambiguous'), 'd3'),
        (f'{HEAD}0,90,1,q1\n{HEAD}1,0,0,q1\n', (0, '', 'several-tables'), ''),
        ('A = [0 0 1 0; 1 0 0 0];\nB = [0 0 1 0; 1 0 0 1];', (0, '', 'several-tables'), '1'),
        (f'{{"left": [{OBJECT}, {OBJECT}],\n"right": [{OBJECT}]}}',
         (0, '', 'several-tables'), ''),
        (f'left:\n  - {OBJECT}\n  - {OBJECT}\nright:\n  - {OBJECT}\n',
         (0, '', 'several-tables'), ''),
        (f'[[left]]\n{PAIRS}[[left]]\n{PAIRS}[[right]]\n{PAIRS}', (0, '', 'several-tables'), ''),
        (f'{{"ur5": {VECTORS}, "ur10": {VECTORS}}}', (0, '', 'several-tables'), ''),
        ('{alpha0: 0, a0: 0, d1: 1, alpha1: 1, a1: 0, d2: 0, d1: 2}',
         (0, '', 'several-tables'), ''),
        ('a = [0 1];\nalpha = [pi/2 0 0];\nd = [1 0];', (0, '', 'wrong-length'), '2'),
        ('dh:\n  - {a: 0, alpha: 1, d: 2}\n  - {a: 1, d: 0}\n',
         (3, 'row 2, column alpha', 'empty'), ''),
        (f"{LINKS}R=SerialLink(L,'offset',[0 pi/2 0]);", (0, '', 'wrong-length'), '3'),
        (f'{LINKS}R=SerialLink(L);R.tool=trotx(1)*transl(0,0,1);',
         (0, '', 'syntax'), "'trotx(1)*transl(0,0,1)'"),
    ],
)  # fmt: skip
def test_what_may_be_another_arm_is_refused(text, place, word):
    error = faults(text)
    assert place in places(error)
    assert word in str(error)


def test_substitutions_have_indices_of_two_digits():
    pairs = ', '.join(f'alpha{k}: 0, a{k}: 1, d{k + 1}: 0' for k in range(11))
    robot, _ = read(f'{{{pairs}}}')
    assert robot.dof == 11
    assert ks.forward_kinematics(robot, np.zeros(11))[0, 3] == 11.0


def test_substitutions_have_the_indices_of_the_book():
    craig = ', '.join(
        f'alpha{i}: {pi(alpha)}, a{i}: {a}, d{i + 1}: {d}'
        + (f', q{i + 1}: {plus(f"q{i + 1}", pi(offset))}' if offset else '')
        for i, (a, alpha, d, offset) in enumerate(ROWS)
    )
    same(read(f's = {{{craig}}}')[0], modified=True)
    classical = '\n'.join(
        f'alpha{i} = {pi(alpha)}\na{i} = {a}\nd{i} = {d}\n'
        f'theta{i} = {plus(f"theta{i}", pi(offset))}'
        for i, (a, alpha, d, offset) in enumerate(ROWS, 1)
    )
    same(read(classical)[0])


def test_given_columns_keep_units_and_indices_of_the_heads():
    text = 'i | alpha(i-1) | len (mm) | offset (mm) | angle\n---|---|---|---|---\n'
    text += written('$i|$al°|$mma|$mmd|q$i + ($o°)')
    robot, notes = read(text, columns='joint,alpha,a,d,theta')
    same(robot, modified=True)
    assert notes['columns'].endswith('joint, alpha(i-1), a [mm], d [mm], theta')


def test_a_title_tells_the_convention():
    table = written('$a,$al°,$d,$o°', 'a,alpha,d,theta\n')
    same(read(f'Table 3: modified DH parameters\n{table}')[0], modified=True)
    _, notes = read(f'Modified or standard\n{table}')
    assert 'standard' in notes['assumed-convention']


BOX = """\
DHRobot: arm, 4 joints (RRRR), dynamics, standard DH parameters
┌────┬────┬────┬────┐
│ θⱼ │ dⱼ │ aⱼ │ ⍺ⱼ │
├────┼────┼────┼────┤
{rows}
└────┴────┴────┴────┘

┌──────┬────────────┐
│ base │ {base} │
│ tool │ {tool} │
└──────┴────────────┘

┌──────┬─────┬─────┐
│ name │ q0  │ q1  │
├──────┼─────┼─────┤
│ qz   │ 0°  │ 0°  │
└──────┴─────┴─────┘
"""


def boxed(base='', tool=''):
    rows = written('│ q$i + ($o°) │ $d │ $a │ $al° │')
    return BOX.format(rows=rows, base=base, tool=tool)


def test_base_and_tool_of_a_printed_robot_are_read():
    robot, notes = read(
        boxed('t = 1, 0, -0.5; rpy/xyz = 0°, 0°, 0°', 't = 0, 0, 0.2; rpy/xyz = 0°, 0°, 90°')
    )
    for q in Q:
        right = shift(x=1, z=-0.5) @ product(ROWS, q) @ shift(z=0.2) @ turn('x', math.pi / 2)
        assert np.abs(ks.forward_kinematics(robot, q) - right).max() < ROUND_OFF
    assert 'tool' in notes['printed-digits']
    assert 'assumed-convention' not in notes
    same(read(boxed())[0])
    for angle in ('10°', 'beta'):
        code, message = fault(boxed(f't = 1, 0, 0; rpy/xyz = {angle}, 0°, 90°'))
        assert code == 'unsupported'
        assert 'base' in message
    same(read(boxed(tool='t = 0, 0, 0; rpy/xyz = 0.00000°, -0°, °'))[0])
    ascii_box = boxed(tool='t = 0, 0, 0.2; rpy/xyz = 0°, 0°, 0°').translate(
        str.maketrans('┌┬┐├┼┤└┴┘─', '+++++++++-')
    )
    assert (
        read(
            ascii_box.partition('\n+------+-----')[0]
            + '\n| tool | t = 0, 0, 0.2; rpy/xyz = 0°, 0°, 0° |\n'
        )[0].description.tool.motion.matrix[2, 3]
        == 0.2
    )


@pytest.mark.parametrize(
    'script',
    [
        '{links}\nR = SerialLink(L);\nR.base = transl(1, 0, -0.5);\n'
        'R.tool = transl([0 0 h])*trotx(pi/2);',
        "{links}\nR = SerialLink(L, 'name', 'arm', 'base', transl(1,0,-0.5), 'tool', "
        "transl(0, 0, 0.2)*trotx(90, 'deg'));",
        "r = DHRobot({calls}, name='arm', tool=SE3(0, 0, h) * SE3.Rx(np.pi/2), "
        'base=SE3.Tx(1) * SE3.Tz(-0.5))',
        'class Arm(DHRobot):\n  def __init__(self):\n    L = {calls}\n    super().__init__(L, '
        "name='arm', tool=SE3.Tz(h) @ SE3.Rx(90, unit='deg'), base=SE3(1, 0, -0.5))",
    ],
)  # fmt: skip
def test_base_and_tool_of_a_script_are_read(script):
    links = written("L($i) = Link('d', $d, 'a', $a, 'alpha', $pa, 'offset', $po);", 'h = 0.2;\n')
    calls = written('RevoluteDH(d=$d, a=$a, alpha=$pa, offset=$po)', '[', ']', ',\n')
    robot, _ = read('h = 0.2\n' * ('{calls}' in script) + script.format(links=links, calls=calls))
    for q in Q:
        right = shift(x=1, z=-0.5) @ product(ROWS, q) @ shift(z=0.2) @ turn('x', math.pi / 2)
        assert np.abs(ks.forward_kinematics(robot, q) - right).max() < ROUND_OFF


def test_what_is_dropped_is_named():
    _, notes = read("L(1)=Link('d',1);L(2)=Link('a',1);R=SerialLink(L);R.qlim=[-1 1;-2 2];")
    assert 'qlim' in notes['left-out']
    _, notes = read(
        'dh:\n  - {a: 0, alpha: 1, d: 2, mass: 3}\n  - {a: 1, alpha: 0, d: 0, mass: 4}\n'
    )
    assert 'mass' in notes['left-out']
    _, notes = read('q1 = 0.3\na,alpha,d,theta\n0,0,1,q1\n1,0,0,q2\n')
    assert 'q1' in notes['left-out']


def test_limits_have_their_own_heads_and_unit():
    for low, high in (
        ('min_theta', 'max_theta'),
        ('limit_min', 'limit_max'),
        ('lower limit', 'upper limit'),
        ('q_min', 'q_max'),
    ):
        robot, notes = read(
            f'a,alpha,d,theta,{low},{high}\n0,pi/2,1,q1,-170,170\n1,0,0,q2,-20,90\n'
        )
        assert robot.limits == pytest.approx(np.radians([[-170, 170], [-20, 90]]), rel=1e-15)
        assert 'limits are read in deg' in notes['assumed-unit']
    robot, _ = read(
        '{"j": [{"a": 0, "alpha": 0, "d": 1, "limits": [-1, 2]},'
        ' {"a": 1, "alpha": 0, "d": 0, "limits": [-3, 3]}]}'
    )
    assert robot.limits.tolist() == [[-1, 2], [-3, 3]]


def test_letters_without_a_value_become_constants():
    found = read_table(
        'i,a,alpha,d,theta\n1,0,90,d1,θ1\n2,a2,0,0,θ2+β\nEE,0,0,L_t,0\n', 'dh.txt', 'arm'
    )
    assert '\nconstants:\n  d1:\n  a2:\n  beta:\n  L_t:\n' in found.text
    (note,) = (note for note in found.doubts if note.code == 'no-value')
    assert 'd1, a2, beta, L_t' in note.message
    with pytest.raises(RobotFileError) as caught:
        ks.robot_from_text(found.text)
    assert places(caught.value) == [(0, 'constants', 'no-value')]
    assert 'd1, a2, beta, L_t' in str(caught.value)
    values = found.text
    for name, value in (('d1', 0.4), ('a2', 0.3), ('beta', 30), ('L_t', 0.1)):
        values = values.replace(f'  {name}:\n', f'  {name}: {value}\n')
    right = product(((0, 90, 0.4, 0), (0.3, 0, 0, 30)), (0.2, 0.7)) @ shift(z=0.1)
    found = ks.forward_kinematics(ks.robot_from_text(values), (0.2, 0.7))
    assert np.abs(found - right).max() < ROUND_OFF


def test_rounded_parts_of_pi_are_named_and_read_on_request():
    for digits in ('1.57', '1.571', '1.5708', '1.570796'):
        text = f'a,alpha,d,theta\n0,{digits},0.4,q1\n0.3,-{digits},0,q2+3.14\n'
        robot, notes = read(text)
        assert robot.description.links[0]['alpha'].text == digits
        assert digits in notes['rounded-pi']
        assert any(
            f'links[0].alpha: {digits} looks like pi/2' in one for one in robot.description.remarks
        )
        robot, notes = read(text, round_angles=True)
        same(robot, rows=((0, 90, 0.4, 0), (0.3, -90, 0, 180)))
    for exact in ('1.5707963267948966', '1.5712', '1.2'):
        robot, notes = read(f'a,alpha,d,theta\n0,{exact},0.4,q1\n')
        assert 'rounded-pi' not in notes
        assert not [one for one in robot.description.remarks if 'rounded' in one]
    robot, _ = read('a,alpha,d,theta\n0,29.999999999999996,1,q1\n', round_angles=True)
    assert robot.description.links[0]['alpha'].text == '30'


def test_heads_that_are_not_understood_are_no_row():
    table = written('$a,$pa,$d,$po', 'len,twi,off,ang\n')
    same(read(table, **ADT)[0])
    assert fault(table)[0] == 'missing-heads'


def test_given_columns_do_not_discard_base_tool_and_offsets_of_a_script():
    matrix = written('$po $d $a $pa', 'dh = [', '];\n', '; ')
    robot, _ = read(f'{matrix}R = SerialLink(dh);\nR.tool = transl(0, 0, 0.2);', **TDA)
    assert robot.description.tool.motion.matrix[2, 3] == 0.2
    same(read(f'{matrix}R = SerialLink(dh);\nR.tool = eye(4);', **TDA)[0])
    assert fault(f'{matrix}R.offset = [0 1 0 0];', **TDA)[0] == 'unsupported'


def test_words_of_a_text_that_contradict_its_numbers_are_refused():
    text = written('$a,$al,$d,$o', 'The arm has 4 degrees of freedom, angles in degrees.\n' + HEAD)
    robot, notes = read(text)
    same(robot)
    assert 'The arm' not in notes.get('left-out', '')  # it is above the heads
    for remark, row, numbers in (
        ('angles in degrees', '0,1.2,0.4,q1', '1.2 and degrees'),
        ('millimetres', '0,pi/2,0.4,q1', '0.4 and millimetres'),
    ):
        code, message = fault(f'# {remark}\n{HEAD}{row}\n')
        assert code == 'ambiguous'
        assert numbers in message
    _, notes = read(f'{HEAD}0,pi/2,0.4,q1\n0.3,0,0,q2\nThe hand follows it.\n')
    assert 'The hand' in notes['left-out']


def test_an_index_after_the_row_is_craigs():
    text = written('$i,$al,$a,$d,q$i + ($o°)', 'i,alpha_i,a_i,d_i+1,theta_i+1\n')
    same(read(text)[0], modified=True)
    same(read(text, columns='joint,alpha,a,d,theta')[0], modified=True)


BENT = ((0.0, 90, 0.4, 0), (0.35, 0, 0, 0), (0.3, -90, 0.05, 90))


@pytest.mark.parametrize(
    'text',
    [
        'robot = make(a=[0, 0.35, 0.3], alpha=[pi/2, 0, -pi/2], d=[0.4, 0, 0.05], '
        'theta=[0, 0, pi/2])',
        '| i | a\\_i | \\alpha\\_i | d\\_i | \\theta\\_i |\n|:-:|:-:|:-:|:-:|:-:|\n'
        '| 1 | 0 | π/2 | 0.4 | θ\\_1 |\n| 2 | 0.35 | 0 | 0 | θ\\_2 |\n'
        '| 3 | 0.3 | -π/2 | 0.05 | θ\\_3 + π/2 |',
        'a [m]  alpha [deg]  d [m]  theta [deg]\n0 90 0.4 0\n0.35 0 0 0\n0.3 -90 0.05 90',
        '=====  =====  ====  =======\na      alpha  d     theta\n=====  =====  ====  =======\n'
        '0      pi/2   0.4   q1\n0.35   0      0     q2\n0.3    -pi/2  0.05  q3+pi/2\n',
        '// theta d a alpha\ndouble[][] dh = { {0, 0.4, 0, Math.PI/2}, {0, 0, 0.35, 0}, '
        '{Math.PI/2, 0.05, 0.3, -Math.PI/2} };',
        'DH;;;;\nJoint;a (mm);alpha (°);d (mm);theta (°)\nJ1;0;90;400;0\nJ2;350;0;0;0\n'
        'J3;300;-90;50;90\n',
    ],
)
def test_more_styles_of_one_arm(text):
    same(read(text)[0], rows=BENT)
