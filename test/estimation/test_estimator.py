# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What becomes of a joint sample: the input table of the node, without ROS."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinematics_service as ks
from kinematics_service.estimation import outcomes as reasons
from kinematics_service.estimation.estimator import (
    VELOCITY_SOURCES,
    Estimator,
    EstimatorOutput,
    EstimatorSettings,
    RefusedMessage,
)
from kinematics_service.estimation.joint_sample import JointSample
from kinematics_service.kinematics.singularity import singularity_of
from kinematics_service.robot.chain import fold
from kinematics_service.robot.conventions import Row
from kinematics_service.robot.file.text.expressions import Affine
from kinematics_service.robot.robot import build_robot, with_chain

ROUND_OFF = 1e-12
# A difference of two numbers near 1 over 10 ms carries the round-off of both.
DIFFERENCE = 1e-12 / 0.01
SECOND = 1_000_000_000
MILLISECOND = 1_000_000
START = 100 * SECOND
NAMES = ('q1', 'q2', 'q3')
Q = (0.3, -0.4, 1.2)


@pytest.fixture(scope='module')
def craig():
    return ks.load_robot('craig_3r')


@pytest.fixture
def one(craig):
    return Estimator(craig, EstimatorSettings())


def sample(positions=Q, velocities=(), at=START, names=NAMES, arrival=None):
    """Return a sample stamped `at` (ns) and heard then, or at `arrival`."""
    heard = at if arrival is None else arrival
    return JointSample(names, positions, velocities, at, heard, heard)


def refused(outcome, reason):
    return isinstance(outcome, RefusedMessage) and outcome.reason == reason


# Merging


def test_an_answer_is_what_the_library_says(one, craig):
    qdot = (0.1, 0.2, -0.3)
    answer = one.take(sample(Q, qdot))
    assert isinstance(answer, EstimatorOutput)
    assert np.array_equal(answer.state.pose, ks.forward_kinematics(craig, Q))
    assert np.array_equal(answer.state.jacobian, ks.jacobian(craig, Q))
    assert np.array_equal(answer.state.twist, ks.twist(craig, Q, qdot))
    assert np.array_equal(answer.state.link_frames, ks.link_frames(craig, Q))
    assert answer.stamp == START
    assert answer.velocity_source == 'message'


@pytest.mark.parametrize('order', [(0, 1, 2), (2, 1, 0), (1, 2, 0), (2, 0, 1)])
def test_names_count_and_not_their_order(one, order):
    answer = one.take(
        sample([Q[i] for i in order], [float(i) for i in order], names=[NAMES[i] for i in order])
    )
    assert answer.state.q.tolist() == list(Q)
    assert answer.state.qdot.tolist() == [0.0, 1.0, 2.0]


def test_extra_joints_are_not_ours_even_when_they_are_nonsense(one):
    names = ('wheel', 'q2', 'wheel', 'q1', 'finger', 'q3')
    answer = one.take(
        sample(
            (math.nan, Q[1], math.inf, Q[0], 1e300, Q[2]),
            (math.nan, 2.0, math.inf, 1.0, math.nan, 3.0),
            names=names,
        )
    )
    assert answer.state.q.tolist() == list(Q)
    assert answer.state.qdot.tolist() == [1.0, 2.0, 3.0]


def test_joints_of_several_messages_are_merged_and_each_is_answered_once_all_are_known(one):
    assert refused(one.take(sample(Q[:1], names=('q1',))), reasons.WAITING)
    assert refused(one.take(sample(Q[1:2], names=('q2',))), reasons.WAITING)
    assert one.take(sample(Q[2:], names=('q3',), at=START + 1)).state.q.tolist() == list(Q)
    answer = one.take(sample((0.5,), names=('q1',), at=START + 2))
    assert answer.state.q.tolist() == [0.5, *Q[1:]]
    assert answer.stamp == START + 2


