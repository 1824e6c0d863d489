"""The command `calibrate`: from the nominal table of an arm to this very one."""

import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from enum import Enum
from pathlib import Path
from typing import Annotated, NamedTuple, Optional, TextIO

import typer

from ..diagnosis.calibration.collecting import CollectedPoses
from ..diagnosis.calibration.output.calibration_run import (
    CalibratedPoses,
    CalibrationOutputs,
    CalibrationRun,
    Fitting,
    TermColumns,
    WantedPoses,
    write_proposal,
    write_report,
    write_robot_file,
)
from ..diagnosis.calibration.proposal import MOST, LineOfSight
from ..diagnosis.calibration.reading import read_positions
from ..errors import CalibrationError, ParameterNotFoundError
from ..estimation.estimator import EstimatorSettings
from ..formats.recordings.source import Selection
from ..kernel import Floats
from ..printing import working
from ..robot.file.parts.parameters import ENDS
from .frame_options import LONGEST_GAP, GapOption, given_limit
from .image_options import ImageOptions, given_images
from .live_calibration import (
    POSES,
    STATES,
    LiveOptions,
    checked_seconds,
    collected,
    kept_when_refused,
)
from .options import RobotOption, WrongUsage, flag, given_robot, option, refuse_unwritable
from .recording_options import (
    ColumnsOption,
    FormatOption,
    JointsOption,
    PrefixOption,
    StampsOption,
    TableWords,
    TopicOption,
    given_selection,
)
from .zero_options import POINT, SheetChoice, ZeroOptions, given_zeros

# What options of several values are where they are not given: typer before 0.10 knows no None.
# No file has such a path.
USUAL = TermColumns()
NO_FILES = (Path(os.devnull, 'none'), Path(os.devnull, 'none'))
PLANS = ('.csv', '.yaml', '.yml')
# Outputs that replace no file unless they are told to.
OVERWRITTEN_BY_FORCE = ('--output', '--plan')
DISTANCE = re.compile(r'([^,=]+),([^,=]+)=\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(mm|m)?')
SIGHT = re.compile(r'([^,]+),([^,]+),([^,]+),([^,]+?)\s*(?:deg)?(?:,\s*([+-]?)([xyz]))?')
# No two points that an arm touches are farther apart, m.
FARTHEST = 100.0


class CameraChoice(str, Enum):
    """Where the camera is."""

    on_tool = 'on-tool'
    fixed = 'fixed'


class FramesChoice(str, Enum):
    """Whose base and tool are written."""

    robot = 'robot'
    measured = 'measured'


