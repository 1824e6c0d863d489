"""
Floods the node with joint states, or starves the demo, and says what becomes of it.

    python bench/flood.py [--demo | --timer] [--seconds 20] [--publishers 3] [--nice 0]
        [--hogs 8]

node     publishers send joint states as fast as they can; then one SIGINT
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

# The stamp is at the front of the serialized message, after its encapsulation.
FAST = f"""
import struct, time, rclpy, kinematics_service as ks
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
names = list(ks.load_robot({ROBOT!r}).joint_names)
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
    for _ in range(options.publishers):
        processes.append(subprocess.Popen([sys.executable, '-c', FAST]))
    return watched(node, options.seconds, 'flooded') and ended(node)


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
    parser.add_argument('--publishers', type=int, default=3)
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
            part = starve_demo if options.demo else flood_node
            return 0 if part(options, processes, output) else 1
    finally:
        for process in processes:
            process.kill()
            process.wait()


if __name__ == '__main__':
    sys.exit(main())
