# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Closed loops: compute the passive variables and their rates from the joint positions and
velocities.
"""
