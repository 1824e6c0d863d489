"""Many equations made as few as there are unknowns, which tell the same of these."""

import numpy as np

from ...kernel import Floats

# Rows of a block, by columns: twice as many of 45 columns are below what OpenBLAS gives to several
# threads, which wait for each other (a sixth of the processor time).
BLOCK = 2


def triangle_of(rows: Floats) -> Floats:
    """
    Return R (k, k) of the QR factorisation of rows (m, k), of blocks of rows first.

    Products of its columns are those of the columns of the rows.
    """
    width = rows.shape[1]
    block = BLOCK * width
    while len(rows) > 2 * block > 0:
        count = len(rows) // block
        blocks = rows[: count * block].reshape(count, block, width)
        triangles = np.asarray(np.linalg.qr(blocks, mode='r')).reshape(-1, width)
        rows = np.concatenate([triangles, rows[count * block :]])
    return np.asarray(np.linalg.qr(rows, mode='r'))