def test_a_joint_that_fell_silent_makes_the_arm_stale_and_no_other_joint_can_help(one):
    one.take(sample())
    late = START + 1001 * MILLISECOND
    assert one.joints.missing(START + SECOND) == ()
    assert one.joints.missing(late) == NAMES
    assert refused(one.take(sample(Q[:2], names=NAMES[:2], at=late)), reasons.WAITING)
    assert one.joints.missing(late) == ('q3',)
    assert isinstance(one.take(sample(Q[2:], names=('q3',), at=late)), EstimatorOutput)


def test_age_is_that_of_the_joint_longest_unheard(one):
    assert one.joints.age(START) == math.inf
    one.take(sample())
    one.take(sample(Q[:1], names=('q1',), at=START + 500 * MILLISECOND))
    assert one.joints.age(START + 600 * MILLISECOND) == pytest.approx(0.6)


def test_staleness_is_measured_by_arrival_and_not_by_stamps(one):
    one.take(sample(at=START, arrival=7 * SECOND))
    assert one.joints.missing(8 * SECOND) == ()
    assert one.joints.missing(8 * SECOND + 1) == NAMES


def test_a_prefix_stands_before_every_name(craig):
    left = Estimator(craig, EstimatorSettings(joint_prefix='left_'))
    assert refused(left.take(sample()), reasons.NOT_OURS)
    both = [f'{side}_{name}' for side in ('right', 'left') for name in NAMES]
    assert left.take(sample((9, 9, 9, *Q), names=both)).state.q.tolist() == list(Q)


def test_another_prefix_forgets_the_joints_and_other_settings_keep_them(one, craig):
    one.take(sample())
    one.configure(craig, EstimatorSettings(velocity_source='difference'))
    assert isinstance(one.take(sample(Q[:1], names=('q1',), at=START + 1)), EstimatorOutput)
    one.configure(craig, EstimatorSettings(joint_prefix='left_'))
    assert one.joints.missing(START + 2) == ('left_q1', 'left_q2', 'left_q3')


# Rejections


@pytest.mark.parametrize(
    ('names', 'positions', 'reason'),
    [
        (('a', 'b', 'c'), Q, reasons.NOT_OURS),
        ((), (), reasons.NOT_OURS),
        ((), Q, reasons.NOT_OURS),
        (NAMES, (), reasons.NO_POSITION),
        (NAMES, Q[:2], reasons.MALFORMED),
        (NAMES, (*Q, 1.0), reasons.MALFORMED),
        (('q1', 'q2', 'q3', 'q1'), (*Q, 0.0), reasons.DUPLICATE),
        (NAMES, (0.0, math.nan, 0.0), reasons.NOT_FINITE),
        (NAMES, (0.0, 0.0, math.inf), reasons.NOT_FINITE),
        (NAMES, (-math.inf, 0.0, 0.0), reasons.NOT_FINITE),
        (NAMES, (1e308, 0.0, 0.0), reasons.TOO_LARGE),
        (NAMES, (0.0, -1.1e15, 0.0), reasons.TOO_LARGE),
    ],
)
def test_a_bad_message_is_counted_and_the_next_good_one_answered(one, names, positions, reason):
    one.take(sample())
    outcome = one.take(sample(positions, names=names, at=START + 1))
    assert refused(outcome, reason)
    assert one.counts[reason] == 1
    assert one.take(sample((1.0, 1.0, 1.0), at=START + 2)).state.q.tolist() == [1.0, 1.0, 1.0]


def test_a_rejected_message_leaves_nothing_behind(one):
    one.take(sample())
    one.take(sample((9.0, math.nan, 9.0), at=START + 1))
    answer = one.take(sample(Q[2:], names=('q3',), at=START + 2))
    assert answer.state.q.tolist() == list(Q)


def test_a_rejection_names_the_joint_and_its_value(one):
    assert 'q2' in one.take(sample((0.0, math.nan, 0.0))).sentence
    assert '3 names but 2 positions' in one.take(sample(Q[:2])).sentence
    assert 'q1' in one.take(sample((1, 2), names=('q1', 'q1'))).sentence


