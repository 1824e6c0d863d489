# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The formats of a derivation, its code, and the command that writes them."""

import functools
import json
import re
import shutil
import signal
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
import sympy
from derivations import derived, marked
from refusal import refused

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.formulas.derive import trigonometry
from kinematics_service.apps.formulas.derive.output.code import code_of
from kinematics_service.apps.formulas.derive.output.documents import markdown_of
from kinematics_service.apps.formulas.derive.output.html import html_of
from kinematics_service.apps.formulas.derive.output.json_output import json_of
from kinematics_service.apps.formulas.derive.output.latex import latex_of
from kinematics_service.apps.formulas.derive.output.report import report_of
from kinematics_service.apps.formulas.derive.output.text import text_of
from kinematics_service.apps.formulas.derive.path import along

ARMS = ['craig_3r', 'rrp_elementary', 'six_joint_dh_unit', 'offset_stanford_printed']
SQUARE = ['craig_3r', 'rrp_elementary', 'puma560', 'offset_stanford_printed']
ROUND_OFF = 1e-12


@functools.cache
def report(name):
    derivation = derived(name)
    path = None
    if name == 'rrp_elementary':
        path = along(derivation, 'theta1=sin(t), theta2=t/2, d3=1+t')
    return report_of(derivation, None, path)


@pytest.mark.slow
@pytest.mark.parametrize('name', marked(ARMS))
def test_text_says_the_factors(name):
    text = text_of(report(name))
    for factor in derived(name).singular_set.factors:
        assert f'Rank there: {factor.rank}.' in text
    assert 'zero: geometric, screw, analytic, rotation' in text
    assert text.isascii()


REACH = '(L1 + L2*cos(q2))**2'


def test_text_of_document_001():
    text = text_of(report('craig_3r'))
    assert f'det J = {derived("craig_3r").determinant}' in text
    assert f'if and only if {REACH} <= L3**2' in text


@pytest.mark.slow
def test_text_says_structural():
    text = text_of(report('six_joint_dh_unit'))
    assert 'Structural: theta1 and theta2' in text


@pytest.mark.parametrize('name', marked(ARMS))
def test_latex_is_balanced(name):
    text = latex_of(report(name))
    bare = re.sub(r'\\[{}$]', '', text)
    assert bare.count('{') == bare.count('}')
    assert bare.count('$') % 2 == 0
    assert text.count(r'\left') - text.count(r'\leftarrow') == text.count(r'\right')
    assert text.count(r'\begin{') == text.count(r'\end{')


@pytest.mark.skipif(shutil.which('pdflatex') is None, reason='no pdflatex here')
@pytest.mark.parametrize('name', marked(ARMS))
def test_latex_compiles(name, tmp_path):
    (tmp_path / 'arm.tex').write_text(latex_of(report(name)))
    command = ['pdflatex', '-interaction=nonstopmode', '-halt-on-error', 'arm.tex']
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)


@pytest.mark.parametrize('name', marked(ARMS))
def test_html_is_well_formed_and_needs_nothing_else(name):
    page = html_of(report(name))
    body = page.split('<body>')[1].split('</body>')[0]
    assert len(ElementTree.fromstring(f'<body>{_without_entities(body)}</body>')) > 10
    assert not re.search(r'<(script|link|img|iframe)', page)
    assert 'src=' not in page


def _without_entities(text):
    # HTML's names for characters, which XML does not know.
    import html

    kept = ('amp', 'lt', 'gt', 'quot', 'apos')
    return re.sub(r'&(\w+);', lambda m: m[0] if m[1] in kept else html.unescape(m[0]), text)


@pytest.mark.parametrize('name', marked(ARMS))
def test_markdown_formulas_are_closed(name):
    text = markdown_of(report(name))
    assert text.count('$$') % 2 == 0
    assert text.startswith('# ')


@pytest.mark.parametrize('name', marked(ARMS))
def test_json_is_read_back_by_sympy(name):
    derivation = derived(name)
    document = json.loads(json_of(derivation))
    names = {s.name: s for s in (*derivation.variables, *derivation.names.lengths)}
    T = sympy.Matrix([[sympy.sympify(e, locals=names) for e in row] for row in document['T']])
    assert (T - derivation.T).expand() == sympy.zeros(4, 4)
    assert set(document['terms_of_difference'].values()) == {0}


def test_json_has_the_velocity_along_a_path():
    derivation = derived('planar_2r')
    path = along(derivation, 'q1=sin(t), q2=2*t', (-1.0, 1.0))
    said = json.loads(json_of(derivation, path))['path']
    assert said['q'] == ['sin(t)', '2*t']
    assert said['qdot'] == ['cos(t)', '2']
    omega = [sympy.sympify(entry, locals={'t': sympy.Symbol('t')}) for entry in said['omega']]
    assert omega[:2] == [0, 0]
    assert str(omega[2]) == 'cos(t) + 2'
    # Stretched at t = 0.
    (crossing,) = said['crossings']
    assert crossing['time'] == pytest.approx(0.0, abs=1e-9)
    assert not crossing['touches']


