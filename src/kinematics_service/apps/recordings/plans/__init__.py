# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check plans, and state for each claim about a plan whether it is proved, refuted, or not decided.
"""
