# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Judge recordings and planned trajectories as a running node would judge them.

Joint states go through the node's state estimator, then in batches through the kernel. Then the
node's rules decide, message by message, which warnings it would publish.
"""
