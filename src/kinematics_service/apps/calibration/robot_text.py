# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write a calibration as a robot file: nominal numbers, corrections, and a certificate as comments.

The section `uncertainty` has the covariance of the calibrated numbers.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...errors import CalibrationError, KinematicsError, RobotFileWriteError
from ...kernel import Floats
from ...kinematics.forward import forward_kinematics
from ...kinematics.uncertainty.arm_errors import named_errors
from ...rigid_motion import inverse
from ...robot.file.parts.description import RobotDescription
from ...robot.file.parts.parameters import ENDS, GEARS, ArmParameter
from ...robot.file.reader import parse_robot
from ...robot.robot import Robot, build_robot
from ...typography import number_text
from ...version import __version__
from ..checking.errors import ERROR_LIMIT
from . import corrections
from .camera import ON_TOOL
from .checking import ROUND_OFF
from .file_sections import (
    constants_section,
    links_section,
    placement_section,
    points_section,
    singularity_section,
    with_sections,
)
from .fitting import outlier_limit, widened
from .identified_table import calibrated_errors
from .report import facts_of
from .result import Calibration

# Number of known poses in the written file.
KNOWN_POSE_COUNT = 5
MAX_SOURCE_LENGTH = 2000

# The covariance of the table's numbers is written as a factor L (covariance L L^T), with this
# number of digits. Few digits are not enough, because the standard deviations of poses may be far
# smaller than those of single numbers of the table.
DIGITS = 6
# An entry x of the factor L (covariance L L^T) is written as zero if |x| <= NEGLIGIBLE_RATIO * r.
# Here r is the norm of the row of L that contains x.
NEGLIGIBLE_RATIO = 1e-7
OF_JOINTS = ('encoder_noise', 'encoder_resolution', 'backlash', 'velocity_noise')

Frames = Literal['robot', 'measured']


@dataclass(frozen=True)
class CalibrationOrigin:
    """The origin of a calibration: the names of the measured files as text, and the date."""

    data: str
    date: str


def calibrated_text(
    result: Calibration,
    text: str,
    q: Floats,
    poses: Floats,
    origin: CalibrationOrigin,
    frames: Frames = 'robot',
    anyway: bool = False,
) -> str:
    """
    Return the text of the robot file of a calibration.

    Every corrected number is written as the nominal number plus its correction. The section
    `known_poses` has some of the measured poses. Singular factors of the nominal table are marked
    as approximate. The section `uncertainty` has the covariance of the fit.

    Parameters
    ----------
    result
        The calibration.
    text
        The text of the nominal robot file.
    q, poses : shapes (N, n) and (N, 4, 4)
        Joint positions and poses of the first set of measured poses.
    origin
        Names of the measured files, and the date. Both are written into the robot file.
    frames
        `robot`: base and tool stay as in the file. `measured`: the frame in which the poses of the
        first set were measured becomes the base, and the frame whose poses were measured
        becomes the tool.
    anyway
        Whether to write a refused calibration; then the first line of the file says that it is
        refused.

    Raises
    ------
    CalibrationError
        The calibration is refused.
    RobotFileWriteError
        The keys of `text` are in braces, or the written text describes another robot than the
        calibrated one.
    """
    if not (result.accepted or anyway):
        message = f'this is no calibration: {"; ".join(result.refusals)}'
        raise CalibrationError(message, code='not-accepted')
    description = result.robot.description
    robot = placed_robot(result, frames)
    factors = robot.description.singularity.factors
    parts = description.source, f'calibrated from {origin.data}, {origin.date}'
    source = '; '.join(part for part in parts if part)[:MAX_SOURCE_LENGTH]
    sections: dict[str, Sequence[str] | None] = {
        'source': [f'source: {json.dumps(source, ensure_ascii=False)}'],
        # None removes the section `tolerance`, because tolerances describe the nominal table, not
        # the calibrated table.
        'tolerance': None,
        'links': links_section(robot.description.links),
        'singularity': singularity_section(text, factors, corrections.task_of(result.robot) or ()),
    }
    if robot.description.points:
        sections['points'] = points_section(robot.description.points)
    if frames == 'measured':
        for end in ENDS:
            sections[end] = placement_section(end, getattr(robot.description, end), 'as measured')
    sections['uncertainty'] = uncertainty_section(result, robot, frames == 'measured')
    sections['known_poses'] = _known_poses(result, robot, q, poses, frames)
    output = with_sections(text, sections, certificate(result, robot, origin, frames))
    output, written = _without_unused_constants(output, description)
    read = build_robot(written)
    apart = np.abs(forward_kinematics(read, q) - forward_kinematics(robot, q)).max()
    if not apart < ROUND_OFF:
        message = f'the text written is {apart:.2g} m from what was found'
        raise RobotFileWriteError(message, code='mismatch')
    return output


