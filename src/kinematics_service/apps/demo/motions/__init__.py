# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the motions of the simulated arm: through a singular pose, and sines, without ROS."""
