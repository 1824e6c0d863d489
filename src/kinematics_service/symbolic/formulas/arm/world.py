"""
Frames and Jacobian of a table at many poses, by products of matrices and their derivatives.

A second road beside the kernel: J comes from dT/dq here, not from axes and moment arms.
"""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from .numbers import Evaluation, Floats
from .table import Table, row_derivative, row_matrix


class World:
    """
    A table at N poses.

    Parameters
    ----------
    table
        The robot's, or a mistaken reading of it.
    values
        N numbers for each symbol of the table, complex ones of joints that are.
    poses
        N.
    coupling : shape (N, P, n)
        How the joints that closed loops move follow the others; None without loops.
    """

    def __init__(
        self,
        table: Table,
        values: Mapping[Any, Floats],
        poses: int,
        coupling: Floats | None = None,
    ) -> None:
        self.table = table
        self.coupling = coupling
        self.evaluation = Evaluation(values, poses)
        self.poses = poses

    @cached_property
    def rows(self) -> list[Floats]:
        """Return the matrix of each row, shape (N, 4, 4)."""
        return [self.evaluation.of_matrix(row_matrix(row)) for row in self.table.rows]

    @cached_property
    def base(self) -> Floats:
        """Return frame 0 in the base frame, shape (N, 4, 4)."""
        return self.evaluation.of_matrix(self.table.base)

    @cached_property
    def frames(self) -> list[Floats]:
        """Return frame 0, the frame after each row, and the tool, in the base frame."""
        frames = [self.base]
        for row in self.rows:
            frames.append(frames[-1] @ row)
        frames.append(frames[-1] @ self.evaluation.of_matrix(self.table.tool))
        return frames

    def between(self, i: int, j: int) -> Floats:
        """Return frame j in frame i of the table, shape (N, 4, 4)."""
        return np.asarray(np.linalg.solve(self.frames[i], self.frames[j]))

    @property
    def pose(self) -> Floats:
        """Return the tool in the base frame, shape (N, 4, 4)."""
        return self.frames[-1]

    @cached_property
    def row_columns(self) -> dict[tuple[int, int], Floats]:
        """Return what each row adds to each column of the Jacobian: keys (row, joint), (N, 6)."""
        parts = {}
        for i, row in enumerate(self.table.rows):
            for k, variable in enumerate(self.table.variables):
                if variable not in row.symbols:
                    continue
                derivative = self.evaluation.of_matrix(row_derivative(row, variable))
                # T = A row B: dT = A drow B, with B = inverse(A row) T.
                rest = np.linalg.solve(self.frames[i + 1], self.pose)
                parts[i, k] = twist_of(self.frames[i] @ derivative @ rest, self.pose)
        return parts

    @cached_property
    def jacobian(self) -> Floats:
        """
        Return J in base axes, reference point the tool's origin, shape (N, 6, n), linear first.
        """
        columns = self.row_columns.values()
        J = np.zeros((self.poses, 6, len(self.table.variables)), np.result_type(float, *columns))
        for (_, k), column in self.row_columns.items():
            J[:, :, k] += column
        if self.coupling is None:
            return J
        n = self.table.joints
        return np.asarray(J[:, :, :n] + J[:, :, n:] @ self.coupling)


def twist_of(derivative: Floats, pose: Floats) -> Floats:
    """Return the column (v, w) of a pose's derivative, shape (N, 6): v = dp, [w] = dR R^T."""
    W = derivative[:, :3, :3] @ np.swapaxes(pose[:, :3, :3], 1, 2)
    w = np.stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]], axis=-1)
    return np.concatenate([derivative[:, :3, 3], w], axis=1)
