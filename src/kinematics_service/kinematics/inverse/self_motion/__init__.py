# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the curves of inverse kinematics solutions of an arm with one redundant joint."""
