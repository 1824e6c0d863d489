# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read a chain of a URDF, and compute the pose of its tip as the product of the joint transforms.

This computation shares no code with the kernel, or with the conversion of the chain to a table.
Therefore it can check both.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np

from ...errors import UrdfError
from ...kernel import Floats
from ...rigid_motion import inverse, turn_about
from ..file.parts.description import MimicFormula
from ..file.text.entries import did_you_mean, meant_by
from ..file.text.fault_report import quoted
from .document import XmlElement
from .elements import EXTENSION
from .joints import MOVING, JointLimits, UrdfJoint, read_joint
from .tree import UrdfTree, end_of


@dataclass(frozen=True)
class Variable:
    """
    An actuated joint that moves the chain.

    Parameters
    ----------
    type
        `revolute`, `prismatic`, or `helical` (a screw). URDF has no helical joints. Two joints of
        a URDF form one: a turning joint, and a sliding joint that mimics the turning joint.
    """

    name: str
    type: str
    limits: JointLimits


@dataclass(frozen=True, eq=False)
class MovingJoint:
    """
    One moving joint of a URDF chain: a constant motion, then a motion about or along the axis.

    Parameters
    ----------
    turns
        True for a joint that turns, False for a joint that slides.
    before : shape (4, 4)
        The constant motion between the previous moving joint and this joint, including the origin
        of this joint.
    axis : shape (3,)
        The axis as a unit vector, in the frame after `before`.
    variable, factor, offset
        The position of the joint, rad or m, is factor * q[variable] + offset.
    follows
        Whether this joint mimics another joint.
    """

    turns: bool
    before: Floats
    axis: Floats
    variable: int
    factor: float
    offset: float
    follows: bool


@dataclass(frozen=True, eq=False)
class UrdfChain:
    """
    The joints of a URDF from the link `base` to the link `tip`.

    Parameters
    ----------
    robot
        The name of the robot in the URDF.
    variables
        The actuated joints, in the order of joint positions q.
    motions
        The moving joints from base to tip.
    end : shape (4, 4)
        The constant motion after the last moving joint.
    mimics
        The joints of the chain that mimic other joints.
    joints
        All joints of the chain, including fixed joints. If a joint of the chain mimics a joint
        outside the chain, that joint too.
    """

    robot: str
    base: str
    tip: str
    variables: tuple[Variable, ...]
    motions: tuple[MovingJoint, ...]
    end: Floats
    mimics: tuple[MimicFormula, ...]
    joints: tuple[UrdfJoint, ...]

    def poses(self, q: Floats) -> Floats:
        """Return poses of the tip in the base, (k, 4, 4), at joint positions q (k, n)."""
        T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
        for motion in self.motions:
            position = motion.factor * q[:, motion.variable] + motion.offset
            T = T @ motion.before @ moved(motion.turns, motion.axis, position)
        return np.asarray(T @ self.end)


def moved(turns: bool, axis: Floats, position: Floats) -> Floats:
    """Return the motion matrices (k, 4, 4) of a joint with a unit axis (3,) at positions (k,)."""
    T = np.tile(np.eye(4), (len(position), 1, 1))
    if turns:
        T[:, :3, :3] = turn_about(axis, position)
    else:
        T[:, :3, 3] = position[:, None] * axis
    return T


