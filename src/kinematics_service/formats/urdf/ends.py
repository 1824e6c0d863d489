"""The links between which the chain of a URDF is taken where they are not named."""

import os
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ...errors import Fault
from ...robot.file.text.fault_report import quoted
from ...typography import listed
from .joints import MOVING, WHY_NOT
from .tree import UrdfTree, end_of

# Number of other tips that are named.
MOST_NAMED = 8


class ChainEnds(NamedTuple):
    """
    The links between which a chain is taken.

    Attributes
    ----------
    doubt
        Which other tips are possible, and how to ask for one; None where there is no other.
    """

    base: str
    tip: str
    doubt: Fault | None = None


class _LinkWay(NamedTuple):
    # The names of the joints that lead to a link, and the link where they begin.
    base: str
    joints: tuple[str, ...]


def chain_ends(tree: UrdfTree, base: str = '', tip: str = '') -> ChainEnds:
    """
    Return the base and the tip of a chain; what is not named is that of the longest chain.

    The base is the root, or the link below the last joint that moves freely. The tip is the end of
    the chain with the most moving joints, of limbs with equally many that of the first. Where
    these are the fingers of one hand, it is the farthest link that no finger moves.

    Parameters
    ----------
    base, tip
        Names of links; empty for those that are to be found.

    Raises
    ------
    UrdfError
        There is no such base, or no joint moves anything below it.
    """
    if tip:
        return ChainEnds(base or _way(tree, tip).base, tip)
    if base:
        tree.way(base, base)  # which refuses a link that does not exist
        base = base.removeprefix('/')
    parents = {end_of(joint, 'parent') for joint in tree.joints.values()}
    ways = {link: _way(tree, link, base) for link in tree.links if link not in parents}
    if base:
        ways = {link: way for link, way in ways.items() if way.base == base}
    moving = {link: _moving(tree, way.joints) for link, way in ways.items()}
    if not any(moving.values()):
        where = f'below {quoted(base)}' if base else 'in it'
        tree.root.refuse(f'no joint moves anything {where}')
    tip = _tip(tree, ways, moving)
    base = _way(tree, tip, base).base
    others = sorted(
        (link for link in ways if moving[link] and link != tip),
        key=moving.__getitem__,
        reverse=True,
    )
    if not others:
        return ChainEnds(base, tip)
    named = listed([f'{link} ({moving[link]})' for link in others], MOST_NAMED)
    joints = _moving(tree, _way(tree, tip, base).joints)
    return ChainEnds(
        base,
        tip,
        tree.root.fault(
            f'the chain taken is {base} to {tip}, with {joints} moving joints; other tips, and '
            f'their joints: {named}; to take the first of them, write '
            f'{tree.root.file}:{base}:{others[0]}'
        ),
    )


def _way(tree: UrdfTree, link: str, base: str = '') -> _LinkWay:
    joints: list[str] = []
    while link != base and (above := tree.above.get(link)):
        if not base and above[0].attributes.get('type') in WHY_NOT:
            break
        joints.append(above[0].attributes['name'])
        link = end_of(above[0], 'parent')
    return _LinkWay(link, tuple(reversed(joints)))


def _moving(tree: UrdfTree, joints: Sequence[str]) -> int:
    # Joints that mimic the same one are moved together.
    actuated = set()
    for joint in map(tree.joints.__getitem__, joints):
        if joint.attributes.get('type') in MOVING:
            mimic = joint.first('mimic')
            actuated.add(
                joint.attributes['name'] if mimic is None else mimic.attributes.get('joint')
            )
    return len(actuated)


def _tip(tree: UrdfTree, ways: Mapping[str, _LinkWay], moving: Mapping[str, int]) -> str:
    most = max(moving.values())
    ends = [link for link in ways if moving[link] == most]

    def common(links: Sequence[str]) -> tuple[str, ...]:
        return tuple(os.path.commonprefix([ways[link].joints for link in links]))

    # Those of the first limb.
    ends = [end for end in ends if 2 * _moving(tree, common([ends[0], end])) >= most]
    if len(ends) > 1:
        shared = common(ends)
        count, hand = len(shared), end_of(tree.joints[shared[-1]], 'child')
        ends = [
            link
            for link, way in ways.items()
            if way.joints[:count] == shared and moving[link] == _moving(tree, shared)
        ] or [hand]
    return max(ends, key=lambda link: len(_way(tree, link).joints))
