"""The content of a topic: numbers that are copied or computed, or a message built as a whole."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...estimation.estimator import StreamQuantity
from ...kernel import Floats, Integers, PoseErrors
from ...kinematics.forward import BASE
from ...kinematics.singularity import measured
from ...kinematics.uncertainty.covariances import covariances
from ..parameters.settings import NodeSettings
from .messages import StateReport


@dataclass(frozen=True, eq=False)  # arrays have no single truth value
class Copied:
    """
    Numbers that are copied from a state's row, or from its measures.

    Attributes
    ----------
    columns
        Their columns; negative ones count from the end.
    of_measures
        Whether these are columns of the measures.
    of_motion
        Whether there are such numbers only if the velocities are known.
    """

    columns: Integers
    of_measures: bool = False
    of_motion: bool = False

    depth: ClassVar[int] = kernel.JACOBIAN
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()

    def of(self, report: StateReport) -> Floats | None:
        """Return the numbers of a report; None if it has none."""
        state = report.answer.state
        if self.of_motion and not state.moving:
            return None
        row = measured(state).measures if self.of_measures else state.row
        assert row is not None
        return row[self.columns]

    def sources(self, row: int, measures: int) -> Integers:
        """
        Return their columns in a row of so many numbers and, beyond its end, in the measures.
        """
        return self.columns + row if self.of_measures else self.columns % row


NO_NUMBERS = Copied(np.empty(0, dtype=np.int64))  # of a message that is a stamp


@dataclass(frozen=True, eq=False)
class WithCovariance:
    """
    Numbers that are copied from a state's row, and the covariance of what they say behind them.

    Attributes
    ----------
    copied
        The numbers. The covariance is that of the twist if they are of the motion; otherwise it
        is that of the pose.
    errors
        What may be off in the arm.
    """

    copied: Copied
    errors: PoseErrors

    depth: ClassVar[int] = kernel.ALL_FRAMES
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()

    @property
    def of_motion(self) -> bool:
        """Return whether there are such numbers only if the velocities are known."""
        return self.copied.of_motion

    def of(self, report: StateReport) -> Floats | None:
        """Return the numbers of a report; None if it has none."""
        numbers = self.copied.of(report)
        if numbers is None:
            return None
        found = covariances(self.errors, report.answer.state, BASE)[int(self.of_motion)]
        return np.concatenate([numbers, found.ravel()])

    def sources(self, row: int, measures: int) -> Integers:
        """Return their columns in a row, where the covariances stand beyond the measures."""
        begin = row + measures + (36 if self.of_motion else 0)
        return np.concatenate([self.copied.sources(row, measures), begin + np.arange(36)])


@dataclass(frozen=True, eq=False)
class Computed:
    """
    Numbers that are computed from a state.

    Attributes
    ----------
    of
        Returns the numbers of a report, of any shape; None if it has none.
    depth
        How much of the state the kernel must have computed.
    quantities
        The kinds of quantities in the answer that it needs.
    """

    of: Callable[[StateReport], npt.ArrayLike | None]
    depth: int = kernel.JACOBIAN
    quantities: tuple[type[StreamQuantity], ...] = ()

    of_motion: ClassVar[bool] = False


@dataclass(frozen=True, eq=False)
class Built:
    """
    A message that is built as a whole.

    Attributes
    ----------
    message
        Returns the message of a report.
    depth
        As in `Computed`.
    period : ns
        Least difference of stamps between two messages.
    """

    message: Callable[[StateReport], Any]
    depth: int
    period: int

    of_motion: ClassVar[bool] = False
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()


def flat(numbers: npt.ArrayLike) -> Floats:
    """Return numbers of any shape as a vector."""
    return np.asarray(numbers, dtype=np.float64).ravel()


Content = Copied | WithCovariance | Computed | Built
# A function of the settings; None if the robot file lacks what the topic needs: it is not offered.
ContentOf = Callable[[NodeSettings], Content | None]
# The topic is offered and nothing is ever published: the arm has no such number.
SILENT = Computed(lambda report: None)


def computed(
    of: Callable[[StateReport], npt.ArrayLike | None],
    *quantities: type[StreamQuantity],
    depth: int = kernel.JACOBIAN,
) -> ContentOf:
    """Return a function of the settings whose content is the same for all: computed numbers."""
    return lambda settings: Computed(of, depth, quantities)
