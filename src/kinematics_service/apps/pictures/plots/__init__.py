# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Draw pictures of an arm with matplotlib: configurations, motions over time, workspaces, and maps of
the distance to a singular pose.
"""
