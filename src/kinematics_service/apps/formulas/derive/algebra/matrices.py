# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute with matrices of exact polynomials, stored as numpy arrays of objects."""

from typing import Any

import numpy as np
import numpy.typing as npt

from .laurent import Ring

Matrix = npt.NDArray[Any]  # array of Laurent polynomials


def identity(ring: Ring) -> Matrix:
    """Return the 4 x 4 identity with entries in the ring."""
    return np.array([[ring.number(int(i == j)) for j in range(4)] for i in range(4)])


def inverse(T: Matrix) -> Matrix:
    """Return the inverse of a 4 x 4 rigid motion."""
    result = T.copy()
    result[:3, :3] = T[:3, :3].T
    result[:3, 3] = -(T[:3, :3].T @ T[:3, 3])
    return result


def terms_in(matrix: Matrix) -> int:
    """Return the number of terms in all entries of a matrix; 0 if all entries are 0."""
    return sum(map(len, matrix.flat))
