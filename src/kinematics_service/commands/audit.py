"""
The command `audit`: a recording or a planned trajectory, judged as the node would have.

"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .options import RobotOption, WrongUsage, given_robot

if TYPE_CHECKING:
    from ..audit.auditing import Audit
    from ..robot import Robot

FAILURES = ('never', 'warn', 'stop', 'limits', 'frames')

HELP = """
Judge a recording of joint states, or a planned trajectory, as the node would have: poses, twists,
stretches near a singularity, limits, gaps, jumps, and whether a second source of poses agrees.

\b
Examples:
  kinematics_service audit run.mcap --robot ur5e --html run.html
  kinematics_service audit plan.yaml --robot arm.yaml
  kinematics_service audit bag/ --robot ur5e --pose-topic /tcp_pose --json -
  kinematics_service audit run.bag --robot panda --out run_kinematics.mcap

\b
FILE is one of
  an MCAP file, a rosbag2 directory or .db3, a ROS 1 bag    (needs rosbags)
  a table (.csv): stamp,position.<joint>,velocity.<joint>, perhaps pose.x ...;
    what UR's RTDE recorder writes; other columns with --columns
  a JointTrajectory (.yaml, .json) as `ros2 topic echo` prints it, or in a bag

\b
Exit code 0: judged. 1: FILE cannot be read or has no state of this robot, or
--fail-on is met. 2: wrong usage. --fail-on is a list of
  warn, stop     it comes nearer to a singularity than that threshold
  limits         a joint is beyond its limits
  frames         the second source of poses disagrees and the cause is found
  never          the default of a recording; that of a plan is stop
