# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""An arm with closed loops, message by message: the branch is kept, and its end is refused."""

import math
import re

import numpy as np
import pytest
from arms import robot_of
from linkages import SHORT_FIVE_BAR
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service.estimation import outcomes as reasons
from kinematics_service.estimation.estimator import (
    Estimator,
    EstimatorOutput,
    EstimatorSettings,
    RefusedMessage,
)
from kinematics_service.estimation.joint_sample import JointSample

MILLISECOND = 1_000_000
# Another start of Newton's method ends in other last digits.
SAME_BRANCH = 1e-11


class Stream:
    """Samples every millisecond to an estimator."""

    def __init__(self, robot):
        self.robot, self.estimator, self.at = robot, Estimator(robot, EstimatorSettings()), 10**10

    def take(self, q, qdot=()):
        self.at += MILLISECOND
        names = self.robot.joint_names
        return self.estimator.take(
            JointSample(names, tuple(q), tuple(qdot), self.at, self.at, self.at)
        )


def motion(robot, count=100):
    # Round the assembled position, each joint at a pace of its own.
    assembled = robot.chain.closure.assembled()
    size = np.where([kind == 'prismatic' for kind in robot.joint_types], 0.1, 0.2)
    t = np.linspace(0.0, 2 * math.pi, count)[:, None]
    return assembled + size * np.sin(t * np.arange(1, robot.dof + 1))


@pytest.mark.parametrize('name', ['crank_slider', 'four_bar_arm', 'flexpicker'])
def test_a_stream_of_messages_is_answered_as_the_library_answers(name):
    robot = robot_of(name)
    stream, path = Stream(robot), motion(robot_of(name))
    for q in path:
        found = stream.take(q, np.ones(robot.dof))
        assert isinstance(found, EstimatorOutput)
        expected = ks.evaluate(robot, q, np.ones(robot.dof))
        for one, other in (
            (found.state.pose, expected.pose),
            (found.state.jacobian, expected.jacobian),
            (found.state.twist, expected.twist),
            (found.state.closure.passive, expected.closure.passive),
        ):
            np.testing.assert_allclose(one, other, rtol=SAME_BRANCH, atol=SAME_BRANCH)
        assert np.max(found.state.closure.residuals) < ROUND_OFF
        # Warm: a step or two of Newton's method for a millisecond.
        assert np.max(found.state.closure.steps) <= 3


def test_the_end_of_a_branch_is_refused_with_its_reason_and_nothing_jumps():
    robot = ks.robot_from_text(SHORT_FIVE_BAR)
    stream = Stream(robot)
    # The elbows part: |A - B| = 0.6 m where the rods are straight.
    opening = np.linspace(0.0, 0.9, 100)
    answers = [stream.take((math.pi / 2 + x, math.pi / 2 - x)) for x in opening]
    # Half the way between the elbows is 0.15 + 0.25 sin x, and a rod 0.3.
    closes = 0.15 + 0.25 * np.sin(opening) < 0.3
    assert 50 < np.sum(closes) < 95
    for answer, closed in zip(answers, closes):
        assert isinstance(answer, EstimatorOutput) == closed
    refused = [answer for answer in answers if isinstance(answer, RefusedMessage)]
    assert {answer.reason for answer in refused} == {reasons.NOT_CLOSED}
    assert "'rods' of short_five_bar" in refused[0].sentence
    assert re.search(r'at \[2\.\d+, 0\.\d+\].* at \[2\.\d+, 0\.\d+\]$', refused[0].sentence)
    assert not any(answer.sentence for answer in refused[1:])
    assert stream.estimator.counts[reasons.NOT_CLOSED] == len(refused)
    # The tip is above the elbows all the time, and again on the way back.
    back = [stream.take((math.pi / 2 + x, math.pi / 2 - x)) for x in opening[::-1]]
    kept = [answer for answer in [*answers, *back] if isinstance(answer, EstimatorOutput)]
    assert len(kept) == 2 * np.sum(closes)
    height = [answer.state.position[1] for answer in kept]
    expected = 0.25 * np.cos(opening) + np.sqrt(
        np.maximum(0.3**2 - (0.15 + 0.25 * np.sin(opening)) ** 2, 0.0)
    )
    expected = [*expected[closes], *expected[closes][::-1]]
    # Where the rods are nearly straight the height has the root of the round-off.
    np.testing.assert_allclose(height, expected, rtol=0, atol=1e-7)


def test_a_joint_that_turns_on_and_on_keeps_its_branch():
    robot = robot_of('crank_slider')
    stream = Stream(robot)
    for angle in np.arange(0.0, 14.0, 0.02):
        wrapped = math.remainder(angle, 2 * math.pi)
        for q in (angle, wrapped):
            found = stream.take((q,))
            assert isinstance(found, EstimatorOutput)
            expected = 0.05 * math.cos(q) + math.sqrt(0.15**2 - (0.05 * math.sin(q)) ** 2)
            assert found.state.position[0] == pytest.approx(expected, abs=ROUND_OFF)
            assert np.max(found.state.closure.steps) <= 5


def test_a_jump_is_answered_from_the_known_position():
    robot = ks.robot_from_text(SHORT_FIVE_BAR)
    stream = Stream(robot)
    random = np.random.default_rng(1)
    for q in random.uniform(-math.pi, math.pi, (40, 2)):
        found = stream.take(q)
        try:
            expected = ks.forward_kinematics(robot, q)
        except ks.LoopError:
            assert isinstance(found, RefusedMessage)
            continue
        np.testing.assert_allclose(found.state.pose, expected, rtol=0, atol=1e-9)


def test_a_recording_leaves_out_what_does_not_close():
    robot = ks.robot_from_text(SHORT_FIVE_BAR)
    estimator = Estimator(robot, EstimatorSettings())
    names, at = robot.joint_names, 10**10
    good = estimator.accept(JointSample(names, (1.5, 1.6), (), at, at, at))
    np.testing.assert_array_equal(good.q, [1.5, 1.6])
    at += MILLISECOND
    bad = estimator.accept(JointSample(names, (math.pi, 0.0), (), at, at, at))
    assert isinstance(bad, RefusedMessage)
    assert bad.reason == reasons.NOT_CLOSED


def test_another_robot_file_of_the_same_joints_starts_on_its_own_branch():
    robot = robot_of('four_bar_arm')
    text = ks.bundled_robots()['four_bar_arm'].read_text(encoding='utf-8').split('known_poses')[0]
    other = ks.robot_from_text(text.replace('psi1: -1.52, psi2: -1.50', 'psi1: -2.34, psi2: 1.50'))
    stream = Stream(robot)
    q = robot.chain.closure.assembled() + 0.1
    first = stream.take(q).state.pose
    stream.estimator.configure(other, EstimatorSettings())
    second = stream.take(q).state.pose
    np.testing.assert_allclose(second, ks.forward_kinematics(other, q), rtol=0, atol=SAME_BRANCH)
    assert np.max(np.abs(second - first)) > 0.1