def test_the_largest_position_that_is_taken_gives_finite_numbers(one):
    answer = one.take(sample((1e15, -1e15, 1e15)))
    assert np.all(np.isfinite(answer.state.numbers))


def stretched(coefficient):
    """Return the SCARA arm with its slide so many times as fast, which no robot file may have."""
    robot = ks.load_robot('scara_hsr065')
    still, none = np.eye(4), Affine(0.0, ())
    rows = [
        *(Row(still, Affine(0.0, ((name, 1.0),)), none, still) for name in robot.variables[:2]),
        Row(still, none, Affine(0.0, ((robot.variables[2], coefficient),)), still),
        Row(still, Affine(0.0, ((robot.variables[3], 1.0),)), none, still),
    ]
    return with_chain(robot, fold(rows, robot.variables, still, still))


def test_a_position_that_cannot_be_computed_with_is_forgotten_with_all_others():
    one = Estimator(stretched(1e300), EstimatorSettings())
    names = one.robot.joint_names
    outcome = one.take(sample((0.4, 0.2, 3e14, 0.1), names=names))
    assert refused(outcome, reasons.TOO_LARGE)
    # The other joints must not be answered with what was refused, nor be known themselves.
    assert one.joints.missing(START) == names
    others = (*names[:2], names[3])
    outcome = one.take(sample((0.5, 0.6, 0.7), names=others, at=START + 1))
    assert refused(outcome, reasons.WAITING)
    good = one.take(sample((2e-300,), names=names[2:3], at=START + 2))
    assert good.state.q.tolist() == [0.5, 0.6, 2e-300, 0.7]
    assert good.velocity_source == 'none'


# Velocities


@pytest.mark.parametrize(
    'velocities',
    [(), (1.0, 2.0), (1.0, 2.0, 3.0, 4.0), (1.0, math.nan, 3.0), (1e300, 0, math.inf)],
)
def test_velocities_that_cannot_be_used_are_differences_of_positions(one, velocities):
    first = one.take(sample(Q, velocities))
    assert first.state.qdot is None
    assert first.velocity_source == 'none'
    moved = [Q[0] + 0.01, Q[1] - 0.02, Q[2] + 0.03]
    second = one.take(sample(moved, velocities, at=START + 10 * MILLISECOND))
    assert second.velocity_source == 'difference'
    np.testing.assert_allclose(second.state.qdot, [1.0, -2.0, 3.0], atol=DIFFERENCE)


def test_a_velocity_that_is_not_ours_may_be_nan(one):
    answer = one.take(sample((*Q, 0.0), (1.0, 2.0, 3.0, math.nan), names=(*NAMES, 'wheel')))
    assert answer.velocity_source == 'message'


def test_there_is_no_difference_after_a_gap(one):
    one.take(sample())
    assert one.take(sample(at=START + SECOND)).velocity_source == 'difference'
    assert one.take(sample(at=START + 2 * SECOND + 1)).velocity_source == 'none'


def test_a_joint_without_limits_takes_the_shortest_angle(one):
    one.take(sample((math.pi - 0.01, 0.0, 0.0)))
    answer = one.take(sample((-math.pi + 0.01, 0.0, 0.0), at=START + 10 * MILLISECOND))
    assert answer.state.qdot[0] == pytest.approx(2.0, abs=DIFFERENCE)


def test_a_joint_with_limits_does_not():
    ur = ks.load_robot('ur3e')
    one = Estimator(ur, EstimatorSettings())
    one.take(sample([3.1] * 6, names=ur.joint_names))
    answer = one.take(sample([-3.1] * 6, names=ur.joint_names, at=START + 100 * MILLISECOND))
    limited = [-62.0] * 5
    turning = (math.tau - 6.2) / 0.1  # wrist 3 turns endlessly
    np.testing.assert_allclose(answer.state.qdot, [*limited, turning], atol=1e-9)


