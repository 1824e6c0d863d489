# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Describe one arm: its files, DH table, kinematic chain, task and measures of singularity."""
