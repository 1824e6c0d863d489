# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Faults of joint states: each planted fault is named, and healthy streams have none."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.estimation.input_checks import (
    FORM_LIMIT,
    MESSAGE_LIMIT,
    SIZE_LIMIT,
    WINDOW,
    JointMessages,
    arrival_jitter,
    input_faults,
)
from kinematics_service.estimation.joint_state_columns import SECOND
from kinematics_service.robot.file.parts.description import MimicFormula

BEGIN = 1_795_720_000 * SECOND
DEGREES = math.degrees(1.0)
# One joint, one without limits that slides, six, seven; SCARA and crank slide.
ARMS = ('planar_2r', 'craig_3r', 'scara_hsr065', 'ur5e', 'panda')


def stream(robot, t, q, qdot=None, stamps=None, late=0.001, names=None):
    """Return messages measured at t (s), that arrive `late` (s) later."""
    stamps = BEGIN + np.round(t * 1e9).astype(np.int64) if stamps is None else stamps
    arrivals = np.round((t + late) * 1e9).astype(np.int64)
    qdot = np.full(q.shape, np.nan) if qdot is None else qdot
    return JointMessages(
        names or robot.joint_names, arrivals, stamps // SECOND, stamps % SECOND, q, qdot
    )


def faults(robot, *groups, timeout=SECOND, names=None, **options):
    """Return the faults as a node finds them that looks at the last messages only."""
    names = {name: name for name in robot.joint_names} if names is None else names
    now = max(group.arrivals[-1] for group in groups)
    recent = [group.taken(group.arrivals >= now - WINDOW) for group in groups]
    recent = [group.taken(slice(-MESSAGE_LIMIT, None)) for group in recent]
    return input_faults(recent, robot, names, timeout, **options)


def swinging(robot, t, speed=0.6, rate=2.0):
    """Return positions and velocities of joints that swing at up to a speed (rad/s, m/s)."""
    phase = rate * t[:, None] + np.arange(robot.dof)
    scale = np.where(robot.prismatic, 0.2, 1.0) * speed
    return scale / rate * np.sin(phase), scale * np.cos(phase)


# Healthy streams


def arrivals_of(kind, t, rng):
    """Return how late messages are (s), sorted by arrival, and which are kept."""
    kept = np.ones(len(t), dtype=bool)
    late = np.full(len(t), 0.001)
    if kind == 'jitter':
        late += np.minimum(rng.exponential(0.002, len(t)), 0.9 * np.diff(t, append=t[-1] + 1.0))
    elif kind == 'pairs':
        late[:-1:2] += 0.999 * np.diff(t)[::2]
    elif kind == 'batches':
        late += np.ceil(t) - t + 1e-6 * np.arange(len(t))
    elif kind == 'stall':
        begin, end = 3.0, 3.0 + rng.uniform(0.3, 5.0)
        waiting = np.flatnonzero((t > begin) & (t < end))
        kept[waiting[:-100]] = False  # the queue's depth
        late[waiting] = end - t[waiting] + 1e-6 * np.arange(len(waiting))
    return late, kept


RATES = (0.2, 2.0, 10.0, 50.0, 1000.0)
FINE = np.arange(0.0, 9.0, 1e-3)


