"""The command `calibrate`: from the nominal table of an arm to this very one."""

import math
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from datetime import datetime
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Optional, TextIO

import typer

from ..robot.bundled import find_robot_file
from .frame_options import LONGEST_GAP, FormatOption, GapOption, given_format, given_limit
from .live_calibration import (
    POSES,
    STATES,
    LiveOptions,
    checked_seconds,
    collected,
    kept_when_refused,
)
from .options import RobotOption, WrongUsage, given_robot, refuse_unwritable
from .recording_options import ColumnsOption, PrefixOption, TopicOption

if TYPE_CHECKING:
    from ..diagnosis.calibration.calibration import Calibration
    from ..diagnosis.calibration.collecting import CollectedPoses
    from ..diagnosis.frame_check import PoseLimit
    from ..formats.recordings.source import Selection
    from ..kernel import Floats
    from ..robot.robot import Robot

HELP = """
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
  kinematics_service calibrate --robot ur5e --live 300 --output my_ur5e.yaml
  kinematics_service calibrate --robot ur5e --propose 10 --plan next.yaml

\b
FILE has joint states and measured poses, as for audit: a bag, or a table
(.csv) with columns stamp, position.<joint>, pose.x and so on. The frame of
the poses and the tool frame or point measured need not be those of the robot
file: both are fitted, unless --fix names base or tool.

\b
--fit and --fix take groups or names, with commas:
  offsets, lengths, angles, gears, base, tool, lag; all; theta2, d1, a3, alpha2,
  beta2, gear2, base.x


Gear ratios are fitted where --fit names them, or all.

\b
--same-point needs no instrument: a spike on the tool touches the same point
from many poses, and COLUMN of a table names the point of each row. Points and
tip are fitted. All lengths are then known by their ratios alone, unless
--distance says how far two points are apart.

\b
--live hears joint states (--topic, /joint_states) and poses of the tool
(--pose-topic, /kinematics/reference_pose) of a running robot, says which
numbers are known by now and which pose tells more, and goes on with what has
come at the end or at Ctrl-C.

\b
Every number has a prior, --tolerance or `tolerance` of the robot file: what
the poses do not tell stays where it was. --propose names the poses to measure
next, after those of FILE or before any; they keep from limits and singular
poses, but nothing is known of the cell around: look at the motion first.
--output is in the convention of the robot file: each number is the nominal
one and its correction, and known_poses are the measured ones.

\b
A result is refused where more remains than audit lets pass (4 mm, 0.5 deg;
--noise says that the instrument leaves more), more than a tenth of the poses
do not fit, or those of one joint's positions do not; what would explain it is
tried and named. No robot file is written then, unless --anyway asks for it.


Exit code 0: calibrated. 1: FILE cannot be read, the frame check names a
mistake that is no matter of calibration, or the result is refused. 2: wrong
usage.
"""


