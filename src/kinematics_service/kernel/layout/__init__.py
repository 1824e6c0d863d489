# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Give the kernel access to numpy arrays, and define the indices of the numbers that the kernel reads
and writes in the arrays.
"""
