"""A calibration from its recordings to its outputs, as the command makes it."""

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TextIO

import numpy as np

from ....errors import CalibrationError
from ....estimation.estimator import EstimatorSettings
from ....kernel import Floats
from ....kinematics.uncertainty.parameters import parameters_of
from ....output_file import write_documents, write_file
from ....printing import Output, attributes, heading, json_text, plain, table
from ....rigid_motion import inverses
from ....robot.bundled import find_robot, find_robot_file
from ....robot.file.reader import robot_file_text
from ....robot.loops import refuse_loops
from ....robot.robot import Robot
from ...checking.errors import PoseLimit
from ...recordings.readers.source import Selection
from ..board_views import board_views
from ..boards.board import BoardFinder
from ..calibration import calibrate
from ..camera import ON_TOOL, Camera
from ..checking import Measured, rigid_positions
from ..chosen_parameters import ChosenParameters, asks_for_gears
from ..collecting import CollectedPoses
from ..conditions import ToolLoads
from ..proposal import LineOfSight, propose_poses, table_text, trajectory_text
from ..reading import (
    MeasuredRecording,
    TouchRecording,
    cells_beside,
    read_images,
    read_measured,
    read_touches,
    seen,
    without_lag,
)
from ..report import cells_of, document_of, sentences_of
from ..result import Calibration
from ..robot_text import CalibrationOrigin, Frames, calibrated_text
from ..zeros import JointZero, calibrate_zeros, zero_sentences, zeros_of
from .page import PageOrigin, page_of
from .sheet import Sheet

# The word for sessions that are a file each.
EACH_FILE = 'file'
# A joint as fast (rad/s, m/s) as this makes a lag matter.
MOVING = 0.05

Tell = Callable[[str], None]


class Fitting(NamedTuple):
    """
    What is fitted, and by what knowledge.

    Attributes
    ----------
    fit, fix, own
        As `calibrate` takes them.
    limit
        Usual errors of the table, instead of those of the robot file.
    noise
        Of the instrument: m and rad.
    check
        Whether mistakes are looked for.
    camera
        Where the camera is, if the poses are those of a board that it sees.
    """

    fit: tuple[str, ...]
    fix: tuple[str, ...]
    own: tuple[str, ...]
    limit: PoseLimit | None
    noise: tuple[float, float] | None
    check: bool
    camera: Camera | None = None


class TermColumns(NamedTuple):
    """
    Columns of tables by which the session and the load of each row are known, if they are.

    Attributes
    ----------
    sessions
        Its cells name the session; `file`: each file is one.
    load
        Its cells are masses in kg.
    at, gravity
        As `ToolLoads` has them.
    """

    sessions: str | None = None
    load: str | None = None
    at: tuple[float, float, float] = ToolLoads._field_defaults['at']
    gravity: tuple[float, float, float] = ToolLoads._field_defaults['gravity']

    def sessions_of(self, given: Sequence[MeasuredRecording]) -> list[str] | None:
        """Return the name of the session of each row; None if no column has it."""
        if self.sessions is None:
            return None
        if self.sessions == EACH_FILE:
            return [Path(one.file).name for one in given for _ in one.q]
        return [cell for one in given for cell in cells_beside(one, self.sessions)]

    def loads_of(self, given: Sequence[MeasuredRecording]) -> ToolLoads | None:
        """Return the load of each row; None if no column has it."""
        if self.load is None:
            return None
        cells = [cell for one in given for cell in cells_beside(one, self.load)]
        try:
            masses = [float(cell) for cell in cells]
        except ValueError as error:
            raise CalibrationError(f'the column {self.load!r} has masses in kg: {error}') from None
        return ToolLoads(masses, self.at, self.gravity)


class CalibrationOutputs(NamedTuple):
    """
    The files of a calibration, None where they are not wanted.

    Attributes
    ----------
    robot, html, json
        The robot file, the page, the document; `-` is the standard output.
    frames
        Whose base and tool the robot file has.
    anyway
        Whether it is written of what is no calibration.
    """

    robot: Path | None
    html: Path | None
    json: Path | None
    frames: Frames
    anyway: bool

    @property
    def stream(self) -> TextIO:
        """Return where lines for a person go."""
        return sys.stderr if str(self.json) == '-' else sys.stdout


class CalibratedPoses(NamedTuple):
    """
    A calibration and where it is from.

    Attributes
    ----------
    files, remarks
        The files, and sentences on reading them.
    q, poses : shapes (N, n) and (N, 4, 4)
        Of the first set, for known poses.
    zeros
        Of the joints, where these alone were asked for.
    """

    found: Calibration
    files: Sequence[str]
    remarks: Sequence[str]
    q: Floats
    poses: Floats
    zeros: Sequence[JointZero] = ()


