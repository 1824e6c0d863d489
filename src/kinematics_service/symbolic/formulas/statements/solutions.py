"""
Whether an equation holds, and whether a formula of the inverse kinematics gives the joint back.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..arm.numbers import DEGREE, Floats
from ..arm.world import World
from .checks import Check, Mask
from .statements import Statement

# Share of the poses at which one branch of an inverse must hit: fewer are coincidences.
BRANCH = 0.1
# An angle near the end of acos has half the digits.
HIT = 1e-7
# Another branch is one at nearly every pose; starts and steps that find it where there is one.
MOST_POSES = 0.9
STARTS = 8
STEPS = 30
SEED = 1955


class EquationCheck(Check):
    """An equation between known names: both sides are equal at every pose."""

    @cached_property
    def right(self) -> Floats:
        """Return the left side, shape (N, 1, 1)."""
        return self.evaluation.of(self.statement.left)[:, None, None]


class PassiveJointCheck(Check):
    """
    A formula of a joint that closed loops move: equal at every pose, whole turns left out.
    """

    @cached_property
    def right(self) -> Floats:
        """Return the joint's position, with the turns of the formula, shape (N, 1, 1)."""
        table, joint = self.names.table, self.statement.joint
        position = self.poses.values[table.variables[joint]]
        if table.joint_types[joint] == 'prismatic':
            return position[:, None, None]
        turn = 2.0 * np.pi
        if self.statement.settings.degrees:
            position, turn = position / DEGREE, turn / DEGREE
        turns = np.round((self.person[:, 0, 0] - position) / turn)
        return np.asarray((position + turn * turns)[:, None, None])


@dataclass(frozen=True, eq=False)
class SolutionCheck(Check):
    """
    A formula of the inverse kinematics: put into the forward kinematics it gives the joint back.

    Parameters
    ----------
    others
        The formulas of the same file for other joints.
    """

    others: tuple[Statement, ...] = ()

    @cached_property
    def right(self) -> Floats:
        """Return the joint variable itself, shape (N, 1, 1)."""
        return self.poses.values[self.variable][:, None, None]

    @property
    def variable(self) -> Any:
        """Return the symbol of the joint."""
        return self.names.table.variables[self.statement.joint]

    @property
    def turns(self) -> bool:
        """Return whether the joint's value counts modulo a full turn."""
        return self.names.table.joint_types[self.statement.joint] != 'prismatic'

    def hits(self, values: Floats) -> Mask:
        """Return at which poses values of the formula are the joint's."""
        difference = self.in_radians(values) - self.right[:, 0, 0]
        if self.turns:
            difference = np.remainder(difference + np.pi, 2.0 * np.pi) - np.pi
        result: Mask = np.abs(difference) <= max(self.tolerance, HIT)
        return result

    def in_radians(self, values: Floats) -> Floats:
        """Return a formula's values in SI units."""
        degrees = self.statement.settings.degrees and self.turns
        return values * DEGREE if degrees else values

    @cached_property
    def share(self) -> float:
        """Return the share of the poses at which the formula gives the joint's own value."""
        return float(np.mean(self.hits(self.person[:, 0, 0])))

    @cached_property
    def reaches(self) -> bool:
        """Return whether the file's formulas together lead the tool back to every point."""
        values = dict(self.poses.values)
        for statement in self.others:
            check = SolutionCheck(self.robot, self.names, statement, self.poses)
            values[check.variable] = check.in_radians(check.person[:, 0, 0])
        if not all(np.all(np.isfinite(v)) for v in values.values()):
            return False
        there = World(self.names.table, values, self.poses.count).pose
        gap = self.gap(there[:, :3, 3], self.world.pose[:, :3, 3])
        return bool(np.all(gap <= HIT))

    @cached_property
    def wrong(self) -> Mask:
        """Return whether the formula is wrong, shape (1, 1)."""
        return np.array([[self.share < BRANCH and not self.is_other_branch]])

    @cached_property
    def is_other_branch(self) -> bool:
        """
        Return whether the other joints can bring the tool to its point with this joint so.

        Lengths stay inside their limits. Asked only where that is more than they can always do:
        the point has as many coordinates as the arm has joints, or more.
        """
        joint = self.statement.joint
        here = self.in_radians(self.person[:, 0, 0])
        good = np.isfinite(here)
        # A formula by other joints is about their values.
        held = self.expressions.free_symbols
        variables = self.names.table.variables
        free = [k for k, v in enumerate(variables) if k != joint and v not in held]
        rank = int(np.linalg.matrix_rank(self.world.jacobian[:, :3], tol=1e-9).max())
        if np.mean(good) < MOST_POSES or not free or rank <= len(free):
            return False
        left = good.copy()
        random = np.random.default_rng(SEED)
        for _ in range(STARTS):
            left &= ~self._reached(np.where(good, here, 0.0), free, random)
        return bool(np.mean(left[good]) <= 1.0 - MOST_POSES)

    def _reached(self, here: Floats, free: list[int], random: np.random.Generator) -> Mask:
        # Newton's damped steps of the other joints from random angles towards the point.
        table, count = self.names.table, self.poses.count
        target = self.world.pose[:, :3, 3]
        values = {**self.poses.values, self.variable: here}
        for k in free:
            turns = table.joint_types[k] != 'prismatic'
            span = np.pi if turns else 1.0
            values[table.variables[k]] = random.uniform(-span, span, count)
        gap = np.zeros((count, 3))
        for _ in range(STEPS):
            world = World(table, values, count)
            gap = target - world.pose[:, :3, 3]
            J = world.jacobian[:, :3, free]
            J_t = np.swapaxes(J, 1, 2)
            damped = J_t @ J + 1e-12 * np.eye(len(free))
            step = np.linalg.solve(damped, J_t @ gap[..., None])[..., 0]
            longest = np.max(np.abs(step), axis=1, keepdims=True)
            step *= np.minimum(1.0, 0.7 / np.maximum(longest, 1e-300))
            for column, k in enumerate(free):
                values[table.variables[k]] = values[table.variables[k]] + step[:, column]
        reached: Mask = np.max(np.abs(gap), axis=1) <= HIT
        for k, (low, high) in enumerate(self.robot.limits):
            if table.joint_types[k] == 'prismatic':
                length = values[table.variables[k]]
                reached &= (length >= low - HIT) & (length <= high + HIT)
        return reached

    def passes(self, i: int, j: int, expression: Any) -> bool:
        """Return whether another formula gives the joint back at enough poses."""
        return float(np.mean(self.hits(self.evaluation.of(expression)))) >= BRANCH
