"""Hold the task, the thresholds and the named factors by which poses of an arm are judged."""

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

if TYPE_CHECKING:  # it loads the search for singular poses
    from ..kernel import Arm


@dataclass(frozen=True, eq=False)
class SingularityModel(FrozenArrays):
    """
    What the poses of one arm are judged by, frozen.

    Attributes
    ----------
    chain
        The arm.
    limits : shape (n, 2), rad or m
        Of its joints.
    task
        Rows of the Jacobian, and their length.
    thresholds
        The watched measure, and when to warn.
    factors
        Named functions whose zeros are singular poses.
    """

    chain: Chain
    limits: Floats
    task: Task
    thresholds: Thresholds
    factors: Factors

    @cached_property
    def arm(self) -> 'Arm':
        """
        Return all of it as the kernel reads it.

        The kernel samples the singular poses when it is first asked for one nearby.
        """
        return kernel.Arm(
            self.chain,
            self.task.kernel_rows,
            self.factors.tape,
            self.factors.complete,
            MEASURES[self.thresholds.measure].column,
            *self.thresholds.bounds_after(),  # no level before: without hysteresis
            joint_spans(self.chain, self.task, self.limits),
        )

    @cached_property
    def measure_places(self) -> MeasurePlaces:
        """Return where the measures stand in a row of them."""
        rows, factors = len(self.task.rows), len(self.factors.names)
        return measure_places(self.chain.dof, rows, factors)


def singularity_model(description: RobotDescription, chain: Chain) -> SingularityModel:
    """
    Return what a robot file says of singularities, with the defaults for what it leaves out.

    Raises
    ------
    KinematicsError
        The thresholds do not fit the arm, or a factor is zero where no pose is singular.
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