class CalibrationRun(NamedTuple):
    """
    The calibrations of one arm from recordings, touches or poses that were heard.

    Attributes
    ----------
    tell
        Is called with words as the work goes on.
    """

    arm: Robot
    fitting: Fitting
    tell: Tell = lambda phase: None

    def check_names(self) -> None:
        """
        Refuse, before there is any pose, what a calibration would refuse with all of them.

        Raises
        ------
        CalibrationError
            The arm has closed loops, a word is no parameter, or nothing is left to be fitted.
        """
        arm, fitting = self.arm, self.fitting
        refuse_loops(arm.description, 'the calibration')
        q = np.zeros((1, arm.dof))
        given = Measured.of(q, np.eye(4)[None], False, np.zeros(1, dtype=np.int64), q)
        every = parameters_of(arm, asks_for_gears(fitting.fit)).table
        ChosenParameters(arm, given, fitting.own, every).fitted(fitting.fit, fitting.fix)

    def of_recordings(
        self,
        files: Sequence[Path],
        reading: Selection,
        gap: float | None,
        columns: TermColumns,
    ) -> CalibratedPoses:
        """
        Return the calibration from poses of recordings, a set each.

        Parameters
        ----------
        gap : s
            Largest time between the joint states around a pose; None: three usual intervals.
        columns
            Of sessions and loads.
        """
        settings = EstimatorSettings(reading.joint_prefix)
        on_tool = self.fitting.camera == ON_TOOL
        given = [
            without_lag(self.arm, seen(one) if on_tool else one)
            for one in (read_measured(file, reading, settings, gap) for file in files)
        ]
        if len({one.positions for one in given}) > 1:
            raise CalibrationError('some files have poses and others positions alone')
        found = self._calibrated(
            np.concatenate([one.q for one in given]),
            poses=np.concatenate(
                [seen(one).measured if on_tool else one.measured for one in given]
            ),
            sets=np.repeat(np.arange(len(given)), [len(one.q) for one in given]),
            qdot=np.concatenate([one.rates for one in given]),
            read='' if on_tool else given[0].kind,
            camera=self.fitting.camera,
            sessions=columns.sessions_of(given),
            loads=columns.loads_of(given),
        )
        return CalibratedPoses(found, _files(given), _remarks(given), given[0].q, given[0].poses)

    def of_seen(
        self,
        files: Sequence[Path],
        reading: Selection,
        gap: float | None,
        folder: Path | None,
        finder: BoardFinder | None,
    ) -> CalibratedPoses:
        """Return the calibration from poses, or from images of a folder if `finder` is given."""
        if folder is None or finder is None:
            return self.of_recordings(files, reading, gap, TermColumns())
        return self.of_images(files[0], reading, folder, finder)

    def of_touches(
        self,
        files: Sequence[Path],
        reading: Selection,
        column: str,
        apart: dict[tuple[str, str], float],
    ) -> CalibratedPoses:
        """Return the calibration from points, named in a column, with distances between them."""
        given = [read_touches(file, reading, column) for file in files]
        q = np.concatenate([one.q for one in given])
        marks = [mark for one in given for mark in one.points]
        found = self._calibrated(q, same_point=marks, apart=apart)
        points = {one.name: one.position for one in found.points}
        poses = rigid_positions(np.array([points[mark] for mark in marks]))
        return CalibratedPoses(found, _files(given), _remarks(given), q, poses)

    def of_images(
        self, file: Path, reading: Selection, folder: Path, finder: BoardFinder
    ) -> CalibratedPoses:
        """Return the calibration from images of a folder, named in a column of a table."""
        camera = self.fitting.camera
        assert camera is not None
        self.tell('images')
        given = read_images(file, reading, folder, finder)
        views = board_views(self.arm, given.q, given.seen, given.names, finder.camera, camera)
        q = given.q[views.rows]
        noise = self.fitting.noise or views.instrument
        run = self._replace(fitting=self.fitting._replace(noise=noise))
        try:
            found = run._calibrated(q, poses=views.poses, camera=camera, whitening=views.whitening)
        except CalibrationError as error:
            doubt = f'. And {views.doubt}' if views.doubt else ''
            raise CalibrationError(f'{error}{doubt}') from None
        found = replace(found, views=views)
        poses = inverses(views.poses) if camera == ON_TOOL else views.poses
        return CalibratedPoses(found, [str(file)], given.remarks, q, poses)

    def of_sheet(
        self,
        files: Sequence[Path],
        reading: Selection,
        column: str,
        sheet: Sheet,
        play: float,
    ) -> CalibratedPoses:
        """Return the zeros of the joints from points of a sheet, named in a column."""
        given = [read_touches(file, reading, column) for file in files]
        points = np.array([sheet.point(name) for one in given for name in one.points])
        came = [one.approach for one in given if one.approach is not None]
        q = np.concatenate([one.q for one in given])
        found = calibrate_zeros(
            self.arm,
            q,
            points,
            approach=np.concatenate(came) if len(came) == len(given) else None,
            play=play,
            progress=self.tell,
            **attributes(self.fitting, 'fix', 'noise', 'check'),
        )
        remarks = [*zero_sentences(found), *_remarks(given)]
        places = rigid_positions(points)
        return CalibratedPoses(found, _files(given), remarks, q, places, zeros_of(found))

    def of_heard(self, poses: CollectedPoses) -> Calibration:
        """Return the calibration from poses of a running robot."""
        return self._calibrated(
            poses.q, poses=poses.poses, qdot=poses.rates, camera=self.fitting.camera
        )

    def _calibrated(self, q: Floats, qdot: Floats | None = None, **rows: Any) -> Calibration:
        moves = qdot is not None and np.max(np.abs(qdot)) > MOVING
        return calibrate(
            self.arm,
            q,
            qdot=qdot if moves else None,
            tolerances=self._tolerances(),
            progress=self.tell,
            **attributes(self.fitting, 'fit', 'fix', 'own', 'noise', 'check'),
            **rows,
        )

    def _tolerances(self) -> dict[str, float]:
        # What the robot file says of single numbers holds beside the option.
        limit = self.fitting.limit
        if limit is None:
            return {}
        named = dict(self.arm.description.tolerances.named)
        return {
            one.name: size
            for one in parameters_of(self.arm).table
            if one.name not in named
            and math.isfinite(size := limit.angle if one.angle else limit.position)
        }


