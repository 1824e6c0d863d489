# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute clearances. The clearance of joint positions q is a radius, rad, in joint space: it is
proved that no joint positions within this radius around q are singular.
"""
