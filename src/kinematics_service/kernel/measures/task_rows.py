# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Select and scale the rows of the Jacobian from which the singularity measures are computed."""

import numpy as np

from ..layout import arrays
from ..layout.arrays import Floats, Integers


class TaskRows:
    """
    The rows of the Jacobian that the task uses, and their scale factors; immutable. The rows form
    the task Jacobian J_t, in the axes of frame 0.

    In the compiled kernel the attributes with a shape are pointers, which Python code cannot read.

    Attributes
    ----------
    joints, count
        Number n of columns, and number m of rows.
    generic_rank
        Rank of J_t at random joint positions.
    axis : shape (m,)
        Index, 0 to 5, of the row of the Jacobian that gives each row of J_t.
    rotation : shape (9,)
        The rotation of frame 0 in the base frame, row by row.
    row_scale : shape (m,), column_scale : shape (n,)
        Factors of the rows and columns of the scaled J_t.
    zero
        Singular values up to this number, in meters, are taken as zero. This bound does not depend
        on the largest singular value.
    """

    def __init__(
        self,
        generic_rank: int,
        axis: Integers,
        rotation: Floats,
        row_scale: Floats,
        column_scale: Floats,
        zero: float = 0.0,
    ) -> None:
        rows_are_there = bool(np.all((axis >= 0) & (axis < 6)))
        if not (rows_are_there and 0 < generic_rank <= min(len(axis), len(column_scale))):
            raise TypeError('the arrays of a task do not go together')
        self.joints, self.count, self.generic_rank = len(column_scale), len(axis), generic_rank
        self.zero: float = zero
        self.axis = arrays.whole(axis, self.count)
        self.rotation = arrays.numbers(rotation, 9)
        self.row_scale = arrays.numbers(row_scale, self.count)
        self.column_scale = arrays.numbers(column_scale, self.joints)
