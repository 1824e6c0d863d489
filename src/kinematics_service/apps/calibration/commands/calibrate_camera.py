# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `calibrate-camera`: calibrate an arm and a camera by a board."""

from typing import Annotated

from ....cli.options import RobotOption, WrongUsage, given_robot, named
from ..output.calibration_run import CalibratedPoses, CalibrationRun
from . import calibration_options
from .calibration_outputs import OutputOptions, run_calibration


@calibration_options.grouped
def calibrate_camera(
    robot: RobotOption,
    camera: Annotated[
        calibration_options.CameraChoice,
        named('--camera', 'On the tool, or fixed with the board on the tool'),
    ],
    outputs: OutputOptions,
    fitting: calibration_options.FitOptions,
    poses: calibration_options.PoseOptions,
    table: calibration_options.TableOptions,
    images: calibration_options.ImageOptions,
    files: calibration_options.FilesArgument = None,
) -> None:
    """
    Calibrate an arm and a camera at once, by a board that the camera sees.

    FILE has joint states and poses of the board in the frame of the camera. With --images, FILE is
    a table (.csv) whose column `image` names images of the board: OpenCV finds the corners. The
    intrinsics are not fitted. Exit code 1: the result is refused.

    \b
    Examples:
      kinematics_service calibrate-camera seen.csv --robot ur5e --camera on-tool
      kinematics_service calibrate-camera taken.csv --robot ur5e --camera fixed
        --images pictures/ --board 7x5,40mm,30mm,DICT_5X5_100 --intrinsics camera.yaml
    """
    arm, given = given_robot(robot), files or []
    outputs.check(given)
    reading = poses.selection(arm, table)
    if not given:
        raise WrongUsage('give FILE with poses of a board, or with names of images')
    finder = images.finder(given)
    positions = reading.pose_format.kind == 'position'
    run = fitting.run(arm, positions, not outputs.anyway, poses.own, camera=camera)

    def calibrated(run: CalibrationRun) -> CalibratedPoses:
        return images.calibrated(run, given, reading, poses.pose_gap, finder)

    run_calibration(run, robot, given, outputs, calibrated)
