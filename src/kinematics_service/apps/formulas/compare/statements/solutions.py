# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check equations and inverse kinematics formulas.

An inverse kinematics formula gives the position of one joint from the tool's pose. The formula is
right if the tool can reach the pose while the joint has this position. A damped Newton search
tests whether the tool can.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from itertools import product
from typing import TypeAlias

import numpy as np
import sympy as sp

from .....kernel import Integers
from .....rigid_motion import rotation_vector, skew_part
from ...arm.numbers import DEGREE, Floats
from ...arm.table import Table
from ...arm.world import World
from .checks import Check, Mask
from .names import ANGLE_IN_PLANE, ROTATION
from .poses import Poses
from .statements import Statement

Limits: TypeAlias = Floats  # lower and upper joint limits, shape (n, 2), rad or m

# An inverse kinematics formula gives a joint's position from the tool's pose. It is evaluated at
# the poses of random configurations. The formula gives a branch of the inverse kinematics if it
# returns the joint's position at this fraction of the configurations or more. At fewer
# configurations, equal values are coincidences.
MIN_HIT_RATIO = 0.1
# A formula returns the joint's position if the formula's value differs from the position by at
# most this (rad or m). The tolerance is large, because acos near -1 and 1 loses half the digits.
HIT_TOLERANCE = 1e-7
# A formula gives another branch of the inverse kinematics if, with the formula's values, the tool
# reaches at least this fraction of the target poses.
BRANCH_POSE_RATIO = 0.9
# Newton's method: number of random starts, and of steps from each start.
STARTS = 24
STEPS = 20
# The search stops after this number of random starts if no start has reached a target pose.
FIRST_STARTS = 4
SEED = 1955
# Maximum number of configurations at which another branch of the inverse kinematics is searched,
# because a configuration takes up to STARTS searches.
MAX_BRANCH_POSES = 40
# Maximum number of combinations of inverse kinematics formulas that are tried. A combination has
# one formula for each joint.
MAX_CHOICES = 16
# If a joint moves a point by less than this (m/rad), the motion is round-off, and the joint does
# not move the point.
STILL_SPEED = 1e-9
# Two rotation matrices count as equal if their entries differ by at most this. If the search ends
# half a turn away from the target rotation, some entry differs by more than 0.9.
ROTATION_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class PoseSearch:
    """
    A search for joint positions at which the tool reaches its target pose. Some joints are held at
    given values.

    Parameters
    ----------
    table
        The table of the arm.
    poses
        Configurations; the tool's poses at them are the targets of the search.
    whole
        Whether the tool must reach rotation and position; else position only.
    joints
        Indices of the joints that may move.
    given
        Indices of the joints that are held at given values.
    out_of_reach
        Whether joint positions may be complex. A complex solution shows that the given values
        solve the arm's equations, although the links are too short or too long for a real
        solution.
    """

    table: Table
    poses: Poses
    whole: bool
    joints: list[int]
    given: list[int]
    out_of_reach: bool = False

    @cached_property
    def target(self) -> World:
        """
        Return frames and Jacobian of the arm at the configurations that give the target poses.
        """
        return World(self.table, self.poses.values, self.poses.count)

    @property
    def rows(self) -> int:
        """Return the number of Jacobian rows that the search uses."""
        return 6 if self.whole else 3

    @cached_property
    def moving(self) -> list[int]:
        """
        Return the joints in `joints` that move the tool's origin.

        If `whole` is true, return also the joints that turn the tool about its origin.
        """
        sizes = np.abs(self.target.jacobian[:, : self.rows]).max(axis=(0, 1))
        return [k for k in self.joints if sizes[k] > STILL_SPEED]

    @property
    def is_redundant(self) -> bool:
        """
        Return whether the joints in `joints` can make every tool motion of the joints in `given`.

        If the result is true, the tool keeps all its motions although the joints in `given` have
        fixed values.
        """
        J = self.target.jacobian[:, : self.rows]
        followed, all_of_them = (
            int(np.linalg.matrix_rank(J[:, :, columns], tol=STILL_SPEED).max()) if columns else 0
            for columns in (self.moving, [*self.moving, *self.given])
        )
        return followed == all_of_them

    def reached(
        self, given: Mapping[sp.Symbol, Floats], mask: Mask, limits: Limits | None = None
    ) -> Mask:
        """
        Return at which configurations the search brings the tool to its target, shape (N,).

        Parameters
        ----------
        given
            Values of the given joints.
        mask : shape (N,)
            Whether to search at each configuration.
        limits
            Limits of the prismatic joints; None: any length.
        """
        finite = np.all([np.isfinite(v) for v in given.values()], axis=0)
        open_ = mask & finite
        random = np.random.default_rng(SEED)
        for start in range(STARTS if self.moving else 1):
            if not open_.any() or (start == FIRST_STARTS and np.array_equal(open_, mask & finite)):
                break
            at = np.flatnonzero(open_)
            open_[at[self._stepped(given, at, random, limits)]] = False
        return np.asarray(mask & finite & ~open_)

    def _stepped(
        self,
        given: Mapping[sp.Symbol, Floats],
        at: Integers,
        random: np.random.Generator,
        limits: Limits | None,
    ) -> Mask:
        # Take damped Newton steps from random positions, and return at which configurations the
        # tool reaches its target.
        table = self.table
        values = {s: v[at] for s, v in {**self.poses.values, **given}.items()}
        for k in self.moving:
            span = 1.0 if table.slides[k] else np.pi
            start = random.uniform(-span, span, len(at))
            if self.out_of_reach:
                start = start + 1j * random.normal(size=len(at))
            values[table.variables[k]] = start
        target = self.target.pose[at]
        moved = {*given, *(table.variables[k] for k in self.moving)}
        still = {
            i: rows[at]
            for i, rows in enumerate(self.target.rows)
            if table.rows[i].symbols.isdisjoint(moved)
        }
        for step_left in reversed(range(STEPS if self.moving else 1)):
            world = World(table, values, len(at), still=still)
            # The twist (v, w) moves the tool to its target, to first order. If joint positions are
            # complex, w is the skew part of R. The skew part is 0 at the target rotation, but also
            # half a turn away.
            R = target[:, :3, :3] @ np.swapaxes(world.pose[:, :3, :3], 1, 2)
            w = 0.5 * skew_part(R) if self.out_of_reach else rotation_vector(R)
            twist = np.concatenate([target[:, :3, 3] - world.pose[:, :3, 3], w], axis=1)
            gap = twist[:, : self.rows]
            if not step_left or float(np.max(np.abs(gap))) <= HIT_TOLERANCE / 10:
                break
            J = world.columns_of(self.moving)[:, : self.rows]
            J_t = np.swapaxes(J, 1, 2).conj()
            damped = J_t @ J + 1e-12 * np.eye(len(self.moving))
            step = np.linalg.solve(damped, J_t @ gap[..., None])[..., 0]
            longest = np.max(np.abs(step), axis=1, keepdims=True)
            step *= np.minimum(1.0, 0.7 / np.maximum(longest, 1e-300))
            for column, k in enumerate(self.moving):
                values[table.variables[k]] = values[table.variables[k]] + step[:, column]
        reached: Mask = np.max(np.abs(gap), axis=1) <= HIT_TOLERANCE
        if self.whole:
            reached &= np.max(np.abs(world.pose - target), axis=(1, 2)) <= ROTATION_TOLERANCE
        for k, (low, high) in enumerate(() if limits is None else limits):
            if table.slides[k]:
                length = values[table.variables[k]]
                reached &= (length >= low - HIT_TOLERANCE) & (length <= high + HIT_TOLERANCE)
        return reached


