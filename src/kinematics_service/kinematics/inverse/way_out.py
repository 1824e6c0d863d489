"""The way out for a twist that the arm has lost: a motion of one joint that gives it back."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...kernel import Floats
from ...robot.robot import Robot
from ..tool_state import evaluate
from .servo import DEFAULTS, ServoSettings, joint_velocity

# Motions tried, in rad, or for prismatic joints in shares of the length: the least one that does.
TRIED = (0.05, 0.1, 0.2, 0.4)


class WayOut(NamedTuple):
    """A joint, and how far it must move (rad or m) until nothing is damped."""

    joint: str
    motion: float


def way_out_for(
    robot: Robot,
    q: npt.ArrayLike,
    twist: npt.ArrayLike,
    settings: ServoSettings = DEFAULTS,
) -> WayOut | None:
    """
    Return a least motion of one joint, inside its limits, after which a twist is not damped.

    Each is evaluated, rather than estimated from here: at a singular pose a first order may know
    no way. None where none of them leads out.

    Parameters
    ----------
    robot
        The arm.
    q : shape (n,), rad or m
        Joint positions.
    twist : shape (6,), m/s and rad/s
        Wanted, in base axes, as for `joint_velocity`.
    settings
        Damping, limits, rows.
    """
    here = np.array(q, dtype=np.float64)
    low, high = robot.limits.T
    for size in TRIED:
        best, found = 0.0, None
        for j, motion in enumerate(size * robot.singularity.task.column_scales):
            for signed in (motion, -motion):
                there = _moved(here, j, signed)
                if not low[j] <= there[j] <= high[j]:
                    continue
                step = joint_velocity(robot, evaluate(robot, there), twist, settings)
                if step.damping == 0.0 and step.smallest_singular_value > best:
                    best = step.smallest_singular_value
                    found = WayOut(robot.joint_names[j], float(signed))
        if found is not None:
            return found
    return None


def _moved(q: Floats, j: int, motion: float) -> Floats:
    there = q.copy()
    there[j] += motion
    return there
