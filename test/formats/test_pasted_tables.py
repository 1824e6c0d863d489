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
    return (
        name
        if offset in ('0', '')
        else f'{name} {offset[0]} {offset[1:]}'
        if (offset[0] == '-')
        else f'{name} + {offset}'
    )


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
    assert any('Khalil: d is along x' in note for note in notes)
    assert '--convention standard: the table itself is modified' in faults(
        text, convention='standard'
    )


def test_khalil_beside_others_is_asked_for_and_branches_are_refused():
    told = faults('θ,d,r,α\nq1,0.1,0,90\nq2,0,0.3,0\n')
    for way in ('--columns theta,a,d,alpha --convention modified', '--columns theta,d,a,alpha'):
        assert way in told
        columns = way.split()[1]
        read('θ,d,r,α\nq1,0.1,0,90\nq2,0,0.3,0\n', columns=columns)
    tree = 'j,ant,sigma,gamma,b,alpha,d,theta,r\n1,0,0,0,0,0,0,t1,1\n2,1,0,0,0,0,1,t2,0\n3,1,0,0,0,0,1,t3,0\n'
    assert 'the links before are 0, 1, 1: the arm branches' in faults(tree)
    assert 'gamma is not 0' in faults(
        tree.replace('3,1,0,0', '3,2,0,1').replace('3,2,0,1', '3,2,0,0.5')
    )


@pytest.mark.parametrize(
    ('text', 'both'),
    [
        ('a,alpha,d,theta\n0,90,0.4,q1\n0.3,0,0,q2-pi/2\n', ('90 beside q2-pi/2', 'deg', 'rad')),
        ('a,alpha,d,theta\n0,90,0.4,q1\n0.3,0,0,q2+1.5708\n', ('90 beside 1.5708', 'deg', 'rad')),
        ('a,alpha,d,theta\n0,90°,0.4,q1\n0.3,0,0,q2+5\n', ('5 beside 90°', 'deg', 'rad')),
        ('a,alpha,d,theta\n0,0,400 mm,q1\n0.3,0,0,q2\n', ('0.3 beside 400 mm', 'm', 'mm')),
    ],
)  # fmt: skip
def test_numbers_of_two_units_are_refused_with_what_to_type(text, both):
    beside, *units = both
    told = faults(text)
    assert beside in told
    for unit in units:
        assert f'--units {unit}' in told
        read(text, units=[unit])


def test_plain_degrees_beside_parts_of_pi_are_read_as_told():
    text = 'a,alpha,d,theta\n0,90,0.4,q1\n0.3,0,0,q2 - pi/2\n'
    right = ((0, 90, 0.4, 0), (0.3, 0, 0, -90))
    same(read(text, units=['deg'])[0], rows=right)
    same(read(text.replace('90', '90°'))[0], rows=right)


@pytest.mark.parametrize(
    ('text', 'told'),
    [
        ('a,alpha,d,theta\n290,0,1.5707963267948966,0\n0,270,0,90\n', 'column d: 1.5707963267948966 is an angle'),
        ('a,alpha,d,theta\n0.3,0,pi/2,0\n0,0.2,0,0\n', 'column d: pi/2 is an angle'),
        ('a,alpha,d,theta\nθ1,0,0,0.3\n', 'column a: theta1 is a joint by its name'),
        ('theta,alpha,a,d\nd1,90,0,q1\n', 'column theta: d1 is a length by its name'),
        ('a,alpha,d,theta\n0,90,0.4,q1\n0.3,0,0,q2*-1\n', 'q2*-1: a product, or a variable with its star'),
        ('a,alpha,d,theta\n0,0,1,0\n1,90,0,q2-90\n1,0,0,0\n1,0,0,0\n', 'column theta: 0 without a variable: write q1'),
        ('a,alpha,d,theta\n0,90,d1,q1\na2,0,0,q2\n0,0,d3,0\n', 'd3 may slide, or be the length of a tool'),
        ('a,alpha,d,theta\n0,90,1,q1\na,alpha,d,theta\n1,0,0,q1\n', 'several tables'),
        ('A = [0 0 1 0; 1 0 0 0];\nB = [0 0 1 0; 1 0 0 1];', 'several tables: leave one in the text (A in line 1, B in line 2)'),
        ('{"left": [{"a": 0, "alpha": 1, "d": 2}, {"a": 0, "alpha": 1, "d": 2}],\n"right": [{"a": 0, "alpha": 1, "d": 2}]}', 'several tables'),
        ('left:\n  - {a: 0, alpha: 1, d: 2}\n  - {a: 1, alpha: 0, d: 0}\nright:\n  - {a: 0, alpha: 1, d: 2}\n', 'several tables'),
        ('[[left]]\na = 0\nalpha = 1\nd = 1\n[[right]]\na = 0\nalpha = 1\nd = 1\n', 'several tables'),
        ("{'a': [0, 1], 'alpha': [1, 0], 'd': [1, 2]}\n{'a': [0, 1], 'alpha': [1, 0], 'd': [1, 2]}", 'several tables'),
        ('{alpha0: 0, a0: 0, d1: 1, alpha1: 1, a1: 0, d2: 0, d1: 2}', 'several tables'),
        ('a = [0 1];\nalpha = [pi/2 0 0];\nd = [1 0];', 'vectors of different lengths: a has 2, alpha has 3, d has 2'),
        ('dh:\n  - {a: 0, alpha: 1, d: 2}\n  - {a: 1, d: 0}\n', 'row 2, column alpha: the cell is empty'),
        ("L(1)=Link('d',1);L(2)=Link('a',1);R=SerialLink(L,'offset',[0 pi/2 0]);", 'offset: 3 values for 2 links'),
        ("L(1)=Link('d',1);L(2)=Link('a',1);R=SerialLink(L);R.tool=trotx(1)*transl(0,0,1);", "tool: 'trotx(1)*transl(0,0,1)' is not understood"),
    ],
)  # fmt: skip
def test_what_may_be_another_arm_is_refused(text, told):
    assert told in faults(text)


