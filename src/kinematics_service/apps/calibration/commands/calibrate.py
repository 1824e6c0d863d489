# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `calibrate`: identify the kinematic parameters of an arm from measured poses."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Optional

from ....cli.options import RobotOption, WrongUsage, given_robot, named, option
from ....errors import CalibrationError
from ..conditions import ToolLoads
from ..output.calibration_run import CalibratedPoses, CalibrationRun
from ..reading import MeasuredRecording, cells_beside
from .calibration_options import FilesArgument, FitOptions, PoseOptions, TableOptions, grouped
from .calibration_outputs import OutputOptions, run_calibration

# The value of --sessions if each file is one session.
EACH_FILE = 'file'
# Default values of --load-at and --gravity. They are not None, because typer before 0.10 does not
# accept None for an option of three numbers.
ORIGIN, DOWN = (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)


class ConditionOptions(NamedTuple):
    """Options for the sessions in which poses were measured, and for the loads on the tool."""

    sessions: Optional[str] = option('The session of each row; `file`: of each FILE.', 'COLUMN')
    load: Optional[str] = option('The load on the tool in each row, kg.', 'COLUMN')
    load_at: Annotated[
        tuple[float, float, float],
        named('--load-at', 'Its centre of mass in the tool frame, m.', 'X Y Z', show_default='0'),
    ] = ORIGIN
    gravity: Annotated[
        tuple[float, float, float],
        named('--gravity', 'Its pull in the base frame.', 'X Y Z', show_default='0 0 -1'),
    ] = DOWN

    def check(self) -> None:
        """Raise an error if options of a load are given without the column of the loads."""
        if self.load is None and (self.load_at, self.gravity) != (ORIGIN, DOWN):
            raise WrongUsage('--load-at, --gravity: need the masses; give --load COLUMN too')

    def of(self, given: Sequence[MeasuredRecording]) -> dict[str, Any]:
        """
        Return the session and the load on the tool for each pose in `given`, as arguments of the
        library's `calibrate`.
        """
        sessions = loads = None
        if self.sessions == EACH_FILE:
            sessions = [Path(record.file).name for record in given for _ in record.q]
        elif self.sessions is not None:
            sessions = [cell for record in given for cell in cells_beside(record, self.sessions)]
        if self.load is not None:
            cells = [cell for record in given for cell in cells_beside(record, self.load)]
            try:
                loads = ToolLoads([float(cell) for cell in cells], self.load_at, self.gravity)
            except ValueError as error:
                message = f'column {self.load!r}: not a mass in kg: {error}'
                raise CalibrationError(message, code='not-a-number') from None
        return {'sessions': sessions, 'loads': loads}


@grouped
def calibrate(
    robot: RobotOption,
    outputs: OutputOptions,
    fitting: FitOptions,
    poses: PoseOptions,
    table: TableOptions,
    conditions: ConditionOptions,
    files: FilesArgument = None,
) -> None:
    """
    Identify the kinematic parameters of an arm from measured tool poses, and write its robot file.

    FILE has joint states and poses, as for audit: a bag, or a table (.csv). The numbers in the
    robot file have priors. A number that the poses do not identify keeps its nominal value. Exit
    code 1: the result is refused.

    \b
    Examples:
      kinematics_service calibrate tracker.csv --robot ur5e --output my_ur5e.yaml
      kinematics_service calibrate points.csv --robot ur5e --pose-format mm,position
      kinematics_service calibrate loads.csv --robot ur5e --load kg --load-at 0 0 0.05
    """
    arm, given = given_robot(robot), files or []
    outputs.check(given)
    reading = poses.selection(arm, table)
    conditions.check()
    positions = reading.pose_format.kind == 'position'
    run = fitting.run(arm, positions, not outputs.anyway, poses.own)
    if not given:
        raise WrongUsage('give FILE with measured poses; calibrate-propose says which to measure')

    def calibrated(run: CalibrationRun) -> CalibratedPoses:
        rows = run.read(given, reading, poses.pose_gap)
        return run.of_recordings(rows, **conditions.of(rows))

    run_calibration(run, robot, given, outputs, calibrated)
