# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `calibrate-live`: collect poses of a running robot, and calibrate with them."""

import math
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import NamedTuple, Optional, TextIO

import typer

from ....cli.missing_ros import ros_module
from ....cli.options import RobotOption, WrongUsage, given_robot, option
from ....errors import CalibrationError, KinematicsError
from ....output_file import write_file
from ....robot.file.parts.parameters import TABLE_GROUPS
from ....robot.robot import Robot
from ..collecting import CollectedPoses, table_of
from ..output.calibration_run import CalibratedPoses, CalibrationRun
from ..proposal import propose_poses
from ..result import Calibration
from .calibration_options import CameraChoice, FitOptions, grouped
from .calibration_outputs import OutputOptions, named_errors, run_calibration

TIME_LIMIT = 86_400.0  # largest time of collecting, s: one day


class LiveOptions(NamedTuple):
    """Options for collecting poses: topics, joint prefix and time (s)."""

    topic: str = option('Joint states.', 'TOPIC', '/joint_states')
    pose_topic: str = option(
        'Poses of the tool (PoseStamped).', 'TOPIC', '/kinematics/reference_pose'
    )
    joint_prefix: str = option('Prefix before the joint names of the robot file.', 'TEXT', '')
    seconds: float = option('Stop after this time; Ctrl-C stops sooner.', 'SECONDS', 600.0)


@grouped
def calibrate_live(
    context: typer.Context,
    robot: RobotOption,
    outputs: OutputOptions,
    fitting: FitOptions,
    options: LiveOptions,
    camera: Optional[CameraChoice] = option(
        'Where the camera is, if the poses are of a board that it sees.'
    ),
) -> None:
    """
    Calibrate a running robot: collect joint states and measured poses, and then calibrate.

    While poses arrive, the command prints which numbers are identified so far, and which pose
    would identify more. Let the arm stand still at each pose. --ros-args and all arguments after
    it are passed to ROS.

    \b
    Example:
      kinematics_service calibrate-live --robot ur5e --output my_ur5e.yaml
    """
    outputs.check(())
    arm, seconds = given_robot(robot), options.seconds
    run = fitting.run(arm, False, not outputs.anyway, camera=camera)
    if not 0.0 < seconds <= TIME_LIMIT:
        message = f'--seconds: {seconds:g} is out of range; write at most {TIME_LIMIT:,.0f}'
        raise WrongUsage(message)
    with named_errors(()):
        run.check_names()
        poses = collected(run, options, outputs.stream, context.obj)
    if isinstance(poses, int):
        raise typer.Exit(poses)
    if not len(poses.q):
        raise CalibrationError(
            f'no pose of {options.pose_topic} with joint states of {options.topic} around its '
            f'stamp within {seconds:g} s; check both topics with `ros2 topic echo`',
            code='no-poses',
        )

    def calibrated(run: CalibrationRun) -> CalibratedPoses:
        return CalibratedPoses(_calibration_of(run, poses), options[:2], (), poses.q, poses.poses)

    try:
        run_calibration(run, robot, (), outputs, calibrated)
    except BaseException:
        _keep(arm, poses)  # write the poses to a file, because collecting them took minutes
        raise


def _calibration_of(run: CalibrationRun, poses: CollectedPoses) -> Calibration:
    return run.calibrated(poses.q, poses.rates, poses=poses.poses)


def collected(
    run: CalibrationRun, options: LiveOptions, stream: TextIO, ros_args: Sequence[str]
) -> CollectedPoses | int:
    """Return the collected poses, or an exit code; lines for the user go to `stream`."""

    def say(line: str) -> None:
        print(line, file=stream, flush=True)

    def fit(poses: CollectedPoses) -> bool:
        try:
            result = _calibration_of(run, poses)
            complete = result.known >= result.possible
            lines = list(_lines(run.arm, result, complete))
        except KinematicsError as error:
            lines, complete = [f'{len(poses.q)} poses: {error}'], False
        for line in lines:
            say(line)
        return complete

    session = ros_module('apps.calibration.calibration_session')
    outcome: CollectedPoses | int = session.collect_poses(run.arm, *options, fit, say, ros_args)
    return outcome


def _keep(robot: Robot, poses: CollectedPoses) -> None:
    # Write the collected poses to a CSV file. The caller raises an error after this. So a further
    # error, from writing the file, is ignored.
    file = Path(f'heard_poses_{datetime.now().astimezone():%Y%m%d_%H%M%S}.csv')
    with suppress(KinematicsError):
        write_file(file, table_of(poses, robot.joint_names))
        line = f'the {len(poses.q)} poses heard are kept in {file}, which calibrate reads'
        print(line, file=sys.stderr)


def _lines(robot: Robot, result: Calibration, complete: bool) -> Iterator[str]:
    yield f'{result.count} poses: {result.known} of {result.possible} combinations are identified'
    table = [parameter for parameter in result.parameters if parameter.group in TABLE_GROUPS]
    for words, known in (('identified', True), ('not yet, or not by itself', False)):
        names = ', '.join(parameter.name for parameter in table if parameter.identifiable == known)
        yield f'  {words}: {names or "none"}'
    if not result.accepted:
        yield f'  no calibration so far: {"; ".join(result.refusals)}'
    if complete:
        yield '  all identifiable numbers are identified; more poses refine them; Ctrl-C ends it'
        return
    (q,) = propose_poses(robot, 1, result).q.tolist()
    values = (
        f'{x:.4f} m' if slides else f'{math.degrees(x):.1f} deg'
        for x, slides in zip(q, robot.prismatic)
    )
    yield f'  a pose that identifies more: {", ".join(values)}'
