# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `audit`: judge a recording or a planned trajectory by the rules of the node."""

import sys
from collections.abc import Mapping
from datetime import datetime
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Annotated, Optional

import typer

from ....cli.options import OfOption, RobotOption, WrongUsage, ending_at, flag, given_robot, option
from ....errors import KinematicsError
from ....estimation.estimator import EstimatorSettings
from ....kinematics.servo_rule import ServoRule
from ....output_file import write_documents
from ....robot.measures import thresholds_for
from ....robot.robot import Robot, with_singularity
from ..audit.auditing import AuditSettings
from ..audit.dataset.episode_audit import EpisodeWork
from ..audit.report.audit_runs import Outcome, Run, outcomes
from ..audit.report.summary import print_summary
from ..audit.slowing import SlowingSettings
from ..datasets.episodes import is_dataset
from . import recording_options
from .dataset_audit import audit_dataset
from .frame_options import GapOption, given_frames
from .plan_options import given_plans

FAILURES = ('never', 'warn', 'stop', 'undecided', 'limits', 'speed', 'frames')


class VelocitySource(str, Enum):
    """The sources of joint velocities that `--velocity-source` accepts."""

    auto = 'auto'
    message = 'message'
    difference = 'difference'


def audit(
    files: Annotated[list[Path], typer.Argument(metavar='FILE...', help='Recordings or plans.')],
    robot: RobotOption,
    of: OfOption = None,
    topic: recording_options.TopicOption = None,
    pose_topic: Optional[str] = option(
        'Topic of measured poses: stamped poses, points or transforms; /tf:FRAME.', 'TOPIC'
    ),
    columns: recording_options.ColumnsOption = None,
    joint_format: recording_options.JointsOption = None,
    stamps: recording_options.StampsOption = None,
    html: Optional[Path] = option('Write a page with all curves.', 'FILE'),
    json: Optional[Path] = option('Write everything as JSON; - prints it.', 'FILE'),
    out: Optional[Path] = option('Write the topics the node would have published.', 'FILE.mcap'),
    fail_on: Optional[str] = option('When to exit with code 1: never, warn, stop, ...', 'LIST'),
    speed_limit: Optional[float] = option('Largest speed of the tool in a plan, m/s.', 'M/S'),
    speed_of: Optional[str] = option(
        'Also limit the speed of these points in a plan: frame numbers or joints.', 'POINT,...'
    ),
    scale: bool = flag('--scale', 'Show where ks.scale would slow the motion down, and why.'),
    reduced: bool = flag(
        '--reduced', 'Use the reduced speed limits of the robot file for --scale.'
    ),
    servo: bool = flag(
        '--servo', "Show where MoveIt Servo's singularity rule would slow the motion down."
    ),
    joint_prefix: recording_options.PrefixOption = '',
    velocity_source: VelocitySource = option(
        'Source of joint velocities, as for the node.', default=VelocitySource.auto
    ),
    timeout: float = option(
        'A pause between joint states longer than this is a gap.', 'SECONDS', default=1.0
    ),
    warn: Optional[float] = option('Threshold of WARN, instead of the one in the robot file.'),
    stop: Optional[float] = option('Threshold of ERROR, instead of the one in the robot file.'),
    pose_format: recording_options.FormatOption = None,
    pose_gap: GapOption = None,
    pose_warn: str = option(
        'RMS pose error, without constant offsets, that is a warning.',
        'LIMIT',
        default='4mm,0.5deg',
    ),
    pose_stop: str = option(
        'RMS pose error at which --fail-on frames fails.', 'LIMIT', default='20mm,2deg'
    ),
    jobs: Optional[int] = option('Number of files to audit at once.', 'N', shown='1'),
    workers: Optional[str] = option(
        'Let a dask cluster audit the files. Its workers must be able to read them.',
        'dask://HOST:PORT',
        shown='here',
    ),
    labels: Optional[Path] = option(
        'Write labels of each row of a dataset as parquet files.', 'DIR'
    ),
    clearance: bool = flag('--clearance', 'Add the clearance to the labels (slow).'),
) -> None:
    """
    Judge a recording of joint states, or a planned trajectory, as the node would have judged it:
    poses, twists, times near a singularity, limits, gaps, jumps, and whether a second source of
    poses agrees.

    \b
    Examples:
      kinematics_service audit run.mcap --robot ur5e --html run.html
      kinematics_service audit plan.yaml --robot arm.yaml --speed-limit 0.25
      kinematics_service audit bag/ --robot ur5e --pose-topic /tcp_pose --json -
      kinematics_service audit run.mcap --robot arm.yaml --scale --html run.html
      kinematics_service audit run.bag --robot panda --out run_kinematics.mcap
      kinematics_service audit shift/*.mcap --robot ur5e --jobs 4 --html pages/
      kinematics_service audit my_dataset --robot so101 --html dataset.html --jobs 4

    \b
    FILE is one of
      an MCAP file, a rosbag2 directory or .db3, a ROS 1 bag    (needs rosbags)
      a table (.csv): stamp,position.<joint>,velocity.<joint>, perhaps pose.x ...;
        what UR's RTDE recorder writes; other columns with --columns
      a JointTrajectory (.yaml, .json) as `ros2 topic echo` prints it, or in a bag
      a dataset: a folder of LeRobot (v2, v3), parquet, HDF5 or npz files with
        one episode or many                              (needs pyarrow, h5py)

    A plan is judged between its points too: it is proved to keep away from singular
    poses, or refuted by a pose of the plan, or not decided. This is no safety function.

    \b
    Each of several FILEs gets its own verdict; --html, --json and --out name
    folders, and the exit code is that of the worst.

    \b
    Exit code 0: judged. 1: FILE cannot be read or has no state of this robot, or
    --fail-on is met. 2: wrong usage. --fail-on is a list of
      warn, stop     the arm comes nearer to a singularity than the threshold of WARN,
                     or of ERROR
      undecided      it is neither proved nor refuted that a plan keeps away from
                     singular poses, or that its speed keeps below --speed-limit
      limits         a joint is beyond its position limits
      speed          a joint is above its velocity limit, or a plan above --speed-limit
      frames         no second source of tool poses is given, or it cannot be compared,
                     or measured and computed poses differ because of a fault that the
                     check names, such as a wrong joint order, or they still differ by
                     more than --pose-stop after correction by the best constant
                     offsets of base and tool
      never          the default for a recording; the default for a plan is
                     stop,undecided, and speed with --speed-limit
    An audit also fails, unless --fail-on is never, if a sample of a plan could not be
    judged, or a checksum of FILE is wrong.
    """
    failures = _failures(fail_on)
    if not 1e-3 <= timeout <= 3600.0:
        raise WrongUsage(f'--timeout: {timeout:g} s is not accepted; give 0.001 to 3600 s')
    if workers is not None and (jobs is not None or out is not None):
        raise WrongUsage('--workers cannot be combined with --jobs or --out; leave them out')
    if jobs is not None and jobs < 1:
        raise WrongUsage(f'--jobs: {jobs} is not accepted; give 1 or more')
    of_dataset = {'--labels': labels, '--clearance': clearance or None}
    slowed = scale or reduced or servo or None
    of_others = (out, topic, pose_topic, slowed, speed_limit, speed_of)
    dataset = _dataset_of(files, of_dataset, of_others)
    arm = _judged(ending_at(given_robot(robot), of), warn, stop)
    words = recording_options.TableWords(columns, pose_format, joint_format, stamps)
    reading = recording_options.given_selection(arm, topic, pose_topic, joint_prefix, words)
    settings = AuditSettings(
        EstimatorSettings(joint_prefix, velocity_source.value, round(timeout * 1e9)),
        given_frames(pose_gap, pose_warn, pose_stop),
        given_plans(arm, failures, speed_limit, speed_of),
        SlowingSettings(reduced, ServoRule() if servo else None) if slowed else None,
    )
    date = datetime.now().astimezone().isoformat(' ', 'seconds')
    if dataset is not None:
        work = EpisodeWork(reading, settings, failures, labels, clearance)
        audit_dataset(dataset, date, work, html, json, jobs or 1, workers)
        return
    paths = {
        'html': _paths('--html', html, files, '.html'),
        'json': _paths('--json', json, files, '.json'),
        'out': _paths('--out', out, files, '.mcap'),
    }
    for name, targets in paths.items():
        for path in targets:
            if path is not None and any(_belongs_to(path, file) for file in files):
                raise WrongUsage(f'--{name}: {path} is the recording itself; give another file')
    formats = html is not None, json is not None
    runs = [
        Run(file, robot, date, reading, settings, failures, *formats, target)
        for file, target in zip(files, paths['out'])
    ]
    failed = False
    for k, outcome in enumerate(outcomes(runs, jobs or 1, workers)):
        if k:
            print()
        _report(outcome, paths['html'][k], paths['json'][k])
        failed |= outcome.failed
    if failed:
        raise typer.Exit(1)