def read_chain(tree: UrdfTree, base: str, tip: str, rounds: bool = False) -> UrdfChain:
    """
    Read the chain between two links of a URDF; base and tip may be on different branches.

    If `rounds` is true, exact angles and axes replace angles and axes that look rounded.

    Raises
    ------
    UrdfError
        There is no such chain, no joint moves the tip, or a robot file cannot express a joint.
    """
    elements = tree.path(base, tip)
    up = len(elements.up)
    path = [_joint(tree, element, rounds) for element in (*elements.up, *elements.down)]
    leaders = {joint.name: _followed(tree, joint) for joint in path if joint.type in MOVING}
    moving = [joint for joint in path if joint.name in leaders and leaders[joint.name].multiplier]
    names = list(dict.fromkeys(leaders[joint.name].mimics for joint in moving))
    if not names:
        tree.root.refuse(f'no joint moves {tip!r} against {base!r}; give other links', 'no-effect')
    extension = tree.root.first(EXTENSION)
    text = '' if extension is None else extension.attributes.get('joint_order', '')
    order = text.split(',' if ',' in text else None)
    if set(names) <= set(order):
        names.sort(key=order.index)
    motions, still = [], np.eye(4)
    for k, joint in enumerate(path):
        # On the part of the path that goes up from the base, the path enters a joint at its child
        # link. There the motion of the joint is inverted.
        before, after, sign = (
            (np.eye(4), inverse(joint.origin), -1.0) if k < up else (joint.origin, np.eye(4), 1.0)
        )
        still = still @ before
        if joint.name in leaders:
            leader, turns = leaders[joint.name], joint.type != 'prismatic'
            factor, offset = sign * leader.multiplier, sign * leader.offset
            if factor == 0.0:  # with multiplier 0, the joint stays at its offset
                still = still @ moved(turns, joint.axis, np.array([offset]))[0]
            else:
                variable, follows = names.index(leader.mimics), bool(joint.mimics)
                motion = MovingJoint(turns, still, joint.axis, variable, factor, offset, follows)
                motions.append(motion)
                still = np.eye(4)
        still = still @ after
    actuated = {name: _joint(tree, tree.joints[name]) for name in names}
    variables = [_variable(actuated[name], moving, leaders) for name in names]
    joints = {**actuated, **{joint.name: joint for joint in path}}
    mimics = tuple(
        MimicFormula(
            mimic.name, mimic.mimics, mimic.multiplier, mimic.offset, mimic.type == 'prismatic'
        )
        for mimic in (leaders[joint.name] for joint in moving if joint.mimics)
    )
    robot = tree.root.attributes.get('name', '')
    base, tip = base.removeprefix('/'), tip.removeprefix('/')
    return UrdfChain(
        *(robot, base, tip, tuple(variables), tuple(motions), still, mimics),
        tuple(joints.values()),
    )


def _joint(tree: UrdfTree, element: XmlElement, rounds: bool = False) -> UrdfJoint:
    try:
        return read_joint(element, tree.version, rounds)
    except UrdfError as error:
        message = error.fault.message + _links_of(element)
        raise UrdfError(replace(error.fault, message=message)) from None


def _links_of(joint: XmlElement) -> str:
    parent, child = (quoted(end_of(joint, end)) for end in ('parent', 'child'))
    return f'; the joint is between links {parent} and {child}'


def _refuse(joint: XmlElement, message: str, code: str) -> NoReturn:
    joint.refuse(message + _links_of(joint), code)


def _followed(tree: UrdfTree, joint: UrdfJoint) -> UrdfJoint:
    # Return the joint as a mimic of an actuated joint, with multiplier and offset. If its leader
    # is itself a mimic, combine both formulas. An actuated joint is returned as a mimic of itself.
    factor, offset, leader = 1.0, 0.0, joint
    passed = set()
    while leader.mimics:
        if leader.name in passed:
            _refuse(joint.element, 'mimics itself, through other joints', 'circular')
        passed.add(leader.name)
        if leader.mimics not in tree.joints:
            hint = did_you_mean(meant_by(leader.mimics, tuple(tree.joints)))
            message = f'mimics the unknown joint {leader.mimics!r}{hint}'
            _refuse(leader.element, message, 'unknown-name')
        factor, offset = factor * leader.multiplier, factor * leader.offset + offset
        leader = _joint(tree, tree.joints[leader.mimics])
        if leader.type not in MOVING:
            message = f'mimics {leader.name!r}, which is {leader.type} and does not move'
            _refuse(joint.element, message, 'wrong-joint-type')
    return replace(joint, mimics=leader.name, multiplier=factor, offset=offset)


def _variable(
    leader: UrdfJoint, moving: Sequence[UrdfJoint], leaders: dict[str, UrdfJoint]
) -> Variable:
    name, turns = leader.name, leader.type != 'prismatic'
    ours = [joint for joint in moving if leaders[joint.name].mimics == name]
    others = [joint for joint in ours if (joint.type != 'prismatic') != turns]
    if others and (not turns or len(others) == len(ours)):
        does, itself = ('turns', 'slides') if turns else ('slides', 'turns')
        _refuse(
            others[0].element,
            f'{itself}, and {name!r}, which it mimics, {does}; a robot file can have this only '
            'for a joint that turns in the same chain (type: helical)',
            'wrong-joint-type',
        )
    kind = 'helical' if others else 'revolute' if turns else 'prismatic'
    return Variable(name, kind, leader.limits)
