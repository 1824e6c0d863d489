# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Plans of arms with closed loops: what samples refute, and that nothing is called proved."""

import math

import linkages
import numpy as np
import pytest
from arms import robot_of
from refusal import refused

import kinematics_service as ks
from kinematics_service.apps.recordings.plans import closed_plan

# A five-bar's elbows part until its rods are straight: half the way between them is a rod then.
OPENING = [[math.pi / 2, math.pi / 2], [math.pi / 2 + 0.9, math.pi / 2 - 0.9]]
STRAIGHT = math.asin((0.3 - 0.15) / 0.25) / 0.9


def test_a_plan_on_which_a_loop_does_not_close_is_refuted_where_its_branch_ends():
    robot = ks.robot_from_text(linkages.SHORT_FIVE_BAR)
    check = ks.check_plan(robot, [0.0, 1.0], OPENING)
    closure = check.closure
    assert check.verdict == closure.verdict == 'refuted'
    assert closure.loop == 'rods'
    assert closure.moment.time == pytest.approx(STRAIGHT, abs=1e-6)
    with pytest.raises(ks.LoopError) as caught:
        ks.evaluate(robot, closure.moment.q)
    assert closure.sentence == str(caught.value)


def test_a_plan_over_a_dead_centre_is_refuted_there():
    robot = robot_of('crank_slider')
    check = ks.check_plan(robot, [1.0, 3.0], [[0.3], [-0.5]], speed_limit=0.02)
    assert check.closure.verdict == 'not decided'
    assert check.closure.moment is None
    found = check.singularity
    assert found.verdict == 'refuted'
    assert found.upper < 0.03
    assert found.moment.time == pytest.approx(1.0 + 2.0 * 0.3 / 0.8, abs=0.1)
    # The slider stands still there, and is fastest at an end: r sin q (1 + r cos q / x) q'.
    speed = check.speeds[0]
    x = linkages.crank_slider(-0.5)
    fastest = 0.4 * 0.05 * math.sin(0.5) * x / (x - 0.05 * math.cos(0.5))
    assert speed.lower == pytest.approx(fastest, rel=1e-9)
    assert speed.moment.time == 3.0
    assert math.isinf(speed.upper)
    assert speed.verdict == 'not decided'
    slower = ks.check_plan(robot, [1.0, 3.0], [[0.3], [-0.5]], speed_limit=0.9 * fastest)
    assert slower.speeds[0].verdict == 'refuted'


@pytest.mark.parametrize('name', ['crank_slider', 'five_bar', 'flexpicker'])
def test_of_loops_nothing_but_joints_is_called_proved(name):
    robot = robot_of(name)
    middle = robot.chain.closure.assembled()
    steps = 0.005 * np.arange(1, robot.dof + 1) * robot.singularity.task.column_scales
    check = ks.check_plan(robot, [0.0, 1.0], [middle, middle + steps], speed_limit=99.0)
    assert check.closure.verdict == 'not decided'
    assert check.singularity.verdict != 'proved'
    assert check.singularity.lower == 0.0
    assert check.speeds[0].verdict == 'not decided'
    assert {joint.limits for joint in check.joints} == {'proved'}
    assert check.joints[0].greatest.value == middle[0] + steps[0]


def test_a_plan_of_one_point_and_speeds_of_frames():
    robot = robot_of('five_bar')
    check = ks.check_plan(robot, [0.0], [[2.0, 1.0]], speed_limit=1.0, speed_of=['1'])
    assert check.closure.samples >= 1
    assert [speed.lower for speed in check.speeds] == [0.0, 0.0]
    # The left elbow turns about its motor.
    check = ks.check_plan(robot, [0.0, 1.0], [[2.0, 1.0], [2.4, 1.0]], speed_of=['1'])
    assert check.speeds[1].lower == pytest.approx(0.4 * 0.25, rel=1e-12)
    with refused(ks.PlanError, 'unknown-name', "five_bar has no point 'left'", '0 to 2'):
        ks.check_plan(robot, [0.0], [[2.0, 1.0]], speed_of=['left'])


def test_behind_the_first_pose_at_which_a_loop_does_not_close_nothing_is_tried(monkeypatch):
    robot, tried = ks.robot_from_text(linkages.SHORT_FIVE_BAR), []
    look = closed_plan.closes_at
    monkeypatch.setattr(
        closed_plan, 'closes_at', lambda chain, q: tried.append(len(q)) or look(chain, q)
    )
    begin = np.array(OPENING[0])
    check = ks.check_plan(robot, [0.0, 1.0], [begin, begin + [1000.0, -1000.0]])
    assert check.closure.verdict == 'refuted'
    assert sum(tried) < 1000


def test_positions_that_no_loop_closes_at_to_round_off_are_refused():
    robot = robot_of('four_bar_arm')
    far = [np.zeros(robot.dof), np.full(robot.dof, 1e11)]
    with refused(ks.PlanError, 'too-large', '1e+11 rad'):
        ks.check_plan(robot, [0.0, 1.0], far)
