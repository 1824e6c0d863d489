"""
The plan of an arm's inverse: recognised once from its screws, then the same for every target.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

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

# Number of poses for the rank, and the largest singular value that counts as zero.
POSES = 50
RANK = 1e-9
WHOLE = 1e-12
# What products of some ten matrices, and the steps of a closed form, are off by as a share.
ROUND_OFF = 2e-15
# Imaginary parts (rad or m) that no real solution has, which refinement then proves.
NOT_REAL = 1e-6
# Screws that a joint moves by ratios of no such whole numbers never come back together.
MOST_TURNS = 1000
# Axes of turns added to five joints, unit vectors that are parallel to no axis of usual arms. At a
# pose where one makes the six joints singular, the other does not.
ADDED_AXES = np.array([[0.48, 0.6, 0.64], [0.64, -0.48, 0.6]])


@dataclass(frozen=True, eq=False)
class InversePlan(FrozenArrays):
    """
    The properties of an arm and the wanted rows that no target changes.

    Attributes
    ----------
    closed
        Its closed form, if it has one.
    six_joints
        How all solutions of six joints are found otherwise, if they can be.
    joints
        The joints for the kernel: their scales, periods and limits.
    scales : shape (n,)
        Weight of a unit of each joint (the length for prismatic ones).
    held : shape (n,)
        The same, 0 for a joint that is held, so that solutions are isolated.
    idle : shape (k, n)
        Scaled joint motions that never move the rows; two joints on one axis have one.
    redundant
        Whether solutions come in families even with those joints held.
    freedom
        Dimension of the null space of the rows at most poses, and of a family.
    overdetermined
        Whether the joints move the tool in fewer ways than count: then no target that was rounded
        is met exactly.
    periods : shape (n,)
        Turn after which a joint is back: 2 pi, more or less behind a gear, or infinite.
    middle : shape (n,), rad or m
        The middle of the limits, 0 if there are none.
    limits, unlimited : shape (n, 2), rad or m
        The limits, and none.
    reach, reach_inside
        What the tool never leaves, whatever the joint positions, and inside the limits.
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
    """Return the plan of an arm for the wanted rows and, with `axis`, the tool's direction."""
    # What is recognised in screws is not there where loops bend the arm: the search is left.
    screws = None if robot.chain.loops else screws_of(robot.chain)
    scales = np.array(robot.singularity.task.column_scales)
    idle, rank = _idle_motions(robot, rows, axis, scales)
    held = scales.copy()
    for j in _pivots(idle):
        held[j] = 0.0
    redundant = rank + len(idle) < robot.dof
    whole = rows == ROW_NAMES
    closed = None
    position = rows == ROW_NAMES[:3] and not axis
    if screws is not None and not redundant and not len(idle) and (whole or position):
        closed = _closed_form(screws, robot, whole)
    six_joints = None
    isolated = whole and robot.dof == 6 and not redundant and not len(idle)
    if closed is None and isolated:
        six_joints = elimination_of(robot)
    low, high = robot.limits.T
    bounded = np.isfinite(low) & np.isfinite(high)
    middle = np.where(bounded, (np.where(bounded, low, 0.0) + np.where(bounded, high, 0.0)) / 2, 0)
    middle = np.clip(middle, low, high)
    periods = _periods(screws, robot) if screws is not None else _periods_of_loops(robot)
    limits = np.array(robot.limits)
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
    # Returns the motions in the null space of every J, and the rank of J at most poses.
    poses = generic_poses(robot.chain, robot.limits, robot.prismatic)
    q = np.ascontiguousarray(poses[:POSES])
    n = robot.dof
    sigma, motions = np.zeros((len(q), n)), np.zeros((len(q), n, n))
    # Of any pose: only what counts of it matters.
    residual = residual_of(robot, IDENTITY, rows, axis)
    kernel.free_motions(residual, scales, q, sigma, motions)
    # Where the joints do not move the rows at all, all of it is round-off.
    least = least_motion(robot.chain)
    rank = int(np.max(np.sum(sigma > np.maximum(RANK * sigma[:, :1], least), axis=1)))
    # sigma V are the rows of J^T J's root: their common null space is that of all of them.
    moving = (sigma[:, :, None] * motions).reshape(-1, n)
    _, size, right = np.linalg.svd(moving, full_matrices=False)
    return signed(right[size <= max(RANK * size[0], least)]), rank


