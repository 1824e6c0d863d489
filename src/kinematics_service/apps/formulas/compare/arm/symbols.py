# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute frames and Jacobian of a table in symbols. As in textbooks, angles about parallel axes are
added: sin(q1 + q2).

Formulas such as `z_0 x (o_3 - o_0)` get the values of z_0 and o_3 from this module. A report
prints the correct entries beside wrong entries.
"""

import operator
from dataclasses import dataclass
from functools import cached_property, reduce

import sympy as sp

from ...arm.table import AXES, EYE, ZERO, Table, inverse_pose, motion, rotation, row_matrix


@dataclass(frozen=True)
class _Walk:
    # This class stores a frame as the product M Rz(angle). The angle stays separate until a
    # rotation about x or y, or a constant pose, follows.
    M: sp.Matrix
    angle: sp.Expr

    def moved(self, axis: str, argument: sp.Expr | sp.Matrix) -> '_Walk':
        if axis == 'Rz':
            return _Walk(self.M, self.angle + argument)
        pose = motion(axis, argument)
        if pose == EYE:
            return self
        if axis.startswith('T'):
            M = self.M.copy()
            M[:3, 3] += M[:3, :3] * (rotation('z', self.angle) * pose)[:3, 3]
            return _Walk(M, self.angle)
        return _Walk(self.frame * pose, ZERO)

    @property
    def frame(self) -> sp.Matrix:
        return self.M * rotation('z', self.angle)


@dataclass(eq=False)
class SymbolicArm:
    """The frames and the Jacobian of a table as exact expressions, in the base frame."""

    table: Table

    @cached_property
    def _walked(self) -> tuple[list[_Walk], list[tuple[sp.Matrix, sp.Expr]]]:
        walk = _Walk(sp.Matrix(self.table.base), ZERO)
        walks, turns = [walk], []
        for row in self.table.rows:
            for axis, argument in row.factors:
                if axis.startswith('R'):
                    turns.append((walk.frame[:3, AXES[axis[1]]], argument))
                walk = walk.moved(axis, argument)
            walks.append(walk)
        walks.append(walk.moved('', self.table.tool))
        return walks, turns

    @cached_property
    def frames(self) -> list[sp.Matrix]:
        """
        Return the 4 x 4 poses of frame 0, of frames 1 to m for the m rows of the table, and of the
        tool in the base frame. Row i leads from frame i - 1 to frame i.
        """
        return [sp.ImmutableDenseMatrix(walk.frame) for walk in self._walked[0]]

    @property
    def rows(self) -> list[sp.Matrix]:
        """Return the 4 x 4 matrix of each row of the table."""
        return [row_matrix(row) for row in self.table.rows]

    def frame(self, at: int) -> sp.Matrix:
        """
        Return the 4 x 4 pose of frame number `at` of the table in the base frame. The number -1
        means the base frame itself, so the pose is the identity.
        """
        return EYE if at < 0 else self.frames[at]

    def between(self, i: int, j: int) -> sp.Matrix:
        """Return the 4 x 4 pose of frame j in frame i. For the numbers i and j see `frame`."""
        if i > j:
            return inverse_pose(self.between(j, i))
        if self.frame(i) == EYE:
            return self.frame(j)
        tool = [self.table.tool] if j > len(self.rows) else []
        return reduce(operator.mul, [*self.rows[i:j], *tool], EYE)

    @cached_property
    def jacobian(self) -> sp.Matrix:
        """
        Return the Jacobian in base axes, linear rows first. Its reference point is the tool's
        origin.
        """
        p = self.frames[-1][:3, 3]
        columns = []
        for variable in self.table.variables:
            turns = (axis * argument.diff(variable) for axis, argument in self._walked[1])
            w = sum(turns, sp.zeros(3, 1))
            columns.append(sp.Matrix.vstack(p.diff(variable), w))
        return sp.ImmutableDenseMatrix(sp.Matrix.hstack(*columns))


# Maximum number of characters of the correct expression that a report prints beside the user's
# wrong entry. A report leaves out a longer expression.
MAX_SHOWN_CHARACTERS = 160


def shown(expression: sp.Expr) -> str:
    """
    Return the text of an expression, factored if this is shorter; empty if the text is too long.
    """
    best = min((expression, sp.factor_terms(expression)), key=sp.count_ops)
    text = str(best)
    return text if len(text) <= MAX_SHOWN_CHARACTERS else ''
