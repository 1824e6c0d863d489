# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Choose the method that solves the inverse kinematics of an arm, from the arm's joint screws.

The choice is made once for all targets that prescribe the same components of the tool's pose, such
as x y z.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np
import numpy.typing as npt

from .... import kernel
from ....kernel import Floats
from ....rigid_motion import inverse
from ....robot.chain import FrozenArrays
from ....robot.clearance_bounds import Reach, reach_of
from ....robot.robot import Robot
from ....robot.task import ROW_NAMES, generic_poses, least_motion, seeded_poses
from ...forward import forward_kinematics
from .chain_geometry import (
    meeting_point,
    parallel,
    reversed_screws,
    through,
    with_feet,
    with_links_merged,
    with_parallel_axes,
    with_turn,
)
from .screws import Screws, screws_of
from .six_joints import six_joints_of
from .target import IDENTITY, residual_of

# Number of random joint positions at which the rank of J is computed.
RANK_POSES = 50
# Singular values of J below this ratio to the largest one are taken as zero.
RANK_RATIO = 1e-9
# A joint turns an axis of the arm with a gear ratio. A gear ratio, or a quotient of two gear
# ratios, is taken as a whole number if it differs from the nearest whole number by at most this.
WHOLE_TOLERANCE = 1e-12
# Relative round-off of a closed form, after a product of ten matrices. The round-off is 9 machine
# epsilons.
CLOSED_FORM_ROUND_OFF = 2e-15
# If no imaginary part of a complex solution exceeds this, rad or m, the solution may be real.
# Refinement then decides whether the solution is real.
IMAGINARY_TOLERANCE = 1e-6
# A joint may turn several axes with different gear ratios. The period of the joint is the smallest
# motion after which every axis has made whole turns. The search for the period tries 1, 2, ...,
# MAX_TURNS turns of the slowest axis.
MAX_TURNS = 1000
# Two possible axes of the sixth joint that is added to an arm of five joints: unit vectors that
# are parallel to no axis of usual arms. At poses where the arm with the first axis is singular,
# the arm with the second axis is regular.
ADDED_AXES = np.array([[0.48, 0.6, 0.64], [0.64, -0.48, 0.6]])


@dataclass(frozen=True, eq=False)
class InversePlan(FrozenArrays):
    """
    The method that solves the inverse kinematics of an arm, for all targets that prescribe the
    same rows (components of the pose).

    Attributes
    ----------
    closed
        The closed form of the arm, or None.
    six_joints
        The elimination for an arm of six joints without a closed form, or None.
    joints
        The joints for the kernel: scales, periods and limits.
    scales : shape (n,)
        Joint motions are divided by these scales: 1 for revolute joints, the characteristic length
        (m) for prismatic joints.
    held : shape (n,)
        As `scales`, but 0 for joints that a search holds so that solutions are isolated.
    idle : shape (k, n)
        Joint motions, divided by `scales`, that leave all prescribed pose components unchanged at
        every pose. For example, two joints on one axis can turn against each other.
    redundant
        Whether solutions still form families if the held joints (`held` is 0) do not move.
    freedom
        Dimension of the null space of J at poses that are not singular; J has only the rows of the
        target. A family of solutions has this dimension.
    overdetermined
        Whether J has fewer independent rows than the target has equations. The arm then cannot
        exactly reach a target whose numbers are rounded.
    periods : shape (n,)
        Joint motion after which the tool has the same pose: 2 pi, another number if the joint has
        a gear ratio, or infinite.
    middle : shape (n,), rad or m
        The middle of the limits, 0 without limits.
    limits, unlimited : shape (n, 2), rad or m
        The joint limits, and infinite limits.
    reach, reach_inside
        Two spheres, each with centre and radius. The tool never leaves `reach`; it does not leave
        `reach_inside` if all joints are inside their limits.
    """

    closed: kernel.ClosedForm | None
    six_joints: kernel.SixJoints | None
    joints: kernel.Joints
    scales: Floats
    held: Floats
    idle: Floats
    redundant: bool
    freedom: int
    overdetermined: bool
    periods: Floats
    middle: Floats
    limits: Floats
    unlimited: Floats
    reach: Reach
    reach_inside: Reach


