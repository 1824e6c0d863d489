"""
An arm's named factors at LANES joint positions side by side, as `factors` has them.

Number k of a step in a lane stands at k * LANES + lane.
"""

import math

from ..forward import chain_pass
from ..layout import arrays, lanes, places
from ..layout.arrays import Flat, Numbers
from . import factors
from .factors import Tape
from .task_rows import TaskRows


def _turn(operation: int, number: float, a: Flat, value: Flat, da: Numbers, db: Numbers) -> bool:
    # Writes sines or cosines, and their derivatives; returns False if an angle is too large.
    angles, sines, cosines = [0.0] * 16, [0.0] * 16, [0.0] * 16
    for lane in range(places.LANES):
        angles[lane] = number * a[lane]
        db[lane] = 0.0
    if not lanes.all_within(angles, 1, places.LARGEST_REDUCED):
        return False
    chain_pass.sines_and_cosines(angles, sines, cosines)
    if operation == places.SINE:
        for lane in range(places.LANES):
            value[lane], da[lane] = sines[lane], number * cosines[lane]
    else:
        for lane in range(places.LANES):
            value[lane], da[lane] = cosines[lane], -number * sines[lane]
    return True


def _combine(operation: int, a: Flat, b: Flat, value: Flat, da: Numbers, db: Numbers) -> None:
    # The operations that need only arithmetic.
    if operation == places.SUM:
        for lane in range(places.LANES):
            value[lane], da[lane], db[lane] = a[lane] + b[lane], 1.0, 1.0
    elif operation == places.DIFFERENCE:
        for lane in range(places.LANES):
            value[lane], da[lane], db[lane] = a[lane] - b[lane], 1.0, -1.0
    elif operation == places.PRODUCT:
        for lane in range(places.LANES):
            value[lane], da[lane], db[lane] = a[lane] * b[lane], b[lane], a[lane]
    else:
        for lane in range(places.LANES):
            value[lane], da[lane], db[lane] = -a[lane], -1.0, 0.0


def _operate(
    operation: int, number: float, a: Flat, b: Flat, value: Flat, da: Numbers, db: Numbers
) -> bool:
    # Like `factors.operate`, which does the rare operations that may be undefined in one lane.
    if operation == places.SINE or operation == places.COSINE:
        return _turn(operation, number, a, value, da, db)
    if operation <= places.PRODUCT or operation == places.NEGATIVE:
        _combine(operation, a, b, value, da, db)
        return True
    for lane in range(places.LANES):
        one = factors.operate(operation, number, a[lane], b[lane])
        value[lane], da[lane], db[lane] = one[0], one[1], one[2]
    return True


def _run_tape(tape: Tape, n: int, q: Flat, steps: Flat) -> bool:
    # Fills the steps like `factors.run_tape`; returns False if an angle is too large for that.
    width = (n + 1) * places.LANES
    da, db = [0.0] * 16, [0.0] * 16
    for i in range(tape.steps):
        operation, number = tape.operations[3 * i], tape.constants[i]
        first, second = tape.operations[3 * i + 1], tape.operations[3 * i + 2]
        step = arrays.after(steps, i * width)
        value = arrays.after(step, n * places.LANES)
        if operation <= places.JOINT:
            for k in range(n * places.LANES):
                step[k] = 0.0
            for lane in range(places.LANES):
                value[lane] = number
                if operation == places.JOINT:
                    value[lane] = number * q[first * places.LANES + lane]
                    step[first * places.LANES + lane] = number
            continue
        before, other = arrays.after(steps, first * width), arrays.after(steps, second * width)
        if not _operate(
            operation,
            number,
            arrays.after(before, n * places.LANES),
            arrays.after(other, n * places.LANES),
            value,
            da,
            db,
        ):
            return False
        for column in range(n):
            k = column * places.LANES
            for lane in range(places.LANES):
                step[k + lane] = da[lane] * before[k + lane] + db[lane] * other[k + lane]
    return True


def _write_factor(n: int, step: Flat, scales: Flat, distances: Flat, result: Flat) -> None:
    # Writes distance to its zero, value and gradient of a factor.
    squares = [0.0] * 16
    value = arrays.after(step, n * places.LANES)
    for lane in range(places.LANES):
        squares[lane] = 0.0
        result[lane] = value[lane]
    for j in range(n):
        at, scale = j * places.LANES, scales[j]
        for lane in range(places.LANES):
            result[places.LANES + at + lane] = step[at + lane]
            slope = step[at + lane] * scale
            squares[lane] += slope * slope
    for lane in range(places.LANES):
        distances[lane] = factors.distance_to_zero(value[lane], math.sqrt(squares[lane]))


def judge_factors(tape: Tape, task: TaskRows, q: Flat, judged: Flat, steps: Flat) -> bool:
    """
    Write the distances of all factors, then value and gradient of each.

    Returns False if they have to be judged one by one: an angle is too large.
    """
    n = task.joints
    if not _run_tape(tape, n, q, steps):
        return False
    for f in range(tape.factors):
        _write_factor(
            n,
            arrays.after(steps, tape.ends[f] * (n + 1) * places.LANES),
            task.column_scale,
            arrays.after(judged, f * places.LANES),
            arrays.after(judged, (tape.factors + f * (1 + n)) * places.LANES),
        )
    return True
