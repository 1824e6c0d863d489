"""
The motion of one arm's tool as another arm's tool sees it, as an arm.

The way from one tool down its own arm, over the floor and up the other arm is a chain like any
other: the joints of the first arm come in reverse and turn the other way.
"""

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..kernel import Floats
from ..rigid_motion import inverse, screw_z
from .conventions import Row, row_of, table_rows
from .file.parts.convention_table import Axis
from .file.parts.description import (
    IDENTITY,
    ElementaryMotion,
    Link,
    LoopDescription,
    Placement,
    PointDescription,
    RigidMotion,
    RobotDescription,
    ShapeRow,
    SingularityDescription,
)
from .file.parts.joints import MAX_JOINTS
from .file.reader import refuse
from .file.text.expressions import Affine, Expression
from .loops import moving_variables, passive_names

# Axes of the same joint that are this near to each other, as a share of the chain's lengths, are
# one axis: what the arms have in common is there twice, and rounded twice.
ONE_AXIS = 1e-12
# What products of motions leave where a zero is meant: no entry of a rotation, no length in m, is
# as small.
ROUND_OFF = 1e-15
# About and along z.
SCREW: tuple[Axis, Axis] = ('Rz', 'Tz')


class _Frame(NamedTuple):
    # A frame of a table in a chain: behind so many screws, and a constant motion.
    screws: int
    motion: Floats


class _JointChain(NamedTuple):
    # Constant motions with screws about z between them, one fewer: angle and length of each are
    # linear in the variables, without constants. The frames are those of the table.
    motions: Sequence[Floats]
    screws: 'Sequence[tuple[Affine, Affine]]'
    frames: Sequence[_Frame] = ()

    def reverse(self) -> '_JointChain':
        n = len(self.screws)
        return _JointChain(
            [inverse(motion) for motion in reversed(self.motions)],
            [(_negative(theta), _negative(d)) for theta, d in reversed(self.screws)],
            [_Frame(n - k, inverse(self.motions[k]) @ motion) for k, motion in self.frames],
        )

    def behind(self, first: '_JointChain') -> Sequence[_Frame]:
        # The frames, where this chain comes after another one.
        n, between = len(first.screws), first.motions[-1]
        return [_Frame(n + k, motion if k else between @ motion) for k, motion in self.frames]


def _negative(affine: Affine) -> Affine:
    return Affine(0.0, tuple((name, -factor) for name, factor in affine.coefficients))


def _chain(
    begin: Floats, rows: Sequence[Row], end: Floats, variables: Mapping[str, str]
) -> _JointChain:
    # Rows between two constant motions, their variables called by other names.
    motions, screws, frames = [begin], [], [_Frame(0, begin)]
    for row in rows:
        motions[-1] = motions[-1] @ row.before @ screw_z(row.theta.constant, row.d.constant)
        if row.theta.coefficients or row.d.coefficients:
            screws.append((_renamed(row.theta, variables), _renamed(row.d, variables)))
            motions.append(row.after)
        else:
            motions[-1] = motions[-1] @ row.after
        frames.append(_Frame(len(screws), motions[-1]))
    motions[-1] = motions[-1] @ end
    return _JointChain(motions, screws, frames)


def _renamed(affine: Affine, variables: Mapping[str, str]) -> Affine:
    return Affine(0.0, tuple((variables[name], factor) for name, factor in affine.coefficients))