def moves(robot, rng):
    """Return positions and velocities at FINE of moves that start, stop and pause."""
    top = np.where(np.isfinite(robot.velocity_limits), robot.velocity_limits, 2.0)
    top = np.where(robot.prismatic, np.minimum(top, 0.5), top)
    goals = rng.choice([-0.95, 0.0, 0.0, 0.95], (len(FINE) // 500, robot.dof)) * top
    ramp = np.ones(200) / 200.0
    speeds = [np.convolve(one, ramp)[: len(FINE)] for one in np.repeat(goals, 500, axis=0).T]
    v = np.array(speeds).T
    return np.cumsum(v, axis=0) * 1e-3, v


def sampled(values, t):
    return np.column_stack([np.interp(t, FINE, column) for column in values.T])


# Each arm with one of the kinds, the first two arms with two.
KINDS = ('jitter', 'pairs', 'batches', 'stall')
CASES = [(arm, KINDS[k % 4]) for k, arm in enumerate((*ARMS, *ARMS[:1]))]


@pytest.mark.parametrize(('arm', 'kind'), CASES)
def test_healthy_streams_have_no_fault(arm, kind):
    robot, rng = ks.load_robot(arm), np.random.default_rng(len(arm + kind))
    for rate in RATES:
        q, v = moves(robot, rng)
        t = np.arange(0.0, 9.0, 1.0 / rate)
        late, kept = arrivals_of(kind, t, rng)
        step = np.where(robot.prismatic, 1e-4, 1.5e-3)  # of a coarse encoder
        measured = np.round(sampled(q, t) / step) * step
        turning, lower = np.array(robot.continuous), rng.choice([-math.pi, 0.0])
        measured[:, turning] = np.mod(measured[:, turning] - lower, math.tau) + lower
        for delay in (-0.05, 0.04, None):
            told = None
            if delay is not None:
                told = sampled(v, t - delay) + 1e-3 * rng.normal(size=measured.shape)
            group = stream(robot, t, measured, told, late=late).taken(kept)
            for now in np.arange(1.3, 13.0, 2.9):
                seen = group.taken(group.arrivals <= now * 1e9)
                if len(seen.q):
                    assert faults(robot, seen) == [], (rate, delay, now)


def test_the_joints_of_a_healthy_stream_are_not_looked_at_one_by_one(monkeypatch):
    # The checks of a joint take 0.4 ms of the executor: a gap in the answers of 60 joints.
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 5.0, 0.005)
    q, v = swinging(robot, t)
    monkeypatch.setattr('kinematics_service.estimation.motion_checks.jumps', None)
    for told in (v, np.full(v.shape, np.nan)):
        assert faults(robot, stream(robot, t, q, told)) == []


@pytest.mark.parametrize('period', [0.5, 1.0, 2.5, 7.0])
def test_a_recording_in_a_loop_has_no_fault_of_stamps(period):
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 9.0, 0.02)
    stamps = BEGIN + np.round(np.mod(t, period) * 1e9).astype(np.int64)
    group = stream(robot, t, *swinging(robot, np.mod(t, period)), stamps)
    timeout = round(0.9 * period * SECOND)
    for now in range(1, 9):
        seen = group.taken(group.arrivals <= now * SECOND)
        assert faults(robot, seen, timeout=timeout) == []


@pytest.mark.parametrize('step', [-3600.0, -0.5, 0.5, 3600.0])
def test_a_clock_that_is_set_is_no_wrong_pace(step):
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 9.0, 0.02)
    stamps = BEGIN + np.round((t + np.where(t > 3.0, step, 0.0)) * 1e9).astype(np.int64)
    group = stream(robot, t, *swinging(robot, t), stamps)
    for now in range(1, 9):
        said = faults(robot, group.taken(group.arrivals <= now * SECOND))
        assert not any('time by stamps' in sentence for sentence in said)


def test_messages_that_come_twice_have_no_fault():
    robot, t = ks.load_robot('ur5e'), np.repeat(np.arange(0.0, 6.0, 0.01), 2)
    group = stream(robot, t, *swinging(robot, t), late=0.001 + 1e-5 * (np.arange(len(t)) % 2))
    assert faults(robot, group) == []


@pytest.mark.parametrize('period', [2, 3])
@pytest.mark.parametrize('late', [0.0, 0.015])
def test_more_than_half_dropped_is_a_fault_unless_messages_come_twice(period, late):
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 6.0, 0.01)
    q, qdot = swinging(robot, t)
    arrival = np.concatenate([t + k * (late + 1e-5) for k in range(period)])
    order = np.argsort(arrival, kind='stable')
    rows = np.tile(np.arange(len(t)), period)[order]
    stamps = BEGIN + np.round(t[rows] * 1e9).astype(np.int64)
    group = stream(robot, arrival[order], q[rows], qdot[rows], stamps)
    said = faults(robot, group)
    assert [' dropped: ' in sentence for sentence in said] == [True] * (period - 2)


def test_a_little_more_than_half_dropped_is_a_fault():
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 6.0, 0.01)
    stamps = BEGIN + np.round(t * 1e9).astype(np.int64)
    stamps[np.arange(len(t)) % 11 < 6] -= SECOND // 2
    (sentence,) = faults(robot, stream(robot, t, *swinging(robot, t), stamps))
    assert 'dropped: ' in sentence
    assert 'not newer' in sentence


# Stamps


