"""The arms of one process: which robot runs in which namespace."""

import re
from collections.abc import Sequence
from pathlib import PurePath
from typing import NamedTuple

from ...errors import ArmsError

# A namespace as ROS accepts it, without the leading slash.
NAMESPACE = re.compile(r'/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*')


class ArmChoice(NamedTuple):
    """A robot (file, bundled name, or None for the parameter `robot`) and its namespace."""

    robot: str | None
    namespace: str | None


def arms_from(choices: Sequence[str]) -> tuple[ArmChoice, ...]:
    """
    Return the arms that values of `--robot` name: `ROBOT`, or `NAMESPACE=ROBOT`.

    Of several arms each one without a namespace gets the name of its robot.

    Raises
    ------
    ArmsError
        A namespace is none, or two arms have the same.
    """
    if not choices:
        return (ArmChoice(None, None),)
    arms = [_arm(choice) for choice in choices]
    if len(arms) == 1:
        return tuple(arms)
    arms = [
        arm if arm.namespace else arm._replace(namespace=_named_after(str(arm.robot)))
        for arm in arms
    ]
    spaces = [arm.namespace for arm in arms]
    for arm in arms:
        if spaces.count(arm.namespace) > 1:
            raise ArmsError(
                f'two arms in the namespace {arm.namespace}: '
                f'write --robot NAMESPACE={arm.robot}, each with its own'
            )
    return tuple(arms)


def _arm(choice: str) -> ArmChoice:
    space, equals, robot = choice.partition('=')
    if not equals or '/' in space.lstrip('/') and not NAMESPACE.fullmatch(space):
        return ArmChoice(choice, None)
    if not NAMESPACE.fullmatch(space):
        raise ArmsError(
            f'--robot {choice}: {space!r} is not a namespace (letters, digits, _ and /)'
        )
    if not robot:
        raise ArmsError(f'--robot {choice}: no robot after the namespace')
    return ArmChoice(robot, '/' + space.lstrip('/'))


def _named_after(robot: str) -> str:
    return '/' + re.sub(r'[^A-Za-z0-9_]|^(?=[0-9])', '_', PurePath(robot).stem)