def _files(given: Sequence[MeasuredRecording | TouchRecording]) -> list[str]:
    return [one.file for one in given]


def _remarks(given: Sequence[MeasuredRecording | TouchRecording]) -> list[str]:
    return [remark for one in given for remark in one.remarks]


def write_robot_file(data: CalibratedPoses, robot: str, outputs: CalibrationOutputs) -> str:
    """Write the robot file of a calibration, if it is one, and return the line that says so."""
    if outputs.robot is None or not (data.found.accepted or outputs.anyway):
        return ''
    date = datetime.now().astimezone().date().isoformat()
    names = ', '.join(Path(one).name for one in data.files)
    text = calibrated_text(
        data.found,
        robot_file_text(*find_robot(robot)),
        data.q,
        data.poses,
        CalibrationOrigin(names, date),
        outputs.frames,
        outputs.anyway,
    )
    write_file(outputs.robot, text)
    return f'wrote {outputs.robot}; next: python -m kinematics_service check {outputs.robot}\n'


def write_report(data: CalibratedPoses, robot: str, outputs: CalibrationOutputs) -> None:
    """Write page and document of a calibration, and print what was found."""
    date = datetime.now().astimezone().isoformat(' ', 'seconds')
    origin = PageOrigin(tuple(data.files), str(find_robot_file(robot)), date, tuple(data.remarks))
    page = page_of(data.found, origin) if outputs.html else ''
    document = {**document_of(data.found, data.files), 'reading': data.remarks}
    if data.zeros:
        document['zeros'] = data.zeros
    report = partial(_print_report, data, outputs)
    write_documents(outputs.html, page, outputs.json, json_text(document), report)


def _print_report(data: CalibratedPoses, outputs: CalibrationOutputs) -> None:
    found = data.found
    out = Output()
    first, *others = sentences_of(found)
    sentences = [first, *data.remarks, *others]
    if not found.accepted:
        unwritten = 'no robot file is written without --anyway'
        file = 'written anyway' if outputs.anyway else unwritten
        out.print(plain(f'{sentences.pop(0)}; {file}.'), '')
    names = ', '.join(data.files)
    out.print(heading(f'{found.robot.name}: {found.count} {found.kind} of {names}'), '')
    out.print(*(plain(f'  {sentence}.') for sentence in sentences), '')
    rows = table('  parameter', 'correction', 'deviation', '')
    for one in found.parameters:
        name, *cells = cells_of(one, found)
        rows.add_row(f'  {name}', *cells)
    out.print(rows)


class WantedPoses(NamedTuple):
    """The number of poses to measure next that are asked for, and among which they are chosen."""

    number: int
    among: Floats | None = None
    line_of_sight: LineOfSight | None = None


def write_proposal(
    arm: Robot,
    wanted: WantedPoses,
    plans: Sequence[Path],
    positions: bool,
    after: Calibration | None = None,
) -> None:
    """Write the poses to measure next into plans, or print them where there are none."""
    count, among, sight = wanted
    proposed = propose_poses(arm, count, after, positions, among=among, line_of_sight=sight)
    for file in plans:
        text = table_text if file.suffix.lower() == '.csv' else trajectory_text
        write_file(file, text(proposed))
        print(f'wrote {file}: {count} poses')
    if not plans:
        print(table_text(proposed), end='')
