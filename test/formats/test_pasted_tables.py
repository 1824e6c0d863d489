"""Tables in the styles of programs, documents and books: each is read as the same arm."""

import math

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.errors import RobotFileError
from kinematics_service.formats.tables.robot_table import read_table

ROUND_OFF = 1e-12  # m and rad; a few rotations of an arm of a metre
# (a, alpha in degrees, d, offset in degrees) of an arm without symmetry, m.
ROWS = ((0.12, 90, 0.4, 0), (0.35, 0, 0.05, -90), (0.2, -90, 0, 30), (0, 45, 0.1, 180))
Q = np.random.default_rng(41).uniform(-2.0, 2.0, (10, 4))


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
    found = read_table(text, 'dh.txt', 'arm', **options)
    return ks.robot_from_text(found.text), [note.message for note in found.doubts]


def faults(text, **options):
    with pytest.raises(RobotFileError) as caught:
        read_table(text, 'dh.txt', 'arm', **options)
    return '\n'.join(str(fault) for fault in caught.value.faults)


def same(robot, modified=False, rows=ROWS):
    assert robot.dof == len(rows)
    assert robot.convention == ('modified' if modified else 'standard')
    for q in Q:
        right = product(rows, q, modified)
        assert np.abs(ks.forward_kinematics(robot, q[: robot.dof]) - right).max() < ROUND_OFF


def lines(row, head='', end='', between='\n', rows=ROWS):
    body = between.join(row(i, *values) for i, values in enumerate(rows, 1))
    return f'{head}{body}{end}'


def pi(angle, word='pi'):
    """Return degrees as a part of pi: -pi/2, pi/6."""
    over = {30: f'{word}/6', 45: f'{word}/4', 90: f'{word}/2', 180: word, 0: '0'}
    return ('-' if angle < 0 else '') + over[abs(angle)]


def plus(name, offset):
    return name if offset in ('0', '') else f'{name} {offset[0]} {offset[1:]}' if (
        offset[0] == '-'
    ) else f'{name} + {offset}'


