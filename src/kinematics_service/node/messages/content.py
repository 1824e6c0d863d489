"""Define the content of a topic: copied numbers, computed numbers, or a whole message."""

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
from ...kinematics.uncertainty.arm_errors import covariances
from ..parameters.settings import NodeSettings
from .messages import StateReport


@dataclass(frozen=True, eq=False)  # an array has no single truth value for `==`
class Copied:
    """
    Numbers that are copied from the row of a state, or from its measures.

    Attributes
    ----------
    columns
        The columns to copy; negative columns count from the end.
    of_measures
        Whether `columns` are columns of the measures; otherwise they are columns of the row.
    of_motion
        Whether the numbers exist only if the velocities are known.
    """

    columns: Integers
    of_measures: bool = False
    of_motion: bool = False

    depth: ClassVar[int] = kernel.JACOBIAN
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()

    def of(self, report: StateReport) -> Floats | None:
        """Return the numbers of a report; None if they need velocities that are not known."""
        state = report.answer.state
        if self.of_motion and not state.moving:
            return None
        row = measured(state).measures if self.of_measures else state.row
        assert row is not None
        return row[self.columns]

    def sources(self, row: int, measures: int) -> Integers:
        """
        Return the columns in a row of `row` numbers that is followed by the measures of the state.
        """
        return self.columns + row if self.of_measures else self.columns % row


NO_NUMBERS = Copied(np.empty(0, dtype=np.int64))  # for a message that has only a stamp


@dataclass(frozen=True, eq=False)
class WithCovariance:
    """
    Numbers that are copied from the row of a state, and their covariance (36,).

    Attributes
    ----------
    copied
        The numbers: the twist if `of_motion` is True, otherwise the pose.
    errors
        The uncertainty of the arm.
    """

    copied: Copied
    errors: PoseErrors

    depth: ClassVar[int] = kernel.ALL_FRAMES
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()

    @property
    def of_motion(self) -> bool:
        """Return whether the numbers exist only if the joint velocities are known."""
        return self.copied.of_motion

    def of(self, report: StateReport) -> Floats | None:
        """
        Return the numbers of a report with their covariance; None if they need unknown velocities.
        """
        numbers = self.copied.of(report)
        if numbers is None:
            return None
        covariance = covariances(self.errors, report.answer.state, BASE)[int(self.of_motion)]
        return np.concatenate([numbers, covariance.ravel()])

    def sources(self, row: int, measures: int) -> Integers:
        """Return the columns in a row that is followed by the measures and by two covariances."""
        begin = row + measures + (36 if self.of_motion else 0)
        return np.concatenate([self.copied.sources(row, measures), begin + np.arange(36)])


@dataclass(frozen=True, eq=False)
class Computed:
    """
    Numbers that are computed from a state.

    Attributes
    ----------
    of
        A function that returns the numbers of a report, of any shape, or None.
    depth
        How much of the state the kernel must compute.
    quantities
        The kinds of quantities that the answer must have.
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
        A function that returns the message of a report.
    depth
        As in `Computed`.
    period : ns
        Smallest difference of stamps between two messages.
    """

    message: Callable[[StateReport], Any]
    depth: int
    period: int

    of_motion: ClassVar[bool] = False
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()


Content = Copied | WithCovariance | Computed | Built
# A function of the settings that returns the content. It returns None if the robot lacks the
# content; the topic is then not offered.
ContentOf = Callable[[NodeSettings], Content | None]
# Content of a topic that is offered but never published for this arm.
SILENT = Computed(lambda report: None)


def computed(
    of: Callable[[StateReport], npt.ArrayLike | None],
    *quantities: type[StreamQuantity],
    depth: int = kernel.JACOBIAN,
) -> ContentOf:
    """
    Return a function of the settings that returns the computed content `of` for any settings.
    """
    return lambda settings: Computed(of, depth, quantities)
