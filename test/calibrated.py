"""Arms whose table is off by what a calibration finds, so that no factorisation is left."""

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


def calibrated_ur5(seed):
    """Return a UR5 (a, alpha, d of each row) with errors of its own."""
    random = np.random.default_rng(seed)
    joints, rows = [], []
    for i, (a, alpha, d) in enumerate(UR5, 1):
        error = random.normal(size=4) * [LENGTH, ANGLE, LENGTH, ANGLE]
        joints.append(f'  - {{name: j{i}, variable: q{i}, type: revolute}}\n')
        rows.append(
            f'  - {{a: {a + error[0]!r}, alpha: {alpha + error[1]!r}, d: {d + error[2]!r}, '
            f'theta: q{i} + ({error[3]!r})}}\n'.replace('np.float64', '')
        )
    text = 'robot: calibrated\nsource: test\nconvention: standard\njoints:\n'
    return ks.robot_from_text(text + ''.join(joints) + 'links:\n' + ''.join(rows))
