# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""How much of a motion may be kept: the causes one by one, and arms that are slowed by it."""

import dataclasses
import math

import numpy as np
import pytest
from arms import LOOPED, calm_poses, robot_of, seeded
from linkages import SHORT_FIVE_BAR
from refusal import refused

import kinematics_service as ks
from kinematics_service.kinematics import scale as scaling
from kinematics_service.robot.robot import build_robot

# Sliding, coupled, singular everywhere, redundant; a closed loop, and loops closed together.
ARMS = (
    *('planar_2r', 'rrp_elementary', 'parallelogram_left', 'six_joint_dh', 'puma560', 'panda'),
    *('standard-9-0', 'five_bar', 'flexpicker'),
)
# Steps of a controller at 500 Hz, s.
STEP = 0.002
# Of a distance that a search found, rad.
FOUND = 1e-3
# An arm that is slowed by its way may brake this much harder than it was asked: the way to the
# nearest singular pose curves.
CURVED = 1.1
# Steps over which that is the mean: singular poses are found to some 1e-3 rad, one by one.
AVERAGED = 10


def limited(robot, acceleration=6.0, velocity=2.0, bound=2.0):
    """Return an arm whose joints all have limits of position, velocity and acceleration."""
    joints = tuple(
        dataclasses.replace(
            joint, lower=-bound, upper=bound, velocity=velocity, acceleration=acceleration
        )
        for joint in robot.description.joints
    )
    return build_robot(dataclasses.replace(robot.description, joints=joints))


def value_of(found, cause, of):
    (k,) = (k for k, one in enumerate(found.constraints) if (one.cause, one.of) == (cause, of))
    return found.values[..., k], found.margins[..., k], found.times[..., k]


# The causes


def test_far_from_everything_all_is_kept():
    found = ks.scale(limited(robot_of('planar_2r')), [0.1, 1.2], [0.3, 0.2])
    assert (found.value, found.cause, found.of) == (1.0, '', '')
    # The limit of the second joint comes first: 0.8 rad at 0.2 rad/s.
    assert found.time_left == pytest.approx(4.0)
    assert found.margin == pytest.approx(0.8)


@pytest.mark.parametrize('bend', [0.031, 0.05, 0.09, 0.2, -0.05])
@pytest.mark.parametrize('speed', [0.1, 1.0, 5.0])
def test_the_stretched_elbow_is_approached_by_the_formula(bend, speed):
    robot = limited(robot_of('planar_2r'), acceleration=4.0, velocity=math.inf)
    towards = -math.copysign(speed, bend)
    found = ks.scale(robot, [0.3, bend], [0.0, towards], horizon=0.05)
    margin = abs(bend) - 0.03

    def speed_before(margin):
        # v T + v^2 / (2 a) = m
        return -4.0 * 0.05 + math.sqrt((4.0 * 0.05) ** 2 + 2.0 * 4.0 * margin)

    v = speed_before(margin)
    value, left, time = value_of(found, 'singularity', '')
    assert value == pytest.approx(min(v / speed, 1.0), rel=1e-4)
    assert left == pytest.approx(margin, rel=1e-4)
    assert time == pytest.approx(margin / speed, rel=1e-4)
    away = ks.scale(robot, [0.3, bend], [0.0, -towards], horizon=0.05)
    # On the way out the folded elbow is ahead, which a stop from 5 rad/s would not be before.
    v = speed_before(math.pi - 0.03 - abs(bend))
    assert value_of(away, 'singularity', '')[0] == pytest.approx(min(v / speed, 1.0), rel=1e-4)
    aside = ks.scale(robot, [0.3, bend], [speed, 0.0], horizon=0.05)
    assert value_of(aside, 'singularity', '')[0] == 1.0


