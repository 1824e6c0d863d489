# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Calibrate a robot: correct the numbers of its nominal table so that it predicts measured poses.

The modules in the order in which a calibration uses them, with their results:
reading, boards, collecting      rows: joint positions with measured poses, touches or images
checking, camera, conditions     `Measured`: the rows after a check for mistakes of the input
chosen_parameters, same_point    parameters to fit, their priors and start values (`placing`)
fitting, calibration             `FitProblem`, its solution `Identified`, and `Calibration`
acceptance                       reasons to refuse a calibration, and remarks
explanations                     mistakes of the input that would explain a refusal
report, robot_text, output       sentences, the robot file, the page

Modules that use the result of a calibration, or that serve a running node:
proposal                         the poses to measure next
pose_covariance                  the covariance of tool poses
second_source_watch              a check of the node against a second source of tool poses
"""
