# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Inverse kinematics: compute joint positions for a target pose, and joint velocities for a twist.
"""
