"""The derivation of an arm with closed loops as text."""

from collections.abc import Iterator
from typing import Any

import sympy

from ..closed_arm import MOST_VARIABLES, ClosedDerivation


def closed_text(derivation: ClosedDerivation) -> str:
    """Return the closure equations, the couplings, the determinants and the open Jacobian."""
    return '\n'.join(_lines(derivation)) + '\n'


def _lines(derivation: ClosedDerivation) -> Iterator[str]:
    robot = derivation.robot
    joints = ', '.join(map(str, derivation.variables))
    yield f'{robot.name}: joints {joints}; passive {", ".join(robot.passive_joint_names)}'
    for loop in derivation.loops:
        psi = ', '.join(map(str, loop.passive))
        yield f'\nLoop {loop.name}: {psi} follow from'
        for equation in loop.equations:
            yield f'  0 = {sympy.sstr(equation)}'
        yield f'Coupling d({psi})/d({joints}) = -(d Phi/d({psi}))^-1 d Phi/d({joints}):'
        yield from _matrix(loop.coupling)
        yield f'Determinant det d Phi/d({psi}); the loop is flat where it is 0:'
        yield f'  {sympy.sstr(loop.determinant)}'
    everything = ', '.join([joints, *robot.passive_joint_names])
    yield '\nPose of the tool in the base frame:'
    yield from _matrix(derivation.T)
    yield f'\nJacobian by {everything}, each by itself; J is this times [1; coupling]:'
    yield from _matrix(derivation.jacobian_open)
    rows = ' '.join(robot.task.rows)
    if derivation.determinant is None and len(robot.task.rows) == robot.dof:
        count = robot.dof + len(robot.passive_joint_names)
        yield f'\nThe determinant of the arm, rows {rows}, is that of these rows of J. It is not'
        yield f'multiplied out: that is done of {MOST_VARIABLES} joints and passive ones at most.'
        yield f'Here are {count}.'
    elif derivation.determinant is None:
        yield f'\nThe task {rows} is not square: there is no determinant of the arm.'
    else:
        yield f'\nDeterminant of the arm, rows {rows}; it is singular where it is 0:'
        yield f'  {sympy.sstr(derivation.determinant)}'


def _matrix(matrix: Any) -> Iterator[str]:
    for i in range(matrix.rows):
        yield '  [' + ', '.join(sympy.sstr(matrix[i, j]) for j in range(matrix.cols)) + ']'