def calibrate(
    context: typer.Context,
    robot: RobotOption,
    files: Annotated[
        Optional[list[Path]], typer.Argument(metavar='FILE...', help='Recordings.')
    ] = None,
    output: Optional[Path] = option('Write the calibrated robot file.', 'FILE'),
    json: Optional[Path] = option('Write everything as JSON; - prints it.', 'FILE'),
    html: Optional[Path] = option('Write a page with pictures.', 'FILE'),
    fit: Optional[str] = option('Fit these alone.', 'NAMES', shown='all but gears'),
    fix: str = option('Leave these as in the robot file.', 'NAMES', default=''),
    tolerance: Optional[str] = option(
        'Usual errors of lengths and angles of the table; default: those of the robot '
        'file, else 1mm,0.2deg.',
        'LIMIT',
    ),
    own: str = option('What each of several files has of its own.', 'NAMES', default='base'),
    frames: FramesChoice = option(
        'Base and tool written: of the robot file, or measured.', default=FramesChoice.robot
    ),
    topic: TopicOption = None,
    pose_topic: Optional[str] = option(
        'Topic of measured poses: stamped poses, points or transforms; /tf:FRAME.', 'TOPIC'
    ),
    columns: ColumnsOption = None,
    joint_format: JointsOption = None,
    stamps: StampsOption = None,
    joint_prefix: PrefixOption = '',
    pose_format: FormatOption = None,
    pose_gap: GapOption = None,
    same_point: Optional[str] = option(
        'Rows alike in this column touched the same point.', 'COLUMN'
    ),
    distance: Optional[list[str]] = option(
        'Known distance of two such points, in m.', 'A,B=LENGTH'
    ),
    camera: Optional[CameraChoice] = option(
        'The poses are those of a board that a camera sees: on the tool, or fixed.'
    ),
    sessions: Optional[str] = option(
        'The session of each row; `file`: each FILE is one. Drifts between sessions are fitted '
        'where that helps.',
        'COLUMN',
    ),
    load: Optional[str] = option(
        'The load on the tool in each row, kg. What joints yield to it is fitted where that '
        'helps.',
        'COLUMN',
    ),
    load_at: tuple[float, float, float] = option(
        'Its centre of mass in the tool frame, m.', 'X Y Z', USUAL.at, shown='0 0 0'
    ),
    gravity: tuple[float, float, float] = option(
        'Where it is pulled to, in the base frame.', 'X Y Z', USUAL.gravity, shown='0 0 -1'
    ),
    images: Optional[Path] = option(
        'Images of a ChArUco board for --camera; the column `image` of FILE names that of each '
        'row.',
        'FOLDER',
    ),
    board: Optional[str] = option(
        'The board: columns and rows of squares, edges of squares and of markers, dictionary; '
        'for instance 7x5,40mm,30mm,DICT_5X5_100.',
        'SIZE,EDGE,EDGE,NAME',
    ),
    intrinsics: Optional[Path] = option(
        "The camera's calibration file, of ROS or OpenCV (YAML, JSON).", 'FILE'
    ),
    zeros: bool = flag(
        '--zeros', 'Fit the zeros of the joints alone, to touches of known points of a sheet.'
    ),
    sheet: Optional[SheetChoice] = option(
        'The sheet of --zeros; without FILE --html writes it, to be printed.', shown='a4'
    ),
    backlash: Optional[str] = option(
        'The play of the turning joints, if it is known: for instance 0.5deg.', 'ANGLE'
    ),
    motors: tuple[Path, Path] = option(
        "LeRobot's calibration file of the servos, and the one to write with these zeros.",
        'OLD NEW',
        NO_FILES,
        shown=False,
    ),
    live: Optional[float] = option(
        'Collect poses of a running robot, until Ctrl-C at the latest.', 'SECONDS'
    ),
    propose: Optional[int] = option('Propose N poses to measure next.', 'N'),
    among: Optional[Path] = option('Propose joint positions of this recording alone.', 'FILE'),
    line_of_sight: Optional[str] = option(
        'Propose poses in which this point (m, base frame) is within so many degrees of the '
        "tool's z axis, or of another one (x, -y ...).",
        'X,Y,Z,DEG[,AXIS]',
    ),
    plan: Optional[list[Path]] = option(
        'Write them: a table (.csv) or a JointTrajectory (.yaml).', 'FILE'
    ),
    noise: Optional[str] = option(
        "The instrument's standard deviation of each number of a pose, if it is known: "
        'for instance 2mm,0.3deg.',
        'LIMIT',
    ),
    anyway: bool = flag('--anyway', 'Write the robot file even if the result is refused.'),
    force: bool = flag('--force', 'Overwrite the output.'),
) -> None:
    """
    Identify the numbers of an arm from measured poses of its tool, and write its robot file.

    \b
    Examples:
      kinematics_service calibrate tracker.csv --robot ur5e --output my_ur5e.yaml
      kinematics_service calibrate tracker.csv --robot ur5e --html found.html
      kinematics_service calibrate points.csv --robot ur5e --pose-format mm,position
      kinematics_service calibrate bag/ --robot arm.yaml --pose-topic /tracker/pose
      kinematics_service calibrate a.csv b.csv --robot ur5e --own base --json -
      kinematics_service calibrate run.csv --robot ur3e --fix base --frames measured
      kinematics_service calibrate holes.csv --robot ur5e --same-point hole
      kinematics_service calibrate seen.csv --robot ur5e --camera on-tool
      kinematics_service calibrate loads.csv --robot ur5e --load kg --load-at 0 0 0.05
      kinematics_service calibrate week.csv --robot ur5e --sessions day
      kinematics_service calibrate taken.csv --robot ur5e --camera on-tool
        --images pictures/ --board 7x5,40mm,30mm,DICT_5X5_100 --intrinsics camera.yaml
      kinematics_service calibrate --robot so101 --zeros --sheet a4 --html sheet.html
      kinematics_service calibrate touches.csv --robot so101 --zeros
      kinematics_service calibrate --robot ur5e --live 300 --output my_ur5e.yaml
      kinematics_service calibrate --robot ur5e --propose 10 --plan next.yaml

    \b
    FILE has joint states and measured poses, as for audit: a bag, or a table
    (.csv) with columns stamp, position.<joint>, pose.x and so on. The frame of
    the poses and the measured frame or point of the tool may differ from those of
    the robot file: both are fitted, unless --fix names base or tool.

    \b
    --fit and --fix take groups or names, with commas:
      offsets, lengths, angles, gears, base, tool, lag; all; theta2, d1, a3, alpha2,
      beta2, gear2, base.x

    \b
    Gear ratios are fitted where --fit names them, or all.

    \b
    --same-point needs no instrument: a spike on the tool touches the same point
    from many poses, and COLUMN of a table names the point of each row. Points and
    tip are fitted. Only the ratios of lengths are identifiable then, unless
    --distance says how far two points are apart.

    \b
    --camera takes the poses of a board (a marker, a checkerboard) in the frame of a
    camera. On the tool, the board stands still; fixed, the board is on the tool.
    Camera, board and the numbers of the arm are found at once. With --images a row of
    the table is an image of the board, and OpenCV finds its corners there. What they
    leave open of each pose counts, and nothing of the intrinsics is fitted.

    \b
    --zeros is for arms whose encoders were mounted by hand. The tip touches crosses
    of a printed sheet, and the column `point` (--same-point names another) has their
    names. Where the sheet lies and where the tip is are fitted along; --fix tool
    where the robot file has the tip. Columns velocity.<joint>, the direction each
    joint came from, tell a backlash; without them --backlash says how far joints
    may be off by it. --motors writes LeRobot's calibration file anew.

    \b
    --sessions and --load are for tables whose rows differ in more than the joints.
    Where the instrument stands, and the zeros of the joints, may drift from session
    to session, for instance by their temperature; joints yield to the torque of a
    load. Each is kept only if held-out rows come out better by more than twice the
    standard error; else the report says that it is not seen to help. Measure the
    same joint positions in each session, or with and without the load. The robot
    file has the arm without a load, in the middle of the sessions.

    \b
    --live hears joint states (--topic, /joint_states) and poses of the tool
    (--pose-topic, /kinematics/reference_pose) of a running robot. It says which
    numbers are identified by now, and which pose would identify more. At the end,
    or at Ctrl-C, it calibrates with what it has heard.

    \b
    Every number has a prior: --tolerance, or `tolerance` of the robot file. A
    number that is not identifiable keeps its nominal value. --propose names the
    poses to measure next, after those of FILE or before any. They keep away from
    limits and singular poses, but the command knows nothing of the cell around the
    arm: look at the motion first. --output is in the convention of the robot file:
    each number is the nominal one and its correction, and known_poses are the
    measured ones.

    \b
    A result is refused in three cases: more error remains than audit accepts (4 mm,
    0.5 deg; --noise is for an instrument that leaves more); more than a tenth of
    the poses are farther off than that; or those that are share the positions of one
    joint.
    Mistakes that would explain it are tried and named. No robot file is written
    then, unless --anyway asks for it.

    \b
    Exit code 0: calibrated. 1: FILE cannot be read, the frame check finds a
    mistake that calibration cannot mend, or the result is refused. 2: wrong usage.
    """
    plans = _plans(plan, propose)
    if propose is None and (among is not None or line_of_sight is not None):
        raise WrongUsage('--among and --line-of-sight choose proposed poses: give --propose N too')
    sight = None if line_of_sight is None else _sight(line_of_sight)
    _check_outputs({'--output': output, '--html': html, '--json': json}, plans, files, force)
    outputs = CalibrationOutputs(output, html, json, plans, frames.value, anyway)
    arm = given_robot(robot)
    others = {'--fit': fit, '--tolerance': tolerance, '--distance': distance, '--live': live}
    of_terms = {'--sessions': sessions, '--load': load}
    refused = {**others, '--propose': propose, '--pose-gap': pose_gap, '--camera': camera}
    refused.update(of_terms)
    of_zeros = given_zeros(
        zeros, arm, (sheet, backlash, None if motors == NO_FILES else motors), force, refused
    )
    pictured = given_images(images, board, intrinsics, camera is not None)
    words = TableWords(columns, pose_format, joint_format, stamps)
    reading = given_selection(arm, topic, pose_topic, joint_prefix, words)
    form = reading.pose_format
    fitting = Fitting(
        _fitted(fit),
        _words(fix),
        _words(own),
        None if tolerance is None else given_limit('--tolerance', tolerance),
        _instrument(noise, form.kind == 'position' or same_point is not None or zeros),
        not anyway,
        None if camera is None else camera.value,
    )
    _check_rows(pose_gap, distance, same_point, camera is not None)
    of_others = {'--same-point': same_point, '--images': images}
    terms = _term_columns(of_terms, load_at, gravity, of_others)
    if pictured is not None:
        pictured.check_file(files or [])
    if live is not None:
        _check_live(live, files, (same_point, *words, *of_terms.values()))
        if among is not None or sight is not None:
            raise WrongUsage('--live proposes as it hears: no --among, no --line-of-sight')
    elif context.obj:
        raise WrongUsage('calibrate takes no --ros-args without --live: it needs no ROS')
    if of_zeros is not None and not files:
        of_zeros.write_sheet(html)
        return
    given = None if among is None else _positions(among, reading)
    wanted = WantedPoses(propose or 0, given, sight)
    if live is None and not files:
        asked = (output, json, html, same_point)
        if propose is None or any(one is not None for one in asked):
            raise WrongUsage('give FILE with measured poses, or --propose N alone')
        write_proposal(arm, wanted, outputs, form.kind == 'position')
        return
    apart = _distances(distance)
    _check_files(files or [])
    if same_point is not None and propose is not None:
        raise WrongUsage('--propose is for measured poses, not for --same-point')
    run, heard = CalibrationRun(arm, fitting), None
    with _named_errors(files or []), ExitStack() as kept:
        if live is not None:
            topics = LiveOptions(
                topic or STATES, pose_topic or POSES, joint_prefix, live, propose or 1
            )
            heard = _heard(run, topics, outputs.stream, context.obj)
            kept.enter_context(kept_when_refused(arm, heard))
        with working('calibrating') as tell:
            tell('reading')
            run = run._replace(tell=tell)
            if heard is not None:
                found = run.of_heard(heard)
                data = CalibratedPoses(found, topics[:2], (), heard.q, heard.poses)
            else:
                rows = _Rows(files or [], reading, same_point, apart, pose_gap, terms, pictured)
                data = _of_files(run, rows, of_zeros)
            written = write_robot_file(data, robot, outputs)
        write_report(data, robot, outputs)
        if not (data.found.accepted or anyway):
            raise typer.Exit(1)
    print(written, end='', file=outputs.stream)
    if of_zeros is not None:
        of_zeros.write_servos(data.found, outputs.stream)
    if propose is not None:
        write_proposal(arm, wanted, outputs, data.found.positions, data.found)


