# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Three angles of an orientation, compared with those of scipy."""

import numpy as np
import pytest

from kinematics_service.apps.checking.euler_orders import (
    EULER_ORDERS,
    euler_angles,
    rotation_of_euler,
)

# A rotation matrix from a dozen products of numbers up to 1.
ROUND_OFF = 2e-15


@pytest.mark.parametrize('order', EULER_ORDERS)
def test_three_angles_in_each_of_the_24_orders_are_those_of_scipy(order):
    from scipy.spatial.transform import Rotation

    assert len(EULER_ORDERS) == 24
    angles = np.random.default_rng(2).uniform(-np.pi, np.pi, (300, 3))
    # Where the first and the third turn about one axis, or next to it.
    angles[:60, 1] = np.repeat([0.0, np.pi / 2, -np.pi / 2, np.pi, 1e-9, np.pi / 2 - 1e-9], 10)
    R = rotation_of_euler(order, angles)
    assert np.abs(R - Rotation.from_euler(order, angles).as_matrix()).max() < ROUND_OFF
    found = euler_angles(order, R)
    assert np.abs(rotation_of_euler(order, found) - R).max() < ROUND_OFF
    expected = Rotation.from_matrix(R[60:]).as_euler(order)
    assert np.abs(found[60:] - expected).max() < 1e-7  # where the middle angle is near its ends
    assert rotation_of_euler(order, angles.reshape(3, 100, 3)).shape == (3, 100, 3, 3)
