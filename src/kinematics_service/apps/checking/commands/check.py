# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `check`: find faults of robot files, and print the robots that they describe."""

import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from rich.table import Table

from ....cli.options import JsonOption, doubt_text, flag, robots_like
from ....cli.robots import joint_letters
from ....cli.singularity_report import DEGREES, threshold_words
from ....errors import Fault, KinematicsError, RobotFileError
from ....estimation.status_text import structure_in_words
from ....kernel import Floats
from ....kinematics.tool_state import evaluate
from ....printing import Output, attributes, facts, heading, json_text, plain, table
from ....robot.closed_poses import tried_poses
from ....robot.file.parts.convention_table import CONVENTIONS
from ....robot.file.parts.description import PassiveJoint, Placement, PointDescription
from ....robot.file.parts.loop_groups import group_name, loop_groups, passive_of
from ....robot.robot import Robot, robot_in_letters
from ....robot.task import SEEDED_POSES, seeded_poses
from ..accuracy_report import tolerances_in_words, uncertainty_in_words
from ..known_pose_causes import pose_causes
from ..known_poses import PoseError, pose_errors, pose_faults
from ..loop_branches import other_branches
from ..textbook_table import motion_text, textbook_table

# Largest number of loop branches that are printed for one group of loops.
BRANCHES_SHOWN = 4

Files = Annotated[
    list[str],
    typer.Argument(
        metavar='FILE...',
        help='Robot files, or names of bundled robots; also with --robot.',
        autocompletion=robots_like,
    ),
]


class FileCheck(NamedTuple):
    """
    The result of checking one robot file. `robot` is None if the file cannot be read; `errors` are
    the errors of the arm at the known poses of the file.
    """

    robot: Robot | None
    faults: Sequence[Fault]
    warnings: Sequence[Fault] = ()
    errors: Sequence[PoseError] = ()


def check(
    files: Files,
    strict: bool = flag('--strict', 'Exit with code 1 also for warnings.'),
    json: JsonOption = False,
) -> None:
    """
    Check robot files, and print what they say: the table as in a textbook, the joints, and
    properties that the arm has at every pose.

    \b
    Examples:
      kinematics_service check my_robot.yaml
      kinematics_service check puma560 ur5e config/*.yaml > report.txt
      kinematics_service check --strict my_robot.yaml
      kinematics_service check --json my_robot.yaml

    All faults of a file are reported at once, on standard error, as file:line: where: message. If
    the table gives another pose than a known pose of the file, this is a fault, too. The exit code
    is 1 if any file has a fault; the other files are still checked. Values that are allowed but
    most likely wrong, such as a link of 250 m, are reported on standard error with WARN; with
    --strict they make the exit code 1, too.

    \b
    The keys of --json: `files`, a list. Each object of the list has the keys:
      file, robot             the file as given; the robot's name, or null
      faults, warnings        objects: line (0: none can be named), where, message
    Further keys, unless `robot` is null:
      dof, joint_names, joint_types, convention
      reach, length           m
      task_rows               rows of the Jacobian in which the arm can move
      generic_rank            rank of these rows at poses that are not singular
      known_poses             objects: index, agrees
    """
    out, results = Output(), []
    for file in files:
        results.append(_checked(file))
        if not json:
            _print_check(out, results[-1])
    faulty, doubtful = (sum(map(bool, column)) for column in zip(*(row[1:3] for row in results)))
    if json:
        print(json_text({'files': [_entry(*row) for row in zip(files, results)]}))
    elif len(files) > 1:
        counts = [f'{faulty} of them with faults' if faulty else 'no faults']
        counts += [f'{doubtful} with warnings'] if doubtful else []
        out.print(heading(f'{len(files)} files checked, {", ".join(counts)}'))
    if faulty or (strict and doubtful):
        raise typer.Exit(1)


def _checked(file: str) -> FileCheck:
    try:
        robot = robot_in_letters(file)
    except RobotFileError as error:
        return FileCheck(None, error.faults)
    except KinematicsError as error:
        return FileCheck(None, [Fault('', 0, '', str(error), error.code)])
    if robot.description.letters:  # with letters instead of numbers, poses cannot be computed
        return FileCheck(robot, (), robot.description.warnings)
    errors = pose_errors(robot)
    faults = pose_faults(robot, errors)
    if faults and (cause := str(pose_causes(robot))):
        faults = (*faults, Fault(robot.description.file, 0, 'known_poses', cause, 'cause'))
    return FileCheck(robot, faults, robot.description.warnings, errors)


