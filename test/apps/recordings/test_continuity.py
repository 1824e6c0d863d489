# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Frames that are missing, repeated or far off in a motion; none where a person moves jerkily."""

import numpy as np
import pytest

from kinematics_service.apps.recordings.audit.dataset.continuity import breaks_of

TICK = 2 * np.pi / 4096


def smooth(count=300, rate=30.0, noise=1e-4):
    random = np.random.default_rng(3)
    angle = np.arange(count)[:, None] / rate * random.uniform(0.4, 1.0, 6) + random.uniform(
        0, 6, 6
    )
    return np.sin(angle) + noise * random.normal(size=(count, 6))


def reaching(count, rate, seed):
    """Return a motion from rest to rest, some of them in a few frames, read in ticks."""
    random = np.random.default_rng(seed)
    rows = [np.zeros(6)]
    while len(rows) < count:
        way = 0.4 * random.normal(size=6) * (random.random(6) < 0.6)
        s = np.linspace(0.0, 1.0, max(2, int(rate * random.uniform(0.2, 2.0))) + 1)[1:]
        begin = rows[-1]
        rows += [begin + x * way for x in 10 * s**3 - 15 * s**4 + 6 * s**5]
        rows += [rows[-1]] * int(rate * random.exponential(0.2))
    return TICK * np.round(np.array(rows[:count]) / TICK)


def test_a_smooth_motion_has_no_breaks():
    assert breaks_of(smooth()) == ([], [], [])


@pytest.mark.parametrize('rate', [5, 10, 15, 30])
def test_a_jerky_motion_has_none_either(rate):
    assert not [seed for seed in range(12) if breaks_of(reaching(400, rate, seed)) != ([], [], [])]


@pytest.mark.parametrize('count', [1, 2, 3])
def test_missing_frames_are_found(count):
    q = smooth()
    missing, repeated, off = breaks_of(np.delete(q, range(120, 120 + count), axis=0))
    assert missing == [119]
    assert not repeated
    assert not off


def test_a_repeated_frame_and_one_far_off_are_found():
    q = smooth()
    q[80] = q[79]
    q[200, 2] += 0.3
    assert breaks_of(q) == ([], [80], [200])


@pytest.mark.parametrize('q', [np.zeros((0, 6)), np.zeros((5, 6)), np.zeros((50, 1))])
def test_an_arm_at_rest_has_no_breaks(q):
    assert breaks_of(q) == ([], [], [])
