# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Calibrate a robot: correct the numbers of its nominal table so that it predicts measured poses.

Modules, in the order in which a calibration uses them:
reading, boards, collecting, checking, camera, conditions: read and check the measurements
chosen_parameters, same_point, placing: choose the parameters, their priors and start values
fitting, calibration: solve the `FitProblem`; the result is a `Calibration`
acceptance, explanations: accept or refuse it, and name mistakes that would explain a refusal
report, robot_text, output: write the sentences, the robot file and the page
Beside: `proposal` (the poses to measure next), `pose_covariance`, and `second_source_watch`.
"""