def relative_motion(
    first: RobotDescription, second: RobotDescription, names: tuple[str, str]
) -> RobotDescription:
    """
    Return the arm whose base is the tool of one arm, and whose tool is that of another.

    Its joints are those that move one against the other, the first arm's before the second's. Its
    Jacobian is in the axes of the first tool.

    Parameters
    ----------
    first, second
        Their bases in one frame. Joints of the same name are the same joint.
    names
        Of the arms, for variables and messages.

    Raises
    ------
    RobotFileError
        Nothing moves the two against each other; one has closed loops and a joint of the other,
        or ends before its loops do.
    """
    variables: dict[str, str] = {}  # by the joint's name
    chains, renamed = [], []
    for name, arm in zip(names, (first, second)):
        for joint in arm.joints:
            variables.setdefault(joint.name, f'{name}_{joint.variable}')
        own = {one.variable: variables[one.name] for one in arm.joints}
        own |= {one: f'{name}_{one}' for one in passive_names(arm)}
        renamed.append(own)
        ends = arm.base.motion.matrix, arm.tool.motion.matrix
        chains.append(_chain(ends[0], table_rows(arm), ends[1], own))
    common = {one.name for one in first.joints} & {one.name for one in second.joints}
    both = set(renamed[0].values()) & set(renamed[1].values())
    if twice := both.difference(variables[name] for name in common):
        refuse(
            first.file,
            f'{names[0]} and {names[1]} both have a variable {min(twice)}: give one of the arms '
            'another name',
        )
    for name, arm in zip(names, (first, second)):
        _check_loops(name, arm, common)
    reverse = chains[0].reverse()
    chain = _joined(reverse, chains[1])
    if not chain.screws:
        refuse(first.file, f'no joint moves the tool of {names[1]} against that of {names[0]}')
    links = tuple(_links(chain))
    joints = {variables[one.name]: one for one in (*first.joints, *second.joints)}
    loops = tuple(
        loop
        for name, arm, frames, own in zip(
            names, (first, second), (reverse.frames, chains[1].behind(reverse)), renamed
        )
        for loop in _loops(name, arm, [_placed(frame, chain) for frame in frames], own)
    )
    moving = moving_variables(replace(first, loops=loops), links)
    actuated = [variable for variable in joints if variable in moving]
    if len(actuated) > MAX_JOINTS:
        refuse(first.file, f'{len(actuated)} joints move the two arms (at most {MAX_JOINTS})')
    assembled = {
        own[joint.variable]: value
        for arm, own in zip((first, second), renamed)
        if arm.loops
        for joint, value in zip(arm.joints, arm.loops[0].q)
    }
    q = tuple(assembled.get(variable, 0.0) for variable in actuated)
    return replace(
        first,
        source='; '.join(dict.fromkeys(arm.source for arm in (first, second) if arm.source)),
        convention='shape',
        angle_unit='rad',
        length_unit='m',
        constants=(),
        joints=tuple(
            replace(joints[variable], variable=variable, unused=False) for variable in actuated
        ),
        links=links,
        loops=tuple(
            replace(loop, q=q) for loop in loops if moving & {one.name for one in loop.passive}
        ),
        base=Placement(first.tool.frame, _as_matrix(chain.motions[0])),
        tool=Placement(second.tool.frame, _as_matrix(chain.motions[-1])),
        points=(),
        singularity=SingularityDescription(),
        uncertainty=None,
        known_poses=(),
        speed_limits=(),
        warnings=(*first.warnings, *second.warnings),
        remarks=(),
    )


def _check_loops(name: str, arm: RobotDescription, common: Set[str]) -> None:
    if arm.loops and common:
        refuse(arm.file, f'{name} has closed loops, and {min(common)} in common with another arm')
    rows = [end.row for loop in arm.loops for end in (loop.start, loop.meets)]
    if max(rows, default=0) > len(arm.links):
        refuse(arm.file, f'{name} ends before its closed loops do: take its tool')


def _placed(frame: _Frame, chain: _JointChain) -> PointDescription:
    # A frame of a table among those that `_links` of the chain has.
    k, motion = frame
    row = sum(len(_moves(screw)) for screw in chain.screws[:k])
    if k < len(chain.screws):
        motion = inverse(chain.motions[k]) @ motion
    return PointDescription('', row, _as_matrix(motion))


