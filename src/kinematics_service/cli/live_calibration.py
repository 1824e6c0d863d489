"""`calibrate --live`: poses of a running robot, and what they tell while they come."""

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple, TextIO

from ..diagnosis.calibration.calibration import Calibration
from ..diagnosis.calibration.collecting import CollectedPoses, table_of
from ..diagnosis.calibration.proposal import propose_poses
from ..errors import KinematicsError
from ..output_file import write_file
from ..robot.file.parts.parameters import TABLE_GROUPS
from ..robot.robot import Robot
from .missing_ros import ros_module
from .options import WrongUsage

# Topics where nothing else is said: those of a node without a namespace.
STATES, POSES = '/joint_states', '/kinematics/reference_pose'
LONGEST = 86_400.0


class LiveOptions(NamedTuple):
    """Topics, joint prefix and time (s) of the collecting, and poses proposed each time."""

    states: str
    poses: str
    joint_prefix: str
    seconds: float
    propose: int


def checked_seconds(seconds: float) -> float:
    """Return the time of the collecting, s; refuse one that is none."""
    if not 0.0 < seconds <= LONGEST:
        raise WrongUsage(f'--live: {seconds:g} s is not above 0 and at most {LONGEST:,.0f} s')
    return seconds


def collected(
    robot: Robot,
    options: LiveOptions,
    fitted: Callable[[CollectedPoses], Calibration],
    stream: TextIO,
    ros_args: Sequence[str],
) -> CollectedPoses | int:
    """Return the poses heard, or an exit code; lines for the user go to the stream."""
    session = ros_module('tools.calibration_session')

    def fit(poses: CollectedPoses) -> Any:
        found = fitted(poses)
        complete = found.known >= found.possible
        return session.LiveFit(tuple(_lines(robot, found, complete, options.propose)), complete)

    def say(line: str) -> None:
        print(line, file=stream, flush=True)

    topics = session.LiveTopics(options.states, options.poses)
    heard: CollectedPoses | int = session.collect_poses(
        robot, topics, options.joint_prefix, options.seconds, fit, say, ros_args
    )
    return heard


@contextmanager
def kept_when_refused(robot: Robot, poses: CollectedPoses) -> Iterator[None]:
    """Write the poses heard as a table if what follows fails: to hear them took minutes."""
    try:
        yield
    except BaseException:
        file = Path(f'heard_poses_{datetime.now().astimezone():%Y%m%d_%H%M%S}.csv')
        with suppress(KinematicsError):  # what failed comes first
            write_file(file, table_of(poses, robot.joint_names))
            told = f'the {len(poses.q)} poses heard are kept in {file}, which calibrate reads'
            print(told, file=sys.stderr)
        raise


def _lines(robot: Robot, found: Calibration, complete: bool, propose: int) -> Iterator[str]:
    yield f'{found.count} poses: {found.known} of {found.possible} combinations are identified'
    table = [one for one in found.parameters if one.group in TABLE_GROUPS]
    for words, known in (('identified', True), ('not yet, or not by itself', False)):
        names = ', '.join(one.name for one in table if one.identifiable == known)
        yield f'  {words}: {names or "none"}'
    if not found.accepted:
        yield f'  no calibration so far: {"; ".join(found.refusals)}'
    if complete:
        yield '  all that such poses identify is identified; more poses refine it; Ctrl-C ends it'
        return
    for q in propose_poses(robot, propose, found).q.tolist():
        values = (
            f'{x:.4f} m' if slides else f'{math.degrees(x):.1f} deg'
            for x, slides in zip(q, robot.prismatic)
        )
        yield f'  a pose that identifies more: {", ".join(values)}'
