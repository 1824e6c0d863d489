# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Pose, Jacobian, twist and singularity of an arm, from its robot file."""

import numpy as np

import kinematics_service as ks

robot = ks.load_robot('ur5e')  # or a path: ks.load_robot('my_arm.yaml')
q = np.radians([0.0, -90.0, 90.0, -90.0, -20.0, 0.0])
qdot = np.array([0.0, 0.1, 0.0, 0.0, 0.2, 0.0])

# One call computes all three; ks.forward_kinematics, ks.jacobian and ks.twist give one each.
state = ks.evaluate(robot, q, qdot)
print('position, m      ', state.position.round(4))
print('quaternion xyzw  ', state.quaternion_xyzw.round(4))
print('J, 6 x n         ', state.jacobian.shape)
print('twist, m/s rad/s ', state.twist.round(4))

near = ks.singularity(robot, q, qdot)
print(f'distance to a singular pose {near.distance:.3f} rad, {near.level.name}')
print(f'nearest: {near.factors.names[near.factors.nearest]}')
print(f'WARN in {near.time_to_warning:.2f} s at this speed')
