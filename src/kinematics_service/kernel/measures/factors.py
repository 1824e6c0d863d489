"""Values and gradients of an arm's named factors: a tape of operations, run forwards."""

import math

import numpy as np
import numpy.typing as npt

from ..forward import chain_pass
from ..layout import arrays, places
from ..layout.arrays import Flat, FlatIntegers, Floats, Integers


def _goes_together(table: Integers, ends: Integers) -> bool:
    # Returns whether every index exists; operands of a step must be earlier steps.
    operands, of_steps = table[:, 1:], table[:, 0] > places.JOINT
    earlier = operands < np.arange(len(table))[:, None]
    fits = np.all(operands >= 0) and np.all(earlier[of_steps])
    return bool(fits and np.all((ends >= 0) & (ends < len(table))))


def _dependences(table: Integers, joints: int) -> npt.NDArray[np.bool_]:
    # Which joints each step depends on.
    depends = np.zeros((len(table), joints), dtype=bool)
    for i, (operation, first, second) in enumerate(table):
        if operation == places.JOINT:
            depends[i, first] = True
        elif operation > places.JOINT:
            depends[i] = depends[first] | depends[second]
    return depends


class Tape:
    """
    A list of elementary operations, whose last results are the factors of an arm: frozen.

    To the compiled kernel the arrays are addresses that Python does not see.

    Attributes
    ----------
    operations : shape (3 steps,)
        Operation and operands of each step: earlier steps, or a joint.
    constants : shape (steps,)
        The constant, or the scale, of each step.
    ends : shape (factors,)
        The step that holds each factor's value.
    steps, factors
        Their number.
    joints
        Least number of joints.
    dependences : shape (factors, joints), bool
        Which joints each factor depends on.
    """

    def __init__(self, operations: Integers, constants: Floats, ends: Integers) -> None:
        table = operations.reshape(-1, 3)
        if len(table) != len(constants) or not _goes_together(table, ends):
            raise TypeError('the arrays of a tape do not go together')
        self._arrays: tuple[object, ...] = operations, constants, ends
        self.steps: int = len(constants)
        self.factors: int = len(ends)
        self.joints: int = int(np.max(table[table[:, 0] == places.JOINT, 1], initial=-1)) + 1
        self.dependences: npt.NDArray[np.bool_] = _dependences(table, self.joints)[ends]
        self.operations: FlatIntegers = arrays.whole(operations, 3 * self.steps)
        self.constants: Flat = arrays.numbers(constants, self.steps)
        self.ends: FlatIntegers = arrays.whole(ends, self.factors)


def run_tape(tape: Tape, n: int, q: Flat, steps: Flat) -> None:
    """Fill `steps` with gradient and, last, value of each step of a tape at q (n,)."""
    width = n + 1
    for i in range(tape.steps):
        operation, number = tape.operations[3 * i], tape.constants[i]
        first, second = tape.operations[3 * i + 1], tape.operations[3 * i + 2]
        step = arrays.after(steps, i * width)
        if operation <= places.JOINT:
            for j in range(n):
                step[j] = 0.0
            step[n] = number
            if operation == places.JOINT:
                step[n] = number * q[first]
                step[first] = number
            continue
        before, other = arrays.after(steps, first * width), arrays.after(steps, second * width)
        value, da, db = operate(operation, number, before[n], other[n])
        for j in range(n):
            step[j] = da * before[j] + db * other[j]
        step[n] = value


def operate(operation: int, number: float, a: float, b: float) -> tuple[float, float, float]:
    """Return the value of a step, and its derivatives by its operands."""
    if operation == places.SUM:
        return a + b, 1.0, 1.0
    if operation == places.DIFFERENCE:
        return a - b, 1.0, -1.0
    if operation == places.PRODUCT:
        return a * b, b, a
    if operation == places.NEGATIVE:
        return -a, -1.0, 0.0
    if operation == places.SINE:
        s, c = chain_pass.sincos(number * a)
        return s, number * c, 0.0
    if operation == places.COSINE:
        s, c = chain_pass.sincos(number * a)
        return c, -number * s, 0.0
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
    """Return the distance to the zero of a factor by its gradient's length, at most pi."""
    if value == 0.0:
        return 0.0
    return abs(value) / slope if abs(value) < places.PI * slope else places.PI


def evaluate_factors(tape: Tape, q: Floats, results: Floats) -> None:
    """Fill `results` (N, factors, 1 + n) with value and gradient of each factor at q (N, n)."""
    arrays.given(tape)
    count, n, factors = arrays.extent(q, 0), arrays.extent(q, 1), tape.factors
    if n < tape.joints:
        raise TypeError('the arrays of factors do not go together')
    positions = arrays.numbers(q, 0)
    result = arrays.results(results, count * factors * (1 + n))
    steps = arrays.scratch(tape.steps * (n + 1))
    for k in range(count):
        run_tape(tape, n, arrays.after(positions, k * n), steps)
        for f in range(factors):
            one = arrays.after(result, (k * factors + f) * (1 + n))
            step = arrays.after(steps, tape.ends[f] * (n + 1))
            one[0] = step[n]
            for j in range(n):
                one[1 + j] = step[j]
    arrays.give_back(steps)
