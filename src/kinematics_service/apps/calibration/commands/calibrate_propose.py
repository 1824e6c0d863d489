# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `calibrate-propose`: choose the poses to measure next."""

import math
import re
from pathlib import Path
from typing import Annotated, Optional

from ....cli.options import RobotOption, WrongUsage, flag, given_robot, named, option
from ....errors import CalibrationError
from ....output_file import write_file
from ....printing import working
from ..proposal import MAX_COUNT, LineOfSight, propose_poses, table_text, trajectory_text
from ..reading import read_positions
from . import calibration_options
from .calibration_outputs import named_errors

NUMBER = r'\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*'
SIGHT = re.compile(rf'{NUMBER},{NUMBER},{NUMBER},{NUMBER}(?:deg)?(?:,\s*([+-]?)([xyz]))?')
PLANS = ('.csv', '.yaml', '.yml')


@calibration_options.grouped
def calibrate_propose(
    robot: RobotOption,
    count: Annotated[int, named('--count', 'Number of poses.', 'N')],
    fitting: calibration_options.FitOptions,
    poses: calibration_options.PoseOptions,
    table: calibration_options.TableOptions,
    images: calibration_options.ImageOptions,
    files: calibration_options.FilesArgument = None,
    plan: Optional[list[Path]] = option(
        'Write a table (.csv), or a JointTrajectory (.yaml).', 'FILE'
    ),
    among: Optional[Path] = option('Choose among joint positions of this recording.', 'FILE'),
    line_of_sight: Optional[str] = option(
        "A point (m) near the tool's z axis, or ,-x ...", 'X,Y,Z,DEG'
    ),
    camera: Optional[calibration_options.CameraChoice] = option(
        'FILE has poses of a board, as calibrate-camera.'
    ),
    force: bool = flag('--force', 'Overwrite the plan.'),
) -> None:
    """
    Propose the poses to measure next (D-optimal).

    FILE has the poses that are measured already. Without FILE, no pose is measured yet. The
    proposed poses keep away from joint limits and singular poses. Obstacles around the arm are
    unknown: look at the motion first. With --line-of-sight, the direction from the tool to the
    point X,Y,Z is at most DEG from the tool's z axis in each pose.

    \b
    Examples:
      kinematics_service calibrate-propose --robot ur5e --count 10 --plan next.yaml
      kinematics_service calibrate-propose tracker.csv --robot ur5e --count 5
    """
    if not 1 <= count <= MAX_COUNT:
        raise WrongUsage(f'--count: {count} is out of range; write 1 to {MAX_COUNT}')
    arm, given, plans = given_robot(robot), files or [], plan or []
    calibration_options.check_inputs(given)
    for file in plans:
        if file.suffix.lower() not in PLANS:
            raise WrongUsage(f'--plan: {file}: unknown ending; write a .csv or a .yaml')
        calibration_options.check_output('--plan', file, given, force)
    sight = None if line_of_sight is None else _sight(line_of_sight)
    reading, finder = poses.selection(arm, table), images.finder(given)
    if finder is not None and camera is None:
        raise WrongUsage('--images needs --camera on-tool or fixed')
    positions, after = reading.pose_format.kind == 'position', None
    run = fitting.run(arm, positions, True, poses.own, camera=camera)
    if given:
        with named_errors(given), working('calibrating') as tell:
            run = run._replace(tell=tell)
            after = images.calibrated(run, given, reading, poses.pose_gap, finder).found
            if not (after.accepted or after.only_worse):
                refused = '; '.join(after.refusals)
                message = f'this is no calibration to go on from: {refused}'
                raise CalibrationError(message, code='not-accepted')
    # Read only the joint positions of the candidates, because their poses are not measured yet.
    chosen = None if among is None else read_positions(among, reading._replace(pose_topic=None))
    proposed = propose_poses(arm, count, after, positions, among=chosen, line_of_sight=sight)
    for file in plans:
        text = table_text if file.suffix.lower() == '.csv' else trajectory_text
        write_file(file, text(proposed))
        print(f'wrote {file}: {count} poses')
    if not plans:
        print(table_text(proposed), end='')


def _sight(text: str) -> LineOfSight:
    match = SIGHT.fullmatch(text.strip())
    x, y, z, angle = map(float, match.group(1, 2, 3, 4)) if match else [math.nan] * 4
    if match is None or not (math.isfinite(x + y + z) and 0.0 < angle <= 180.0):
        raise WrongUsage(
            f'--line-of-sight: {text!r} is not accepted; write for instance 2.5,0,1.2,30 for a '
            "point within 30 deg of the tool's z axis, or 2.5,0,1.2,30,-x"
        )
    axis = [0.0, 0.0, 0.0]
    axis['xyz'.index(match[6] or 'z')] = -1.0 if match[5] == '-' else 1.0
    return LineOfSight((x, y, z), math.radians(angle), axis)
