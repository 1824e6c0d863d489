# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Audit a dataset episode by episode: make findings, label all rows, and write one table of results.
"""
