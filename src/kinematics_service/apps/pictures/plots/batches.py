# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute a function of many configurations in batches, in this process or by workers of a dask
cluster.

This process and the workers use equal batches, so that their results are equal bit for bit.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from ....kernel import Floats
from ....robot.robot import Robot
from ...recordings.sweep import results_of_workers

# A function of a robot and an array of shape (k, ...), for example of k joint positions. It
# returns an array of shape (k, ...), and computes each row independently. The function must be in
# a module of this package, because workers import it by name; `functools.partial` of such a
# function is allowed.
Batch = Callable[[Robot, Floats], Floats]

# Number of rows (joint positions) in a batch. A batch for six joints is a message of 3 MB to a
# worker.
ROWS = 65_536


def map_batches(
    function: Batch, robot: Robot, array: Floats, workers: str | None = None, rows: int = ROWS
) -> Floats:
    """
    Return `function(robot, array)`, computed in batches of rows.

    Parameters
    ----------
    function
        Function that computes each row independently of the others.
    robot
        The arm.
    array : shape (N, ...)
        Joint positions, or other arguments of the function, row by row.
    workers
        `dask://HOST:PORT` of a scheduler whose workers have the same version of this package;
        None: this process.
    rows
        Number of rows of a batch.

    Returns
    -------
    shape (N, ...)
        The results of the batches, in order.

    Raises
    ------
    SweepError
        The workers cannot be used, see `results_of_workers`.
    """
    starts = range(0, max(len(array), 1), rows)
    pieces = (array[start : start + rows] for start in starts)
    if workers is None:
        return np.concatenate([function(robot, piece) for piece in pieces])
    return np.concatenate(list(results_of_workers(partial(function, robot), pieces, workers)))
