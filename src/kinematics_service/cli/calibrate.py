"""The command `calibrate`: from the nominal table of an arm to this very one."""

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Optional, TextIO

import typer

from ..robot.bundled import find_robot_file
from .application import app
from .frame_options import LONGEST_GAP, FormatOption, GapOption, given_format, given_limit
from .options import RobotOption, WrongUsage, given_robot

if TYPE_CHECKING:
    from ..diagnosis.calibration.calibration import Calibration
    from ..diagnosis.calibration.reading import MeasuredRecording
    from ..diagnosis.frame_check import PoseLimit
    from ..estimation.estimator import EstimatorSettings
    from ..formats.recordings.source import Selection
    from ..robot.robot import Robot

HELP = """
Identify the numbers of an arm from measured poses of its tool, and write its robot file.

\b
Examples:
  kinematics_service calibrate tracker.csv --robot ur5e --output my_ur5e.yaml
  kinematics_service calibrate points.csv --robot ur5e --pose-format mm,position
  kinematics_service calibrate bag/ --robot arm.yaml --pose-topic /tracker/pose
  kinematics_service calibrate a.csv b.csv --robot ur5e --own base --json -
  kinematics_service calibrate run.csv --robot ur3e --fix base --frames measured
  kinematics_service calibrate --robot ur5e --propose 10 --plan next.yaml

\b
FILE has joint states and measured poses, as for audit: a bag, or a table
(.csv) with columns stamp, position.<joint>, pose.x and so on. The frame of
the poses and the tool frame or point measured need not be those of the robot
file: both are fitted, unless --fix names base or tool.

\b
--fit and --fix take groups or names, with commas:
  offsets, lengths, angles, base, tool, lag; theta2, d1, a3, alpha2, beta2, base.x

\b
Every number has a prior, --tolerance: what the poses do not tell stays where
it was. --propose names the poses to measure next, after those of FILE or
before any; they keep from limits and singular poses, but nothing is known of
the cell around: look at the motion first. --output is in the convention of
the robot file: each number is the nominal one and its correction, and
known_poses are the measured ones.

\b
Exit code 0: calibrated. 1: FILE cannot be read, or the frame check names a
mistake that is no matter of calibration. 2: wrong usage.
"""


PLANS = ('.csv', '.yaml', '.yml')
# A joint as fast (rad/s, m/s) as this makes a lag matter.
MOVING = 0.05


class FramesChoice(str, Enum):
    """Whose base and tool are written."""

    robot = 'robot'
    measured = 'measured'


@app.command(short_help="Identify an arm's numbers from measured poses.", help=HELP)
def calibrate(
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
    fit: Annotated[
        str, typer.Option(metavar='NAMES', help='Fit these alone.', show_default='all')
    ] = '',
    fix: Annotated[
        str, typer.Option(metavar='NAMES', help='Leave these as in the robot file.')
    ] = '',
    tolerance: Annotated[
        str,
        typer.Option(metavar='LIMIT', help='Usual errors of lengths and angles of the table.'),
    ] = '1mm,0.2deg',
    own: Annotated[
        str, typer.Option(metavar='NAMES', help='What each of several files has of its own.')
    ] = 'base',
    frames: Annotated[
        FramesChoice, typer.Option(help='Base and tool written: of the robot file, or measured.')
    ] = FramesChoice.robot,
    topic: Annotated[
        Optional[str],
        typer.Option(metavar='TOPIC', help='Topic of a bag; needed if it has several.'),
    ] = None,
    pose_topic: Annotated[
        Optional[str], typer.Option(metavar='TOPIC', help='Topic of PoseStamped messages.')
    ] = None,
    columns: Annotated[
        Optional[str],
        typer.Option(
            metavar='KEY=START,...',
            help='Beginnings of the column names: stamp=, position=, velocity=, pose=.',
        ),
    ] = None,
    joint_prefix: Annotated[
        str, typer.Option(metavar='TEXT', help='Put before the joint names of the robot file.')
    ] = '',
    pose_format: FormatOption = None,
    pose_gap: GapOption = None,
    propose: Annotated[
        Optional[int], typer.Option(metavar='N', help='Propose N poses to measure next.')
    ] = None,
    plan: Annotated[
        Optional[list[Path]],
        typer.Option(
            metavar='FILE', help='Write them: a table (.csv) or a JointTrajectory (.yaml).'
        ),
    ] = None,
    force: Annotated[bool, typer.Option('--force', help='Overwrite the output.')] = False,
) -> None:
    """Run the command; `HELP` is what its user reads."""
    plans = _plans(plan, propose)
    _check_outputs([*([] if output is None else [output]), *plans], force)
    arm = given_robot(robot)
    limit = given_limit('--tolerance', tolerance)
    form = given_format(pose_format)
    if pose_gap is not None and not 0.0 < pose_gap <= LONGEST_GAP:
        raise WrongUsage(f'--pose-gap: {pose_gap:g} is not within 0 and {LONGEST_GAP:g} s')
    if not files:
        if propose is None or output is not None or json is not None:
            raise WrongUsage('give FILE with measured poses, or --propose N alone')
        _propose(arm, propose, None, plans, form.kind == 'position', sys.stdout)
        return
    from ..estimation.estimator import EstimatorSettings
    from ..formats.recordings.source import Selection

    reading = Selection(arm, topic, pose_topic, columns, joint_prefix, form)
    settings = EstimatorSettings(joint_prefix)
    with _status() as tell:
        tell('reading')
        given = _read(files, reading, settings, pose_gap)
        found = _calibrated(
            arm,
            given,
            (_words(fit), _words(fix), _words(own)),
            limit,
            tell,
        )
        text = '' if output is None else _text(found, robot, given, frames)
    if output is not None:
        from ..robot.file.writer import replace_file

        replace_file(output, text)
    _report(found, given, json)
    report = sys.stderr if str(json) == '-' else sys.stdout
    if output is not None:
        print(f'wrote {output}; next: python -m kinematics_service check {output}', file=report)
    if propose is not None:
        _propose(arm, propose, found, plans, found.positions, report)


