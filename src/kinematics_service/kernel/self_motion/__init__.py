# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute curves of inverse kinematics solutions of an arm with one joint more than its target needs.
"""
