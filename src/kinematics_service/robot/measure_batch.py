"""Measures of many poses at once, row by row as `kernel.measure` lays them out."""

import numpy as np

from .. import kernel
from ..kernel import Chain, Floats
from .measure_places import measure_places
from .task import Task

NO_FACTORS = kernel.Tape(np.empty(0, dtype=np.int64), np.empty(0), np.empty(0, dtype=np.int64))


def measure_table(chain: Chain, task: Task, q: Floats) -> Floats:
    """Return the measures at joint positions q (N, n), one row each; no factors, no thresholds."""
    rows = np.empty((len(q), chain.widths[kernel.JACOBIAN]))
    kernel.evaluate(chain, q, chain.at_rest.reshape(1, -1), kernel.JACOBIAN, rows)
    arm = kernel.Arm(chain, task.kernel_rows, NO_FACTORS, False, kernel.DISTANCE, 0.0, 0.0)
    measures = np.empty((len(q), measure_places(chain.dof, len(task.rows)).width))
    kernel.measure(arm, rows, q, measures)
    return measures
