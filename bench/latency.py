"""
Nothing lost at 1 kHz, and how long an answer takes: node, feeder and listener in three processes.

    python bench/latency.py [--rate 1000] [--seconds 60] [--robot ur5e]

The Jacobian has no stamp, so the message's number is encoded in the first joint and read back
from the second axis, (sin q1, -cos q1, 0). Times are from the stamp to the listener's callback.
"""

import argparse
import math
import os
import signal
import subprocess
import sys
import time

import numpy as np

STEP, FIRST = 5e-5, -1.5


def feed(arguments):
    import rclpy
    from sensor_msgs.msg import JointState

    import kinematics_service as ks

    rclpy.init()
    node = rclpy.create_node('feeder')
    publisher = node.create_publisher(JointState, 'joint_states', 100)
    while publisher.get_subscription_count() == 0:
        time.sleep(0.05)
    time.sleep(1.0)
    robot = ks.load_robot(arguments.robot)
    message = JointState()
    message.name = list(robot.joint_names)
    message.velocity = [0.1] * robot.dof
    period = 1.0 / arguments.rate
    begin = time.perf_counter()
    for k in range(round(arguments.rate * arguments.seconds)):
        wait = begin + k * period - time.perf_counter()
        if wait > 0:
            time.sleep(wait)
        message.position = [FIRST + STEP * k, -1.0, 1.2, -0.4, 1.1, 0.3]
        now = time.time_ns()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, 1_000_000_000)
        publisher.publish(message)
    time.sleep(1.0)
    rclpy.shutdown()


def percentiles(latencies):
    p50, p99 = np.percentile(latencies, [50, 99])
    return f'{p50 * 1e3:9.3f}{p99 * 1e3:9.3f}{max(latencies) * 1e3:9.3f}'


def cpu_seconds(pid):
    with open(f'/proc/{pid}/stat') as stat:
        fields = stat.read().rsplit(')', 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def listen(arguments):
    import rclpy
    from geometry_msgs.msg import PoseStamped
    from rclpy.experimental import EventsExecutor
    from rclpy.qos import QoSProfile
    from std_msgs.msg import Float64MultiArray

    rclpy.init()
    node = rclpy.create_node('listener')
    poses, jacobians, stamps = [], {}, {}

    def on_pose(message):
        now = time.time_ns()
        stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        poses.append((now - stamp) * 1e-9)
        stamps[len(poses) - 1] = stamp

    def on_jacobian(message):
        now = time.time_ns()
        wx, wy = message.data[3 * 6 + 1], message.data[4 * 6 + 1]
        jacobians[round((math.atan2(wx, -wy) - FIRST) / STEP)] = now

    qos = QoSProfile(depth=1000)
    node.create_subscription(PoseStamped, '/kinematics/pose', on_pose, qos)
    node.create_subscription(Float64MultiArray, '/kinematics/jacobian', on_jacobian, qos)
    executor = EventsExecutor()
    executor.add_node(node)
    server = subprocess.Popen(
        [sys.executable, '-m', 'kinematics_service', '--robot', arguments.robot]
    )
    try:
        while node.count_publishers('/kinematics/pose') == 0:
            executor.spin_once(timeout_sec=0.1)
        feeder = subprocess.Popen([sys.executable, __file__, *sys.argv[1:], '--feed'])
        while not poses:
            executor.spin_once(timeout_sec=0.1)
        used, begin = cpu_seconds(server.pid), time.perf_counter()
        while feeder.poll() is None:
            executor.spin_once(timeout_sec=0.1)
        used, elapsed = cpu_seconds(server.pid) - used, time.perf_counter() - begin
    finally:
        server.send_signal(signal.SIGINT)
        code = server.wait(timeout=10)
    sent = round(arguments.rate * arguments.seconds)
    lost = sent - len(jacobians)
    # With nothing lost, pose k carries the stamp of message k.
    answers = [(jacobians[k] - stamps[k]) * 1e-9 for k in range(sent)] if not lost else []
    print(f'{sent} messages at {arguments.rate} Hz, {arguments.robot}; node exit code {code}')
    print(f'{"":10}{"received":>9}{"lost":>6}{"p50 ms":>9}{"p99 ms":>9}{"max ms":>9}')
    print(f'{"pose":10}{len(poses):9}{sent - len(poses):6}{percentiles(poses)}')
    if answers:
        print(f'{"jacobian":10}{len(jacobians):9}{lost:6}{percentiles(answers)}')
    else:
        print(f'{"jacobian":10}{len(jacobians):9}{lost:6}')
    print(
        f'CPU of the node: {used / elapsed * 100:.0f} % of a core, '
        f'{used / max(len(poses), 1) * 1e6:.0f} us a message'
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--rate', type=float, default=1000.0)
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--robot', default='ur5e', help='an arm whose second axis is as above')
    parser.add_argument('--feed', action='store_true', help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', '87')
    feed(arguments) if arguments.feed else listen(arguments)


if __name__ == '__main__':
    main()