ADT = 'a,alpha,d,theta'
STYLES = {
    'tuples of math': (
        lines(lambda i, a, al, d, o: f"    ({a}, {pi(al, 'math.pi')}, {d}, {pi(o, 'math.pi')}),  # J{i}",
              'import math\nDH = [\n', '\n]\n'), {'columns': ADT}),
    'rows of numpy': (
        lines(lambda i, a, al, d, o: f"[{pi(o, 'np.pi')}, {d}, {a}, {pi(al, 'np.pi')}]",
              'import numpy as np\ndh = np.array([', '])', ',\n               '),
        {'columns': 'theta,d,a,alpha'}),
    'a matrix of sympy': (
        lines(lambda i, a, al, d, o: f"[{plus(f'q{i}', pi(o, 'sp.pi'))}, {d}, {a}, {pi(al, 'sp.pi')}]",
              "q1, q2, q3, q4 = sp.symbols('q1:5')\nDH = sp.Matrix([", '])', ', '),
        {'columns': 'theta,d,a,alpha'}),
    'an array of C': (
        lines(lambda i, a, al, d, o: f"    {{{a}f, {pi(al, 'M_PI')}, {d}f, {pi(o, 'M_PI')}}}, // axis {i}",
              '#include <math.h>\nstatic const double dh[4][4] = {\n', '\n};'), {'columns': ADT}),
    'the constants of C': (
        lines(lambda i, a, al, d, o: f"{{{a}, {pi(al).replace('pi/2', 'M_PI_2').replace('pi/4', 'M_PI_4')}, {d}, {pi(o, 'M_PI')}}}",
              'float table[][4] = {', '};', ','), {'columns': ADT}),
    'a matrix of MATLAB with comments': (
        lines(lambda i, a, al, d, o: f'  {a}  {pi(al)}  {d}  q({i}){pi(o) if o < 0 else "+" + pi(o)};  % joint {i}',
              'syms q1 q2 q3 q4\n% the arm\ndh = [\n', '\n];\n'), {'columns': ADT}),
    'a matrix of MATLAB with operators between blanks': (
        lines(lambda i, a, al, d, o: f"{a}, {pi(al)}, {d}, {plus(f'q{i}', pi(o))}",
              'DH = [', '];', ';\n'), {'columns': ADT}),
    'rows of Julia or Octave by lines': (
        lines(lambda i, a, al, d, o: f'\t{a}\t{pi(al)}\t{d}\t{pi(o)}', 'dh = [', '];'),
        {'columns': ADT}),
    'heads in a comment': (
        lines(lambda i, a, al, d, o: f'[{pi(o)}, {d}, {a}, {pi(al)}],',
              '# theta, d, a, alpha for each link\ndh = [\n', '\n]'), {}),
    'heads behind the mark of a comment': (
        lines(lambda i, a, al, d, o: f'{a} {pi(al)} {d} {pi(o)}', '# a alpha d theta\n'), {}),
    'remarks behind rows': (
        lines(lambda i, a, al, d, o: f'{a},{pi(al)},{d},{pi(o)}  # link {i}',
              'a,alpha,d,theta\n# from the drawing\n'), {}),
    'deg2rad': (
        lines(lambda i, a, al, d, o: f'{a},np.deg2rad({al}),{d},math.radians({o})', f'{ADT}\n'), {}),
    'factors that turn degrees': (
        lines(lambda i, a, al, d, o: f'[{a}, {al}*D2R, {d}, {o} * D2R]', 'dh = [', ']', ',\n'),
        {'columns': ADT}),
    'words for degrees': (
        lines(lambda i, a, al, d, o: f'| {a} | {al} deg | {d} | {o} degrees |',
              '| a | alpha | d | theta |\n|---|---|---|---|\n'), {}),
    'millimetres in cells': (
        lines(lambda i, a, al, d, o: f'{1000 * a:g} mm;{pi(al)} rad;{1000 * d:g} mm;{pi(o)} rad',
              'a;alpha;d;theta\n'), {}),
    'metres in cells': (
        lines(lambda i, a, al, d, o: f'{a} m\t{al}°\t{d} m\t{o}°', 'a\talpha\td\ttheta\n'), {}),
    'centimetres in the heads': (
        lines(lambda i, a, al, d, o: f'{100 * a:g},{al},{100 * d:g},{o}',
              'a (cm),alpha (deg),d (cm),theta (deg)\n'), {}),
    'each column in its unit': (
        lines(lambda i, a, al, d, o: f'{a},{al},{1000 * d:g},{pi(o)}',
              'a [m],alpha [deg],d [mm],theta [rad]\n'), {}),
    'parts of pi below a head in degrees': (
        lines(lambda i, a, al, d, o: f'{a},{pi(al)},{d},{o}', 'a,alpha (deg),d,theta (deg)\n'), {}),
    'columns by blanks, with sums': (
        lines(lambda i, a, al, d, o: f"{i}  {a}  {pi(al)}  {d}  {plus(f'q{i}', pi(o))}",
              'Link  a  alpha  d  theta\n'), {}),
    'one blank between, with sums': (
        lines(lambda i, a, al, d, o: f"{i} {a} {pi(al)} {d} {plus(f'q{i}', pi(o))}",
              'i a alpha d theta\n'), {}),
    'a heavy box': (
        lines(lambda i, a, al, d, o: f'│ {i} │ {a} │ {al}° │ {d} │ {o}° │',
              '┏━━━┳━━━┳━━━┳━━━┳━━━┓\n┃ # ┃ a ┃ α ┃ d ┃ θ ┃\n┡━━━╇━━━╇━━━╇━━━╇━━━┩\n',
              '\n└───┴───┴───┴───┴───┘'), {}),
    'a double box': (
        lines(lambda i, a, al, d, o: f'║ {a} ║ {al}° ║ {d} ║ {o}° ║',
              '╔═══╦═══╦═══╦═══╗\n║ a ║ α ║ d ║ θ ║\n╠═══╬═══╬═══╬═══╣\n', '\n╚═══╩═══╩═══╩═══╝'), {}),
    'a frame of pandas': (
        lines(lambda i, a, al, d, o: f'{i - 1}  {a}  {math.radians(al)}  {d}  {math.radians(o)}',
              '      a     alpha     d     theta\n'), {}),
    'a frame of pandas in Markdown': (
        lines(lambda i, a, al, d, o: f'|  {i - 1} | {a} | {al} | {d} | {o} |',
              '|    |   a |   alpha |   d |   theta |\n|---:|----:|--------:|----:|--------:|\n'), {}),
    'dictionaries': (
        lines(lambda i, a, al, d, o: f"    {{'a': {a}, 'alpha': {pi(al, 'np.pi')}, 'd': {d}, 'theta': {pi(o, 'np.pi')}}},",
              'links = [\n', '\n]\n'), {}),
    'calls of dict': (
        lines(lambda i, a, al, d, o: f'dict(alpha={pi(al)}, a={a}, d={d}, offset={pi(o)})',
              'DH = [', ']', ',\n'), {}),
    'attributes of a struct': (
        lines(lambda i, a, al, d, o: f'arm({i}).a = {a}; arm({i}).alpha = {pi(al)}; arm({i}).d = {d}; arm({i}).theta = {pi(o)};'), {}),
    'vectors of MATLAB': (
        f"a = [{' '.join(str(row[0]) for row in ROWS)}];\nalpha = [{' '.join(pi(row[1]) for row in ROWS)}];\n"
        f"d = [{' '.join(str(row[2]) for row in ROWS)}];\noffset = [{' '.join(pi(row[3]) for row in ROWS)}];", {}),
    'vectors of Python': (
        f"alpha = [{', '.join(pi(row[1], 'math.pi') for row in ROWS)}]  # twists\na = {[row[0] for row in ROWS]}\n"
        f"d = {[row[2] for row in ROWS]}\ntheta = [{', '.join(pi(row[3], 'math.pi') for row in ROWS)}]", {}),
    'YAML with a mapping a row': (
        lines(lambda i, a, al, d, o: f'  - {{a: {a}, alpha: {pi(al)}, d: {d}, theta: {pi(o)}}}', 'dh:\n'), {}),
    'YAML in blocks': (
        lines(lambda i, a, al, d, o: f'  - a: {a}\n    alpha: {pi(al)}\n    d: {d}\n    theta: {pi(o)}', 'dh_parameters:\n'), {}),
    'YAML by joint': (
        lines(lambda i, a, al, d, o: f'joint_{i}:\n  d: {d}\n  a: {a}\n  alpha: {pi(al)}\n  offset: {pi(o)}'), {}),
    'YAML by columns': (
        'a:\n' + ''.join(f'  - {row[0]}\n' for row in ROWS) + 'alpha:\n' + ''.join(f'  - {pi(row[1])}\n' for row in ROWS)
        + 'd:\n' + ''.join(f'  - {row[2]}\n' for row in ROWS) + 'theta:\n' + ''.join(f'  - {pi(row[3])}\n' for row in ROWS), {}),
    'YAML with a list a row': (
        lines(lambda i, a, al, d, o: f'  - [{a}, {pi(al)}, {d}, {pi(o)}]', 'dh:\n'), {'columns': ADT}),
    'JSON with an object a row': (
        lines(lambda i, a, al, d, o: f'{{"name": "joint_{i}", "theta": {math.radians(o)!r}, "d": {d}, "a": {a}, "alpha": {math.radians(al)!r}}}',
              '{"robot": "arm", "links": [', ']}', ',\n'), {}),
    'JSON by columns': (
        f'{{"a": {[row[0] for row in ROWS]}, "d": {[row[2] for row in ROWS]}, "alpha": {[math.radians(row[1]) for row in ROWS]}, "theta": {[math.radians(row[3]) for row in ROWS]}}}', {}),
    'JSON with an array a row': (
        lines(lambda i, a, al, d, o: f'[{a}, {math.radians(al)!r}, {d}, {math.radians(o)!r}]', '{"dh": [', ']}', ', '), {'columns': ADT}),
    'TOML with a table a row': (
        lines(lambda i, a, al, d, o: f'[[joint]]\na = {a}\nalpha = {math.radians(al)!r}\nd = {d}\ntheta = {math.radians(o)!r}\n', 'title = "arm"\n'), {}),
    'TOML by columns': (
        f'[dh]\nalpha = {[math.radians(row[1]) for row in ROWS]}\na = {[row[0] for row in ROWS]}\nd = {[row[2] for row in ROWS]}\ntheta = {[math.radians(row[3]) for row in ROWS]}', {}),
    'TOML with an array a row': (
        lines(lambda i, a, al, d, o: f'  [{a}, {math.radians(al)!r}, {d}, {math.radians(o)!r}],', '[robot]\ndh = [\n', '\n]'), {'columns': ADT}),
    'a table of HTML': (
        lines(lambda i, a, al, d, o: f'<tr><td>{i}</td><td>{a}</td><td>{al}&deg;</td><td>{d}</td><td>&theta;<sub>{i}</sub> + ({o}&deg;)</td></tr>',
              '<table>\n<tr><th>i</th><th>a</th><th>&alpha;</th><th>d</th><th>&theta;</th></tr>\n', '\n</table>'), {}),
    'a column for each joint': (
        f"joint,1,2,3,4\na,{','.join(str(row[0]) for row in ROWS)}\nalpha,{','.join(pi(row[1]) for row in ROWS)}\n"
        f"d,{','.join(str(row[2]) for row in ROWS)}\ntheta,{','.join(pi(row[3]) for row in ROWS)}", {}),
    'functions of time': (
        lines(lambda i, a, al, d, o: f"{a},{pi(al)},{d},{plus(f'theta_{i}(t)', pi(o))}", f'{ADT}\n'), {}),
    'indices in tags': (
        lines(lambda i, a, al, d, o: f"| {a} | {pi(al, 'PI')} | {d} | {plus(f'q<sub>{i}</sub>', pi(o, 'PI'))} |",
              '| a<sub>i</sub> | α<sub>i</sub> | d<sub>i</sub> | θ<sub>i</sub> |\n|---|---|---|---|\n'), {}),
    'stars of a book': (
        lines(lambda i, a, al, d, o: f"{i}\t{a}\t{al}°\t{d}\tθ{i}* {'−' if o < 0 else '+'} {abs(o)}°", 'Link\ta\tα\td\tθ\n'), {}),
    'stars of LaTeX': (
        lines(lambda i, a, al, d, o: rf"{i} & {a} & ${pi(al).replace('pi/', chr(92) + 'frac' + chr(92) + 'pi')}$ & {d} & $\theta_{i}^* {'-' if o < 0 else '+'} {abs(o)}^\circ$ \\",
              'Link & $a_i$ & $\\alpha_i$ & $d_i$ & $\\theta_i$ \\\\\n'), {}),
    'words for heads': (
        lines(lambda i, a, al, d, o: f"| {i} | {plus(f'θ{i}', pi(o))} | {d} | {a} | {pi(al)} |",
              '| Joint No. | Joint angle θ (rad) | Link offset d (m) | Link length a (m) | Link twist α (rad) |\n|---|---|---|---|---|\n'), {}),
    'a script of the toolbox with offsets of its robot': (
        lines(lambda i, a, al, d, o: f"L({i}) = Link('d', {d}, 'a', {a}, 'alpha', {pi(al)});",
              end=f"\nR = SerialLink(L, 'name', 'arm');\nR.offset = [{' '.join(pi(row[3]) for row in ROWS)}];"), {}),
    'a matrix of the toolbox': (
        lines(lambda i, a, al, d, o: f'0 {d} {a} {pi(al)} 0 {pi(o)}', 'robot = SerialLink([', "], 'name', 'arm')", '; '), {}),
    'a matrix of the toolbox by its name': (
        lines(lambda i, a, al, d, o: f'  0, {d}, {a}, {pi(al)}', 'clc; clear;\nmdl = [\n', f"\n];\nr = SerialLink(mdl, 'offset', [{' '.join(pi(row[3]) for row in ROWS)}]);", ';\n'), {}),
    'values above the table': (
        lines(lambda i, a, al, d, o: f'a{i},{pi(al)},d{i},{pi(o)}', f"a1, a2, a3, a4 = 0.12, 0.35, 0.2, 0\nd1 = 0.4; d2 = 0.05; d3 = 0; d4 = 0.1\n\n{ADT}\n"), {}),
    'elements of a vector': (
        lines(lambda i, a, al, d, o: f'[{pi(al)}, length[{i - 1}], {d}, {pi(o)}]', 'length = [0.12, 0.35, 0.2, 0]\ndh = [', ']', ',\n'), {'columns': 'alpha,a,d,theta'}),
}  # fmt: skip


@pytest.mark.parametrize('style', STYLES)
def test_each_style_is_the_same_arm(style):
    text, options = STYLES[style]
    robot, _ = read(text, **options)
    same(robot)
