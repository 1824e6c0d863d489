# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""All joint positions that reach a pose, and joint velocities that follow a twist."""

import numpy as np

import kinematics_service as ks

robot = ks.load_robot('ur5e')
now = np.array([0.1, -1.2, 1.4, -1.6, -1.2, 0.2])
target = ks.forward_kinematics(robot, now)
target[:3, 3] += [0.05, 0.0, 0.1]

result = ks.inverse_kinematics(robot, target, near=now)
print(f'{result.status}: {len(result)} solutions inside the limits, {result.method}')
for solution in result:
    print(solution.q.round(3), f'residual {solution.residual:.1e}', solution.posture)

# No solution is a result with a reason, and the nearest pose.
far = np.eye(4)
far[:3, 3] = [3.0, 0.0, 0.0]
refused = ks.inverse_kinematics(robot, far)
print(f'{refused.status}: {refused.reason}')

# One step of a servo: exact away from singular poses, damped near them, inside every limit.
step = ks.joint_velocity(robot, now, [0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
print('qdot', step.qdot.round(4))
