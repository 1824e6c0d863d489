# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `calibrate-zeros`: identify joint zeros by touches of a printed sheet."""

import os
import sys
from enum import Enum
from pathlib import Path
from typing import Annotated, Optional

import numpy as np

from ....cli.options import RobotOption, WrongUsage, given_robot, named, option
from ....output_file import say_written, write_file
from ....printing import attributes
from ..checking import refuse_loops, rigid_positions
from ..output.calibration_run import CalibratedPoses, CalibrationRun, origin_of
from ..output.servo_file import read_servos, servos_text
from ..output.sheet import SHEETS
from ..reading import read_touches
from ..zeros import calibrate_zeros as calibrated_zeros
from ..zeros import zero_sentences, zeros_of
from .calibrate_touch import POINT_OPTION
from .calibration_options import FilesArgument, FitOptions, TableOptions, check_output, grouped
from .calibration_outputs import OutputOptions, run_calibration

# Default value of --motors: two paths that no file has. It is not None, because typer before 0.10
# does not accept None for an option of two files.
NO_FILES = (Path(os.devnull, 'none'), Path(os.devnull, 'none'))


class SheetChoice(str, Enum):
    """Values of the option for the size of the printed sheet."""

    a4 = 'a4'
    letter = 'letter'


@grouped
def calibrate_zeros(
    robot: RobotOption,
    outputs: OutputOptions,
    table: TableOptions,
    files: FilesArgument = None,
    point: str = POINT_OPTION,
    sheet: SheetChoice = option('The paper of the sheet.', default=SheetChoice.a4),
    motors: Annotated[
        tuple[Path, Path],
        named(
            '--motors',
            "LeRobot's calibration, and the file to write.",
            'OLD NEW',
            show_default=False,
        ),
    ] = NO_FILES,
    fix: str = option('Do not calibrate these: tool.', 'NAMES', ''),
    noise: Optional[str] = option('Standard deviation of a touch: 0.5mm.', 'LIMIT'),
) -> None:
    """
    Find the zeros of the joints of an arm whose encoders were mounted by hand.

    Without FILE, --html writes a sheet to print. FILE is a table (.csv): each row has the name of
    a cross that the tip touched, and the joint positions. The pose of the sheet and the position
    of the tip are fitted. If FILE has columns velocity.<joint>, a backlash is identified, too. The
    sign of a velocity is the direction in which the joint moved to the cross.

    \b
    Examples:
      kinematics_service calibrate-zeros --robot so101 --html sheet.html
      kinematics_service calibrate-zeros touches.csv --robot so101 --motors old.json new.json
    """
    arm, given, paper = given_robot(robot), files or [], SHEETS[sheet.value]
    outputs.check(given)
    reading = table.selection(arm)
    refuse_loops(arm.description)
    servos = None
    if motors != NO_FILES:
        check_output('--motors', motors[1], (), outputs.force)
        servos = read_servos(motors[0], arm.joint_names)
    if not given:
        if outputs.html is None:
            raise WrongUsage('give FILE with touches, or --html FILE for the sheet to print')
        write_file(outputs.html, paper.page)
        say_written(outputs.html, sys.stdout)
        return

    def calibrated(run: CalibrationRun) -> CalibratedPoses:
        rows = [read_touches(file, reading, point) for file in given]
        points = np.array([paper.point(name) for touches in rows for name in touches.points])
        came = [touches.approach for touches in rows if touches.approach is not None]
        q, (names, remarks) = np.concatenate([touches.q for touches in rows]), origin_of(rows)
        approach = np.concatenate(came) if len(came) == len(rows) else None
        settings = {'progress': run.tell, **attributes(run, 'fix', 'noise', 'check')}
        result = calibrated_zeros(arm, q, points, approach=approach, **settings)
        remarks, places = [*zero_sentences(result), *remarks], rigid_positions(points)
        return CalibratedPoses(result, names, remarks, q, places, zeros_of(result))

    run = FitOptions(None, fix, None, noise).run(arm, True, not outputs.anyway)
    data = run_calibration(run, robot, given, outputs, calibrated)
    if servos is not None:
        write_file(motors[1], servos_text(servos, data.zeros))
        say_written(motors[1], outputs.stream)
