# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the node says near singular poses of arms with factors and without, each a node inside."""

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

import brute_force
from diagnostic_msgs.msg import DiagnosticStatus
from ros_harness import LATCHED, level_of, values_of

import kinematics_service as ks

FACTORS = {'so101': 'elbow'}
# Five joints with a factor; seven; six without a spherical wrist.
ARMS = (*FACTORS, 'fr3', 'crx10ia_l')
# Poses are looked for among so many, and told with four digits after the point.
POSES, ROUNDED = 500, 1e-4


def pose_near_a_singular_one(robot, factor):
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    q = np.random.default_rng(0).uniform(low, high, (POSES, robot.dof))
    found = ks.singularity(robot, q)
    near = np.isfinite(found.nearest_singular[:, 0]) & (found.level == ks.Level.WARN)
    if factor:
        near &= found.factors.estimates[:, 0] < 1.01 * found.distance
    return q[near][0]


@pytest.mark.parametrize('name', ARMS)
def test_a_warning_names_the_factor_or_the_singular_pose(arm, name):
    one, factor = arm(name), FACTORS.get(name)
    robot = ks.load_robot(name)
    assert robot.singularity.factors.names == ((factor,) if factor else ())
    q = pose_near_a_singular_one(robot, factor)
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)
    one.answer(q)
    one.spin_until(lambda: warnings, 'warning')
    values = values_of(warnings[0])
    assert level_of(warnings[0]) == ks.Level.WARN
    assert warnings[0].message.startswith(f'near a singularity: {factor or "distance"}')
    assert values.get('factor') == factor
    told = dict(word.split('=') for word in values['nearest_singular'].split())
    assert tuple(told) == robot.joint_names
    pose = np.array([float(position) for position in told.values()])
    distance = np.linalg.norm((pose - q) / robot.singularity.task.column_scales)
    assert distance == pytest.approx(float(values['distance']), abs=3 * ROUNDED)
    s = np.linalg.svd(brute_force.scaled_jacobian(robot, pose), compute_uv=False)
    assert s[robot.singularity.task.generic_rank - 1] < 3 * ROUNDED * robot.singularity.task.reach
