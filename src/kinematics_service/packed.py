"""
Everything the kernel reads of an arm in one array: one argument of a call instead of nine.

"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from . import kernel
from .chain import Chain
from .kernel import Floats, Integers
from .measures import Thresholds
from .task import Task

if TYPE_CHECKING:
    from .factors import Factors

# Where each measure stands in a row of measures.
COLUMN = {
    'determinant': kernel.DETERMINANT,
    'manipulability': kernel.MANIPULABILITY,
    'condition_number': kernel.CONDITION_NUMBER,
    'smallest_singular_value': kernel.SMALLEST_SINGULAR_VALUE,
    'distance': kernel.DISTANCE,
}


def pack(
    chain: Chain,
    task: Task,
    factors: 'Factors | None' = None,
    thresholds: Thresholds | None = None,
) -> Floats:
    """
    Return an arm as the kernel reads it: a header of kernel.ARM_HEADER numbers, then its parts.

    Whole numbers stand in it bit for bit. It is read-only.

    """
    given = factors is not None and len(factors.names) > 0
    tape = factors.integers if factors is not None and given else np.empty(0, dtype=np.int64)
    constants = factors.numbers if factors is not None and given else np.empty(0)
    ends = factors.ends if factors is not None and given else np.empty(0, dtype=np.int64)
    parts = (
        (kernel.CHAIN_INTEGERS_AT, chain.integers),
        (kernel.CHAIN_NUMBERS_AT, chain.numbers),
        (kernel.TASK_INTEGERS_AT, task.integers),
        (kernel.TASK_NUMBERS_AT, task.numbers),
        (kernel.TAPE_AT, tape.ravel()),
        (kernel.TAPE_NUMBERS_AT, constants),
        (kernel.FACTOR_ENDS_AT, ends),
    )
    arm = np.zeros(kernel.ARM_HEADER + sum(part.size for _, part in parts))
    whole: Integers = arm.view(np.int64)
    at = kernel.ARM_HEADER
    for name, part in parts:
        whole[name] = at
        into = whole if part.dtype == np.int64 else arm
        into[at : at + part.size] = part
        at += part.size
    whole[kernel.TAPE_STEPS] = constants.size
    whole[kernel.FACTORS] = ends.size
    whole[kernel.FACTORS_COMPLETE] = factors is not None and factors.complete
    whole[kernel.WATCHED_COLUMN] = kernel.DISTANCE
    if thresholds is not None:
        whole[kernel.WATCHED_COLUMN] = COLUMN[thresholds.measure]
        arm[kernel.WARN], arm[kernel.STOP] = thresholds.warn, thresholds.stop
    arm.setflags(write=False)
    return arm


class MeasurePlaces(NamedTuple):
    """
    Where things stand in a row of measures, as `kernel.measure` fills it.

    Attributes
    ----------
    lost, motion, way, sigma
        First column of the lost direction, the joint motion, the way out, the singular values.
    judged
        First of the columns kernel.WATCHED, LEVEL and NEAREST.
    distances, results
        First column of the factors' distances, and of their values and gradients.
    width
        Number of columns.

    """

    lost: int
    motion: int
    way: int
    sigma: int
    judged: int
    distances: int
    results: int
    width: int


def measure_places(dof: int, rows: int, factors: int = 0) -> MeasurePlaces:
    """
    Return the places of an arm with so many joints, rows of the task, and factors.

    """
    motion = kernel.LOST_AT + 6
    way = motion + dof
    sigma = way + dof
    judged = sigma + min(dof, rows)
    distances = judged + kernel.JUDGED
    results = distances + factors
    width = results + factors * (1 + dof)
    return MeasurePlaces(kernel.LOST_AT, motion, way, sigma, judged, distances, results, width)
