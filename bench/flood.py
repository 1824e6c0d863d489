"""
Floods the node with joint states, or starves the demo, and says what becomes of it.

    python bench/flood.py [--demo | --timer | --after] [--seconds 20] [--publishers 3] [--nice 0]
        [--hogs 8] [--messages small] [--times 1]

node     publishers send joint states as fast as they can; then one SIGINT
--after  floods of one node, one after another: with each of the `--messages` (small, joints,
         name), by each number of `--publishers` (1,4), so many `--times`. A request every 0.3 s
         meanwhile; 2 s after each flood 40 requests, 100 joint states, the diagnostics of 10 s, a
         publisher of best effort, and silence. A line each; exit code 0 if all was right
--demo   processes that only compute take one core together with the demo, then they go; then one
         SIGINT
--timer  why a timer must not be set anew in its own callback: rclpy's event queue gets a timer's
         update for each reset and each call, and a call for each update that finds it due. Some
         updates that come late therefore feed themselves, if working them off takes longer than
         the period; a timer of fixed period works them off

Prints the memory of the process every few seconds, and how long it lived after the signal.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

COMMAND = [sys.executable, '-m', 'kinematics_service']
ROBOT = 'ur5e'
STEP = 5.0
# Both wait so long at most: for the process to answer, and for it to end.
PATIENCE, DEADLINE = 120.0, 10.0

# What floods: as a driver sends it, with the joints of ten thousand others, with a name of 1 MB.
# The stamp is at the front of the serialized message, after its encapsulation.
FAST = f"""
import struct, sys, time, rclpy, kinematics_service as ks
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
names = list(ks.load_robot({ROBOT!r}).joint_names)
names += dict(small=[], joints=[f'joint_{{k}}' for k in range(9_994)], name=['x' * 1_000_000])[
    sys.argv[1]]
rclpy.init()
publisher = rclpy.create_node('flood').create_publisher(JointState, 'joint_states', 100)
data = bytearray(serialize_message(JointState(name=names, position=[0.1] * len(names))))
while True:
    struct.pack_into('<iI', data, 4, *divmod(time.time_ns(), 1_000_000_000))
    publisher.publish(bytes(data))
"""
HOG = 'while True: pass'
# Calls of a 50 Hz timer, half a second at a time; after a second come the late updates.
TIMER = """
import os, sys, threading, time, rclpy
from rclpy.clock import Clock, ClockType
from rclpy.experimental import EventsExecutor
from rclpy.task import Future
late, sets_itself = int(sys.argv[1]), sys.argv[2] == 'itself'
rclpy.init()
node, executor = rclpy.create_node('timers'), EventsExecutor()
executor.add_node(node)
steady, calls, begin = Clock(clock_type=ClockType.STEADY_TIME), [0], time.monotonic()

def turn():
    calls[0] += 1
    if sets_itself:
        timer.timer_period_ns = round((0.02 - (time.monotonic() - begin) % 0.02) * 1e9)
        timer.reset()

def updates():
    once.cancel()
    for _ in range(late):
        timer.reset()
    time.sleep(0.05)

def watch():
    for k in range(1, 11):
        before = calls[0]
        time.sleep(0.5)
        pages = int(open('/proc/self/statm').read().split()[1])
        size = pages * os.sysconf('SC_PAGE_SIZE') / 2**20
        print(f'{k / 2:4.1f} s: {calls[0] - before:7} calls, {size:6.1f} MiB', flush=True)
    print('spin_until_future_complete(..., timeout_sec=4.0) did not come back', flush=True)
    os._exit(0)

