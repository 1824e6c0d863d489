# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Messages that are lost are told by the numbers of those that are heard."""

import random

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from kinematics_service.node.losses import Losses


def losses(publishers=1):
    return Losses(lambda: publishers)


MS = 1_000_000  # ns


def heard(one, numbers, since=0):
    for k, number in enumerate(numbers):
        one.take(number, (since + k) * MS)
    return one.count


def test_gaps_are_counted():
    assert heard(losses(), [7, 8, 9]) == 0
    assert heard(losses(), [7, 9, 10, 15]) == 5


def test_what_came_before_the_first_message_is_not_lost():
    assert heard(losses(), [60_000, 60_001]) == 0


@pytest.mark.parametrize('publishers', [1, 2])
def test_a_publisher_that_begins_anew_is_no_loss(publishers):
    assert heard(losses(publishers), [500, 501, 1, 2, 3]) == 0


def test_one_that_has_begun_anew_loses_from_there():
    # Not from the number it had before.
    assert heard(losses(), [500, 1, 2, 900]) == 897


def test_a_publisher_that_joins_with_higher_numbers_is_no_loss():
    there = [1]
    one = Losses(lambda: there[0])
    heard(one, [3, 4])
    there[0] = 2
    assert heard(one, [5, 90_000, 6, 90_001, 7, 90_002]) == 0
    assert heard(one, [90_005, 8]) == 2


def test_a_publisher_in_the_place_of_another_is_no_loss():
    one = losses(2)
    heard(one, [3, 500, 4, 501])
    one.publishers_changed()
    assert heard(one, [60_000, 5, 60_001, 6]) == 0
    assert heard(one, [60_004, 7]) == 2


def test_a_silent_publisher_hides_no_more_than_the_first_gap():
    one = losses(2)
    assert heard(one, [1, 2, 5, 6]) == 0  # 5 may be the other's first
    assert heard(one, [9, 10, 21]) == 2 + 10


def test_where_nothing_is_numbered_nothing_is_known():
    assert heard(losses(), [None, None]) is None


@pytest.mark.parametrize(('count', 'seed'), [(1, 0), (2, 1), (3, 2), (5, 3), (8, 0), (8, 1)])
def test_gaps_of_several_publishers_add_up_however_their_numbers_mix(seed, count):
    draw = random.Random(seed)
    last = draw.sample(range(1, draw.choice([2 * count + 2, 40, 4_000]), 2), count)
    one, lost = losses(count), 0
    for number in draw.sample(last, count) if seed % 2 else last:
        one.take(number, number * MS)
    for _ in range(3_000):
        k = draw.randrange(count)
        gap = draw.choice([0] * 30 + [1, 2, 30])
        last[k] += 1 + gap
        lost += gap
        one.take(last[k], last[k] * MS)  # each at 1 kHz, by its own clock
    # Each is heard once more, the highest number first: no gap is left open.
    for k in sorted(range(count), key=last.__getitem__, reverse=True):
        last[k] += 1
        one.take(last[k], last[k] * MS)
    assert one.count == lost


def publisher(draw, joins, rate, share, first):
    """Return (stamp ns, number) of what is heard of a publisher, and how many are lost between."""
    times = np.arange(joins, 5.0, 1.0 / rate) + draw.uniform(0.0, 1.0 / rate)
    kept = np.flatnonzero(draw.random(len(times)) >= share)
    sent = [(int(1e9 * times[k]), int(first + k)) for k in kept]
    return sent, int(kept[-1] - kept[0] + 1 - len(kept)) if len(kept) else 0


@pytest.mark.parametrize(
    ('apart', 'share', 'seed'),
    [(0, 0.2, 1), (50, 0.02, 0), (3_000, 0.5, 0), (100_000, 0.2, 1), (0, 0.5, 0)],
)
def test_publishers_of_other_rates_that_join_later_are_counted_within_two_percent(
    seed, share, apart
):
    draw = np.random.default_rng(seed)
    count = int(draw.integers(2, 9))
    joins = draw.uniform(0.0, 2.0, count)
    every = [
        publisher(draw, t, draw.choice([50, 100, 250, 500, 1000]), share, draw.integers(apart + 1))
        for t in joins
    ]
    there = 0
    one = Losses(lambda: there)
    for stamp, number in sorted(message for sent, _ in every for message in sent):
        before, there = there, sum(1e9 * joins <= stamp)
        if there != before:
            one.publishers_changed()
        one.take(number, stamp)
    lost = sum(missing for _, missing in every)
    # Where publishers join, a gap of each may be taken for the first message of the one that does.
    hidden = count * 2 / (1 - share)
    assert one.count == pytest.approx(lost, rel=0.02, abs=hidden)


@pytest.mark.parametrize(
    ('apart', 'period', 'seed'),
    [(0, 0.2, 0), (3_000, 1.0, 0), (3_000, 0.2, 1), (100_000, 1.0, 1)],
)
def test_nine_tenths_of_eight_publishers_are_counted_within_five_percent_or_as_a_lower_bound(
    seed, period, apart
):
    # The node hears a tenth of each period, as one that is busy; publishers stall and hurry.
    draw = np.random.default_rng(seed)
    sent, lost = [], 0
    for rate in 2_000 * draw.uniform(0.5, 1.5, 8):
        times = np.cumsum(draw.exponential(1 / rate, int(20.0 * rate)))
        kept = np.flatnonzero(times % period < 0.1 * period)
        first = draw.integers(apart + 1)
        sent += [(int(1e9 * times[k]), int(first + k)) for k in kept]
        lost += int(kept[-1] - kept[0] + 1 - len(kept))
    one = losses(8)
    for stamp, number in sorted(sent):
        one.take(number, stamp)
    assert one.count <= 1.05 * lost
    assert one.count >= 0.95 * lost or one.is_lower_bound


def test_a_gap_that_no_publisher_explains_makes_a_lower_bound():
    one = losses(2)
    heard(one, [k for number in range(100) for k in (number, 5_000 + number)])
    assert not one.is_lower_bound
    one.take(3_000, 201 * MS)  # 2,900 messages in 3 ms
    assert one.is_lower_bound


@pytest.mark.parametrize('count', [1, 2, 8])
def test_publishers_that_lose_nothing_make_no_lower_bound(count):
    one = losses(count)
    for number in range(500):
        for k in range(count):
            one.take(1_000_000 * k + number, (10 * number + k) * MS)
    assert (one.count, one.is_lower_bound) == (0, False)
