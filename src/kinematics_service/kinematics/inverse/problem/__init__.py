# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Prepare an inverse kinematics problem: choose the solution method from the geometry of the arm, and
check the target.
"""