def _dataset_of(
    files: list[Path], of_dataset: Mapping[str, object], of_others: tuple[object, ...]
) -> Path | None:
    # Returns the dataset among the files, or None. Raises an error if options of datasets are
    # given for recordings, or options of recordings for a dataset.
    dataset = next((file for file in files if is_dataset(file)), None)
    if dataset is None:
        given = next((name for name, value in of_dataset.items() if value is not None), None)
        if given:
            raise WrongUsage(
                f'{given} is for datasets, and {files[0]} is not a dataset; leave it out'
            )
    elif len(files) > 1:
        raise WrongUsage(f'{dataset} is a dataset; give one dataset at a time')
    elif any(value is not None for value in of_others):
        raise WrongUsage(
            f'{dataset} is a dataset; leave out --out, --topic, --pose-topic, --scale, --reduced, '
            '--servo and --speed-..., which are for recordings and plans'
        )
    return dataset


def _failures(text: str | None) -> tuple[str, ...] | None:
    if text is None:
        return None
    words = tuple(word.strip() for word in text.split(',') if word.strip())
    for word in words:
        if word not in FAILURES:
            raise WrongUsage(f'--fail-on: {word!r} is not one of {", ".join(FAILURES)}')
    if not words or ('never' in words and len(words) > 1):
        raise WrongUsage(f'--fail-on: {text!r} is not accepted; give never alone, or other words')
    return words