PLANS = ('.csv', '.yaml', '.yml')
# Outputs that replace no file unless they are told to.
OVERWRITTEN_BY_FORCE = ('--output', '--plan')
DISTANCE = re.compile(r'([^,=]+),([^,=]+)=\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(mm|m)?')
# No two points that an arm touches are farther apart, m.
FARTHEST = 100.0
# A joint as fast (rad/s, m/s) as this makes a lag matter.
MOVING = 0.05


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
    output: Annotated[
        Optional[Path], typer.Option(metavar='FILE', help='Write the calibrated robot file.')
    ] = None,
    json: Annotated[
        Optional[Path], typer.Option(metavar='FILE', help='Write everything as JSON; - prints it.')
    ] = None,
    html: Annotated[
        Optional[Path], typer.Option(metavar='FILE', help='Write a page with pictures.')
    ] = None,
    fit: Annotated[
        Optional[str],
        typer.Option(metavar='NAMES', help='Fit these alone.', show_default='all but gears'),
    ] = None,
    fix: Annotated[
        str, typer.Option(metavar='NAMES', help='Leave these as in the robot file.')
    ] = '',
    tolerance: Annotated[
        Optional[str],
        typer.Option(
            metavar='LIMIT',
            help='Usual errors of lengths and angles of the table; default: those of the robot '
            'file, else 1mm,0.2deg.',
        ),
    ] = None,
    own: Annotated[
        str, typer.Option(metavar='NAMES', help='What each of several files has of its own.')
    ] = 'base',
    frames: Annotated[
        FramesChoice, typer.Option(help='Base and tool written: of the robot file, or measured.')
    ] = FramesChoice.robot,
    topic: TopicOption = None,
    pose_topic: Annotated[
        Optional[str], typer.Option(metavar='TOPIC', help='Topic of PoseStamped messages.')
    ] = None,
    columns: ColumnsOption = None,
    joint_prefix: PrefixOption = '',
    pose_format: FormatOption = None,
    pose_gap: GapOption = None,
    same_point: Annotated[
        Optional[str],
        typer.Option(metavar='COLUMN', help='Rows alike in this column touched the same point.'),
    ] = None,
    distance: Annotated[
        Optional[list[str]],
        typer.Option(metavar='A,B=LENGTH', help='Known distance of two such points, in m.'),
    ] = None,
    live: Annotated[
        Optional[float],
        typer.Option(
            metavar='SECONDS', help='Collect poses of a running robot, until Ctrl-C at the latest.'
        ),
    ] = None,
    propose: Annotated[
        Optional[int], typer.Option(metavar='N', help='Propose N poses to measure next.')
    ] = None,
    plan: Annotated[
        Optional[list[Path]],
        typer.Option(
            metavar='FILE', help='Write them: a table (.csv) or a JointTrajectory (.yaml).'
        ),
    ] = None,
    noise: Annotated[
        Optional[str],
        typer.Option(
            metavar='LIMIT',
            help='Standard deviation of each number of a pose by the instrument, if it is known: '
            'for instance 2mm,0.3deg.',
        ),
    ] = None,
    anyway: Annotated[
        bool, typer.Option('--anyway', help='Write the robot file of what is no calibration, too.')
    ] = False,
    force: Annotated[bool, typer.Option('--force', help='Overwrite the output.')] = False,
) -> None:
    """Run the command; `HELP` is what its user reads."""
    plans = _plans(plan, propose)
    _check_outputs({'--output': output, '--html': html, '--json': json}, plans, files, force)
    arm = given_robot(robot)
    form = given_format(pose_format)
    wanted = _Wanted(
        _fitted(fit),
        _words(fix),
        _words(own),
        None if tolerance is None else given_limit('--tolerance', tolerance),
        _instrument(noise, form.kind == 'position' or same_point is not None),
        not anyway,
    )
    if pose_gap is not None and not 0.0 < pose_gap <= LONGEST_GAP:
        raise WrongUsage(f'--pose-gap: {pose_gap:g} is not within 0 and {LONGEST_GAP:g} s')
    if distance and same_point is None:
        raise WrongUsage('--distance is between points: give --same-point COLUMN too')
    if live is not None:
        _check_live(live, files, (same_point, columns, pose_format))
    elif context.obj:
        raise WrongUsage('calibrate takes no --ros-args without --live: it needs no ROS')
    elif not files:
        asked = (output, json, html, same_point)
        if propose is None or any(one is not None for one in asked):
            raise WrongUsage('give FILE with measured poses, or --propose N alone')
        _propose(arm, propose, None, plans, form.kind == 'position', sys.stdout)
        return
    apart = _distances(distance)
    _check_files(files or [])
    if same_point is not None and propose is not None:
        raise WrongUsage('--propose is for measured poses, not for --same-point')
    from ..formats.recordings.source import Selection

    reading = Selection(arm, topic, pose_topic, columns, joint_prefix, form)
    report = sys.stderr if str(json) == '-' else sys.stdout
    heard = None
    if live is not None:
        topics = LiveOptions(
            topic or STATES, pose_topic or POSES, joint_prefix, live, propose or 1
        )
        with _parameters_known():
            heard = _heard(arm, topics, wanted, report, context.obj)
    kept = nullcontext() if heard is None else kept_when_refused(arm, heard.poses)
    with _parameters_known(), kept:
        with _status() as tell:
            tell('reading')
            if heard is not None:
                data = heard.fit(tell)
            elif same_point is not None:
                data = _touched(files or [], reading, same_point, wanted, apart, tell)
            else:
                data = _measured(files or [], reading, pose_gap, wanted, tell)
            written = _written(data, robot, frames, output, anyway)
        if html is not None:
            _write_page(data, html, robot)
        _report(data, json, anyway)
        if not (data.found.accepted or anyway):
            raise typer.Exit(1)
    print(written, end='', file=report)
    if propose is not None:
        _propose(arm, propose, data.found, plans, data.found.positions, report)


