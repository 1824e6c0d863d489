# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Merge JointState messages into joint positions and velocities, evaluate the arm, and decide on
singularity warnings.
"""
