# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The numbers of the kernel that must be the same on every machine, as a hash for each arm.

    python test/kernel/kernel_numbers.py [robot ...]

prints the lines of kernel_numbers.txt: an arm, a function, the sha256 of what it computed.

What enters the hashes: the constants of the bundled arms to nine decimals, so that the versions of
numpy and sympy they come from do not matter (`constants` is their hash); a tape of factors that is
written below; and poses from the generator below. What does not: all that calls atan2, pow, log,
or sine and cosine beyond 1e5 rad of the C library, whose last digit each machine has its own way
with: inverse kinematics, and factors with an arc tangent.
"""

import hashlib
import sys

import numpy as np

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.kernel.layout import places

# Two blocks of poses side by side, and a rest.
POSES = 2 * kernel.LANES + 3
SINGLY = 3
# Poses whose nearest singular pose is searched: plain Python takes 50 ms for each.
SEARCHED = 10
DECIMALS = 9


class Generator:
    """Numbers between -1 and 1 by Knuth's linear congruences (MMIX): the same everywhere."""

    def __init__(self):
        self.state = 1

    def numbers(self, *shape):
        found = []
        for _ in range(int(np.prod(shape))):
            self.state = (6364136223846793005 * self.state + 1442695040888963407) % 2**64
            found.append((self.state >> 11) / 2.0**52 - 1.0)
        return np.array(found).reshape(shape)


def rounded(array):
    # 0.0 takes the sign from a zero.
    return np.round(array, DECIMALS) + 0.0 if array.dtype == np.float64 else array.copy()


def tape(n):
    """Return a tape with every operation but the arc tangent, and three factors."""
    steps = [
        (places.JOINT, 0, 0, 1.0),
        (places.JOINT, n - 1, 0, -0.5),
        (places.CONSTANT, 0, 0, 0.25),
        (places.SUM, 0, 1, 1.0),
        (places.SINE, 3, 3, 2.0),
        (places.COSINE, 1, 1, 1.0),
        (places.PRODUCT, 4, 5, 1.0),
        (places.DIFFERENCE, 6, 2, 1.0),
        (places.NEGATIVE, 7, 7, 1.0),
        (places.QUOTIENT, 8, 5, 1.0),
        (places.PRODUCT, 4, 4, 1.0),
        (places.SQUARE_ROOT, 10, 10, 1.0),
    ]
    return kernel.Tape(
        np.array([step[:3] for step in steps]).ravel(),
        np.array([step[3] for step in steps]),
        np.array([7, 9, 11]),
    )


def arm_of(name):
    """Return an arm, and the arrays that describe it."""
    robot = ks.load_robot(name)
    table = robot.chain.table
    arrays = [rounded(array) for array in table[1:]]
    chain = kernel.Chain(type(table)(table.dof, *arrays))
    task = robot.singularity.task
    rows = [task.axes, task.rotation, task.row_scales, task.column_scales]
    rows = [rounded(array) for array in rows]
    kernel_rows = kernel.TaskRows(task.generic_rank, *rows)
    # The seeds of the atlas differ in one joint: of more, plain Python takes seconds.
    spans = np.tile([-3.0, 6.0, np.inf], (robot.dof, 1))
    spans[np.arange(robot.dof) != min(1, robot.dof - 1), 1] = 0.0
    given = (False, kernel.DISTANCE, 0.2, 0.1, spans)
    arm = kernel.Arm(chain, kernel_rows, tape(robot.dof), *given)
    return arm, [*arrays, *rows, np.array([task.generic_rank])]


def errors_of(chain):
    """Return errors along any screws in frames of the table, with a triangle of causes."""
    count, random = 2 * chain.frames, Generator()
    table = kernel.PoseErrorTable(
        frame=np.arange(count) // 2,
        screw=random.numbers(count, 6),
        gear=np.arange(count) % (chain.dof + 1) - 1,
        spread=np.tril(random.numbers(count, count)),
        rates=random.numbers(chain.dof),
        floor=random.numbers(6) ** 2,
    )
    return kernel.PoseErrors(chain, table)


