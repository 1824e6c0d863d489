"""
What is known of each joint, and how a message changes it.

"""

import math

from . import angles, arrays, evaluation, places
from .arm import Arm
from .arrays import Floats, Integers

# Evidence that two publishers disagree about a joint: it jumps by more than MOVED_APART (rad or m)
# and back to within a fifth of that, again and again within the window.
MOVED_APART = 1e-3
RETURNED = 0.2


def _joints(size: int) -> int:
    # Of a memory with so many numbers.
    return (size - places.MEMORY_HEADER) // places.MEMORY_ROWS


def _note_jump(whole: Integers, n: int, j: int, arrival: int) -> None:
    count = whole[places.MEMORY_HEADER + places.JUMP_COUNT * n + j]
    at = places.JUMPS + count % places.JUMPS_KEPT
    whole[places.MEMORY_HEADER + at * n + j] = arrival
    whole[places.MEMORY_HEADER + places.JUMP_COUNT * n + j] = count + 1


def _forget(memory: Floats, n: int) -> None:
    numbers = arrays.after(memory, places.MEMORY_HEADER)
    whole = arrays.as_whole(numbers)
    for j in range(n):
        numbers[places.POSITION * n + j] = places.NAN
        numbers[places.BEFORE * n + j] = places.NAN
        numbers[places.VELOCITY * n + j] = places.NAN
        whole[places.DIFFERENCED * n + j] = 0
        whole[places.KNOWN * n + j] = 0
        whole[places.STAMPED * n + j] = 0
        whole[places.JUMP_COUNT * n + j] = 0


def forget(memory: Floats) -> None:
    """
    Know nothing of any joint any more.

    """
    _forget(arrays.results(memory, places.MEMORY_HEADER), _joints(arrays.size(memory)))


def _note_late(
    memory: Floats,
    n: int,
    ours: int,
    layout: Integers,
    positions: Floats,
    stamp: int,
    arrival: int,
) -> None:
    # A publisher whose clock is behind another's is never accepted, but it may still disagree:
    # joints that an older message has where they cannot have been.
    whole = arrays.as_whole(memory)
    numbers = arrays.after(memory, places.MEMORY_HEADER)
    joints = arrays.whole_after(whole, places.MEMORY_HEADER)
    for k in range(ours):
        j = layout[k]
        if joints[places.KNOWN * n + j] == 0:
            continue
        velocity = numbers[places.VELOCITY * n + j]
        speed = 0.0 if math.isnan(velocity) else abs(velocity)
        moved = 2.0 * speed * abs(joints[places.STAMP * n + j] - stamp) * 1e-9
        away = abs(positions[layout[ours + k]] - numbers[places.POSITION * n + j])
        if away > MOVED_APART + moved:
            _note_jump(whole, n, j, arrival)


def _store(
    memory: Floats,
    n: int,
    ours: int,
    layout: Integers,
    positions: Floats,
    velocities: Floats,
    heard: bool,
    at: int,
    stamped: bool,
    arrival: int,
) -> None:
    # What a message says of our joints; `heard`: its velocities count. `at` is its time, ns.
    whole = arrays.as_whole(memory)
    numbers = arrays.after(memory, places.MEMORY_HEADER)
    joints = arrays.whole_after(whole, places.MEMORY_HEADER)
    for k in range(ours):
        j, place = layout[k], layout[ours + k]
        position = positions[place]
        known = numbers[places.POSITION * n + j]
        jump = abs(position - known)
        back = abs(position - numbers[places.BEFORE * n + j])
        if jump > MOVED_APART and back < RETURNED * jump:
            _note_jump(whole, n, j, arrival)
        velocity, differenced = places.NAN, 0
        if heard:
            velocity = velocities[place]
        elif whole[places.VELOCITY_SOURCE] != places.FROM_MESSAGE:
            differenced = 1
            since = at - joints[places.STAMP * n + j]
            if joints[places.KNOWN * n + j] != 0 and 0 < since <= whole[places.TIMEOUT]:
                step = position - known
                if joints[places.WRAPS * n + j] != 0:
                    step = angles.shortest_angle(step)
                velocity = step / (since * 1e-9)
                if not math.isfinite(velocity):
                    velocity = places.NAN
        numbers[places.BEFORE * n + j] = known
        numbers[places.POSITION * n + j] = position
        numbers[places.VELOCITY * n + j] = velocity
        joints[places.DIFFERENCED * n + j] = differenced
        joints[places.KNOWN * n + j] = 1
        joints[places.STAMP * n + j] = at
        joints[places.STAMPED * n + j] = 1 if stamped else 0
        joints[places.ARRIVAL * n + j] = arrival


def _all_computable(numbers: Floats, places_of: Integers, count: int) -> bool:
    computable = True
    for k in range(count):
        computable = computable and abs(numbers[places_of[k]]) <= places.LARGEST
    return computable


def _latest_stamp(joints: Integers, n: int, ours: int, layout: Integers) -> int:
    # Of the joints of ours that have one; before all times where none has.
    latest = -places.LARGEST_STAMP
    for k in range(ours):
        j = layout[k]
        if joints[places.STAMPED * n + j] != 0:
            latest = max(latest, joints[places.STAMP * n + j])
    return latest


