# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Named tolerances, each with its reason."""

# Sums of a few dozen products of numbers near 1 in double precision; the golden data's own bound.
ROUND_OFF = 1e-12

# Determinants of the golden data: smaller numbers, fewer roundings.
DETERMINANT = 1e-13

# Central differences with step 1e-6: the third derivative leaves 1e-12, round-off 1e-10.
DIFFERENCE_STEP = 1e-6
DIFFERENCE = 1e-8

# Distances, condition numbers: quotients of numbers that carry ROUND_OFF.
QUOTIENT = 1e-9

# Distances to singular poses that were found: a search ends where a step gains less of the way.
FOUND = 1e-5