class _Rows(NamedTuple):
    # What options say of the rows of files.
    files: list[Path]
    reading: Selection
    same_point: str | None
    apart: dict[tuple[str, str], float]
    gap: float | None
    terms: TermColumns
    pictured: ImageOptions | None


def _of_files(run: CalibrationRun, rows: _Rows, zeros: ZeroOptions | None) -> CalibratedPoses:
    if zeros is not None:
        column = rows.same_point or POINT
        return run.of_sheet(rows.files, rows.reading, column, zeros.sheet, zeros.play)
    if rows.same_point is not None:
        return run.of_touches(rows.files, rows.reading, rows.same_point, rows.apart)
    if rows.pictured is not None:
        return run.of_images(rows.files[0], rows.reading, *rows.pictured)
    return run.of_recordings(rows.files, rows.reading, rows.gap, rows.terms)


@contextmanager
def _named_errors(files: Sequence[Path]) -> Iterator[None]:
    # An unknown parameter is wrong usage. Errors in rows begin with the name of their file.
    try:
        yield
    except ParameterNotFoundError as error:
        raise WrongUsage(f'--fit, --fix: {error}') from None
    except CalibrationError as error:
        if not files or any(str(file) in str(error) for file in files):
            raise
        raise CalibrationError(f'{", ".join(map(str, files))}: {error}') from None


