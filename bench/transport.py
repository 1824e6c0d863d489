# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
What the transport costs: the node beside a plain rclpy node without mathematics, in one run.

    python bench/transport.py [--only cpu,rate,latency,...] [--rounds 3] [--seconds 6]

cpu      CPU a message at 1 kHz, six joints, four topics heard, one, and none
rate     the highest rate with nothing lost, one arm, the pose heard
latency  from the stamp to the listener's callback at 1 kHz, beside a bare relay
arms     1, 2, 4, 8 arms in one process and in several
motion   CPU a message of accelerations, wrenches and null space, heard and unheard; beside the
         node of other sources with `--before SRC`
scale    from a command to its scale, beside from a joint state to its pose, 100 Hz each

Node, feeder and listener are processes of their own; feeder and listener are the same for all and
handle bytes, so that they leave the machine to what is measured. The cases take turns, round by
round, and the median counts. What lasts is the ratios: all in one run, on one machine.
"""

import argparse
import contextlib
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

from processes import PATIENCE, ROBOT, JointStates, age_of, node, paced, plain, running  # isort: skip
from node_process import processor_seconds

FOUR = ('pose', 'twist', 'jacobian', 'singularity/manipulability')
ONE = ('pose',)
# A rate is passed if nothing is lost in one of so many tries: others use this machine, too.
TRIES = 2
BISECTIONS = 4
# So many arms, at this rate (Hz) each.
ARMS, ARM_RATE = (1, 2, 4, 8), 250

# Joint states with efforts, so that there is a wrench; and commands in turns with joint states.
EFFORTS, COMMANDS = '--efforts', '--commands'

# The processes share one file of int64: slots, then a ring of latencies in ns.
SENT, RATE, FED, LISTENING, HEARD, ANSWERED, COMMANDED = range(7)
SLOTS, RING = 16, 1 << 17


def shared(path):
    return np.memmap(path, np.int64, 'r+', shape=(SLOTS + RING,))


# Feeder and listener


def feed(options):
    """Publish JointStates at the shared rate; they differ in stamp and positions."""
    import rclpy
    from sensor_msgs.msg import JointState

    import kinematics_service as ks

    messages = JointStates(options.robot, efforts=options.efforts)
    q = np.array([0.3, -1.0, 1.2, -0.4, 1.1, 0.3, 0.2])[: ks.load_robot(options.robot).dof]
    qdot = np.zeros(len(q))
    rclpy.init()
    peer = rclpy.create_node('feeder')
    publishers, commands = (
        [peer.create_publisher(JointState, f'{space}/{name}', 100) for space in options.arms]
        for name in ('joint_states', 'kinematics/command')
    )
    while any(publisher.get_subscription_count() == 0 for publisher in publishers):
        time.sleep(0.02)
    slots = shared(options.path)
    slots[FED] = 1
    while True:
        rate = int(slots[RATE])
        if rate == 0:
            time.sleep(0.005)
            continue
        for k in paced(rate):
            if slots[RATE] != rate:
                break
            # The first joint swings, and its velocity agrees: healthy input.
            side = 1.0 if k % 2000 < 1000 else -1.0
            q[0], qdot[0] = 0.3 + 1e-4 * (1000 - abs(k % 2000 - 1000)), side * 1e-4 * rate
            if options.commands and k % 2:
                slots[COMMANDED] = time.time_ns()
                commands[0].publish(messages.at(q, qdot))
                continue
            for publisher in publishers:
                publisher.publish(messages.at(q, qdot))
            slots[SENT] += len(publishers)


def listen(options):
    """Count the answers, and note the age of each pose, or of the command of each scale."""
    import rclpy
    from geometry_msgs.msg import AccelStamped, PoseStamped, TwistStamped, WrenchStamped
    from rclpy.experimental import EventsExecutor
    from std_msgs.msg import Float64, Float64MultiArray

    kinds = {
        **{'pose': PoseStamped, 'twist': TwistStamped, 'jacobian': Float64MultiArray},
        **{'acceleration': AccelStamped, 'wrench': WrenchStamped},
        **{'null_space': Float64MultiArray, 'null_space/away': Float64MultiArray},
    }
    rclpy.init()
    peer = rclpy.create_node('listener')
    slots = shared(options.path)

    def note(age):
        heard = int(slots[HEARD])
        slots[SLOTS + heard % RING] = age
        slots[HEARD] = heard + 1

    def on_pose(data):
        note(round(1e9 * age_of(data)))

    def on_scale(data):
        note(time.time_ns() - int(slots[COMMANDED]))

    def on_other(data):
        slots[ANSWERED] += 1

    names = [f'{space}/kinematics/{topic}' for space in options.arms for topic in options.topics]
    noted = {'pose': on_pose, 'scale': on_scale}
    for name in names:
        topic = name.split('/kinematics/')[1]
        on = noted.get(topic, on_other)
        peer.create_subscription(kinds.get(topic, Float64), name, on, 1000, raw=True)
    while any(peer.count_publishers(name) == 0 for name in names):
        time.sleep(0.02)
    slots[LISTENING] = 1
    executor = EventsExecutor()
    executor.add_node(peer)
    while True:
        executor.spin_once(timeout_sec=0.05)


# What is measured


class CaseError(Exception):
    pass


@contextlib.contextmanager
def answering(commands, topics, namespaces, *words):
    """Run what answers, a feeder and a listener; yield their `Case` once they are matched."""
    with contextlib.ExitStack() as stack:
        path = stack.enter_context(tempfile.NamedTemporaryFile(prefix='transport_')).name
        errors = stack.enter_context(tempfile.TemporaryFile())
        np.zeros(SLOTS + RING, np.int64).tofile(path)
        slots = shared(path)
        peer = [sys.executable, __file__, '--path', path, *words, '--arms', *namespaces, '--peer']
        peers = [[*peer, 'feed'], [*peer, 'listen', '--topics', *topics]][: 2 if topics else 1]
        started = [
            stack.enter_context(running(one, stdout=subprocess.DEVNULL, stderr=errors))
            for one in (*commands, *peers)
        ]
        case = Case(slots, started, started[: len(commands)], errors, bool(topics))
        deadline = time.monotonic() + PATIENCE
        while not (slots[FED] and (slots[LISTENING] or not topics)):
            case.check(time.monotonic() < deadline)
            time.sleep(0.02)
        time.sleep(1.0)
        yield case


class Case:
    """Processes that answer, with a feeder and a listener."""

    def __init__(self, slots, started, nodes, errors, is_heard):
        self.slots, self.started, self.nodes = slots, started, nodes
        self.errors, self.is_heard = errors, is_heard

    def check(self, fine=True):
        """Raise the last words of a process that has ended, or of one that is late."""
        if not fine or any(process.poll() is not None for process in self.started):
            self.errors.seek(0)
            lines = self.errors.read().decode(errors='replace').strip().splitlines()
            raise CaseError(lines[-1] if lines else 'not matched in time')

    def cpu_a_message(self, rate, seconds):
        """Return the CPU time a message of all nodes together, us, and the share unanswered."""
        self.slots[RATE] = rate
        time.sleep(2.0)
        before = self._used()
        time.sleep(seconds)
        used, sent, heard = self._used() - before
        self._rest()
        return used / sent * 1e6, 1.0 - heard / sent if self.is_heard else 0.0

    def _used(self):
        self.check()
        used = sum(processor_seconds(process.pid) for process in self.nodes)
        return np.array([used, self.slots[SENT], self.slots[HEARD]])

    def lost(self, rate, seconds):
        """Return how many messages were not answered, and the rate that was really fed."""
        before, begin = self.slots[:SLOTS].copy(), time.perf_counter()
        self.slots[RATE] = rate
        time.sleep(seconds)
        self.slots[RATE] = 0
        elapsed = time.perf_counter() - begin
        self._rest()
        sent, heard = (self.slots[:SLOTS] - before)[[SENT, HEARD]].tolist()
        return sent - heard, sent / elapsed

    def latencies(self, rate, seconds):
        """Return the ages of the poses heard, ms, after a warm-up."""
        self.slots[RATE] = rate
        time.sleep(2.0)
        first = int(self.slots[HEARD])
        time.sleep(min(seconds, 0.9 * RING / rate))
        last = int(self.slots[HEARD])
        self._rest()
        return self.slots[SLOTS + np.arange(first, last) % RING] * 1e-6

    def _rest(self):
        # Until what is on its way has come, or is not coming.
        self.slots[RATE] = 0
        before = -1
        while before != int(self.slots[HEARD]):
            before = int(self.slots[HEARD])
            time.sleep(0.5)


def one_arm(command, topics, *words):
    """Return a case of one process without a namespace; `words` are for feeder and listener."""
    return [command], topics, ('',), *words


OURS = node('--robot', ROBOT)
PLAIN = {
    'plain node, 4 topics': one_arm(plain(), FOUR),
    'plain node, 1 topic': one_arm(plain('--topics', 'pose'), ONE),
    'relay': one_arm(plain('--relay'), ONE),
}
# Of `rate` and `latency` only the pose is counted.
HEARD_OF_OURS = {
    'kinematics, 1 topic heard': one_arm(OURS, ONE),
    'kinematics, 4 topics heard': one_arm(OURS, FOUR),
}


def measured(cases, rounds, measure):
    """Return name -> results of all rounds; the cases take turns. A case that fails says why."""
    results = {name: [] for name in cases}
    for _ in range(rounds):
        for name, parts in cases.items():
            try:
                with answering(*parts) as case:
                    results[name].append(measure(case))
            except CaseError as error:
                print(f'  {name}: {error}', file=sys.stderr)
    return {name: values for name, values in results.items() if values}


def with_profiles(command):
    """Return a command that runs with what the node asks of Fast DDS."""
    from kinematics_service.node.process.middleware import VARIABLES, fast_dds, profiles

    version = fast_dds()
    return ['env', f'{VARIABLES[version]}={profiles(version)}', *command]


def cpu(options):
    constant = plain('--bytes'), plain('--bytes', '--topics', 'pose')
    # All threads on the last core: no way to another one from the middleware's to the executor's.
    on_one_core = ['taskset', '-c', str(max(os.sched_getaffinity(0))), *OURS]
    cases = PLAIN | {
        'constant bytes, 4 topics': one_arm(constant[0], FOUR),
        'constant bytes, 1 topic': one_arm(constant[1], ONE),
        'the same with our profiles, 4': one_arm(with_profiles(constant[0]), FOUR),
        'the same with our profiles, 1': one_arm(with_profiles(constant[1]), ONE),
        **HEARD_OF_OURS,
        'kinematics, nothing heard': one_arm(OURS, ()),
        'kinematics, 4 heard, taskset': one_arm(on_one_core, FOUR),
        'kinematics, 1 heard, taskset': one_arm(on_one_core, ONE),
    }
    results = measured(
        cases, options.rounds, lambda case: case.cpu_a_message(1000, options.seconds)
    )
    references = [
        np.median([us for us, _ in results.get(name, [(np.nan, 0.0)])]) for name in [*PLAIN][:2]
    ]
    print(f'\nCPU a message, 1 kHz, {ROBOT}: median of {options.rounds} (least to most), us')
    print(f'{"":34}{"us":>7}{"":16}{"to plain, 4":>12}{"to plain, 1":>12}{"unanswered":>12}')
    for name, values in results.items():
        used, unanswered = zip(*values)
        median = statistics.median(used)
        span = f'({min(used):.0f} to {max(used):.0f})'
        ratios = ''.join(f'{median / reference:12.2f}' for reference in references)
        print(f'{name:34}{median:7.0f}{span:>16}{ratios}{max(0.0, *unanswered):12.1%}')


def highest_rate(case, seconds):
    """
    Return the highest rate, Hz, with every message answered, and whether the feeder was the limit.
    """

    def passes(rate):
        for _ in range(TRIES):
            lost, fed = case.lost(rate, seconds)
            if fed < 0.9 * rate:
                return None
            if lost == 0:
                return True
        return False

    good, bad = 0, 1000
    while passed := passes(bad):
        good, bad = bad, 2 * bad
    if passed is None and good:
        return good, True
    for _ in range(BISECTIONS):
        middle = (good + bad) // 2
        if passes(middle):
            good = middle
        else:
            bad = middle
    return good, False


def rate(options):
    cases = PLAIN | {'plain node, 4 topics': one_arm(plain(), ONE)} | HEARD_OF_OURS
    results = measured(cases, 1, lambda case: highest_rate(case, 2.0))
    reference = results.get('plain node, 1 topic', [(np.nan, False)])[0][0]
    print('\nHighest rate with nothing lost, one arm, Hz (2 s, best of two tries)')
    print(f'{"":34}{"Hz":>7}{"to plain, 1":>14}')
    for name, ((hertz, limited),) in results.items():
        note = '   the feeder was the limit' if limited else ''
        print(f'{name:34}{hertz:7.0f}{hertz / reference:14.2f}{note}')


def latency(options):
    events = one_arm(plain('--relay', '--executor', 'events'), ONE)
    cases = PLAIN | {'relay, events executor': events} | HEARD_OF_OURS
    print_ages('Age of the pose at the listener, 1 kHz', cases, 1000, options)


def print_ages(title, cases, rate, options):
    """Print the ages of what is heard of each case."""
    results = measured(cases, options.rounds, lambda case: case.latencies(rate, options.seconds))
    print(f'\n{title}: medians of {options.rounds} rounds, ms')
    print(f'{"":34}{"p50":>8}{"p99":>8}{"longest":>9}')
    for name, values in results.items():
        p50, p99 = np.median([np.percentile(value, [50, 99]) for value in values], axis=0)
        print(f'{name:34}{p50:8.3f}{p99:8.3f}{max(map(np.max, values)):9.3f}')


def arms(options):
    cases = {}
    for count in ARMS:
        names = [f'arm_{k}' for k in range(count)]
        spaces = tuple(f'/{name}' for name in names)
        together = [part for name in names for part in ('--robot', f'{name}={ROBOT}')]
        apart = [node('--robot', ROBOT, '--ros-args', '-r', f'__ns:={name}') for name in spaces]
        cases[f'{count} in one process'] = ([node(*together)], ONE, spaces)
        cases[f'{count} in {count} processes'] = (apart, ONE, spaces)

    def measure(case):
        us, _ = case.cpu_a_message(ARM_RATE, options.seconds)
        return us, case.lost(ARM_RATE, 2.0)[0]

    results = measured(cases, options.rounds, measure)
    print(f'\nArms, {ARM_RATE} Hz each, the pose of each heard: median of {options.rounds}')
    print(f'{"":34}{"us a message":>14}{"% of a core":>13}{"lost":>7}')
    for name, values in results.items():
        us = statistics.median(us for us, _ in values)
        lost = statistics.median(lost for _, lost in values)
        share = us * 1e-4 * ARM_RATE * int(name.split()[0])
        print(f'{name:34}{us:14.0f}{share:13.1f}{lost:7.0f}')


def motion(options):
    panda, of_panda = node('--robot', 'panda'), ('--robot', 'panda')
    null_space = (*ONE, 'null_space', 'null_space/away')
    cases = {
        'nothing heard': one_arm(OURS, (), EFFORTS),
        'pose': one_arm(OURS, ONE, EFFORTS),
        'pose, acceleration': one_arm(OURS, (*ONE, 'acceleration'), EFFORTS),
        'pose, wrench': one_arm(OURS, (*ONE, 'wrench'), EFFORTS),
        'panda: pose': one_arm(panda, ONE, *of_panda),
        'panda: pose, null space, away': one_arm(panda, null_space, *of_panda),
    }
    if options.before:
        there = ['env', f'PYTHONPATH={options.before}']
        for name in ('nothing heard', 'pose', 'panda: pose'):
            (command,), *rest = cases[name]
            cases[f'before: {name}'] = ([[*there, *command]], *rest)
    results = measured(
        cases, options.rounds, lambda case: case.cpu_a_message(1000, options.seconds)
    )
    print(f'\nCPU a message, 1 kHz: median of {options.rounds} (least to most), us')
    for name, values in results.items():
        used, unanswered = zip(*values)
        span = f'({min(used):.0f} to {max(used):.0f})'
        median = statistics.median(used)
        print(f'{name:34}{median:7.0f}{span:>16}{max(0.0, *unanswered):12.1%} unanswered')


def scale(options):
    cases = {
        'from a joint state to its pose': one_arm(OURS, ONE, COMMANDS),
        'from a command to its scale': one_arm(OURS, ('scale',), COMMANDS),
    }
    print_ages('Age at the listener, 100 Hz each', cases, 200, options)


PARTS = {
    **{'cpu': cpu, 'rate': rate, 'latency': latency},
    **{'arms': arms, 'motion': motion, 'scale': scale},
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--only', default=','.join(PARTS), help='of ' + ', '.join(PARTS))
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--seconds', type=float, default=6.0, help='of each measurement')
    parser.add_argument('--before', help='of motion: the `src` of other sources, compiled')
    for hidden in ('--path', '--peer'):
        parser.add_argument(hidden, help=argparse.SUPPRESS)
    parser.add_argument('--robot', default=ROBOT, help=argparse.SUPPRESS)
    for hidden in (EFFORTS, COMMANDS):
        parser.add_argument(hidden, action='store_true', help=argparse.SUPPRESS)
    for hidden in ('--arms', '--topics'):
        parser.add_argument(hidden, nargs='*', default=[], help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.peer == 'feed':
        feed(options)
    elif options.peer == 'listen':
        listen(options)
    else:
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # ends the processes, too
        for part in options.only.split(','):
            PARTS[part](options)


if __name__ == '__main__':
    main()
