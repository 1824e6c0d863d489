# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Make the picture of an arm as plain data, for ROS markers and the page of command `view`."""
