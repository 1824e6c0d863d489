"""
Whether an equation holds, and whether a formula of the inverse kinematics gives the joint back.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .checks import Check, Mask
from .numbers import DEGREE, Floats
from .statements import Statement
from .world import World

# Share of the poses at which one branch of an inverse must hit: fewer are coincidences.
BRANCH = 0.1
# An angle near the end of acos has half the digits.
HIT = 1e-7


class EquationCheck(Check):
    """An equation between known names: both sides are equal at every pose."""

    @cached_property
    def right(self) -> Floats:
        """Return the left side, shape (N, 1, 1)."""
        return self.evaluation.of(self.statement.left)[:, None, None]


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
        return np.array([[self.share < BRANCH]])

    def passes(self, i: int, j: int, expression: Any) -> bool:
        """Return whether another formula gives the joint back at enough poses."""
        return float(np.mean(self.hits(self.evaluation.of(expression)))) >= BRANCH
