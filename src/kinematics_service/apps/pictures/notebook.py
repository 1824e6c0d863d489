# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write results as HTML for a notebook: tables, matrices and a sketch of the arm."""

from collections.abc import Callable, Sequence
from html import escape
from typing import Any

import numpy as np

from ... import page
from ...kernel import Floats
from ...kinematics.inverse.result import IkResult
from ...kinematics.singularity import Singularity
from ...kinematics.tool_state import ToolState
from ...printing import number
from ...robot.robot import Robot
from ...robot.task import TWIST_ROWS
from .plots.ranges import clear_pose
from .sketch import sketch


def html_of(result: Robot | ToolState | Singularity | IkResult) -> str:
    """Return a robot, tool state, singularity or inverse kinematics result as HTML."""
    view = next(view for kind, view in VIEWS.items() if isinstance(result, kind))
    return f'<div><p><b>{escape(repr(result))}</b></p>{"".join(view(result))}</div>'


def _robot(robot: Robot) -> list[str]:
    rows = [
        [escape(name), kind, *(number(x, 4) for x in limits)]
        for name, kind, limits in zip(robot.joint_names, robot.joint_types, robot.limits.tolist())
    ]
    head = ('joint', 'type', 'lower [rad, m]', 'upper [rad, m]')
    table = page.table(head, rows, (2, 3))
    return [_facts(source=robot.source), table, sketch(robot, clear_pose(robot))]


def _state(state: ToolState) -> list[str]:
    if state.row.ndim > 1:
        return []
    names = state.robot.joint_names
    parts = [
        _matrix('joint positions [rad, m]', names, ('q',), state.q[None]),
        _matrix('tool in the base frame [m]', ('', '', '', ''), ('', '', '', ''), state.pose),
        _matrix('Jacobian', names, TWIST_ROWS, state.jacobian),
    ]
    if state.moving:
        parts.append(_matrix('twist [m/s, rad/s]', TWIST_ROWS, ('',), state.twist[None]))
    return [*parts, sketch(state.robot, state.q)]


def _singularity(result: Singularity) -> list[str]:
    if np.ndim(result.level):
        return []  # several configurations get no table, only the heading (see `html_of`)
    words = {
        'determinant': None if result.determinant is None else f'{result.determinant:.6g}',
        'manipulability': f'{result.manipulability:.6g}',
        'condition number': f'{result.condition_number:.4g}',
        'singular values': '  '.join(f'{x:.4g}' for x in result.singular_values.tolist()),
        'nearest singular pose': None
        if result.nearest_singular is None
        else '  '.join(number(x, 4) for x in result.nearest_singular.tolist()),
    }
    if result.factors is not None:
        values = zip(result.factors.names, result.factors.values.tolist())
        words |= {f'factor {name}': f'{value:.4g}' for name, value in values}
    return [_facts(**{name: word for name, word in words.items() if word is not None})]


def _solutions(result: IkResult) -> list[str]:
    rows = [
        [
            *(number(x, 4) for x in solution.q.tolist()),
            escape(str(solution.posture)),
            escape(', '.join(solution.beyond)) or f'{solution.margin:.3g}',
            f'{solution.residual:.1e}',
        ]
        for solution in result
    ]
    parts = [_facts(status=result.status, reason=result.reason)]
    if rows:
        joints = [f'q{k + 1}' for k in range(len(result[0].q))]
        head = (*joints, 'posture', 'to the nearest limit, or beyond those of', 'residual')
        parts.append(page.table(head, rows, (*range(len(joints)), len(head) - 1)))
    if result.families:
        moving = '; '.join(', '.join(family.joints) for family in result.families)
        parts.append(_facts(**{'families, in which these move': moving}))
    return parts


def _facts(**words: str) -> str:
    return page.table(('', ''), [[escape(name), escape(word)] for name, word in words.items()], ())


def _matrix(title: str, columns: Sequence[str], rows: Sequence[str], values: Floats) -> str:
    body = [[name, *(number(x, 4) for x in row)] for name, row in zip(rows, values.tolist())]
    head = ('', *map(escape, columns))
    return f'<p>{escape(title)}</p>{page.table(head, body, range(1, len(head)))}'


VIEWS: dict[type, Callable[[Any], list[str]]] = {
    Robot: _robot,
    ToolState: _state,
    Singularity: _singularity,
    IkResult: _solutions,
}
