# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the clearance of joint positions: a proved radius, rad, within which no pose is singular.
"""