def _print_check(out: Output, result: FileCheck) -> None:
    if result.robot is not None:
        _print_robot(out, result.robot)
        _print_arm(out, result.robot, result.errors)
    lines = [*map(doubt_text, result.warnings), *map(str, result.faults)]
    if lines:
        # Flush stdout first, so that the lines are in order if both streams show on one screen.
        sys.stdout.flush()
        print(plain('\n'.join(lines)), file=sys.stderr)


def _entry(file: str, result: FileCheck) -> dict[str, Any]:
    robot, fields = result.robot, ('line', 'where', 'message', 'code')
    entry: dict[str, Any] = {
        'file': file,
        'robot': None if robot is None else robot.name,
        'faults': [attributes(fault, *fields) for fault in result.faults],
        'warnings': [attributes(doubt, *fields) for doubt in result.warnings],
    }
    if robot is not None:
        entry |= attributes(robot, 'dof', 'joint_names', 'joint_types', 'convention')
        entry |= attributes(robot.singularity.task, 'reach', 'length', 'generic_rank')
        if robot.description.letters:
            entry |= {'reach': None, 'length': None}
        entry['task_rows'] = robot.singularity.task.rows
        entry['known_poses'] = [
            {'index': error.index, 'agrees': error.share <= 1.0} for error in result.errors
        ]
    return entry


def _print_robot(out: Output, robot: Robot) -> None:
    description, convention = robot.description, CONVENTIONS[robot.convention]
    units = f'{description.angle_unit}, {description.length_unit}'
    about = (
        ('source', robot.source or 'not said'),
        ('convention', convention.formula),
        ('units', '' if convention.product else units),
        ('constants', ', '.join(_constants(robot))),
    )
    title = heading(f'{robot.name} ({description.file})')
    out.print(title, facts(about), '', textbook_table(description), '', _joint_table(robot), '')


def _constants(robot: Robot) -> Iterator[str]:
    for constant in robot.description.constants:
        value = f' = {constant.value:.6g}' if _is_formula(constant.text) else ''
        text = f'{constant.name} = {constant.text}{value}'
        yield f'{constant.name} (no value)' if constant.letter else text


