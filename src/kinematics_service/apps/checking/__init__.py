# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check whether a robot file describes a given robot: the command `check`, and the frame check of
audits and calibrations.

The input is joint positions with poses of a second source, or the known poses of a robot file.
Hypotheses about mistakes (`hypotheses.py`: units, signs, offsets, lags, orders of angles) are
fitted and compared (`causes.py`). The result is a diagnosis that names the cause (`diagnosis.py`).
"""