def _check_live(
    seconds: float, files: list[Path] | None, of_recordings: tuple[str | None, ...]
) -> None:
    if files or any(one is not None for one in of_recordings):
        raise WrongUsage(
            '--live hears a running robot: FILE, --same-point, --sessions, --load, --columns, '
            '--pose-format, --joint-format and --stamps are for recordings'
        )
    checked_seconds(seconds)


def _check_rows(
    gap: float | None, distance: Sequence[str] | None, same_point: str | None, camera: bool
) -> None:
    if gap is not None and not 0.0 < gap <= LONGEST_GAP:
        raise WrongUsage(f'--pose-gap: {gap:g} is not within 0 and {LONGEST_GAP:g} s')
    if camera and same_point is not None:
        raise WrongUsage('--camera is for measured poses, not for --same-point')
    if distance and same_point is None:
        raise WrongUsage('--distance is between points: give --same-point COLUMN too')


def _term_columns(
    columns: Mapping[str, str | None],
    at: tuple[float, float, float],
    gravity: tuple[float, float, float],
    others: Mapping[str, object],
) -> TermColumns:
    sessions, load = columns.values()
    given = ' and '.join(name for name, column in columns.items() if column is not None)
    for name, value in others.items():
        if given and value is not None:
            raise WrongUsage(f'{given}: for measured poses, not for {name}')
    if load is None and (at, gravity) != (USUAL.at, USUAL.gravity):
        raise WrongUsage('--load-at and --gravity are of a load: give --load COLUMN too')
    return TermColumns(sessions, load, at, gravity)


