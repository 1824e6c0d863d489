# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Describe the motion of one arm's tool relative to another arm's tool as one arm.

The chain of the new arm begins at the tool of the first arm and goes to this arm's base. It
continues from the base of the second arm to the tool of the second arm. So the joints of the first
arm are in reverse order, and their motions are inverted (a joint variable q becomes -q).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..kernel import Floats
from ..rigid_motion import inverse, screw_z
from ..typography import linear_text
from .conventions import table_rows
from .file.parts import description
from .file.parts.convention_table import Axis
from .file.parts.joints import MAX_JOINTS
from .file.parts.links import names_in_rows
from .file.reader import refuse
from .file.text.expressions import Affine, Expression

# Two axes count as one axis if the distance between them is at most this tolerance times the sum
# of the chain's lengths. The two arms of a cell may share a joint, for example in the torso. The
# chain from the first tool to the second tool then contains the shared joint twice. Because of
# round-off, the two copies of the joint's axis may be apart, so the tolerance is above 0.
AXIS_TOLERANCE = 1e-12
# Set entries of a pose matrix below this (translations in m) to zero, because they are round-off.
ZERO_TOLERANCE = 1e-15
SCREW_AXES: tuple[Axis, Axis] = ('Rz', 'Tz')


class _JointChain(NamedTuple):
    # A kinematic chain: constant motions, (4, 4) each, separated by screws about z. The angle and
    # the length of a screw are linear in the joint variables, without a constant.
    motions: Sequence[Floats]
    screws: 'Sequence[tuple[Affine, Affine]]'

    def reverse(self) -> '_JointChain':
        return _JointChain(
            [inverse(motion) for motion in reversed(self.motions)],
            [(_negative(theta), _negative(d)) for theta, d in reversed(self.screws)],
        )


def _negative(affine: Affine) -> Affine:
    return Affine(0.0, tuple((name, -factor) for name, factor in affine.coefficients))


def _chain(arm: description.RobotDescription, variables: Mapping[str, str]) -> _JointChain:
    # Return the chain of an arm from the frame of the cell to the tool of the arm, with renamed
    # variables.
    motions, screws = [arm.base.motion.matrix], []
    for row in table_rows(arm):
        motions[-1] = motions[-1] @ row.before @ screw_z(row.theta.constant, row.d.constant)
        if row.theta.coefficients or row.d.coefficients:
            screws.append((_renamed(row.theta, variables), _renamed(row.d, variables)))
            motions.append(row.after)
        else:
            motions[-1] = motions[-1] @ row.after
    motions[-1] = motions[-1] @ arm.tool.motion.matrix
    return _JointChain(motions, screws)


def _renamed(affine: Affine, variables: Mapping[str, str]) -> Affine:
    return Affine(0.0, tuple((variables[name], factor) for name, factor in affine.coefficients))


def relative_motion(
    first: description.RobotDescription,
    second: description.RobotDescription,
    names: tuple[str, str],
) -> description.RobotDescription:
    """
    Return an arm whose base is the tool of the first arm and whose tool is the tool of the second.

    The result has the joints that change the relative motion: first those of the first arm, then
    those of the second arm. The Jacobian of the result is in the axes of the first tool.

    Parameters
    ----------
    first, second
        Two arms with their bases in one frame. Two joints of the same name are one joint.
    names
        The names of the arms, for variables and messages.

    Raises
    ------
    RobotFileError
        No joint changes the motion, or an arm has closed loops.
    """
    variables: dict[str, str] = {}  # maps the name of each joint to its variable in the new table
    chains = []
    for name, arm in zip(names, (first, second)):
        if arm.loops:
            refuse(
                arm.file,
                f'{name} has closed loops, which a relative motion cannot have; '
                'use each arm alone, from the frame of the cell',
                'unsupported',
            )
        for joint in arm.joints:
            variables.setdefault(joint.name, f'{name}_{joint.variable}')
        chains.append(_chain(arm, {joint.variable: variables[joint.name] for joint in arm.joints}))
    called = list(variables.values())
    if twice := [variable for variable in called if called.count(variable) > 1]:
        refuse(
            first.file,
            f'{names[0]} and {names[1]} both have a variable {min(twice)}; rename one of the arms',
            'duplicate-name',
        )
    chain = _joined(chains[0].reverse(), chains[1])
    if not chain.screws:
        message = f'no joint moves the tool of {names[1]} against that of {names[0]}'
        refuse(first.file, message, 'no-effect')
    links = tuple(_links(chain))
    joints = {variables[joint.name]: joint for joint in (*first.joints, *second.joints)}
    moving = names_in_rows(links)
    if len(moving) > MAX_JOINTS:
        message = f'{len(moving)} joints move the two arms (at most {MAX_JOINTS})'
        refuse(first.file, message, 'too-many')
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
        base=description.Placement(first.tool.frame, _as_matrix(chain.motions[0])),
        tool=description.Placement(second.tool.frame, _as_matrix(chain.motions[-1])),
        points=(),
        singularity=description.SingularityDescription(),
        uncertainty=None,
        known_poses=(),
        speed_limits=(),
        warnings=(*first.warnings, *second.warnings),
        remarks=(),
    )


