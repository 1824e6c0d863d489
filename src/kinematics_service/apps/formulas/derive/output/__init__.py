# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write a derivation as text, page, LaTeX, source code, JSON or notebook output."""
