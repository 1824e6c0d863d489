# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Floods the node with joint states, and says what works two seconds after it.

    python bench/flood.py [--seconds 20] [--publishers 1,4] [--messages small,joints,name]
        [--times 1]

Floods of one node, one after another: of usual messages, of 10,000 joints, and with a name of 1
MB, by each number of publishers, as fast as they can. A request every 0.3 s meanwhile; two seconds
after each flood 40 requests, 100 joint states, the diagnostics of 10 s, a publisher of best
effort, and silence; memory before, most, and then. A line each; then one SIGINT. Exit code 0 if
all was right.
"""

import argparse
import os
import signal
import subprocess
import sys
import time

from processes import node, running  # isort: skip
from floods import ROBOT, Client, flooded
from node_process import memory
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState


def one_flood(pid, client, kind, publishers, seconds):
    """Flood the node, look what works two seconds later; print it, and return whether all did."""
    before, sizes = memory(pid), []
    asked = flooded(client, kind, publishers, seconds, lambda: sizes.append(memory(pid)))
    client.rest(2.0)
    met = sum(future.done() for future in asked)
    waits = [client.answered(2.0) for _ in range(40)]
    after = [wait for wait in waits if wait is not None]
    right, others = client.answers(100)
    client.diagnostics.clear()
    client.rest(10.0)
    diagnostics, stale = len(client.diagnostics), client.warnings[-1].level == b'\x03'
    changed, heard = best_effort(client)
    print(
        f'{kind:6} by {publishers}: {met} of {len(asked)} requests, after it {len(after)} of 40 '
        f'(longest {max(after, default=0):.2f} s), {right} of 100 joint states ({others} others), '
        f'{diagnostics} diagnostics in 10 s, stale {stale}, best effort {changed}, {heard} of 20, '
        f'memory {before:.0f}, {max(sizes):.0f}, {memory(pid):.0f} MiB',
        flush=True,
    )
    return (met, len(after), right, others, stale, changed, heard) == (
        *(len(asked), 40, 100, 0, True, True, 20),
    ) and diagnostics in (9, 10, 11)


def best_effort(client):
    """Have a publisher come of which the node must hear by an event, and go again."""
    qos = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher = client.node.create_publisher(JointState, 'joint_states', qos)
    try:
        changed = client.until(lambda: client.said('reliability') == 'best effort', 5.0)
        client.rest(2.0)  # one subscription replaces the other
        return changed, client.answers(20, publisher)[0]
    finally:
        client.node.destroy_publisher(publisher)
        client.until(lambda: client.said('reliability') == 'reliable', 10.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--seconds', type=float, default=20.0)
    parser.add_argument('--publishers', default='1,4')
    parser.add_argument('--messages', default='small,joints,name')
    parser.add_argument('--times', type=int, default=1)
    options = parser.parse_args()
    fine = True
    environment = {**os.environ, 'PYTHONFAULTHANDLER': '1'}
    with running(node('--robot', ROBOT), env=environment) as process:
        client = Client()
        client.send(20)
        for kind in options.messages.split(','):
            for publishers in map(int, options.publishers.split(',')):
                for _ in range(options.times):
                    fine &= one_flood(process.pid, client, kind, publishers, options.seconds)
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        try:
            code = process.wait(10.0)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGABRT)  # it says where each of its threads is
            code = process.wait()
        print(f'SIGINT: exit code {code} after {time.monotonic() - begin:.2f} s')
    return 0 if fine and code == 0 else 1


if __name__ == '__main__':
    sys.exit(main())