@contextmanager
def _parameters_known() -> Iterator[None]:
    # A name that is no parameter is wrong usage here.
    from ..errors import ParameterNotFoundError

    try:
        yield
    except ParameterNotFoundError as error:
        raise WrongUsage(f'--fit, --fix: {error}') from None


def _check_live(
    seconds: float, files: list[Path] | None, of_recordings: tuple[str | None, ...]
) -> None:
    if files or any(one is not None for one in of_recordings):
        raise WrongUsage(
            '--live hears a running robot: FILE, --same-point, --columns and --pose-format '
            'are for recordings'
        )
    checked_seconds(seconds)


def _check_files(files: Sequence[Path]) -> None:
    if len({one.resolve() for one in files}) < len(files):
        raise WrongUsage('FILE: one recording is given twice, and would count twice')


class _Calibrated(NamedTuple):
    # What was found; the files and remarks on them; joints and poses for known poses.
    found: 'Calibration'
    files: list[str]
    remarks: list[str]
    q: 'Floats'
    poses: 'Floats'


class _Wanted(NamedTuple):
    # What is fitted, what is not, what each set has of its own; usual errors, noise; whether
    # mistakes are looked for.
    fit: tuple[str, ...]
    fix: tuple[str, ...]
    own: tuple[str, ...]
    limit: 'PoseLimit | None'
    instrument: tuple[float, float] | None
    check: bool

    def fitting(self, arm: 'Robot') -> dict[str, Any]:
        """Return the arguments of the library that say so."""
        return {
            'fit': self.fit,
            'fix': self.fix,
            'tolerances': _tolerances(arm, self.limit),
            'noise': self.instrument,
            'check': self.check,
        }


def _instrument(noise: str | None, positions: bool) -> tuple[float, float] | None:
    if noise is None:
        return None
    given = given_limit('--noise', noise)
    if math.isinf(given.position) or (math.isinf(given.angle) and not positions):
        raise WrongUsage(f'--noise: {noise!r} lacks one of both; write for instance 2mm,0.3deg')
    return given.position, given.angle if math.isfinite(given.angle) else 0.0


class _LivePoses(NamedTuple):
    # Poses of a running robot, and what makes a calibration of them.
    poses: 'CollectedPoses'
    fit: Callable[[Callable[[str], None]], _Calibrated]


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
    if propose is not None:
        from ..diagnosis.calibration.proposal import MOST

        if not 1 <= propose <= MOST:
            raise WrongUsage(f'--propose: {propose} is not within 1 and {MOST} poses')
    if plan and propose is None:
        raise WrongUsage('--plan writes proposed poses: give --propose N too')
    for file in plan or []:
        if file.suffix.lower() not in PLANS:
            raise WrongUsage(f'--plan: {file} is neither a table (.csv) nor a plan (.yaml)')
    return plan or []


def _check_outputs(
    outputs: Mapping[str, Path | None],
    plans: Sequence[Path],
    inputs: Sequence[Path] | None,
    force: bool,
) -> None:
    # Before anything is heard or computed: what comes in an hour cannot be had again.
    named = [(option, file) for option, file in outputs.items() if file is not None]
    for option, file in [*named, *(('--plan', file) for file in plans)]:
        if option == '--json' and str(file) == '-':
            continue
        refuse_unwritable(option, file)
        if file.exists() and any(one.exists() and file.samefile(one) for one in inputs or []):
            raise WrongUsage(f'{option}: {file} is the recording itself')
        if option in OVERWRITTEN_BY_FORCE and file.is_file() and not force:
            raise WrongUsage(f'{file} exists already: give another name, or --force')


def _propose(
    arm: 'Robot',
    count: int,
    after: 'Calibration | None',
    plans: Sequence[Path],
    positions: bool,
    stream: TextIO,
) -> None:
    from ..diagnosis.calibration.plan_text import table_text, trajectory_text
    from ..diagnosis.calibration.proposal import propose_poses
    from ..output_file import write_file

    proposed = propose_poses(arm, count, after, positions)
    for file in plans:
        text = table_text if file.suffix.lower() == '.csv' else trajectory_text
        write_file(file, text(proposed))
        print(f'wrote {file}: {count} poses', file=stream)
    if not plans:
        print(table_text(proposed), end='', file=stream)


