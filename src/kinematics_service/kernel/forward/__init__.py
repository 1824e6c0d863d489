# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Forward kinematics: compute frames, screws and twist of one pose, or of 16 poses at once."""
