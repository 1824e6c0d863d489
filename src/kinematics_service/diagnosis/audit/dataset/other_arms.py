"""Poses that are another arm's: of the dataset, or of another model."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ....kernel import Floats
from ....robot.measures import Level
from ....robot.robot import Robot
from ...frame_check.errors import Errors, PoseLimit
from ...frame_check.other_robots import explains, left_by, other_robot
from ..findings import Finding


class OtherState(NamedTuple):
    """Joint positions (N, n), rad or m, of another arm at the times of poses."""

    label: str
    q: Floats


def other_findings(
    robot: Robot,
    poses: Floats,
    errors: Errors,
    others: Sequence[OtherState],
    q: Floats,
    limit: PoseLimit,
) -> Iterator[Finding]:
    """
    Yield a finding if poses are explained by another arm's state, or by another robot.

    Parameters
    ----------
    poses : shape (N, 4, 4)
    errors
        What remains with this arm's state.
    others
        States of the dataset's other arms.
    q : shape (N, n), rad or m
        This arm's state.
    limit
        What instrument and nominal table can leave.
    """
    tried = [
        (f'the poses are those of the {one.label} arm', left_by(robot, one.q, poses))
        for one in others
        if one.q.shape == q.shape
    ]
    model = other_robot(robot, errors, q, poses, limit)
    if model is not None:
        tried.append((f'the poses are those of the robot {model.name}', model.left))
    good = [
        (text, left) for text, left in tried if left is not None and explains(left, errors, limit)
    ]
    if good:
        text, left = min(good, key=lambda one: one[1].position_rms)
        yield Finding(
            Level.ERROR, f'{text[0].upper()}{text[1:]}: with its joints {left.in_words()} remain.'
        )