def _loops(
    name: str,
    arm: RobotDescription,
    frames: Sequence[PointDescription],
    variables: Mapping[str, str],
) -> Iterator[LoopDescription]:
    # Both chains of each loop part from and meet the frames of another chain.
    here = np.eye(4)
    for loop in arm.loops:
        start, meets = (
            replace(
                end,
                row=frames[end.row].row,
                motion=_as_matrix(frames[end.row].motion.matrix @ end.motion.matrix),
            )
            for end in (loop.start, loop.meets)
        )
        # Of the table, between the frames that the ends are said in now.
        begin = start.motion.matrix @ inverse(loop.start.motion.matrix)
        end = loop.meets.motion.matrix @ inverse(meets.motion.matrix)
        there, back = (
            [row_of(link, arm.convention) for link in links] for links in (loop.there, loop.links)
        )
        yield replace(
            loop,
            name=f'{name}_{loop.name}',
            passive=tuple(replace(one, name=variables[one.name]) for one in loop.passive),
            start=start,
            meets=meets,
            there=_whole_links(_chain(begin, there, end, variables)),
            links=_whole_links(_chain(here, back, here, variables)),
        )


def _whole_links(chain: _JointChain) -> tuple[Link, ...]:
    # With the constant motions before the first screw and behind the last one.
    begin, end = (ShapeRow(_as_matrix(chain.motions[k]), None, IDENTITY) for k in (0, -1))
    return (begin, *_links(chain), end) if chain.screws else (begin,)


def _joined(first: _JointChain, second: _JointChain) -> _JointChain:
    # One after the other, without what the first does and the second takes back: the joints that
    # both arms stand on.
    motions = [*first.motions[:-1], first.motions[-1] @ second.motions[0], *second.motions[1:]]
    screws = [*first.screws, *second.screws]
    size = sum(float(np.linalg.norm(motion[:3, 3])) for motion in motions)
    k = len(first.screws)
    while 0 < k < len(screws):
        here, there, between = screws[k - 1], screws[k], motions[k]
        # A motion that takes the axis to itself, or turns it round, changes places with a screw.
        round_z = between[2, 2] < 0.0
        undone = there == (here if round_z else tuple(map(_negative, here)))
        parallel = np.abs(between[:2, 2]).max() <= ONE_AXIS
        same = not here[0].coefficients or np.abs(between[:2, 3]).max() <= ONE_AXIS * size
        if not (undone and parallel and same):
            break
        motions[k - 1 : k + 2] = [motions[k - 1] @ motions[k] @ motions[k + 1]]
        del screws[k - 1 : k + 1]
        k -= 1
    return _JointChain(motions, screws)


def _links(chain: _JointChain) -> 'Sequence[Link]':
    # Of Sheth and Uicker's rows, T = in * joint * inverse(out): the constant motions are any.
    links: list[Link] = []
    for k, screw in enumerate(chain.screws):
        after = IDENTITY
        if k < len(chain.screws) - 1:
            after = _as_matrix(inverse(chain.motions[k + 1]))
        moves = _moves(screw)
        links += [ShapeRow(IDENTITY, move, IDENTITY) for move in moves[:-1]]
        links.append(ShapeRow(IDENTITY, moves[-1], after))
    return links


def _moves(screw: 'tuple[Affine, Affine]') -> list[ElementaryMotion]:
    return [
        ElementaryMotion(axis, Expression(_text(affine), affine))
        for axis, affine in zip(SCREW, screw)
        if affine.coefficients
    ]


def _text(affine: Affine) -> str:
    terms = [
        f'{"-" if factor < 0.0 else "+"} '
        + (name if abs(factor) == 1.0 else f'{abs(factor)!r}*{name}')
        for name, factor in affine.coefficients
    ]
    return ' '.join(terms).removeprefix('+ ').replace('- ', '-', 1 if terms[0][0] == '-' else 0)


def _as_matrix(motion: Floats) -> RigidMotion:
    # Without the last digit, which products have rounded: right angles are seen to be right.
    numbers = [0.0 if abs(x) < ROUND_OFF else float(f'{x:.15g}') for x in motion.ravel()]
    return RigidMotion(np.reshape(numbers, (4, 4)), tuple(map(repr, numbers)))
