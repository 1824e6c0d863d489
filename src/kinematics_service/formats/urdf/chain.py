"""
A chain of a URDF as its joints say it, and its pose as their plain product.

The product shares nothing with the kernel or the table made from the chain, so it can judge them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...kernel import Floats
from ...rigid_motion import turn_about
from .document import XmlElement
from .elements import EXTENSION
from .joints import MOVING, Angle, UrdfJoint, read_joint
from .tree import UrdfTree


@dataclass(frozen=True)
class Variable:
    """
    An actuated joint that moves the chain.

    Parameters
    ----------
    type
        `revolute`, `prismatic`, or `helical` where joints that mimic it slide too.
    lower, upper, velocity
        rad or m, infinite where there is none.
    """

    name: str
    type: str
    lower: float
    upper: float
    velocity: float


@dataclass(frozen=True, eq=False)
class MovingJoint:
    """
    One moving joint of the chain: `before`, then about or along its axis.

    Parameters
    ----------
    turns
        Rather than slides.
    before : shape (4, 4)
        Everything that stands still since the last motion, the joint's own origin included.
    axis : shape (3,)
        Unit vector.
    variable, factor, offset
        The joint's position is factor times that variable (its index) plus offset, in rad or m.
    follows
        Whether the joint mimics another.
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
    The way from one link to another.

    Parameters
    ----------
    robot
        The name in the URDF.
    end : shape (4, 4)
        What stands still after the last motion.
    """

    robot: str
    base: str
    tip: str
    variables: tuple[Variable, ...]
    motions: tuple[MovingJoint, ...]
    end: Floats

    def poses(self, q: Floats) -> Floats:
        """Return the tip in the base, shape (k, 4, 4), at positions q, shape (k, n), rad or m."""
        T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
        for motion in self.motions:
            position = motion.factor * q[:, motion.variable] + motion.offset
            T = T @ motion.before @ moved(motion.turns, motion.axis, position)
        return np.asarray(T @ self.end)


def moved(turns: bool, axis: Floats, position: Floats) -> Floats:
    """Return what joints at positions (k,) do, about or along an axis: shape (k, 4, 4)."""
    T = np.tile(np.eye(4), (len(position), 1, 1))
    if turns:
        T[:, :3, :3] = turn_about(axis, position)
    else:
        T[:, :3, 3] = position[:, None] * axis
    return T


def read_chain(tree: UrdfTree, base: str, tip: str, angle: Angle = float) -> UrdfChain:
    """
    Return the chain between two links.

    Raises
    ------
    UrdfError
        There is none, no joint moves it, or a robot file cannot say what one of its joints does.
    """
    way = [read_joint(element, angle) for element in tree.chain(base, tip)]
    leaders = {joint.name: _followed(tree, joint) for joint in way if joint.type in MOVING}
    moving = [joint for joint in way if joint.name in leaders and leaders[joint.name].multiplier]
    names = list(dict.fromkeys(leaders[joint.name].mimics for joint in moving))
    if not names:
        tree.root.refuse(f'no joint moves {tip!r} against {base!r}')
    names = _ordered(tree.root, names)
    motions, still = [], np.eye(4)
    for joint in way:
        still = still @ joint.origin
        if joint.name not in leaders:
            continue
        leader, turns = leaders[joint.name], joint.type != 'prismatic'
        if leader.multiplier == 0.0:  # it mimics, and so it stands still
            still = still @ moved(turns, joint.axis, np.array([leader.offset]))[0]
            continue
        variable, follows = names.index(leader.mimics), bool(joint.mimics)
        factor, offset = leader.multiplier, leader.offset
        motions.append(MovingJoint(turns, still, joint.axis, variable, factor, offset, follows))
        still = np.eye(4)
    variables = [_variable(tree, name, moving, leaders) for name in names]
    robot = tree.root.attributes.get('name', '')
    return UrdfChain(robot, base, tip, tuple(variables), tuple(motions), still)


def _followed(tree: UrdfTree, joint: UrdfJoint) -> UrdfJoint:
    # The joint with `mimics` the actuated joint at the end of the mimicry, itself if there is
    # none, and multiplier and offset to match.
    factor, offset, leader = 1.0, 0.0, joint
    passed = set()
    while leader.mimics:
        if leader.name in passed:
            joint.element.refuse('it mimics itself, by way of the joints it mimics')
        passed.add(leader.name)
        if leader.mimics not in tree.joints:
            leader.element.refuse(f'it mimics {leader.mimics!r}, and there is no such joint')
        factor, offset = factor * leader.multiplier, factor * leader.offset + offset
        leader = read_joint(tree.joints[leader.mimics])
        if leader.type not in MOVING:
            joint.element.refuse(f'it mimics {leader.name!r}, which is {leader.type}')
    return replace(joint, mimics=leader.name, multiplier=factor, offset=offset)


def _ordered(root: XmlElement, names: list[str]) -> list[str]:
    # As the chain has them, unless the file is one of ours and says otherwise.
    extension = root.first(EXTENSION)
    named = [] if extension is None else extension.attributes.get('joint_order', '').split()
    return sorted(names, key=named.index) if set(names) <= set(named) else names


def _variable(
    tree: UrdfTree, name: str, moving: Sequence[UrdfJoint], leaders: dict[str, UrdfJoint]
) -> Variable:
    leader = read_joint(tree.joints[name])
    turns = leader.type != 'prismatic'
    ours = [joint for joint in moving if leaders[joint.name].mimics == name]
    others = [joint for joint in ours if (joint.type != 'prismatic') != turns]
    if others and (not turns or len(others) == len(ours)):
        does, named = ('turns', 'slides') if turns else ('slides', 'turns')
        others[0].element.refuse(
            f'it {said}, and {name!r}, which it mimics, {does}; a robot file can say that only of '
            'a joint that turns in the same chain (type: helical)'
        )
    kind = 'helical' if others else 'revolute' if turns else 'prismatic'
    return Variable(name, kind, leader.lower, leader.upper, leader.velocity)