def test_substitutions_have_the_indices_of_the_book():
    craig = ', '.join(
        f'alpha{i}: {pi(alpha)}, a{i}: {a}, d{i + 1}: {d}'
        + (f', q{i + 1}: {plus(f"q{i + 1}", pi(offset))}' if offset else '')
        for i, (a, alpha, d, offset) in enumerate(ROWS)
    )
    same(read(f's = {{{craig}}}')[0], modified=True)
    classical = '\n'.join(
        f'alpha{i} = {pi(alpha)}\na{i} = {a}\nd{i} = {d}\ntheta{i} = {plus(f"theta{i}", pi(offset))}'
        for i, (a, alpha, d, offset) in enumerate(ROWS, 1)
    )
    same(read(classical)[0])


def test_given_columns_keep_units_and_indices_of_the_heads():
    text = 'i | alpha(i-1) | len (mm) | offset (mm) | angle\n---|---|---|---|---\n'
    text += lines(
        lambda i, a, al, d, o: f'{i}|{al}°|{1000 * a:g}|{1000 * d:g}|{plus(f"q{i}", f"{o}°")}'
    )
    robot, notes = read(text, columns='joint,alpha,a,d,theta')
    same(robot, modified=True)
    assert 'the columns are read as joint, alpha(i-1), a [mm], d [mm], theta' in notes


def test_a_title_tells_the_convention():
    table = lines(lambda i, a, al, d, o: f'{a},{al}°,{d},{o}°', 'a,alpha,d,theta\n')
    same(read(f'Table 3: modified DH parameters\n{table}')[0], modified=True)
    _, notes = read(f'Modified or standard\n{table}')
    assert any('the standard convention is assumed' in note for note in notes)


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
    rows = lines(lambda i, a, al, d, o: f'│ {plus(f"q{i}", f"{o}°")} │ {d} │ {a} │ {al}° │')
    return BOX.format(rows=rows, base=base, tool=tool)


