# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the table of an arm in symbols, and evaluate its frames and Jacobian at many configurations.
"""
