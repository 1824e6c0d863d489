# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Solve inverse kinematics: find all joint positions that bring the tool to a target, and prove that
no solution is missing.
"""