def _without_unused_constants(
    text: str, nominal: RobotDescription
) -> tuple[str, RobotDescription]:
    # Remove constants of the robot file that only the old base, tool or singular factors used.
    # Repeat this, because a removed constant may have been the only user of another constant.
    # Return the new text and its robot description.
    def unused(description: RobotDescription) -> list[str]:
        keys = {warning.where for warning in description.warnings}
        return [entry.name for entry in description.constants if f'constants.{entry.name}' in keys]

    before = unused(nominal)
    read = parse_robot(text, nominal.file)
    while more := [k for k in unused(read) if k not in before]:
        text = with_sections(text, {'constants': constants_section(text, more)})
        read = parse_robot(text, nominal.file)
    return text, read


def placed_robot(result: Calibration, frames: Frames) -> Robot:
    """
    Return the calibrated robot with base and tool of the robot file, or with those of the measured
    poses. `frames` selects one of the two.
    """
    if frames == 'robot':
        return result.calibrated
    if result.positions:
        raise CalibrationError(
            'the axes of the tool are not identifiable from positions: its frame stays that of '
            'the file',
            code='no-orientations',
        )
    description = result.calibrated.description
    base = result.base_offsets[0] @ description.base.motion.matrix
    tool = description.tool.motion.matrix @ result.tool_offsets[0]
    placed = corrections.with_ends(description, base, tool)
    try:
        return build_robot(placed)
    except KinematicsError:
        # The singular poses of an arm with few joints depend on the tool frame. With the measured
        # tool frame, the singular factors of the file hold only approximately.
        return corrections.built_nearly(placed)


def certificate(
    result: Calibration, robot: Robot, origin: CalibrationOrigin, frames: Frames
) -> list[str]:
    """
    Return the comment lines at the head of the robot file. They describe the measured data, the
    fit and its results.

    Parameters
    ----------
    robot
        The robot that the file describes.
    """
    left_out = f', {len(result.outliers)} left out as outliers' if result.outliers else ''
    of_points = f' of {", ".join(point.name for point in result.points)}' if result.points else ''
    no_factors = 'The singular factors of the nominal table do not hold here and are left out.'
    nearly = 'The singular factors are those of the nominal table: approximate here, they name '
    nearly += 'what is near and are not counted on for distances.'
    facts = [
        *(f'NO CALIBRATION, written anyway: {refusal}' for refusal in result.refusals),
        f'Calibrated by kinematics_service {__version__} on {origin.date}.',
        f'data: {origin.data}, {result.count} {result.kind}{of_points}{left_out}',
        *facts_of(result),
        f'Base and tool: {"those of the nominal file" if frames == "robot" else "as measured"}',
        'A number of the table is the nominal one and its correction. Rows without a joint that',
        'the nominal table does not have are extra angles between parallel axes.',
    ]
    written = robot.description.singularity.factors
    if result.robot.description.singularity.factors and not written:
        facts.append(no_factors)
    elif any(factor.approximate for factor in written):
        facts.append(nearly)
    return [f'# {fact}' for fact in facts]


def _known_poses(
    result: Calibration, robot: Robot, q: Floats, poses: Floats, frames: Frames
) -> list[str]:
    # Return the lines of the section `known_poses`. It has some evenly spaced measured poses,
    # written as poses of the tool in the base frame of the written file.
    X, Y = result.base_offsets[0], result.tool_offsets[0]
    # If the calibration is accepted, leave out the outliers. If it is refused, take all
    # measurements.
    outliers = set(result.outliers) if result.accepted else set()
    rows = np.array([k for k in range(len(q)) if k not in outliers])
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, KNOWN_POSE_COUNT).astype(int))]
    expected = forward_kinematics(robot, q[rows])
    T = poses[rows]
    if result.positions:
        # Only positions of a point of the tool were measured, so compute the origin of the tool
        # from this point and the calibrated orientation.
        point = (np.linalg.inv(X) @ poses[rows])[:, :3, 3]
        T = expected.copy()
        T[:, :3, 3] = point - T[:, :3, :3] @ Y[:3, 3]
    elif frames == 'robot':
        T = np.linalg.inv(X) @ T @ np.linalg.inv(Y)

    description = robot.description
    length, angle = _tolerances(result, poses[rows], frames)
    bounds = f'xyz: {_scaled(length, False, description, 2)}'
    if not result.positions:
        bounds += f', rpy: {_scaled(angle, True, description, 2)}'
    lines = [f'known_poses:  # {"the tip touched a point" if result.points else "measured"}']
    for joints, pose in zip(q[rows].tolist(), T):
        turns = zip(joints, ~robot.prismatic)
        at = [number_text(corrections.in_file_units(x, turn, description)) for x, turn in turns]
        six = corrections.rigid_motion(pose, description).texts
        entry = f'q: [{", ".join(at)}], xyz: [{", ".join(six[:3])}]'
        entry += '' if result.positions else f', rpy: [{", ".join(six[3:])}]'
        lines.append(f'  - {{{entry}, tolerance: {{{bounds}}}}}')
    return lines