def _is_formula(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return True
    return False


def _joint_table(robot: Robot) -> Table:
    named_apart = robot.joint_names != robot.variables
    with_speeds = bool(np.isfinite(robot.velocity_limits).any())
    slides = bool(robot.prismatic.any())
    in_mm = robot.description.length_unit == 'mm'
    columns = {
        '  joint': [f'  {plain(name)}' for name in robot.joint_names],
        'variable': map(plain, robot.variables) if named_apart else None,
        'type': [
            f'{joint.type}, unused' if joint.unused else joint.type
            for joint in robot.description.joints
        ],
        'limits [rad, m]' if slides else 'limits [rad]': map(_range, robot.limits),
        'limits [deg, mm]' if slides and in_mm else 'limits [deg]': [
            ('' if not in_mm else _range(limits * 1000.0)) if slid else _range(limits * DEGREES)
            for limits, slid in zip(robot.limits, robot.prismatic)
        ],
        'rad/s, m/s' if slides else 'rad/s': [
            f'{speed:.4g}' if math.isfinite(speed) else 'none' for speed in robot.velocity_limits
        ]
        if with_speeds
        else None,
    }
    shown = {head: cells for head, cells in columns.items() if cells is not None}
    joints = table(*shown)
    for cells in zip(*shown.values()):
        joints.add_row(*cells)
    return joints


def _range(limits: Floats) -> str:
    low, high = limits
    if math.isinf(low) and math.isinf(high):
        return 'none'
    return f'{low:.4g} .. {high:.4g}'


def _print_arm(out: Output, robot: Robot, errors: Sequence[PoseError]) -> None:
    task, description = robot.singularity.task, robot.description
    unknown = f'needs the values of {description.letters}' if description.letters else ''
    full = min(len(task.rows), robot.dof)
    factors = (
        f'{factor.name} = {factor.text}{", approximate" if factor.approximate else ""}'
        for factor in description.singularity.factors
    )
    arm = (
        ('joints', f'{robot.dof}, {joint_letters(description.joints)} from the base'),
        ('base', _placement(description.base, "the table's frame 0")),
        ('tool', _placement(description.tool, "the last row's frame")),
        ('points', '\n'.join(map(_point, description.points))),
        (
            'reach',
            unknown or f'{task.reach:.4g} m from frame 0, the farthest of {SEEDED_POSES} poses',
        ),
        ('loops', '\n'.join(_loops(robot))),
        ('task', f'rows {" ".join(task.rows)} of the Jacobian'),
        ('length', unknown or f'{task.length:.4g} m, the characteristic length'),
        ('rank', f'{task.generic_rank} of {full} at almost every pose'),
        ('structure', _structure(robot)),
        ('measure', threshold_words(robot.singularity.thresholds)),
        ('singular factors', '\n'.join(factors)),
        ('uncertainty', '\n'.join(uncertainty_in_words(robot))),
        ('tolerance', tolerances_in_words(description.tolerances)),
        ('known poses', (description.known_poses and unknown) or _known(errors)),
        ('remarks', '\n'.join(description.remarks)),
    )
    out.print(facts(arm), '')


def _placement(placement: Placement, other: str) -> str:
    where = motion_text(placement.motion)
    return f'{placement.frame}, ' + (f'at {other}' if where == 'identity' else where)


def _point(point: PointDescription) -> str:
    frame = f'the frame after row {point.row}' if point.row else "the table's frame 0"
    where = motion_text(point.motion)
    return f'{point.name}, at {frame}' + ('' if where == 'identity' else f', {where}')


def _loops(robot: Robot) -> Iterator[str]:
    if not robot.description.loops:
        return
    start = robot.chain.closure.assembled()
    closure = evaluate(robot, start).closure
    assert closure is not None
    at = 0
    for g, group in enumerate(loop_groups(robot.description.loops)):
        passive = passive_of(group)
        values = closure.passive[at : at + len(passive)]
        at += len(passive)
        positions = _positions(passive, values, 6)
        move = 'moves' if len(group) == 1 else 'are closed together and move'
        rows = sum(len(loop.rows) for loop in group)
        yield (
            f'{group_name(group)} {move} {positions}: {rows} rows, {len(passive)} passive '
            f'joints; closed to {closure.residuals[g]:.1g}, det {closure.determinants[g]:.4g}'
        )
        yield f'  other branches there: {_branches(robot, g)}'
    q = seeded_poses(robot.limits, robot.prismatic)
    closed, tried = tried_poses(robot.chain, q)
    yield (
        f'{robot.dof} degrees of freedom, those of the joints; the loops close at '
        f'{len(closed)} of {tried} poses inside the limits'
    )


def _positions(joints: Sequence[PassiveJoint], values: Iterable[float], digits: int) -> str:
    return ', '.join(
        f'{joint.name} = {round(value, 12) + 0.0:.{digits}g}'
        for joint, value in zip(joints, values)
    )


def _branches(robot: Robot, g: int) -> str:
    branches = other_branches(robot.description, g)
    passive = passive_of(loop_groups(robot.description.loops)[g])
    texts = [_positions(passive, branch, 4) for branch in branches[:BRANCHES_SHOWN]]
    if len(branches) > BRANCHES_SHOWN:
        texts.append(f'{len(branches) - BRANCHES_SHOWN} more')
    return '; '.join(texts) or 'none was found'


def _structure(robot: Robot) -> str:
    task = robot.singularity.task
    if task.structurally_deficient or not task.dependent_joints:
        return structure_in_words(robot)
    joints = ' and '.join(task.dependent_joints)
    return f'{joints} can move at every pose without moving the task rows'


def _known(errors: Sequence[PoseError]) -> str:
    if not errors:
        return 'none in the file'
    worst = max(errors, key=lambda error: error.share)
    verdict = f'{sum(error.share <= 1.0 for error in errors)} of {len(errors)} agree'
    return f'{verdict}\nworst, known_poses[{worst.index}]: {worst}'
