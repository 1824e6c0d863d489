"""
Values and gradients of an arm's named factors: a tape of operations, run forwards.

"""

import math

from . import arrays, chain_pass, places
from .arrays import Floats, Integers


def run_tape(
    integers: Integers, numbers: Floats, count: int, n: int, q: Floats, steps: Floats
) -> None:
    """
    Fill `steps` with gradient and, last, value of each of `count` steps of a tape at q (n,).

    """
    width = n + 1
    for i in range(count):
        operation, first, second = integers[3 * i], integers[3 * i + 1], integers[3 * i + 2]
        number = numbers[i]
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
        value, da, db = _operate(operation, number, before[n], other[n])
        for j in range(n):
            step[j] = da * before[j] + db * other[j]
        step[n] = value


def _operate(operation: int, number: float, a: float, b: float) -> tuple[float, float, float]:
    # The value of a step, and its derivatives by its operands.
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
    """
    Return the distance to the zero of a factor by its gradient's length, at most pi.

    """
    if value == 0.0:
        return 0.0
    return abs(value) / slope if abs(value) < places.PI * slope else places.PI


def evaluate_factors(
    integers: Integers, numbers: Floats, ends: Integers, q: Floats, results: Floats
) -> None:
    """
    Fill `results` (N, factors, 1 + n) with value and gradient of each factor at q (N, n).

    Parameters
    ----------
    integers : shape (3 steps,), numbers : shape (steps,), ends : shape (factors,)
        The tape: operation and operands of each step, its constant or scale, the factors' steps.

    """
    count, n = arrays.extent(q, 0), arrays.extent(q, 1)
    tape_steps, factors = arrays.size(numbers), arrays.size(ends)
    tape = arrays.whole(integers, 3 * tape_steps)
    constants, last = arrays.numbers(numbers, 0), arrays.whole(ends, 0)
    positions = arrays.numbers(q, 0)
    result = arrays.results(results, count * factors * (1 + n))
    steps = arrays.scratch(tape_steps * (n + 1))
    for k in range(count):
        run_tape(tape, constants, tape_steps, n, arrays.after(positions, k * n), steps)
        for f in range(factors):
            one = arrays.after(result, (k * factors + f) * (1 + n))
            step = arrays.after(steps, last[f] * (n + 1))
            one[0] = step[n]
            for j in range(n):
                one[1 + j] = step[j]
    arrays.give_back(steps)
