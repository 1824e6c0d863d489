# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define the groups of options that the calibration commands share, and read the options' texts.
"""

import inspect
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Optional

import typer

from ....cli.options import WrongUsage, option, refuse_unwritable
from ....errors import CalibrationError
from ....rigid_motion import inverses
from ....robot.file.parts.parameters import ENDS
from ....robot.robot import Robot
from ...recordings.commands.frame_options import MAX_GAP, given_limit
from ...recordings.commands.recording_options import TableWords, given_selection
from ...recordings.readers.open_file import TABLES
from ...recordings.readers.source import Selection
from ..board_views import board_views
from ..boards.board import Board, BoardFinder
from ..boards.intrinsics import read_intrinsics
from ..camera import ON_TOOL, Camera
from ..output.calibration_run import CalibratedPoses, CalibrationRun
from ..reading import read_images

BOARD = re.compile(r'(\d{1,3})x(\d{1,3}),([^,]+),([^,]+),\s*(DICT_\w+)(,\s*legacy)?')
# Allowed numbers of squares along an edge of a board. With 1 or 2 squares, the board would have no
# inner corners or only one row of inner corners. Boards with more than 100 squares along an edge
# do not exist.
SQUARES = range(3, 101)
LARGEST_SQUARE = 10.0  # m; if an edge is longer, its unit was not metres

FilesArgument = Annotated[Optional[list[Path]], typer.Argument(metavar='FILE...', hidden=True)]


class CameraChoice(str, Enum):
    """Values of --camera: the place of the camera."""

    on_tool = 'on-tool'
    fixed = 'fixed'


class TableOptions(NamedTuple):
    """Options for the columns of a table and their units."""

    columns: Optional[str] = option('Names of columns, as `audit` takes them.', 'KEY=START,...')
    joint_format: Optional[str] = option(
        'Units of joint columns, as for `audit`: deg ...', 'WORDS'
    )
    stamps: Optional[str] = option(
        'Unit of stamps, or rate of rows; none: standing still.', 'UNIT|RATE'
    )
    joint_prefix: str = option('Prefix before the joint names of the robot file.', 'TEXT', '')

    def selection(self, robot: Robot) -> Selection:
        """Return the selection of what is read from a table: robot, columns and units."""
        words = TableWords(self.columns, None, self.joint_format, self.stamps)
        return given_selection(robot, None, None, self.joint_prefix, words)


class PoseOptions(NamedTuple):
    """
    Options of the measured poses in recordings. `own` names the ends (base, tool) whose pose
    differs from file to file.
    """

    topic: Optional[str] = option('Topic of joint states, if a bag has several.', 'TOPIC')
    pose_topic: Optional[str] = option('Topic of poses, points or transforms; /tf:FRAME.', 'TOPIC')
    pose_format: Optional[str] = option(
        'Units and orientations of pose columns, as for `audit`.', 'WORDS'
    )
    pose_gap: Optional[float] = option(
        'Longest time between joint states around a pose.', 'SECONDS'
    )
    own: str = option('Frames that differ from file to file: base, tool.', 'NAMES', 'base')

    def selection(self, robot: Robot, table: TableOptions) -> Selection:
        """Return the selection of what is read from a recording: robot, topics and columns."""
        gap = self.pose_gap
        if gap is not None and not 0.0 < gap <= MAX_GAP:
            raise WrongUsage(f'--pose-gap: {gap:g} is out of range; write at most {MAX_GAP:g}')
        for end in given_words(self.own):
            if end not in ENDS:
                raise WrongUsage(f'--own: {end!r} is not one of {", ".join(ENDS)}')
        words = TableWords(table.columns, self.pose_format, table.joint_format, table.stamps)
        return given_selection(robot, self.topic, self.pose_topic, table.joint_prefix, words)


class FitOptions(NamedTuple):
    """Options for the fitted parameters, their priors and the noise of the instrument."""

    fit: Optional[str] = option(
        'Calibrate only these groups or names.  [default: all but gears]', 'NAMES'
    )
    fix: str = option('Do not calibrate these groups or names.', 'NAMES', '')
    tolerance: Optional[str] = option(
        'Typical errors of the table, instead of those in the robot file.', 'LIMIT'
    )
    noise: Optional[str] = option('Standard deviation of the instrument: 2mm,0.3deg.', 'LIMIT')

    def run(
        self,
        robot: Robot,
        positions: bool,
        check: bool,
        own: str = 'base',
        camera: CameraChoice | None = None,
    ) -> CalibrationRun:
        """Return the settings of a calibration from these options."""
        words = given_words(self.fit or '')
        if self.fit is not None and not words:
            raise WrongUsage('--fit: empty; leave it out to fit all but gears')
        limit = None if self.tolerance is None else given_limit('--tolerance', self.tolerance)
        noise, fix = given_noise(self.noise, positions), given_words(self.fix)
        where: Camera | None = None if camera is None else camera.value
        return CalibrationRun(robot, words, fix, given_words(own), limit, noise, check, where)


class ImageOptions(NamedTuple):
    """Options for images of a board, and for the detection of the board."""

    images: Optional[Path] = option(
        'Images of a ChArUco board, named in the column `image`.', 'FOLDER'
    )
    board: Optional[str] = option(
        'Squares, edges, dictionary: 7x5,40mm,30mm,DICT_5X5_100.', 'BOARD'
    )
    intrinsics: Optional[Path] = option("The camera's calibration file, of ROS or OpenCV.", 'FILE')

    def finder(self, files: Sequence[Path]) -> BoardFinder | None:
        """Return the detector of the board; None if no folder of images is given."""
        if self == (None, None, None):
            return None
        if self.images is None or self.board is None or self.intrinsics is None:
            raise WrongUsage('--images, --board and --intrinsics go together: give all three')
        if not self.images.is_dir():
            raise WrongUsage(f'--images: no folder {self.images}; give that of the images')
        if len(files) != 1 or files[0].suffix.lower() not in TABLES:
            raise WrongUsage('--images takes one FILE, a table (.csv) with a column `image`')
        return BoardFinder(given_board(self.board), read_intrinsics(self.intrinsics))

    def calibrated(
        self,
        run: CalibrationRun,
        files: Sequence[Path],
        reading: Selection,
        gap: float | None,
        finder: BoardFinder | None,
    ) -> CalibratedPoses:
        """Return the calibration from poses of a board, or from images if `finder` is given."""
        if self.images is None or finder is None or run.camera is None:
            return run.of_recordings(run.read(files, reading, gap))
        run.tell('images')
        given, seen = read_images(files[0], reading, self.images, finder)
        camera = run.camera
        views = board_views(run.arm, given.q, seen, given.points, finder.camera, camera)
        run, q = run._replace(noise=run.noise or views.instrument), given.q[views.rows]
        try:
            result = run.calibrated(q, poses=views.poses, whitening=views.whitening)
        except CalibrationError as error:
            doubt = f'. And {views.doubt}' if views.doubt else ''
            raise CalibrationError(f'{error}{doubt}', code=error.code) from None
        poses = inverses(views.poses) if camera == ON_TOOL else views.poses
        result = replace(result, views=views)
        return CalibratedPoses(result, [str(files[0])], given.remarks, q, poses)


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """
    Return a command whose groups of options are replaced by the single options of each group.
    """
    groups, parameters = dict[str, Any](), list[inspect.Parameter]()
    for parameter in inspect.signature(command).parameters.values():
        if hasattr(parameter.annotation, '_fields'):
            groups[parameter.name] = parameter.annotation
            parameters += inspect.signature(parameter.annotation).parameters.values()
        else:
            parameters.append(parameter)
    parameters = [parameter.replace(kind=parameter.KEYWORD_ONLY) for parameter in parameters]

    def run(**values: Any) -> None:
        given = dict[str, Any]()
        for name, group in groups.items():
            given[name] = group(*(values.pop(field) for field in group._fields))
        command(**given, **values)

    run.__doc__, run.__name__ = command.__doc__, command.__name__
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return run


def given_words(text: str) -> tuple[str, ...]:
    """Return the words of a text that are separated by commas."""
    return tuple(word.strip() for word in text.split(',') if word.strip())


def given_noise(text: str | None, positions: bool) -> tuple[float, float] | None:
    """
    Return the noise of an instrument, m and rad, from the text of --noise; None without a text.

    If `positions` is set, a text without an angle is accepted.
    """
    if text is None:
        return None
    given = given_limit('--noise', text)
    if math.isinf(given.position) or (math.isinf(given.angle) and not positions):
        message = f'--noise: {text!r} lacks a length or an angle; write for instance 2mm,0.3deg'
        raise WrongUsage(message)
    return given.position, given.angle if math.isfinite(given.angle) else 0.0


def given_board(text: str) -> Board:
    """Return a board from the text of --board."""
    if match := BOARD.fullmatch(text.strip()):
        columns, rows = int(match[1]), int(match[2])
        square, marker = (given_limit('--board', match[k]).position for k in (3, 4))
        if {columns, rows} <= set(SQUARES) and marker < square < LARGEST_SQUARE:
            return Board(columns, rows, square, marker, match[5], match[6] is not None)
    raise WrongUsage(
        f'--board: {text!r} is not accepted; write how many squares it has along and down (3 to '
        '100), the edges of squares and of markers, which are smaller, and the dictionary: for '
        'instance 7x5,40mm,30mm,DICT_5X5_100; and ,legacy behind that for a board that OpenCV '
        'before 4.6 printed'
    )


def check_inputs(files: Sequence[Path]) -> None:
    """Refuse a recording that is given twice, since its poses would count twice."""
    resolved = [path.resolve() for path in files]
    for file in files:
        if resolved.count(file.resolve()) > 1:
            raise WrongUsage(f'FILE: {file} is given twice; give it once')


def check_output(name: str, file: Path, inputs: Sequence[Path], replaces: bool) -> None:
    """Refuse an output that cannot be written, is an input, or exists and is not replaced."""
    refuse_unwritable(name, file)
    if file.exists() and any(path.exists() and file.samefile(path) for path in inputs):
        raise WrongUsage(f'{name}: {file} is the recording itself; give another name')
    if file.is_file() and not replaces:
        raise WrongUsage(f'{name}: {file} exists; give another name, or --force')
