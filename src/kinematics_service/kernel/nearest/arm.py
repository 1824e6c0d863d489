"""Everything the kernel reads of an arm."""

import numpy as np

from ..forward.chain import Chain
from ..layout import places
from ..layout.arrays import Floats
from ..measures.factors import Tape
from ..measures.task_rows import TaskRows
from .atlas import Atlas


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
    reach
        How far the tool comes from frame 0, or the characteristic length where that is more, m: by
        how much J_t bends. Singular poses are looked for only where it is known, not 0.
    spans : shape (n, 3)
        Of each joint, as `Atlas` has them; all around each if they are not given.
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
        reach: float = 0.0,
        spans: Floats | None = None,
    ) -> None:
        if task.joints != chain.dof or tape.joints > chain.dof:
            raise TypeError('the parts of an arm do not go together')
        if not 0 <= watched < places.LOST_AT:
            raise TypeError('the watched measure is none')
        self.chain, self.task, self.tape = chain, task, tape
        self.factors_complete = factors_complete
        self.watched, self.warn, self.stop, self.reach = watched, warn, stop, reach
        around = [-places.PI, places.TAU, places.INFINITY]
        self.spans: Floats = np.tile(around, (chain.dof, 1)) if spans is None else spans
        self._atlas: Atlas | None = None

    def atlas(self) -> Atlas:
        """Return singular poses from anywhere, of the factors where they are all: found once."""
        if self._atlas is None:
            by_factors = self.factors_complete
            self._atlas = Atlas(self.chain, self.task, self.tape, by_factors, self.spans)
        return self._atlas