@pytest.mark.parametrize('acceleration', [math.inf, 50.0, 2.0])
def test_a_limit_of_position_is_approached_by_its_stopping_distance(acceleration):
    robot = limited(robot_of('scara_hsr065'), acceleration, math.inf)
    T, margin, speed = 0.02, 0.1, 1.7
    q, qdot = np.array([0.2, 0.9, 2.0 - margin, 0.0]), np.array([0.0, 0.0, speed, 0.0])
    found = ks.scale(robot, q, qdot, horizon=T)
    v = margin / T
    if math.isfinite(acceleration):
        a = acceleration
        v = -a * T + math.sqrt((a * T) ** 2 + 2.0 * a * margin)
    name = robot.joint_names[2]
    value, left, time = value_of(found, 'position limit', name)
    assert value == pytest.approx(min(v / speed, 1.0))
    assert (left, time) == (pytest.approx(margin), pytest.approx(margin / speed))
    assert value_of(ks.scale(robot, q, -qdot, horizon=T), 'position limit', name)[0] == 1.0
    q[2] = 2.1  # beyond it nothing goes on, and everything back
    assert ks.scale(robot, q, qdot, horizon=T).value == 0.0
    assert ks.scale(robot, q, qdot, horizon=T).of == name
    assert ks.scale(robot, q, -qdot, horizon=T).value == 1.0


def test_the_joint_that_brakes_slowest_says_how_long_a_stop_takes():
    robot = robot_of('planar_2r')
    first, second = robot.description.joints
    joints = (
        dataclasses.replace(first, upper=1.0, acceleration=100.0),
        dataclasses.replace(second, acceleration=2.0),
    )
    robot = build_robot(dataclasses.replace(robot.description, joints=joints))
    # Both stop together: the second in 0.5 s, so that the first needs 0.25 m of its way, too.
    found = ks.scale(robot, [0.9, 1.2], [1.0, 1.0], horizon=1e-9)
    value, _, _ = value_of(found, 'position limit', 'q1')
    assert value == pytest.approx(math.sqrt(2.0 * 2.0 * 0.1), rel=1e-6)


def test_the_fastest_joint_shortens_all():
    robot = limited(robot_of('puma560'), velocity=2.0)
    found = ks.scale(robot, calm_poses(robot, 1)[0] * 0.1 + 0.3, [0.1, -5.0, 4.0, 0, 0, 0])
    value, margin, time = value_of(found, 'velocity limit', robot.joint_names[1])
    assert (value, margin, time) == (pytest.approx(0.4), pytest.approx(-3.0), 0.0)


SPEEDS = """\
robot: fast
convention: standard
joints: [{name: q1, type: revolute, acceleration: 8}, {name: q2, type: revolute}]
links: [{a: 1, alpha: 0, d: 0, theta: q1}, {a: 1, alpha: 0, d: 0, theta: q2}]
points: {elbow: {row: 1}}
speed_limits:
  tool: {linear: 2.5, angular: 2.0, reduced: 0.25}
  elbow: {linear: 0.5}
"""


def test_speeds_of_the_tool_and_of_points_have_limits():
    robot = ks.robot_from_text(SPEEDS)
    np.testing.assert_array_equal(robot.acceleration_limits, [8.0, math.inf])
    q, qdot = [0.2, 1.5], np.array([1.0, 2.0])
    V = ks.twist(robot, q, qdot)
    found = ks.scale(robot, q, qdot)
    speed = np.linalg.norm(V[:3])
    assert value_of(found, 'speed limit', 'tool')[0] == pytest.approx(2.5 / speed)
    assert value_of(found, 'turning limit', 'tool')[0] == pytest.approx(2.0 / 3.0)
    assert value_of(found, 'speed limit', 'elbow')[0] == pytest.approx(0.5)
    assert (found.cause, found.of) == ('speed limit', 'elbow')
    assert found.value == pytest.approx(0.5)
    slow = ks.scale(robot, q, qdot, reduced=True)
    assert slow.value == pytest.approx(0.25 / speed)
    assert (slow.cause, slow.of) == ('speed limit', 'tool')


# The key of the fault, and what its sentence names.
BAD = {
    'elbo: {linear: 1}': ('.elbo', ["'elbo'", 'tool, elbow']),
    'tool: {}': ('.tool', ['linear', 'angular', 'reduced']),
    'tool: {linear: 0}': ('.tool.linear', ['above 0', '0']),
    'tool: {linear: -1}': ('.tool.linear', ['above 0', '-1']),
    'tool: {linear: 0.25, reduced: 1.5}': ('.tool.reduced', ['0.25', '1.5']),
    'tool: {linear: 250 mm/s}': ('.tool.linear', ["'250 mm", 'units']),
    'tool: {linear: 1e400}': ('.tool.linear', ['1e400', 'finite']),
    'tool: {linear: .nan}': ('.tool.linear', ["'.nan'", 'finite']),
    'tool: 0.25': ('.tool', ['{linear, angular, reduced}', "'0.25'"]),
    'tool: {linear: }': ('.tool.linear', ['value']),
    'tool: {linear: 1}\n  elbow: {linear: 1}\n  tool: {linear: 2}': ('.tool', ['7', '9']),
    'tool: {speed: 1}': ('.tool.speed', ["'linear'"]),
}


