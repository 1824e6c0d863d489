# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Files of formulas made to be long, deep or large: answered in seconds, with a sentence and a line.
"""

import time

import pytest

import kinematics_service as ks
from kinematics_service.apps.formulas.compare.comparison import compare
from kinematics_service.apps.formulas.compare.text import tokens

SECONDS = 8.0  # of this process, on a slow machine; each took from 20 s to no end, or a traceback


def numbered(first, line, count):
    """Return a file of definitions, each made of the one before, and a formula of the last."""
    lines = [f'a0 = {first}', *(line.format(n, n - 1) for n in range(1, count + 1))]
    return '\n'.join([*lines, f'x = a{count}'])


RIGHT = {
    'a sum of 400 terms': 'x = L1*cos(q1) + L2*cos(q1 + q2)'
    + ''.join(f' + {k}*cos(q1) - {k}*cos(q1)' for k in range(200)),
    'a left side of 400 terms': ' + '.join(['q1'] * 400) + ' = 400*q1',
    'a product of 300': 'x = L2*cos(q1 + q2) + L1*cos(q1)' + '*1' * 300,
}
# Place and code of the fault.
REFUSED = {
    'squares of numbers': (numbered('9^24', 'a{0} = a{1}*a{1}', 30), '7:8', 'too-large'),
    'squares of sums': (numbered('9^24 + L1', 'a{0} = a{1}*a{1}', 30), '11:9', 'too-large'),
    'matrices of matrices': (
        numbered('[1, 2; 3, 4]', 'a{0} = [a{1}, a{1}; a{1}, a{1}]', 15),
        *('5:6', 'too-large'),
    ),
    'a row of 2,000': (f'J = [{", ".join(["1"] * 2000)}]', '1:5', 'too-large'),
    '400 rows': ('J = [' + '\n'.join(['1 2 3'] * 400) + ']', '1:5', 'too-large'),
    'sines of sines': ('x = ' + r'\sin ' * 50 + 'q1', '1:190', 'too-deep'),
    'sines by definitions': (
        numbered('q1', 'a{0} = sin(sin(a{1}))', 30),
        *('8:10', 'too-deep'),
    ),
    '300 formulas': ('x = 1\n' * 300, '201:1', 'too-many'),
    'braces never closed': ('x = ' + r'\begin {' * 20_000, '1:1', 'empty'),
    'an infinite size': ('T = Matrix(1e999, 1, [1])', '1:5', 'wrong-shape'),
    'a root of -1': ('x = sqrt(-1)', '1:5', 'not-real'),
    'a power of -1': ('x = (-1)^(1/2)', '1:9', 'not-real'),
}


@pytest.mark.parametrize('name', RIGHT)
def test_a_long_formula_is_compared(name):
    started = time.process_time()
    found = compare(ks.load_robot('planar_2r'), RIGHT[name])
    assert found.agrees, found.faults
    assert not found.faults
    assert time.process_time() - started < SECONDS


@pytest.mark.parametrize('name', REFUSED)
def test_a_formula_without_bounds_is_refused_with_its_line(name):
    text, place, code = REFUSED[name]
    started = time.process_time()
    found = compare(ks.load_robot('planar_2r'), text)
    faults = [(f'{fault.line}:{fault.column}', fault.code) for fault in found.faults]
    assert (place, code) in faults, faults[:3]
    assert time.process_time() - started < SECONDS


@pytest.mark.parametrize('formula', ['x = I', 'x = sqrt(-L1^2)', 'q1 = acos(2*L1/L1)'])
def test_what_is_no_real_number_is_no_traceback(formula):
    found = compare(ks.load_robot('planar_2r'), formula)
    assert found.faults or not found.agrees


def test_a_name_in_other_letters_is_suggested():
    (fault,) = compare(ks.load_robot('planar_2r'), 'x = l_1*cos(q1)').faults
    assert fault.code == 'unknown-name'
    assert "'L1'?" in fault.message


def test_a_formula_of_too_many_words_is_refused(monkeypatch):
    monkeypatch.setattr(tokens, 'MAX_TOKENS', 10)
    assert not compare(ks.load_robot('planar_2r'), 'x = 1 + 1 + 1 + 1').faults
    (fault,) = compare(ks.load_robot('planar_2r'), 'x = 1\ny = 1 + 1 + 1 + 1 + 1').faults
    assert (fault.line, fault.column, fault.code) == (2, 1, 'too-large')
