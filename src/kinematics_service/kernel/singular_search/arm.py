# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Collect the data of an arm from which the kernel computes singularity measures and singular poses.
"""

import numpy as np

from ..forward.chain import Chain
from ..layout import places
from ..layout.arrays import Floats
from ..measures.factors import Tape
from ..measures.task_rows import TaskRows
from .singular_atlas import SingularAtlas


class Arm:
    """
    The chain, task, singular factors and thresholds of an arm for the kernel; immutable, so
    threads may share it.

    Attributes
    ----------
    chain
        The kinematic chain.
    task
        Selects and scales the rows of the Jacobian that form the task Jacobian J_t.
    tape
        Computes the singular factors that the robot file names.
    factors_complete
        Whether the product of the factors is the determinant of J_t. If so, only the zeros of the
        factors are singular poses.
    watched
        Index, in a row of measures, of the measure that is compared with the thresholds.
    warn, stop
        Thresholds of the levels WARN and ERROR.
    spans : shape (n, 3)
        First position, range and period of each joint, as in `SingularAtlas`; by default full
        turns.
    """

    def __init__(
        self,
        chain: Chain,
        task: TaskRows,
        tape: Tape,
        factors_complete: bool,
        watched: int,
        warn: float,
        stop: float,
        spans: Floats | None = None,
    ) -> None:
        if task.joints != chain.dof or tape.joints > chain.dof:
            raise TypeError('the parts of an arm do not go together')
        if not 0 <= watched < places.LOST_AT:
            raise TypeError('the watched measure is none')
        self.chain, self.task, self.tape = chain, task, tape
        self.factors_complete = factors_complete
        self.watched, self.warn, self.stop = watched, warn, stop
        around = [-places.PI, places.TAU, places.INFINITY]
        self.spans: Floats = np.tile(around, (chain.dof, 1)) if spans is None else spans
        self._atlas: SingularAtlas | None = None

    def atlas(self) -> SingularAtlas:
        """
        Return the `SingularAtlas` of the arm, samples of its singular poses; the first call
        computes the samples.
        """
        if self._atlas is None:
            self._atlas = SingularAtlas(self.chain, self.task, self.spans)
        return self._atlas
