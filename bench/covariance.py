"""
What the covariances of pose and twist cost a message, all in one run: what counts are differences.

    python bench/covariance.py [--robot ur5e]

A joint state is taken from its bytes and answered: the messages are filled, and not sent. The arm
has noise in every joint, and first a covariance of all numbers of its table as `calibrate` writes
it, then standard deviations of them.
"""

import argparse
import time
from dataclasses import replace

import numpy as np
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation.estimator import Estimator, EstimatorOutput
from kinematics_service.kinematics.uncertainty.arm_errors import errors_of_file
from kinematics_service.kinematics.uncertainty.parameters import parameters_of
from kinematics_service.robot.file.parts.description import Uncertainty
from kinematics_service.robot.robot import build_robot
from kinematics_service.ros.messages.joint_state_reader import JointStateReader
from kinematics_service.ros.messages.message_layout import MessageLayout
from kinematics_service.ros.messages.topics import topics_of
from kinematics_service.ros.node.outputs import Channel, filled_by_the_kernel
from kinematics_service.ros.parameters.settings import settings_from
from kinematics_service.ros.parameters.table import PARAMETERS

ROUNDS, MESSAGES = 600, 40
USUAL = ('~/pose', '~/jacobian', '~/twist')
POSE, TWIST = '~/pose_with_covariance', '~/twist_with_covariance'
HEARD = {
    'neither': USUAL,
    'neither, frames computed': USUAL,
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
        print(f'  {name:26} {value:7.2f} us {value - best["neither"]:+7.2f}')


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--robot', action='append')
    for name in parser.parse_args().robot or ('ur5e', 'panda'):
        for dense in (True, False):
            costs(uncertain(ks.load_robot(name), np.random.default_rng(1), dense))