def test_base_and_tool_of_a_printed_robot_are_read():
    robot, notes = read(
        boxed('t = 1, 0, -0.5; rpy/xyz = 0°, 0°, 0°', 't = 0, 0, 0.2; rpy/xyz = 0°, 0°, 90°')
    )
    for q in Q:
        right = shift(x=1, z=-0.5) @ product(ROWS, q) @ shift(z=0.2) @ turn('x', math.pi / 2)
        assert np.abs(ks.forward_kinematics(robot, q) - right).max() < ROUND_OFF
    assert 'tool has the digits that are printed' in notes
    assert not [note for note in notes if 'convention' in note]
    same(read(boxed())[0])
    assert 'several angles' in faults(boxed('t = 1, 0, 0; rpy/xyz = 10°, 0°, 90°'))
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
        "{links}\nR = SerialLink(L);\nR.base = transl(1, 0, -0.5);\nR.tool = transl([0 0 h])*trotx(pi/2);",
        "{links}\nR = SerialLink(L, 'name', 'arm', 'base', transl(1,0,-0.5), 'tool', transl(0, 0, 0.2)*trotx(90, 'deg'));",
        "r = DHRobot({calls}, name='arm', tool=SE3(0, 0, h) * SE3.Rx(np.pi/2), base=SE3.Tx(1) * SE3.Tz(-0.5))",
        "class Arm(DHRobot):\n  def __init__(self):\n    L = {calls}\n    super().__init__(L, name='arm', tool=SE3.Tz(h) @ SE3.Rx(90, unit='deg'), base=SE3(1, 0, -0.5))",
    ],
)  # fmt: skip
def test_base_and_tool_of_a_script_are_read(script):
    links = lines(
        lambda i, a, al, d, o: (
            f"L({i}) = Link('d', {d}, 'a', {a}, 'alpha', {pi(al)}, 'offset', {pi(o)});"
        ),
        'h = 0.2;\n',
    )
    calls = lines(
        lambda i, a, al, d, o: f'RevoluteDH(d={d}, a={a}, alpha={pi(al)}, offset={pi(o)})',
        '[',
        ']',
        ',\n',
    )
    robot, _ = read('h = 0.2\n' * ('{calls}' in script) + script.format(links=links, calls=calls))
    for q in Q:
        right = shift(x=1, z=-0.5) @ product(ROWS, q) @ shift(z=0.2) @ turn('x', math.pi / 2)
        assert np.abs(ks.forward_kinematics(robot, q) - right).max() < ROUND_OFF


def test_what_is_dropped_is_named():
    _, notes = read("L(1)=Link('d',1);L(2)=Link('a',1);R=SerialLink(L);R.qlim=[-1 1;-2 2];")
    assert any('qlim of the robot is not read' in note for note in notes)
    _, notes = read(
        'dh:\n  - {a: 0, alpha: 1, d: 2, mass: 3}\n  - {a: 1, alpha: 0, d: 0, mass: 4}\n'
    )
    assert 'left out: mass' in notes
    _, notes = read('q1 = 0.3\na,alpha,d,theta\n0,0,1,q1\n1,0,0,q2\n')
    assert 'the values of q1 are left out: joints move' in notes


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
        assert any('limits are taken to be in deg' in note for note in notes)
    robot, _ = read(
        '{"j": [{"a": 0, "alpha": 0, "d": 1, "limits": [-1, 2]}, {"a": 1, "alpha": 0, "d": 0, "limits": [-3, 3]}]}'
    )
    assert robot.limits.tolist() == [[-1, 2], [-3, 3]]


def test_letters_without_a_value_become_constants():
    found = read_table(
        'i,a,alpha,d,theta\n1,0,90,d1,θ1\n2,a2,0,0,θ2+β\nEE,0,0,L_t,0\n', 'dh.txt', 'arm'
    )
    assert '\nconstants:\n  d1:\n  a2:\n  beta:\n  L_t:\n' in found.text
    assert any(
        'd1, a2, beta, L_t: letters without a value' in note.message for note in found.doubts
    )
    with pytest.raises(
        RobotFileError, match='constants: d1, a2, beta, L_t: no value; write a number'
    ):
        ks.robot_from_text(found.text)
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
        assert any(f'{digits} looks like' in note for note in notes)
        assert any(
            f'links[0].alpha: {digits} looks like pi/2 rounded' in one
            for one in robot.description.remarks
        )
        robot, notes = read(text, round_angles=True)
        same(robot, rows=((0, 90, 0.4, 0), (0.3, -90, 0, 180)))
    for exact in ('1.5707963267948966', '1.5712', '1.2'):
        robot, notes = read(f'a,alpha,d,theta\n0,{exact},0.4,q1\n')
        assert not [note for note in notes if 'rounded' in note]
        assert not [one for one in robot.description.remarks if 'rounded' in one]
    robot, _ = read('a,alpha,d,theta\n0,29.999999999999996,1,q1\n', round_angles=True)
    assert robot.description.links[0]['alpha'].text == '30'


def test_heads_that_are_not_understood_are_no_row():
    table = lines(lambda i, a, al, d, o: f'{a},{pi(al)},{d},{pi(o)}', 'len,twi,off,ang\n')
    same(read(table, columns=ADT)[0])
    assert 'no row says what the columns hold' in faults(table)
