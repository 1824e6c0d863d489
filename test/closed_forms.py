# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What can be written down by hand of the bundled arms, without the library."""

import math

import numpy as np

# Lengths of config/craig_3r.yaml.
L1, L2, L3 = 0.12, 0.4, 0.3


def craig_jacobian_in_tool_axes(q):
    """
    Return J of craig_3r in the axes of its tool, shape (6, 3).

    The tool's x runs along the last link, its z along the axes of joints 2 and 3, so that joints
    2 and 3 move the tool in its x and y, and joint 1, a vertical axis at the distance r, in its z.
    """
    _, q2, q3 = q
    r = L1 + L2 * math.cos(q2) + L3 * math.cos(q2 + q3)
    return np.array(
        [
            [0.0, L2 * math.sin(q3), 0.0],
            [0.0, L2 * math.cos(q3) + L3, L3],
            [r, 0.0, 0.0],
            [-math.sin(q2 + q3), 0.0, 0.0],
            [-math.cos(q2 + q3), 0.0, 0.0],
            [0.0, 1.0, 1.0],
        ]
    )
