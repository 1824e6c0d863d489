"""
What the transport costs: the node beside a plain rclpy node without mathematics, in one run.

    python bench/transport.py [--only cpu,rate,latency,arms] [--rounds 3] [--seconds 6]
        [--node-args='...'] [--also='plain path=--ros-args -p transport:=plain']

cpu      CPU a message at 1 kHz, six joints, four topics heard, one, and none
rate     the highest rate with nothing lost, one arm, the pose heard
latency  from the stamp to the listener's callback at 1 kHz, beside a bare relay
arms     1, 2, 4, 8 arms in one process and in several

Node, feeder and listener are processes of their own; feeder and listener are the same for all and
handle bytes, so that they leave the machine to what is measured. The cases take turns, round by
round, and the median counts. What lasts is the ratios: all in one run, on one machine.
"""

import argparse
import os
import shlex
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

from processes import PATIENCE, ROBOT, JointStates, age_of, node, paced, plain  # isort: skip
from node_process import processor_seconds

FOUR = ('pose', 'twist', 'jacobian', 'singularity/manipulability')
ONE = ('pose',)
# A rate is passed if nothing is lost in one of so many tries: others use this machine, too.
TRIES = 2
BISECTIONS = 4

# The processes share one file of int64: slots, then a ring of latencies in ns.
SENT, RATE, STOP, FED, LISTENING, HEARD, ANSWERED = range(7)
SLOTS, RING = 16, 1 << 17


def shared(path):
    return np.memmap(path, np.int64, 'r+', shape=(SLOTS + RING,))


# Feeder and listener


def feed(path, namespaces):
    """
    Publish JointStates at the shared rate until told to stop; they differ in stamp and positions.
    """
    import rclpy
    from sensor_msgs.msg import JointState

    messages, q = JointStates(ROBOT), np.array([0.3, -1.0, 1.2, -0.4, 1.1, 0.3])
    rclpy.init()
    peer = rclpy.create_node('feeder')
    publishers = [
        peer.create_publisher(JointState, f'{namespace}/joint_states', 100)
        for namespace in namespaces
    ]
    while any(publisher.get_subscription_count() == 0 for publisher in publishers):
        time.sleep(0.02)
    slots = shared(path)
    slots[FED] = 1
    while not slots[STOP]:
        rate = int(slots[RATE])
        if rate == 0:
            time.sleep(0.005)
            continue
        for k in paced(rate):
            if slots[RATE] != rate:
                break
            q[0] = 0.3 + 1e-4 * (k % 1000)
            for publisher in publishers:
                publisher.publish(messages.at(q))
            slots[SENT] += len(publishers)


def listen(path, namespaces, topics):
    """Count the answers, and note the age of each pose."""
    import rclpy
    from geometry_msgs.msg import PoseStamped, TwistStamped
    from rclpy.experimental import EventsExecutor
    from std_msgs.msg import Float64, Float64MultiArray

    kinds = {'pose': PoseStamped, 'twist': TwistStamped, 'jacobian': Float64MultiArray}
    rclpy.init()
    peer = rclpy.create_node('listener')
    slots = shared(path)

    def on_pose(data):
        heard = int(slots[HEARD])
        slots[SLOTS + heard % RING] = round(1e9 * age_of(data))
        slots[HEARD] = heard + 1

    def on_other(data):
        slots[ANSWERED] += 1

    names = [f'{namespace}/kinematics/{topic}' for namespace in namespaces for topic in topics]
    for name in names:
        kind = kinds.get(name.split('/kinematics/')[1], Float64)
        on = on_pose if kind is PoseStamped else on_other
        peer.create_subscription(kind, name, on, 1000, raw=True)
    while any(peer.count_publishers(name) == 0 for name in names):
        time.sleep(0.02)
    slots[LISTENING] = 1
    executor = EventsExecutor()
    executor.add_node(peer)
    while not slots[STOP]:
        executor.spin_once(timeout_sec=0.05)


# What is measured


class CaseError(Exception):
    pass


