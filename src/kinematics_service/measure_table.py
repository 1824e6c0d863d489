"""
Measures of many poses at once, row by row as `kernel.measure` lays them out.

"""

import numpy as np

from . import kernel
from .chain import Chain
from .kernel import Floats
from .packed import measure_places, pack
from .task import Task


def measure_table(chain: Chain, task: Task, q: Floats) -> Floats:
    """
    Return the measures at joint positions q (N, n), one row each; no factors, no thresholds.

    """
    rows = np.empty((len(q), chain.widths[kernel.JACOBIAN]))
    kernel.evaluate(
        chain.integers, chain.numbers, q, chain.at_rest.reshape(1, -1), kernel.JACOBIAN, rows
    )
    measures = np.empty((len(q), measure_places(chain.dof, len(task.rows)).width))
    kernel.measure(pack(chain, task), rows, q, measures)
    return measures
