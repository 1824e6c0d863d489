"""Serialized messages: joint states taken from their bytes, and answered."""

from typing import NamedTuple

from . import judging, observing, outgoing
from .joint_memory import JointMemory, OurJoints
from .layout import arrays, places
from .layout.arrays import Bytes, Flat, FlatBytes, Floats, Nanoseconds
from .nearest.nearest_singular import NearestSearch
from .outgoing import OutgoingMessages


class FormTable(NamedTuple):
    """
    What serialized joint states of one form have in common.

    Attributes
    ----------
    fixed, same : shape (size,)
        Bytes that select what must not change, and what stands there.
    stamp, positions, velocities
        Where they begin: int32 seconds and uint32 nanoseconds, then doubles, as in this machine's
        memory.
    position_count, velocity_count
        Their number.
    """

    fixed: Bytes
    same: Bytes
    stamp: int
    positions: int
    velocities: int
    position_count: int
    velocity_count: int


class IncomingForm:
    """
    A form of joint states, and the joints of ours in them.

    Attributes
    ----------
    table
        What they have in common. The compiled kernel has the addresses of its arrays.
    ours
        Our joints.
    size
        Bytes of a message.
    stamp : ns
        Of the message that was last taken.
    """

    def __init__(self, table: FormTable, ours: OurJoints) -> None:
        size = arrays.size(table.fixed)
        ends = (
            table.stamp + 8,
            table.positions + 8 * table.position_count,
            table.velocities + 8 * table.velocity_count,
        )
        if min(table[2:]) < 0 or max(ends) > size or ours.places_needed > table.position_count:
            raise ValueError('a place outside of the message')
        self.table: FormTable = table
        self.ours: OurJoints = ours
        self.size: int = size
        self.stamp: Nanoseconds = 0
        self.stamp_at: int = table.stamp
        self.positions_at: int = table.positions
        self.velocities_at: int = table.velocities
        self.position_count: int = table.position_count
        self.velocity_count: int = table.velocity_count
        self.fixed: FlatBytes = arrays.octets(table.fixed, size)
        self.same: FlatBytes = arrays.octets(table.same, size)


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
    arrays.given(search)
    arrays.given(memory)
    arrays.given(form)
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
