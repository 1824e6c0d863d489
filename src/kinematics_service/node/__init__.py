# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Run the ROS 2 node: topics, parameters, process, and the picture of the arm."""
