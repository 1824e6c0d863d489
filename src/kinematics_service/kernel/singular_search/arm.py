"""Everything the kernel reads of an arm."""

import numpy as np

from ..forward.chain import Chain
from ..layout import places
from ..layout.arrays import Floats
from ..measures.factors import Tape
from ..measures.task_rows import TaskRows
from .singular_atlas import SingularAtlas


class Arm:
    """
    An arm as the kernel reads it, frozen: one argument of a call, which threads may share.

    Attributes
    ----------
    chain, task, tape
        How it moves, what it is judged by, and its named factors.
    factors_complete
        Whether the product of the factors is the determinant: no other singular poses.
    watched
        Column of the measure that the thresholds are about.
    warn, stop
        The thresholds.
    spans : shape (n, 3)
        Begin, reach and period of each joint, as in `SingularAtlas`; by default full turns.
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
        """Return samples of the singular poses, found once."""
        if self._atlas is None:
            self._atlas = SingularAtlas(self.chain, self.task, self.spans)
        return self._atlas
