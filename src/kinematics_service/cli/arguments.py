# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Prepare the arguments of the command line before typer reads them."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from ..robot.bundled import TOPIC
from ..robot.file.translation import translator_of
from ..typography import plain_names

NUMBERS = re.compile(r'[-+]?(?:[\d.,]|pi)[\d.,eE+*/°pi-]*')
DESCRIPTION = '/robot_description'
TAKES_NUMBERS = ('--q', '--qdot', '--near', '--xyz', '--rpy', '--quaternion')


class Arguments(NamedTuple):
    """A command line in two parts: the arguments for this program, and the arguments for ROS."""

    ours: list[str]
    ros: list[str]


class WrongArguments(Exception):
    """Two options exclude each other, or an option has no value. The message names the options."""


def split_ros_arguments(argv: Sequence[str]) -> Arguments:
    """
    Split a command line into the arguments for typer and the arguments for rclpy.

    The arguments for rclpy go from `--ros-args` to `--` or to the end.
    """
    ours: list[str] = []
    ros: list[str] = []
    current = ours
    for argument in argv:
        if argument == '--ros-args':
            current = ros
        elif argument == '--' and current is ros:
            ros.append(argument)
            current = ours
            continue
        current.append(argument)
    return Arguments(ours, ros)


def join_numbers(argv: Sequence[str]) -> list[str]:
    """
    Join the numbers after an option such as `--q` to one argument; return all arguments.

    `--q 0.1, -0.2 0.3` becomes `--q`, `0.1, -0.2 0.3`.
    """
    joined: list[str] = []
    numbers_may_follow = False
    for argument in argv:
        if numbers_may_follow and NUMBERS.fullmatch(plain_names(argument)):
            if joined[-1] in TAKES_NUMBERS:
                joined.append(argument)
            else:
                joined[-1] += f' {argument}'
            continue
        joined.append(argument)
        numbers_may_follow = argument.partition('=')[0] in TAKES_NUMBERS
    return joined


def name_robots(argv: Sequence[str]) -> list[str]:
    """
    Return all arguments, with base and tip link joined to the argument that names the robot.

    `arm.urdf --base a --tip b` becomes `arm.urdf:a:b`. `--robot-description` becomes
    `--robot topic:/robot_description`, and with `--base a --tip b` it becomes
    `--robot topic:/robot_description:a:b`.

    Raises
    ------
    WrongArguments
        A link is missing, or the arguments do not contain exactly one URDF or topic.
    """
    named: list[str] = []
    ends = {'--base': '', '--tip': ''}
    words = iter(_with_topics(argv))
    for word in words:
        option, equals, link = word.partition('=')
        if option not in ends:
            named.append(word)
            continue
        ends[option] = link if equals else next(words, '')
        if not ends[option]:
            raise WrongArguments(f'{option}: write the name of a link after it')
    if not any(ends.values()):
        return named
    places = [i for i, word in enumerate(named) if translator_of(word) or TOPIC in word]
    if len(places) != 1:
        raise WrongArguments('--base and --tip are links of a URDF; give one URDF with them')
    named[places[0]] += f':{ends["--base"]}:{ends["--tip"]}'
    return named


def _with_topics(argv: Sequence[str]) -> list[str]:
    words: list[str] = []
    for word in argv:
        option, _, topic = word.partition('=')
        if option == '--robot-description':
            words += ['--robot', f'{TOPIC}{topic or DESCRIPTION}']
        elif words and words[-1] == f'{TOPIC}{DESCRIPTION}' and not word.startswith('-'):
            words[-1] = f'{TOPIC}{word}'
        else:
            words.append(word)
    return words