class Running:
    """Processes that answer, a feeder and a listener: started, matched, and ended together."""

    def __init__(self, commands, topics, namespaces=('',)):
        self.commands, self.topics, self.namespaces = commands, topics, namespaces

    def __enter__(self):
        descriptor, self.path = tempfile.mkstemp(prefix='transport_')
        os.close(descriptor)
        np.zeros(SLOTS + RING, np.int64).tofile(self.path)
        self.slots = shared(self.path)
        self.errors = tempfile.TemporaryFile()
        self.nodes = [self._start(command) for command in self.commands]
        peer = [sys.executable, __file__, '--path', self.path, '--arms', *self.namespaces]
        self.peers = [self._start([*peer, '--peer', 'feed'])]
        if self.topics:
            self.peers.append(self._start([*peer, '--peer', 'listen', '--topics', *self.topics]))
        deadline = time.monotonic() + PATIENCE
        ready = (FED, LISTENING) if self.topics else (FED,)
        try:
            while not all(self.slots[slot] for slot in ready):
                if time.monotonic() > deadline or any(
                    process.poll() is not None for process in (*self.nodes, *self.peers)
                ):
                    raise CaseError(self._last_words())
                time.sleep(0.02)
        except BaseException:
            self.__exit__()
            raise
        time.sleep(1.0)
        return self

    def _start(self, command):
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=self.errors)

    def _last_words(self):
        self.errors.seek(0)
        lines = self.errors.read().decode(errors='replace').strip().splitlines()
        return lines[-1] if lines else 'not matched in time'

    def __exit__(self, *exception):
        self.slots[RATE], self.slots[STOP] = 0, 1
        for process in self.nodes:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
        for process in (*self.nodes, *self.peers):
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self.errors.close()
        os.unlink(self.path)

    def cpu_a_message(self, rate, seconds):
        """Return the CPU time a message of all nodes together, us, and the share unanswered."""
        self.slots[RATE] = rate
        time.sleep(2.0)
        before = self._used()
        time.sleep(seconds)
        used, sent, heard = self._used() - before
        self._rest()
        if any(process.poll() is not None for process in self.nodes):
            raise CaseError(self._last_words())
        return used / sent * 1e6, 1.0 - heard / sent if self.topics else 0.0

    def _used(self):
        used = sum(processor_seconds(process.pid) for process in self.nodes)
        return np.array([used, self.slots[SENT], self.slots[HEARD]])

    def lost(self, rate, seconds):
        """Return how many messages were not answered, and the rate that was really fed."""
        sent, heard = int(self.slots[SENT]), int(self.slots[HEARD])
        begin = time.perf_counter()
        self.slots[RATE] = rate
        time.sleep(seconds)
        self.slots[RATE] = 0
        elapsed = time.perf_counter() - begin
        self._rest()
        sent, heard = int(self.slots[SENT]) - sent, int(self.slots[HEARD]) - heard
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


def one_arm(options):
    return node('--robot', ROBOT, *shlex.split(options.node_args))


def others(options):
    # Our node once more, with other arguments: name=arguments.
    for text in options.also:
        name, _, arguments = text.partition('=')
        yield name, node('--robot', ROBOT, *shlex.split(arguments))


def measured(cases, rounds, measure):
    """Return name -> results of all rounds; the cases take turns. A case that fails says why."""
    results = {name: [] for name in cases}
    for _ in range(rounds):
        for name, (commands, topics, namespaces) in cases.items():
            try:
                with Running(commands, topics, namespaces) as running:
                    results[name].append(measure(running))
            except CaseError as error:
                print(f'  {name}: {error}', file=sys.stderr)
    return {name: values for name, values in results.items() if values}


def with_profiles(command):
    """Return a command that runs with what the node asks of Fast DDS."""
    from kinematics_service.ros.process.middleware import VARIABLES, fast_dds, profiles

    version = fast_dds()
    return ['env', f'{VARIABLES[version]}={profiles(version)}', *command]


def on_one_core(name, command):
    """
    Yield the node's cases once more, all its threads on the last core.

    From the middleware's thread to the executor's then is no way to another core.
    """
    if shutil.which('taskset'):
        last = str(max(os.sched_getaffinity(0)))
        for topics, words in ((FOUR, '4 topics heard'), (ONE, '1 topic heard')):
            yield f'{name}, {words}, taskset', ([['taskset', '-c', last, *command]], topics, ('',))


def cpu(options):
    alone = ('',)
    cases = {
        'plain node, 4 topics': ([plain()], FOUR, alone),
        'plain node, 1 topic': ([plain('--topics', 'pose')], ONE, alone),
        'relay, 1 topic': ([plain('--relay')], ONE, alone),
        'constant bytes, 4 topics': ([plain('--bytes')], FOUR, alone),
        'constant bytes, 1 topic': ([plain('--bytes', '--topics', 'pose')], ONE, alone),
        'the same with our profiles, 4': ([with_profiles(plain('--bytes'))], FOUR, alone),
        'the same with our profiles, 1': (
            [with_profiles(plain('--bytes', '--topics', 'pose'))],
            ONE,
            alone,
        ),
    }
    for name, command in (('kinematics', one_arm(options)), *others(options)):
        cases[f'{name}, 4 topics heard'] = ([command], FOUR, alone)
        cases[f'{name}, 1 topic heard'] = ([command], ONE, alone)
        cases[f'{name}, nothing heard'] = ([command], (), alone)
        for case, one_core in on_one_core(name, command):
            cases[case] = one_core
    results = measured(
        cases, options.rounds, lambda running: running.cpu_a_message(1000, options.seconds)
    )
    unanswered = {
        name: max(0.0, *(share for _, share in values)) for name, values in results.items()
    }
    results = {name: [us for us, _ in values] for name, values in results.items()}
    references = [np.median(results.get(name, [np.nan])) for name in list(cases)[:2]]
    print(f'\nCPU a message, 1 kHz, {ROBOT}: median of {options.rounds} (least to most), us')
    print(f'{"":34}{"us":>7}{"":16}{"to plain, 4":>12}{"to plain, 1":>12}{"unanswered":>12}')
    for name, values in results.items():
        median = statistics.median(values)
        span = f'({min(values):.0f} to {max(values):.0f})'
        ratios = ''.join(f'{median / reference:12.2f}' for reference in references)
        print(f'{name:34}{median:7.0f}{span:>16}{ratios}{unanswered[name]:12.1%}')


