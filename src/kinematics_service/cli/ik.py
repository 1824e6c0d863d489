# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `ik`: print joint positions that bring the tool to a pose or a position."""

import math
import re
import sys
from collections.abc import Iterator
from typing import Annotated, Any, Optional

import numpy as np
import typer

from ..kernel import Floats
from ..kinematics.inverse.problem.target import TOOL_AXES
from ..kinematics.inverse.result import OTHERS, IkFamily, IkResult, IkSolution
from ..kinematics.inverse.self_motion.arcs import IkArc
from ..kinematics.inverse.solve import TOLERANCE, inverse_kinematics
from ..printing import Output, attributes, facts, heading, json_text, number, plain
from ..rigid_motion import rotation_of_quaternion, rotation_of_roll_pitch_yaw
from ..robot.robot import Robot
from ..robot.task import ROW_NAMES
from . import options
from .singularity_report import DEGREES, arm_json

# For each method of inverse kinematics, the text that the output has for it.
HOW = {'closed form': 'in closed form', 'algebraic': 'by elimination', 'search': 'by search'}

RpyOption = Annotated[
    Optional[str],
    options.named(
        '--rpy',
        'Its orientation: roll, pitch, yaw; R = Rz(yaw) Ry(pitch) Rx(roll).',
        'NUMBERS',
        show_default='any orientation',
    ),
]
QuaternionOption = Annotated[
    Optional[str],
    options.named(
        '--quaternion', 'Its orientation: x, y, z, w.', 'NUMBERS', show_default='any orientation'
    ),
]
NearOption = Annotated[
    Optional[str],
    options.named(
        '--near',
        'Joint positions the solutions should be near.',
        'NUMBERS',
        show_default='the middle of the limits',
    ),
]


def ik(
    robot: options.RobotOption,
    xyz: str = options.option(
        'Position of the tool in the base frame, m.', 'NUMBERS', default=...
    ),
    rpy: RpyOption = None,
    quaternion: QuaternionOption = None,
    near: NearOption = None,
    rows: Optional[str] = options.option(
        'Match only these of x y z rx ry rz of the target, in the axes of frame 0.',
        'NAMES',
        shown='all of a pose, x y z of a position',
    ),
    axis: Optional[str] = options.option(
        'Match only the direction of this tool axis: x, y or z.',
        'AXIS',
        shown='the whole orientation',
    ),
    tolerance: float = options.option(
        'Largest pose error of a solution, m and rad.', default=TOLERANCE, least=0.0
    ),
    seed: int = options.option('Seed of the random starts of a search.', default=0, least=0),
    one: bool = options.flag('--one', 'Stop at the first solution found.'),
    everything: bool = options.flag('--all', 'Also print solutions outside the joint limits.'),
    family: bool = options.flag(
        '--family', 'Print the curves of solutions of an arm with one redundant joint.'
    ),
    deg: options.DegreesOption = False,
    json: options.JsonOption = False,
) -> None:
    """
    Print the joint positions that bring the tool to a pose, or only to a position, and whether it
    is proved that no others exist.

    \b
    Examples:
      kinematics_service ik --robot ur5e --xyz 0.3,-0.2,0.4 --rpy 180,0,90 --deg
      kinematics_service ik --robot craig_3r --xyz 0.4,0.1,-0.2 --near 0,0.5,0.5
      kinematics_service ik --robot puma560 --xyz=-0.3,0.4,0.9 --quaternion 0,0,0,1 --json
      kinematics_service ik --robot scara_hsr065 --xyz 0.4,0.1,0.2 --rows x,y --one
      kinematics_service ik --robot ur5e --xyz 0.3,-0.2,0.4 --rpy 180,0,0 --deg --axis z

    Positions that differ by full turns are one solution. The command prints the positions inside
    the limits that are nearest to --near (default: the middle of the limits). Each solution was
    checked by forward kinematics. If the arm can move without moving the tool, the solution is a
    family, printed at one of its positions. If no solution is inside the limits, the command
    prints the joint positions inside the limits that bring the tool nearest to the target. Then
    the exit code is 1.

    --axis is for arms of five joints: only the direction of this axis of the tool counts, not the
    whole orientation. Typed numbers are rounded. So a target counts as reached if the position
    error (m) and the rotation error (rad) are at most --tolerance. The residual combines the two
    errors.

    --family: an arm with one joint more than the target needs, for example seven for a pose, can
    move while the tool rests. The joint limits cut this motion into arcs. The command prints for
    each arc the joints and limits at which it ends, its length, the range of each joint, and the
    positions farthest from the limits. A search may miss arcs, so the key `complete` of --json has
    the value `found`, not `proved`.

    --one: the first solution found inside the limits, or the nearest one if the arm has a
    closed form. Without a closed form the search starts at --near; --seed gives other starts.

    \b
    The keys of --json, in m and rad; null: infinite or undefined:
      robot, base_frame, tool_frame, joint_names
      target, near                   4 rows of 4, or x y z; near may be null
      axis, tolerance                null, or x, y or z; m and rad
      status                         solved, family, outside_limits or unreachable
      reason, method                 a sentence; closed form, algebraic or search
      complete                       proved, found (no proof that these are all) or partial
      roots                          null, or numbers of complex solutions: found, and possible
      solutions                      objects: q, residual, feasible, beyond (names of
                                     joints outside their limits), margin (to the nearest
                                     limit), shoulder, elbow, wrist, multiplicity
      families                       the same keys, and motions (joint motions along the
                                     family, one in each row), straight, joints, closed, intervals
                                     (the arcs, with --family: each has q with a sample in each
                                     row, the length s up to each sample, length, closed, ends of
                                     joint and limit, windings, ranges, largest_margin)
      nearest                        null, or q, residual, position_error, rotation_error
    """
    if one and everything:
        raise options.WrongUsage('--one and --all exclude each other; give one of them')
    if one and family:
        raise options.WrongUsage('--one and --family exclude each other; give one of them')
    if axis is not None and (axis not in TOOL_AXES or (rpy is None and quaternion is None)):
        if axis in TOOL_AXES:
            raise options.WrongUsage('--axis needs a rotation; give --rpy or --quaternion as well')
        raise options.WrongUsage(
            f'--axis: unknown axis {axis!r} (accepted: {", ".join(TOOL_AXES)})'
        )
    arm = options.given_robot(robot)
    target = target_from(xyz, rpy, quaternion, deg)
    start = None if near is None else options.joint_values(arm, near, '--near', deg)
    result = inverse_kinematics(
        arm,
        target,
        near=start,
        respect_limits=not everything,
        rows=None if rows is None else _row_names(rows, target, axis),
        seed=seed,
        all_solutions=not one,
        axis=axis,
        tolerance=tolerance,
        curves=family,
    )
    if json:
        print(_document(arm, result, target, start, {'axis': axis, 'tolerance': tolerance}))
    else:
        _print_result(Output(), arm, result, start, deg)
    if result.status in ('outside_limits', 'unreachable'):
        raise typer.Exit(1)


