# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Joint efforts: the bias is the mean of the last messages, and of none before a gap."""

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.estimation.cdr import SECOND
from kinematics_service.estimation.estimator import Estimator, EstimatorSettings
from kinematics_service.estimation.joint_efforts import AVERAGED, JointEfforts
from kinematics_service.estimation.joint_sample import JointSample
from kinematics_service.estimation.joint_state_form import SerializedSample, form_of

ROBOT = ks.load_robot('planar_2r')


class Heard:
    """An estimator that messages with efforts are given to."""

    def __init__(self):
        self.estimator, self.at = Estimator(ROBOT, EstimatorSettings()), SECOND
        self.efforts = self.estimator.quantity(JointEfforts)

    def take(self, efforts):
        self.at += 1
        q, at = [0.1, 0.2], self.at
        sample = JointSample(ROBOT.joint_names, q, (), at, at, at, efforts)
        answer = self.estimator.take(sample, quantities=[JointEfforts])
        return answer.quantities[JointEfforts]


def test_the_bias_is_the_mean_of_the_last_messages():
    heard = Heard()
    for k in range(AVERAGED + 10):
        heard.take([float(k), 1.0])
    assert heard.efforts.take_bias() == AVERAGED
    np.testing.assert_allclose(heard.efforts.bias, [9.5 + AVERAGED / 2, 1.0], rtol=1e-12)


def test_the_bias_is_not_averaged_across_a_gap_of_efforts():
    heard = Heard()
    assert heard.take([1.0, 1.0]).tolist() == [1.0, 1.0]
    for gap in ([np.nan, 1.0], ()):
        assert heard.take(gap) is None
        assert heard.efforts.take_bias() == 0
        before = 0.0 if heard.efforts.bias is None else heard.efforts.bias
        assert heard.take([3.0, 5.0]).tolist() == ([3.0, 5.0] - np.array(before)).tolist()
        assert heard.efforts.take_bias() == 1
        assert heard.efforts.bias.tolist() == [3.0, 5.0]
        assert heard.take([4.0, 7.0]).tolist() == [1.0, 2.0]


def test_bytes_have_the_efforts_of_the_message():
    pytest.importorskip('rclpy')
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import JointState

    message = JointState(name=['other', 'q2', 'q1'], position=[0.0, 0.2, 0.1])
    message.effort, message.header.stamp.sec = [9.0, 2.0, 1.0], 7
    data, estimator = serialize_message(message), Estimator(ROBOT, EstimatorSettings())
    sample = SerializedSample(form_of(data), data, SECOND)
    answer = estimator.take(sample, quantities=[JointEfforts])
    assert answer.stamp == 7 * SECOND
    assert answer.quantities[JointEfforts].tolist() == [1.0, 2.0]