def wrong_stamps(kind, t):
    """Return sec and nanosec as a driver fills them that mistakes their meaning."""
    ns = BEGIN + np.round(t * 1e9).astype(np.int64)
    sec, nanosec = ns // SECOND, ns % SECOND
    return {
        'milliseconds': (sec, nanosec // 1_000_000),
        'microseconds': (sec, nanosec // 1000),
        'whole seconds': (sec, 0 * nanosec),
        'all nanoseconds': (sec, ns % 2**32),
        'sec holds milliseconds': (((ns // 1_000_000) + 2**31) % 2**32 - 2**31, ns % 2**32),
        'frozen': (0 * sec + 1_133_099_831, 0 * sec + 1_126_656_057),
        '10 times faster': divmod(10 * (ns - BEGIN) + BEGIN, SECOND),
        '4 times slower': divmod((ns - BEGIN) // 4 + BEGIN, SECOND),
    }[kind]


SAID = {
    'milliseconds': 'nanosec most likely holds milliseconds',
    'microseconds': 'nanosec most likely holds microseconds',
    'whole seconds': 'their stamps are whole seconds',
    'all nanoseconds': 'a second or more',
    'sec holds milliseconds': 'sec most likely holds milliseconds',
    'frozen': 'all with the stamp 1133099831.1126656057',
    '10 times faster': 'it passes 10.0 times faster',
    '4 times slower': 'it passes 4.0 times slower',
}


@pytest.mark.parametrize('kind', SAID)
@pytest.mark.parametrize('rate', [10.0, 50.0, 1000.0])
def test_wrong_stamps_are_named_with_their_cause(kind, rate):
    robot, t = ks.load_robot('ur5e'), 0.4 + np.arange(0.0, 6.0, 1.0 / rate)
    q, _ = swinging(robot, t)
    sec, nanosec = wrong_stamps(kind, t)
    group = stream(robot, t, q)._replace(seconds=sec, nanoseconds=nanosec)
    (sentence,) = faults(robot, group)
    assert SAID[kind] in sentence
    if kind == 'whole seconds' and rate == 50.0:
        assert sentence.startswith('245 of 251 messages')
    if kind == 'frozen' and rate == 50.0:
        assert sentence.startswith('251 messages in 5 s')


@pytest.mark.parametrize('kind', ['milliseconds', 'microseconds'])
def test_the_unit_is_named_before_a_second_is_over(kind):
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 0.98, 0.02)
    q, _ = swinging(robot, t)
    sec, nanosec = wrong_stamps(kind, t)
    (sentence,) = faults(robot, stream(robot, t, q)._replace(seconds=sec, nanoseconds=nanosec))
    assert SAID[kind] in sentence


def test_simulated_time_may_pass_at_any_rate():
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 6.0, 0.02)
    q, _ = swinging(robot, t)
    sec, nanosec = wrong_stamps('10 times faster', t)
    group = stream(robot, t, q)._replace(seconds=sec, nanoseconds=nanosec)
    assert faults(robot, group, simulated=True) == []


def test_a_wrong_pace_is_named_where_messages_come_twice():
    robot, t = ks.load_robot('ur5e'), np.repeat(np.arange(0.0, 6.0, 0.02), 2)
    seconds, nanoseconds = wrong_stamps('10 times faster', t)
    group = stream(robot, t, swinging(robot, t)[0], late=0.001 + 1e-5 * (np.arange(len(t)) % 2))
    (sentence,) = faults(robot, group._replace(seconds=seconds, nanoseconds=nanoseconds))
    assert SAID['10 times faster'] in sentence


def test_the_noise_of_speeds_by_arrival_is_that_of_the_intervals():
    robot, rng = ks.load_robot('ur5e'), np.random.default_rng(3)
    t = np.cumsum(0.02 + 0.0008 * rng.normal(size=250))
    q, _ = swinging(robot, t)
    group = stream(robot, t, q, stamps=np.zeros(len(t), dtype=np.int64))
    assert faults(robot, group) == []
    text = arrival_jitter([group], robot.joint_names)
    jitter, share = (float(text.split(word)[1].split()[0]) for word in ('jitter of ', 'about '))
    assert jitter == pytest.approx(0.8, rel=0.15)
    assert share == pytest.approx(4.0, rel=0.15)


# Jumps and speeds


@pytest.mark.parametrize('told', [False, True])
@pytest.mark.parametrize('rate', [10.0, 50.0, 500.0])
def test_one_message_of_zeros_in_25_is_counted_and_named(told, rate):
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 4.99, 1.0 / rate)
    q, qdot = swinging(robot, t)
    q += 1.0
    for values in (q, qdot):
        values[12::25] = 0.0
    (sentence,) = faults(robot, stream(robot, t, q, qdot if told else None))
    assert sentence.startswith('positions jump: ')
    zeros = len(q[-MESSAGE_LIMIT:][::25])
    assert abs(int(sentence.split()[2]) - 12 * zeros) <= 12
    assert ' steps of shoulder_pan_joint, ' in sentence


def test_a_joint_without_a_speed_limit_jumps_too():
    robot, t = ks.load_robot('craig_3r'), np.arange(0.0, 3.0, 0.02)
    assert not np.isfinite(robot.velocity_limits[2])
    q, _ = swinging(robot, t)
    q[100:, 2] += 0.5
    (sentence,) = faults(robot, stream(robot, t, q))
    assert 'jump: 1 steps of q3' in sentence


@pytest.mark.parametrize('told', [False, True])
def test_a_speed_beyond_its_limit_is_named_with_its_multiple(told):
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 3.0, 0.002)
    q, qdot = swinging(robot, t, 0.1)
    speed = 1.5 * robot.velocity_limits[2]
    q[:, 2], qdot[:, 2] = np.where(t > 1, speed * (t - 1), 0.0), np.where(t > 1, speed, 0.0)
    (sentence,) = faults(robot, stream(robot, t, q, qdot if told else None))
    assert 'velocity limit: elbow_joint at 4.7' in sentence
    assert ' rad/s, 1.5 times' in sentence


# Reported velocities


@pytest.mark.parametrize('factor', [-1.0, DEGREES, 2.0, 0.5, 0.0])
@pytest.mark.parametrize('rate', [10.0, 50.0, 1000.0])
def test_a_factor_is_found_within_a_second_of_the_change(factor, rate):
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 20.0, 1.0 / rate)
    t = t[-2000:]
    q, qdot = swinging(robot, t, rate=0.7)
    for last in (0.4, 1.0):  # s of the change that were received
        told = qdot.copy()
        told[t > t[-1] - last, 1] *= factor
        said = faults(robot, stream(robot, t, q, told))
        if factor in (2.0, 0.5, 0.0) and (last == 0.4 or rate == 10.0):
            continue  # hidden by what a filter and rare messages may do
        assert len(said) == 1
        assert said[0].startswith('reported velocities contradict')
        assert 'that of shoulder_lift' in said[0]
    if not said:
        return
    assert f' {factor:.2g}' in said[0] or f' {factor:.3g} times' in said[0]
    assert (': wrong sign' in said[0]) == (factor == -1.0)
    assert (': degrees?' in said[0]) == (factor == DEGREES)


@pytest.mark.parametrize('speed', [1.0, -1e6, 1e300])
def test_a_velocity_of_a_joint_at_rest_is_named(speed):
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 2.0, 0.02)
    q, qdot = np.full((len(t), 6), 0.3), np.zeros((len(t), 6))
    qdot[:, 4] = speed
    said = faults(robot, stream(robot, t, q, qdot))
    if speed == 1e300:  # refused by the estimator: the velocities of the message are not used
        assert said == []
        return
    assert f'wrist_2_joint is up to {abs(speed):.3g} rad/s' in said[0]
    assert 'moves by 0' in said[0]