def _check_files(files: Sequence[Path]) -> None:
    if len({one.resolve() for one in files}) < len(files):
        raise WrongUsage('FILE: one recording is given twice, and would count twice')


def _instrument(noise: str | None, positions: bool) -> tuple[float, float] | None:
    if noise is None:
        return None
    given = given_limit('--noise', noise)
    if math.isinf(given.position) or (math.isinf(given.angle) and not positions):
        raise WrongUsage(f'--noise: {noise!r} lacks one of both; write for instance 2mm,0.3deg')
    return given.position, given.angle if math.isfinite(given.angle) else 0.0


def _heard(
    run: CalibrationRun, topics: LiveOptions, stream: TextIO, ros_args: Sequence[str]
) -> CollectedPoses:
    for end in run.fitting.own:
        if end not in ENDS:
            raise WrongUsage(f'--own: {end!r} is not one of {", ".join(ENDS)}')
    run.check_names()
    poses = collected(run.arm, topics, run.of_heard, stream, ros_args)
    if isinstance(poses, int):
        raise typer.Exit(poses)
    if not len(poses.q):
        raise CalibrationError(
            f'no pose of {topics.poses} with joint states of {topics.states} around its stamp '
            f'was heard within {topics.seconds:g} s'
        )
    return poses


def _distances(given: Sequence[str] | None) -> dict[tuple[str, str], float]:
    result: dict[tuple[str, str], float] = {}
    for text in given or []:
        match = DISTANCE.fullmatch(text.strip())
        if match is None:
            raise WrongUsage(f'--distance: {text!r} is not accepted; write for instance A,B=0.25')
        length = float(match[3]) * (1e-3 if match[4] == 'mm' else 1.0)
        if length > FARTHEST:
            raise WrongUsage(
                f'--distance: {text!r} is {length:g} m, farther than an arm reaches: write '
                f'millimetres as {text.strip()}mm'
            )
        pair = match[1].strip(), match[2].strip()
        if pair in result or pair[::-1] in result:
            raise WrongUsage(f'--distance: {" and ".join(pair)} are given twice')
        result[pair] = length
    return result


