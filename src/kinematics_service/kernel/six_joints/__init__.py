# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute all inverse kinematics solutions of a general arm of six joints, by elimination."""
