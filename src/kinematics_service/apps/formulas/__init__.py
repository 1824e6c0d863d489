# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Derive exact formulas of an arm (`derive`), and check formulas that a user wrote (`compare`).

`derive/` computes frames, Jacobian, determinant and singular set of a robot file in exact algebra,
and writes the result as text, page, LaTeX or code. `compare/` reads formulas, compares them with
the derived ones or with numbers, and names the mistake that explains a difference.
"""