def signed(motions: Floats) -> Floats:
    """
    Return unit motions (k, n) with the first large number of each positive, and no negative zero.

    So they are the same on each machine.
    """
    signs = np.sign(motions[np.arange(len(motions)), np.argmax(np.abs(motions) > 0.1, axis=1)])
    return np.asarray(np.where(np.abs(motions) < 1e-9, 0.0, motions) * signs[:, None])


def _pivots(idle: Floats) -> list[int]:
    # Returns a joint to hold for each idle motion: the last one it moves most, by elimination.
    left, pivots = idle.copy(), []
    for k in range(len(left)):
        j = left.shape[1] - 1 - int(np.argmax(np.round(np.abs(left[k][::-1]), 9)))
        pivots.append(j)
        for i in range(k + 1, len(left)):
            left[i] = left[i] - left[k] * (left[i, j] / left[k, j])
    return pivots


def _periods(screws: Screws, robot: Robot) -> Floats:
    periods = np.full(robot.dof, np.inf)
    slides = np.array(screws.slides)
    for j, kind in enumerate(robot.joint_types):
        ratios = screws.coupling[:, j]
        if kind == 'revolute' and not np.any(ratios[slides]):
            periods[j] = 2 * math.pi * _turns(ratios[~slides])
    return periods


def _periods_of_loops(robot: Robot) -> Floats:
    chain, periods = robot.chain, np.full(robot.dof, np.inf)
    for j, ends in enumerate(chain.closure.is_periodic()):
        ratios = chain.table.by_theta[chain.table.joint == j]
        slides = np.any(chain.table.by_d[chain.table.joint == j])
        if ends and not slides and robot.joint_types[j] == 'revolute':
            periods[j] = 2 * math.pi * _turns(ratios)
    return periods


def _turns(ratios: Floats) -> float:
    # The least number of turns of a joint after which all screws it moves have made whole ones.
    moving = np.abs(ratios[ratios != 0.0])
    if not len(moving):
        return 1.0
    # Turns of the slowest of them, in which the others make whole ones, too.
    slowest = float(np.min(moving))
    for turns in range(1, MOST_TURNS + 1):
        if _whole(turns * moving / slowest):
            return turns / slowest
    return math.inf


def _whole(numbers: Floats) -> bool:
    return bool(np.all(np.abs(numbers - np.round(numbers)) < WHOLE))


def one_to_one(screws: Screws, robot: Robot) -> bool:
    """Return whether positions of the screws, modulo full turns, are positions of the joints."""
    C = screws.coupling
    if C.shape[0] != C.shape[1] or abs(np.linalg.det(C)) < WHOLE:
        return False
    slides = np.array(screws.slides)
    turns = ~robot.prismatic
    if np.any(C[np.ix_(slides, turns)]) or np.any(C[np.ix_(~slides, ~turns)]):
        return False
    # Full turns of each screw are full periods of the joints, and the other way round.
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
    for backwards in (False, True):
        form = reversed_screws(screws) if backwards else screws
        if found := _geometry_of_six(form):
            return _closed(*found, backwards)
    return None


def _geometry_of_six(form: Screws) -> tuple[int, Screws, Floats] | None:
    # The way to a closed form, the screws made exact, and the point that is solved first.
    wrist = meeting_point(form, (3, 4, 5))
    if wrist is not None and _solvable(form):
        return kernel.SPHERICAL_WRIST, with_feet(through(form, (3, 4, 5), wrist)), wrist
    found = with_parallel_axes(form)
    return found and (kernel.PARALLEL_AXES, *found)