@functools.lru_cache(maxsize=128)
def plan_for(robot: Robot, rows: tuple[str, ...], axis: str = '') -> InversePlan:
    """
    Return the plan of an arm: how inverse kinematics is solved for targets of one kind.

    The targets prescribe the pose components `rows`, some of x y z rx ry rz. If `axis` is given,
    they also prescribe the direction of this tool axis.
    """
    # Use no screws for an arm with closed loops, because only the search can solve it.
    screws = None if robot.chain.loops else screws_of(robot.chain)
    scales = np.array(robot.singularity.task.column_scales)
    idle, rank = _idle_motions(robot, rows, axis, scales)
    held = scales.copy()
    for j in _pivots(idle):
        held[j] = 0.0
    redundant = rank + len(idle) < robot.dof
    isolated, whole = not redundant and not len(idle), rows == ROW_NAMES
    closed = six_joints = None
    position = rows == ROW_NAMES[:3] and not axis
    if screws is not None and isolated and (whole or position):
        closed = _closed_form(screws, robot, whole)
    if closed is None and isolated and whole:
        six_joints = elimination_of(robot)
    limits = np.array(robot.limits)
    middle, bounded = np.clip(0.0, *limits.T), np.isfinite(limits).all(axis=1)
    middle[bounded] = limits[bounded].sum(axis=1) / 2
    periods = _periods(screws, robot) if screws is not None else _periods_of_loops(robot)
    unlimited = np.repeat([[-np.inf, np.inf]], robot.dof, axis=0)
    return InversePlan(
        closed=closed,
        six_joints=six_joints,
        joints=kernel.Joints(scales, periods, limits),
        scales=scales,
        held=held,
        idle=idle,
        redundant=redundant,
        freedom=robot.dof - rank,
        overdetermined=rank < len(rows) + (2 if axis else 0),
        periods=periods,
        middle=middle,
        limits=limits,
        unlimited=unlimited,
        reach=reach_of(robot.chain, unlimited),
        reach_inside=reach_of(robot.chain, limits),
    )


def _idle_motions(
    robot: Robot, rows: tuple[str, ...], axis: str, scales: Floats
) -> tuple[Floats, int]:
    # Returns the joint motions that are in the null space of J at all joint positions, and the
    # generic rank of J.
    poses = generic_poses(robot.chain, robot.limits, robot.prismatic)
    q = np.ascontiguousarray(poses[:RANK_POSES])
    n = robot.dof
    sigma, motions = np.zeros((len(q), n)), np.zeros((len(q), n, n))
    # J is the Jacobian of the components of the pose that the target prescribes (`rows`). It does
    # not depend on the pose of the target, so take any pose.
    residual = residual_of(robot, IDENTITY, rows, axis)
    kernel.free_motions(residual, scales, q, sigma, motions)
    # Take singular values below `least` as zero. This is necessary if the joints change none of
    # the pose components in `rows`. All entries of J are then only round-off.
    least = least_motion(robot.chain)
    rank = int(np.max(np.sum(sigma > np.maximum(RANK_RATIO * sigma[:, :1], least), axis=1)))
    # Find the null space common to all joint positions. With the singular value decomposition J =
    # U sigma V^T, the matrix sigma V^T has the null space of J. So stack the rows of this matrix
    # for all joint positions.
    moving = (sigma[:, :, None] * motions).reshape(-1, n)
    _, size, right = np.linalg.svd(moving, full_matrices=False)
    return signed(right[size <= max(RANK_RATIO * size[0], least)]), rank


def signed(motions: Floats) -> Floats:
    """
    Return joint motions (k, n) with new signs: in each motion, the first component with a size
    above 0.1 is positive.

    The signs make the motions equal on every machine. Numbers that are only round-off become 0.
    """
    signs = np.sign(motions[np.arange(len(motions)), np.argmax(np.abs(motions) > 0.1, axis=1)])
    return np.asarray(np.where(np.abs(motions) < 1e-9, 0.0, motions) * signs[:, None])


def _pivots(idle: Floats) -> list[int]:
    # An idle motion is a joint motion that changes no pose component which the target prescribes.
    # Returns for each idle motion the index of a joint to hold, chosen by Gaussian elimination:
    # the joint that moves most in the idle motion. If several joints move equally far, the last of
    # them is chosen.
    rows, pivots = idle.copy(), []
    for k in range(len(rows)):
        j = rows.shape[1] - 1 - int(np.argmax(np.round(np.abs(rows[k][::-1]), 9)))
        pivots.append(j)
        rows[k + 1 :] -= rows[k] * (rows[k + 1 :, j, None] / rows[k, j])
    return pivots


def _periods(screws: Screws, robot: Robot) -> Floats:
    slides = np.array(screws.slides)
    turning, sliding = screws.coupling[~slides].T, screws.coupling[slides].any(axis=0)
    return _periods_by(robot, turning, ~sliding)