def _words(text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(',') if word.strip())


def _fitted(fit: str | None) -> tuple[str, ...]:
    words = _words(fit or '')
    if fit is not None and not words:
        raise WrongUsage('--fit names nothing; without it all but gears are fitted')
    return words


def _touched(
    files: Sequence[Path],
    reading: 'Selection',
    column: str,
    wanted: _Wanted,
    distances: dict[tuple[str, str], float],
    tell: Callable[[str], None],
) -> _Calibrated:
    import numpy as np

    from ..diagnosis.calibration.calibration import calibrate as calibrated
    from ..diagnosis.calibration.touches_reading import read_touches

    given = [read_touches(file, reading, column) for file in files]
    q = np.concatenate([one.q for one in given])
    marks = [mark for one in given for mark in one.points]
    found = calibrated(
        reading.robot,
        q,
        same_point=marks,
        apart=distances,
        progress=tell,
        **wanted.fitting(reading.robot),
    )
    points = {one.name: one.position for one in found.points}
    poses = np.tile(np.eye(4), (len(q), 1, 1))
    poses[:, :3, 3] = [points[mark] for mark in marks]
    remarks = [remark for one in given for remark in one.remarks]
    return _Calibrated(found, [one.file for one in given], remarks, q, poses)


def _heard(
    arm: 'Robot',
    topics: LiveOptions,
    wanted: _Wanted,
    stream: TextIO,
    ros_args: Sequence[str],
) -> _LivePoses:
    import numpy as np

    from ..diagnosis.calibration.calibration import calibrate as calibrated
    from ..errors import CalibrationError

    _check_names(arm, wanted)
    fitting = wanted.fitting(arm)

    def fitted(
        poses: 'CollectedPoses', tell: Callable[[str], None] = lambda phase: None
    ) -> 'Calibration':
        moves = np.max(np.abs(poses.rates)) > MOVING
        return calibrated(
            arm,
            poses.q,
            poses.poses,
            qdot=poses.rates if moves else None,
            own=wanted.own,
            progress=tell,
            **fitting,
        )

    poses = collected(arm, topics, fitted, stream, ros_args)
    if isinstance(poses, int):
        raise typer.Exit(poses)
    if not len(poses.q):
        raise CalibrationError(
            f'no pose of {topics.poses} with joint states of {topics.states} around its stamp '
            f'was heard within {topics.seconds:g} s'
        )
    files = [topics.states, topics.poses]

    def fit_all(tell: Callable[[str], None]) -> _Calibrated:
        return _Calibrated(fitted(poses, tell), files, [], poses.q, poses.poses)

    return _LivePoses(poses, fit_all)


def _check_names(arm: 'Robot', wanted: _Wanted) -> None:
    # What a calibration would refuse when all poses are there, before any of them.
    import numpy as np

    from ..diagnosis.calibration.checking import Measured
    from ..diagnosis.calibration.chosen_parameters import ChosenParameters, asks_for_gears
    from ..kinematics.uncertainty.parameters import parameters_of
    from ..robot.file.parts.parameters import ENDS
    from ..robot.loops import refuse_loops

    refuse_loops(arm.description, 'the calibration')
    for end in wanted.own:
        if end not in ENDS:
            raise WrongUsage(f'--own: {end!r} is not one of {", ".join(ENDS)}')
    q = np.zeros((1, arm.dof))
    given = Measured(q, np.eye(4)[None], False, np.zeros(1, dtype=np.int64), q)
    table = parameters_of(arm, asks_for_gears(wanted.fit)).table
    ChosenParameters(arm, given, wanted.own, table).fitted(wanted.fit, wanted.fix)


