# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the text of a new robot file: an example arm, with comments that explain each part.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from ..parts.convention_table import CONVENTIONS, Convention, RowKind
from ..parts.description import AngleUnit
from ..parts.quantities import Units

MAX_JOINTS = 12
CELL_WIDTH = 6  # width of a number in the written table, characters


class _Link(NamedTuple):
    # A row of a standard table: a in m, alpha in multiples of 90 degrees, d in m.
    a: float
    alpha: int
    d: float


# Example arms with 1 to 6 joints. Arms with one or two joints are planar, the arm with three
# joints is anthropomorphic, and larger arms add wrist joints.
PLANAR = (_Link(0.3, 0, 0), _Link(0.25, 0, 0))
SHOULDER = (_Link(0, 1, 0.4), _Link(0.35, 0, 0))
ELBOW, BEND, TURN = _Link(0.3, 0, 0), _Link(0, 1, 0), _Link(0, 0, 0.1)
SMALL: dict[int, tuple[_Link, ...]] = {
    1: PLANAR[:1],
    2: PLANAR,
    3: (*SHOULDER, ELBOW),
    4: (*SHOULDER, ELBOW, _Link(0.1, 0, 0)),
    5: (*SHOULDER, ELBOW, BEND, TURN),
    6: (*SHOULDER, BEND, _Link(0, -1, 0.3), BEND, TURN),
}


def _holds(convention: Convention) -> bool:
    # Return whether a convention can describe the example arm, which has theta, d, a and alpha in
    # each row.
    before, after = convention.before_joint, convention.after_joint
    return not convention.product or (
        {'a', 'alpha', 'd', 'theta'} <= set(convention.quantities) and not (before and after)
    )


# The conventions that can describe the example arm.
NEW_CONVENTIONS = tuple(
    convention.name for convention in CONVENTIONS.values() if _holds(convention)
)


def new_robot_text(name: str, dof: int, convention: str, units: Units) -> str:
    """
    Return the text of a robot file for an example arm with `dof` revolute joints.

    The command `check` accepts the text.

    Parameters
    ----------
    name
        The name of the robot: letters, digits, underscores.
    dof
        Number of joints, 1 to MAX_JOINTS.
    convention
        The convention of the table, one of NEW_CONVENTIONS. The arm does not depend on it.
    units
        The units of the numbers.
    """
    links = _links(dof)
    written = CONVENTIONS[convention]
    rows = '\n'.join(f'  - {row}' for row in WRITERS[written.rows](links, written, units))
    return f"""\
# {name}: a robot file of kinematics_service.  One file is one arm, base to tool.
# The numbers are those of an example arm: replace them by yours, then
#   python -m kinematics_service check {name}.yaml
# A number may be an expression: + - * / ( ), sqrt, sin, cos, atan2{PI[units.angle]}, constants.
robot: {name}
# Where the numbers come from: datasheet, page, or your own ruler.
source: "example numbers, to be replaced by those of a datasheet or a drawing"
convention: {convention}
units: {{angle: {units.angle}, length: {units.length}}}    # of every number in this file
# Names for numbers that stand in several places:
# constants: {{L1: {_length(0.35, units)}}}

# The actuated joints, in the order of the Jacobian's columns.
#   name      as your driver publishes it in joint_states
#   variable  what the table below calls it (without it: the name)
#   type      revolute turns; prismatic slides and stands in d; helical does both
#   limits    the joint's own range; without them it turns for ever
#   velocity  the joint's largest speed, a second
joints:
{_joints(dof, units)}

{written.notes or f'# The table.  {written.formula}'}
links:
{rows}

# base: where the table begins, in the frame of the poses.  tool: the tool, in the last frame.
# xyz is a position; rpy are roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll).
base: {{frame: base_link, xyz: [0, 0, 0], rpy: [0, 0, 0]}}
tool: {{frame: tool0, xyz: [0, 0, 0], rpy: [0, 0, 0]}}

# Poses you know from elsewhere: the teach pendant, a drawing, a tape measure.  check compares them
# with the table, which is how a wrong sign is found.  Without rpy the position alone is compared.
# known_poses:
#   - {_known_pose(links, units)}
"""


PI: dict[AngleUnit, str] = {'rad': ', pi', 'deg': ''}