@pytest.mark.parametrize('line', BAD)
def test_speed_limits_that_are_none_are_refused_with_their_line(line):
    text = SPEEDS.split('  tool:')[0] + f'  {line}\n'
    with pytest.raises(ks.RobotFileError) as refusal:
        ks.robot_from_text(text)
    key, words = BAD[line]
    fault = refusal.value.faults[0]
    assert (fault.line, fault.where) == (7 + line.count('\n'), f'speed_limits{key}')
    for word in words:
        assert word in fault.message


@pytest.mark.parametrize(
    ('units', 'line', 'words'),
    [
        ('', 'linear: 250', ['linear', '250 m/s', 'millimetres']),
        ('', 'reduced: 250', ['reduced', '250 m/s', 'millimetres']),
        ('', 'angular: 90', ['angular', '90 rad/s', 'degrees']),
        ('{length: mm}', 'linear: 0.25', ['linear', '0.25 mm/s', 'metres']),
        ('{length: mm, angle: deg}', 'linear: 250, angular: 90, reduced: 25', []),
        ('', 'linear: 2.5, angular: 9, reduced: 0.25', []),
    ],
)
def test_speed_limits_that_are_hardly_meant_in_the_unit_of_the_file_are_warned_of(
    units, line, words
):
    text = SPEEDS.split('  tool:')[0] + f'  tool: {{{line}}}\n'
    if units:
        text = text.replace('convention', f'units: {units}\nconvention')
    warnings = [str(one) for one in ks.robot_from_text(text).description.warnings]
    said = [one for one in warnings if 'speed_limits' in one]
    assert [all(word in one for word in words) for one in said] == [True] * bool(words)


def test_units_of_a_file_are_those_of_its_speeds():
    text = SPEEDS.replace('convention', 'units: {angle: deg, length: mm}\nconvention')
    text = text.replace('linear: 2.5, angular: 2.0', 'linear: 2500, angular: 90')
    robot = ks.robot_from_text(text)
    assert robot.description.speed_limits[0].linear == pytest.approx(2.5)
    assert robot.description.speed_limits[0].angular == pytest.approx(math.pi / 2)
    assert robot.acceleration_limits[0] == pytest.approx(math.radians(8))


@pytest.mark.parametrize(
    ('choice', 'code', 'words'),
    [
        ({'horizon': 0.0}, 'out-of-range', ['horizon', '0.0']),
        ({'horizon': math.nan}, 'out-of-range', ['horizon', 'nan']),
        ({'reduced': True}, 'missing-key', ['puma560', 'reduced', 'speed_limits']),
        ({'rule': 'servo'}, 'wrong-type', ['rule', 'ServoRule', "'servo'"]),
    ],
)
def test_what_is_no_choice_is_refused(choice, code, words):
    with refused(ks.ServoSettingsError, code, *words):
        ks.scale('puma560', np.zeros(6), np.zeros(6), **choice)


@pytest.mark.parametrize('name', ARMS)
def test_a_batch_is_its_motions_and_all_are_between_0_and_1(name):
    robot = limited(robot_of(name)) if name not in LOOPED else robot_of(name)
    q = calm_poses(robot, 6)[:6]
    qdot = np.random.default_rng(2).normal(size=q.shape)
    whole = ks.scale(robot, q, qdot)
    assert np.all((whole.values >= 0.0) & (whole.values <= 1.0))
    for k, (at, rates) in enumerate(zip(q, qdot)):
        alone = ks.scale(robot, at, rates)
        assert alone.value == pytest.approx(whole.value[k], abs=1e-6)
        if alone.value < 1.0 - 1e-9:
            assert (alone.cause, alone.of) == (whole.cause[k], whole.of[k])
        assert ks.scale(robot, at, 0.0 * rates).value == 1.0


@pytest.mark.parametrize('size', [1e-300, 1e-12, 1e12, 1e200])
def test_any_speed_has_a_scale(size):
    robot = limited(robot_of('puma560'))
    found = ks.scale(robot, np.full(6, 0.3), np.full(6, size))
    assert 0.0 <= found.value <= 1.0
    assert found.value * size <= 2.0 * (1.0 + 1e-12)


