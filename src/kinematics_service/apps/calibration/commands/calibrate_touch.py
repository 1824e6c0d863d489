# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `calibrate-touch`: calibrate an arm by points that the tip of its tool touched."""

import re
from collections.abc import Sequence
from typing import Optional

import numpy as np

from ....cli.options import RobotOption, WrongUsage, given_robot, option
from ..checking import rigid_positions
from ..output.calibration_run import CalibratedPoses, CalibrationRun, origin_of
from ..reading import read_touches
from .calibration_options import FilesArgument, FitOptions, TableOptions, grouped
from .calibration_outputs import OutputOptions, run_calibration

DISTANCE = re.compile(r'([^,=]+),([^,=]+)=\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(mm|m)?')
MAX_DISTANCE = 100.0  # m; largest --distance, because no arm touches points farther apart
POINT = 'point'  # the column that names the point of each row

POINT_OPTION = option('The column that names the points.', 'COLUMN', POINT)


@grouped
def calibrate_touch(
    robot: RobotOption,
    outputs: OutputOptions,
    fitting: FitOptions,
    table: TableOptions,
    files: FilesArgument = None,
    point: str = POINT_OPTION,
    distance: Optional[list[str]] = option(
        'Known distance of two points, in m or mm.', 'A,B=LENGTH'
    ),
) -> None:
    """
    Calibrate an arm without an instrument: a spike on the tool touches the same points again.

    FILE is a table (.csv): each row has joint positions and the name of the touched point. Touch
    each point from many poses. The calibration also finds the positions of the points and the tip.
    Touches alone do not identify the size of the arm. To identify the size as well, measure the
    distance between two points and give it with --distance. Exit code 1: the result is refused.

    \b
    Examples:
      kinematics_service calibrate-touch holes.csv --robot ur5e --point hole
      kinematics_service calibrate-touch holes.csv --robot ur5e --distance A,B=250mm
    """
    arm, given = given_robot(robot), files or []
    outputs.check(given)
    reading, apart = table.selection(arm), _distances(distance)
    run = fitting.run(arm, True, not outputs.anyway)
    if not given:
        raise WrongUsage('give FILE, a table of touches')

    def calibrated(run: CalibrationRun) -> CalibratedPoses:
        rows = [read_touches(file, reading, point) for file in given]
        q = np.concatenate([touches.q for touches in rows])
        marks = [mark for touches in rows for mark in touches.points]
        result = run.calibrated(q, same_point=marks, apart=apart)
        points = {touched.name: touched.position for touched in result.points}
        poses = rigid_positions(np.array([points[mark] for mark in marks]))
        return CalibratedPoses(result, *origin_of(rows), q, poses)

    run_calibration(run, robot, given, outputs, calibrated)


def _distances(given: Sequence[str] | None) -> dict[tuple[str, str], float]:
    result: dict[tuple[str, str], float] = {}
    for text in given or []:
        match = DISTANCE.fullmatch(text.strip())
        if match is None:
            raise WrongUsage(f'--distance: {text!r} is not accepted; write for instance A,B=0.25')
        length = float(match[3]) * (1e-3 if match[4] == 'mm' else 1.0)
        if length > MAX_DISTANCE:
            raise WrongUsage(
                f'--distance: {text!r} is {length:g} m, farther than an arm reaches: write '
                f'millimetres as {text.strip()}mm'
            )
        pair = match[1].strip(), match[2].strip()
        if pair in result or pair[::-1] in result:
            raise WrongUsage(f'--distance: {",".join(pair)} is given twice; give it once')
        result[pair] = length
    return result
