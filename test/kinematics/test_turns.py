# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Runs of pieces of a curve inside the limits, beside a list of all full turns."""

import itertools

import numpy as np
import pytest

from kinematics_service.kinematics.inverse.self_motion.turns import runs_of


def all_runs(boxes, closed, lap):
    """Return {(first, count, closed): set of turns} by listing every vector of turns."""
    inside = [
        set(itertools.product(*(range(low, high + 1) for low, high in box))) for box in boxes
    ]

    def moved(k, turns):
        laps, i = divmod(k, len(boxes))
        there = tuple(t + laps * way for t, way in zip(turns, lap))
        return (closed or laps == 0) and there in inside[i]

    found = {}
    for i, lifts in enumerate(inside):
        for turns in lifts:
            ends = closed and not any(lap)
            if ends and all(moved(k, turns) for k in range(len(boxes))):
                if i == 0:
                    found.setdefault((0, len(boxes), True), set()).add(turns)
                continue
            if not moved(i - 1, turns):
                count = next(n for n in itertools.count(1) if not moved(i + n, turns))
                found.setdefault((i, count, False), set()).add(turns)
    return found


@pytest.mark.parametrize('closed', [False, True])
@pytest.mark.parametrize('lap', [(0, 0, 0), (0, 1, 0), (1, 0, -2)])
def test_runs_are_those_of_a_list_of_all_turns(closed, lap):
    random = np.random.default_rng(5)
    for pieces in (1, 2, 3, 7) * 12:
        low = random.integers(-2, 2, (pieces, 3))
        high = low + random.integers(-1, 4, (pieces, 3))
        boxes = np.stack([low, high], axis=2)
        # Successive pieces differ in one joint, as at a limit, or in all.
        for k in range(1, pieces) if random.random() < 0.5 else ():
            same = np.arange(3) != random.integers(3)
            boxes[k, same] = boxes[k - 1, same]
        expected = all_runs(boxes.tolist(), closed, lap)
        runs = list(runs_of(boxes.tolist(), closed, lap))
        assert {(run.first, run.pieces, run.closed): run.windings for run in runs} == {
            key: len(turns) for key, turns in expected.items()
        }
        assert all(run.turns in expected[run[:2] + (run.closed,)] for run in runs)
