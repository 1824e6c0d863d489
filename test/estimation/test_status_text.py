# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Directions in words: what hardly takes part is left out."""

import numpy as np
import pytest
from arms import robot_of

import kinematics_service as ks
from kinematics_service.estimation.status_text import (
    direction_in_words,
    joints_in_words,
    singularity_status,
)
from kinematics_service.robot.measures import Level

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


@pytest.mark.parametrize('level', [Level.OK, Level.WARN])
@pytest.mark.parametrize(('name', 'volume'), [('panda', 'manipulability'), ('ur5e', 'det(J) =')])
def test_a_determinant_is_shown_where_there_is_one(name, volume, level):
    robot = robot_of(name)
    found = ks.singularity(robot, np.full(robot.dof, 0.7))
    text = singularity_status(robot, found, level, 'base').sentence
    shown = {word: word in text for word in ('manipulability', 'det(J) =')}
    assert shown == {word: word == volume for word in shown}
