# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Run a calibration for a command: read recordings, calibrate, and write the outputs."""

import math
import sys
from collections.abc import Callable, Sequence
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TextIO

import numpy as np

from ....errors import CalibrationError
from ....kernel import Floats
from ....kinematics.uncertainty.parameters import parameters_of
from ....output_file import write_documents, write_file
from ....printing import Output, attributes, heading, json_text, plain, table
from ....rigid_motion import inverses
from ....robot.bundled import find_robot, find_robot_file
from ....robot.file.reader import robot_file_text
from ....robot.robot import Robot
from ...checking.errors import PoseLimit
from ...recordings.readers.source import Selection
from ..calibration import calibrate
from ..camera import ON_TOOL, Camera
from ..checking import Measured, refuse_loops
from ..chosen_parameters import ChosenParameters, asks_for_gears
from ..conditions import RowConditions
from ..reading import (
    MeasuredRecording,
    TouchRecording,
    read_measured,
)
from ..report import cells_of, document_of, sentences_of
from ..result import Calibration
from ..robot_text import CalibrationOrigin, Frames, calibrated_text
from ..zeros import JointZero
from .page import PageOrigin, page_of

# The calibration fits a lag if some joint is faster than this, rad/s or m/s.
MOVING = 0.05


class CalibrationOutputs(NamedTuple):
    """
    The output files of a calibration; None if a file is not wanted.

    Attributes
    ----------
    robot, html, json
        Paths of the robot file, the HTML page and the JSON document; `-` is the standard output.
    frames
        Whether the robot file keeps base and tool, or has those of the measured poses.
    anyway
        Whether the robot file of a refused calibration is written.
    """

    robot: Path | None
    html: Path | None
    json: Path | None
    frames: Frames
    anyway: bool

    @property
    def stream(self) -> TextIO:
        """Return the stream for text: stderr if the JSON document goes to stdout, else stdout."""
        return sys.stderr if str(self.json) == '-' else sys.stdout


class CalibratedPoses(NamedTuple):
    """
    A calibration, its measured poses, and the files that it was computed from.

    Attributes
    ----------
    found
        The calibration.
    files, remarks
        Names of the measured files, and sentences on reading the files.
    q, poses : shapes (N, n) and (N, 4, 4)
        Joint positions and poses of the first set, for known poses.
    zeros
        Zeros of the joints; empty unless the command is `calibrate-zeros`.
    """

    found: Calibration
    files: Sequence[str]
    remarks: Sequence[str]
    q: Floats
    poses: Floats
    zeros: Sequence[JointZero] = ()


