# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Apps beside each other on the core; each folder is one, and can be removed."""