def visits(arm, random):
    """Yield each function and the arrays that it filled."""
    chain, n = arm.chain, arm.chain.dof
    q = 4.0 * random.numbers(POSES, n)
    q[0] = q[kernel.LANES + 3] = 0.0
    qdot = random.numbers(POSES, n)
    for depth in (kernel.POSE, kernel.JACOBIAN, kernel.ALL_FRAMES):
        rows = np.zeros((POSES, chain.widths[depth]))
        for rates in (qdot, qdot[:1].copy()):
            kernel.evaluate(chain, q, rates, depth, rows)
            yield 'evaluate', rows
    covariances = np.zeros((POSES, 2, 6, 6))
    for in_tool_axes in (False, True):
        kernel.covariances(errors_of(chain), rows, q, qdot, in_tool_axes, covariances)
        yield 'covariances', covariances
    measures = np.zeros((POSES, arm_width(arm)))
    kernel.measure(arm, rows, q, measures)
    yield 'measure', measures
    few = (rows[:SEARCHED].copy(), q[:SEARCHED].copy(), measures[:SEARCHED].copy())
    for in_order in (False, True):
        kernel.find_nearest(kernel.NearestSearch(arm), *few, in_order)
        yield 'find_nearest', few[2]
    moving, point, radii = np.arange(n), np.array([0.05, 0.0, -0.1]), np.zeros(POSES)
    kernel.clearances(kernel.Clearance(arm, moving, point, 3.0, 5.0, 9.0), q, radii)
    yield 'clearances', radii
    turned = np.zeros((POSES * chain.frames, 4))
    kernel.quaternions(rows[:, chain.frames_at :].reshape(-1, 4, 4).copy(), turned)
    yield 'quaternions', turned
    factors = np.zeros((POSES, arm.tape.factors, 1 + n))
    kernel.evaluate_factors(arm.tape, q, factors)
    yield 'evaluate_factors', factors
    for k in range(SINGLY):
        row, one = np.zeros(chain.single_widths[kernel.JACOBIAN]), np.zeros(arm_width(arm))
        kernel.evaluate_and_measure_one(arm, q[k], qdot[k], row, one)
        yield 'evaluate_and_measure_one', row
        yield 'evaluate_and_measure_one', one
        yield from steps_of_the_servo(arm, q[k], row, 3.0 * random.numbers(6))


def steps_of_the_servo(arm, q, row, twist):
    n = arm.chain.dof
    limits, fastest = np.array([[-2.0, 2.5]] * n), np.full(n, 1.5)
    servo = kernel.Servo(
        arm.task,
        damping=0.1,
        damped_below=0.2,
        length=0.5,
        horizon=0.1,
        limits=limits,
        fastest=fastest,
    )
    step = kernel.ServoOutput(servo, np.zeros(n))
    kernel.servo(step, q, row, twist)
    yield 'servo', step.qdot
    yield 'servo', np.array([int(step.is_held(j)) for j in range(n)])
    said = [step.damping, step.least_singular_value, step.shortened, float(step.slowest)]
    yield 'servo', np.array(said)


def arm_width(arm):
    """Return the length of a row of measures."""
    n, m = arm.chain.dof, arm.task.count
    return kernel.LOST_AT + 6 + 2 * n + min(m, n) + kernel.JUDGED + arm.tape.factors * (2 + n) + n


def lines(names):
    """Yield a line for each arm and function."""
    for name in names:
        arm, constants = arm_of(name)
        hashes = {'constants': hashlib.sha256()}
        for array in constants:
            hashes['constants'].update(array.astype(array.dtype.newbyteorder('<')).tobytes())
        for function, array in visits(arm, Generator()):
            digest = hashes.setdefault(function, hashlib.sha256())
            digest.update(array.astype(array.dtype.newbyteorder('<')).tobytes())
        for function, digest in hashes.items():
            yield f'{name} {function} {digest.hexdigest()}'


def main():
    without_loops = (
        name
        for name, path in sorted(ks.bundled_robots().items())
        if 'loops:' not in path.read_text()
    )
    for line in lines(sys.argv[1:] or without_loops):
        print(line)


if __name__ == '__main__':
    main()