def _links(dof: int) -> tuple[_Link, ...]:
    if dof in SMALL:
        return SMALL[dof]
    # The arm has more than six joints: their axes are in turn along the arm and perpendicular to
    # the arm.
    arm = [_Link(0, 1 if i % 4 else -1, 0.3 if i % 2 == 0 else 0) for i in range(dof - 1)]
    return (*arm, _Link(0, 0, 0.1))


def _joints(dof: int, units: Units) -> str:
    limits = '-180, 180' if units.angle == 'deg' else '-pi, pi'
    speed = 90 if units.angle == 'deg' else 1.5
    lines = (
        f'  - {{name: joint_{i}, variable: q{i}, type: revolute, limits: [{limits}], '
        f'velocity: {speed}}}'
        for i in range(1, dof + 1)
    )
    return '\n'.join(lines)


def _length(metres: float, units: Units) -> str:
    return f'{metres * 1000.0:.6g}' if units.length == 'mm' else f'{metres:.6g}'


def _angle(quarters: int, units: Units) -> str:
    if units.angle == 'deg':
        return str(90 * quarters)
    return {-1: '-pi/2', 0: '0', 1: 'pi/2'}[quarters]


def _quantities(links: Sequence[_Link], convention: Convention, units: Units) -> Iterator[str]:
    # Yield the rows of a table with named quantities. In Craig's convention, a and alpha come
    # before the joint of a row. So row i + 1 has a and alpha of link i.
    late = bool(convention.before_joint)
    before = _Link(0, 0, 0)
    for i, link in enumerate(links, 1):
        shown = before if late else link
        yield _dh_row(convention, shown._replace(d=link.d), f'q{i}', units)
        before = link
    if late and (before.a or before.alpha):
        yield _dh_row(convention, before._replace(d=0), '0', units)


def _dh_row(convention: Convention, link: _Link, theta: str, units: Units) -> str:
    texts = {
        **{motion.quantity: '0' for motion in convention.motions},
        'a': _length(link.a, units),
        'alpha': _angle(link.alpha, units),
        'd': _length(link.d, units),
        'theta': theta,
    }
    *cells, last = convention.quantities
    columns = ' '.join(f'{name}: {texts[name] + ",":{CELL_WIDTH}}' for name in cells)
    return f'{{{columns} {last}: {texts[last]}}}'


def _elementary(links: Sequence[_Link], _: Convention, units: Units) -> Iterator[str]:
    for i, link in enumerate(links, 1):
        yield f'Rz(q{i})'
        if link.d:
            yield f'Tz({_length(link.d, units)})'
        if link.a:
            yield f'Tx({_length(link.a, units)})'
        if link.alpha:
            yield f'Rx({_angle(link.alpha, units)})'


def _shape(links: Sequence[_Link], _: Convention, units: Units) -> Iterator[str]:
    # Yield rows in the convention of Sheth and Uicker. The key `in` of row i is the fixed motion
    # before joint i. It is made from d, a and alpha of row i - 1 of the standard DH table.
    motion = ''
    for i, link in enumerate(links, 1):
        yield f'{{{motion}joint: Rz(q{i})}}'
        xyz = f'[{_length(link.a, units)}, 0, {_length(link.d, units)}]'
        motion = f'in: {{xyz: {xyz}, rpy: [{_angle(link.alpha, units)}, 0, 0]}}, '
    yield f'{{{motion.removesuffix(", ")}}}'


WRITERS: dict[RowKind, Callable[[Sequence[_Link], Convention, Units], Iterator[str]]] = {
    'quantities': _quantities,
    'motion': _elementary,
    'shape': _shape,
}


def _known_pose(links: Sequence[_Link], units: Units) -> str:
    # Return the entry for `known_poses`: the pose of the tool at q = 0. At q = 0 each frame is
    # rotated about x by a multiple of 90 degrees.
    x = y = z = 0.0
    quarters = 0
    for link in links:
        turn = quarters * math.pi / 2.0
        x += link.a
        y -= link.d * round(math.sin(turn))
        z += link.d * round(math.cos(turn))
        quarters += link.alpha
    xyz = ', '.join(_length(value + 0.0, units) for value in (x, y, z))
    # Reduce the roll angle to -90, 0, 90 or 180 degrees.
    quarters = (quarters + 1) % 4 - 1
    roll = {2: '180' if units.angle == 'deg' else 'pi'}.get(quarters) or _angle(quarters, units)
    zeros = ', '.join('0' for _ in links)
    return f'{{q: [{zeros}], xyz: [{xyz}], rpy: [{roll}, 0, 0]}}'
