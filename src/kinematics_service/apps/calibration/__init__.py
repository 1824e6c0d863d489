# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Calibrate a robot: correct the numbers of its nominal table so that its poses fit measured ones.

Each line of modules starts from the result of the line above:
reading, boards, collecting      rows: joint positions with measured poses, touches or images
checking, camera, conditions     `Measured`: the rows after a check for mistakes
chosen_parameters, same_point    the parameters, their priors and start values (`placing`)
fitting, calibration             `FitProblem`, its solution `Identified`, and `Calibration`
acceptance, explanations         reasons of a refusal, mistakes that would explain it, remarks
report, robot_text, output       sentences, the robot file, the page; `proposal`: the next poses
second_source_watch, pose_covariance  a second source beside a node; covariance of tool poses
"""
