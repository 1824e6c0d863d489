# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write the text of a robot file, given the chain of a URDF and the DH table of this chain."""

import json
import math
import re
from collections.abc import Sequence

from ...kernel import Floats
from ...rigid_motion import exact_rpy
from ...typography import linear_text, number_text
from ..file.text.expression_syntax import why_no_name
from .chain import UrdfChain, Variable
from .table import ConstantPose, UrdfRow, UrdfTable

# If a joint name has more characters than this, the variables in the table are q1, q2, ... and not
# the joint names.
MAX_VARIABLE = 8
# Largest length of the text `source` in a robot file, characters. A file with a longer text is
# refused.
MAX_SOURCE_LENGTH = 2000
# Words that YAML 1.1 or 1.2 reads as text only if they are in quotes.
WORDS = ('true', 'false', 'null', 'yes', 'no', 'on', 'off')


def robot_file_text(
    chain: UrdfChain,
    table: UrdfTable,
    convention: str,
    name: str,
    source: str,
    known: Sequence[tuple[Floats, Floats]],
) -> str:
    """
    Return the text of a robot file for a chain of a URDF.

    Parameters
    ----------
    chain, table, convention
        The chain, its table, and the convention of the table.
    name, source
        Name and source of the robot.
    known
        Pairs for `known_poses`: joint positions (n,), and the pose of the tip (4, 4).
    """
    names = _variables(chain.variables)
    moving = {term.variable for row in table.rows for term in row.terms}
    lines = [
        f'robot: {name}',
        f'source: {json.dumps(printable_source(source), ensure_ascii=False)}',
        f'convention: {convention}',
        'joints:',
        *(
            _joint(joint, variable, j in moving)
            for j, (joint, variable) in enumerate(zip(chain.variables, names))
        ),
        'links:',
        *(_link(row, names) for row in table.rows),
        f'base: {_placement(chain.base, table.base)}',
        f'tool: {_placement(chain.tip, table.tool)}',
        'known_poses:  # multiplied out from the URDF, not from this table',
        *(f'  - {_known_pose(q, T)}' for q, T in known),
    ]
    return '\n'.join([*lines, ''])


def printable_source(source: str) -> str:
    """
    Return a source for a robot file: replace unprintable characters by `?`, and cut long texts.
    """
    return ''.join(c if c.isprintable() else '?' for c in source)[:MAX_SOURCE_LENGTH]


def _variables(joints: Sequence[Variable]) -> list[str]:
    names = [joint.name for joint in joints]
    fit = all(
        len(name) <= MAX_VARIABLE and why_no_name(name) is None and name.lower() not in WORDS
        for name in names
    )
    return names if fit else [f'q{i}' for i in range(1, len(names) + 1)]


def quoted_name(text: str) -> str:
    """Return a name as YAML text, in quotes if YAML would read the bare name as another value."""
    plain = re.fullmatch(r'[A-Za-z][A-Za-z0-9_./-]*', text) and text.lower() not in WORDS
    return text if plain else json.dumps(text, ensure_ascii=False)


def _joint(joint: Variable, variable: str, moves: bool) -> str:
    entry = [f'name: {quoted_name(joint.name)}']
    if variable != joint.name:
        entry.append(f'variable: {variable}')
    entry.append(f'type: {joint.type}')
    lower, upper, velocity, acceleration, _ = joint.limits
    if not math.isinf(lower) or not math.isinf(upper):
        entry.append(f'limits: [{_limit(lower)}, {_limit(upper)}]')
    for key, rate in (('velocity', velocity), ('acceleration', acceleration)):
        if math.isfinite(rate):
            entry.append(f'{key}: {number_text(rate)}')
    if not moves:
        entry.append('unused: true')
    return f'  - {{{", ".join(entry)}}}'


def _limit(value: float) -> str:
    return number_text(value) if math.isfinite(value) else '-.inf' if value < 0.0 else '.inf'


def _link(row: UrdfRow, names: Sequence[str]) -> str:
    theta, d = (_expression(row, turns, names) for turns in (True, False))
    return f'  - {{a: {row.a.text}, alpha: {row.alpha.text}, d: {d}, theta: {theta}}}'


def _expression(row: UrdfRow, turns: bool, names: Sequence[str]) -> str:
    constant = row.theta if turns else row.d
    terms = [(term.factor, names[term.variable]) for term in row.terms if term.turns == turns]
    if not terms:
        return constant.text
    if constant.value != 0.0:
        sign = math.copysign(1.0, constant.value)
        terms.append((sign, constant.text.removeprefix('-')))
    return linear_text(terms)


def _placement(frame: str, pose: ConstantPose) -> str:
    entry = [f'frame: {quoted_name(frame)}']
    for key, values in (('xyz', pose.xyz), ('rpy', pose.rpy)):
        if any(value.value for value in values):
            entry.append(f'{key}: [{", ".join(value.text for value in values)}]')
    return f'{{{", ".join(entry)}}}'


def _known_pose(q: Floats, T: Floats) -> str:
    values = (('q', q), ('xyz', T[:3, 3]), ('rpy', exact_rpy(T[:3, :3])))
    return '{' + ', '.join(f'{k}: [{", ".join(map(number_text, v))}]' for k, v in values) + '}'
