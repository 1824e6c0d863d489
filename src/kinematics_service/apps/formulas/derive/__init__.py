# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Derive frames, Jacobian, determinant and singular set of an arm exactly, with sympy.
"""
