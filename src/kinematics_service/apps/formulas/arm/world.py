# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Evaluate frames and Jacobian of a table at many configurations, by products of the row matrices and
their derivatives.

This module computes the Jacobian from dT/dq. The kernel of the package computes the Jacobian from
joint axes and moment arms, so the two results are independent.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate

import numpy as np
import sympy as sp

from .numbers import Evaluation, Floats
from .table import Table, row_derivative, row_matrix


@dataclass(eq=False)
class World:
    """
    The frames and the Jacobian of a robot's table, evaluated at N configurations.

    Parameters
    ----------
    table
        The robot's table, or the table with one mistake that may explain a wrong formula of the
        user.
    values
        N numbers for each symbol of the table; complex if the joint positions are complex.
    poses
        The number N of configurations.
    coupling : shape (N, P, n)
        Rates of the P passive joints per rate of the n active joints; None without closed loops.
    still
        Known values of row matrices, shape (N, 4, 4), by row index. These rows are not evaluated
        again.
    """

    table: Table
    values: Mapping[sp.Symbol, Floats]
    poses: int
    coupling: Floats | None = None
    still: Mapping[int, Floats] = field(default_factory=dict)

    @cached_property
    def evaluation(self) -> Evaluation:
        """Return the object that evaluates expressions at the N configurations."""
        return Evaluation(self.values, self.poses)

    @cached_property
    def rows(self) -> list[Floats]:
        """Return the matrix of each row of the table, shape (N, 4, 4)."""
        return [
            self.still[i] if i in self.still else self.evaluation.of_matrix(row_matrix(row))
            for i, row in enumerate(self.table.rows)
        ]

    @cached_property
    def base(self) -> Floats:
        """Return the pose of frame 0 in the base frame, shape (N, 4, 4)."""
        return self.evaluation.of_matrix(self.table.base)

    @cached_property
    def frames(self) -> list[Floats]:
        """
        Return the poses of all frames in the base frame, each of shape (N, 4, 4).

        The list begins with frame 0 and ends with the tool. Between them are frames 1 to m: row i
        of the table leads from frame i - 1 to frame i, and the table has m rows.
        """
        return [*accumulate((self.base, *self.rows, self.tool), np.matmul)]

    @cached_property
    def tool(self) -> Floats:
        """Return the pose of the tool in the last frame of the table, shape (N, 4, 4)."""
        return self.evaluation.of_matrix(self.table.tool)

    def frame(self, at: int) -> Floats:
        """
        Return the pose of frame number `at` in the base frame, shape (N, 4, 4). The number -1
        means the base frame itself, so the pose is the identity.
        """
        return np.broadcast_to(np.eye(4), self.base.shape) if at < 0 else self.frames[at]

    def between(self, i: int, j: int) -> Floats:
        """
        Return the pose of frame j in frame i, shape (N, 4, 4). For the numbers i and j see
        `frame`.
        """
        return np.asarray(np.linalg.solve(self.frame(i), self.frame(j)))

    @property
    def pose(self) -> Floats:
        """Return the pose of the tool in the base frame, shape (N, 4, 4)."""
        return self.frames[-1]

    @cached_property
    def row_columns(self) -> dict[tuple[int, int], Floats]:
        """
        Return the twist that each row of the table adds to each Jacobian column. The keys are
        (row, joint), the values have shape (N, 6).
        """
        return self._row_columns(range(len(self.table.variables)))

    def _row_columns(self, joints: Sequence[int]) -> dict[tuple[int, int], Floats]:
        parts = {}
        for i, row in enumerate(self.table.rows):
            for k in joints:
                variable = self.table.variables[k]
                if variable not in row.symbols:
                    continue
                derivative = self.evaluation.of_matrix(row_derivative(row, variable))
                # The tool's pose is T = A M B, where M is the matrix of this row, and A and B do
                # not depend on M. So its derivative is dT = A dM B.
                dT = self.frames[i] @ derivative @ self._behind[i]
                parts[i, k] = twist_of(dT, self.pose)
        return parts

    @cached_property
    def _behind(self) -> list[Floats]:
        # Return the pose of the tool in each of the frames 1 to m, shape (N, 4, 4).
        behind = accumulate((self.tool, *reversed(self.rows[1:])), lambda T, row: row @ T)
        return [*behind][::-1]

    def columns_of(self, joints: Sequence[int]) -> Floats:
        """
        Return the Jacobian columns of the k joints in `joints`, as if all closed loops were open,
        shape (N, 6, k).
        """
        parts = self._row_columns(joints)
        J = np.zeros((self.poses, 6, len(joints)), np.result_type(float, *parts.values()))
        for (_, k), column in parts.items():
            J[:, :, joints.index(k)] += column
        return J

    @cached_property
    def jacobian(self) -> Floats:
        """
        Return the Jacobian in base axes, shape (N, 6, n), linear rows first. The reference point
        is the tool's origin.
        """
        J = self.columns_of(range(len(self.table.variables)))
        if self.coupling is None:
            return J
        n = self.table.joints
        return np.asarray(J[:, :, :n] + J[:, :, n:] @ self.coupling)


def with_constants(
    table: Table, variables: Mapping[sp.Symbol, Floats], poses: int
) -> dict[sp.Symbol, Floats]:
    """
    Return the values of all symbols of a table at N configurations: `variables` holds the values
    of the joint variables, and the table gives those of its constants.
    """
    values = dict(variables)
    for symbol in table.constants:
        if symbol in table.derived:
            values[symbol] = Evaluation(values, poses).of(table.derived[symbol])
        else:
            values[symbol] = np.full(poses, table.given[symbol])
    return values


def twist_of(derivative: Floats, pose: Floats) -> Floats:
    """
    Return the twist (v, w) of a moving frame, shape (N, 6).

    `pose` contains the rotation R and the position p of the frame. The derivative of the pose
    contains dR and dp. The linear part of the twist is v = dp. The cross product matrix of the
    angular part w is dR R^T.
    """
    W = derivative[:, :3, :3] @ np.swapaxes(pose[:, :3, :3], 1, 2)
    w = np.stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]], axis=-1)
    return np.concatenate([derivative[:, :3, 3], w], axis=1)
