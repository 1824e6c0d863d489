# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write the outputs of the calibration commands: robot file, report, and a page with pictures."""
