# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Arms whose table is off by what a calibration finds, so that no factorisation is left."""

import functools
import math

import numpy as np

import kinematics_service as ks

# Of angles in rad, of lengths in m.
ANGLE, LENGTH = 1e-3, 5e-4
HALF = math.pi / 2
UR5 = (
    (0.0, HALF, 0.089159),
    (-0.425, 0.0, 0.0),
    (-0.39225, 0.0, 0.0),
    (0.0, HALF, 0.10915),
    (0.0, -HALF, 0.09465),
    (0.0, 0.0, 0.0823),
)


@functools.cache
def calibrated_ur5(seed):
    """Return a UR5 (a, alpha, d of each row) with errors of its own."""
    return with_errors(UR5, (LENGTH, ANGLE, LENGTH, ANGLE), seed)


@functools.cache
def with_errors(rows, size, seed):
    """Return an arm of rows (a, alpha, d) with errors of a size in each number and each angle."""
    random = np.random.default_rng(seed)
    joints, links = [], []
    for i, row in enumerate(rows, 1):
        a, alpha, d, theta = (
            float(x) for x in np.array([*row, 0.0]) + random.normal(size=4) * np.asarray(size)
        )
        joints.append(f'  - {{name: j{i}, variable: q{i}, type: revolute}}\n')
        links.append(f'  - {{a: {a!r}, alpha: {alpha!r}, d: {d!r}, theta: q{i} + ({theta!r})}}\n')
    text = 'robot: calibrated\nsource: test\nconvention: standard\njoints:\n'
    return ks.robot_from_text(text + ''.join(joints) + 'links:\n' + ''.join(links))
