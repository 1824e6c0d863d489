"""
From the nominal table to one very robot: `calibrate`, its variants, and the node's second source.

    reading, boards, collecting      rows: joint positions, and poses, touches or images
    -> checking, camera, conditions  `Measured`: rows that fit each other, without known mistakes
    -> chosen_parameters, same_point the parameters, their priors, and the start (`placing`)
    -> fitting                       `FitProblem` -> `Identified`: corrections, covariance, noise
    -> calibration                   `Calibration` (result, identified_table, corrections)
    -> acceptance, explanations      refusals, what would explain them, remarks
    -> report                        sentences for the screen, the page and the robot file
    -> robot_text, output            the robot file, the page, the document
    -> proposal                      the poses to measure next

`second_source.py` is what the node says of poses that arrive while it runs.
"""
