# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""When a warning is said again."""

import math

import numpy as np
import pytest

from kinematics_service.estimation.alarm import Alarm
from kinematics_service.robot.measures import Level, Thresholds

MILLISECOND = 1_000_000
X = np.array([1.0, 0, 0, 0, 0, 0])


def turned(degrees: float) -> np.ndarray:
    angle = math.radians(degrees)
    return np.array([math.cos(angle), math.sin(angle), 0, 0, 0, 0])


def said(steps):
    """Return which of the steps (level, direction, time in ms) are said."""
    alarm, answers = Alarm(), []
    for level, direction, at in steps:
        alarm, say = alarm.step(level, direction, at * MILLISECOND)
        answers.append(say)
    return answers


@pytest.mark.parametrize('level', list(Level))
def test_the_first_state_is_said_whatever_its_level(level):
    assert said([(level, X, 0)]) == [True]


def test_a_fine_state_is_said_once():
    assert said([(Level.OK, X, at) for at in range(0, 10_000, 500)]) == [True] + 19 * [False]


def test_every_change_of_level_is_said_at_once():
    levels = [Level.OK, Level.WARN, Level.ERROR, Level.WARN, Level.OK, Level.STALE, Level.OK]
    assert all(said([(level, X, at) for at, level in enumerate(levels)]))


@pytest.mark.parametrize('level', [Level.WARN, Level.ERROR])
def test_a_bad_state_is_said_once_a_second(level):
    steps = [(level, X, at) for at in range(0, 5_000, 10)]
    times = [step[2] for step, say in zip(steps, said(steps)) if say]
    assert times == [0, 1000, 2000, 3000, 4000]


def test_silence_is_said_once():
    assert said([(Level.STALE, None, at) for at in range(0, 10_000, 500)]) == [True] + 19 * [False]


@pytest.mark.parametrize(('degrees', 'again'), [(20, False), (29, False), (31, True), (90, True)])
def test_a_lost_direction_is_said_again_when_it_has_turned_by_more_than_30_degrees(degrees, again):
    assert said([(Level.WARN, X, 0), (Level.WARN, turned(degrees), 100)]) == [True, again]


def test_a_slow_turn_is_measured_from_what_was_said_last():
    steps = [(Level.WARN, turned(degrees), 10 * degrees) for degrees in range(90)]
    assert [degrees for degrees, say in enumerate(said(steps)) if say] == [0, 31, 62]


@pytest.mark.parametrize('degrees', [180, 175, -170])
def test_the_sign_of_a_lost_direction_means_nothing(degrees):
    assert said([(Level.WARN, X, 0), (Level.WARN, turned(degrees), 100)]) == [True, False]


def test_a_lost_direction_that_turns_with_every_message_makes_no_storm():
    steps = [(Level.WARN, turned(90 * (at % 2)), at) for at in range(1000)]
    assert sum(said(steps)) <= 21


def with_factors(*steps):
    alarm, answers = Alarm(), []
    for level, factor, at in steps:
        alarm, say = alarm.step(level, X, at * MILLISECOND, factor)
        answers.append(say)
    return answers


def test_another_nearest_factor_is_said():
    assert with_factors((Level.WARN, 0, 0), (Level.WARN, 1, 100), (Level.WARN, 1, 200)) == [
        True,
        True,
        False,
    ]


def test_another_nearest_factor_of_a_fine_state_is_not_said():
    assert with_factors((Level.OK, 0, 0), (Level.OK, 1, 100)) == [True, False]


def test_factors_that_take_turns_with_every_message_make_no_storm():
    assert sum(with_factors(*((Level.WARN, at % 2, at) for at in range(1000)))) <= 21


def test_a_turn_of_a_fine_state_is_not_said():
    assert said([(Level.OK, X, 0), (Level.OK, turned(90), 100)]) == [True, False]


@pytest.mark.parametrize('seed', range(5))
def test_noise_at_the_threshold_gives_one_warning(seed):
    thresholds = Thresholds('distance', 0.1, 0.03)
    values = np.random.default_rng(seed).normal(0.1, 0.005, 1000)
    level, levels = Level.OK, []
    for value in values:
        level = thresholds.level(float(value), level)
        levels.append(level)
    assert sum(after != before for before, after in zip([Level.OK, *levels], levels)) == 1


@pytest.mark.parametrize(
    ('value', 'previous', 'level'),
    [
        (0.11, Level.OK, Level.OK),
        (0.1, Level.OK, Level.WARN),
        (0.149, Level.WARN, Level.WARN),
        (0.151, Level.WARN, Level.OK),
        (0.03, Level.WARN, Level.ERROR),
        (0.044, Level.ERROR, Level.ERROR),
        (0.046, Level.ERROR, Level.WARN),
        (0.11, Level.ERROR, Level.WARN),
        (0.16, Level.ERROR, Level.OK),
        (0.11, Level.STALE, Level.OK),
        (math.nan, Level.OK, Level.ERROR),
    ],
)
def test_a_level_is_left_at_one_and_a_half_times_its_threshold(value, previous, level):
    assert Thresholds('distance', 0.1, 0.03).level(value, previous) == level


@pytest.mark.parametrize(
    ('value', 'previous', 'level'),
    [
        (16.9, Level.OK, Level.OK),
        (17.0, Level.OK, Level.WARN),
        (11.4, Level.WARN, Level.WARN),
        (11.3, Level.WARN, Level.OK),
        (30.0, Level.WARN, Level.ERROR),
        (20.1, Level.ERROR, Level.ERROR),
        (19.9, Level.ERROR, Level.WARN),
        (math.inf, Level.OK, Level.ERROR),
    ],
)
def test_a_condition_number_is_left_at_two_thirds_of_its_threshold(value, previous, level):
    assert Thresholds('condition_number', 17.0, 30.0).level(value, previous) == level