def target_from(xyz: str, rpy: str | None, quaternion: str | None, degrees: bool) -> Floats:
    """
    Return the target in the options of `ik`: a position (3,), m, or a pose (4, 4).

    Raises
    ------
    WrongUsage
        An option has too many or too few numbers, or two options exclude each other.
    """
    position = options.given_numbers('--xyz', xyz, 3)
    if rpy is not None and quaternion is not None:
        raise options.WrongUsage('--rpy and --quaternion exclude each other; give one of them')
    if rpy is not None:
        angles = options.given_numbers('--rpy', rpy, 3, True, degrees)
        if not degrees and np.abs(angles).max() > math.tau:
            message = '--rpy is read in radians and looks like degrees: did you mean --deg?'
            print(message, file=sys.stderr)
        R = rotation_of_roll_pitch_yaw(angles)
    elif quaternion is not None:
        given = options.given_numbers('--quaternion', quaternion, 4)
        if abs(float(np.linalg.norm(given)) - 1.0) > 1e-3:
            raise options.WrongUsage(f'--quaternion: {quaternion} must have length 1')
        R = rotation_of_quaternion(given)
    else:
        return position
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = R, position
    return pose


def _row_names(text: str, target: Floats, axis: str | None) -> list[str]:
    accepted = ROW_NAMES if target.ndim == 2 and axis is None else ROW_NAMES[:3]
    names = re.split(r'\s*,\s*|\s+', text.strip())
    if set(names) - set(accepted):
        raise options.WrongUsage(f'--rows: unknown rows {text!r} (accepted: {" ".join(accepted)})')
    return names


def _document(
    robot: Robot,
    result: IkResult,
    target: Floats,
    near: Floats | None,
    settings: dict[str, Any],
) -> str:
    nearest = result.nearest
    return json_text(
        {
            **arm_json(robot),
            'target': target,
            'near': near,
            **settings,
            **attributes(result, 'status', 'reason', 'method', 'complete', 'roots'),
            'solutions': [
                {**_entry(solution), 'multiplicity': solution.multiplicity} for solution in result
            ],
            'families': [
                {
                    **_entry(family),
                    **attributes(family, 'motions', 'straight', 'joints', 'closed'),
                    'intervals': [_arc_entry(arc) for arc in family.intervals],
                }
                for family in result.families
            ],
            'nearest': None
            if nearest is None
            else attributes(nearest, 'q', 'residual', 'position_error', 'rotation_error'),
        }
    )


def _entry(solution: IkSolution | IkFamily) -> dict[str, Any]:
    return {
        **attributes(solution, 'q', 'residual', 'feasible', 'beyond', 'margin'),
        **attributes(solution.posture, 'shoulder', 'elbow', 'wrist'),
    }


def _arc_entry(arc: IkArc) -> dict[str, Any]:
    return {
        **attributes(arc, 'q', 's', 'length', 'closed', 'windings', 'ranges', 'ends'),
        'largest_margin': arc.with_largest_margin(),
    }