timer = node.create_timer(0.02, turn, clock=steady)
once = node.create_timer(1.0, updates, clock=steady)
threading.Thread(target=watch, daemon=True).start()
executor.spin_until_future_complete(Future(), timeout_sec=4.0)
print(f'spin_until_future_complete(..., timeout_sec=4.0): {time.monotonic() - begin:.1f} s')
os._exit(0)
"""


def memory(process):
    with open(f'/proc/{process.pid}/statm') as statm:
        return int(statm.read().split()[1]) * os.sysconf('SC_PAGE_SIZE') / 2**20


def watched(process, seconds, words):
    """Print the memory of a process while it runs; return whether it still does."""
    begin = time.monotonic()
    while time.monotonic() - begin < seconds:
        time.sleep(min(STEP, seconds))
        if process.poll() is not None:
            print(f'it ended by itself: exit code {process.returncode}')
            return False
        print(
            f'{words}, {time.monotonic() - begin:5.0f} s: {memory(process):7.1f} MiB', flush=True
        )
    return True


def ended(process):
    """Send SIGINT and say what came of it; return whether the process ended."""
    begin = time.monotonic()
    process.send_signal(signal.SIGINT)
    try:
        code = process.wait(DEADLINE)
    except subprocess.TimeoutExpired:
        print(f'SIGINT was ignored for {DEADLINE:.0f} s: SIGKILL')
        return False
    print(f'SIGINT: exit code {code} after {time.monotonic() - begin:.2f} s')
    return code == 0


def started(processes, arguments, ready, output, core=None):
    """Start the node or the demo and return it once its output has a text."""
    process = subprocess.Popen([*COMMAND, *arguments], stdout=output, stderr=subprocess.STDOUT)
    if core is not None:
        os.sched_setaffinity(process.pid, core)
    processes.append(process)
    deadline = time.monotonic() + PATIENCE
    while ready not in (said := Path(output.name).read_text(errors='replace')):
        if process.poll() is not None or time.monotonic() > deadline:
            raise SystemExit('it does not start: ' + said)
        time.sleep(0.1)
    return process


def flood_node(options, processes, output):
    node = started(processes, ['--robot', ROBOT], 'listening to', output)
    # Of its main thread alone: those of the middleware go on hearing.
    os.setpriority(os.PRIO_PROCESS, node.pid, options.nice)
    print(f'before: {memory(node):.1f} MiB')
    for _ in range(int(options.publishers)):
        processes.append(subprocess.Popen([sys.executable, '-c', FAST, options.messages]))
    return watched(node, options.seconds, 'flooded') and ended(node)


class Client:
    """Asks the node and sends it joint states, and hears what it answers."""

    def __init__(self):
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
        from geometry_msgs.msg import PoseStamped
        from rclpy.qos import DurabilityPolicy, QoSProfile
        from sensor_msgs.msg import JointState
        from std_srvs.srv import Trigger

        import kinematics_service as ks

        rclpy.init()
        self.node = rclpy.create_node('client')
        self.executor = rclpy.executors.SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.names = list(ks.load_robot(ROBOT).joint_names)
        self.type, self.request = JointState, Trigger.Request()
        self.diagnostics, self.warnings, self.poses = [], [], []
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for kind, topic, heard, qos in (
            (DiagnosticArray, '/diagnostics', self.diagnostics, 10),
            (DiagnosticStatus, '/kinematics/singularity/warning', self.warnings, latched),
        ):
            self.node.create_subscription(kind, topic, heard.append, qos)
        self.node.create_subscription(PoseStamped, '/kinematics/pose', self._on_pose, 1000)
        # A flooded transport delivers many requests at once: room for all their answers.
        self.service = self.node.create_client(
            Trigger, '/kinematics/describe', qos_profile=QoSProfile(depth=1000)
        )
        self.publisher = self.node.create_publisher(JointState, 'joint_states', 1000)
        self.until(self.service.service_is_ready, PATIENCE)
        self.until(lambda: self.publisher.get_subscription_count() == 1, PATIENCE)

    def _on_pose(self, pose):
        self.poses.append((pose.header.stamp.sec, pose.header.stamp.nanosec))

    def until(self, true, seconds):
        """Listen until something is so, or for some seconds; return whether it is."""
        end = time.monotonic() + seconds
        while not (so := true()) and time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.01)
        return so

    def rest(self, seconds):
        """Listen for some seconds."""
        self.until(lambda: False, seconds)

    def ask(self):
        """Call a service; return the future of its answer."""
        return self.service.call_async(self.request)

    def answered(self, seconds):
        """Ask, and return how long the answer took (s), None if it took longer."""
        begin, future = time.monotonic(), self.ask()
        return time.monotonic() - begin if self.until(future.done, seconds) else None

    def send(self, number, publisher=None):
        """Send joint states at 50 Hz; return their stamps."""
        stamps = []
        for k in range(number):
            message = self.type(name=self.names, position=[0.1 + 0.001 * k] * len(self.names))
            stamps.append(divmod(time.time_ns(), 1_000_000_000))
            message.header.stamp.sec, message.header.stamp.nanosec = stamps[-1]
            (publisher or self.publisher).publish(message)
            self.rest(0.02)
        return stamps

    def answers(self, number, publisher=None):
        """Return how many of the poses are those of the joint states sent, and how many others."""
        self.poses.clear()
        stamps = self.send(number, publisher)
        self.until(lambda: len(self.poses) >= number, 2.0)
        self.rest(0.5)
        right = len(set(stamps) & set(self.poses))
        return right, len(self.poses) - right

    def said(self, key):
        """Return a value of the last diagnostics."""
        values = self.diagnostics[-1].status[0].values if self.diagnostics else ()
        return next((pair.value for pair in values if pair.key == key), '')


def one_flood(node, client, kind, publishers, seconds):
    """Flood the node, look what works two seconds later; print it, and return whether all did."""
    before = memory(node)
    floods = [subprocess.Popen([sys.executable, '-c', FAST, kind]) for _ in range(publishers)]
    asked, most = [], 0.0
    try:
        client.until(lambda: client.node.count_publishers('/joint_states') > publishers, 30.0)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            asked.append(client.ask())
            client.rest(0.3)
            most = max(most, memory(node))
    finally:
        for flood in floods:
            flood.kill()
            flood.wait()
    client.rest(2.0)
    met = sum(future.done() for future in asked)
    waits = [client.answered(2.0) for _ in range(40)]
    after = [wait for wait in waits if wait is not None]
    right, others = client.answers(100)
    client.diagnostics.clear()
    client.rest(10.0)
    diagnostics, stale = len(client.diagnostics), client.warnings[-1].level == b'\x03'
    changed, heard = best_effort(client)
    lean = memory(node)
    print(
        f'{kind:6} by {publishers}: {met} of {len(asked)} requests, after it {len(after)} of 40 '
        f'(longest {max(after, default=0):.2f} s), {right} of 100 joint states ({others} others), '
        f'{diagnostics} diagnostics in 10 s, stale {stale}, best effort {changed}, {heard} of 20, '
        f'memory {before:.0f}, {most:.0f}, {lean:.0f} MiB',
        flush=True,
    )
    return (met, len(after), right, others, stale, changed, heard) == (
        *(len(asked), 40, 100, 0, True, True, 20),
    ) and diagnostics in (9, 10, 11)


def best_effort(client):
    """Have a publisher come of which the node must hear by an event, and go again."""
    from rclpy.qos import QoSProfile, ReliabilityPolicy

    qos = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher = client.node.create_publisher(client.type, 'joint_states', qos)
    try:
        changed = client.until(lambda: client.said('reliability') == 'best effort', 5.0)
        client.rest(2.0)  # one subscription replaces the other
        return changed, client.answers(20, publisher)[0]
    finally:
        client.node.destroy_publisher(publisher)
        client.until(lambda: client.said('reliability') == 'reliable', 10.0)


def after_floods(options, processes, output):
    node = started(processes, ['--robot', ROBOT], 'listening to', output)
    client, fine = Client(), True
    client.send(20)
    for kind in options.messages.split(','):
        for publishers in map(int, options.publishers.split(',')):
            for _ in range(options.times):
                fine &= one_flood(node, client, kind, publishers, options.seconds)
                if node.poll() is not None:
                    raise SystemExit(f'it ended: {Path(output.name).read_text(errors="replace")}')
    return ended(node) and fine


def starve_demo(options, processes, output):
    core = {max(os.sched_getaffinity(0))}
    demo = started(processes, ['demo', '--robot', ROBOT], 'tool', output, core)
    print(f'before: {memory(demo):.1f} MiB')
    hogs = []
    for _ in range(options.hogs):
        hogs.append(subprocess.Popen([sys.executable, '-c', HOG]))
        os.sched_setaffinity(hogs[-1].pid, core)
    processes += hogs
    if not watched(demo, options.seconds, 'starved'):
        return False
    for hog in hogs:
        hog.kill()
    return watched(demo, 2 * STEP, 'left alone') and ended(demo)


def late_updates():
    for late in (1000, 40_000):
        for who in ('itself', 'nobody'):
            print(f'{late} late updates of a timer that is set anew by {who}', flush=True)
            subprocess.run([sys.executable, '-c', TIMER, str(late), who], check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--demo', action='store_true')
    parser.add_argument('--timer', action='store_true')
    parser.add_argument('--seconds', type=float, default=20.0)
    parser.add_argument('--after', action='store_true')
    parser.add_argument('--publishers', default='3', help='their number; several after a comma')
    parser.add_argument('--messages', default='small', help='small, joints, name')
    parser.add_argument('--times', type=int, default=1)
    parser.add_argument('--nice', type=int, default=0, help="of the node's main thread")
    parser.add_argument('--hogs', type=int, default=8)
    options = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', '88')
    if options.timer:
        late_updates()
        return 0
    processes = []
    try:
        with tempfile.NamedTemporaryFile('w') as output:
            part = starve_demo if options.demo else after_floods if options.after else flood_node
            return 0 if part(options, processes, output) else 1
    finally:
        for process in processes:
            process.kill()
            process.wait()


if __name__ == '__main__':
    sys.exit(main())