def test_velocity_source_message_knows_no_differences(craig):
    one = Estimator(craig, EstimatorSettings(velocity_source='message'))
    one.take(sample())
    assert one.take(sample(at=START + 1)).velocity_source == 'none'
    assert one.take(sample(Q, (1, 2, 3), at=START + 2)).state.qdot.tolist() == [1.0, 2.0, 3.0]


def test_velocity_source_difference_reads_no_velocities(craig):
    one = Estimator(craig, EstimatorSettings(velocity_source='difference'))
    assert one.take(sample(Q, (9.0, 9.0, 9.0))).velocity_source == 'none'
    answer = one.take(sample(Q, (9.0, 9.0, 9.0), at=START + 1))
    assert answer.state.qdot.tolist() == [0.0, 0.0, 0.0]


def test_one_driver_with_velocities_and_one_without_are_both_used(one):
    for k in range(2):
        one.take(sample(Q[:2], (1.0, 2.0), at=START + k * 10 * MILLISECOND, names=NAMES[:2]))
        answer = one.take(sample((0.5 * k,), at=START + (10 * k + 5) * MILLISECOND, names=('q3',)))
    assert answer.velocity_source == 'difference'
    np.testing.assert_allclose(answer.state.qdot, [1.0, 2.0, 50.0], atol=DIFFERENCE)


# Stamps


@pytest.mark.parametrize('back', [0, 1, MILLISECOND, SECOND])
def test_an_equal_stamp_or_one_a_little_older_is_dropped(one, back):
    one.take(sample(at=START + 2 * SECOND))
    outcome = one.take(sample((9.0, 9.0, 9.0), at=START + 2 * SECOND - back))
    assert refused(outcome, reasons.DROPPED)
    assert one.counts[reasons.RESETS] == 0


@pytest.mark.parametrize('back', [SECOND + 1, 50 * SECOND])
def test_a_big_step_back_is_a_new_start_and_its_message_counts(one, back):
    one.take(sample())
    answer = one.take(sample(at=START - back))
    assert isinstance(answer, EstimatorOutput)
    assert answer.velocity_source == 'none'
    assert one.counts[reasons.RESETS] == 1
    assert one.take(sample(at=START - back + 1)).stamp == START - back + 1
    assert one.counts[reasons.RESETS] == 1