def _periods_of_loops(robot: Robot) -> Floats:
    chain, table = robot.chain, robot.chain.table
    masks = [table.joint == j for j in range(robot.dof)]
    sliding = np.array([table.by_d[entries].any() for entries in masks])
    periodic = ~sliding & np.array(chain.closure.is_periodic(), dtype=bool)
    return _periods_by(robot, [table.by_theta[entries] for entries in masks], periodic)


def _periods_by(robot: Robot, ratios: Iterable[Floats], periodic: npt.NDArray[np.bool_]) -> Floats:
    revolute = np.array(robot.joint_types) == 'revolute'
    turns = [_turns(row) if ends else math.inf for ends, row in zip(revolute & periodic, ratios)]
    return math.tau * np.array(turns)


def _turns(ratios: Floats) -> float:
    # Returns the least number of turns of a joint after which every axis that it drives has made
    # whole turns; infinite if none is found. `ratios` has the turns of each axis per turn of the
    # joint (gear ratios).
    moving = np.abs(ratios[ratios != 0.0])
    if not len(moving):
        return 1.0
    # Try 1, 2, ... turns of the slowest axis until all other axes have made whole turns.
    slowest = float(np.min(moving))
    for turns in range(1, MAX_TURNS + 1):
        if _whole(turns * moving / slowest):
            return turns / slowest
    return math.inf


def _whole(numbers: Floats) -> bool:
    return bool(np.all(np.abs(numbers - np.round(numbers)) < WHOLE_TOLERANCE))


def one_to_one(screws: Screws, robot: Robot) -> bool:
    """
    Return whether psi = coupling q maps joint positions q one to one, up to full turns.

    The vector psi has the angle or displacement of each screw.
    """
    C = screws.coupling
    if C.shape[0] != C.shape[1] or abs(np.linalg.det(C)) < WHOLE_TOLERANCE:
        return False
    slides = np.array(screws.slides)
    turns = ~robot.prismatic
    if np.any(C[np.ix_(slides, turns)]) or np.any(C[np.ix_(~slides, ~turns)]):
        return False
    # Check that full turns of the screws are full periods of the joints, and that full periods of
    # the joints are full turns of the screws.
    periods = _periods(screws, robot)[turns]
    if not np.all(np.isfinite(periods)):
        return False
    by_period = C[np.ix_(~slides, turns)] * periods / (2 * math.pi)
    return _whole(by_period) and _whole(np.linalg.inv(by_period))


def _closed_form(screws: Screws, robot: Robot, whole: bool) -> kernel.ClosedForm | None:
    if robot.dof == 3:
        for form in (screws, with_links_merged(screws)):
            if one_to_one(form, robot) and _solvable(form):
                return _closed(kernel.POSITION_3, with_feet(form), form.tool, False)
    if robot.dof != 6 or not whole or not one_to_one(screws, robot):
        return None
    solver = next(closed_solvers(screws), None)
    return None if solver is None else cast(kernel.ClosedForm, solver.form)


class SixSolver(NamedTuple):
    """
    A solver that finds all inverse kinematics solutions of an arm with six joint screws.

    Attributes
    ----------
    form
        The closed form or the elimination that the solver uses.
    to_joints : shape (6, 6)
        Matrix that converts the angles (or displacements) psi of the six screws to joint
        positions: q = to_joints psi.
    home_inverse : shape (4, 4)
        Inverse of the tool's pose with all joints at zero.
    backwards
        Whether the screws are ordered from tool to base.
    """

    form: kernel.ClosedForm | kernel.SixJoints
    to_joints: Floats
    home_inverse: Floats
    backwards: bool = False

    def candidates(self, pose: Floats) -> tuple[Floats, float]:
        """
        Return candidate solutions (m, 6) for a pose (4, 4), and a bound of their distance from
        solutions, rad. The bound is infinite if none is proved.
        """
        motion = pose @ self.home_inverse
        motion = np.ascontiguousarray(inverse(motion) if self.backwards else motion)
        if isinstance(self.form, kernel.SixJoints):
            roots, accuracy = np.empty((kernel.MAX_CANDIDATES, 6, 2)), np.empty(3)
            roots = roots[: kernel.complex_solutions(self.form, motion, roots, accuracy)]
            psi = roots[np.all(np.abs(roots[:, :, 1]) < IMAGINARY_TOLERANCE, axis=1), :, 0]
            return psi @ self.to_joints.T, 0.0 if accuracy[2] else math.inf
        psi, off = np.empty((kernel.MAX_CANDIDATES, 6)), np.empty(1)
        psi = psi[: kernel.inverse_candidates(self.form, motion, np.zeros(6), psi, off)]
        return psi @ self.to_joints.T, float(off[0])