def _tolerances(result: Calibration, poses: Floats, frames: Frames) -> tuple[float, float]:
    # Return the tolerances (m, rad) of the known poses in the written file. A tolerance is the
    # outlier limit times the estimated noise, so that all used poses are within it. But a
    # tolerance is at most max(ERROR_LIMIT, outlier limit * noise of the instrument).
    known, limit = result.instrument or (0.0, 0.0), outlier_limit(2)
    length, angle = (
        limit * min(noise, max(bound / limit, of_instrument))
        for noise, bound, of_instrument in zip(result.noise, ERROR_LIMIT, known)
    )
    lever = 0.0
    if result.camera is not None:
        # `lever` is the distance from the measured point to the origin of the written pose. An
        # error of the rotation moves this origin by `lever` times the angle.
        seen = np.linalg.norm(poses[:, :3, 3], axis=1).max() if result.camera == ON_TOOL else 0.0
        beyond = inverse(result.tool_offsets[0])[:3, 3] if frames == 'robot' else np.zeros(3)
        lever = float(seen + np.linalg.norm(beyond))
    return max(math.hypot(length, lever * angle), ROUND_OFF), max(angle, ROUND_OFF)


def uncertainty_section(result: Calibration, robot: Robot, ends: bool) -> list[str]:
    """
    Return the lines of the section `uncertainty` of a robot file.

    Parameters
    ----------
    result
        The calibration.
    robot
        The robot that the file describes.
    ends
        Whether base and tool of the robot are those fitted to the measured poses. If so, the
        covariance includes the parameters of base and tool.
    """
    description = robot.description
    lines = ['uncertainty:']
    joints = corrections.of_joints_alone(result.robot.description.uncertainty)
    for key in OF_JOINTS if joints is not None else ():
        values = getattr(joints, key.removeprefix('encoder_'))
        if values is not None and any(values):
            turning = zip(values, ~robot.prismatic)
            texts = (_scaled(x, angle, description) for x, angle in turning)
            lines.append(f'  {key}: [{", ".join(texts)}]')
    noise = widened(result.noise, result.freedom)
    floor = f'xyz: {_scaled(noise.position, False, description)}'
    if not result.positions:
        floor += f', rpy: {_scaled(noise.rotation, True, description)}'
    lines.append(f'  floor: {{{floor}}}  # what the fit leaves of each number')
    parameters, factor = named_factor(result, robot, ends)
    if parameters:
        lines.append('  covariance:  # of these numbers, L L^T: a row of L each')
    for k, (parameter, row) in enumerate(zip(parameters, factor)):
        least = NEGLIGIBLE_RATIO * float(np.linalg.norm(row))
        numbers = (x if abs(x) > least else 0.0 for x in row[: k + 1].tolist())
        relative = parameter.group == GEARS
        texts = (_scaled(x, parameter.angle, None if relative else description) for x in numbers)
        lines.append(f'    {parameter.name}: [{", ".join(texts)}]')
    return lines


def named_factor(
    result: Calibration, robot: Robot, ends: bool
) -> tuple[tuple[ArmParameter, ...], Floats]:
    """
    Return the parameters of a calibrated table, and the lower triangular factor L of their
    covariance L L^T.

    A calibration gives the covariance of corrections of the nominal table. This function converts
    the covariance to the parameters of the calibrated table, which may have additional rows. Most
    corrections correspond to one parameter of the calibrated table. Each other correction moves
    the tool like a combination of several parameters, which is found by least squares.
    """
    errors, known = calibrated_errors(robot, result, ends), named_errors(robot)
    made_of = np.zeros((len(known.frames), len(errors.frames)))
    for column, (frame, screw, gear) in enumerate(zip(errors.frames, errors.screws, errors.gears)):
        in_frame = (known.gears == gear) & (known.frames == frame)
        same = in_frame & (np.abs(known.screws - screw).max(axis=1) < ROUND_OFF)
        free = np.flatnonzero(same & ~np.any(made_of, axis=1))
        if len(free):
            made_of[free[0], column] = 1.0
        else:
            rows = np.flatnonzero(in_frame)
            made_of[rows, column] = np.linalg.lstsq(known.screws[rows].T, screw, rcond=None)[0]
    factor = made_of @ errors.factor
    # Each row of the matrix `factor` belongs to a parameter. If a joint moves several rows of the
    # DH table, the gear ratio of the joint has several equal rows in `factor`. Keep only the
    # first of these equal rows.
    _, first = np.unique(known.of, return_index=True)
    kept = first[np.any(made_of[first], axis=1)]
    triangle = np.linalg.qr(factor[kept].T, mode='r')
    signs = np.where(np.diag(triangle) < 0.0, -1.0, 1.0)
    return tuple(known.parameters[known.of[k]] for k in kept), (signs[:, None] * triangle).T


def _scaled(
    value: float, angle: bool, description: RobotDescription | None, digits: int = DIGITS
) -> str:
    # Return a number (rad or m) as text in the units of the robot file; in rad or m if no
    # description is given.
    unit = 1.0
    if description is not None:
        unit = description.radians if angle else description.metres
    return number_text(float(f'{value / unit:.{digits}g}'))
