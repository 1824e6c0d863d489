"""A calibration written as a robot file: nominal numbers, corrections, and its certificate."""

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...errors import CalibrationError, KinematicsError, RobotFileWriteError
from ...kernel import Floats
from ...kinematics.forward import forward_kinematics
from ...rigid_motion import exact_rpy, inverse
from ...robot.file.parts.description import RobotDescription
from ...robot.file.parts.parameters import ENDS
from ...robot.file.reader import parse_robot
from ...robot.file.writing.sections import (
    constants_section,
    links_section,
    placement_section,
    points_section,
    singularity_section,
    tolerances_section,
    with_sections,
)
from ...robot.robot import Robot, build_robot, robot_from_text
from ...typography import number_text
from ...version import __version__
from ..checking.errors import MOST
from .camera import ON_TOOL
from .checking import ROUND_OFF, in_words
from .corrections import built_nearly, in_file_units, task_of, with_ends
from .fitting import outlier_limit
from .report import NO_BETTER
from .result import BLOCKS, Calibration
from .uncertainty_text import uncertainty_section

# Known poses written.
KNOWN_POSES = 5
LONGEST_SOURCE = 2000

Frames = Literal['robot', 'measured']


@dataclass(frozen=True)
class CalibrationOrigin:
    """Where a calibration is from: the files of its poses in words, and the date."""

    data: str
    date: str


def calibrated_text(
    found: Calibration,
    text: str,
    q: Floats,
    poses: Floats,
    origin: CalibrationOrigin,
    frames: Frames = 'robot',
    anyway: bool = False,
) -> str:
    """
    Return the robot file of a calibration.

    Every corrected number is written as the nominal one and what is added. Known poses are the
    measured ones. Singular factors, those of the nominal table, are marked as approximate. What
    the fit left open is the section `uncertainty`.

    Parameters
    ----------
    found
        The calibration.
    text
        The robot file it began with.
    q, poses : shapes (N, n) and (N, 4, 4)
        Those of its first set.
    origin
        For the certificate.
    frames
        `robot`: base and tool stay as in the file. `measured`: they are those of the poses, of
        the first set.
    anyway
        Whether it is written where it is no calibration, as its first line then says.

    Raises
    ------
    CalibrationError
        What was found is refused.
    RobotFileWriteError
        The text cannot be changed without touching what is not ours.
    """
    if not (found.accepted or anyway):
        raise CalibrationError(f'this is no calibration: {"; ".join(found.refusals)}')
    description = found.robot.description
    robot = placed_robot(found, frames)
    factors = robot.description.singularity.factors
    links = links_section(robot.description.links)
    sections: dict[str, Sequence[str] | None] = {
        'source': [f'source: {json.dumps(_source(description, origin), ensure_ascii=False)}'],
        'links': links,
        'singularity': singularity_section(text, factors, task_of(found.robot) or ()),
    }
    if robot.description.points:
        sections['points'] = points_section(robot.description.points)
    if robot.description.tolerances.named:
        sections['tolerance'] = tolerances_section(robot.description)
    if frames == 'measured':
        for end in ENDS:
            sections[end] = placement_section(end, getattr(robot.description, end), 'as measured')
    sections['uncertainty'] = uncertainty_section(found, robot, frames == 'measured')
    sections['known_poses'] = _known_poses(found, robot, q, poses, frames)
    result = with_sections(text, sections, certificate(found, robot, origin, frames))
    result = _without_unused_constants(result, description)
    read = robot_from_text(result)
    apart = np.abs(forward_kinematics(read, q) - forward_kinematics(robot, q)).max()
    if not apart < ROUND_OFF:
        raise RobotFileWriteError(f'the text written is {apart:.2g} m from what was found')
    return result


def _without_unused_constants(text: str, nominal: RobotDescription) -> str:
    # What base, tool or factors alone used. Each goes after those that are made of it.
    before = set(_unused_constants(nominal))
    while unused := [
        k for k in _unused_constants(parse_robot(text, nominal.file)) if k not in before
    ]:
        text = with_sections(text, {'constants': constants_section(text, unused)})
    return text


def _unused_constants(description: RobotDescription) -> list[str]:
    names = [one.name for one in description.constants]
    unused = {one.where for one in description.warnings}
    return [name for name in names if f'constants.{name}' in unused]


def placed_robot(found: Calibration, frames: Frames) -> Robot:
    """Return the calibrated robot with base and tool of its own, or of the measured poses."""
    if frames == 'robot':
        return found.calibrated
    if found.positions:
        raise CalibrationError(
            'the axes of the tool are not identifiable from positions: its frame stays that of '
            'the file'
        )
    description = found.calibrated.description
    base = found.base_offsets[0] @ description.base.motion.matrix
    tool = description.tool.motion.matrix @ found.tool_offsets[0]
    placed = with_ends(description, base, tool)
    try:
        return build_robot(placed)
    except KinematicsError:
        # Another point of the tool is singular elsewhere, in an arm of few joints.
        return built_nearly(placed)


