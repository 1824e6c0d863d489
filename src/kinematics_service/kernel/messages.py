# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read joint states from serialized messages, compute the tool state, and write this state into
outgoing messages.
"""

from typing import Any

import numpy as np

from . import judging, observing, outgoing
from .joint_memory import JointMemory, OurJoints, ReportedJoints
from .layout import arrays, places
from .layout.arrays import Bytes, Flat, FlatBytes, Floats, Nanoseconds
from .outgoing import OutgoingMessages
from .singular_search.nearest_search import NearestSearch


class IncomingForm:
    """
    The byte layout of serialized joint states that have equal joint names, and the indices of the
    arm's joints in these messages.

    Parameters
    ----------
    fixed, same : shape (size,)
        `fixed` is a mask of the bits that are equal in all messages; `same` has the values of
        these bits.
    stamp_at
        Offset of the stamp: int32 seconds, then uint32 nanoseconds, in this machine's byte order.
    positions, velocities
        Byte ranges of the doubles with positions, and with velocities.
    ours
        The joints of the arm that the messages report, and their indices in the messages.

    Attributes
    ----------
    table
        The arrays `fixed` and `same`; the compiled kernel uses their addresses.
    size
        Number of bytes of a message.
    reported
        The joint positions, velocities and times of the last message.
    """

    def __init__(
        self,
        fixed: Bytes,
        same: Bytes,
        stamp_at: int,
        positions: slice,
        velocities: slice,
        ours: OurJoints,
    ) -> None:
        self.table: tuple[Any, ...] = (fixed, same)
        self.size, self.stamp_at = arrays.size(fixed), stamp_at
        self.positions_at: int = positions.start
        self.velocities_at: int = velocities.start
        self.position_count: int = (positions.stop - positions.start) // 8
        self.velocity_count: int = (velocities.stop - velocities.start) // 8
        begins = (stamp_at, positions.start, velocities.start)
        ends = (stamp_at + 8, positions.stop, velocities.stop)
        counts = (self.position_count - ours.places_needed, self.velocity_count)
        if min(begins) < 0 or max(ends) > self.size or min(counts) < 0:
            raise ValueError('a place outside of the message')
        numbers, rates = np.zeros(self.position_count), np.zeros(self.velocity_count)
        self.reported = ReportedJoints(ours, numbers, rates, 0, 0, 0)
        self.fixed = arrays.octets(fixed, self.size)
        self.same = arrays.octets(same, self.size)


def _fits(form: IncomingForm, data: FlatBytes) -> bool:
    # Returns whether all fixed bits of the message have the values that the byte layout expects.
    other = 0
    for k in range(form.size):
        other |= (data[k] & form.fixed[k]) ^ form.same[k]
    return other == 0


def _copy_numbers(data: FlatBytes, at: int, count: int, numbers: Flat) -> None:
    for k in range(count):
        numbers[k] = arrays.number_at(data, at + 8 * k)


def observe_bytes(
    search: NearestSearch,
    memory: JointMemory,
    form: IncomingForm,
    data: bytes,
    arrival: Nanoseconds,
    row: Floats,
    measures: Floats,
    answers: OutgoingMessages | None,
) -> int:
    """
    Store the joint state of a serialized message in the memory, compute the tool state, and fill
    the outgoing messages.

    Return the result code of `observe`, or NOT_THIS_FORM if the message has another byte layout or
    the stamp 0.

    Parameters
    ----------
    search
        The object that searches the nearest singular pose. For the next message of a motion, pass
        the same object again: the search then continues from its previous result. A new object
        begins a new search.
    memory
        The memory of the arm's joints.
    form
        The byte layout. The call overwrites `form.reported`.
    data
        The bytes of the message.
    arrival : ns
        Time of receipt on the steady clock.
    row : shape (width + 2 n + ROW_TAIL,)
        Filled with the tool state, in the order of `observe`.
    measures
        Filled with the singularity measures of the new tool state, in the order of `measure`.
    answers
        Outgoing messages that are filled with the new tool state and its covariances; None to fill
        no messages.
    """
    arm = search.arm
    if len(data) != form.size:
        return places.NOT_THIS_FORM
    octets = arrays.octets_of(data)
    if not _fits(form, octets):
        return places.NOT_THIS_FORM
    at = form.stamp_at
    stamp = arrays.seconds_at(octets, at) * 1_000_000_000 + arrays.nanoseconds_at(octets, at + 4)
    if stamp == 0:
        return places.NOT_THIS_FORM

    n, reported = memory.joints, form.reported
    width = arrays.size(row) - 2 * n - places.ROW_TAIL
    observing.check_fit(arm, memory, reported.ours, width)
    evaluated = arrays.results(row, arm.chain.frames_at + 2 * n + places.ROW_TAIL)
    measured = arrays.results(measures, judging.width(arm))
    if answers is not None:
        numbers = arrays.size(row) + arrays.size(measures)
        outgoing.check_fit(answers, arm.chain, width, numbers)
    reported.stamp, reported.arrival = stamp, arrival
    _copy_numbers(octets, form.positions_at, form.position_count, reported.positions)
    _copy_numbers(octets, form.velocities_at, form.velocity_count, reported.velocities)
    work = arrays.scratch(judging.room(arm))
    outcome = observing.take(arm, memory, reported, evaluated, width)
    if outcome % places.STARTED_ANEW <= places.WITH_DIFFERENCES:
        judging.judge_row(arm, evaluated, arrays.after(evaluated, width), measured, work, search)
        if answers is not None:
            q, qdot = arrays.after(evaluated, width), arrays.after(evaluated, width + n)
            outgoing.fill_covariances(answers, evaluated, q, qdot)
            outgoing.fill(
                answers, stamp, evaluated, arrays.size(row), measured, arrays.size(measures)
            )
    arrays.give_back(work)
    return outcome
