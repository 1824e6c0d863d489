# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the values and gradients of the singular factors that the robot file names.

A tape is a list of operations that computes the factors. The method is forward automatic
differentiation: each operation, a step of the tape, gives a value and a gradient. Several poses
can be computed at once. Their arrays are then interleaved: first the first number of each pose,
then the second number of each pose, and so on. A pose has bit for bit the same results if it is
computed alone.
"""

import math

import numpy as np

from ..forward import chain_pass
from ..layout import arrays, blocks, places
from ..layout.arrays import Flat, Floats, Integers, Numbers
from .task_rows import TaskRows


def _goes_together(table: Integers, ends: Integers) -> bool:
    # A row of `table` has one operation and two operands. Each operand is the index of an earlier
    # row; for JOINT it is the index of a joint. `ends` has indices of rows. Returns whether all
    # indices are valid.
    operands, of_steps = table[:, 1:], table[:, 0] > places.JOINT
    earlier = operands < np.arange(len(table))[:, None]
    fits = np.all(operands >= 0) and np.all(earlier[of_steps])
    return bool(fits and np.all((ends >= 0) & (ends < len(table))))


class Tape:
    """
    The list of elementary operations that computes the singular factors of an arm; immutable.

    In the compiled kernel the attributes with a shape are pointers, which Python code cannot read.

    Attributes
    ----------
    operations : shape (3 steps,)
        Operation and two operands of each step. An operand is the index of an earlier step, or of
        a joint.
    constants : shape (steps,)
        A number c for each step. The step CONSTANT has the value c. JOINT, SINE and COSINE
        multiply the operand by c, and ARC_TANGENT divides the angle by c.
    ends : shape (factors,)
        Index of the step that computes the value of each factor.
    steps, factors
        Numbers of steps and of factors.
    joints
        Smallest number of joints that an arm must have: the largest joint index plus 1.
    """

    def __init__(self, operations: Integers, constants: Floats, ends: Integers) -> None:
        table = operations.reshape(-1, 3)
        if len(table) != len(constants) or not _goes_together(table, ends):
            raise TypeError('the arrays of a tape do not go together')
        self.steps, self.factors = len(constants), len(ends)
        self.joints: int = int(np.max(table[table[:, 0] == places.JOINT, 1], initial=-1)) + 1
        self.operations = arrays.whole(operations, 3 * self.steps)
        self.constants = arrays.numbers(constants, self.steps)
        self.ends = arrays.whole(ends, self.factors)


def _run_tape(tape: Tape, n: int, q: Flat, steps: Flat, lanes: int) -> bool:
    # Computes all steps of the tape, and so the factors, at q (n,). Writes the gradient (n,) and
    # the value of each step to `steps`. Returns False if several poses are computed at once and an
    # angle is above LARGEST_REDUCED.
    width = (n + 1) * lanes
    da, db = [0.0] * 16, [0.0] * 16  # one number for each of LANES poses
    for i in range(tape.steps):
        operation, number = tape.operations[3 * i], tape.constants[i]
        first, second = tape.operations[3 * i + 1], tape.operations[3 * i + 2]
        step = arrays.after(steps, i * width)
        value = arrays.after(step, n * lanes)
        if operation <= places.JOINT:
            arrays.fill(step, n * lanes, 0.0)
            for lane in range(lanes):
                value[lane] = number
                if operation == places.JOINT:
                    value[lane] = number * q[first * lanes + lane]
                    step[first * lanes + lane] = number
            continue
        before, other = arrays.after(steps, first * width), arrays.after(steps, second * width)
        a, b = arrays.after(before, n * lanes), arrays.after(other, n * lanes)
        if not _operate(operation, number, a, b, value, da, db, lanes):
            return False
        for column in range(n):
            k = column * lanes
            for lane in range(lanes):
                step[k + lane] = da[lane] * before[k + lane] + db[lane] * other[k + lane]
    return True


def _operate(
    operation: int,
    number: float,
    a: Flat,
    b: Flat,
    value: Flat,
    da: Numbers,
    db: Numbers,
    lanes: int,
) -> bool:
    # Writes the value of one step of a tape, and the derivatives da and db of the value by the two
    # operands. Returns False if several poses are computed at once and an angle is above
    # LARGEST_REDUCED.
    if operation == places.SINE or operation == places.COSINE:
        return _write_sines(operation, number, a, value, da, db, lanes)
    if operation <= places.PRODUCT or operation == places.NEGATIVE:
        _combine(operation, a, b, value, da, db, lanes)
        return True
    for lane in range(lanes):
        result = _partial(operation, number, a[lane], b[lane])
        value[lane], da[lane], db[lane] = result[0], result[1], result[2]
    return True


def _write_sines(
    operation: int, number: float, a: Flat, value: Flat, da: Numbers, db: Numbers, lanes: int
) -> bool:
    # Writes the sines or cosines of the operand, and their derivatives. Returns False if several
    # poses are computed at once and an angle is above LARGEST_REDUCED.
    angles, sines, cosines = [0.0] * 16, [0.0] * 16, [0.0] * 16
    for lane in range(lanes):
        angles[lane] = number * a[lane]
        db[lane] = 0.0
    if lanes == 1:
        pair = chain_pass.sincos(angles[0])
        sines[0], cosines[0] = pair[0], pair[1]
    elif blocks.all_within(angles, 1, places.LARGEST_REDUCED):
        chain_pass.sines_and_cosines(angles, sines, cosines)
    else:
        return False
    if operation == places.SINE:
        for lane in range(lanes):
            value[lane], da[lane] = sines[lane], number * cosines[lane]
    else:
        for lane in range(lanes):
            value[lane], da[lane] = cosines[lane], -number * sines[lane]
    return True


def _combine(
    operation: int, a: Flat, b: Flat, value: Flat, da: Numbers, db: Numbers, lanes: int
) -> None:
    # Writes the sum, difference, product or negative of the operands, and its derivatives by the
    # operands.
    if operation == places.SUM:
        for lane in range(lanes):
            value[lane], da[lane], db[lane] = a[lane] + b[lane], 1.0, 1.0
    elif operation == places.DIFFERENCE:
        for lane in range(lanes):
            value[lane], da[lane], db[lane] = a[lane] - b[lane], 1.0, -1.0
    elif operation == places.PRODUCT:
        for lane in range(lanes):
            value[lane], da[lane], db[lane] = a[lane] * b[lane], b[lane], a[lane]
    else:
        for lane in range(lanes):
            value[lane], da[lane], db[lane] = -a[lane], -1.0, 0.0


def _partial(operation: int, number: float, a: float, b: float) -> tuple[float, float, float]:
    # Returns the value of a quotient, square root or arc tangent, and its derivatives by the two
    # operands; NaN if the operation is undefined.
    if operation == places.QUOTIENT and b != 0.0:
        return a / b, 1.0 / b, -a / (b * b)
    if operation == places.SQUARE_ROOT and a >= 0.0:
        root = math.sqrt(a)
        return root, 0.5 / root if a > 0.0 else 0.0, 0.0
    if operation == places.ARC_TANGENT:
        squares = a * a + b * b
        angle = math.atan2(a, b) / number
        if squares > 0.0:
            return angle, b / squares / number, -a / squares / number
        return angle, 0.0, 0.0
    return places.NAN, places.NAN, places.NAN


def distance_to_zero(value: float, slope: float) -> float:
    """
    Return the first-order distance to the zero of a factor, |value| / slope, rad, at most pi.
    `slope` is the norm of the scaled gradient of the factor.
    """
    if value == 0.0:
        return 0.0
    return abs(value) / slope if abs(value) < places.PI * slope else places.PI


def judge_factors(
    tape: Tape, task: TaskRows, distances: int, q: Flat, judged: Flat, steps: Flat, lanes: int
) -> bool:
    """
    Write to `judged` the distances to the zeros of all factors, then the value and gradient of
    each factor.

    `distances` is the number of places for distances at the beginning of `judged`; the values and
    gradients follow. Returns False if several poses are computed at once and an angle is above
    LARGEST_REDUCED. The caller must then call `judge_factors` for each pose alone.
    """
    if lanes == 1:
        return _judge_factors(tape, task, distances, q, judged, steps, 1)
    return _judge_factors(tape, task, distances, q, judged, steps, places.LANES)


def _judge_factors(
    tape: Tape, task: TaskRows, distances: int, q: Flat, judged: Flat, steps: Flat, lanes: int
) -> bool:
    n = task.joints
    if not _run_tape(tape, n, q, steps, lanes):
        return False
    for f in range(tape.factors):
        step = arrays.after(steps, tape.ends[f] * (n + 1) * lanes)
        result = arrays.after(judged, (distances + f * (1 + n)) * lanes)
        _write_factor(n, step, task.column_scale, arrays.after(judged, f * lanes), result, lanes)
    return True


def _write_factor(
    n: int, step: Flat, scales: Flat, distances: Flat, result: Flat, lanes: int
) -> None:
    # Writes to `distances` the first-order distance to the zero of one factor, and to `result` the
    # value and gradient of this factor.
    squares = [0.0] * 16
    value = arrays.after(step, n * lanes)
    for lane in range(lanes):
        squares[lane] = 0.0
        result[lane] = value[lane]
    for j in range(n):
        at, scale = j * lanes, scales[j]
        for lane in range(lanes):
            result[lanes + at + lane] = step[at + lane]
            slope = step[at + lane] * scale
            squares[lane] += slope * slope
    for lane in range(lanes):
        distances[lane] = distance_to_zero(value[lane], math.sqrt(squares[lane]))


def evaluate_factors(tape: Tape, q: Floats, results: Floats) -> None:
    """
    Fill `results` (N, factors, 1 + n) with the value and the gradient of each factor at N joint
    positions q.
    """
    count, n, factors = arrays.extent(q, 0), arrays.extent(q, 1), tape.factors
    if n < tape.joints:
        raise TypeError('the arrays of factors do not go together')
    positions = arrays.numbers(q, 0)
    result = arrays.results(results, count * factors * (1 + n))
    steps = arrays.scratch(tape.steps * (n + 1))
    for k in range(count):
        _run_tape(tape, n, arrays.after(positions, k * n), steps, 1)
        for f in range(factors):
            factor = arrays.after(result, (k * factors + f) * (1 + n))
            step = arrays.after(steps, tape.ends[f] * (n + 1))
            factor[0] = step[n]
            arrays.copy(arrays.after(factor, 1), n, step)
    arrays.give_back(steps)
