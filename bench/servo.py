"""
A stream of twists at 200 Hz through a wrist singularity: node and arm in two processes.

    python bench/servo.py [--rate 200] [--robot ur5e] [--aside 0.001]

The arm is simulated: it moves by the velocities it hears and says where it is. Joint 5 of the
path goes from 0.25 rad bent through straight to -0.25; `--aside` shifts the tool on the way, so
that the path misses the singularity by that much (m) and joint 4 would have to swing round.
"""

import argparse
import math
import os
import signal
import subprocess
import sys
import time

import numpy as np

BEND, SECONDS = 0.25, 4.0


def twist_between(T, ahead):
    """Return the displacement (6,) from a pose to one near it, base axes."""
    R = ahead[:3, :3] @ T[:3, :3].T
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
    return np.concatenate([ahead[:3, 3] - T[:3, 3], vector])


def run(arguments):
    """Track the path once and print what was seen."""
    import rclpy
    from geometry_msgs.msg import TwistStamped
    from rclpy.experimental import EventsExecutor
    from sensor_msgs.msg import JointState

    import kinematics_service as ks

    robot = ks.load_robot(arguments.robot)
    n = robot.dof
    rclpy.init()
    node = rclpy.create_node('arm')
    said = node.create_publisher(JointState, 'joint_states', 100)
    wanted = node.create_publisher(TwistStamped, '/kinematics/target_twist', 1)
    latest, heard = np.zeros(n), []

    def on_velocity(message):
        latest[:] = message.velocity
        heard.append(latest.copy())

    node.create_subscription(JointState, '/kinematics/ik/joint_velocity', on_velocity, 100)
    executor = EventsExecutor()
    executor.add_node(node)
    server = subprocess.Popen(
        [sys.executable, '-m', 'kinematics_service', '--robot', arguments.robot]
    )
    start = np.array([0.3, -1.1, 1.4, -0.9, BEND, 0.2])
    q, period = start.copy(), 1.0 / arguments.rate
    try:
        while wanted.get_subscription_count() == 0 or said.get_subscription_count() == 0:
            executor.spin_once(timeout_sec=0.1)
        settle = time.monotonic() + 1.0
        while time.monotonic() < settle:
            executor.spin_once(timeout_sec=0.05)
        steps = round(SECONDS * arguments.rate)
        off, nearest, late = [], math.inf, 0
        begin = time.perf_counter()
        for k in range(steps):
            due = begin + k * period
            while (left := due - time.perf_counter()) > 0.0:
                executor.spin_once(timeout_sec=left)
            late += time.perf_counter() - due > period
            q += latest * period
            now = time.time_ns()
            state = JointState(name=robot.joint_names, position=q.tolist())
            state.velocity = latest.tolist()
            state.header.stamp.sec, state.header.stamp.nanosec = divmod(now, 1_000_000_000)
            said.publish(state)
            share = (k + 1) / steps
            ahead = ks.forward_kinematics(robot, start - [0, 0, 0, 0, 2 * BEND * share, 0])
            ahead[1, 3] += arguments.aside * math.sin(math.pi * share)
            T = ks.forward_kinematics(robot, q)
            error = twist_between(T, ahead)
            off.append(error)
            nearest = min(nearest, float(ks.singularity(robot, q).distance))
            # The velocity of the path, and half of what is left of the error in each step.
            target = TwistStamped()
            target.header.frame_id = robot.base_frame
            target.header.stamp = state.header.stamp
            linear, angular = target.twist.linear, target.twist.angular
            twist = (0.5 * error / period).tolist()
            linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = twist
            wanted.publish(target)
        elapsed = time.perf_counter() - begin
    finally:
        server.send_signal(signal.SIGINT)
        code = server.wait(timeout=10)
        rclpy.try_shutdown()
    shares = np.max(np.abs(np.array(heard)) / robot.velocity_limits, axis=0)
    off = np.abs(np.array(off))
    print(
        f'{robot.name}, {steps} twists at {steps / elapsed:.1f} Hz, {late} late; node code {code}'
    )
    print(f'velocities heard            {len(heard)}')
    print(f'nearest to the singularity  {nearest:.2g} rad')
    print(f'fastest joint, of its limit {shares.max():.3f} ({robot.joint_names[shares.argmax()]})')
    for what, rows in (('worst', off), ('at the end', off[-1:])):
        linear, angular = rows[:, :3].max() * 1e3, rows[:, 3:].max()
        print(f'off the path, {what:14}{linear:.2f} mm, {angular:.4f} rad')


def main():
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--rate', type=float, default=200.0)
    parser.add_argument('--robot', default='ur5e', help='an arm with six joints and a wrist')
    parser.add_argument('--aside', type=float, default=0.0)
    arguments = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', '88')
    run(arguments)


if __name__ == '__main__':
    main()
