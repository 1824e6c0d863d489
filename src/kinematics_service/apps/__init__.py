# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Applications on the core of the package. Each folder is one app, and can be removed."""
