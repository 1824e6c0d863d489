"""
From `python -m kinematics_service` to the first answer, and what is imported on the way.

    python bench/start.py [--robot ur5e] [--runs 5]

The kernel's cache is warm: the node is started once before. Joint states come every 5 ms.
"""

import argparse
import os
import signal
import statistics
import subprocess
import sys
import time


def started(node, publisher, message, poses, robot):
    """
    Return the seconds from a start of the node to its first pose.

    """
    import rclpy

    begin = time.time_ns()
    server = subprocess.Popen(
        [sys.executable, '-m', 'kinematics_service', '--robot', robot],
        stderr=subprocess.DEVNULL,
    )
    poses.clear()
    # A pose answers a message sent after the start: what an earlier node left is older.
    while not any(stamp > begin for _, stamp in poses):
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)
        rclpy.spin_once(node, timeout_sec=0.005)
    first = next(heard for heard, stamp in poses if stamp > begin)
    server.send_signal(signal.SIGINT)
    assert server.wait(timeout=20) == 0
    return (first - begin) * 1e-9


def main():
    """
    Read the command line.

    """
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--robot', default='ur5e')
    parser.add_argument('--runs', type=int, default=5)
    arguments = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', '91')

    import rclpy
    from geometry_msgs.msg import PoseStamped
    from sensor_msgs.msg import JointState

    import kinematics_service as ks

    robot = ks.load_robot(arguments.robot)
    rclpy.init()
    node = rclpy.create_node('starter')
    poses = []

    def on_pose(answer):
        stamp = answer.header.stamp
        poses.append((time.time_ns(), stamp.sec * 1_000_000_000 + stamp.nanosec))

    node.create_subscription(PoseStamped, '/kinematics/pose', on_pose, 10)
    publisher = node.create_publisher(JointState, 'joint_states', 10)
    message = JointState(name=robot.joint_names, position=[0.1] * robot.dof)
    times = [
        started(node, publisher, message, poses, arguments.robot)
        for _ in range(arguments.runs + 1)
    ][1:]
    print(f'start to first answer, {arguments.robot}, {arguments.runs} runs with a warm cache:')
    print(f'median {statistics.median(times):.2f} s, {min(times):.2f} to {max(times):.2f} s')
    code = 'import kinematics_service.ros.runner'
    lines = subprocess.run(
        [sys.executable, '-X', 'importtime', '-c', code],
        capture_output=True,
        text=True,
        check=True,
    ).stderr.splitlines()
    packages = {}
    for line in lines[1:]:
        own, _, name = line.removeprefix('import time:').split('|')
        top = name.strip().partition('.')[0]
        packages[top] = packages.get(top, 0) + int(own)
    total = sum(packages.values())
    print(f'imports of the node: {total * 1e-6:.2f} s, by package:')
    for name, own in sorted(packages.items(), key=lambda item: -item[1])[:14]:
        print(f'{name:24}{own * 1e-3:8.0f} ms')


if __name__ == '__main__':
    main()