class CalibrationRun(NamedTuple):
    """
    The settings with which one arm is calibrated from recordings, touches or received poses.

    Attributes
    ----------
    fit, fix, own
        As `calibrate` takes them.
    limit
        Usual errors of the table (m, rad) instead of those of the robot file; None: of the file.
    noise
        The noise of the instrument, m and rad; None: unknown.
    check
        Whether the frame check and the search for mistakes run.
    camera
        The place of the camera, if the poses are those of a board in its images.
    tell
        Called with the name of each phase of the work.
    """

    arm: Robot
    fit: tuple[str, ...]
    fix: tuple[str, ...]
    own: tuple[str, ...]
    limit: PoseLimit | None
    noise: tuple[float, float] | None
    check: bool
    camera: Camera | None = None
    tell: Callable[[str], None] = lambda phase: None

    def check_names(self) -> None:
        """
        Refuse wrong settings before any pose is measured, so that no measurement is in vain.

        Raises
        ------
        CalibrationError
            The arm has closed loops, a word names no parameter, or no parameter is fitted.
        """
        refuse_loops(self.arm.description)
        q = np.zeros((1, self.arm.dof))
        given = Measured.of(q, np.eye(4)[None], False, np.zeros(1, dtype=np.int64), q)
        every = parameters_of(self.arm, asks_for_gears(self.fit)).table
        ChosenParameters(self.arm, given, self.own, every).fitted(self.fit, self.fix)

    def of_recordings(
        self,
        files: Sequence[Path],
        reading: Selection,
        gap: float | None,
        conditions: Callable[[Sequence[MeasuredRecording]], RowConditions] = lambda _: (
            RowConditions()
        ),
    ) -> CalibratedPoses:
        """
        Return the calibration from the poses of recordings; each file is one set.

        Parameters
        ----------
        gap : s
            Largest time between the joint states around a pose; None: three usual intervals.
        conditions
            Returns sessions and loads of the rows, as `calibrate` takes them.
        """
        on_tool = self.camera == ON_TOOL
        given = [read_measured(file, reading, gap, on_tool) for file in files]
        if len({one.positions for one in given}) > 1:
            raise CalibrationError(
                'FILE: some have poses, others positions alone; give files of one kind',
                code='conflict',
            )
        found = self.calibrated(
            np.concatenate([one.q for one in given]),
            poses=np.concatenate([one.measured for one in given]),
            sets=np.repeat(np.arange(len(given)), [len(one.q) for one in given]),
            qdot=np.concatenate([one.rates for one in given]),
            read='' if on_tool else given[0].kind,
            camera=self.camera,
            **conditions(given)._asdict(),
        )
        poses = inverses(given[0].poses) if on_tool else given[0].poses
        return CalibratedPoses(found, *origin_of(given), given[0].q, poses)

    def calibrated(self, q: Floats, qdot: Floats | None = None, **rows: Any) -> Calibration:
        """Return the calibration; `rows` are arguments of the library's `calibrate`."""
        moves = qdot is not None and np.max(np.abs(qdot)) > MOVING
        # Tolerances that the robot file has for single numbers override the option.
        limit, named = self.limit, dict(self.arm.description.tolerances.named)
        table = [one for one in parameters_of(self.arm).table if one.name not in named]
        sizes = {one.name: limit[one.angle] for one in table} if limit else {}
        return calibrate(
            self.arm,
            q,
            qdot=qdot if moves else None,
            tolerances={name: size for name, size in sizes.items() if math.isfinite(size)},
            progress=self.tell,
            **attributes(self, 'fit', 'fix', 'own', 'noise', 'check'),
            **rows,
        )


def origin_of(given: Sequence[MeasuredRecording | TouchRecording]) -> tuple[list[str], list[str]]:
    """Return the names of all files, and all remarks on reading the files."""
    return [one.file for one in given], [remark for one in given for remark in one.remarks]


def write_robot_file(data: CalibratedPoses, robot: str, outputs: CalibrationOutputs) -> str:
    """
    Write the robot file and return a line of text about the file. If no file is wanted, or if the
    calibration is refused, write nothing and return an empty text.
    """
    if outputs.robot is None or not (data.found.accepted or outputs.anyway):
        return ''
    date = datetime.now().astimezone().date().isoformat()
    origin = CalibrationOrigin(', '.join(Path(one).name for one in data.files), date)
    nominal, whose = robot_file_text(*find_robot(robot)), (outputs.frames, outputs.anyway)
    text = calibrated_text(data.found, nominal, data.q, data.poses, origin, *whose)
    write_file(outputs.robot, text)
    return f'wrote {outputs.robot}; next: python -m kinematics_service check {outputs.robot}\n'


def write_report(data: CalibratedPoses, robot: str, outputs: CalibrationOutputs) -> None:
    """Write the page and the document of a calibration, and print its results."""
    date = datetime.now().astimezone().isoformat(' ', 'seconds')
    origin = PageOrigin(tuple(data.files), str(find_robot_file(robot)), date, tuple(data.remarks))
    page = page_of(data.found, origin) if outputs.html else ''
    document = {**document_of(data.found, data.files), 'reading': data.remarks}
    if data.zeros:
        document['zeros'] = data.zeros
    report = partial(_print_report, data, outputs)
    write_documents(outputs.html, page, outputs.json, json_text(document), report)


def _print_report(data: CalibratedPoses, outputs: CalibrationOutputs) -> None:
    found, out = data.found, Output()
    first, *others = sentences_of(found)
    sentences = [first, *data.remarks, *others]
    if not found.accepted:
        no_file = 'no robot file is written without --anyway'
        end = 'written anyway' if outputs.anyway else no_file
        out.print(plain(f'{sentences.pop(0)}; {end}.'), '')
    title = f'{found.robot.name}: {found.count} {found.kind} of {", ".join(data.files)}'
    out.print(heading(title), '')
    out.print(*(plain(f'  {sentence}.') for sentence in sentences), '')
    rows = table('  parameter', 'correction', 'deviation', '')
    for one in found.parameters:
        name, *cells = cells_of(one, found)
        rows.add_row(f'  {name}', *cells)
    out.print(rows)