def certificate(
    found: Calibration, robot: Robot, origin: CalibrationOrigin, frames: Frames
) -> list[str]:
    """
    Return the comment lines that say what was measured, fitted and found.

    Parameters
    ----------
    robot
        The arm as it is written.
    """
    left_out = f', {len(found.outliers)} left out as outliers' if found.outliers else ''
    of_points = f' of {", ".join(one.name for one in found.points)}' if found.points else ''
    kind, rms = found.kind, found.rms_in_words
    ends = 'those of the nominal file' if frames == 'robot' else 'as measured'
    facts = [f'NO CALIBRATION, written anyway: {one}' for one in found.refusals]
    facts += [
        f'Calibrated by kinematics_service {__version__} on {origin.date}.',
        f'data: {origin.data}, {found.count} {kind}{of_points}{left_out}',
        f'error before ({found.placed} fitted): {rms(found.before)} rms; after: '
        f'{rms(found.after)}',
        f'error of held-out {kind} ({BLOCKS} blocks of rows): before '
        f'{rms(found.held_out_before)}; after {rms(found.held_out)}'
        f'{NO_BETTER if found.no_better else ""}',
        f'noise{"" if found.noise_told else " (assumed)"}: '
        f'{in_words(*found.noise, found.positions)} of each number of a {found.row}',
        f'identifiable from these {kind}: {found.known} independent combinations of '
        f'{len(found.parameters)} parameters; from any such {kind}: {found.possible}',
        f'base and tool: {ends}',
    ]
    facts += [one.sentence for one in found.combinations]
    facts += [
        'A number of the table is the nominal one and its correction. Rows without a joint that',
        'the nominal table does not have are extra angles between parallel axes.',
        *_on_factors(found, robot),
    ]
    return [f'# {fact}' for fact in facts]


def _on_factors(found: Calibration, robot: Robot) -> list[str]:
    if not found.robot.description.singularity.factors:
        return []
    written = robot.description.singularity.factors
    if not written:
        return ['The singular factors of the nominal table do not hold here and are left out.']
    if not any(one.approximate for one in written):
        return []
    return [
        'The singular factors are those of the nominal table: approximate here, they name what is',
        'near and are not counted on for distances.',
    ]


def _source(description: RobotDescription, origin: CalibrationOrigin) -> str:
    calibrated = f'calibrated from {origin.data}, {origin.date}'
    return '; '.join(part for part in (description.source, calibrated) if part)[:LONGEST_SOURCE]


def _known_poses(
    found: Calibration, robot: Robot, q: Floats, poses: Floats, frames: Frames
) -> list[str]:
    # Measured poses as those of this file's tool in its base frame, evenly spread.
    X, Y = found.base_offsets[0], found.tool_offsets[0]
    # Of what is refused rows count that contradict it.
    outliers = set(found.outliers) if found.accepted else set()
    rows = np.array([k for k in range(len(q)) if k not in outliers])
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, KNOWN_POSES).astype(int))]
    expected = forward_kinematics(robot, q[rows])
    T = poses[rows]
    if found.positions:
        # The point of the tool, brought to its origin by the calibrated orientation.
        point = (np.linalg.inv(X) @ poses[rows])[:, :3, 3]
        T = expected.copy()
        T[:, :3, 3] = point - T[:, :3, :3] @ Y[:3, 3]
    elif frames == 'robot':
        T = np.linalg.inv(X) @ T @ np.linalg.inv(Y)

    def in_units(number: float, angle: bool) -> float:
        return in_file_units(number, angle, robot.description)

    def shown(numbers: Iterable[float], angles: Iterable[bool]) -> str:
        return f'[{", ".join(map(number_text, map(in_units, numbers, angles)))}]'

    what = 'the tip touched a point' if found.points else 'measured'
    lines = [f'known_poses:  # {what}']
    length, angle = _tolerances(found, _lever(found, poses[rows], frames))
    bounds = f'xyz: {_rounded(in_units(length, False))}'
    if not found.positions:
        bounds += f', rpy: {_rounded(in_units(angle, True))}'
    for joints, pose in zip(q[rows].tolist(), T):
        entry = f'q: {shown(joints, ~robot.prismatic)}, '
        entry += f'xyz: {shown(pose[:3, 3].tolist(), [False] * 3)}, '
        if not found.positions:
            entry += f'rpy: {shown(exact_rpy(pose[:3, :3]), [True] * 3)}, '
        lines.append(f'  - {{{entry}tolerance: {{{bounds}}}}}')
    return lines


def _lever(found: Calibration, poses: Floats, frames: Frames) -> float:
    # How far (m) from the camera what is written is of what was seen in it: a turn moves that.
    if found.camera is None:
        return 0.0
    seen = np.linalg.norm(poses[:, :3, 3], axis=1).max() if found.camera == ON_TOOL else 0.0
    beyond = inverse(found.tool_offsets[0])[:3, 3] if frames == 'robot' else np.zeros(3)
    return float(seen + np.linalg.norm(beyond))


def _tolerances(found: Calibration, lever: float) -> tuple[float, float]:
    # What the noise of the measurement makes of a pose, so that none of those used is beyond. It
    # is estimated by what remains: no more than a calibration leaves is noise.
    known, limit = found.instrument or (0.0, 0.0), outlier_limit(2)
    length, angle = (
        limit * min(noise, max(most / limit, of_instrument))
        for noise, most, of_instrument in zip(found.noise, MOST, known)
    )
    return max(math.hypot(length, lever * angle), ROUND_OFF), max(angle, ROUND_OFF)


def _rounded(value: float) -> str:
    return number_text(float(f'{value:.2g}'))
