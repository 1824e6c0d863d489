"""
What the covariances of pose and twist cost a message, all in one run: what counts are differences.

    python bench/covariance.py [--robot ur5e] [--draws 100000]

A joint state is taken from its bytes and answered: the messages are filled, and not sent. The arm
has noise in every joint, and a covariance of all numbers of its table as `calibrate` writes it.
Then covariances against draws: joints, velocities and all these numbers at random, poses and
twists of every such arm.
"""

import argparse
import time
from dataclasses import replace

import numpy as np
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.diagnosis.calibration.arm_errors import errors_of_file, named_errors
from kinematics_service.diagnosis.calibration.corrected_chain import poses_of
from kinematics_service.diagnosis.calibration.parameters import (
    every_parameter_of,
    parameters_of,
    placement,
)
from kinematics_service.estimation.estimator import Estimator, EstimatorOutput
from kinematics_service.rigid_motion import rotation_vector
from kinematics_service.robot.file.description import Uncertainty
from kinematics_service.robot.robot import build_robot
from kinematics_service.ros.messages.joint_state_reader import JointStateReader
from kinematics_service.ros.messages.message_layout import MessageLayout
from kinematics_service.ros.messages.topics import topics_of
from kinematics_service.ros.node.outputs import Channel, filled_by_the_kernel
from kinematics_service.ros.parameters.settings import settings_from
from kinematics_service.ros.parameters.table import PARAMETERS

ROUNDS, MESSAGES = 40, 500
ARMS = ('ur5e', 'panda', 'scara_hsr065', 'puma560', 'parallelogram_left', 'offset_stanford_shape')
USUAL = ('~/pose', '~/jacobian', '~/twist')
POSE, TWIST = '~/pose_with_covariance', '~/twist_with_covariance'
HEARD = {
    'neither': USUAL,
    'neither, with ~/link_frames computed': USUAL,
    'pose': (*USUAL, POSE),
    'twist': (*USUAL, TWIST),
    'both': (*USUAL, POSE, TWIST),
}


def uncertain(robot, random, dense=True):
    """Return the arm with noise in its joints, and deviations or a covariance of its table."""
    table = parameters_of(robot).table
    scales = np.array([2e-4 if one.angle else 1e-4 for one in table])
    factor = np.tril(random.normal(size=(len(table), len(table)))) * scales[:, None]
    rows = [tuple(row[: k + 1].tolist()) for k, row in enumerate(factor)]
    names = [one.name for one in table]
    zeros = (0.0,) * robot.dof
    said = Uncertainty(
        noise=tuple(random.uniform(1e-4, 4e-4, robot.dof).tolist()),
        resolution=zeros,
        backlash=zeros,
        velocity_noise=tuple(random.uniform(1e-3, 4e-3, robot.dof).tolist()),
        parameters=() if dense else tuple(zip(names, scales.tolist())),
        factor=tuple(zip(names, rows)) if dense else (),
        floor_xyz=0.0,
        floor_rpy=0.0,
    )
    return build_robot(replace(robot.description, uncertainty=said))


class Answered:
    """Joint states of an arm that are taken and answered on some topics."""

    def __init__(self, robot, heard, frames):
        values = {parameter.name: parameter.default for parameter in PARAMETERS}
        settings = settings_from(values, robot)
        channels, depth = [], kernel.ALL_FRAMES if frames else kernel.JACOBIAN
        for topic in topics_of(settings):
            if topic.name in heard:
                layout = MessageLayout(topic.template(settings))
                channels.append(
                    Channel(
                        *(None, None, None, topic, None),
                        numbers=topic.numbers(settings),
                        layout=layout,
                        as_bytes=True,
                    )
                )
                depth = max(depth, topic.depth)
        assert {one.topic.name for one in channels} == set(heard)
        self.depth = depth
        self.messages, _ = filled_by_the_kernel(channels, settings, depth)
        self.estimator = Estimator(robot, settings.estimator)
        message = JointState(name=robot.joint_names, position=[0.3] * robot.dof)
        message.velocity = [0.1] * robot.dof
        self.data, self.stamp = [], 0
        reader = JointStateReader()
        for k in range(MESSAGES):
            message.position = (0.3 + 1e-3 * np.sin(k + np.arange(robot.dof))).tolist()
            message.header.stamp.sec = 1
            self.data.append(bytearray(serialize_message(message)))
        reader.read(bytes(self.data[0]))
        (self.form,) = reader.forms(len(self.data[0]))

    def microseconds(self):
        data = []
        for one in self.data:
            self.stamp += 1
            seconds, rest = divmod(self.stamp, 1000)
            one[4:8] = (seconds + 1).to_bytes(4, 'little')
            one[8:12] = (rest * 1_000_000).to_bytes(4, 'little')
            data.append(bytes(one))
        take, form, depth, messages = (
            self.estimator.take_bytes,
            self.form,
            self.depth,
            self.messages,
        )
        begin = time.perf_counter()
        for one in data:
            answer = take(form, one, 0, depth, messages)
        spent = time.perf_counter() - begin
        assert isinstance(answer, EstimatorOutput)
        return 1e6 * spent / len(data)


