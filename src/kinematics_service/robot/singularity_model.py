# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Hold the data that the singularity test needs: chain, task, thresholds and singular factors."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from .. import kernel
from ..kernel import Chain, Floats
from .chain import FrozenArrays
from .factors import Factors, read_factors, with_loops
from .file.parts.description import RobotDescription
from .joint_spans import joint_spans
from .measure_places import MeasurePlaces, measure_places
from .measures import MEASURES, Thresholds, thresholds_for
from .task import Task, find_task, generic_poses

# The import is only for type checkers. At run time it would load the search for singular poses.
if TYPE_CHECKING:
    from ..kernel import Arm


@dataclass(frozen=True, eq=False)
class SingularityModel(FrozenArrays):
    """
    The read-only data with which the kernel tests whether an arm is singular.

    Attributes
    ----------
    chain
        The kernel's chain from the base to the tool.
    limits : shape (n, 2), rad or m
        The limits of the joints.
    task
        The rows of the Jacobian, and the characteristic length.
    thresholds
        The measure that the node watches, and its values at which WARN and ERROR begin.
    factors
        The singular factors: named functions of q whose zeros are singular poses.
    """

    chain: Chain
    limits: Floats
    task: Task
    thresholds: Thresholds
    factors: Factors

    @cached_property
    def arm(self) -> 'Arm':
        """
        Return the singularity model as an object of the kernel.

        The kernel samples the singular poses at the first search for the nearest singular pose.
        """
        return kernel.Arm(
            self.chain,
            self.task.kernel_rows,
            self.factors.tape,
            self.factors.complete,
            MEASURES[self.thresholds.measure].column,
            # The values at which WARN and ERROR begin, without hysteresis.
            *self.thresholds.bounds_after(),
            joint_spans(self.chain, self.task, self.limits),
        )

    @cached_property
    def measure_places(self) -> MeasurePlaces:
        """
        Return the column indices of the quantities that `kernel.measure` writes for this arm.
        """
        rows, factors = len(self.task.rows), len(self.factors.names)
        return measure_places(self.chain.dof, rows, factors)


def singularity_model(description: RobotDescription, chain: Chain) -> SingularityModel:
    """
    Return the singularity model of an arm; keys that the robot file omits have default values.

    Raises
    ------
    KinematicsError
        The thresholds do not fit the arm, or a zero of a factor is not a singular pose.
    """
    joints, settings = description.joints, description.singularity
    limits = np.array([[joint.lower, joint.upper] for joint in joints])
    names = [joint.name for joint in joints]
    prismatic = [joint.type == 'prismatic' for joint in joints]
    q = generic_poses(chain, limits, prismatic)
    task = find_task(chain, names, q, prismatic, settings.task, settings.length)
    factors = with_loops(read_factors(description, chain, task, q), description, chain)
    thresholds = thresholds_for(task, settings.measure, settings.warn, settings.stop)
    return SingularityModel(chain, limits, task, thresholds, factors)
