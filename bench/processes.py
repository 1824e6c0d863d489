# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
What benchmarks of the node share: processes, what these have used, and messages to feed them.

To import it keeps ROS to this computer, in a domain of its own, and lets helpers of the tests be
imported.
"""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from kinematics_service.estimation.cdr import STAMP, STAMP_AT

os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
os.environ.setdefault('ROS_DOMAIN_ID', '87')
sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

ROBOT = 'ur5e'
SECOND = 1_000_000_000
# Everything that is waited for comes within this (s).
PATIENCE = 120.0
# A feeder that is held up for longer (s) does not send in a burst what it could not send.
HELD_UP = 0.02


def node(*arguments):
    """Return the command of our node."""
    return [sys.executable, '-m', 'kinematics_service', *arguments]


def plain(*arguments):
    """Return the command of a node without mathematics."""
    return [sys.executable, str(Path(__file__).with_name('plain_node.py')), *arguments]


@contextlib.contextmanager
def running(command, seconds=20.0, **options):
    """Run a process; end it with SIGINT, and kill it where it does not end in some seconds."""
    process = subprocess.Popen(command, **options)
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.send_signal(signal.SIGINT)
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@contextlib.contextmanager
def peer(name):
    """
    Yield a node of this process; end it if the block ends or SIGINT comes.

    A process that ends without it leaves ports of shared memory behind, and each neighbour of it
    waits a third of a second in its next `publish`.
    """
    import rclpy

    rclpy.init()
    node = rclpy.create_node(name)
    try:
        yield node
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def paced(rate):
    """Yield 0, 1, 2, ... at a rate (Hz)."""
    begin, k = time.perf_counter(), 0
    while True:
        late = time.perf_counter() - begin - k / rate
        if late < 0.0:
            time.sleep(-late)
        elif late > HELD_UP:
            begin += late
        yield k
        k += 1


class JointStates:
    """Joint states as bytes that differ in stamp and positions: cheap for who sends them."""

    def __init__(self, robot, frame='base_link', efforts=False):
        from rclpy.serialization import serialize_message
        from sensor_msgs.msg import JointState

        import kinematics_service as ks
        from kinematics_service.estimation.joint_state_form import form_of

        names = list(ks.load_robot(robot).joint_names)
        message = JointState(name=names, position=[0.0] * len(names), velocity=[0.0] * len(names))
        message.effort = [1.0] * len(names) if efforts else []
        message.header.frame_id = frame
        self._data = bytearray(serialize_message(message))
        self._form = form_of(bytes(self._data))

    def at(self, q, qdot=None):
        """Return the bytes of positions and velocities (n,), stamped with the time of now."""
        self._data[self._form.positions] = q.tobytes()
        if qdot is not None:
            self._data[self._form.velocities] = qdot.tobytes()
        STAMP.pack_into(self._data, STAMP_AT, *divmod(time.time_ns(), SECOND))
        return bytes(self._data)


def age_of(data):
    """Return the age (s) of a message whose bytes begin with its stamp."""
    seconds, nanoseconds = STAMP.unpack_from(data, STAMP_AT)
    return (time.time_ns() - seconds * SECOND - nanoseconds) * 1e-9