def costs(robot):
    """Print microseconds a message with the topics heard and unheard."""
    answered = {
        name: Answered(robot, heard, 'computed' in name or 'neither' not in name)
        for name, heard in HEARD.items()
    }
    best = dict.fromkeys(answered, np.inf)
    for _ in range(ROUNDS):
        for name, one in answered.items():
            best[name] = min(best[name], one.microseconds())
    errors = errors_of_file(robot)
    print(f'{robot.name}: {errors.screws} screws, {errors.causes} causes')
    for name, value in best.items():
        print(f'  {name:40} {value:7.2f} us {value - best["neither"]:+7.2f}')


def sampled(robot, q, qdot, draws, random):
    """Return the covariances (2, 6, 6) of poses and twists of arms drawn at random."""
    said, known = robot.description.uncertainty, named_errors(robot)
    arm, count = every_parameter_of(robot.description), len(known.parameters) - 12
    description = robot.description
    base, tool = description.base.motion.matrix, description.tool.motion.matrix
    chain = placement(arm.chain, base, tool, (count, count + 6))
    names = [one.name for one in known.parameters]
    at = [names.index(name) for name, _ in said.factor]
    L = np.zeros((len(at), len(at)))
    for k, (_, row) in enumerate(said.factor):
        L[k, : len(row)] = row
    middle = poses_of(chain, np.zeros(len(names)), q[None])[0]
    step = 1e-5
    found = np.empty((draws, 2, 6))
    for k in range(draws):
        values = np.zeros(len(names))
        values[at] = L @ random.normal(size=len(at))
        joints = q + np.array(said.noise) * random.normal(size=len(q))
        rates = qdot + np.array(said.velocity_noise) * random.normal(size=len(q))
        moments = joints + step * np.outer([-1.0, 0.0, 1.0], rates)
        before, pose, after = poses_of(chain, values, moments)
        found[k, 0, :3] = pose[:3, 3] - middle[:3, 3]
        found[k, 0, 3:] = rotation_vector((pose[:3, :3] @ middle[:3, :3].T)[None])[0]
        found[k, 1, :3] = (after - before)[:3, 3] / (2 * step)
        turned = after[:3, :3] @ before[:3, :3].T
        found[k, 1, 3:] = rotation_vector(turned[None])[0] / (2 * step)
    return np.array([np.cov(found[:, kind].T) for kind in range(2)])


def compare(name, draws, random):
    """Print how far covariances of an arm are from those of draws."""
    robot = uncertain(ks.load_robot(name), random)
    q, qdot = random.uniform(-1.0, 1.0, (2, robot.dof))
    expected = sampled(robot, q, qdot, draws, random)
    found = [ks.pose_covariance(robot, q), ks.twist_covariance(robot, q, qdot)]
    print(f'{name:24}', end='')
    for one, other in zip(found, expected):
        sizes = np.sqrt(np.diag(one))
        moving = np.ix_(*[sizes > 1e-9 * sizes.max()] * 2)
        scaled = np.abs(one - other)[moving] / np.outer(sizes, sizes)[moving]
        print(f' {100 * scaled.max():6.2f} %', end='')
    print(flush=True)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--robot', action='append')
    parser.add_argument('--draws', type=int, default=100_000)
    given = parser.parse_args()
    for name in given.robot or ('ur5e', 'panda'):
        costs(uncertain(ks.load_robot(name), np.random.default_rng(1)))
        costs(uncertain(ks.load_robot(name), np.random.default_rng(1), dense=False))
    if given.draws:
        print(f'\nlargest difference from {given.draws} draws, pose and twist')
        for name in ARMS:
            compare(name, given.draws, np.random.default_rng(2))
