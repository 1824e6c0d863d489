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
    A topic's numbers, copied from one of two arrays of the kernel: the row of results for a state
    (pose, Jacobian, twist), or the state's singularity measures.

    Attributes
    ----------
    columns
        Indices of the numbers to copy; negative ones count from the end of the array.
    of_measures
        Whether `columns` are indices in the singularity measures; otherwise they are indices in
        the row of results.
    of_motion
        Whether the joint velocities are needed to compute the numbers.
    """

    columns: Integers
    of_measures: bool = False
    of_motion: bool = False

    depth: ClassVar[int] = kernel.JACOBIAN
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()

    def of(self, report: StateReport) -> Floats | None:
        """
        Return the topic's numbers for a state report; None if they need joint velocities that are
        unknown.
        """
        state = report.answer.state
        if self.of_motion and not state.moving:
            return None
        row = measured(state).measures if self.of_measures else state.row
        assert row is not None
        return row[self.columns]

    def sources(self, row: int, measures: int) -> Integers:
        """
        Return, for each number of the message, its index in an array of the kernel.

        The array has `row` numbers that are results for a state, then `measures` numbers that are
        singularity measures.
        """
        return self.columns + row if self.of_measures else self.columns % row


NO_NUMBERS = Copied(np.empty(0, dtype=np.int64))  # content of a message that has only a stamp


@dataclass(frozen=True, eq=False)
class WithCovariance:
    """
    A topic's pose or twist, copied from the kernel's results for a state, and its covariance
    (36,).

    Attributes
    ----------
    copied
        The copied numbers: those of the twist if `copied.of_motion` is True, otherwise those of
        the pose.
    errors
        The uncertainty of the arm.
    """

    copied: Copied
    errors: PoseErrors

    depth: ClassVar[int] = kernel.ALL_FRAMES
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()

    @property
    def of_motion(self) -> bool:
        """Return whether the joint velocities are needed to compute the numbers."""
        return self.copied.of_motion

    def of(self, report: StateReport) -> Floats | None:
        """
        Return the topic's numbers and their covariance for a state report; None for a twist if
        joint velocities are unknown.
        """
        numbers = self.copied.of(report)
        if numbers is None:
            return None
        covariance = covariances(self.errors, report.answer.state, BASE)[int(self.of_motion)]
        return np.concatenate([numbers, covariance.ravel()])

    def sources(self, row: int, measures: int) -> Integers:
        """
        Return, for each number of the message, its index in an array of the kernel.

        The message has the pose (or twist), then the covariance (36 numbers). The array has `row`
        numbers that are results for a state, then `measures` singularity measures, the covariance
        of the pose (36 numbers), and the covariance of the twist (36 numbers).
        """
        begin = row + measures + (36 if self.of_motion else 0)
        return np.concatenate([self.copied.sources(row, measures), begin + np.arange(36)])


@dataclass(frozen=True, eq=False)
class Computed:
    """
    Numbers of a topic that a function computes from each state report.

    Attributes
    ----------
    of
        A function of a state report. It returns an array of any shape with the topic's numbers, or
        None if it cannot compute the numbers.
    depth
        `kernel.JACOBIAN`, or `kernel.ALL_FRAMES` if `of` needs the link frames.
    quantities
        Classes of the quantities, such as accelerations, that `of` needs in the report besides the
        state.
    """

    of: Callable[[StateReport], npt.ArrayLike | None]
    depth: int = kernel.JACOBIAN
    quantities: tuple[type[StreamQuantity], ...] = ()

    of_motion: ClassVar[bool] = False


@dataclass(frozen=True, eq=False)
class Built:
    """
    A whole message of a topic that a function builds from each state report.

    Attributes
    ----------
    message
        A function that returns the message for a state report.
    depth
        `kernel.JACOBIAN`, or `kernel.ALL_FRAMES` if `message` needs the link frames.
    period : ns
        The stamps are divided into intervals of this length, from 0. The first state in each
        interval is published.
    """

    message: Callable[[StateReport], Any]
    depth: int
    period: int

    of_motion: ClassVar[bool] = False
    quantities: ClassVar[tuple[type[StreamQuantity], ...]] = ()


Content = Copied | WithCovariance | Computed | Built
# A function that returns the content of a topic for a node's settings. It returns None if the
# topic has no meaning for the arm; the node then does not offer the topic.
ContentOf = Callable[[NodeSettings], Content | None]
# Content of a topic that exists but has no messages, because the arm lacks the topic's measure.
SILENT = Computed(lambda report: None)


def computed(
    of: Callable[[StateReport], npt.ArrayLike | None],
    *quantities: type[StreamQuantity],
    depth: int = kernel.JACOBIAN,
) -> ContentOf:
    """
    Return a function that takes the settings and returns the content of a topic.

    The settings have no effect: the content is always `Computed`, and the function `of` computes
    its numbers.
    """
    return lambda settings: Computed(of, depth, quantities)
