# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Solve slices of an arm with one redundant joint. In a slice, the first or the last joint is held,
and the other joints are solved.

The solver needs seven joints: one is held, six are solved. It adds the joints that the arm lacks:

- The target is a pose: the arm has seven joints, and none is added.
- The target is a position and the direction of a tool axis: the arm has six joints, and a joint
  about the tool axis is added.
- The target is a position: the arm has four joints, and three rotations are added, whose axes meet
  at the tool's origin.

The position of the held joint changes only the target of the six joints, not their geometry.
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

# Rotation of the tool for a target that is only a position. The solver then adds three joints
# about the tool's origin. The rotation is arbitrary, but the three joints are not singular at it.
ADDED_ROTATION = turn_about(np.array([0.48, 0.6, 0.64]), 1.1)


class SlicedArm(NamedTuple):
    """
    An arm with one redundant joint, and a solver for the arm with one joint held (a slice).

    Attributes
    ----------
    robot
        The arm.
    screws
        Joint screws of the arm. If the target gives a direction instead of a rotation, the last
        screw is an added joint about the tool axis.
    to_joints : shape (k, joints)
        Matrix that converts the angles or displacements psi of the screws to joint positions: q =
        psi @ to_joints, with row vectors.
    whole
        Whether the target has a rotation or a direction in addition to a position.
    held
        Index of the screw whose joint is held, the first or the last.
    six
        Solver for six screws: all screws except the held one. If the target is only a position,
        three of the six are added rotations about the tool's origin. None if no solver was found.
    """

    robot: Robot
    screws: Screws
    to_joints: Floats
    whole: bool
    held: int = 0
    six: SixSolver | None = None

    def solutions(self, pose: Floats, position: float) -> Floats:
        """
        Return all solutions (m, n) with the tool at `pose` and the held joint at `position`.

        The held joint is screw number `held`; its position is in rad.
        """
        if self.six is None:
            return np.empty((0, self.robot.dof))
        psi, _ = self.six.candidates(self.motion_of_six(pose, position))
        psi, held = psi[:, : len(self.screws.axes) - 1], np.full((len(psi), 1), position)
        psi = np.hstack([psi, held] if self.held else [held, psi])
        return np.asarray(psi @ self.to_joints)

    def motion_of_six(self, pose: Floats, position: float) -> Floats:
        """
        Return the motion (4, 4) with which the six solved screws bring the tool to `pose`.

        The six screws start at zero. The seventh screw, number `held`, is held at the angle
        `position`, rad.
        """
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
    """
    Return an arm with a solver that holds one joint and solves the others.

    The targets prescribe the pose components `rows`, some of x y z rx ry rz, and the direction of
    the tool axis `axis`. If the arm does not have exactly one redundant joint for these targets,
    returns None.
    """
    screws = None if robot.chain.loops else screws_of(robot.chain)
    position, whole = rows == ROW_NAMES[:3], bool(axis) or rows == ROW_NAMES
    if screws is None or not one_to_one(screws, robot) or not (position or rows == ROW_NAMES):
        return None
    if plan_for(robot, rows, axis).overdetermined:
        # Refuse a planar arm, because it has more than one redundant joint.
        return None
    if axis:
        screws = with_turn(screws, screws.home[:3, TOOL_AXES.index(axis)], screws.tool)
    if len(screws.axes) != (7 if whole else 4):
        return None
    to_joints = np.asarray(np.linalg.inv(screws.coupling).T[:, : robot.dof])
    arm = SlicedArm(robot, screws, to_joints, whole)
    variants = (sliced(arm, held) for held in ((6, 0) if whole else (0,)))
    return next((variant for variant in variants if variant.six is not None), arm)


def sliced(arm: SlicedArm, held: int) -> SlicedArm:
    """
    Return the arm with a solver for all screws except number `held`, which is the first or the
    last screw.

    If the joint of this screw is prismatic, the arm is returned unchanged.
    """
    robot, screws = arm.robot, arm.screws
    if screws.slides[held]:
        return arm
    others = np.arange(len(screws.axes)) != held
    axes, points = screws.axes[others], screws.points[others]
    slides = [slide for slide, other in zip(screws.slides, others) if other]
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
