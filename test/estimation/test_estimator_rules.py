# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The compiled estimator against its rules in plain Python, bit for bit, over streams of messages.
"""

import math
from array import array

import numpy as np
import pytest
from arms import robot_of
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_estimator import PlainEstimator, same
from random_robots import random_arm

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation import outcomes as reasons
from kinematics_service.estimation.estimator import (
    VELOCITY_SOURCES,
    AcceptedMessage,
    Estimator,
    EstimatorSettings,
    RefusedMessage,
)
from kinematics_service.estimation.joint_sample import JointSample

MILLISECOND = 1_000_000
SECOND = 1_000_000_000
START = 100 * SECOND


def arms():
    names = ['planar_2r', 'craig_3r', 'parallelogram_left', 'ur3e', 'offset_stanford_shape']
    yield from map(robot_of, names)
    # Of many joints that turn, the singular poses take most of a second.
    turning = ((1, 'standard'), (2, 'elementary'), (5, 'standard'), (5, 'elementary'))
    for dof, convention in (*turning, (9, 'standard')):
        yield ks.robot_from_text(random_arm(dof, dof, convention).text())
    yield ks.robot_from_text(random_arm(12, 12, 'elementary', ('prismatic',)).text())


ARMS = tuple(arms())

# Positions that repeat, so that joints stand still, jump away and back, or wrap; and a few that no
# arm ever has.
SANE = st.sampled_from(
    [0.0, 0.0004, 0.5, 0.5 + 1e-9, 0.45, 0.4, -0.5, 3.1, -3.1, 6.0, 100.0, 1.0 / 3.0]
)
INSANE = st.sampled_from([math.nan, math.inf, -math.inf, 1e15, 1.1e15, -1e16, 1e308, -0.0, 5e-324])
ODD = st.one_of(SANE, st.floats(-10, 10), INSANE)
RATES = st.sampled_from([0.0, 1.0, -2.0, 1e-3, 1.0 / 3.0])
# Steps of a publisher's clock: mostly forwards, sometimes repeated, late, or a reset.
STEPS = st.sampled_from(
    [10 * MILLISECOND] * 6
    + [0, 1, -1, -20 * MILLISECOND, 900 * MILLISECOND, SECOND, SECOND + 1, -SECOND, -SECOND - 1]
    + [5 * SECOND, -60 * SECOND]
)


@st.composite
def streams(draw, names):
    """Draw samples of up to three publishers, each with names of its own, over one topic."""
    known = [*names, *('wheel', 'finger')]
    publishers = []
    for _ in range(draw(st.integers(1, 3))):
        order = draw(st.permutations(known))
        count = draw(st.sampled_from([len(order), len(order), max(1, len(order) // 2)]))
        publishers.append(tuple(order[:count]))
    stamp = arrival = START
    samples = []
    for _ in range(draw(st.integers(1, 15))):
        step = draw(STEPS)
        stamp, arrival = stamp + step, arrival + abs(step)
        listed = draw(st.sampled_from(publishers))
        if draw(st.integers(0, 30)) == 0:
            listed = (*listed, draw(st.sampled_from(known)))
        count = len(listed) if draw(st.integers(0, 20)) else draw(st.integers(0, 3))
        moving = draw(st.sampled_from([0, 0, len(listed), len(listed), 1]))
        odd = draw(st.integers(0, 12))
        samples.append(
            JointSample(
                listed,
                draw(st.lists(ODD if odd == 1 else SANE, min_size=count, max_size=count)),
                draw(st.lists(ODD if odd == 2 else RATES, min_size=moving, max_size=moving)),
                0 if draw(st.integers(0, 15)) == 0 else stamp,
                arrival + 7,
                arrival,
            )
        )
    return samples


@st.composite
def cases(draw):
    robot = draw(st.sampled_from(ARMS))
    prefix = draw(st.sampled_from(['', '', 'left_']))
    setting = EstimatorSettings(
        prefix,
        draw(st.sampled_from(VELOCITY_SOURCES)),
        draw(st.sampled_from([SECOND, SECOND, 50 * MILLISECOND])),
    )
    return robot, setting, draw(streams([prefix + name for name in robot.joint_names]))


def known_alike(one, plain, arrival):
    assert one.counts == plain.counts
    assert one.joints.missing(arrival) == plain.missing(arrival)
    assert one.joints.age(arrival) == plain.age(arrival)
    assert one.joints.disputed(arrival) == plain.disputed(arrival)
    assert one.joints.newest() == plain.newest()
    jumps = one.joints.columns.jump_count.tolist()
    assert [min(count, 16) for count in jumps] == [
        len(joint.jumps) for joint in plain.joints.values()
    ]


@pytest.mark.slow
@settings(max_examples=50, deadline=None)
@given(case=cases(), depth=st.sampled_from([kernel.JACOBIAN, kernel.ALL_FRAMES]))
def test_every_answer_is_that_of_the_plain_rules(case, depth):
    robot, setting, samples = case
    one, plain = Estimator(robot, setting), PlainEstimator(robot, setting)
    for sample in samples:
        outcome = one.take(sample, depth)
        assert same(outcome, plain.take(sample, depth)), outcome
        known_alike(one, plain, sample.arrival)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(case=cases())
def test_accepting_alone_follows_the_same_rules(case):
    robot, setting, samples = case
    one, plain = Estimator(robot, setting), PlainEstimator(robot, setting)
    both = Estimator(robot, setting)
    for sample in samples:
        outcome = one.accept(sample)
        assert same(outcome, plain.accept(sample)), outcome
        known_alike(one, plain, sample.arrival)
        # And so does `take`, whose answers are of the same joints.
        answer = both.take(sample)
        if isinstance(outcome, AcceptedMessage) and not isinstance(answer, RefusedMessage):
            assert np.array_equal(answer.state.q, outcome.q)
            assert answer[1:3] == outcome[2:]


@pytest.mark.parametrize('step', [0.0, 0.1, 3.0, math.pi, -math.pi, 3.2, -3.2, 2 * math.pi, 1e15])
def test_the_shortest_angle_is_the_ieee_remainder(step):
    for x in (step, np.nextafter(step, 9e15), np.nextafter(step, -9e15), 7 * step, -step):
        found = kernel.shortest_angle(float(x))
        assert found == math.remainder(x, math.tau)
        assert math.copysign(1.0, found) == math.copysign(1.0, math.remainder(x, math.tau))


@pytest.mark.parametrize(
    'form', [list, tuple, np.array, lambda x: array('d', x), np.float32, lambda x: frozen(x)]
)
def test_numbers_are_taken_in_every_form(form):
    robot = robot_of('craig_3r')
    one, plain = (make(robot, EstimatorSettings()) for make in (Estimator, PlainEstimator))
    numbers = form([0.25, -0.5, 1.5])
    sample = JointSample(robot.joint_names, numbers, numbers, START, START, START)
    assert same(one.take(sample), plain.take(sample))


def frozen(numbers):
    array = np.array(numbers)
    array.setflags(write=False)
    return array


def test_a_shallow_answer_is_the_deep_one_without_its_frames():
    robot = robot_of('ur5e')
    q = [0.1 * j for j in range(6)]
    sample = JointSample(robot.joint_names, q, q, START, START, START)
    shallow = Estimator(robot, EstimatorSettings()).take(sample, kernel.JACOBIAN)
    deep = Estimator(robot, EstimatorSettings()).take(sample)
    width = len(shallow.state.numbers)
    assert np.array_equal(shallow.state.numbers, deep.state.numbers[:width])
    assert deep.state.link_frames.shape == (7, 4, 4)
    shallow_quaternion = shallow.state.continuous_quaternion_xyzw
    assert np.array_equal(shallow_quaternion, deep.state.continuous_quaternion_xyzw)


def test_another_timeout_and_source_count_from_the_next_message_on():
    robot = robot_of('planar_2r')
    one = Estimator(robot, EstimatorSettings())
    q = [0.1, 0.2]

    def take(at, velocities=(1.0, 2.0)):
        return one.take(JointSample(robot.joint_names, q, velocities, at, at, at))

    assert take(START).velocity_source == 'message'
    one.configure(robot, EstimatorSettings('', 'difference', 20 * MILLISECOND))
    assert take(START + 10 * MILLISECOND).velocity_source == 'difference'
    assert take(START + 40 * MILLISECOND).velocity_source == 'none'
    assert one.counts[reasons.RESETS] == 0
    take(START + 10 * MILLISECOND)
    assert one.counts[reasons.RESETS] == 1