def test_a_message_without_stamp_is_always_taken_at_its_time_of_receipt(one):
    for k in range(3):
        answer = one.take(JointSample(NAMES, (0.1 * k, 0, 0), (), 0, START + k * SECOND // 10, k))
        assert answer.stamp == START + k * SECOND // 10
    np.testing.assert_allclose(answer.state.qdot, [1.0, 0.0, 0.0], atol=DIFFERENCE)
    assert one.counts[reasons.NOT_STAMPED] == 3


def test_messages_without_stamp_in_one_instant_give_no_infinite_velocity(one):
    for k in range(150):
        answer = one.take(JointSample(NAMES, (0.1 * k, 0, 0), (), 0, START, START))
    assert answer.state.qdot is None


def test_a_stamp_after_messages_without_is_taken_whatever_it_is(one):
    one.take(JointSample(NAMES, Q, (), 0, START, START))
    assert isinstance(one.take(sample(at=5)), EstimatorOutput)


@pytest.mark.parametrize('stamp', [-SECOND, -1, 1, 2**31 * SECOND, (2**31 - 1) * SECOND + 2**32])
def test_any_stamp_can_be_the_first(one, stamp):
    assert one.take(sample(at=stamp, arrival=START)).stamp == stamp


def test_a_clock_that_steps_back_resets_once_whoever_tells_of_it_first(one):
    back = 90 * SECOND
    one.take(sample())
    assert one.clock_stepped_back(START - back, back)
    one.take(sample(at=START - back))
    assert one.counts[reasons.RESETS] == 1
    one.take(sample(at=START, arrival=START))
    one.take(sample(at=START - back + 1, arrival=START))
    assert one.counts[reasons.RESETS] == 2
    assert not one.clock_stepped_back(START - back, back)
    assert one.counts[reasons.RESETS] == 2


def test_a_clock_that_steps_back_by_less_than_the_timeout_resets_too(one):
    one.take(sample())
    back = SECOND // 10
    assert one.clock_stepped_back(START - back, back)
    assert isinstance(one.take(sample(at=START - back + 1)), EstimatorOutput)


def test_a_clock_that_steps_back_before_any_message_changes_nothing(one):
    assert not one.clock_stepped_back(0, START)
    assert one.counts[reasons.RESETS] == 0


# Limits and publishers that disagree


def test_a_joint_beyond_its_limit_is_computed_and_named():
    ur = ks.load_robot('ur3e')
    one = Estimator(ur, EstimatorSettings())
    q = [0.0, 6.3, 0.0, -7.0, 0.0, 400.0]
    answer = one.take(sample(q, names=ur.joint_names))
    assert np.array_equal(answer.state.pose, ks.forward_kinematics(ur, q))
    assert one.beyond_limits() == ('shoulder_lift_joint', 'wrist_1_joint')


def test_publishers_that_take_turns_with_other_positions_are_in_dispute(one):
    for k in range(10):
        one.take(sample((0.5 * (k % 2), 0.0, 0.0), at=START + k * MILLISECOND))
    assert one.joints.disputed(START + 10 * MILLISECOND) == ('q1',)
    assert one.joints.disputed(START + 10 * SECOND) == ()


def test_a_publisher_whose_clock_is_behind_is_dropped_but_in_dispute(one):
    for k in range(10):
        one.take(sample(Q, at=START + k * MILLISECOND))
        late = sample(
            (Q[0], Q[1] + 0.1, Q[2]), at=START + k * MILLISECOND - SECOND // 20, arrival=START
        )
        assert refused(one.take(late), reasons.DROPPED)
    assert one.joints.disputed(START + 10 * MILLISECOND) == ('q2',)


def test_a_moving_arm_and_its_late_messages_are_in_no_dispute(one):
    def at(time):
        return [math.sin(time + j) for j in range(3)]

    for k in range(150):
        time = START + 10 * k * MILLISECOND
        one.take(sample(at(0.01 * k), at=time))
        one.take(sample(at(0.01 * k - 0.02), at=time - 20 * MILLISECOND, arrival=time))
    assert one.joints.disputed(time) == ()


def test_two_publishers_that_agree_are_in_no_dispute(one):
    for k in range(100):
        one.take(sample((0.01 * k + 1e-5 * (k % 2), 0.0, 0.0), at=START + k * MILLISECOND))
    assert one.joints.disputed(START + 100 * MILLISECOND) == ()


# Quaternions


def test_the_sign_of_the_quaternion_is_continuous_over_two_turns(one):
    quaternions = []
    for k in range(400):
        answer = one.take(
            sample((4 * math.pi * k / 400, 0.2, 0.3), at=START + k * 10 * MILLISECOND)
        )
        quaternions.append(answer.state.continuous_quaternion_xyzw)
    quaternions = np.array(quaternions)
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, atol=ROUND_OFF)
    assert np.all(np.sum(quaternions[1:] * quaternions[:-1], axis=1) > 0.99)
    # After one turn the orientation is the same and the quaternion the opposite.
    np.testing.assert_allclose(quaternions[200], -quaternions[0], atol=ROUND_OFF)


# Whatever comes


ANYTHING = st.one_of(st.floats(), st.sampled_from([0.0, 1e308, -1e308, 1e15, math.nan]))
STAMPS = st.one_of(
    st.integers(-(2**31) * SECOND, 2**31 * SECOND + 2**32),
    st.integers(0, 5).map(lambda k: k * SECOND // 2),
)
SAMPLES = st.builds(
    JointSample,
    names=st.lists(st.sampled_from([*NAMES, 'wheel', '']), max_size=5),
    positions=st.lists(ANYTHING, max_size=5),
    velocities=st.lists(ANYTHING, max_size=5),
    stamp=STAMPS,
    received=STAMPS,
    arrival=st.integers(0, 10 * SECOND),
)


@pytest.mark.slow
@settings(max_examples=50, deadline=None)
@given(samples=st.lists(SAMPLES, max_size=12), source=st.sampled_from(VELOCITY_SOURCES))
def test_no_sample_makes_it_raise_and_every_answer_is_finite(craig, samples, source):
    one = Estimator(craig, EstimatorSettings(velocity_source=source))
    for each in samples:
        outcome = one.take(each)
        if isinstance(outcome, EstimatorOutput):
            assert np.all(np.isfinite(outcome.state.numbers))
            assert abs(np.linalg.norm(outcome.state.continuous_quaternion_xyzw) - 1.0) < ROUND_OFF
            ks.singularity(craig, outcome.state.q, outcome.state.qdot)
    assert sum(
        count
        for reason, count in one.counts.items()
        if reason not in (reasons.NOT_STAMPED, reasons.RESETS)
    ) == len(samples)


def test_nothing_grows_with_the_number_of_lists_of_names(one):
    for k in range(1000):
        one.take(sample((*Q, 0.0), names=(*NAMES, f'extra_{k}'), at=START + k))
    one.take(sample([0.0] * 100_000, names=[f'j{k}' for k in range(100_000)], at=START + 1000))
    assert len(one.joints._lists) <= 16
    assert max(len(names) for names in one.joints._lists) < 1000


def test_messages_without_a_stamp_are_counted_and_no_others(one):
    one.take(sample())
    one.take(sample((0.1, math.nan, 0.2), at=START + MILLISECOND))
    assert one.counts[reasons.NOT_STAMPED] == 0
    for k, positions in enumerate([Q, (0.1, math.nan, 0.2), Q]):
        heard = START + (2 + k) * MILLISECOND
        one.take(JointSample(NAMES, positions, (), 0, heard, heard))
    assert one.counts[reasons.NOT_STAMPED] == 2


def test_another_arm_says_its_state_at_once_and_other_settings_do_not(craig):
    one = Estimator(craig, EstimatorSettings())

    def said(at, q=(0.3, 0.001, 0.2)):
        answer = one.take(sample(q, at=at))
        return one.judge(singularity_of(answer.state), at)[1]

    assert [said(START + k * MILLISECOND) for k in range(3)] == [True, False, False]
    one.configure(craig, EstimatorSettings(timeout=2 * SECOND))
    assert not said(START + 3 * MILLISECOND)
    longer = dataclasses.replace(craig.description, known_poses=())
    one.configure(build_robot(longer), EstimatorSettings(timeout=2 * SECOND))
    assert said(START + 4 * MILLISECOND)
    assert not said(START + 5 * MILLISECOND)


def test_a_level_is_kept_up_where_the_pose_is_nearly_singular():
    robot = ks.load_robot('puma560')
    one = Estimator(robot, EstimatorSettings())
    found = ks.singularity(robot, [0.1, -1.0, 1.2, 0.5, 0.9, 0.7])
    found = dataclasses.replace(found, distance=0.5, level=ks.Level.WARN)
    levels = [one.judge(found, START + k * MILLISECOND)[0] for k in range(2)]
    assert levels == [ks.Level.WARN, ks.Level.WARN]


# A change of the arm


def test_the_last_answer_is_computed_anew_for_another_arm_once_all_joints_are_known(craig):
    one = Estimator(craig, EstimatorSettings())
    last = one.take(sample(velocities=(0.1, 0.2, -0.3)))
    longer = ks.robot_from_text(
        ks.bundled_robots()['craig_3r'].read_text() + 'tool: {xyz: [0, 0, 0.1]}\n'
    )
    one.configure(longer, EstimatorSettings())
    answer = one.anew(last)
    np.testing.assert_array_equal(answer.state.pose, ks.forward_kinematics(longer, Q))
    assert np.linalg.norm(answer.state.continuous_quaternion_xyzw) == pytest.approx(
        1.0, abs=ROUND_OFF
    )
    assert not np.array_equal(answer.state.pose, last.state.pose)
    assert Estimator(longer, EstimatorSettings()).anew(last) is None
