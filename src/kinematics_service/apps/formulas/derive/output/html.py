# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write a derivation as one HTML page with formulas in MathML."""

import re
from collections.abc import Sequence
from html import escape
from typing import Any

import sympy
from sympy.printing.mathml import MathMLPresentationPrinter

from .....page import document, resource
from ..file_factors import decimal
from .report import Block, Equation, Heading

GREEK = {'alpha', 'beta', 'gamma', 'theta', 'phi', 'psi', 'omega'}
MATHML = '<math xmlns="http://www.w3.org/1998/Math/MathML" display="{}">{}</math>'


class DecimalMathMLPrinter(MathMLPresentationPrinter):  # type: ignore[misc]
    """A printer of sympy's MathML that keeps decimals of the robot file as decimals."""

    def _print_Rational(self, expr: Any) -> Any:
        text = decimal(expr)
        return super()._print_Rational(expr) if text is None else self._element('mn', text)

    def _print_Mul(self, expr: Any) -> Any:
        # Add the brackets of -(a + b), because sympy would write -a + b.
        coefficient, factor = expr.as_coeff_Mul()
        if coefficient == -1 and factor.is_Add:
            return self._element('mrow', self._operator('-'), self._bracketed(factor))
        return super()._print_Mul(expr)

    def _print_Add(self, expr: Any, order: Any = None) -> Any:
        # Add the brackets of a - (b + c), because sympy would write a - b + c.
        parts = []
        for k, term in enumerate(self._as_ordered_terms(expr, order=order)):
            negative = term.could_extract_minus_sign()
            if negative or k > 0:
                parts.append(self._operator('-' if negative else '+'))
            if negative:
                term = -term
            parts.append(self._bracketed(term) if term.is_Add else self._print(term))
        return self._element('mrow', *parts)

    def _element(self, name: str, *inside: Any) -> Any:
        element = self.dom.createElement(name)
        for part in inside:
            element.appendChild(self.dom.createTextNode(part) if isinstance(part, str) else part)
        return element

    def _operator(self, text: str) -> Any:
        return self._element('mo', text)

    def _bracketed(self, expr: Any) -> Any:
        return self._element('mrow', self._operator('('), self._print(expr), self._operator(')'))

    def _unfence(self, node: Any) -> None:
        """
        Replace `mfenced`, which sympy before 1.13 writes and browsers ignore, by explicit
        brackets.
        """
        node.tagName = 'mrow'
        first, *others = list(node.childNodes)
        node.insertBefore(self._operator(node.getAttribute('open') or '('), first)
        for other in others:
            node.insertBefore(self._operator(','), other)
        node.appendChild(self._operator(node.getAttribute('close') or ')'))
        for name in ('open', 'close'):
            if node.hasAttribute(name):
                node.removeAttribute(name)

    def _print_MatrixBase(self, m: Any) -> Any:
        # Let the style sheet draw the brackets of matrices, because few systems have a font with
        # growing brackets.
        rows = [[self._element('mtd', self._print(entry)) for entry in row] for row in m.tolist()]
        table = self._element('mtable', *(self._element('mtr', *row) for row in rows))
        table.setAttribute('class', 'matrix')
        return table


def html_of(blocks: Sequence[Block]) -> str:
    """Return the blocks of a report as a complete HTML page."""
    title = next(block.text for block in blocks if isinstance(block, Heading))
    return document(title, map(_html, blocks), resource(__package__, 'formulas.css'))


def _html(block: Block) -> str:
    if isinstance(block, Heading):
        return f'<h{block.level}>{escape(block.text)}</h{block.level}>\n'
    if isinstance(block, Equation):
        row = f'<mrow>{_as_written(_left(block.left))}<mo>=</mo>{mathml(block.right)}</mrow>'
        return f'<div class="formula">{MATHML.format("block", row)}</div>\n'
    parts = (
        escape(p) if isinstance(p, str) else MATHML.format('inline', mathml(p))
        for p in block.parts
    )
    return f'<p>{"".join(parts)}</p>\n'


def mathml(expression: sympy.Expr | sympy.Matrix) -> str:
    """Return an expression as presentation MathML without the outer element."""
    printer = DecimalMathMLPrinter()
    node = printer._print(expression)
    for fence in [node, *node.getElementsByTagName('mfenced')]:
        if fence.tagName == 'mfenced':
            printer._unfence(fence)
    return _as_written(str(node.toxml()))


def _as_written(markup: str) -> str:
    # Mark up formulas so that they look equal with and without a mathematical font. Brackets are
    # as high as a letter, letters are italic, words are upright, and a minus is as long as a plus.
    markup = re.sub(r'<mo>([()])</mo>', r'<mo stretchy="false">\1</mo>', markup)
    markup = re.sub(r'<mi>(&\w+;|[^<\d])</mi>', r'<mi class="letter">\1</mi>', markup)
    markup = re.sub(r'<mi>([^<\d][^<]*)</mi>', r'<mi class="word">\1</mi>', markup)
    return markup.replace('<mo>-</mo>', '<mo>\N{MINUS SIGN}</mo>')


def _left(left: str) -> str:
    if left == 'det J':
        return '<mo>det</mo><mi>J</mi>'
    if left.startswith('\\dot'):
        return '<mover><mi>q</mi><mo>.</mo></mover><mo>(</mo><mi>t</mi><mo>)</mo>'
    name, _, index = left.replace('{', '').replace('}', '').lstrip('\\').partition('_')
    name, opened, argument = name.partition('(')
    symbol = f'&{name};' if name in GREEK else escape(name)
    tail = f'<mo>(</mo><mi>{escape(argument.rstrip(")"))}</mi><mo>)</mo>' if opened else ''
    kind = 'mn' if symbol.isdigit() else 'mi'
    if index:
        return f'<msub><{kind}>{symbol}</{kind}><mi>{escape(index)}</mi></msub>{tail}'
    return f'<{kind}>{symbol}</{kind}>{tail}'
