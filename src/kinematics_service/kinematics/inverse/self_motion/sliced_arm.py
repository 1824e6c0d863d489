"""
An arm with one joint more than its target asks for, and its slices: that joint held.

Held at the arm's end, it leaves six joints whose geometry is the same at every position of it:
only their target moves. Where only the direction of a tool's axis counts, a joint about that axis
is added; where only the position counts, three about the tool's origin, which slices alone have.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .... import kernel
from ....kernel import Floats
from ....rigid_motion import inverse, turn_about
from ....robot.robot import Robot
from ....robot.task import ROW_NAMES, seeded_poses
from ...forward import forward_kinematics
from ..problem.chain_geometry import with_turn
from ..problem.plan import SixSolver, closed_solvers, eliminating_solver, one_to_one
from ..problem.screws import Screws, screws_of
from ..problem.target import TOOL_AXES, IkTarget

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
    screws
        Of the arm, and of the joint that is added for a direction.
    table : shape (n, 7)
        The same for the kernel.
    uncoupling : shape (n, n)
        The inverse of the screws' coupling.
    whole
        Whether the rotation counts.
    length
        What a rad counts, m.
    slices
        The slices by the joint that is held; None if the others cannot be solved.
    """

    screws: Screws
    table: Floats
    uncoupling: Floats
    whole: bool
    length: float
    slices: Slices | None

    @property
    def turning(self) -> npt.NDArray[np.bool_]:
        """Return which screws turn, shape (n,)."""
        return ~np.array(self.screws.slides)

    def to_screws(self, q: Floats) -> Floats:
        """Return positions of the screws (..., n) from those of the joints; an added one at 0."""
        C = self.screws.coupling
        return np.asarray(q @ C[:, : q.shape[-1]].T)

    def to_joints(self, psi: Floats, joints: int) -> Floats:
        """Return positions of the joints (..., joints) from those of the screws (..., n)."""
        return np.asarray((psi @ self.uncoupling.T)[..., :joints])

    def point(self, target: IkTarget) -> kernel.CurvePoint:
        """Return room for a target's solutions."""
        centre = target.pose[:3, 3].copy()
        return kernel.CurvePoint(self.table, self._motion(target), centre, self.whole, self.length)

    def posture(self, robot: Robot, target: IkTarget, q: Floats) -> Floats:
        """Return positions of the screws (n,) of a solution (joints,)."""
        psi = np.ascontiguousarray(self.to_screws(q))
        if target.axis:
            # The added joint: the turn about the axis from the tool to the target's pose.
            M = forward_kinematics(robot, q)[:3, :3].T @ target.pose[:3, :3]
            first = TOOL_AXES.index(target.axis) - 2
            psi[-1] = math.atan2(M[first + 1, first], M[first, first])
        return psi

    def _motion(self, target: IkTarget) -> Floats:
        # Return the motion from rest to a target.
        return np.asarray(target.pose @ inverse(self.screws.home))

    def solutions(self, slices: Slices, target: IkTarget, position: float) -> Floats:
        """Return positions of the screws (m, n) in a slice, the joint held at a position."""
        held = slices.joint
        turn = _motion_of(self.screws, held, -position)
        motion = self._motion(target)
        motion = turn @ motion if held == 0 else motion @ turn
        if not self.whole:
            goal = motion[:3, :3] @ self.screws.tool + motion[:3, 3]
            motion[:3, :3] = ADDED_ROTATION
            motion[:3, 3] = goal - ADDED_ROTATION @ self.screws.tool
        psi, _ = slices.six.candidates(motion)
        return np.insert(psi[:, : len(self.table) - 1], held, position, axis=1)


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
    table = np.column_stack([screws.axes, screws.points, np.array(screws.slides, np.float64)])
    back, length = (
        np.asarray(np.linalg.inv(screws.coupling), np.float64),
        0.5 * robot.singularity.task.length,
    )
    arm = SlicedArm(screws, np.ascontiguousarray(table), back, whole, length, None)
    for held in (len(table) - 1, 0) if whole else (0,):
        if not screws.slides[held] and (slices := _slices(arm, robot, held)) is not None:
            return arm._replace(slices=slices)
    return arm


def _slices(arm: SlicedArm, robot: Robot, held: int) -> Slices | None:
    screws = arm.screws
    others = [k for k in range(len(screws.axes)) if k != held]
    axes, points = screws.axes[others], screws.points[others]
    slides = tuple(screws.slides[k] for k in others)
    if not arm.whole:
        axes, points = np.vstack([axes, np.eye(3)]), np.vstack([points, [screws.tool] * 3])
        slides += (False, False, False)
    six = Screws(axes, points, slides, np.eye(6), np.eye(4))
    solver = next(closed_solvers(six), None)
    if solver is None:
        motions = []
        for q in seeded_poses(robot.limits, robot.prismatic)[:8]:
            T = forward_kinematics(robot, q) @ inverse(screws.home)
            if not arm.whole:
                T[:3, :3] = T[:3, :3] @ ADDED_ROTATION
            turn = _motion_of(screws, held, -float(arm.to_screws(q)[held]))
            motions.append(turn @ T if held == 0 else T @ turn)
        solver = eliminating_solver(six, np.array(motions))
    return None if solver is None else Slices(held, solver)


def _motion_of(screws: Screws, k: int, position: float) -> Floats:
    T = np.eye(4)
    if screws.slides[k]:
        T[:3, 3] = position * screws.axes[k]
        return T
    T[:3, :3] = turn_about(screws.axes[k], position)
    T[:3, 3] = screws.points[k] - T[:3, :3] @ screws.points[k]
    return T
