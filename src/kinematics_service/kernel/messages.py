"""
Serialized messages: joint states taken from their bytes, and answered.

"""

from . import arrays, joint_memory, judging, outgoing, places
from .arm import Arm
from .arrays import Bytes, Floats, Integers
from .outgoing import OutgoingMessages


def _is_of_form(form: Integers, data: Bytes, size: int) -> bool:
    # Whether the bytes are those of the form's pattern, where they are to be.
    pattern = arrays.as_octets(arrays.whole_after(form, form[places.FORM_PATTERN]))
    other = 0
    for k in range(size):
        other |= (data[k] & pattern[k]) ^ pattern[size + k]
    return other == 0


def _copy_numbers(data: Bytes, at: int, count: int, numbers: Floats) -> None:
    for k in range(count):
        numbers[k] = arrays.number_at(data, at + 8 * k)


def observe_bytes(
    arm: Arm,
    memory: Floats,
    form: Integers,
    data: Bytes,
    arrival: int,
    row: Floats,
    results: Floats,
    answers: OutgoingMessages | None,
) -> int:
    """
    Take a serialized message of a known form, and answer it: all in one call.

    Returns what `observe` returns, or NOT_THIS_FORM for bytes of another form and for a message
    without a stamp.

    Parameters
    ----------
    arm, memory, arrival, row
        As in `observe`.
    form
        See FORM_STAMP; FORM_NOW is written.
    data : shape (FORM_BYTES,)
        The message.
    results
        As the measures in `measure_one`.
    answers
        What is filled with the state, as `fill_messages` does it.

    """
    arrays.given(arm)
    header = arrays.whole_results(form, places.FORM_HEADER)
    size = arrays.size(data)
    octets = arrays.octets(data, 0)
    if header[places.FORM_BYTES] != size or not _is_of_form(header, octets, size):
        return places.NOT_THIS_FORM
    at = header[places.FORM_STAMP]
    stamp = arrays.seconds_at(octets, at) * 1_000_000_000 + arrays.nanoseconds_at(octets, at + 4)
    if stamp == 0:
        return places.NOT_THIS_FORM

    known = arrays.results(memory, places.MEMORY_HEADER)
    n = arm.chain.dof
    width = arrays.size(row) - 2 * n - places.ROW_TAIL
    evaluated = arrays.results(row, arm.chain.frames_at + 2 * n + places.ROW_TAIL)
    measured = arrays.results(results, judging.width(arm))
    if answers is not None and arrays.size(row) + arrays.size(results) < answers.needed:
        raise TypeError('a state has fewer numbers than the messages take')
    count = header[places.FORM_COUNT]
    velocity_count = header[places.FORM_VELOCITY_COUNT]
    header[places.FORM_NOW] = stamp
    work = arrays.scratch(max(count + velocity_count, judging.room(arm)))
    velocities = arrays.after(work, count)
    _copy_numbers(octets, header[places.FORM_POSITIONS], count, work)
    _copy_numbers(octets, header[places.FORM_VELOCITIES], velocity_count, velocities)
    said = joint_memory.take(
        arm,
        known,
        n,
        (header[places.FORM_PATTERN] - places.FORM_HEADER) // 2,
        arrays.whole_after(header, places.FORM_HEADER),
        work,
        velocities,
        count == velocity_count,
        stamp,
        0,
        arrival,
        evaluated,
        width,
    )
    if said % places.STARTED_ANEW <= places.SAID_WITH_DIFFERENCES:
        q = arrays.after(evaluated, width)
        judging.judge_row(arm, evaluated, q, measured, work)
        if answers is not None:
            outgoing.fill(answers, stamp, evaluated, arrays.size(row), measured)
    arrays.give_back(work)
    return said