class SixSolver(NamedTuple):
    """
    Six screws, and how all their solutions are found.

    Attributes
    ----------
    form
        The closed form, or how the solutions are found by elimination.
    to_joints : shape (6, 6)
        Joint positions from those of the screws.
    home_inverse : shape (4, 4)
        Inverse of the tool's pose at rest.
    backwards
        Whether the screws are ordered from tool to base.
    """

    form: kernel.ClosedForm | kernel.SixJoints
    to_joints: Floats
    home_inverse: Floats
    backwards: bool = False

    def candidates(self, pose: Floats) -> tuple[Floats, float]:
        """Return candidates (m, 6) for a pose (4, 4), and how far they are from solutions, rad."""
        motion = pose @ self.home_inverse
        motion = np.ascontiguousarray(inverse(motion) if self.backwards else motion)
        if isinstance(self.form, kernel.SixJoints):
            roots, said = np.empty((kernel.MOST_CANDIDATES, 6, 2)), np.empty(3)
            roots = roots[: kernel.complex_solutions(self.form, motion, roots, said)]
            psi = roots[np.all(np.abs(roots[:, :, 1]) < NOT_REAL, axis=1), :, 0]
            return psi @ self.to_joints.T, 0.0 if said[2] else math.inf
        psi, off = np.empty((kernel.MOST_CANDIDATES, 6)), np.empty(1)
        psi = psi[: kernel.inverse_candidates(self.form, motion, np.zeros(6), psi, off)]
        return psi @ self.to_joints.T, float(off[0])


def closed_solvers(screws: Screws) -> Iterator[SixSolver]:
    """Yield the closed forms of six screws, from base to tool and from tool to base."""
    for backwards in (False, True):
        given = reversed_screws(screws) if backwards else screws
        if geometry := _geometry_of_six(given):
            yield _solver(_closed(*geometry, backwards), geometry[1], backwards)


def eliminating_solver(screws: Screws, poses: Floats) -> SixSolver | None:
    """Return the elimination of six screws, ranked at poses (m, 4, 4) that they can have."""
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
    Return five joints as six: an added turn is the last, and the caller holds it at 0.

    The turn makes a closed form (Pieper 1968): it completes a spherical wrist, or it is the last
    joint behind three parallel axes. `eliminated`: by elimination instead.
    """
    if robot.chain.loops or robot.dof != 5:
        return ()
    screws = screws_of(robot.chain)
    if not one_to_one(screws, robot):
        return ()
    if eliminated:
        q = np.ascontiguousarray(seeded_poses(robot.limits, robot.prismatic)[:POSES])
        solver = eliminating_solver(with_turn(screws, *ADDED_AXES), forward_kinematics(robot, q))
        return () if solver is None else (solver,)
    found = []
    for backwards in (False, True):
        given = reversed_screws(screws) if backwards else screws
        wrist = meeting_point(given, (3, 4))
        for axis in ADDED_AXES:
            six = with_turn(given, axis, given.points[4] if wrist is None else wrist)
            if geometry := _geometry_of_six(six):
                found.append(_solver(_closed(*geometry, backwards), geometry[1], backwards))
    return tuple(found)


@functools.lru_cache(maxsize=128)
def elimination_of(robot: Robot) -> kernel.SixJoints | None:
    """Return how all solutions of six joints are found by elimination, if they can be."""
    if robot.chain.loops or robot.dof != 6:
        return None
    screws = screws_of(robot.chain)
    if not one_to_one(screws, robot):
        return None
    q = np.ascontiguousarray(seeded_poses(robot.limits, robot.prismatic)[:POSES])
    return six_joints_of(screws, forward_kinematics(robot, q))


def _solvable(screws: Screws) -> bool:
    # Three joints for three coordinates, unless the first two share an axis, or all are parallel;
    # the search solves those.
    first = with_feet(screws)
    z1, z2, z3 = first.axes[:3]
    both_turn = not first.slides[0] and not first.slides[1]
    if both_turn and parallel(z1, z2) and np.array_equal(first.points[0], first.points[1]):
        return False
    if first.slides[0] and first.slides[1] and parallel(z1, z2):
        return False
    return not (parallel(z1, z2) and parallel(z2, z3))


def _closed(way: int, form: Screws, point: Floats, backwards: bool) -> kernel.ClosedForm:
    slides = np.array(form.slides, dtype=np.float64)
    return kernel.ClosedForm(
        way,
        screws=np.ascontiguousarray(np.column_stack([form.axes, form.points, slides])),
        point=np.array(point),
        home_inverse=np.ascontiguousarray(inverse(form.home)),
        backwards=backwards,
        to_joints=np.ascontiguousarray(np.linalg.inv(form.coupling)),
        to_screws=np.ascontiguousarray(form.coupling),
        error=form.off + ROUND_OFF,
    )