@pytest.mark.parametrize('name', marked([*SQUARE, 'six_joint_dh_unit']))
def test_numpy_code_is_the_library(name):
    derivation = derived(name)
    module = {}
    exec(compile(code_of(derivation, 'numpy'), name, 'exec'), module)
    lengths = derivation.names.values.values()
    q = derivation.exact.sampler.random(5)
    robot = derivation.robot
    for pose in q:
        T, J = module['pose'](pose, *lengths), module['jacobian'](pose, *lengths)
        expected = ks.forward_kinematics(robot, pose)
        np.testing.assert_allclose(T, expected, rtol=0, atol=ROUND_OFF)
        np.testing.assert_allclose(J, ks.jacobian(robot, pose), rtol=0, atol=ROUND_OFF)
        if name in SQUARE:
            found = module['determinant'](pose, *lengths)
            wanted = ks.singularity(robot, pose).determinant
            assert found == pytest.approx(wanted, rel=1e-9, abs=ROUND_OFF)


@pytest.mark.parametrize('name', marked(['craig_3r', 'rrp_elementary']))
def test_latex_code_is_balanced(name):
    text = code_of(derived(name), 'latex')
    assert text.count(r'\[') == text.count(r'\]')
    assert text.count(r'\left') == text.count(r'\right')


def test_the_command_writes_a_file(tmp_path, capsys):
    out = tmp_path / 'arm.json'
    arguments = ['planar_2r', '--format', 'json', '--out', str(out), '--frame', 'tool']
    assert main(['derive', *arguments]) == 0
    assert capsys.readouterr() == (f'wrote {out}\n', '')
    assert json.loads(out.read_text())['robot'] == 'planar_2r'
    assert [path.name for path in tmp_path.iterdir()] == ['arm.json']


@pytest.mark.parametrize(
    ('arguments', 'code', 'message'),
    [
        (['no_such_arm'], 2, 'no_such_arm'),
        (['planar_2r', '--lock', 'q9=0'], 1, "'q9' to lock (known: q1, q2)"),
        (['planar_2r', '--lock', 'q1'], 2, 'such as q1=0'),
        (['planar_2r', '--lock', 'q1=0', '--write'], 2, 'omit --lock'),
        (['planar_2r', '--frame', '7'], 1, "frame '7' (known: base, tool,"),
        (['planar_2r', '--plot', 'a.png'], 2, 'give --path'),
        (['planar_2r', '--from', '2', '--to', '1'], 2, '--from 2'),
    ],
)
def test_a_wrong_command_line_is_one_sentence(capsys, arguments, code, message):
    assert main(['derive', *arguments]) == code
    errors = ' '.join(capsys.readouterr().err.split())
    assert message in errors
    assert 'Traceback' not in errors


@pytest.mark.parametrize(
    ('locked', 'code', 'word'),
    [
        ({'q9': '0'}, 'unknown-name', "'q9'"),
        ({'q1': '0', 'q2': '0'}, 'too-few', 'every joint'),
        ('q1=0', 'wrong-type', "'q1=0'"),
    ],
)
def test_joints_that_cannot_be_locked_are_refused(locked, code, word):
    with refused(ks.DerivationError, code, word):
        ks.derive('planar_2r', locked)


def test_a_frame_that_the_arm_does_not_have_is_refused():
    with refused(ks.DerivationError, 'unknown-name', "'7'"):
        derived('planar_2r').jacobian_in('7')


# The command, which says when it begins to derive: then it has loaded all that it needs.
DERIVE = """
import sys
from kinematics_service.__main__ import main
from kinematics_service.apps.formulas.derive import derivation

whole = derivation.derive

def derive(*arguments):
    print('ready', flush=True)
    return whole(*arguments)

derivation.derive = derive
sys.exit(main())
"""


@pytest.mark.slow
def test_ctrl_c_leaves_no_half_file(tmp_path):
    # Derivations of seven joints take seconds, so the signal comes in the middle of one.
    page = tmp_path / 'panda.html'
    running = subprocess.Popen(
        [sys.executable, '-c', DERIVE, 'derive', 'panda', '--format', 'html', '--out', str(page)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert running.stdout.readline() == 'ready\n'
    running.send_signal(signal.SIGINT)
    _, errors = running.communicate(timeout=120.0)
    assert running.returncode == 130
    assert 'Traceback' not in errors
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_sums_are_factored_as_sympy_does_it_of_the_whole(monkeypatch):
    shorter, seen = trigonometry._taken_out, []

    def both(sum_):
        found = shorter(sum_)
        seen.append(found == sympy.factor_terms(sum_))
        return found

    monkeypatch.setattr(trigonometry, '_taken_out', both)
    ks.derive('craig_3r')
    assert seen
    assert all(seen)
