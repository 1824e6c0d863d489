# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the commands `plot` and `view` with their options, one file for each command."""