def _judged(robot: Robot, warn: float | None, stop: float | None) -> Robot:
    if warn is None and stop is None:
        return robot
    defaults = robot.singularity.thresholds
    try:
        thresholds = thresholds_for(
            robot.singularity.task,
            defaults.measure,
            defaults.warn if warn is None else warn,
            defaults.stop if stop is None else stop,
        )
    except KinematicsError as error:
        raise WrongUsage(f'--warn, --stop: {error}') from None
    return with_singularity(robot, None, thresholds)


def _paths(option: str, given: Path | None, files: list[Path], suffix: str) -> list[Path | None]:
    # Returns the output file of each recording, as `given` by an option. If there are several
    # recordings, `given` must be a folder.
    several = len(files) > 1
    if given is None or not (several or given.is_dir()):
        return [given] * len(files)
    if str(given) == '-':
        raise WrongUsage(f'{option} - is for one recording; give a folder for {len(files)}')
    if given.exists() and not given.is_dir():
        raise WrongUsage(f'{option}: {given} is a file; give a folder for {len(files)} recordings')
    names = [(file.name if file.is_dir() else file.stem) + suffix for file in files]
    for name, file in zip(names, files):
        other = files[names.index(name)]
        if other is not file:
            raise WrongUsage(
                f'{option}: {other} and {file} would both be {given / name}; rename one of them'
            )
    try:
        given.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise WrongUsage(f'{option}: {given}: {error.strerror}') from None
    return [given / name for name in names]


def _belongs_to(path: Path, recording: Path) -> bool:
    # Returns whether writing an output file to `path` would overwrite the recording, or a file in
    # the folder of its bag.
    if not path.exists() or not recording.exists():
        return False
    parts = [recording, *(recording.iterdir() if recording.is_dir() else ())]
    return any(part.exists() and path.samefile(part) for part in parts)


def _report(outcome: Outcome, html: Path | None, json: Path | None) -> None:
    if outcome.summary is not None:
        report = partial(print_summary, outcome.summary)
        write_documents(html, outcome.html, json, outcome.json, report)
    if outcome.error:
        print(outcome.error, file=sys.stderr)