A plan that could not be judged in some sample, and a file whose checksum is
wrong, fail too, unless it says never.
"""


class VelocitySource(str, Enum):
    """
    Where joint velocities come from.

    """

    auto = 'auto'
    message = 'message'
    difference = 'difference'


def audit(
    file: Annotated[Path, typer.Argument(metavar='FILE', help='The recording or the plan.')],
    robot: RobotOption,
    topic: Annotated[
        str | None,
        typer.Option(metavar='TOPIC', help='Topic of a bag; needed where it has several.'),
    ] = None,
    pose_topic: Annotated[
        str | None,
        typer.Option(metavar='TOPIC', help='PoseStamped of the tool from elsewhere, to compare.'),
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            metavar='KEY=START,...',
            help='What columns of a table begin with: stamp=, position=, velocity=, pose=.',
        ),
    ] = None,
    html: Annotated[
        Path | None, typer.Option(metavar='FILE', help='Write a page with every curve.')
    ] = None,
    json: Annotated[
        Path | None, typer.Option(metavar='FILE', help='Write everything as JSON; - prints it.')
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar='FILE.mcap', help='Write the topics the node would have published.'),
    ] = None,
    fail_on: Annotated[
        str | None,
        typer.Option(metavar='LIST', help='When to exit with code 1: never, warn, stop, ...'),
    ] = None,
    joint_prefix: Annotated[
        str, typer.Option(metavar='TEXT', help='Put before the joint names of the robot file.')
    ] = '',
    velocity_source: Annotated[
        VelocitySource, typer.Option(help='Joint velocities, as the parameter of the node.')
    ] = VelocitySource.auto,
    timeout: Annotated[
        float, typer.Option(metavar='SECONDS', help='The parameter joint_state_timeout.')
    ] = 1.0,
    warn: Annotated[
        float | None, typer.Option(help='Threshold of WARN, instead of that of the robot file.')
    ] = None,
    stop: Annotated[float | None, typer.Option(help='Threshold of ERROR, likewise.')] = None,
) -> None:
    """
    Run the command; `HELP` is what its user reads.

    """
    wanted = _failures(fail_on)
    if not 1e-3 <= timeout <= 3600.0:
        raise WrongUsage(f'--timeout: {timeout:g} is not within 0.001 and 3600 s')
    for option, path in (('--html', html), ('--out', out)):
        if path is not None and path.resolve() == file.resolve():
            raise WrongUsage(f'{option}: {path} is the recording itself')
    arm = _judged(given_robot(robot), warn, stop)
    finished = _run(
        file, arm, topic, pose_topic, columns, out, joint_prefix, velocity_source.value, timeout
    )
    _write(finished, html, json)
    if _failed(finished, wanted):
        raise typer.Exit(1)


def _failures(text: str | None) -> tuple[str, ...] | None:
    if text is None:
        return None
    wanted = tuple(word.strip() for word in text.split(',') if word.strip())
    for word in wanted:
        if word not in FAILURES:
            raise WrongUsage(f'--fail-on: {word!r} is not one of {", ".join(FAILURES)}')
    if not wanted or ('never' in wanted and len(wanted) > 1):
        raise WrongUsage('--fail-on: name what is a failure, or never')
    return wanted


def _judged(robot: 'Robot', warn: float | None, stop: float | None) -> 'Robot':
    if warn is None and stop is None:
        return robot
    from ..errors import KinematicsError
    from ..measures import thresholds_for
    from ..robot import with_singularity

    own = robot.thresholds
    try:
        thresholds = thresholds_for(
            robot.task,
            own.measure,
            own.warn if warn is None else warn,
            own.stop if stop is None else stop,
        )
    except KinematicsError as error:
        raise WrongUsage(f'--warn, --stop: {error}') from None
    return with_singularity(robot, None, thresholds)


def _run(
    file: Path,
    robot: 'Robot',
    topic: str | None,
    pose_topic: str | None,
    columns: str | None,
    out: Path | None,
    joint_prefix: str,
    velocity_source: str,
    timeout: float,
) -> 'Audit':
    from ..audit.auditing import Listener
    from ..audit.auditing import audit as audited
    from ..audit.source import Wanted, open_source
    from ..estimator import EstimatorSettings

    settings = EstimatorSettings(joint_prefix, velocity_source, round(timeout * 1e9))
    with ExitStack() as stack:
        reading = Wanted(robot, topic, pose_topic, columns, joint_prefix)
        source = stack.enter_context(open_source(file, reading))
        part: Callable[[Any], None] = lambda _: None  # noqa: E731
        if out is not None:
            from ..audit.bag_writer import open_writer

            part = stack.enter_context(open_writer(out, robot, joint_prefix)).write
        progress = stack.enter_context(_progress(source.total))
        return audited(source, robot, str(file), settings, Listener(progress, part))


@contextmanager
def _progress(total: int | None) -> Iterator[Callable[[int], None]]:
    # A bar on standard error while it works, on a terminal only; gone when it is done.
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _: None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task('messages', total=total)
        yield lambda messages: bar.advance(task, messages)


def _write(finished: 'Audit', html: Path | None, json: Path | None) -> None:
    from ..audit.document import document_of
    from ..audit.page import page_of
    from ..audit.summary import print_summary
    from ..printing import json_text
    from ..robot_file_writer import replace_file

    if html is not None:
        replace_file(html, page_of(finished))
    if json is not None and str(json) != '-':
        replace_file(json, json_text(document_of(finished)) + '\n')
    if json is not None and str(json) == '-':
        print(json_text(document_of(finished)))
    else:
        print_summary(finished)


def _failed(finished: 'Audit', wanted: tuple[str, ...] | None) -> bool:
    from ..measures import Level

    wanted = wanted or (('stop',) if finished.planned else ('never',))
    worst = max((stretch.level for stretch in finished.stretches), default=Level.OK)
    frames = finished.frames
    met = {
        'never': False,
        'warn': worst >= Level.WARN,
        'stop': worst >= Level.ERROR,
        'limits': any(joint.beyond for joint in finished.joints),
        'frames': frames is not None and frames.diagnosis.cause is not None,
    }
    # What could not be judged is not fine: samples of a plan, or a damaged file.
    unjudged = finished.damaged or (finished.planned and bool(finished.refused))
    return (unjudged and wanted != ('never',)) or any(met[word] for word in wanted)
