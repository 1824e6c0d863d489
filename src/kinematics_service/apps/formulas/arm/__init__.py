# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the table of an arm (such as its DH table) in symbols. Evaluate frames and Jacobian of the
arm at many configurations.
"""