# In a closed loop


def driven(robot, q, command, seconds):
    """
    Integrate the scaled command at 500 Hz; return the ways (N, n) and the shares (N,).
    """
    ways, shares = [q], []
    for _ in range(round(seconds / STEP)):
        shares.append(ks.scale(robot, ways[-1], command, horizon=0.05).value)
        ways.append(ways[-1] + STEP * shares[-1] * command)
    return np.array(ways), np.array(shares)


def kept(robot, ways, shares, command):
    """Check that limits of position, acceleration and distance are kept on the way."""
    assert np.all(np.abs(ways) <= 2.0 + 1e-9)
    # The first step begins at the command: what an arm does before is not known.
    slowed = (shares[:-AVERAGED] - shares[AVERAGED:]) / (AVERAGED * STEP)
    assert np.max(slowed) * np.max(np.abs(command)) <= CURVED * 6.0
    distances = ks.singularity(robot, ways).distance
    least = min(float(distances[0]), robot.singularity.thresholds.stop)
    assert np.min(distances) >= least - FOUND


# Six and seven joints are driven below.
LOOPED_COMMANDS = ('planar_2r', 'craig_3r', 'scara_hsr065')


@pytest.mark.parametrize('name', LOOPED_COMMANDS)
def test_an_arm_in_a_closed_loop_stops_at_limits_and_before_singular_poses(name):
    robot, random = limited(robot_of(name)), np.random.default_rng(12)
    for q in seeded(robot, 200):
        command = random.normal(size=robot.dof)
        found = ks.scale(robot, q, command, horizon=0.05)
        if found.value == 1.0 and ks.singularity(robot, q).distance > 0.25:
            break
    else:
        pytest.fail('no pose to begin at')
    target = ks.singularity(robot, q).nearest_singular
    commands = [command / np.max(np.abs(command)) * 1.9]
    if target is not None:
        towards = target - q
        commands.append(towards / np.max(np.abs(towards)) * 1.9)
    for one in commands:
        ways, shares = driven(robot, q, one, 0.8)
        kept(robot, ways, shares, one)
    if target is not None:
        # It does not stop before it has to: 1.9 rad/s bring it to what it must keep.
        assert ks.singularity(robot, ways[-1]).distance < robot.singularity.thresholds.stop + 0.15


# A singular surface that comes from aside, beyond that which is nearest at first.
FROM_ASIDE = {
    'puma560': (
        [0.612194, 1.815816, 1.007888, 0.148953, -0.832224, 1.087015],
        [-0.156848, -0.262663, 1.320797, -1.646115, 1.9, 0.503067],
    ),
    'panda': (
        [0.224639, -1.039459, 0.965669, 0.697559, 0.736821, -0.144703, -1.112446],
        [-0.579919, 0.208555, 0.167562, -1.9, 1.13211, -0.468974, -1.561022],
    ),
}


@pytest.mark.parametrize('name', FROM_ASIDE)
def test_a_singular_surface_from_aside_is_seen_in_time(name):
    robot, (q, command) = limited(robot_of(name)), np.array(FROM_ASIDE[name])
    ways, shares = driven(robot, q, command, 0.8)
    kept(robot, ways, shares, command)


def test_singular_poses_that_the_motion_passes_by_slow_nothing():
    # Seven joints: singular poses are so few that most motions towards one pass by.
    robot = limited(robot_of('panda'))
    q = np.array([-0.914182, 1.518605, -1.742143, 0.716726, 1.480354, -1.090726, 1.581793])
    command = np.array([-0.239038, 0.037593, 0.092095, 0.116063, 0.040144, 1.9, 0.270426])
    ahead = q + np.linspace(0.0, 0.4, 100)[:, None] * command
    distances = ks.singularity(robot, ahead).distance
    assert 1.2 * robot.singularity.thresholds.stop < np.min(distances) < 0.5 * distances[0]
    found = ks.scale(robot, ahead, command, horizon=0.05)
    slowed = found.value < 1.0
    assert not np.any(slowed & (found.cause == 'singularity'))


