# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Suggest parameters that map the joint names in messages to the joints of the arm."""

import difflib
import re
from collections.abc import Iterator, Sequence
from functools import lru_cache

from ..estimation import outcomes
from ..estimation.estimator import Estimator
from ..robot.bundled import bundled_robots
from ..robot.robot import Robot
from ..typography import listed

# Largest number of names listed in a sentence.
MAX_NAMES = 8
# Largest number of joints for which the node guesses, from similar names, which received name
# belongs to which joint. The number is limited, because a guess for 128 joints would take 1 s.
MAX_GUESSED_JOINTS = 16
# Matches a name that needs no quotes in a sentence and in a command line.
PLAIN = re.compile(r'[\w/.:#+-]{1,60}')
# Matches the name of a joint in a bundled robot file. The search in all files takes 2 ms, but a
# YAML parser would take 0.6 s.
JOINT = re.compile(r'^ +- \{name: ([^ ,}]+),.*\btype: ', re.MULTILINE)


def unmatched_in_words(arm: Estimator, topic: str) -> str:
    """
    Return a text with suggested parameters if no message on a topic names a joint of the arm.

    Return an empty text before the first message, and after a message that names a joint.
    """
    lists, count = arm.joints.unmatched(), arm.counts[outcomes.NOT_OURS]
    beginning = f'{count} messages on {topic} name no joint of {arm.robot.name}: '
    return beginning + _in_words(arm.robot, lists) if lists else ''


@lru_cache(maxsize=4)
def _in_words(robot: Robot, lists: tuple[tuple[str, ...], ...]) -> str:
    names = list(dict.fromkeys(name for message_names in lists for name in message_names))
    remedies = ' or '.join(_remedies(robot, lists, list(filter(PLAIN.fullmatch, names))))
    remedy = f'try {remedies}' if remedies else 'map them with joint_names'
    if not remedies and len(names) < robot.dof:
        remedy = 'these are too few for its joints: is another device on this topic?'
    return f'they name {shown(names)}; expected {shown(robot.joint_names)}; {remedy}'


def shown(names: Sequence[str]) -> str:
    """Return at most MAX_NAMES names as text, with quotes around names that need quotes."""
    plain = (name if PLAIN.fullmatch(name) else ascii(name[:60]) for name in names)
    return listed(list(plain), MAX_NAMES) or 'nothing'


def _remedies(robot: Robot, lists: Sequence[Sequence[str]], received: list[str]) -> Iterator[str]:
    joint_names = [joint.name for joint in robot.description.joints]
    if prefixes := _prefixes(joint_names, received):
        for prefix in prefixes:
            option = f'-p joint_prefix:={prefix}'
            yield option if prefix else 'without joint_prefix and joint_names'
        return
    others = [
        (len(joints), not prefix, f'--robot {name}' + (prefix and f' -p joint_prefix:={prefix}'))
        for name, file in bundled_robots().items()
        for joints in [JOINT.findall(file.read_text('utf-8'))]
        for prefix in _prefixes(joints, received)[:1]
    ]
    yield from (option for *rank, option in others if rank == list(max(others)[:2]))
    for names in lists:
        if (
            set(names) <= set(received)
            and len(set(names)) == len(names) == len(joint_names) <= MAX_GUESSED_JOINTS
        ):
            similar = [difflib.get_close_matches(name, names, 1, 0.0)[0] for name in joint_names]
            is_order = len(set(similar)) == len(joint_names)
            if is_order or not others:
                order = similar if is_order else list(names)
                yield f'-p "joint_names:={order}" (this order is a guess: check it)'


def _prefixes(joints: Sequence[str], received: Sequence[str]) -> list[str]:
    # Return each prefix such that the messages contain the name prefix + joint for every joint.
    ends = [name.removesuffix(joints[0]) for name in received if name.endswith(joints[0])]
    return [prefix for prefix in ends if all(prefix + joint in received for joint in joints)]