class EquationCheck(Check):
    """
    The check of an equation whose names are all known: both sides must be equal at every
    configuration.
    """

    @cached_property
    def right(self) -> Floats:
        """
        Return what the equation's right side should be: the values of its left side, (N, 1, 1).
        """
        return self.evaluation.of(self.statement.left)[:, None, None]


class PassiveJointCheck(Check):
    """
    The check of a passive joint's formula, which must be right at every configuration, up to whole
    turns.
    """

    @cached_property
    def right(self) -> Floats:
        """
        Return the passive joint's position, shifted by whole turns towards the formula's value,
        (N, 1, 1).
        """
        table, joint = self.names.table, self.statement.joint
        position = self.poses.values[table.variables[joint]]
        if table.slides[joint]:
            return position[:, None, None]
        turn = 2.0 * np.pi
        if self.statement.settings.degrees:
            position, turn = position / DEGREE, turn / DEGREE
        turns = np.round((self.person[:, 0, 0] - position) / turn)
        return np.asarray((position + turn * turns)[:, None, None])


@dataclass(frozen=True, eq=False)
class SolutionCheck(Check):
    """
    The check of an inverse kinematics formula, which gives a joint's value from the tool's pose.

    Parameters
    ----------
    others
        All inverse kinematics formulas of the file, including the formulas of other joints.
    """

    others: tuple[Statement, ...] = ()

    @cached_property
    def right(self) -> Floats:
        """Return the joint's position at each configuration, shape (N, 1, 1)."""
        return self.poses.values[self.variable][:, None, None]

    @property
    def variable(self) -> sp.Symbol:
        """Return the symbol of the joint whose position the formula gives."""
        return self.names.table.variables[self.statement.joint]

    @property
    def turns(self) -> bool:
        """
        Return whether the formula gives the angle of a revolute joint. If so, values that differ
        by whole turns are equal.
        """
        return not self.names.table.slides[self.statement.joint]

    def hits(self, values: Floats) -> Mask:
        """
        Return at which of the N configurations a formula's values (N,) equal the joint's position.
        """
        difference = self.in_radians(values) - self.right[:, 0, 0]
        if self.turns:
            difference = np.remainder(difference + np.pi, 2.0 * np.pi) - np.pi
        return np.asarray(np.abs(difference) <= max(self.tolerance, HIT_TOLERANCE))

    def in_radians(self, values: Floats) -> Floats:
        """Return a formula's values in rad (m if the joint is prismatic)."""
        degrees = self.statement.settings.degrees and self.turns
        return values * DEGREE if degrees else values

    @cached_property
    def hit_ratio(self) -> float:
        """
        Return the fraction of configurations at which the formula returns the joint's position.
        """
        return float(np.mean(self.hits(self.person[:, 0, 0])))

    @cached_property
    def is_about_the_pose(self) -> bool:
        """
        Return whether the formula depends on the tool's rotation, not only on the tool's position.

        The result is also true if the joint of the formula does not move the tool's origin.
        """
        column = self.world.jacobian[:, :3, self.statement.joint]
        turned = self.statement.value.free_symbols & {ANGLE_IN_PLANE, *ROTATION.values()}
        return bool(turned) or float(np.max(np.abs(column))) < STILL_SPEED

    @cached_property
    def together(self) -> float | None:
        """
        Return the fraction of configurations at which the file's formulas are right together.

        The file may have several inverse kinematics formulas for one joint. So choose one formula
        for each joint that has formulas. The choice is right at a configuration if the arm can
        reach the tool pose of the configuration while the joints have the values of the chosen
        formulas. Joints without formulas may have any position. The formulas are right together at
        a configuration if at least one choice is right.

        Return None if only one joint has formulas, if more than `MAX_CHOICES` choices exist, or if
        the joints without formulas can make every tool motion of the joints with formulas.
        """
        by_joint: dict[int, list[Statement]] = {}
        for statement in self.others:
            by_joint.setdefault(statement.joint, []).append(statement)
        choices = [*product(*by_joint.values())]
        if len(by_joint) < 2 or len(choices) > MAX_CHOICES:
            return None
        table = self.names.table
        whole = any(self.of(other).is_about_the_pose for other in self.others)
        free = [k for k in range(len(table.variables)) if k not in by_joint]
        search = PoseSearch(table, self.poses, whole, free, [*by_joint])
        if free and search.is_redundant:
            return None
        reached = np.zeros(self.poses.count, dtype=bool)
        for chosen in choices:
            values = self._in_turn({statement.joint: statement for statement in chosen})
            if values is not None:
                given = {table.variables[k]: v for k, v in values.items()}
                reached |= search.reached(given, ~reached)
        return float(np.mean(reached))

    def of(self, statement: Statement) -> 'SolutionCheck':
        """Return the check of another formula of the file at the same configurations."""
        return replace(self, statement=statement)

    def _in_turn(self, chosen: Mapping[int, Statement]) -> dict[int, Floats] | None:
        # Evaluate the chosen formula of each joint. If a formula contains other joints, their
        # formulas are evaluated first. Return None if formulas depend on each other in a circle.
        variables, positions = self.names.table.variables, dict[int, Floats]()
        needed = {
            k: [j for j in chosen if j != k and variables[j] in statement.value.free_symbols]
            for k, statement in chosen.items()
        }
        try:
            order = [*TopologicalSorter(needed).static_order()]
        except CycleError:
            return None
        for k in order:
            values = {**self.poses.values, **{variables[j]: v for j, v in positions.items()}}
            check = replace(self.of(chosen[k]), poses=replace(self.poses, values=values))
            positions[k] = check.in_radians(check.person[:, 0, 0])
        return positions

    @cached_property
    def wrong(self) -> Mask:
        """Return whether the formula is wrong, shape (1, 1)."""
        return np.array([[self.solved < BRANCH_POSE_RATIO and not self.is_a_root]])

    @cached_property
    def solved(self) -> float:
        """
        Return the fraction of configurations at which the formula's value is right.

        The value is right if it equals the joint's position at the configuration. It is also right
        if the arm can reach the same tool pose with this value as the joint's position.
        """
        return self.hit_ratio + (1.0 - self.hit_ratio) * self.branches(self.robot.limits)

    @cached_property
    def is_a_root(self) -> bool:
        """
        Return whether the formula solves the arm's equations if joint positions may be complex.

        The formula may give a solution that the arm can reach at some configurations only. For
        example, the arm may be too short to reach back over its shoulder. In an unreachable
        solution, the positions of the other joints are complex numbers.

        The result is true if two conditions hold. First, `solved` is at least MIN_HIT_RATIO.
        Second, consider the configurations at which the formula's value differs from the joint's
        position. At the fraction BRANCH_POSE_RATIO of them or more, the arm's equations have a
        real or complex solution with the formula's value. Joint limits are ignored.
        """
        return (
            self.solved >= MIN_HIT_RATIO
            and self.branches(None, out_of_reach=True) >= BRANCH_POSE_RATIO
        )

    def branches(self, limits: Limits | None, out_of_reach: bool = False) -> float:
        """
        Return how often a value that differs from the joint's position is still a solution.

        The formula misses a configuration if its value differs from the joint's position. At each
        missed configuration, a search (`PoseSearch`) gives the joint the formula's value, and
        tries to bring the tool back to its pose. The result is the fraction of the missed
        configurations at which the search succeeds.

        Joints in the expression of the formula keep their positions, and all remaining joints may
        move. Prismatic joints stay inside `limits`, if given. The search compares positions of the
        tool's origin. If the moving joints can always bring the tool's origin to its target, or if
        the formula depends on the rotation, the search also compares rotations. With
        `out_of_reach`, joint positions may be complex, and configurations at which the formula is
        undefined are left out.
        """
        joint, table = self.statement.joint, self.names.table
        values = self.in_radians(self.person[:, 0, 0])
        others = ~self.hits(self.person[:, 0, 0])
        missed = np.flatnonzero(others & np.isfinite(values) if out_of_reach else others)[
            :MAX_BRANCH_POSES
        ]
        held = self.expressions.free_symbols
        free = [k for k, v in enumerate(table.variables) if k != joint and v not in held]
        whole = self.is_about_the_pose
        search = PoseSearch(table, self.poses, whole, free, [joint], out_of_reach)
        if search.is_redundant:
            search = replace(search, whole=True)
        if search.is_redundant:
            return 0.0
        if not len(missed):
            return 1.0 if out_of_reach else 0.0
        mask = np.isin(np.arange(self.poses.count), missed)
        return float(np.mean(search.reached({self.variable: values}, mask, limits)[mask]))

    def passes(self, values: Floats, right: Floats) -> bool:
        """
        Return whether the values (N,) of a repaired formula are better than the user's values.

        The hit ratio of a formula is the fraction of the N configurations at which the formula
        returns the joint's position. The repaired formula is better if its hit ratio exceeds the
        user's hit ratio by more than MIN_HIT_RATIO. The argument `right` is not used.
        """
        hit_ratio = float(np.mean(self.hits(values)))
        return hit_ratio >= MIN_HIT_RATIO and hit_ratio > self.hit_ratio + MIN_HIT_RATIO
