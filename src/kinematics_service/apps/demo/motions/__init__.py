# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the two motions of the simulated arm: a line through a singular pose, and sines of time.

The computation needs no ROS.
"""