def test_it_stops_no_earlier_than_it_must():
    robot = limited(robot_of('planar_2r'))
    ways, shares = driven(robot, np.array([0.0, 1.5]), np.array([0.0, -1.5]), 2.0)
    assert 0.03 - FOUND <= ways[-1, 1] <= 0.03 * 1.1
    # All of the speed is kept until a stop at 6 rad/s^2, and the reaction before it, begin.
    (slowed,) = np.nonzero(shares < 1.0)
    must = 0.03 + 1.5 * 0.05 + 1.5**2 / (2 * 6.0)
    assert ways[slowed[0], 1] == pytest.approx(must, abs=2 * 1.5 * STEP)


def test_flat_positions_that_the_motion_passes_by_slow_nothing():
    robot = robot_of('four_bar_arm')
    joints = [dataclasses.replace(one, acceleration=6.0) for one in robot.description.joints]
    robot = build_robot(dataclasses.replace(robot.description, joints=tuple(joints)))
    q, command = np.array([0.075261, 0.633873, -2.708089]), np.array([0.598606, 0.229506, 1.0])
    # All that a stop takes, and a tenth more.
    ahead = q + np.linspace(0.0, 1.1 * (0.05 + 0.5 / 6.0), 40)[:, None] * command
    assert np.min(ks.singularity(robot, ahead).distance) > 2.0 * robot.singularity.thresholds.stop
    assert ks.scale(robot, q, command, horizon=0.05).value == 1.0


def test_a_motion_is_proved_if_the_clearance_covers_the_way_of_its_stop():
    robot = robot_of('planar_2r')
    # The elbow is straight at 0, and 0.1 s of reaction lead 0.1 rad towards it.
    found = ks.scale(robot, [[0.0, 0.5], [0.0, 0.05]], [[0.0, -1.0]] * 2, horizon=0.1)
    np.testing.assert_array_equal(found.proved, [True, False])
    assert ks.scale('puma560', np.full(6, 0.3), np.full(6, 0.1)).proved
    # Closed loops have no clearance; at rest nothing is passed.
    assert not ks.scale('four_bar_arm', [0.1, 1.2, 0.3], [0.1, 0.0, 0.0]).proved
    assert ks.scale('four_bar_arm', [0.1, 1.2, 0.3], [0.0, 0.0, 0.0]).proved


def test_where_a_search_misses_that_a_loop_closes_no_longer_the_motion_stops_before(monkeypatch):
    # Elbows that part until the rods between them are too short.
    robot = ks.robot_from_text(SHORT_FIVE_BAR)
    joints = [dataclasses.replace(one, acceleration=6.0) for one in robot.description.joints]
    robot = build_robot(dataclasses.replace(robot.description, joints=tuple(joints)))
    q, command = np.full(2, math.pi / 2), np.array([1.0, -1.0])
    # Half the way between the elbows is 0.15 + 0.25 sin x, and a rod 0.3.
    last = math.asin(0.6)
    assert ks.forward_kinematics(robot, q + 0.999 * last * command).shape == (4, 4)
    with pytest.raises(ks.LoopError):
        ks.forward_kinematics(robot, q + 1.001 * last * command)
    real = scaling.singularity

    def missing(robot, q):
        found = real(robot, q)
        return dataclasses.replace(found, distance=np.full_like(found.distance, 0.2))

    monkeypatch.setattr(scaling, 'singularity', missing)
    beside = q + (last - 0.1) * command
    found = ks.scale(robot, [beside, beside], [command * 3.0, command * 0.0], horizon=0.05)
    assert found.values[0, 0] < 1.0
    assert found.values[1, 0] == 1.0


@pytest.mark.parametrize('name', ['four_bar_arm', 'five_bar'])
def test_an_arm_with_closed_loops_stops_where_they_still_close(name):
    description = robot_of(name).description
    joints = tuple(dataclasses.replace(one, acceleration=6.0) for one in description.joints)
    robot = build_robot(dataclasses.replace(description, joints=joints))
    random = np.random.default_rng(3)
    for q in calm_poses(robot, 30)[:30]:
        command = random.normal(size=robot.dof)
        command /= np.max(np.abs(command))
        if ks.scale(robot, q, command, horizon=0.05).value < 1.0:
            continue
        ways, _ = driven(robot, q, command, 0.5)
        assert np.all(ways >= robot.limits[:, 0] - 1e-9)
        assert np.all(ways <= robot.limits[:, 1] + 1e-9)
        distances = ks.singularity(robot, ways).distance
        assert np.min(distances) >= min(distances[0], robot.singularity.thresholds.stop) - FOUND
        return
    pytest.fail('no pose to begin at')