def _merge(
    memory: Floats,
    n: int,
    ours: int,
    layout: Integers,
    positions: Floats,
    velocities: Floats,
    has_velocities: bool,
    stamp: int,
    received: int,
    arrival: int,
) -> int:
    # What becomes of a message, as `observe` says it, but before any evaluation.
    message_places = arrays.whole_after(layout, ours)
    if not _all_computable(positions, message_places, ours):
        return places.BAD_POSITION

    whole = arrays.as_whole(memory)
    numbers = arrays.after(memory, places.MEMORY_HEADER)
    joints = arrays.whole_after(whole, places.MEMORY_HEADER)
    # Stamps of our joints must grow; a large step back is a new start, not an old message.
    anew = 0
    if stamp != 0:
        latest = _latest_stamp(joints, n, ours, layout)
        if stamp <= latest:
            if latest - stamp <= whole[places.TIMEOUT]:
                _note_late(memory, n, ours, layout, positions, stamp, arrival)
                return places.NOT_NEWER
            _forget(memory, n)
            whole[places.NEW_TOOL] = 1
            anew = places.STARTED_ANEW

    heard = (
        has_velocities
        and whole[places.VELOCITY_SOURCE] != places.FROM_DIFFERENCE
        and _all_computable(velocities, message_places, ours)
    )
    at = stamp if stamp != 0 else received
    _store(memory, n, ours, layout, positions, velocities, heard, at, stamp != 0, arrival)

    said = places.SAID_WITH_VELOCITIES
    for j in range(n):
        unheard = arrival - joints[places.ARRIVAL * n + j]
        if joints[places.KNOWN * n + j] == 0 or unheard > whole[places.TIMEOUT]:
            return places.INCOMPLETE + anew
        if math.isnan(numbers[places.VELOCITY * n + j]):
            said = places.SAID_WITHOUT_VELOCITIES
        elif joints[places.DIFFERENCED * n + j] != 0 and said == places.SAID_WITH_VELOCITIES:
            said = places.SAID_WITH_DIFFERENCES
    return said + anew


def _write_continuous_quaternion(memory: Floats, row: Floats, at: int) -> None:
    # Turned to the side of the last one, so that its sign is continuous from answer to answer.
    whole = arrays.as_whole(memory)
    along = 0.0
    for i in range(4):
        along += row[places.QUATERNION_AT + i] * memory[places.LAST_QUATERNION + i]
    sign = -1.0 if whole[places.NEW_TOOL] == 0 and along < 0.0 else 1.0
    for i in range(4):
        row[at + i] = sign * row[places.QUATERNION_AT + i]
        memory[places.LAST_QUATERNION + i] = row[at + i]
    whole[places.NEW_TOOL] = 0


def take(
    arm: Arm,
    memory: Floats,
    n: int,
    ours: int,
    layout: Integers,
    positions: Floats,
    velocities: Floats,
    has_velocities: bool,
    stamp: int,
    received: int,
    arrival: int,
    row: Floats,
    at: int,
) -> int:
    """
    Do what `observe` does; `at` is the width of the row.

    """
    said = _merge(
        memory, n, ours, layout, positions, velocities, has_velocities, stamp, received, arrival
    )
    if said % places.STARTED_ANEW > places.SAID_WITH_DIFFERENCES:
        return said
    numbers = arrays.after(memory, places.MEMORY_HEADER)
    moving = said % places.STARTED_ANEW != places.SAID_WITHOUT_VELOCITIES
    for j in range(n):
        row[at + j] = numbers[places.POSITION * n + j]
        row[at + n + j] = numbers[places.VELOCITY * n + j] if moving else 0.0
    if at == 0:
        return said
    if evaluation.evaluate_tail(arm.chain, row, at) >= 0:
        return places.NOT_COMPUTABLE + said // places.STARTED_ANEW * places.STARTED_ANEW
    _write_continuous_quaternion(memory, row, at + 2 * n)
    return said


def observe(
    arm: Arm,
    memory: Floats,
    layout: Integers,
    positions: Floats,
    velocities: Floats,
    stamp: int,
    received: int,
    arrival: int,
    row: Floats,
) -> int:
    """
    Take a message into the memory, and fill a row with the state it makes: all in one call.

    Returns SAID_WITHOUT_VELOCITIES to NOT_COMPUTABLE, plus STARTED_ANEW where its stamp stepped
    back so far that everything before was forgotten.

    Parameters
    ----------
    arm
        The arm.
    memory
        As joint_table.JointTable packs it.
    layout : shape (2 k,)
        Which k joints of ours the message names, then their places in it.
    positions, velocities : rad or m, rad/s or m/s
        Of the message; its velocities count where they are as many as its positions.
    stamp, received, arrival : ns
        As joint_sample.JointSample has them.
    row : shape (width + 2 n + ROW_TAIL,)
        As `evaluate_one` fills it, but the quaternion at its end with its sign continuous over
        time. Where the width is 0, q and qdot only.

    """
    arrays.given(arm)
    known = arrays.results(memory, places.MEMORY_HEADER)
    n = _joints(arrays.size(memory))
    at = arrays.size(row) - 2 * n - places.ROW_TAIL
    if n != arm.chain.dof or (at != 0 and at < places.JACOBIAN_AT):
        raise TypeError('the arrays of an arm and a message do not go together')
    return take(
        arm,
        known,
        n,
        arrays.size(layout) // 2,
        arrays.whole(layout, 0),
        arrays.numbers(positions, 0),
        arrays.numbers(velocities, 0),
        arrays.size(velocities) == arrays.size(positions),
        stamp,
        received,
        arrival,
        arrays.results(row, 0),
        at,
    )
