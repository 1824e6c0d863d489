# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Choose base and tip of a URDF's chain: the longest chain of moving joints before a hand."""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from ...errors import Fault
from ...typography import listed
from ..file.parts.joints import MAX_JOINTS
from ..file.text.fault_report import quoted
from .document import XmlElement
from .joints import MOVING, WHY_NOT
from .tree import UrdfTree, end_of

# A message lists at most this number of links or joints: the links that could be the tip but were
# not chosen, or the joints that were cut off.
MAX_NAMED_TIPS = 8
# Words in the names of joints and links that show whether a joint belongs to a hand. FINGER and
# GRIPPER match joints of a hand, or the links that such joints move. GRIPPER is used only for the
# last joints of a chain. ARM matches joints that move the whole hand and do not belong to it.
# STILL matches links that are fixed in the hand, not fingers.
FINGER = re.compile(r'finger|thumb|jaw|claw|knuckle', re.IGNORECASE)
GRIPPER = re.compile(r'gripper', re.IGNORECASE)
ARM = re.compile(
    r'wrist|roll|pitch|yaw|rotat|twist|flex|turn|exten|to_?(grip|hand)', re.IGNORECASE
)
STILL = re.compile(r'fixed|static|(base|palm)$', re.IGNORECASE)
# Words in the names of links that are probably the tool.
TOOL = re.compile(r'tool|tcp|effector|flange|grasp|(?<![a-z])eef?(?![a-z])|gripper_?frame', re.I)
# Two branches with equally many moving joints count as fingers if each has at most this many.
# Branches with more joints may be arms, because an arm needs three joints to reach a point.
MAX_FINGER_JOINTS = 2


class ChainEnds(NamedTuple):
    """
    The base and tip link of the chain that is read from a URDF.

    Attributes
    ----------
    doubts
        Warnings about other possible tips, and about joints that no chain can contain.
    """

    base: str
    tip: str
    doubts: tuple[Fault, ...] = ()


class _LinkPath(NamedTuple):
    # The path to a link: the link where the path begins, the number of its joints, and the names
    # of its moving joints.
    base: str
    length: int
    moving: tuple[str, ...]


def chain_ends(tree: UrdfTree, base: str = '', tip: str = '') -> ChainEnds:
    """
    Return the base and tip link of a URDF chain, and choose a link that the user did not name.

    The base is the root, or the link below the last floating or planar joint. The tip is at the
    end of the chain with the most moving joints, without the joints of a hand. If several limbs
    have equally many moving joints, the tip is at the end of the first limb. After the last moving
    joint there may be several links, connected by fixed joints. Then the tip is a link whose name
    has a word for a tool (`tool`, `tcp`, `flange`). If no name has such a word, the tip is the
    farthest link. A hand begins

    1. at a joint whose name has the word finger, thumb, jaw, claw or gripper;
    2. at a link that carries a fixed link whose name has a word for a tool, unless another tool is
       farther along the arm;
    3. at a link with three or more similar branches, or with two branches of one or two moving
       joints each. Two longer branches may be two arms on a torso.

    In cases 2 and 3, no branch after the link may have more moving joints than the path from the
    base to the link. Otherwise the branches are limbs.

    Parameters
    ----------
    base, tip
        Names of links; an empty name if the function chooses the link.

    Raises
    ------
    UrdfError
        A link of this name does not exist, no joint moves a link below it, or the tree has two
        branches that may be limbs or fingers.
    """
    if tip:
        path = _path_to(tree, tip, base)
        return ChainEnds(base or path.base, tip, () if base else tuple(_cuts(tree, [path])))
    if base:
        tree.path(base, base)  # raises an error if the tree has no link `base`
        base = base.removeprefix('/')
    kept = [joint for joint in tree.joints.values() if joint.attributes.get('type') not in WHY_NOT]
    parents = {end_of(joint, 'parent') for joint in kept}
    paths = {link: _path_to(tree, link, base) for link in tree.links if link not in parents}
    if base:
        paths = {link: path for link, path in paths.items() if path.base == base}
    moving = {link: _count(tree, path.moving) for link, path in paths.items()}
    if not any(moving.values()):
        where = f'below {quoted(base)}; give another base' if base else 'in the file'
        tree.root.refuse(f'no moving joint {where}', 'no-effect')
    tip, hand = _tip(tree, paths)
    cuts = () if base else tuple(_cuts(tree, [paths[link] for link in paths if moving[link]]))
    path = _path_to(tree, tip, base)
    others = [link for link in paths if moving[link] and link != tip]
    others.sort(key=moving.__getitem__, reverse=True)
    if not others:
        return ChainEnds(path.base, tip, cuts)
    named = listed([f'{link} ({moving[link]})' for link in others], MAX_NAMED_TIPS)
    ends = f' before {quoted(hand)}, the first one of a hand' if hand else ''
    choice = tree.root.fault(
        f'the chain is {path.base} to {tip}, with {_count(tree, path.moving)} moving joints'
        f'{ends}; other tips, and their joints: {named}; to take the first of them, write '
        f'{tree.root.file}:{paths[others[0]].base}:{others[0]}',
        'chosen-chain',
    )
    return ChainEnds(path.base, tip, (choice, *cuts))