def test_a_joint_at_rest_that_reports_nearly_zero_is_never_named():
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 2.0, 0.002)
    rng = np.random.default_rng(8)
    q = 0.3 + 1e-4 * rng.normal(size=(len(t), 6))
    for bias in (0.0, 0.01, -0.015):
        qdot = bias + 0.02 * rng.normal(size=q.shape)
        assert faults(robot, stream(robot, t, q, qdot)) == []


def test_velocities_that_are_not_used_are_not_compared():
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 2.0, 0.02)
    q, qdot = swinging(robot, t)
    assert faults(robot, stream(robot, t, q, -qdot), reported=False) == []


# MimicFormula joints


def with_mimic(value, q2=-0.5, slides=False):
    robot = ks.load_robot('craig_3r')
    mimic = MimicFormula('q3_mimic', 'q2', -1.0, 0.1, slides)
    robot = replace(robot, description=replace(robot.description, mimics=(mimic,)))
    names = {name: f'left_{name}' for name in (*robot.joint_names, mimic.name)}
    t = np.zeros(1)
    q = np.array([[0.3, q2, 0.2, value]])
    return faults(robot, stream(robot, t, q, names=tuple(names.values())), names=names)


def test_a_mimic_joint_that_differs_from_its_formula_is_named_with_both_numbers():
    (sentence,) = with_mimic(0.7)
    assert 'left_q3_mimic' in sentence
    assert '0.7 rad in the messages' in sentence
    assert '-left_q2 + 0.1 = 0.6' in sentence
    assert with_mimic(0.61) == []
    assert with_mimic(math.nan) == []
    assert '0.61 m in the messages' in with_mimic(0.61, slides=True)[0]
    assert with_mimic(0.604, slides=True) == []


