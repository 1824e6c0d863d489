"""Poses that are another arm's: of the dataset, or of another model."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ....errors import KinematicsError
from ....kernel import Floats
from ....kinematics.tool_state import evaluate
from ....robot.bundled import bundled_robots
from ....robot.measures import Level
from ....robot.robot import Robot, load_robot
from ...frame_check.errors import Errors, PoseLimit, errors_of
from ...frame_check.offsets import fit_offsets
from ..findings import Finding

# Another arm is named if it leaves so many times less than this one.
LESS = 3.0


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
        (f'the poses are those of the {one.label} arm', robot, one.q)
        for one in others
        if one.q.shape == q.shape
    ]
    tried += [
        (f'the poses are those of the robot {name}', other, q)
        for name, other in _robots_like(robot)
    ]
    found = [(text, _left(other, state, poses)) for text, other, state in tried]
    good = [
        (text, left)
        for text, left in found
        if left is not None
        and left.within(limit)
        and LESS * left.position_rms < errors.position_rms
    ]
    if good:
        text, left = min(good, key=lambda one: one[1].position_rms)
        yield Finding(
            Level.ERROR, f'{text[0].upper()}{text[1:]}: with its joints {left.in_words()} remain.'
        )


def _robots_like(robot: Robot) -> Iterator[tuple[str, Robot]]:
    for name in bundled_robots():
        other = load_robot(name)
        same = other.dof == robot.dof and np.array_equal(other.prismatic, robot.prismatic)
        if same and other.name != robot.name:
            yield name, other


def _left(robot: Robot, q: Floats, poses: Floats) -> Errors | None:
    try:
        A = evaluate(robot, q).pose
    except KinematicsError:
        return None
    fit = fit_offsets(A[None], poses[None]).one(0)
    return errors_of(fit.position, fit.rotation)
