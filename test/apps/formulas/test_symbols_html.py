# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the page shows is what was derived: its MathML is read back and compared as numbers."""

import math
import random
import xml.etree.ElementTree as ElementTree

import pytest
import sympy
from chromium import chromium_tab
from derivations import derived

from kinematics_service.apps.formulas.derive.output.html import html_of, mathml
from kinematics_service.apps.formulas.derive.output.report import report_of

# A bracket's box is a line high.
HIGHEST_BRACKET = 1.6
BRACKETS = 'mo[stretchy="false"]'
HEIGHTS = (
    f'[...document.querySelectorAll({BRACKETS!r})].map(e => e.getBoundingClientRect().height)'
)
SIZES = """[...document.querySelectorAll('msub')].map(e =>
  [0, 1].map(k => parseFloat(getComputedStyle(e.children[k]).fontSize)))"""

FUNCTIONS = {'sin': math.sin, 'cos': math.cos, 'acos': math.acos}


def plain(node):
    """Return presentation MathML as a Python expression, reading it as an eye does."""
    parts = [plain(child) for child in node]
    text = (node.text or '').strip()
    match node.tag:
        case 'mi' | 'mn':
            return text.replace('π', 'pi').replace('θ', 'theta')
        case 'mo':
            signs = {'\u2062': '*', '\u2061': '', '\u2212': '-', '\u00b7': '*', '': '*'}
            return signs.get(text, text)
        case 'msub':
            return parts[0] + '_' + parts[1]
        case 'msup':
            return f'({parts[0]})**({parts[1]})'
        case 'mfrac':
            return f'(({parts[0]})/({parts[1]}))'
        case 'msqrt':
            return f'sqrt({"".join(parts)})'
        case 'mfenced':
            return f'({"".join(parts)})'
        case _:
            return ''.join(parts)


def value(expression, numbers):
    read = ElementTree.fromstring(
        f'<math>{mathml(expression)}</math>'.replace('&InvisibleTimes;', '*')
    )
    text = plain(read)
    names = {str(k).replace('_', ''): v for k, v in numbers.items()}
    text = text.replace('_', '')
    return eval(text, {'__builtins__': {}, **FUNCTIONS, 'sqrt': math.sqrt, 'pi': math.pi}, names)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['craig_3r', 'rrp_elementary'])
def test_the_page_shows_what_was_derived(name):
    derivation = derived(name)
    entries = [*derivation.jacobian, *derivation.T]
    chance = random.Random(1)
    compared = 0
    for entry in entries:
        symbols = sorted(entry.free_symbols, key=str)
        numbers = {symbol: chance.uniform(0.2, 1.2) for symbol in symbols}
        expected = float(entry.subs(numbers))
        assert value(entry, numbers) == pytest.approx(expected, abs=1e-12), entry
        compared += 1
    assert compared >= 25


def test_a_negated_sum_keeps_its_brackets():
    a, b, c = sympy.symbols('a b c')
    negated = sympy.Mul(-1, a + b, evaluate=False)
    numbers = {a: 0.3, b: 0.5, c: 0.7}
    assert value(negated, numbers) == pytest.approx(-0.8)
    assert value(sympy.Add(c, negated, evaluate=False), numbers) == pytest.approx(-0.1)
    assert value(c * negated, numbers) == pytest.approx(-0.56)


@pytest.mark.slow
@pytest.mark.browser
def test_a_page_looks_right_without_a_mathematical_font(tmp_path):
    # In a browser: brackets as high as what they hold, subscripts smaller than their letters.
    file = tmp_path / 'craig_3r.html'
    file.write_text(html_of(report_of(derived('craig_3r'))), encoding='utf-8')
    with chromium_tab() as tab:
        tab.open(file.as_uri(), 1000, 800)
        tab.wait_for("document.readyState == 'complete'", 'the whole page')
        count = tab.wait_for(f'document.querySelectorAll({BRACKETS!r}).length', 'formulas')
        assert count > 20
        highest = tab.evaluate(f'Math.max(...{HEIGHTS})')
        letter = tab.evaluate('parseFloat(getComputedStyle(document.body).fontSize)')
        assert highest < HIGHEST_BRACKET * letter
        sizes = tab.evaluate(SIZES)
        assert len(sizes) > 20
        assert all(sub < 0.8 * base for base, sub in sizes)
        assert tab.errors == []


def test_letters_are_italic_words_upright_and_brackets_do_not_grow():
    q = sympy.Symbol('q_1')
    markup = mathml(-sympy.sin(q) * sympy.Symbol('L_2'))
    assert '<mi class="word">sin</mi>' in markup
    assert '<mi class="letter">q</mi>' in markup
    assert '<mo stretchy="false">(</mo>' in markup
    assert '<mo>-</mo>' not in markup


def test_every_bracket_is_written_out():
    x, y = sympy.symbols('x y')
    markup = mathml(sympy.atan2(y, sympy.sin(x)) ** 2)
    assert 'mfenced' not in markup
    assert markup.count('(</mo>') == markup.count(')</mo>') >= 2
    assert '<mo>,</mo>' in markup


def test_the_left_side_of_the_determinant_is_upright():
    page = html_of(report_of(derived('craig_3r')))
    assert page.count('<mo>det</mo><mi class="letter">J</mi>') == 1
    assert page.count('<mo>det</mo>') == 1
