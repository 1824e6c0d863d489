# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check whether a robot file describes a given robot: the command `check`, and the frame check of
audits and calibrations.

The check compares two sources of tool poses. The first source is the robot file: its table gives a
pose for each set of joint positions. The second source is a measurement, or the list `known_poses`
of the file. Possible mistakes (`hypotheses.py`: wrong units, signs, offsets, lags, orders of
angles) are corrected one at a time, and the remaining differences are compared (`causes.py`). The
result is a diagnosis that names the cause (`diagnosis.py`).
"""
