# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Expressions: what they are worth, what is refused and why, and that nothing else ever happens.
"""

import ast
import contextlib
import math
import random
import threading
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusal import refused

from kinematics_service.errors import ExpressionError, KinematicsError
from kinematics_service.robot.file.text.expression_syntax import MAX_CHARACTERS
from kinematics_service.robot.file.text.expressions import (
    Affine,
    Scope,
    check_function,
    parse_affine,
)

ROUND_OFF = 1e-9  # relative; trees of up to a few dozen operations, each good to 1e-16
SCOPE = Scope('rad', {'L1': 0.5, 'l': 2.0}, ('q1', 'q2', 'phi3'))
DEGREES = Scope('deg', {}, ('q1',))


@pytest.mark.parametrize(
    ('text', 'constant', 'coefficients'),
    [
        ('0', 0.0, {}),
        ('-0', 0.0, {}),
        ('017', 17.0, {}),
        ('1e-3', 0.001, {}),
        ('.5', 0.5, {}),
        ('5.', 5.0, {}),
        ('1.5E+2', 150.0, {}),
        ('-pi/2', -math.pi / 2, {}),
        ('2 - 3 - 4', -5.0, {}),
        ('8/4/2', 1.0, {}),
        ('2 + 3*4', 14.0, {}),
        ('-(2 + 3)*4', -20.0, {}),
        ('- - -1', -1.0, {}),
        ('+L1', 0.5, {}),
        ('sqrt(2)/2', math.sqrt(2) / 2, {}),
        ('atan2(1, -1)', 3 * math.pi / 4, {}),
        ('sin(pi/6)*cos(0)', math.sin(math.pi / 6), {}),
        ('-q2', 0.0, {'q2': -1.0}),
        ('q2 + pi/2', math.pi / 2, {'q2': 1.0}),
        ('l + phi3', 2.0, {'phi3': 1.0}),
        ('pi - (phi3 - q2)', math.pi, {'q2': 1.0, 'phi3': -1.0}),
        ('(q1 + 1)/l*3', 1.5, {'q1': 1.5}),
        ('q1 - q1', 0.0, {}),
        ('sin(q1 - q1)', 0.0, {}),
        ('0*q1*q2', 0.0, {}),
        ('1\n + 2', 3.0, {}),
    ],
)
def test_value(text: str, constant: float, coefficients: dict[str, float]) -> None:
    affine = parse_affine(text, SCOPE)
    assert affine == Affine(constant, tuple(coefficients.items()))
    assert math.copysign(1.0, affine.constant) == math.copysign(1.0, constant)


@pytest.mark.parametrize(
    'text', ['0', '-0', '+0', '017', '-1.5E+2', '.5', '-5.', '0.1', '-1e-308', '1e-999', '9' * 200]
)
def test_a_number_alone_has_the_value_that_it_has_in_an_expression(text: str) -> None:
    alone, inside = (parse_affine(written, SCOPE).constant for written in (text, f'({text})'))
    assert alone.hex() == inside.hex()


@pytest.mark.parametrize('text', ['1e999', '-1e999', '0' * (MAX_CHARACTERS + 1)])
def test_a_number_alone_is_refused_as_it_is_in_an_expression(text: str) -> None:
    messages = []
    for written in (text, f'{text} '):
        with pytest.raises(ExpressionError) as caught:
            parse_affine(written, SCOPE)
        messages.append((str(caught.value).replace('402', '401'), caught.value.code))
    assert messages[0] == messages[1]


def test_coefficients_are_in_the_order_of_the_joints() -> None:
    names = [name for name, _ in parse_affine('phi3 + q2 + q1', SCOPE).coefficients]
    assert names == ['q1', 'q2', 'phi3']


def test_trigonometry_follows_the_angle_unit() -> None:
    assert parse_affine('sin(30)', DEGREES).constant == pytest.approx(0.5, rel=ROUND_OFF)
    assert parse_affine('cos(60)', DEGREES).constant == pytest.approx(0.5, rel=ROUND_OFF)
    assert parse_affine('atan2(1, 1)', DEGREES).constant == 45.0
    assert parse_affine('sqrt(4)', DEGREES).constant == 2.0


@pytest.mark.parametrize(
    ('text', 'code', 'word'),
    [
        ('', 'empty', ''),
        ('p1', 'unknown-name', "'p1'"),
        ('True', 'unknown-name', "'True'"),
        ('__import__', 'unknown-name', "'__import__'"),
        ('tan(1)', 'unknown-name', "'tan'"),
        ('eval(1)', 'unknown-name', "'eval'"),
        ('sin', 'syntax', 'write sin(...)'),
        ('L1(2)', 'syntax', 'write L1*(...)'),
        ('atan2(1)', 'wrong-length', 'atan2'),
        ('sin(1, 2)', 'wrong-length', '1'),
        ('sin()', 'syntax', "')'"),
        ('0x10', 'not-a-number', "'0x10'"),
        ('1_0', 'not-a-number', "'1_0'"),
        ('1j', 'not-a-number', "'1j'"),
        ('1e', 'not-a-number', "'1e'"),
        ('1.2.3', 'not-a-number', "'1.2.3'"),
        ('2q1', 'not-a-number', 'write 2*q1'),
        ('1:30', 'not-a-number', 'write 90'),
        ('2**3', 'syntax', 'write x*x'),
        ('2^3', 'syntax', 'write x*x'),
        ('7//2', 'syntax', 'write /'),
        ('7 % 2', 'syntax', "'%'"),
        ('L1.real', 'syntax', "'.'"),
        ('[1]', 'syntax', "'['"),
        ("'1'", 'syntax', ''),
        ('θ1', 'syntax', "'θ'"),
        ('٣', 'syntax', "'٣'"),
        ('2 3', 'syntax', "'2'"),
        ('2(3)', 'syntax', "'2'"),
        ('(1', 'syntax', "'('"),
        ('1)', 'syntax', "write '('"),
        ('1 +', 'syntax', 'write 1'),
        ('*1', 'syntax', "'*'"),
        ('(1, 2)', 'syntax', "','"),
        ('1/0', 'division-by-zero', ''),
        ('1/(L1 - 0.5)', 'division-by-zero', ''),
        ('sqrt(-4)', 'out-of-range', '-4'),
        ('1e999', 'not-finite', '1e999'),
        ('1e308*10', 'not-finite', ''),
        ('1e308*10*q1', 'not-finite', ''),
        ('q1*q2', 'not-linear', 'q1 is multiplied by q2'),
        ('(q1 + q2)*phi3', 'not-linear', 'q1 and q2 is multiplied by phi3'),
        ('sin(q1)', 'not-linear', 'q1 is inside sin()'),
        ('1/q1', 'not-linear', 'division by q1'),
        ('1+' * 200 + '1', 'too-long', '401'),
        ('(' * 33 + '1' + ')' * 33, 'too-deep', '32'),
    ],
)  # fmt: skip
def test_refused(text: str, code: str, word: str) -> None:
    with refused(ExpressionError, code, word):
        parse_affine(text, SCOPE)


def test_the_messages_of_a_few_expressions() -> None:
    # For a person to read.
    messages = {
        'p1': "unknown name 'p1' (known: pi, L1, l, q1, q2, phi3)",
        '2^3': "'^' is not accepted: write x*x for a square",
        'q1*q2': 'not linear in the joint variables: q1 is multiplied by q2 '
        '(accepted: sums such as 2*q1 - q2)',
    }
    for text, message in messages.items():
        with pytest.raises(ValueError) as caught:
            parse_affine(text, SCOPE)
        assert isinstance(caught.value, KinematicsError)
        assert str(caught.value) == message


ANGLE, RATIO = 1, 0  # what a place of the file wants; None where it may be either
# Expression, what its place wants, and what to write instead; None if that is undecided.
PI_IN_DEGREES = [
    ('pi/2', ANGLE, '90'),
    ('-pi/2', ANGLE, '-90'),
    ('3*pi/4', ANGLE, '135'),
    ('pi/12.0', ANGLE, '15'),
    ('147.8*pi/180', ANGLE, '147.8'),
    ('q1 + pi/2', ANGLE, 'q1 + 180/2'),
    ('pi - (q2 - q1)', ANGLE, '180 - (q2 - q1)'),
    ('q1+pi-pi/3', ANGLE, 'q1+180-180/3'),
    ('  -2*q1 - ( pi/4 )', ANGLE, '-2*q1 - ( 180/4 )'),
    ('K*pi + q2', ANGLE, 'K*180 + q2'),
    ('q1 - pi/7', ANGLE, 'q1 - 180/7'),
    ('pi/7', ANGLE, '180/7'),
    ('K*sin(pi/3)', RATIO, None),
    ('0.02/(2*pi)*q2', RATIO, None),
    ('-pi/6', None, '-30'),
    ('cos(pi/5)', None, None),
    ('q2 - pi/3', None, 'q2 - 180/3'),
    ('0.1 - pi/2', ANGLE, None),  # is 0.1 in radians or degrees?
    ('q1*pi/180', ANGLE, None),  # converts to radians what is in degrees
    ('0.25*pi', RATIO, None),  # a quarter of a circumference
    ('d3 + pi', RATIO, None),
    ('sin(30 + pi)', RATIO, None),
    ('sqrt(pi)', ANGLE, None),
    ('pi/(1 - 1)', ANGLE, None),
    ('pi*pi', None, None),
    ('pi - pi', ANGLE, None),
    ('q1 - 0*pi', ANGLE, None),
]


@pytest.mark.parametrize(('text', 'wanted', 'instead'), PI_IN_DEGREES)
def test_pi_in_degrees_is_computed(text: str, wanted: int | None, instead: str | None) -> None:
    variables = ('q1', 'q2', 'd3')
    scope = Scope('deg', {'K': 0.3}, variables, {}, wanted)
    with refused(ExpressionError, 'pi-in-degrees', "'angle: deg'") as caught:
        parse_affine(text, scope)
    told = str(caught.value)
    assert ('write ' in told) == (instead is not None)
    assert instead is None or f'write {instead} (' in told
    # A place that takes lengths as well decides only sums with joints.
    assert ('if it is an angle' in told) == (text == '-pi/6')
    if wanted is not None and instead is not None:
        # What is to be written means in degrees what the text meant in radians.
        read = parse_affine(instead, scope)
        meant = parse_affine(text, Scope('rad', {'K': 0.3}, variables))
        assert math.radians(read.constant) == pytest.approx(meant.constant, abs=ROUND_OFF)
        for (name, factor), (named, expected) in zip(
            read.coefficients, meant.coefficients, strict=True
        ):
            assert name == named
            assert factor == pytest.approx(expected, rel=ROUND_OFF)


def test_a_long_advice_on_pi_is_left_out() -> None:
    with refused(ExpressionError, 'pi-in-degrees', '3.14159') as caught:
        parse_affine('+'.join(['q1'] * 40) + ' + pi', Scope('deg', {}, ('q1',), {}, ANGLE))
    assert 'write' not in str(caught.value)


def test_many_known_names_are_cut() -> None:
    scope = Scope('rad', {f'c{i}': 1.0 for i in range(50)})
    with refused(ExpressionError, 'unknown-name', 'c18, and 31 more'):
        parse_affine('x', scope)


def test_the_longest_and_the_deepest_are_accepted() -> None:
    assert parse_affine('-' * (MAX_CHARACTERS - 1) + '1', SCOPE).constant == -1.0
    assert parse_affine('1+' * 199 + '1', SCOPE).constant == 200.0
    assert parse_affine('(' * 32 + '1' + ')' * 32, SCOPE).constant == 1.0


@pytest.mark.parametrize('text', ['sin(q1)', 'q1*q2*q1', 'L1 + l*cos(q1 + q2)', 'sqrt(q1)/q2'])
def test_a_function_may_be_nonlinear(text: str) -> None:
    check_function(text, SCOPE)


@pytest.mark.parametrize('text', ['sin(q1', 'q9', 'sin(q1)*1/0', 'sin(q1) + sqrt(-1)'])
def test_a_function_is_checked(text: str) -> None:
    with pytest.raises(ExpressionError):
        check_function(text, SCOPE)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.text(max_size=60))
def test_any_text_is_a_value_or_an_expression_error(text: str) -> None:
    _only_expression_errors(text)


PIECES = st.sampled_from(
    ['q1', 'q2', 'L1', 'pi', 'sin', 'sqrt(', 'atan2(', '(', ')', ',', '+', '-', '*', '/', '**']
    + ['1', '0', '.5', '1e308', '1e-308', '0x1', '1j', ' ', 'lambda', 'x.y', '\n', 'if', 'not']
)


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(st.lists(PIECES, max_size=40))
def test_any_pieces_are_a_value_or_an_expression_error(pieces: list[str]) -> None:
    _only_expression_errors(''.join(pieces))


def _only_expression_errors(text: str) -> None:
    with contextlib.suppress(ExpressionError):
        affine = parse_affine(text, SCOPE)
        assert math.isfinite(affine.constant)
        assert all(math.isfinite(factor) and factor for _, factor in affine.coefficients)
    with contextlib.suppress(ExpressionError):
        check_function(text, SCOPE)


def test_affine_agrees_with_arithmetic_on_numbers() -> None:
    # An independent road: the same tree built once as text and once as plain numbers.
    compared = 0
    for seed in range(100):
        generator = random.Random(seed)
        point = {name: generator.uniform(-3.0, 3.0) for name in SCOPE.variables}
        text, value = _linear(generator, point, depth=3)
        if len(text) > MAX_CHARACTERS:
            continue
        affine = parse_affine(text, SCOPE)
        found = affine.at(point)
        assert found == pytest.approx(value, rel=ROUND_OFF, abs=ROUND_OFF), text
        compared += 1
    assert compared > 90


def _linear(generator: random.Random, point: dict[str, float], depth: int) -> tuple[str, float]:
    if depth == 0:
        name = generator.choice(list(point))
        return name, point[name]
    left, left_value = _linear(generator, point, depth - 1)
    number = generator.choice([0.25, 3.0, 12.5, 1e-3])
    match generator.randrange(5):
        case 0:
            right, right_value = _linear(generator, point, depth - 1)
            return f'({left} + {right})', left_value + right_value
        case 1:
            right, right_value = _linear(generator, point, depth - 1)
            return f'{left} - ({right})', left_value - right_value
        case 2:
            return f'{number}*({left})', number * left_value
        case 3:
            return f'({left})/{number}', left_value / number
    return f'-({left}) + sin({number})', -left_value + math.sin(number)


def test_only_one_thread_parses_at_a_time(monkeypatch):
    # The solver of targets reads robots in a thread while the node's own may be read, and Python
    # up to 3.12 confuses the depths of two trees that are built at a time: seldom, so that two
    # at a time is what is looked for.
    parse, inside, met = ast.parse, [], []

    def slow_parse(*args, **kwargs):
        inside.append(threading.get_ident())
        time.sleep(0.002)
        met.append(len(inside))
        inside.remove(threading.get_ident())
        return parse(*args, **kwargs)

    monkeypatch.setattr(ast, 'parse', slow_parse)
    threads = [
        threading.Thread(target=parse_affine, args=('0.5 * q1 + 2', SCOPE)) for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert met == [1, 1, 1, 1]