def _cuts(tree: UrdfTree, paths: Sequence[_LinkPath]) -> Iterator[Fault]:
    # Yield a fault for each floating or planar joint that has moving joints both above and below
    # it in the tree.
    for base in dict.fromkeys(path.base for path in paths):
        for joint in tree.above.get(base, ())[:1]:
            if above := _path_to(tree, end_of(joint, 'parent')).moving:
                yield joint.fault(
                    f'a {joint.attributes["type"]} joint, which a robot file cannot have, cuts '
                    f'the chain: {listed(above, MAX_NAMED_TIPS)} above it and the joints below it '
                    'cannot be one arm',
                    'unsupported',
                )


def _path_to(tree: UrdfTree, link: str, base: str = '') -> _LinkPath:
    joints: list[XmlElement] = []
    while link != base and (above := tree.above.get(link)):
        if not base and above[0].attributes.get('type') in WHY_NOT:
            break
        joints.append(above[0])
        link = end_of(above[0], 'parent')
    moving = [joint for joint in reversed(joints) if joint.attributes.get('type') in MOVING]
    return _LinkPath(link, len(joints), tuple(joint.attributes['name'] for joint in moving))


def _count(tree: UrdfTree, joints: Sequence[str]) -> int:
    # Return the number of independent joints: several joints that mimic one joint count as one.
    pairs = [(name, tree.joints[name].first('mimic')) for name in joints]
    return len({name if mimic is None else mimic.attributes.get('joint') for name, mimic in pairs})


def _tip(tree: UrdfTree, paths: Mapping[str, _LinkPath]) -> tuple[str, str]:
    # Return the tip link of the arm, and the name of the first joint of the hand after the tip, or
    # ''.
    arms = {link: path.moving[: _before_hand(tree, path.moving)] for link, path in paths.items()}
    leaf = max(arms, key=lambda link: (_count(tree, arms[link]), _count(tree, paths[link].moving)))
    count = _before_branches(tree, paths, leaf, arms[leaf])
    arm = arms[leaf][:count]
    links = [link for link, path in paths.items() if path.moving[:count] == arm]
    first = next((paths[link].moving[count] for link in links if paths[link].moving != arm), '')
    ends = [link for link in links if paths[link].moving == arm]
    if not ends:
        return end_of(tree.joints[first], 'parent'), first

    def rank(link: str) -> tuple[bool, bool, int]:
        return bool(TOOL.search(link)), not FINGER.search(link), paths[link].length

    return max(ends, key=rank), first


def _before_hand(tree: UrdfTree, path: Sequence[str]) -> int:
    # Return the number of joints in a path that come before the joints of a hand. The joints of a
    # hand are found by their names. If all joints have such names, return the number of all
    # joints.
    count = len(path)
    while count and _of_hand(tree.joints[path[count - 1]], GRIPPER):
        count -= 1
    fingers = (k for k, name in enumerate(path) if _of_hand(tree.joints[name], FINGER))
    return min(count, next(fingers, count)) or len(path)


def _of_hand(joint: XmlElement, word: re.Pattern[str]) -> bool:
    name, link = joint.attributes['name'], end_of(joint, 'child')
    if FINGER.search(name):
        return 'fixed' not in name.lower()
    moved = FINGER.search(link) and not STILL.search(link)
    return not ARM.search(name) and bool(word.search(name) or moved)


def _before_branches(
    tree: UrdfTree, paths: Mapping[str, _LinkPath], leaf: str, arm: tuple[str, ...]
) -> int:
    # Return the number of joints in the arm before a hand. The hand is found by its branches or by
    # a tool link, not by names of joints. If no hand is found, return the number of all joints.
    of_fingers = arm and _of_hand(tree.joints[arm[0]], GRIPPER)
    for k in range(1, 0 if of_fingers else min(len(arm), MAX_JOINTS)):
        chains = {link: path.moving for link, path in paths.items() if path.moving[:k] == arm[:k]}
        shared, fingers = _count(tree, arm[:k]), dict[str, int]()
        for chain in chains.values():
            if more := _count(tree, chain) - shared:
                fingers[chain[k]] = max(more, fingers.get(chain[k], 0))
        tools = {chain[: k + 1] for link, chain in chains.items() if TOOL.search(link)}
        smallest, largest = min(fingers.values(), default=0), max(fingers.values(), default=0)
        if any(_of_hand(tree.joints[joint], FINGER) for joint in fingers):
            return k
        if largest > shared or arm[: k + 1] in tools:
            # No hand begins directly after joint k, for one of two reasons. A branch after joint k
            # has more moving joints than the path to joint k, so the branch is a limb and not a
            # finger. Or a tool link is farther along the arm.
            continue
        similar = len(fingers) > 1 and smallest >= largest - 1
        short = smallest == largest <= MAX_FINGER_JOINTS
        if arm[:k] in tools or (similar and (len(fingers) > 2 or short)):
            return k
        if similar:
            begin = f'{tree.root.file}:{paths[leaf].base}'
            hand = end_of(tree.joints[arm[k]], 'parent')
            tree.root.refuse(
                f'{" and ".join(map(quoted, fingers))} are joints of fingers or of limbs; for '
                f'fingers write {begin}:{hand}, for limbs {begin}:{leaf}',
                'ambiguous',
            )
    return len(arm)
