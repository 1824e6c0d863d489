"""
The motion of one arm's tool as another arm's tool sees it, as an arm.

The way from one tool down its own arm, over the floor and up the other arm is a chain like any
other: the joints of the first arm come in reverse and turn the other way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, NoReturn

import numpy as np

from ..errors import Fault, RobotFileError
from ..kernel import Floats
from ..rigid_motion import inverse, screw_z
from .conventions import table_rows
from .file.parts.convention_table import Axis
from .file.parts.description import (
    IDENTITY,
    ElementaryMotion,
    Link,
    Placement,
    RigidMotion,
    RobotDescription,
    ShapeRow,
    SingularityDescription,
)
from .file.parts.joints import MAX_JOINTS
from .file.text.expressions import Affine, Expression
from .loops import moving_variables

# Axes of the same joint that are this near to each other, as a share of the chain's lengths, are
# one axis: what the arms have in common is there twice, and rounded twice.
ONE_AXIS = 1e-12
# What products of motions leave where a zero is meant: no entry of a rotation, no length in m, is
# as small.
ROUND_OFF = 1e-15
# About and along z.
SCREW: tuple[Axis, Axis] = ('Rz', 'Tz')


class _JointChain(NamedTuple):
    # Constant motions with screws about z between them, one fewer: angle and length of each are
    # linear in the variables, without constants.
    motions: Sequence[Floats]
    screws: 'Sequence[tuple[Affine, Affine]]'

    def reverse(self) -> '_JointChain':
        return _JointChain(
            [inverse(motion) for motion in reversed(self.motions)],
            [(_negative(theta), _negative(d)) for theta, d in reversed(self.screws)],
        )


def _negative(affine: Affine) -> Affine:
    return Affine(0.0, tuple((name, -factor) for name, factor in affine.coefficients))


def _chain(description: RobotDescription, variables: Mapping[str, str]) -> _JointChain:
    # From the frame of the cell to the tool, its variables called by other names.
    motions, screws = [description.base.motion.matrix], []
    for row in table_rows(description):
        motions[-1] = motions[-1] @ row.before @ screw_z(row.theta.constant, row.d.constant)
        if row.theta.coefficients or row.d.coefficients:
            screws.append((_renamed(row.theta, variables), _renamed(row.d, variables)))
            motions.append(row.after)
        else:
            motions[-1] = motions[-1] @ row.after
    motions[-1] = motions[-1] @ description.tool.motion.matrix
    return _JointChain(motions, screws)


def _renamed(affine: Affine, variables: Mapping[str, str]) -> Affine:
    return Affine(0.0, tuple((variables[name], factor) for name, factor in affine.coefficients))


def refuse(file: str, message: str) -> NoReturn:
    """Raise a sentence about a cell or an arm of it as the fault of its file."""
    raise RobotFileError((Fault(file, 0, '', message),))


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
        An arm has closed loops, or nothing moves the two against each other.
    """
    variables: dict[str, str] = {}  # by the joint's name
    chains: list[_JointChain] = []
    for name, arm in zip(names, (first, second)):
        if arm.loops:
            refuse(arm.file, f'{name} has closed loops: a relative motion takes arms without')
        for joint in arm.joints:
            variables.setdefault(joint.name, f'{name}_{joint.variable}')
        chains.append(_chain(arm, {one.variable: variables[one.name] for one in arm.joints}))
    chain = _joined(chains[0].reverse(), chains[1])
    if not chain.screws:
        refuse(first.file, f'no joint moves the tool of {names[1]} against that of {names[0]}')
    links = tuple(_links(chain))
    joints = {variables[one.name]: one for one in (*first.joints, *second.joints)}
    moving = moving_variables(first, links)
    if len(moving) > MAX_JOINTS:
        refuse(first.file, f'{len(moving)} joints move the two arms (at most {MAX_JOINTS})')
    return replace(
        first,
        source='; '.join(dict.fromkeys(arm.source for arm in (first, second) if arm.source)),
        convention='shape',
        angle_unit='rad',
        length_unit='m',
        constants=(),
        joints=tuple(
            replace(joint, variable=variable, unused=False)
            for variable, joint in joints.items()
            if variable in moving
        ),
        links=links,
        base=Placement(first.tool.frame, _as_matrix(chain.motions[0])),
        tool=Placement(second.tool.frame, _as_matrix(chain.motions[-1])),
        points=(),
        singularity=SingularityDescription(None, None, 'distance', None, None, ()),
        uncertainty=None,
        known_poses=(),
        speed_limits=(),
        warnings=(*first.warnings, *second.warnings),
        remarks=(),
    )


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
        moves = [
            ElementaryMotion(axis, Expression(_text(affine), affine))
            for axis, affine in zip(SCREW, screw)
            if affine.coefficients
        ]
        links += [ShapeRow(IDENTITY, move, IDENTITY) for move in moves[:-1]]
        links.append(ShapeRow(IDENTITY, moves[-1], after))
    return links


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