def test_a_mimic_joint_that_is_off_by_a_constant_is_named_while_it_moves_and_a_late_one_is_not():
    robot, t = ks.load_robot('craig_3r'), np.arange(0.0, 4.0, 0.02)
    mimic = MimicFormula('q3_mimic', 'q2', -1.0, 0.1, True)
    robot = replace(robot, description=replace(robot.description, mimics=(mimic,)))
    names = {name: name for name in (*robot.joint_names, mimic.name)}
    for late, off, said in ((0.0, 0.0, 0), (0.25, 0.0, 0), (0.0, 0.1, 1), (0.25, 0.05, 1)):
        q = np.column_stack([swinging(robot, t)[0], np.zeros(len(t))])
        q[:, 3] = 0.1 + off - swinging(robot, t - late)[0][:, 1]
        for count in range(60, len(t), 45):
            found = faults(
                robot, stream(robot, t[:count], q[:count], names=tuple(names)), names=names
            )
            assert len(found) == said


@pytest.mark.parametrize(('apart', 'said'), [(0.4, 0), (3600.0, 1), (-7.0, 1)])
def test_clocks_of_two_drivers_that_differ_are_named(apart, said):
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 2.0, 0.01)
    q, qdot = swinging(robot, t)
    late = stream(robot, t, q, qdot).stamps + round(apart * 1e9)
    first = stream(robot, t, q[:, :3], qdot[:, :3], names=robot.joint_names[:3])
    other = stream(robot, t, q[:, 3:], qdot[:, 3:], late, names=robot.joint_names[3:])
    found = faults(robot, first, other)
    assert len(found) == said
    assert all('with shoulder_pan_joint and wrist_1_joint are' in one for one in found)
    assert faults(robot, first, other, simulated=True) == []


def test_a_driver_that_freezes_is_named_within_a_second():
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 4.0, 0.01)
    q, qdot = swinging(robot, t)
    stamps = BEGIN + np.round(np.minimum(t, 2.5) * 1e9).astype(np.int64)
    (sentence,) = faults(robot, stream(robot, t, q, qdot, stamps))
    assert sentence.startswith('150 messages in 1.5 s')
    assert 'all with the stamp' in sentence


@pytest.mark.parametrize('step', [10, 100])
def test_nanosec_in_coarser_steps_is_named_as_long_as_it_lasts(step):
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 9.0, 0.01)
    q, qdot = swinging(robot, t)
    seconds, rest = np.divmod(np.round((t + 0.3) * 1e9).astype(np.int64), SECOND)
    stamps = BEGIN + seconds * SECOND + rest // step
    for count in range(200, len(t), 170):
        early = slice(0, count)
        group = stream(robot, t[early], q[early], qdot[early], stamps[early])
        (sentence,) = faults(robot, group)
        assert f'steps of {step} ns' in sentence


# Hostile numbers


@pytest.mark.parametrize(
    ('stamp', 'q', 'qdot'),
    [*itertools.product([-(2**31), 0, 2**31 - 1], [0.0, 1e15, 1e300, math.nan], [1e15, math.inf])],
)
def test_no_number_stops_the_checks(stamp, q, qdot):
    robot, t = ks.load_robot('ur5e'), np.arange(0.0, 2.0, 0.1)
    ones = np.ones((len(t), 6))
    group = stream(robot, t, q * ones * t[:, None], qdot * ones)
    group = group._replace(seconds=np.full(len(t), stamp), nanoseconds=np.arange(len(t)))
    assert all(isinstance(sentence, str) for sentence in faults(robot, group))


def test_what_is_kept_is_bounded():
    assert MESSAGE_LIMIT * SIZE_LIMIT <= 1 << 24
    assert FORM_LIMIT < 10