def _plans(plan: list[Path] | None, propose: int | None) -> list[Path]:
    if propose is not None and not 1 <= propose <= MOST:
        raise WrongUsage(f'--propose: {propose} is not within 1 and {MOST} poses')
    if plan and propose is None:
        raise WrongUsage('--plan writes proposed poses: give --propose N too')
    for file in plan or []:
        if file.suffix.lower() not in PLANS:
            raise WrongUsage(f'--plan: {file} is neither a table (.csv) nor a plan (.yaml)')
    return plan or []


def _sight(text: str) -> LineOfSight:
    match = SIGHT.fullmatch(text.strip())
    try:
        x, y, z, angle = map(float, match.group(1, 2, 3, 4) if match else [math.nan] * 4)
    except ValueError:
        x = y = z = angle = math.nan
    if match is None or not (math.isfinite(x + y + z) and 0.0 < angle <= 180.0):
        raise WrongUsage(
            f'--line-of-sight: {text!r} is not accepted; write for instance 2.5,0,1.2,30 for a '
            "point within 30 deg of the tool's z axis, or 2.5,0,1.2,30,-x"
        )
    axis = [0.0, 0.0, 0.0]
    axis['xyz'.index(match[6] or 'z')] = -1.0 if match[5] == '-' else 1.0
    return LineOfSight((x, y, z), math.radians(angle), axis)


def _positions(file: Path, reading: Selection) -> Floats:
    # Of the arm alone: poses are still to be measured.
    alone = reading._replace(pose_topic=None)
    return read_positions(file, alone, EstimatorSettings(reading.joint_prefix))


def _check_outputs(
    outputs: Mapping[str, Path | None],
    plans: Sequence[Path],
    inputs: Sequence[Path] | None,
    force: bool,
) -> None:
    # Before anything is heard or computed: what comes in an hour cannot be had again.
    named = [(name, file) for name, file in outputs.items() if file is not None]
    for name, file in [*named, *(('--plan', file) for file in plans)]:
        if name == '--json' and str(file) == '-':
            continue
        refuse_unwritable(name, file)
        if file.exists() and any(one.exists() and file.samefile(one) for one in inputs or []):
            raise WrongUsage(f'{name}: {file} is the recording itself')
        if name in OVERWRITTEN_BY_FORCE and file.is_file() and not force:
            raise WrongUsage(f'{file} exists already: give another name, or --force')


def _words(text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(',') if word.strip())


def _fitted(fit: str | None) -> tuple[str, ...]:
    words = _words(fit or '')
    if fit is not None and not words:
        raise WrongUsage('--fit names nothing; without it all but gears are fitted')
    return words
