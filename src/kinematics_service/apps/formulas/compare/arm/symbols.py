"""
Frames and Jacobian as a textbook writes them: angles of parallel axes are summed, not expanded.

They stand in recipes such as `z_0 x (o_3 - o_0)`, and beside a wrong entry as the right one.
"""

import operator
from dataclasses import dataclass
from functools import cached_property, reduce

import sympy as sp

from .table import AXES, EYE, Table, TableRow, inverse_pose, rotation, row_matrix, translation


@dataclass(frozen=True)
class _Walk:
    # A frame M Rz(angle), the angle kept apart until another axis turns.
    M: sp.Matrix
    angle: sp.Expr

    def moved(self, axis: str, argument: sp.Expr) -> '_Walk':
        if argument == 0 or not axis:
            return self
        if axis == 'Rz':
            return _Walk(self.M, self.angle + argument)
        if axis[0] == 'T':
            along = [sp.Integer(0)] * 3
            along[AXES[axis[1]]] = argument
            turned = rotation('z', self.angle) * translation(*along)
            M = self.M.copy()
            M[:3, 3] = self.M[:3, 3] + self.M[:3, :3] * turned[:3, 3]
            return _Walk(M, self.angle)
        return _Walk(self.frame * rotation(axis[1], argument), sp.Integer(0))

    def times(self, pose: sp.Matrix) -> '_Walk':
        return self if pose == EYE else _Walk(self.frame * pose, sp.Integer(0))

    @property
    def frame(self) -> sp.Matrix:
        return self.M * rotation('z', self.angle)

    def axis(self, letter: str) -> sp.Matrix:
        # Rz leaves z alone: the third column of M.
        return self.M[:3, 2] if letter == 'z' else self.frame[:3, AXES[letter]]


class SymbolicArm:
    """The exact frames of a table and its Jacobian, in the base frame."""

    def __init__(self, table: Table) -> None:
        self.table = table

    @cached_property
    def _walked(self) -> tuple[list[_Walk], list[tuple[sp.Matrix, sp.Expr]]]:
        walk = _Walk(sp.Matrix(self.table.base), sp.Integer(0))
        walks, turns = [walk], []
        for row in self.table.rows:
            for axis, argument in _motions(row):
                if isinstance(axis, str):
                    if axis and axis[0] == 'R':
                        turns.append((walk.axis(axis[1]), argument))
                    walk = walk.moved(axis, argument)
                else:
                    walk = walk.times(argument)
            walks.append(walk)
        walks.append(walk.times(sp.Matrix(self.table.tool)))
        return walks, turns

    @cached_property
    def frames(self) -> list[sp.Matrix]:
        """Return frame 0, the frame after each row, and the tool, in the base frame."""
        return [sp.ImmutableDenseMatrix(walk.frame) for walk in self._walked[0]]

    @property
    def rows(self) -> list[sp.Matrix]:
        """Return the matrix of each row."""
        return [row_matrix(row) for row in self.table.rows]

    def between(self, i: int, j: int) -> sp.Matrix:
        """Return frame j in frame i of the table, i <= j."""
        if self.frames[i] == EYE:
            return self.frames[j]
        tool = [self.table.tool] if j > len(self.rows) else []
        return reduce(operator.mul, [*self.rows[i:j], *tool], EYE)

    @cached_property
    def jacobian(self) -> sp.Matrix:
        """Return J in base axes, reference point the tool's origin, linear rows first."""
        p = self.frames[-1][:3, 3]
        columns = []
        for variable in self.table.variables:
            w = sp.zeros(3, 1)
            for axis, argument in self._walked[1]:
                w += axis * argument.diff(variable)
            columns.append(sp.Matrix.vstack(p.diff(variable), w))
        return sp.ImmutableDenseMatrix(sp.Matrix.hstack(*columns))


def _motions(row: TableRow) -> list[tuple[str | None, sp.Expr]]:
    if row.quantities:
        return [(axis, row[name]) for axis, name in row.order.motions]
    return [(None, row.inner), (row.axis, row.argument), (None, inverse_pose(row.outer))]


LONGEST_SHOWN = 160


def shown(expression: sp.Expr) -> str:
    """
    Return an expression in its shortest cheap form; empty where that is still too long to read.
    """
    best = min((expression, sp.factor_terms(expression)), key=sp.count_ops)
    text = str(best)
    return text if len(text) <= LONGEST_SHOWN else ''
