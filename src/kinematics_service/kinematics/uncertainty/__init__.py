# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute covariances of the tool's pose and twist from the uncertainty of an arm's parameters."""
