# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute pose, Jacobian, twist, singularity measures and inverse kinematics of an arm."""
