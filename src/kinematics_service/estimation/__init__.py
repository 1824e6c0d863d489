# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Merge joint states from messages, and compute the tool's state and singularity warnings from them.
"""
