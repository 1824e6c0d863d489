"""
Serialized messages: joint states read from their bytes, answers written where messages have them.

"""

from . import arrays, joint_memory, judging, places
from .arm import Arm
from .arrays import Bytes, Floats, Integers


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
    sheet: Floats,
) -> int:
    """
    Take a serialized message of a known form: `observe`, `measure_one`, `fill_sheet` in one call.

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
    sheet
        As in `fill_sheet`.

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
        if arrays.size(sheet) > 0:
            _fill_sheet(arrays.results(sheet, 0), stamp, evaluated, arrays.size(row), measured)
    arrays.give_back(work)
    return said


def fill_sheet(sheet: Floats, stamp: int, row: Floats, results: Floats) -> None:
    """
    Copy a stamp and numbers of a state to where serialized messages have them.

    Parameters
    ----------
    sheet
        Empty for nothing. Otherwise whole numbers, bit for bit: how many stamps, how many
        numbers, where in the sheet the stamps go (in units of four bytes), where the numbers come
        from (a place in `row`, or beyond its end in `results`), and where in the sheet they go;
        then the messages.
    stamp : ns
        Beyond what a message can hold, the nearest it can.
    row, results
        As `observe_bytes` fills them.

    """
    if arrays.size(sheet) > 0:
        _fill_sheet(
            arrays.results(sheet, 0),
            stamp,
            arrays.numbers(row, 0),
            arrays.size(row),
            arrays.numbers(results, 0),
        )


def _fill_sheet(sheet: Floats, stamp: int, row: Floats, size: int, results: Floats) -> None:
    whole = arrays.as_whole(sheet)
    stamps, count = whole[0], whole[1]
    seconds = stamp // 1_000_000_000
    if seconds * 1_000_000_000 > stamp:  # C rounds towards zero
        seconds -= 1
    nanoseconds = stamp - seconds * 1_000_000_000
    seconds = max(-places.LARGEST_SECOND - 1, min(places.LARGEST_SECOND, seconds))
    words = arrays.as_half_words(sheet)
    for k in range(2, 2 + stamps):
        words[whole[k]] = seconds
        words[whole[k] + 1] = nanoseconds
    sources = arrays.whole_after(whole, 2 + stamps)
    targets = arrays.whole_after(sources, count)
    for k in range(count):
        source = sources[k]
        sheet[targets[k]] = row[source] if source < size else results[source - size]
