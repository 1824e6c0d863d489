# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Arms and targets at which one guard alone keeps elimination from a proof that would be none.

Each is of links at right angles or nearly so; the poses were met among thousands.
"""

import general_arms
import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.kinematics.inverse.problem.plan import plan_for
from kinematics_service.kinematics.inverse.problem.screws import screws_of
from kinematics_service.rigid_motion import inverse
from kinematics_service.robot.task import ROW_NAMES

H = general_arms.H


def eliminated(robot, target):
    """Return the real solutions (m, 6) of elimination, and whether it proves that they are all."""
    screws = screws_of(robot.chain)
    form = plan_for(robot, ROW_NAMES).six_joints
    if form is None:
        return np.empty((0, 6)), False
    psi, said = np.zeros((kernel.MAX_CANDIDATES, 6, 2)), np.zeros(3)
    count = kernel.complex_solutions(form, target @ inverse(screws.home), psi, said)
    real = psi[:count][np.max(np.abs(psi[:count, :, 1]), axis=1) < 1e-8, :, 0]
    return np.linalg.solve(screws.coupling, real.T).T, bool(said[2])


def is_right(robot, q):
    """Return whether elimination finds the joint positions of a target, or proves nothing."""
    found, proved = eliminated(robot, ks.forward_kinematics(robot, q))
    return not proved or bool(np.any(general_arms.apart(robot, found, q) < 1e-6))


def arm(kinds, rows):
    return ks.robot_from_text(general_arms.text_of('standard', rows, kinds))


def test_pivots_near_zero_prove_nothing_at_a_singular_pose():
    # Axes 3 to 5 are 1e-9 rad from parallel: the equations lose as many digits, and the double
    # root of the pose is far off the circle.
    rows = [(-0.13, -1.5707963242966478, -0.34, H), (0.42, 3.1415926520396478, 0.0, 0.0)]
    rows += [(0.44, 1.570796327284651, 0.0, H), (0.0, 5.00879186986572e-10, 0.0, 0.0)]
    rows += [(-0.04, -1.0502767005005464e-09, 0.0, 0.0), (0.0, -1.570796326605106, -0.05, 0.0)]
    robot = arm('RRRPRR', rows)
    assert is_right(robot, [-1.5 * H, 0.0, -H, -0.5, -H, -0.5 * H])


def test_equations_that_nearly_depend_on_each_other_prove_nothing_at_a_singular_pose():
    # Axes 1 to 3 are 1e-10 rad from parallel, and no pivot is small: what is left of the shortest
    # equation has lost the digits.
    rows = [(0.01, 2.7213381147619173e-10, 0.25, H), (0.36, -1.9922852403924002e-10, 0.0, H)]
    rows += [(-0.36, 1.5707963268844636, -0.05, H), (0.49, 1.5707963269143719, 0.3, H)]
    rows += [(0.34, 1.5707963266969136, 0.0, H), (0.03, 1.570796326728981, 0.35, 0.0)]
    q = [0.7852197673833732, -1.570821499897492, 0.7854469943776689]
    q += [-6.7383032547110245e-06, -6.57582526093178e-05, -1.5708869178848164]
    assert is_right(arm('RRRRPR', rows), q)


def test_a_family_is_not_proved_to_be_nothing():
    # The determinant vanishes at every angle, its round-off is in the low coefficients alone.
    rows = [(0.0, -9.201755237905402e-05, 0.0, 0.0), (0.0, -0.0004783729496619503, 0.0, 0.0)]
    rows += [(0.0, 1.5707291153015992, 0.0, H), (0.0, 1.5708631414070664, 0.0, 0.0)]
    rows += [(-0.08, 1.570540879371156, 0.0, H), (0.45, -1.5701693153597334, 0.0, 0.0)]
    robot = arm('RRPRRR', rows)
    q = np.array([-0.25, -1.0, 0.0, 0.5, -1.0, 0.0]) * np.pi
    assert is_right(robot, q)


def test_roots_whose_discs_meet_account_for_no_solution():
    # Several solutions share the hidden angle, at which Newton's method leads to one of them.
    robot = general_arms.general_arm('skew_wrist')
    q = np.array([-0.25, 0.25, -0.75, 1.0, 0.75, 0.75]) * np.pi
    assert is_right(robot, q)


@pytest.mark.parametrize('name', ['random-0', 'RPRPRR-0', 'PRPRPR-0'])
def test_half_a_turn_away_from_the_goal_is_no_solution_of_it(name):
    # There the sine of what is left is zero, and so is the step of Newton.
    robot = general_arms.general_arm(name)
    form, screws = plan_for(robot, ROW_NAMES).six_joints, screws_of(robot.chain)
    q = general_arms.general_poses(name, 1)[0]
    motion = ks.forward_kinematics(robot, q) @ inverse(screws.home)
    psi = np.zeros((kernel.MAX_CANDIDATES, 6, 2))
    psi[0, :, 0] = screws.coupling @ q
    assert kernel.followed_solutions(form, motion, 1, psi) == 1
    motion[:3, :3] = np.diag([1.0, -1.0, -1.0]) @ motion[:3, :3]
    assert kernel.followed_solutions(form, motion, 1, psi) == 0


def test_the_round_off_of_a_polynomial_that_vanishes_accounts_for_nothing():
    # A family with two slides; a double root with three, whose two axes are nearly parallel.
    rows = [(0.0, -H, 0.32, 0.0), (0.0, H, -0.17, 0.0), (0.0, H, 0.0, 0.0)]
    rows += [(0.0, -H, -0.02, H), (0.0, H, -0.43, 0.0), (0.0, 0.0, 0.0, H)]
    assert is_right(arm('RPRRRP', rows), [-1.5 * H, 0.5, 0.5 * H, -1.5 * H, 0.0, 0.5])
    rows = [(0.21, -1.5716173575842032, 0.0, 0.0), (0.0, -0.00010044345263037201, 0.28, 0.0)]
    rows += [(0.0, 3.1418110000331825, 0.0, 0.0), (0.31, 0.0010112567600447221, -0.03, 0.0)]
    rows += [(0.15, -1.5687453341282194, 0.0, 0.0), (0.27, -1.569718319657269, -0.15, 0.0)]
    assert is_right(arm('PRRRPP', rows), [-0.5, 0.0, 0.0, 1.5 * H, 0.5, 0.0])


def test_each_real_one_of_all_solutions_that_are_certified_is_among_those_found():
    # Two solutions are 3e-3 rad apart. Elimination counts 15, targets beside it lead to all 16.
    # Each number counts to its last digit.
    a = [8.063746138543934e-05, 0.2514441423139063, 5.875302039856456e-08, -7.411433303764352e-16]
    a += [0.0, 1.5102993620001545e-11]
    alpha = [-1.5708256081401892, 0.0, -1.5707963106524716, 1.5707963267948968]
    alpha += [-1.5707963267948966, 2.686641390897577e-12]
    d = [7.251695808842939e-05, -4.017068803265458e-13, 3.0097169312649523e-09]
    d += [-1.8714783373738768, 1.437077460030808, 2.7192022763690056]
    theta = [2.308683148527747e-06, 3.008398423942014e-14, 9.693888375003488e-09]
    theta += [-1.6536117853075388e-16, -0.0011058760547051462, -9.68417734469637e-13]
    rows = list(zip(a, alpha, d, theta))
    robot = arm('RRRRRR', rows)
    q = np.array([-2.539451684411639, 1.6178381412416718, 1.5707963267959622])
    q = np.append(q, [-3.111927983861086, -5.235043265779764e-13, 1.055115036697803])
    result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q))
    found = np.array([one.q for one in result])
    assert np.any(general_arms.apart(robot, found, q) < 1e-6)
    assert result.complete == 'proved'
    assert len(found) == 4
