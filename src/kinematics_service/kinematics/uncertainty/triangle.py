# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Reduce m linear equations with k unknowns to k equations, by QR factorisation in blocks."""

import numpy as np

from ...kernel import Floats

# The matrix is divided into blocks of rows. Each block has BLOCK times as many rows as columns.
# With 45 columns, OpenBLAS factorises a block of this size by one thread. For larger blocks
# OpenBLAS uses several threads. They wait for each other and take six times the processor time.
BLOCK = 2


def triangle_of(rows: Floats) -> Floats:
    """
    Return R (k, k) of the QR factorisation of the matrix `rows` (m, k), computed block by block.

    R^T R equals rows^T rows.
    """
    width = rows.shape[1]
    block = BLOCK * width
    while len(rows) > 2 * block > 0:
        count = len(rows) // block
        blocks = rows[: count * block].reshape(count, block, width)
        triangles = np.asarray(np.linalg.qr(blocks, mode='r')).reshape(-1, width)
        rows = np.concatenate([triangles, rows[count * block :]])
    return np.asarray(np.linalg.qr(rows, mode='r'))
