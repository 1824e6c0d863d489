# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Parse the text of a robot file: YAML with line numbers, faults, entries and expressions."""
