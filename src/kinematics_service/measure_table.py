"""
Measures of many poses at once, row by row as `kernel.measure` lays them out.

"""

import numpy as np

from . import kernel
from .chain import Chain
from .kernel import Floats
from .task import Task


def measure_rows(chain: Chain, task: Task, rows: Floats) -> Floats:
    """
    Return the measures of evaluated rows (N, width), one row each.

    """
    n, m = chain.dof, len(task.rows)
    measures = np.empty((len(rows), kernel.LOST_AT + 6 + 2 * n + min(m, n)))
    kernel.measure(chain.integers, task.integers, task.numbers, rows, measures)
    return measures


def measure_table(chain: Chain, task: Task, q: Floats) -> Floats:
    """
    Return the measures at joint positions q (N, n), one row each.

    """
    rows = np.empty((len(q), chain.widths[kernel.JACOBIAN]))
    kernel.evaluate(
        chain.integers, chain.numbers, q, chain.at_rest.reshape(1, -1), kernel.JACOBIAN, rows
    )
    return measure_rows(chain, task, rows)
