# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Turn a file of formulas into statements about a robot, and check each statement."""