def _plans(plan: list[Path] | None, propose: int | None) -> list[Path]:
    if plan and propose is None:
        raise WrongUsage('--plan writes proposed poses: give --propose N too')
    for file in plan or []:
        if file.suffix.lower() not in PLANS:
            raise WrongUsage(f'--plan: {file} is neither a table (.csv) nor a plan (.yaml)')
    return plan or []


def _check_outputs(outputs: Sequence[Path], force: bool) -> None:
    for file in outputs:
        if file.exists() and not force:
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
    from ..robot.file.writer import replace_file

    proposed = propose_poses(arm, count, after, positions)
    for file in plans:
        text = table_text if file.suffix.lower() == '.csv' else trajectory_text
        replace_file(file, text(proposed))
        print(f'wrote {file}: {count} poses', file=stream)
    if not plans:
        print(table_text(proposed), end='', file=stream)


def _words(text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(',') if word.strip())


def _read(
    files: Sequence[Path],
    reading: 'Selection',
    settings: 'EstimatorSettings',
    gap: float | None,
) -> 'list[MeasuredRecording]':
    from ..diagnosis.calibration.reading import read_measured, without_lag

    given = [read_measured(file, reading, settings, gap) for file in files]
    return [without_lag(reading.robot, one) for one in given]


def _calibrated(
    arm: 'Robot',
    given: 'Sequence[MeasuredRecording]',
    names: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]],
    limit: 'PoseLimit',
    tell: Callable[[str], None],
) -> 'Calibration':
    import numpy as np

    from ..diagnosis.calibration.calibration import calibrate as calibrated
    from ..diagnosis.calibration.parameters import parameters_of
    from ..errors import CalibrationError

    if len({one.positions for one in given}) > 1:
        raise CalibrationError('some files have poses and others positions alone')
    fit, fix, own = names
    tolerances = {
        one.name: limit.angle if one.angle else limit.position
        for one in parameters_of(arm).table
        if math.isfinite(limit.angle if one.angle else limit.position)
    }
    rates = np.concatenate([one.rates for one in given])
    return calibrated(
        arm,
        np.concatenate([one.q for one in given]),
        np.concatenate([one.measured for one in given]),
        sets=np.repeat(np.arange(len(given)), [len(one.q) for one in given]),
        rates=rates if np.max(np.abs(rates)) > MOVING else None,
        own=own,
        fit=fit,
        fix=fix,
        tolerances=tolerances,
        progress=tell,
    )


def _text(
    found: 'Calibration', robot: str, given: 'Sequence[MeasuredRecording]', frames: FramesChoice
) -> str:
    from ..diagnosis.calibration.robot_text import CalibrationOrigin, calibrated_text

    date = datetime.now().astimezone().date().isoformat()
    names = ', '.join(Path(one.file).name for one in given)
    return calibrated_text(
        found,
        find_robot_file(robot).read_text(encoding='utf-8'),
        given[0].q,
        given[0].poses,
        CalibrationOrigin(names, date),
        frames.value,
    )


def _report(found: 'Calibration', given: 'Sequence[MeasuredRecording]', json: Path | None) -> None:
    from ..diagnosis.calibration.report import cells_of, document_of, sentences_of
    from ..printing import Output, heading, json_text, plain, table
    from ..robot.file.writer import replace_file

    if json is not None:
        document = document_of(found, [one.file for one in given])
        document['reading'] = [remark for one in given for remark in one.remarks]
        text = json_text(document)
        if str(json) == '-':
            print(text)
            return
        replace_file(json, text + '\n')
    out = Output()
    names = ', '.join(one.file for one in given)
    kind = 'positions' if found.positions else 'poses'
    out.print(heading(f'{found.robot.name}: {found.count} {kind} of {names}'), '')
    remarks = [remark for one in given for remark in one.remarks]
    out.print(*(plain(f'  {sentence}.') for sentence in (*remarks, *sentences_of(found))), '')
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
