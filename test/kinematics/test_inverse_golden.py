# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics against solution sets made independently, closed form checked by Newton."""

import json
import math

import numpy as np
import pytest
from folders import GOLDEN

import kinematics_service as ks

SAME = 1e-9  # modulo 2 pi: the sets' own bound
PROVED = 1e-10

SETS = {
    'ik_s000a_position': ('anthropomorphic_3r',),
    'ik_s000b_position': ('parallelogram_left', 'parallelogram_right'),
    'ik_s000c_position': ('spherical_rrp',),
    'ik_s001_position': ('craig_3r',),
    'ik_s002_position': ('rrp_elementary',),
    'ik_s003a_pose': ('offset_stanford_shape', 'offset_stanford_dh'),
    'ik_s003c_pose': ('offset_stanford_dh', 'offset_stanford_shape'),
}
# Point C of document 003, the origin of the frame after joint 3: the first rows of the arm alone,
# the shape-matrix zero of phi2 and that of the printed table (E3.8).
POINT_C = {
    'ik_s003a_C_position': ('d: 0, theta: phi2 + pi/2',),
    'ik_s003b_C_position': ('d: 0, theta: phi2',),
}
FIRST_THREE = """
robot: partial
source: "document 003, the first three joints"
convention: standard
constants: {{a: 0.13, h: 0.5, l: 0.3}}
joints:
  - {{name: phi1, type: revolute}}
  - {{name: phi2, type: revolute}}
  - {{name: phi3, type: prismatic, limits: [0, .inf]}}
links:
  - {{a: a, alpha: pi/2, d: h,        theta: phi1}}
  - {{a: 0, alpha: pi/2, {second}}}
  - {{a: 0, alpha: 0,    d: l + phi3, theta: 0}}
"""


def golden(name):
    return json.loads((GOLDEN / f'{name}.json').read_text())


def arms():
    for name, robots in SETS.items():
        for robot in robots:
            yield pytest.param(name, ks.load_robot(robot), id=f'{name}-{robot}')
    for name, rows in POINT_C.items():
        yield pytest.param(name, ks.robot_from_text(FIRST_THREE.format(second=rows[0])), id=name)


def away(robot, a, b):
    difference = np.asarray(a) - np.asarray(b)
    turning = np.array([kind == 'revolute' for kind in robot.joint_types])
    difference[turning] -= 2 * math.pi * np.round(difference[turning] / (2 * math.pi))
    return np.max(np.abs(difference))


@pytest.mark.parametrize(('name', 'robot'), list(arms()))
def test_the_same_solutions_and_the_same_ones_are_feasible(name, robot):
    for case in golden(name)['targets']:
        target = case.get('target_T', case.get('target_p'))
        found = ks.inverse_kinematics(robot, target, respect_limits=False)
        assert len(found) == case['n_solutions'], case['name']
        for expected in case['solutions']:
            distances = [away(robot, one.q, expected['q']) for one in found]
            nearest = found[int(np.argmin(distances))]
            assert min(distances) < SAME, case['name']
            assert nearest.feasible == expected['feasible'], case['name']
        assert all(one.residual < PROVED for one in found)
        feasible = sum(one['feasible'] for one in case['solutions'])
        inside = ks.inverse_kinematics(robot, target)
        assert len(inside) == feasible
        expected_status = 'solved' if feasible else 'outside_limits'
        assert inside.status == (expected_status if case['n_solutions'] else 'unreachable')
        assert (inside.nearest is None) == bool(feasible)
