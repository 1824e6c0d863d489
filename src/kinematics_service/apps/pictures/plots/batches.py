"""
One function over many joint positions, in batches: here, or by the workers of a dask cluster.

The batches are cut alike wherever they run, so that the numbers are the same bit for bit.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from ....kernel import Floats
from ....robot.robot import Robot
from ...recordings.sweep import results_of_workers

# A function of a robot and rows (k, ...) that answers each row by itself: (k, ...). Workers import
# it by its name, so it must be in a module they have; `functools.partial` of one is fine.
Batch = Callable[[Robot, Floats], Floats]

# Rows of a batch: 3 MB on the wire for six joints.
ROWS = 65_536


def map_batches(
    function: Batch, robot: Robot, array: Floats, workers: str | None = None, rows: int = ROWS
) -> Floats:
    """
    Return `function(robot, array)`, computed in batches of rows.

    Parameters
    ----------
    function
        Answers each row independently of the others.
    robot
        The arm.
    array : shape (N, ...)
        Joint positions, or whatever else the function takes row by row.
    workers
        `dask://HOST:PORT` of a scheduler whose workers have this package in the same version;
        without it this process.
    rows
        Of a batch.

    Returns
    -------
    shape (N, ...)
        Rows of the batches' results, in order.

    Raises
    ------
    SweepError
        As `results_of_workers`.
    """
    starts = range(0, max(len(array), 1), rows)
    pieces = (array[start : start + rows] for start in starts)
    if workers is None:
        return np.concatenate([function(robot, piece) for piece in pieces])
    return np.concatenate(list(results_of_workers(partial(function, robot), pieces, workers)))