def _print_result(
    out: Output, robot: Robot, result: IkResult, near: Floats | None, degrees: bool
) -> None:
    method = HOW[result.method]
    out.print(
        heading(f'{robot.name}: {robot.tool_frame} to the target in {robot.base_frame}, {method}'),
        f'  {plain(result.reason)}{_completeness(result)}',
    )
    if result.solutions:
        order = f'nearest to {"the middle of the limits" if near is None else "--near"} first'
        units = ('deg' if degrees else 'rad') + (', m' if np.any(robot.prismatic) else '')
        worst = max(solution.residual for solution in result.solutions)
        out.print(
            f'  residuals up to {worst:.1e}',
            '',
            heading(f'     joints [{units}], {order}'),
            facts(_solution_rows(out, robot, result.solutions, degrees)),
        )
    for family in result.families:
        out.print('', facts(_family_words(robot, family, degrees)))
    nearest = result.nearest
    if nearest is None or result.status == 'family':
        return
    turned = nearest.rotation_error * (DEGREES if degrees else 1.0)
    errors = (
        ('nearest pose', f'{nearest.position_error:.4g} m off in position'),
        ('', f'{turned:.4g} {"deg" if degrees else "rad"} off in orientation'),
        ('at', _positions(robot, nearest.q, degrees)),
    )
    out.print('', facts(errors))


def _completeness(result: IkResult) -> str:
    curves = any(family.intervals for family in result.families)
    if result.complete == 'partial' or not (result.solutions or curves):
        return ''
    others = f'; {OTHERS[result.complete]}'
    if result.complete == 'found' or result.roots is None:
        return others
    count, bound = result.roots
    return f'{others} ({count} of {bound} complex ones found)'


def _solution_rows(
    out: Output, robot: Robot, solutions: tuple[IkSolution, ...], degrees: bool
) -> Iterator[tuple[str, str]]:
    # Yield the number and the text of each solution. The text has one line, or two lines on a
    # narrow terminal.
    rows = [_joint_texts(robot, solution.q, degrees) for solution in solutions]
    width = max(len(text) for row in rows for text in row)
    for k, (row, solution) in enumerate(zip(rows, solutions), 1):
        joints = '  '.join(text.rjust(width) for text in row)
        residual = '' if solution.exact else f'residual {solution.residual:.1e}'
        count = solution.multiplicity
        margin = _margin(robot, solution, degrees)
        times = {0: 'singular', 1: ''}.get(count, f'{count} in one')
        words = '; '.join(filter(None, (str(solution.posture), margin, residual, times)))
        fits = len(f'  {len(rows)}  {joints}  {words}') <= out.width
        yield str(k), f'{joints}{"  " if fits else chr(10)}{words}'


def _joint_texts(robot: Robot, q: Floats, degrees: bool) -> list[str]:
    return [
        number(x * DEGREES, 2) if turns and degrees else number(x, 4)
        for x, turns in zip(q.tolist(), ~robot.prismatic)
    ]


def _margin(robot: Robot, solution: IkSolution, degrees: bool) -> str:
    if solution.beyond:
        return f'beyond the limits of {", ".join(solution.beyond)}'
    lower, upper = robot.limits.T
    nearest = int(np.argmin(np.minimum(solution.q - lower, upper - solution.q)))
    if math.isinf(solution.margin):
        return ''
    if robot.prismatic[nearest]:
        return f'{solution.margin:.3g} m to a limit'
    margin = solution.margin * (DEGREES if degrees else 1.0)
    return f'{margin:.3g} {"deg" if degrees else "rad"} to a limit'


def _family_words(robot: Robot, family: IkFamily, degrees: bool) -> Iterator[tuple[str, str]]:
    kind = 'a straight line' if family.straight else 'a curve'
    if len(family.motions) > 1:
        kind = f'{len(family.motions)} dimensions'
    verb = 'moves' if len(family.joints) == 1 else 'move together'
    yield 'family', f'{kind}; {", ".join(family.joints)} {verb}'
    yield 'at', _positions(robot, family.q, degrees)
    for motion in family.motions:
        yield 'along', _positions(robot, motion, False)
    if family.beyond:
        yield '', f'beyond the limits of {", ".join(family.beyond)}'
    for k, arc in enumerate(family.intervals, 1):
        yield f'arc {k}', _arc_words(arc)
        low, high = (_joint_texts(robot, q, degrees) for q in arc.ranges.T)
        ranges = (f'{name} {a} .. {b}' for name, a, b in zip(robot.joint_names, low, high))
        yield '', '  '.join(ranges)
        best = _positions(robot, arc.with_largest_margin(), degrees)
        yield '', f'farthest from the limits: {best}'


def _arc_words(arc: IkArc) -> str:
    words = f'{arc.length:.4g} rad long'
    if arc.closed:
        words += ', closed'
    else:
        first, last = (
            f'the {end.limit} limit of {end.joint}' if end.joint else 'where it cannot be followed'
            for end in arc.ends
        )
        words += f', from {first} to {last}'
    if arc.windings > 1:
        words += f', {arc.windings} times by full turns of joints'
    return words


def _positions(robot: Robot, q: Floats, degrees: bool) -> str:
    texts = _joint_texts(robot, q, degrees)
    return '  '.join(f'{name} {text}' for name, text in zip(robot.joint_names, texts))
