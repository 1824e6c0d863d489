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
from ..problem.plan import SixSolver, closed_solvers, eliminating_solver, one_to_one, plan_for
from ..problem.screws import Screws, screws_of
from ..problem.target import TOOL_AXES

# The tool's rotation at which slices for a position are solved: any at which the three joints that
# are added about the tool's origin are regular.
ADDED_ROTATION = turn_about(np.array([0.48, 0.6, 0.64]), 1.1)


class SlicedArm(NamedTuple):
    """
    An arm with one joint more than its target asks for.

    Attributes
    ----------
    robot
        The arm.
    screws
        Of the arm, and of the joint that is added for a direction.
    to_joints : shape (k, joints)
        Positions of the screws times this are those of the joints.
    whole
        Whether the rotation counts.
    held
        Which of the screws is held in its slices.
    six
        The others, and for a position three about the tool's origin; None if they have no solver.
    """

    robot: Robot
    screws: Screws
    to_joints: Floats
    whole: bool
    held: int = 0
    six: SixSolver | None = None

    def solutions(self, pose: Floats, position: float) -> Floats:
        """Return joint positions (m, n) of solutions, the screw that is held at a position."""
        if self.six is None:
            return np.empty((0, self.robot.dof))
        psi, _ = self.six.candidates(self.motion_of_six(pose, position))
        psi, held = psi[:, : len(self.screws.axes) - 1], np.full((len(psi), 1), position)
        psi = np.hstack([psi, held] if self.held else [held, psi])
        return np.asarray(psi @ self.to_joints)

    def motion_of_six(self, pose: Floats, position: float) -> Floats:
        """Return the motion (4, 4) from rest that is left to six screws, the other one held."""
        screws, turn = self.screws, np.eye(4)
        turn[:3, :3] = turn_about(screws.axes[self.held], -position)
        turn[:3, 3] = screws.points[self.held] - turn[:3, :3] @ screws.points[self.held]
        motion = pose @ inverse(screws.home)
        motion = motion @ turn if self.held else turn @ motion
        if not self.whole:
            goal = motion[:3, :3] @ screws.tool + motion[:3, 3]
            motion[:3, :3] = ADDED_ROTATION
            motion[:3, 3] = goal - ADDED_ROTATION @ screws.tool
        return np.asarray(motion)


@functools.lru_cache(maxsize=128)
def sliced_arm_of(robot: Robot, rows: tuple[str, ...], axis: str) -> SlicedArm | None:
    """Return the arm for the rows that count; None where it is not one whose curves are known."""
    screws = None if robot.chain.loops else screws_of(robot.chain)
    position, whole = rows == ROW_NAMES[:3], bool(axis) or rows == ROW_NAMES
    if screws is None or not one_to_one(screws, robot) or not (position or rows == ROW_NAMES):
        return None
    if plan_for(robot, rows, axis).overdetermined:
        # A plane arm: more than one of its joints are left.
        return None
    if axis:
        screws = with_turn(screws, screws.home[:3, TOOL_AXES.index(axis)], screws.tool)
    if len(screws.axes) != (7 if whole else 4):
        return None
    to_joints = np.asarray(np.linalg.inv(screws.coupling).T[:, : robot.dof])
    arm = SlicedArm(robot, screws, to_joints, whole)
    ways = (sliced(arm, held) for held in ((6, 0) if whole else (0,)))
    return next((one for one in ways if one.six is not None), arm)


def sliced(arm: SlicedArm, held: int) -> SlicedArm:
    """Return an arm with a screw at an end held, if that turns, and the solver of the others."""
    robot, screws = arm.robot, arm.screws
    if screws.slides[held]:
        return arm
    others = np.arange(len(screws.axes)) != held
    axes, points = screws.axes[others], screws.points[others]
    slides = [one for one, other in zip(screws.slides, others) if other]
    if not arm.whole:
        axes, points = np.vstack([axes, np.eye(3)]), np.vstack([points, [screws.tool] * 3])
        slides += [False] * 3
    six, arm = Screws(axes, points, tuple(slides), np.eye(6), np.eye(4)), arm._replace(held=held)
    solver = next(closed_solvers(six), None)
    if solver is None:
        q = seeded_poses(robot.limits, robot.prismatic)[:8]
        places = q @ screws.coupling[held, : robot.dof]
        poses = zip(forward_kinematics(robot, q), places.tolist())
        motions = np.array([arm.motion_of_six(pose, place) for pose, place in poses])
        solver = eliminating_solver(six, motions)
    return arm._replace(six=solver)
