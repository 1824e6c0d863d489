# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The compiled calls beside other libraries, all in one run: what counts are the ratios.

    python bench/kernel.py [--robot ur5e] [--most 1000000]

Pinocchio's two calls are `computeJointJacobians` and `getFrameJacobian`, of the same arm;
roboticstoolbox's are `fkine` and `jacob0`.
"""

import argparse
import itertools
import time

import numpy as np
from kernel_peers import peers_of

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.kinematics import threads
from kinematics_service.kinematics.singularity import singularity_of
from kinematics_service.robot.robot import build_robot

ROUNDS, CALLS = 60, 500
# Of a motion from a random pose.
MESSAGES = 200
JOINTS = (2, 3, 6, 12, 24, 48, 96)
BATCHES = (1, 10, 100, 1_000, 10_000, 100_000, 1_000_000)


def nanoseconds(functions, calls=CALLS, rounds=ROUNDS):
    """Return the least time of a call of each: in turns, so that a busy machine is so for all."""
    best = dict.fromkeys(functions, np.inf)
    for function in functions.values():
        function()
    for _ in range(rounds):
        for name, function in functions.items():
            begin = time.perf_counter()
            for _ in range(calls):
                function()
            best[name] = min(best[name], (time.perf_counter() - begin) / calls)
    return {name: value * 1e9 for name, value in best.items()}


def without_factors(robot):
    """Return the same arm judged without its named factors: `distance` from the gradient alone."""
    from dataclasses import replace

    description = robot.description
    judged = replace(description.singularity, factors=())
    return build_robot(replace(description, singularity=judged))


def serial_arm(joints):
    """Return an arm of so many joints, its axes turned by 90 degrees from one to the next."""
    names = [f'q{k + 1}' for k in range(joints)]
    lines = [f'robot: arm_{joints}', 'source: bench', 'convention: standard', 'joints:']
    lines += [f'  - {{name: {name}, type: revolute}}' for name in names]
    lines.append('links:')
    turns = ('pi/2', '-pi/2')
    lines += [
        f'  - {{a: 0.1, alpha: {turns[k % 2]}, d: 0.05, theta: {name}}}'
        for k, name in enumerate(names)
    ]
    return ks.robot_from_text('\n'.join(lines) + '\n')


class OnePose:
    """The compiled calls of one pose of an arm, arrays made beforehand."""

    def __init__(self, robot, q, qdot):
        self.arm, self.q, self.qdot = robot.singularity.arm, q, qdot
        self.search = kernel.NearestSearch(robot.singularity.arm)
        # Poses of a motion, a message every 2 ms, there and back.
        rows = []
        for step in range(MESSAGES):
            row = np.empty(robot.chain.single_widths[kernel.JACOBIAN])
            kernel.evaluate_one(robot.chain, q + 0.002 * step * qdot, qdot, row)
            rows.append(row)
        self.along = itertools.cycle(rows + rows[::-1])
        self.row = np.empty(robot.chain.single_widths[kernel.JACOBIAN])
        self.measures = np.empty(robot.singularity.measure_places.width)

    def evaluate(self):
        kernel.evaluate_one(self.arm.chain, self.q, self.qdot, self.row)

    def measure(self):
        kernel.measure_one(self.search, next(self.along), self.measures)

    def both(self):
        kernel.evaluate_and_measure_one(self.arm, self.q, self.qdot, self.row, self.measures)


def calls_of_one_pose(robot):
    random = np.random.default_rng(1)
    q, qdot = random.uniform(-3, 3, robot.dof), random.uniform(-1, 1, robot.dof)
    one, bare = OnePose(robot, q, qdot), OnePose(without_factors(robot), q, qdot)
    bare.evaluate()
    state = ks.evaluate(robot, q, qdot)
    peers = peers_of(robot, q)
    calls = {name: peer.call for name, peer in peers.items() if name != 'Pinocchio'}
    calls = {
        'Pinocchio: pose and J, two calls': peers['Pinocchio'].call,
        'compiled call: pose, J, twist': one.evaluate,
        'compiled call: all measures, along a motion': one.measure,
        '  the same without named factors': bare.measure,
        'one call: pose, J, twist, all measures': one.both,
        'ks.evaluate(robot, q, qdot)': lambda: ks.evaluate(robot, q, qdot),
        'singularity_of(state)': lambda: singularity_of(state),
    } | calls
    slow = {name for name, peer in peers.items() if peer.slow}
    times = nanoseconds({name: call for name, call in calls.items() if name not in slow})
    times |= nanoseconds({name: calls[name] for name in slow}, calls=20, rounds=10)
    J = ks.jacobian(robot, q)
    worst = max(np.max(np.abs(peer.jacobian() - J)) for peer in peers.values())
    assert worst < 1e-12, worst
    reference = times['Pinocchio: pose and J, two calls']
    print(f'{robot.name}, {robot.dof} joints; J agrees with all of them to {worst:.1e}\n')
    print(f'{"one pose":40}{"ns":>9}{"ratio":>8}')
    for name, value in times.items():
        print(f'{name:40}{value:9.0f}{value / reference:8.2f}')
    share = (
        times['one call: pose, J, twist, all measures'] / times['compiled call: pose, J, twist']
    )
    print(f'with all measures {share:.1f} times pose, J and twist')


def growth():
    print(
        f'\n{"joints":>6}{"ns a call":>12}{"ns a joint":>12}{"batch, ns a pose":>18}{"a joint":>9}'
    )
    random = np.random.default_rng(2)
    for joints in JOINTS:
        robot = serial_arm(joints)
        chain = robot.chain
        one = OnePose(robot, random.uniform(-3, 3, joints), random.uniform(-1, 1, joints))
        q = random.uniform(-3, 3, (500, joints))
        rows = np.empty((500, chain.widths[kernel.JACOBIAN]))

        def batch(chain=chain, q=q, rows=rows):
            rest = chain.at_rest.reshape(1, -1)
            kernel.evaluate(chain, q, rest, kernel.JACOBIAN, rows)

        call = nanoseconds({'call': one.evaluate}, calls=300)['call']
        pose = nanoseconds({'batch': batch}, calls=1)['batch'] / 500
        print(f'{joints:6}{call:12.0f}{call / joints:12.0f}{pose:18.0f}{pose / joints:9.0f}')


def processor_time(function, rounds=5):
    """Return the least processor time of a call in ns, all threads together."""
    best = np.inf
    for _ in range(rounds):
        begin = time.process_time()
        function()
        best = min(best, time.process_time() - begin)
    return best * 1e9


def on_cores(cores, function):
    """Return `function` run with batches spread over at most so many cores."""

    def run():
        allowed, threads.cores = threads.cores, lambda: cores
        try:
            function()
        finally:
            threads.cores = allowed

    return run


def batches(robot, most):
    cores = threads.cores()
    # On a busy machine only the processor time says what threads cost each other.
    print(
        f'\n{"poses":>9}{"one core, ns a pose":>21}{f"{cores} cores":>10}{"measures, one":>15}'
        f'{"CPU, one":>15}{f"CPU, {cores}":>15}'
    )
    random = np.random.default_rng(3)
    for count in BATCHES:
        if count > most:
            break
        q = random.uniform(-3, 3, (count, robot.dof))

        def evaluate(q=q):
            ks.evaluate(robot, q)

        state = ks.evaluate(robot, q[: min(count, 20_000)])
        rounds = 60 if count < 100_000 else 5
        calls = max(1, 500 // count)
        one, several = on_cores(1, evaluate), on_cores(cores, evaluate)
        found = nanoseconds({'one': one, 'all': several}, calls, rounds)

        def judge(state=state):
            singularity_of(state)

        judge = nanoseconds({'judge': on_cores(1, judge)}, calls, 5)
        judged = judge['judge'] / len(state.q)
        line = f'{count:9}{found["one"] / count:21.0f}{found["all"] / count:10.0f}{judged:15.0f}'
        if count > 2 * threads.MIN_PART:
            line += ''.join(f'{processor_time(run) / count:15.0f}' for run in (one, several))
        print(line)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--robot', default='ur5e')
    parser.add_argument('--most', type=int, default=BATCHES[-1], help='poses of the largest batch')
    arguments = parser.parse_args()
    robot = ks.load_robot(arguments.robot)
    calls_of_one_pose(robot)
    growth()
    batches(robot, arguments.most)


if __name__ == '__main__':
    main()
