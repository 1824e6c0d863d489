"""
An arm with one joint more than its target asks for, and its slices: that joint held.

Held at the arm's end, it leaves six joints whose geometry is the same at every position of it:
only their target moves. Where only the direction of a tool's axis counts, a joint about that axis
is added; where only the position counts, three about the tool's origin, which slices alone have.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from ....kernel import Floats
from ....rigid_motion import inverse, turn_about
from ....robot.robot import Robot
from ....robot.task import ROW_NAMES, seeded_poses
from ...forward import forward_kinematics
from ..problem.chain_geometry import with_turn
from ..problem.plan import SixSolver, closed_solvers, eliminating_solver, one_to_one
from ..problem.screws import Screws, screws_of
from ..problem.target import TOOL_AXES

# The tool's rotation at which slices for a position are solved: any at which the three joints that
# are added about the tool's origin are regular.
ADDED_ROTATION = turn_about(np.array([0.48, 0.6, 0.64]), 1.1)


class Slices(NamedTuple):
    """
    The slices of an arm by a joint at one of its ends.

    Attributes
    ----------
    joint
        Which of the screws is held.
    six
        The others, and for a position three about the tool's origin.
    """

    joint: int
    six: SixSolver


class SlicedArm(NamedTuple):
    """
    An arm with one joint more than its target asks for.

    Attributes
    ----------
    robot
        The arm.
    screws
        Of the arm, and of the joint that is added for a direction.
    whole
        Whether the rotation counts.
    slices
        The slices by the joint that is held; None if the others cannot be solved.
    """

    robot: Robot
    screws: Screws
    whole: bool
    slices: Slices | None

    def solutions(self, slices: Slices, pose: Floats, position: float) -> Floats:
        """Return joint positions (m, n) in a slice, its screw held at a position."""
        psi, _ = slices.six.candidates(self.motion_of_six(slices.joint, pose, position))
        held = np.full((len(psi), 1), position)
        psi = psi[:, : len(self.screws.axes) - 1]
        psi = np.hstack([held, psi] if slices.joint == 0 else [psi, held])
        return np.asarray(psi @ np.linalg.inv(self.screws.coupling).T[:, : self.robot.dof])

    def motion_of_six(self, held: int, pose: Floats, position: float) -> Floats:
        """Return the motion (4, 4) from rest that is left to six screws, the other one held."""
        screws, turn = self.screws, np.eye(4)
        turn[:3, :3] = turn_about(screws.axes[held], -position)
        turn[:3, 3] = screws.points[held] - turn[:3, :3] @ screws.points[held]
        motion = pose @ inverse(screws.home)
        motion = turn @ motion if held == 0 else motion @ turn
        if not self.whole:
            goal = motion[:3, :3] @ screws.tool + motion[:3, 3]
            motion[:3, :3] = ADDED_ROTATION
            motion[:3, 3] = goal - ADDED_ROTATION @ screws.tool
        return np.asarray(motion)


@functools.lru_cache(maxsize=128)
def sliced_arm_of(robot: Robot, rows: tuple[str, ...], axis: str) -> SlicedArm | None:
    """Return the arm for the rows that count; None where it is not one whose curves are known."""
    if robot.chain.loops:
        return None
    screws = screws_of(robot.chain)
    if not one_to_one(screws, robot):
        return None
    if axis and rows == ROW_NAMES[:3]:
        along = screws.home[:3, TOOL_AXES.index(axis)]
        screws = with_turn(screws, along, screws.tool)
    whole = bool(axis) or rows == ROW_NAMES
    if len(screws.axes) != (7 if whole else 4) or (not whole and rows != ROW_NAMES[:3]):
        return None
    arm = SlicedArm(robot, screws, whole, None)
    for held in (len(screws.axes) - 1, 0) if whole else (0,):
        if not screws.slides[held] and (slices := slices_of(arm, held)) is not None:
            return arm._replace(slices=slices)
    return arm


def slices_of(arm: SlicedArm, held: int) -> Slices | None:
    """Return the slices of an arm, a turning screw at an end held, or None without a solver."""
    robot, screws = arm.robot, arm.screws
    others = np.arange(len(screws.axes)) != held
    axes, points, slides = (
        screws.axes[others],
        screws.points[others],
        np.array(screws.slides)[others],
    )
    if not arm.whole:
        axes, points = np.vstack([axes, np.eye(3)]), np.vstack([points, [screws.tool] * 3])
    six = Screws(axes, points, (*slides.tolist(), False, False, False)[:6], np.eye(6), np.eye(4))
    solver = next(closed_solvers(six), None)
    if solver is None:
        motions = []
        for q in seeded_poses(robot.limits, robot.prismatic)[:8]:
            position = float(screws.coupling[held, : robot.dof] @ q)
            motions.append(arm.motion_of_six(held, forward_kinematics(robot, q), position))
        solver = eliminating_solver(six, np.array(motions))
    return None if solver is None else Slices(held, solver)
