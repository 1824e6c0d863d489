# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define an inverse kinematics problem: an arm, a target, and options of the solution."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ....errors import JointVectorError
from ....kernel import Floats
from ....robot.robot import Robot
from ...arguments import finite_vector
from .plan import InversePlan
from .target import IkTarget


class IkProblem(NamedTuple):
    """
    An inverse kinematics problem: an arm, its target, and the options of the solution.

    Attributes
    ----------
    robot, target, plan
        The arm, the target, and the plan: the method chosen for this arm and for the pose
        components that the target prescribes.
    near : shape (n,), rad or m
        Joint positions; solutions are sorted by their distance from `near`.
    seed
        Seed of the random starts of a search.
    curves
        Whether the curves of solutions are traced if the arm has one redundant joint.
    respect_limits
        Whether solutions outside the limits are left out.
    """

    robot: Robot
    target: IkTarget
    plan: InversePlan
    near: Floats
    seed: int
    curves: bool = True
    respect_limits: bool = True

    def random(self) -> np.random.Generator:
        """Return a new generator of random numbers with the seed of the problem."""
        return np.random.default_rng(self.seed)


def near_or_middle(robot: Robot, plan: InversePlan, near: npt.ArrayLike | None) -> Floats:
    """
    Return `near` as n finite numbers, or the middle of the joint limits if `near` is None.

    Raises
    ------
    JointVectorError
        `near` is not n finite numbers.
    """
    if near is None:
        return plan.middle
    return finite_vector(JointVectorError, 'near', near, robot.joint_names)
