"""Serialized messages: joint states taken from their bytes, and answered."""

from typing import Any

from . import judging, observing, outgoing
from .joint_memory import JointMemory, OurJoints
from .layout import arrays, places
from .layout.arrays import Bytes, Flat, FlatBytes, Floats, Nanoseconds
from .outgoing import OutgoingMessages
from .singular_search.nearest_search import NearestSearch


class IncomingForm:
    """
    A form of serialized joint states, and the joints of ours in them.

    Parameters
    ----------
    fixed, same : shape (size,)
        Bytes that select what must not change, and what stands there.
    stamp_at
        Where int32 seconds and uint32 nanoseconds begin, as in this machine's memory.
    positions, velocities
        Where their doubles are.
    ours
        Our joints.

    Attributes
    ----------
    table
        Both arrays, as given; the compiled kernel has their addresses.
    size
        Bytes of a message.
    stamp : ns
        Of the message that was last taken.
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
        self.ours, self.size, self.stamp_at = ours, arrays.size(fixed), stamp_at
        self.stamp: Nanoseconds = 0
        self.positions_at: int = positions.start
        self.velocities_at: int = velocities.start
        self.position_count: int = (positions.stop - positions.start) // 8
        self.velocity_count: int = (velocities.stop - velocities.start) // 8
        begins = (stamp_at, positions.start, velocities.start)
        ends = (stamp_at + 8, positions.stop, velocities.stop)
        counts = (self.position_count - ours.places_needed, self.velocity_count)
        if min(begins) < 0 or max(ends) > self.size or min(counts) < 0:
            raise ValueError('a place outside of the message')
        self.fixed = arrays.octets(fixed, self.size)
        self.same = arrays.octets(same, self.size)


def _fits(form: IncomingForm, data: FlatBytes) -> bool:
    # Whether the bytes are those of the form, where they are to be.
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
    Take a serialized message of a known form, and answer it: all in one call.

    Returns what `observe` returns, or NOT_THIS_FORM for bytes of another form and for a message
    without a stamp.

    Parameters
    ----------
    search
        Of the arm: that of the message before, or a new one.
    memory, arrival, row
        As in `observe`.
    form
        The form; its stamp is written.
    data
        The message.
    measures
        As in `measure_one`.
    answers
        What is filled with the state, as `fill_messages` does it.
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

    n, count = memory.joints, form.position_count
    width = arrays.size(row) - 2 * n - places.ROW_TAIL
    observing.check_fit(arm, memory, form.ours, count, width)
    evaluated = arrays.results(row, arm.chain.frames_at + 2 * n + places.ROW_TAIL)
    measured = arrays.results(measures, judging.width(arm))
    if answers is not None:
        numbers = arrays.size(row) + arrays.size(measures)
        outgoing.check_fit(answers, arm.chain, width, numbers)
    form.stamp = stamp
    work = arrays.scratch(max(count + form.velocity_count, judging.room(arm)))
    velocities = arrays.after(work, count)
    _copy_numbers(octets, form.positions_at, count, work)
    _copy_numbers(octets, form.velocities_at, form.velocity_count, velocities)
    said = observing.take(
        arm,
        memory,
        form.ours,
        work,
        velocities,
        count == form.velocity_count,
        stamp,
        0,
        arrival,
        evaluated,
        width,
    )
    if said % places.STARTED_ANEW <= places.SAID_WITH_DIFFERENCES:
        judging.judge_row(arm, evaluated, arrays.after(evaluated, width), measured, work, search)
        if answers is not None:
            q, qdot = arrays.after(evaluated, width), arrays.after(evaluated, width + n)
            outgoing.spread(answers, evaluated, q, qdot)
            outgoing.fill(
                answers, stamp, evaluated, arrays.size(row), measured, arrays.size(measures)
            )
    arrays.give_back(work)
    return said