def _measured(
    files: Sequence[Path],
    reading: 'Selection',
    gap: float | None,
    wanted: _Wanted,
    tell: Callable[[str], None],
) -> _Calibrated:
    import numpy as np

    from ..diagnosis.calibration.calibration import calibrate as calibrated
    from ..diagnosis.calibration.reading import read_measured, without_lag
    from ..errors import CalibrationError
    from ..estimation.estimator import EstimatorSettings

    settings = EstimatorSettings(reading.joint_prefix)
    given = [
        without_lag(reading.robot, read_measured(file, reading, settings, gap)) for file in files
    ]
    if len({one.positions for one in given}) > 1:
        raise CalibrationError('some files have poses and others positions alone')
    rates = np.concatenate([one.rates for one in given])
    found = calibrated(
        reading.robot,
        np.concatenate([one.q for one in given]),
        np.concatenate([one.measured for one in given]),
        sets=np.repeat(np.arange(len(given)), [len(one.q) for one in given]),
        qdot=rates if np.max(np.abs(rates)) > MOVING else None,
        own=wanted.own,
        read=given[0].kind,
        progress=tell,
        **wanted.fitting(reading.robot),
    )
    remarks = [remark for one in given for remark in one.remarks]
    return _Calibrated(found, [one.file for one in given], remarks, given[0].q, given[0].poses)


def _tolerances(arm: 'Robot', limit: 'PoseLimit | None') -> dict[str, float]:
    # What the robot file says of single numbers holds beside the option.
    from ..kinematics.uncertainty.parameters import parameters_of

    if limit is None:
        return {}
    named = dict(arm.description.tolerances.named)
    return {
        one.name: limit.angle if one.angle else limit.position
        for one in parameters_of(arm).table
        if math.isfinite(limit.angle if one.angle else limit.position) and one.name not in named
    }


def _written(
    data: _Calibrated, robot: str, frames: FramesChoice, output: Path | None, anyway: bool
) -> str:
    # Writes the robot file, if it is one, and returns the line that says so.
    if output is None or not (data.found.accepted or anyway):
        return ''
    from ..output_file import write_file

    write_file(output, _text(data, robot, frames, anyway))
    return f'wrote {output}; next: python -m kinematics_service check {output}\n'


def _text(data: _Calibrated, robot: str, frames: FramesChoice, anyway: bool) -> str:
    from ..diagnosis.calibration.robot_text import CalibrationOrigin, calibrated_text

    date = datetime.now().astimezone().date().isoformat()
    names = ', '.join(Path(one).name for one in data.files)
    return calibrated_text(
        data.found,
        find_robot_file(robot).read_text(encoding='utf-8'),
        data.q,
        data.poses,
        CalibrationOrigin(names, date),
        frames.value,
        anyway,
    )


def _write_page(data: _Calibrated, html: Path, robot: str) -> None:
    from ..diagnosis.calibration.page.page import PageOrigin, page_of
    from ..output_file import write_file

    date = datetime.now().astimezone().isoformat(' ', 'seconds')
    origin = PageOrigin(tuple(data.files), str(find_robot_file(robot)), date, tuple(data.remarks))
    write_file(html, page_of(data.found, origin))


def _report(data: _Calibrated, json: Path | None, anyway: bool) -> None:
    from ..diagnosis.calibration.report import cells_of, document_of, kind_of, sentences_of
    from ..output_file import write_file
    from ..printing import Output, heading, json_text, plain, table

    found = data.found
    if json is not None:
        document = document_of(found, data.files)
        document['reading'] = data.remarks
        text = json_text(document)
        if str(json) == '-':
            print(text)
            return
        write_file(json, text + '\n')
    out = Output()
    names = ', '.join(data.files)
    first, *others = sentences_of(found)
    sentences = [first, *data.remarks, *others]
    if not found.accepted:
        file = 'written anyway' if anyway else 'no robot file is written without --anyway'
        out.print(plain(f'{sentences.pop(0)}; {file}.'), '')
    out.print(heading(f'{found.robot.name}: {found.count} {kind_of(found)} of {names}'), '')
    out.print(*(plain(f'  {sentence}.') for sentence in sentences), '')
    rows = table('  parameter', 'correction', 'deviation', '')
    for one in found.parameters:
        name, *cells = cells_of(one)
        rows.add_row(f'  {name}', *cells)
    out.print(rows)


@contextmanager
def _status() -> Iterator[Callable[[str], None]]:
    # Shows a line on standard error while it works, on a terminal only.
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _: None
        return
    with console.status('calibrating') as status:
        yield status.update