def highest_rate(running, seconds):
    """
    Return the highest rate, Hz, with every message answered, and whether the feeder was the limit.
    """

    def passes(rate):
        for _ in range(TRIES):
            lost, fed = running.lost(rate, seconds)
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
    alone = ('',)
    cases = {'plain node, 4 topics': ([plain()], ONE, alone)}
    cases['plain node, 1 topic'] = ([plain('--topics', 'pose')], ONE, alone)
    cases['relay, 1 topic'] = ([plain('--relay')], ONE, alone)
    for name, command in (('kinematics', one_arm(options)), *others(options)):
        cases[f'{name}, 1 topic heard'] = ([command], ONE, alone)
        cases[f'{name}, 4 topics heard'] = ([command], FOUR, alone)
    results = measured(cases, 1, lambda running: highest_rate(running, 2.0))
    reference = results.get('plain node, 1 topic', [(np.nan, False)])[0][0]
    print('\nHighest rate with nothing lost, one arm, Hz (2 s, best of two tries)')
    print(f'{"":34}{"Hz":>7}{"to plain, 1":>14}')
    for name, ((hertz, limited),) in results.items():
        note = '   the feeder was the limit' if limited else ''
        print(f'{name:34}{hertz:7.0f}{hertz / reference:14.2f}{note}')


def latency(options):
    alone = ('',)
    cases = {
        'relay': ([plain('--relay')], ONE, alone),
        'relay, events executor': ([plain('--relay', '--executor', 'events')], ONE, alone),
        'plain node, 1 topic': ([plain('--topics', 'pose')], ONE, alone),
    }
    for name, command in (('kinematics', one_arm(options)), *others(options)):
        cases[f'{name}, 1 topic heard'] = ([command], ONE, alone)
        cases[f'{name}, 4 topics heard'] = ([command], FOUR, alone)
    results = measured(
        cases, options.rounds, lambda running: running.latencies(1000, options.seconds)
    )
    print(f'\nAge of the pose at the listener, 1 kHz: medians of {options.rounds} rounds, ms')
    print(f'{"":34}{"p50":>8}{"p99":>8}{"longest":>9}')
    for name, values in results.items():
        p50, p99 = np.median([np.percentile(value, [50, 99]) for value in values], axis=0)
        print(f'{name:34}{p50:8.3f}{p99:8.3f}{max(map(np.max, values)):9.3f}')


def arms(options):
    cases = {}
    for count in map(int, options.arm_counts.split(',')):
        names = [f'arm_{k}' for k in range(count)]
        spaces = tuple(f'/{name}' for name in names)
        extra = shlex.split(options.node_args)
        together = [part for name in names for part in ('--robot', f'{name}={ROBOT}')]
        apart = [
            node('--robot', ROBOT, *extra, '--ros-args', '-r', f'__ns:={space}')
            for space in spaces
        ]
        cases[f'{count} in one process'] = ([node(*together, *extra)], ONE, spaces)
        cases[f'{count} in {count} processes'] = (apart, ONE, spaces)
    hertz = options.arm_rate

    def measure(running):
        us, _ = running.cpu_a_message(hertz, options.seconds)
        return us, running.lost(hertz, 2.0)[0]

    results = measured(cases, options.rounds, measure)
    print(f'\nArms, {hertz} Hz each, the pose of each heard: median of {options.rounds}')
    print(f'{"":34}{"us a message":>14}{"% of a core":>13}{"lost":>7}')
    for name, values in results.items():
        us = statistics.median(us for us, _ in values)
        lost = statistics.median(lost for _, lost in values)
        share = us * 1e-4 * hertz * int(name.split()[0])
        print(f'{name:34}{us:14.0f}{share:13.1f}{lost:7.0f}')


PARTS = {'cpu': cpu, 'rate': rate, 'latency': latency, 'arms': arms}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--only', default=','.join(PARTS), help='of ' + ', '.join(PARTS))
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--seconds', type=float, default=6.0, help='of each measurement')
    parser.add_argument('--arm-rate', type=int, default=250, help='Hz of each of several arms')
    parser.add_argument('--arm-counts', default='1,2,4,8')
    parser.add_argument('--node-args', default='', help='added to the command of the node')
    parser.add_argument('--also', action='append', default=[], metavar='NAME=ARGS')
    for hidden in ('--path', '--peer'):
        parser.add_argument(hidden, help=argparse.SUPPRESS)
    for hidden in ('--arms', '--topics'):
        parser.add_argument(hidden, nargs='*', default=[], help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.peer == 'feed':
        feed(options.path, options.arms)
    elif options.peer == 'listen':
        listen(options.path, options.arms, options.topics)
    else:
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # ends the processes, too
        for part in options.only.split(','):
            PARTS[part](options)


if __name__ == '__main__':
    main()
