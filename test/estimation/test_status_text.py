"""Directions in words: what hardly takes part is left out."""

import numpy as np
import pytest

from kinematics_service.estimation.status_text import direction_in_words, joints_in_words

NAMES = ('q1', 'q2', 'q3')


@pytest.mark.parametrize(
    ('motion', 'words'),
    [
        ([1.0, 0.09, -0.11], 'q1 - q3'),
        ([0.0, -2.0, 1.0], 'q2 - q3'),
        ([0.3, 0.0, -0.4], '- q1 + q3'),
        ([0.0, 0.0, 0.0], 'no joint'),
    ],
)
def test_joints_that_take_part_are_named_with_signs(motion, words):
    assert joints_in_words(NAMES, np.array(motion)) == words


@pytest.mark.parametrize(
    ('direction', 'words'),
    [
        ([0.0, -1.0, 0.0, 0.0, 0.0, 0.0], 'motion along y'),
        ([0.0, 0.0, 0.09, 1.0, 0.0, 0.0], 'rotation about x'),
        ([0.0, 0.0, 0.5, 1.0, 0.0, 0.0], 'motion along z with rotation about x'),
        ([-3.0, 0.0, -4.0, 0.0, 0.0, 0.0], 'motion along (0.60, 0.00, 0.80)'),
    ],
)
def test_a_lost_direction_is_motion_along_and_rotation_about_an_axis(direction, words):
    assert direction_in_words(np.array(direction)) == words
