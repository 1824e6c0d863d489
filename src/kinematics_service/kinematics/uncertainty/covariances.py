"""The covariances of pose and twist of a state, by what may be off in the arm."""

import math

import numpy as np

from ... import kernel
from ...kernel import Floats, PoseErrors
from ...robot.points import TOOL
from ..forward import BASE
from ..tool_state import ToolState


def covariances(errors: PoseErrors, state: ToolState, axes: str = BASE) -> Floats:
    """
    Return the covariances of pose and twist, shape (..., 2, 6, 6), of a state with all frames.

    Those of the twist are of its numbers in these axes, `base` or `tool`.
    """
    qdot = np.zeros_like(state.q) if state.qdot is None else state.qdot
    count = math.prod(state.row.shape[:-1])
    rows, positions, rates = (
        np.ascontiguousarray(table).reshape(count, table.shape[-1])
        for table in (state.row, state.q, qdot)
    )
    found = np.empty((count, 2, 6, 6))
    kernel.covariances(errors, rows, positions, rates, axes == TOOL, found)
    return found.reshape(*state.row.shape[:-1], 2, 6, 6)
