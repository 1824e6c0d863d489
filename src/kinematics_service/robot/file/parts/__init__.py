# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the sections of a robot file: joints, table, loops, points, singularity and others."""
