# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute singularity measures: numbers that describe how near an arm is to a singular pose."""