def _joined(first: _JointChain, second: _JointChain) -> _JointChain:
    # Join two chains: from the tool of the first arm to the frame of the cell, and from this frame
    # to the tool of the second arm. A joint that moves both arms, such as a torso joint, is last
    # in the first chain and first in the second chain, with opposite signs. Leave out such a
    # joint, because it does not change the pose of one tool relative to the other.
    motions = [*first.motions[:-1], first.motions[-1] @ second.motions[0], *second.motions[1:]]
    screws = [*first.screws, *second.screws]
    size = sum(float(np.linalg.norm(motion[:3, 3])) for motion in motions)
    k = len(first.screws)
    while 0 < k < len(screws):
        screw, other, between = screws[k - 1], screws[k], motions[k]
        # `screw` and `other` are two screw motions, each about its own z axis. They can cancel if
        # the two z axes are one line. If both z axes have the same direction, opposite screws
        # cancel. If the directions are opposite, equal screws cancel. Screws that only slide can
        # also cancel if the z axes are parallel.
        round_z = between[2, 2] < 0.0
        undone = other == (screw if round_z else tuple(map(_negative, screw)))
        parallel = np.abs(between[:2, 2]).max() <= AXIS_TOLERANCE
        same = not screw[0].coefficients or np.abs(between[:2, 3]).max() <= AXIS_TOLERANCE * size
        if not (undone and parallel and same):
            break
        motions[k - 1 : k + 2] = [motions[k - 1] @ motions[k] @ motions[k + 1]]
        del screws[k - 1 : k + 1]
        k -= 1
    return _JointChain(motions, screws)


def _links(chain: _JointChain) -> 'Sequence[description.Link]':
    # Return the chain as table rows of Sheth and Uicker, T = in * joint * inverse(out), because
    # `in` and `out` can be any constant motions.
    links: list[description.Link] = []
    for k, screw in enumerate(chain.screws):
        moves = [
            description.ElementaryMotion(axis, Expression(_text(affine), affine))
            for axis, affine in zip(SCREW_AXES, screw)
            if affine.coefficients
        ]
        after = description.IDENTITY
        if k < len(chain.screws) - 1:
            after = _as_matrix(inverse(chain.motions[k + 1]))
        links += [
            description.ShapeRow(description.IDENTITY, move, description.IDENTITY)
            for move in moves[:-1]
        ]
        links.append(description.ShapeRow(description.IDENTITY, moves[-1], after))
    return links


def _text(affine: Affine) -> str:
    return linear_text((factor, name) for name, factor in affine.coefficients)


def _as_matrix(motion: Floats) -> description.RigidMotion:
    # Round the entries to 15 digits, so that right angles are exact in the new table.
    numbers = [0.0 if abs(x) < ZERO_TOLERANCE else float(f'{x:.15g}') for x in motion.ravel()]
    return description.RigidMotion(np.reshape(numbers, (4, 4)), tuple(map(repr, numbers)))
