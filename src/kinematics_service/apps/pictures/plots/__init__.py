# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Draw pictures of an arm with matplotlib: poses, paths, maps of the distance, workspaces.
"""
