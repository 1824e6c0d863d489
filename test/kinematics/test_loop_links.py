# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The links of closed loops have their lengths in every pose, and end where the loop does."""

import numpy as np
import pytest
from arms import robot_of

from kinematics_service import kernel
from kinematics_service.kinematics.loop_links import carried_rows, linked_frames, loop_links
from kinematics_service.kinematics.tool_state import evaluate

# Round-off of some ten products of motions of a machine of a metre.
CLOSE = 1e-9


def links(name, q):
    state = evaluate(robot_of(name), q, depth=kernel.ALL_FRAMES)
    return state, loop_links(state)


def lengths(loop):
    return np.linalg.norm(np.diff(loop.corners, axis=0), axis=1)


@pytest.mark.parametrize('q', [(0.0, 0.0, 0.0), (0.4, -0.2, 0.9), (-0.5, -0.5, -0.5)])
def test_the_rods_of_a_delta_have_their_lengths_and_end_at_the_platform(q):
    state, loops = links('flexpicker', q)
    assert len(loops) == 3
    for loop in loops:
        sizes = lengths(loop)
        # Base, upper arm, rods, platform: w, L, l, u of the robot file.
        expected = [0.567 * np.sqrt(3) / 6, 0.524, 1.244, 0.076 / np.sqrt(3)]
        assert sizes[sizes > CLOSE] == pytest.approx(expected, abs=CLOSE)
        assert loop.corners[-1] == pytest.approx(state.position, abs=CLOSE)
        assert not any(loop.slides)


def test_the_motors_of_a_delta_are_at_the_base_across_its_arms():
    _, loops = links('flexpicker', (0.1, 0.2, 0.3))
    for k, loop in enumerate(loops):
        (motor,) = (joint for joint in loop.joints if joint.motors)
        assert motor.motors == (f'theta{k + 1}',)
        assert motor.point[2] == pytest.approx(0.0, abs=CLOSE)
        assert motor.direction @ motor.point == pytest.approx(0.0, abs=CLOSE)
        assert not motor.slides


@pytest.mark.parametrize('stroke', [2.4, 2.8])
def test_a_cylinder_is_as_long_as_its_joint_says(stroke):
    robot = robot_of('excavator')
    q = np.array(robot.description.loops[0].q)
    q[1] = stroke
    _, loops = links('excavator', q)
    (length,) = lengths(loops[0])[np.flatnonzero(loops[0].slides)]
    assert length == pytest.approx(stroke, abs=CLOSE)


def test_slides_that_place_a_platform_are_no_links():
    assert carried_rows(robot_of('flexpicker')) == (True, True, True)
    assert linked_frames(robot_of('flexpicker')).tolist() == [True, False, False, True]


@pytest.mark.parametrize('name', ['puma560', 'scara_hsr065', 'crank_slider', 'five_bar'])
def test_rows_of_other_arms_are_links(name):
    robot = robot_of(name)
    assert not any(carried_rows(robot))
    assert linked_frames(robot).all()


def test_an_arm_without_loops_has_none():
    assert links('puma560', np.zeros(6))[1] == ()