def closed_solvers(screws: Screws) -> Iterator[SixSolver]:
    """
    Yield solvers for the closed forms of six screws. The first solver orders the screws from base
    to tool, the second from tool to base. A solver is omitted if no closed form is known.
    """
    solvers = _closed_solver(screws, False), _closed_solver(reversed_screws(screws), True)
    return (solver for solver in solvers if solver is not None)


def _closed_solver(given: Screws, backwards: bool) -> SixSolver | None:
    point = meeting_point(given, (3, 4, 5))
    if point is not None and _solvable(given):
        kind, exact = kernel.SPHERICAL_WRIST, with_feet(through(given, (3, 4, 5), point))
    elif aligned := with_parallel_axes(given):
        kind, (exact, point) = kernel.PARALLEL_AXES, aligned
    else:
        return None
    return _solver(_closed(kind, exact, point, backwards), exact, backwards)


def eliminating_solver(screws: Screws, poses: Floats) -> SixSolver | None:
    """
    Return a solver by elimination for six screws, or None if elimination fails. The elimination
    can begin at different joints; these variants are tried at the reachable poses `poses` (m, 4,
    4), and the solver uses the best ones first.
    """
    form = six_joints_of(screws, poses)
    return None if form is None else _solver(form, screws, False)


def _solver(
    form: kernel.ClosedForm | kernel.SixJoints, screws: Screws, backwards: bool
) -> SixSolver:
    to_joints = np.asarray(np.linalg.inv(screws.coupling), np.float64)
    return SixSolver(form, to_joints, inverse(screws.home), backwards)


@functools.lru_cache(maxsize=128)
def as_six(robot: Robot, eliminated: bool) -> tuple[SixSolver, ...]:
    """
    Return solvers for an arm of five joints to which a sixth joint is added. The caller then takes
    the solutions in which the sixth joint is at 0.

    The joint is added after the tool or before the base. Number the axes so that the added one is
    axis 6. The arm then has a closed form (Pieper 1968), because axes 4, 5 and 6 meet in a point,
    or because axes 2, 3 and 4 are parallel. If `eliminated`, the solver uses elimination instead.
    """
    if robot.chain.loops or robot.dof != 5:
        return ()
    screws = screws_of(robot.chain)
    if not one_to_one(screws, robot):
        return ()
    if eliminated:
        q = np.ascontiguousarray(seeded_poses(robot.limits, robot.prismatic)[:RANK_POSES])
        solver = eliminating_solver(with_turn(screws, *ADDED_AXES), forward_kinematics(robot, q))
        return () if solver is None else (solver,)
    forms: list[SixSolver | None] = []
    for backwards in (False, True):
        given = reversed_screws(screws) if backwards else screws
        wrist = meeting_point(given, (3, 4))
        point = given.points[4] if wrist is None else wrist
        forms += [_closed_solver(with_turn(given, axis, point), backwards) for axis in ADDED_AXES]
    return tuple(solver for solver in forms if solver is not None)


@functools.lru_cache(maxsize=128)
def elimination_of(robot: Robot) -> kernel.SixJoints | None:
    """
    Return the elimination for an arm of six joints, or None if elimination cannot solve the arm.
    """
    if robot.chain.loops or robot.dof != 6:
        return None
    screws = screws_of(robot.chain)
    if not one_to_one(screws, robot):
        return None
    q = np.ascontiguousarray(seeded_poses(robot.limits, robot.prismatic)[:RANK_POSES])
    return six_joints_of(screws, forward_kinematics(robot, q))


def _solvable(screws: Screws) -> bool:
    # Returns whether the first three joints have a closed form for a position. They have none if
    # the first two share an axis or slide in one direction, or if all three are parallel. The
    # search solves these cases.
    first = with_feet(screws)
    z1, z2, z3 = first.axes[:3]
    if not parallel(z1, z2):
        return True
    slide1, slide2 = first.slides[:2]
    same_axis = not (slide1 or slide2) and np.array_equal(first.points[0], first.points[1])
    return not (same_axis or (slide1 and slide2) or parallel(z2, z3))


def _closed(kind: int, form: Screws, point: Floats, backwards: bool) -> kernel.ClosedForm:
    slides = np.array(form.slides, dtype=np.float64)
    return kernel.ClosedForm(
        kind,
        screws=np.ascontiguousarray(np.column_stack([form.axes, form.points, slides])),
        point=np.array(point),
        home_inverse=np.ascontiguousarray(inverse(form.home)),
        backwards=backwards,
        to_joints=np.ascontiguousarray(np.linalg.inv(form.coupling)),
        to_screws=np.ascontiguousarray(form.coupling),
        error=form.off + CLOSED_FORM_ROUND_OFF,
    )
