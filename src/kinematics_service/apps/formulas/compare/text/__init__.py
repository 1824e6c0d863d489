# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read a file of formulas: split it into tokens, parse them, and build expressions."""
