# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Judge recordings and planned trajectories by the rules of the node.

Joint states go through the estimator of the node, then in batches through the kernel, and message
by message through the rules for warnings.
"""
