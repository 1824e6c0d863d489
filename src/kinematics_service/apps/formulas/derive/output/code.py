# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write T, J and the determinant as source code. The code computes common subexpressions once.
Lengths are parameters of the functions.
"""

from collections.abc import Callable, Iterator

import sympy
from sympy.printing.jscode import JavascriptCodePrinter
from sympy.printing.numpy import NumPyPrinter

from ..derivation import Derivation


def code_of(derivation: Derivation, language: str) -> str:
    """
    Return source code with functions for the tool's pose, the Jacobian, and the determinant if it
    was derived.
    """
    return _WRITERS[language](derivation)


def _functions(
    derivation: Derivation,
) -> Iterator[tuple[str, list[tuple[sympy.Symbol, sympy.Expr]], sympy.Expr | sympy.Matrix]]:
    # Yield the name of each function, the common subexpressions (symbol, expression) that the
    # function computes first, and the expression that it returns.
    functions = {'pose': derivation.T, 'jacobian': derivation.jacobian}
    if derivation.determinant is not None:
        name = 'determinant' if derivation.singular_set.determinant.square else 'manipulability'
        functions[name] = derivation.determinant
    for name, expression in functions.items():
        replaced, (reduced,) = sympy.cse([expression], symbols=sympy.numbered_symbols('x_'))
        yield name, replaced, reduced


def _about(derivation: Derivation) -> list[str]:
    task = ' '.join(derivation.singular_set.determinant.rows)
    unit = derivation.robot.description.length_unit
    lengths = ', '.join(
        name if value is None else f'{name} = {value!r} {unit}'
        for name, value in derivation.lengths.items()
    )
    return [
        f'{derivation.robot.name}: kinematics, derived from its robot file.',
        f'Joints: {", ".join(v.name for v in derivation.variables)} (rad, {unit}).',
        f'Lengths of the file: {lengths or "none"}.',
        'Jacobian: rows vx vy vz wx wy wz of the tool in base axes.',
        f'Task rows of the determinant: {task}.',
    ]


def _numpy(derivation: Derivation) -> str:
    printer = NumPyPrinter({'fully_qualified_modules': False})
    lines = ['"""', *_about(derivation), '', '"""', '', 'import numpy']
    lines += ['from numpy import arctan2, array, cos, pi, sin, sqrt', '']
    names = [v.name for v in derivation.variables]
    lengths = [symbol.name for symbol in derivation.names.lengths]
    for name, replaced, reduced in _functions(derivation):
        signature = ', '.join(['q', *lengths])
        lines += ['', f'def {name}({signature}):', f'    {", ".join(names)}, = q']
        lines += [f'    {symbol} = {printer.doprint(value)}' for symbol, value in replaced]
        if isinstance(reduced, sympy.MatrixBase):
            rows = [
                f'        [{", ".join(printer.doprint(e) for e in row)}],'
                for row in reduced.tolist()
            ]
            lines += ['    return array([', *rows, '    ])', '']
        else:
            lines += [f'    return {printer.doprint(reduced)}', '']
    text = '\n'.join(lines)
    return text.replace('abs(', 'numpy.abs(')


def _javascript(derivation: Derivation) -> str:
    printer = JavascriptCodePrinter()
    lines = [f'// {line}' for line in _about(derivation)]
    lengths = [symbol.name for symbol in derivation.names.lengths]
    names = [v.name for v in derivation.variables]
    q = 'joint_positions' if 'q' in names else 'q'
    factors = sympy.Matrix([f.expression for f in derivation.singular_set.factors])
    for name, replaced, reduced in [*_functions(derivation), ('factors', [], factors)]:
        lines += ['', f'export function {name}({", ".join([q, *lengths])}) {{']
        lines += [f'  const [{", ".join(names)}] = {q};']
        lines += [f'  const {symbol} = {printer.doprint(value)};' for symbol, value in replaced]
        if isinstance(reduced, sympy.MatrixBase):
            written = [[printer.doprint(e) for e in row] for row in reduced.tolist()]
            rows = [
                ', '.join(row) if name == 'factors' else f'[{", ".join(row)}]' for row in written
            ]
            lines += ['  return [', *(f'    {row},' for row in rows), '  ];', '}']
        else:
            lines += [f'  return {printer.doprint(reduced)};', '}']
    return '\n'.join(lines) + '\n'


def _latex(derivation: Derivation) -> str:
    lines = [f'% {line}' for line in _about(derivation)]
    symbols = {'pose': 'T', 'jacobian': 'J', 'determinant': r'\det J', 'manipulability': 'w'}
    for name, replaced, reduced in _functions(derivation):
        equations = [(sympy.latex(symbol), part) for symbol, part in replaced]
        equations.append((symbols[name], reduced))
        lines += [rf'\[ {left} = {sympy.latex(right)} \]' for left, right in equations]
    return '\n'.join(lines) + '\n'


_WRITERS: dict[str, Callable[[Derivation], str]] = {
    'numpy': _numpy,
    'js': _javascript,
    'latex': _latex,
}
