"""Preparation of the command line before typer reads it."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from ..typography import plain_names

NUMBERS = re.compile(r'[-+]?(?:[\d.,]|pi)[\d.,eE+*/°pi-]*')
TAKES_NUMBERS = ('--q', '--qdot', '--near', '--xyz', '--rpy', '--quaternion')


class Arguments(NamedTuple):
    """A command line in two parts: ours, and ROS's own."""

    ours: list[str]
    ros: list[str]


def split_ros_arguments(argv: Sequence[str]) -> Arguments:
    """
    Return what is typer's and what is rclpy's: from each `--ros-args` on, up to a `--` or the end.
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
    Return the arguments with the numbers after --q, --xyz and the like joined into one.

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
