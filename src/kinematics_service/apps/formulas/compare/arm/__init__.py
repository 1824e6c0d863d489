# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the quantities that formulas name (poses, axes, Jacobians), in symbols and in numbers.
"""
