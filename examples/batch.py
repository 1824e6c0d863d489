# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Ten thousand poses in one call: which share of the joint space is near singular?"""

import numpy as np

import kinematics_service as ks

robot = ks.load_robot('puma560')
low, high = robot.limits.T
q = np.random.default_rng(0).uniform(low, high, size=(10_000, robot.dof))

near = ks.singularity(robot, q)  # every field is an array with a row a pose
for level in (ks.Level.WARN, ks.Level.ERROR):
    share = np.mean(near.level >= level)
    print(f'{level.name:5} {100.0 * share:5.2f} % of {len(q)} random poses inside the limits')

nearest = near.factors.nearest[near.level >= ks.Level.WARN]
for k, name in enumerate(near.factors.names):
    print(f'      {name}: {np.mean(nearest == k):.0%} of those')
