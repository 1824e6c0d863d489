# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define what a topic's messages contain: copied numbers, computed numbers, or a whole message."""

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


@dataclass(frozen=True, eq=False)  # eq=False, because arrays have no single truth value
class Copied:
    """
    Numbers that are copied from the kernel's results for a state (one row of an array), or from
    the singularity measures of the state.

    Attributes
    ----------
    columns
        The columns to copy; negative columns count from the end.
    of_measures
        Whether `columns` are columns of the measures; otherwise `columns` are columns of the row.
    of_motion
        Whether the numbers exist only if the joint velocities are known.
    """

    columns: Integers
    of_measures: bool = False
    of_motion: bool = False

    depth: ClassVar[int] = kernel.JACOBIAN
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()

    def of(self, report: StateReport) -> Floats | None:
        """
        Return the topic's numbers for a state report; None if the numbers need unknown velocities.
        """
        state = report.answer.state
        if self.of_motion and not state.moving:
            return None
        row = measured(state).measures if self.of_measures else state.row
        assert row is not None
        return row[self.columns]

    def sources(self, row: int, measures: int) -> Integers:
        """
        Return the indices of the numbers in an array that contains first the row of the state,
        with `row` numbers, then the measures.
        """
        return self.columns + row if self.of_measures else self.columns % row


NO_NUMBERS = Copied(np.empty(0, dtype=np.int64))  # content of messages that have only a stamp


@dataclass(frozen=True, eq=False)
class WithCovariance:
    """
    Numbers copied from the kernel's results for a state (one row), and their covariance (36,).

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
        Return the topic's numbers and covariance for a state report; None if velocities are
        unknown.
        """
        numbers = self.copied.of(report)
        if numbers is None:
            return None
        covariance = covariances(self.errors, report.answer.state, BASE)[int(self.of_motion)]
        return np.concatenate([numbers, covariance.ravel()])

    def sources(self, row: int, measures: int) -> Integers:
        """
        Return the indices of the numbers and of their covariance in an array. The array contains
        the row of the state, the measures, and the covariances of pose and twist.
        """
        begin = row + measures + (36 if self.of_motion else 0)
        return np.concatenate([self.copied.sources(row, measures), begin + np.arange(36)])


@dataclass(frozen=True, eq=False)
class Computed:
    """
    Numbers of a topic that a function computes from each report.

    Attributes
    ----------
    of
        A function that returns the numbers of a report, of any shape, or None.
    depth
        How much of the state the kernel must compute.
    quantities
        The kinds of additional quantities that the answer must contain.
    """

    of: Callable[[StateReport], npt.ArrayLike | None]
    depth: int = kernel.JACOBIAN
    quantities: tuple[type[StreamQuantity], ...] = ()

    of_motion: ClassVar[bool] = False


@dataclass(frozen=True, eq=False)
class Built:
    """
    A whole message of a topic that a function builds from each report.

    Attributes
    ----------
    message
        A function that returns the message of a report.
    depth
        How much of the state the kernel must compute.
    period : ns
        Smallest difference between the stamps of two published messages.
    """

    message: Callable[[StateReport], Any]
    depth: int
    period: int

    of_motion: ClassVar[bool] = False
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()


Content = Copied | WithCovariance | Computed | Built
# A function of the settings that returns the content of a topic. If the robot lacks this content,
# the function returns None, and the node does not offer the topic.
ContentOf = Callable[[NodeSettings], Content | None]
# Content of a topic that the node offers, but never publishes for this arm.
SILENT = Computed(lambda report: None)


def computed(
    of: Callable[[StateReport], npt.ArrayLike | None],
    *quantities: type[StreamQuantity],
    depth: int = kernel.JACOBIAN,
) -> ContentOf:
    """
    Return a function that ignores the settings and returns `Computed` content with the function
    `of`.
    """
    return lambda settings: Computed(of, depth, quantities)
