"""The changes of the joints' states by a message, and the state that it makes."""

import math

from . import evaluation, joint_memory
from .forward import angles
from .joint_memory import JointMemory, OurJoints
from .layout import arrays, places
from .layout.arrays import Flat, Floats, Nanoseconds
from .loops import closing
from .singular_search.arm import Arm

# Evidence that two publishers disagree about a joint: it jumps by more than MOVED_APART (rad or m)
# and back to within a fifth of that, again and again within the window.
MOVED_APART = 1e-3
RETURNED = 0.2


def _note_jump(memory: JointMemory, j: int, arrival: Nanoseconds) -> None:
    count = memory.jump_count[j]
    memory.jumps[places.JUMPS_KEPT * j + count % places.JUMPS_KEPT] = arrival
    memory.jump_count[j] = count + 1


def _note_late(
    memory: JointMemory, ours: OurJoints, positions: Flat, stamp: Nanoseconds, arrival: Nanoseconds
) -> None:
    # A publisher whose clock is behind another's is never accepted, but it may still disagree:
    # joints that an older message has where they cannot have been.
    for k in range(ours.count):
        j = ours.joint[k]
        if memory.known[j] == 0:
            continue
        velocity = memory.velocity[j]
        speed = 0.0 if math.isnan(velocity) else abs(velocity)
        moved = 2.0 * speed * abs(memory.stamp[j] - stamp) * 1e-9
        away = abs(positions[ours.place[k]] - memory.position[j])
        if away > MOVED_APART + moved:
            _note_jump(memory, j, arrival)


def _store(
    memory: JointMemory,
    ours: OurJoints,
    positions: Flat,
    velocities: Flat,
    heard: bool,
    at: Nanoseconds,
    stamped: bool,
    arrival: Nanoseconds,
) -> None:
    # Stores a message's values of the arm's joints; `heard`: its velocities count. `at` is its
    # time, ns.
    for k in range(ours.count):
        j, place = ours.joint[k], ours.place[k]
        position = positions[place]
        known = memory.position[j]
        jump = abs(position - known)
        back = abs(position - memory.before[j])
        if jump > MOVED_APART and back < RETURNED * jump:
            _note_jump(memory, j, arrival)
        velocity, differenced = places.NAN, 0
        if heard:
            velocity = velocities[place]
        elif memory.velocity_source != places.FROM_MESSAGE:
            differenced = 1
            since = at - memory.stamp[j]
            if memory.known[j] != 0 and 0 < since <= memory.timeout:
                step = position - known
                if memory.wraps[j] != 0:
                    step = angles.shortest_angle(step)
                velocity = step / (since * 1e-9)
                if not math.isfinite(velocity):
                    velocity = places.NAN
        memory.before[j] = known
        memory.position[j] = position
        memory.velocity[j] = velocity
        memory.differenced[j] = differenced
        memory.known[j] = 1
        memory.stamp[j] = at
        memory.stamped[j] = 1 if stamped else 0
        memory.arrival[j] = arrival


def _all_computable(numbers: Flat, ours: OurJoints) -> bool:
    computable = True
    for k in range(ours.count):
        computable = computable and abs(numbers[ours.place[k]]) <= places.LARGEST
    return computable


def _latest_stamp(memory: JointMemory, ours: OurJoints) -> Nanoseconds:
    # Returns the latest stamp of the joints; before all times if none has one.
    latest = -places.LARGEST_STAMP
    for k in range(ours.count):
        j = ours.joint[k]
        if memory.stamped[j] != 0:
            latest = max(latest, memory.stamp[j])
    return latest


def _merge(
    memory: JointMemory,
    ours: OurJoints,
    positions: Flat,
    velocities: Flat,
    has_velocities: bool,
    stamp: Nanoseconds,
    received: Nanoseconds,
    arrival: Nanoseconds,
) -> int:
    # Returns the outcome of a message, as for `observe`, but before any evaluation.
    if not _all_computable(positions, ours):
        return places.BAD_POSITION

    # Stamps of the arm's joints must grow; a large step back is a new start, not an old message.
    new_start = 0
    if stamp != 0:
        latest = _latest_stamp(memory, ours)
        if stamp <= latest:
            if latest - stamp <= memory.timeout:
                _note_late(memory, ours, positions, stamp, arrival)
                return places.NOT_NEWER
            joint_memory.clear(memory)
            memory.is_new_tool = True
            new_start = places.STARTED_ANEW

    heard = (
        has_velocities
        and memory.velocity_source != places.FROM_DIFFERENCE
        and _all_computable(velocities, ours)
    )
    at = stamp if stamp != 0 else received
    _store(memory, ours, positions, velocities, heard, at, stamp != 0, arrival)

    outcome = places.SAID_WITH_VELOCITIES
    for j in range(memory.joints):
        unheard = arrival - memory.arrival[j]
        if memory.known[j] == 0 or unheard > memory.timeout:
            return places.INCOMPLETE + new_start
        if math.isnan(memory.velocity[j]):
            outcome = places.SAID_WITHOUT_VELOCITIES
        elif memory.differenced[j] != 0 and outcome == places.SAID_WITH_VELOCITIES:
            outcome = places.SAID_WITH_DIFFERENCES
    return outcome + new_start


def _write_continuous_quaternion(memory: JointMemory, row: Flat, at: int) -> None:
    # Turned to the side of the last one, so that its sign is continuous from answer to answer.
    along = 0.0
    for i in range(4):
        along += row[places.QUATERNION_AT + i] * memory.last_quaternion[i]
    sign = -1.0 if not memory.is_new_tool and along < 0.0 else 1.0
    for i in range(4):
        row[at + i] = sign * row[places.QUATERNION_AT + i]
        memory.last_quaternion[i] = row[at + i]
    memory.is_new_tool = False


def _close(arm: Arm, memory: JointMemory, q: Flat, section: Flat) -> bool:
    # Closes the loops at q; where they closed at the last answer, on from there. Behind a pose at
    # which one does not close, nothing is known of the branch but the known positions.
    if memory.is_closed:
        failed = closing.close_next(arm.chain.closure, memory.closed, q, section)
    else:
        failed = closing.close(arm.chain.closure, q, section)
    memory.is_closed = failed == 0
    if failed == 0:
        arrays.copy(memory.closed, memory.closure, section)
    return failed == 0


def take(
    arm: Arm,
    memory: JointMemory,
    ours: OurJoints,
    positions: Flat,
    velocities: Flat,
    has_velocities: bool,
    stamp: Nanoseconds,
    received: Nanoseconds,
    arrival: Nanoseconds,
    row: Flat,
    at: int,
) -> int:
    """Do the work of `observe`; `at` is the width of the row."""
    outcome = _merge(memory, ours, positions, velocities, has_velocities, stamp, received, arrival)
    if outcome % places.STARTED_ANEW > places.SAID_WITH_DIFFERENCES:
        return outcome
    n = memory.joints
    moving = outcome % places.STARTED_ANEW != places.SAID_WITHOUT_VELOCITIES
    for j in range(n):
        row[at + j] = memory.position[j]
        row[at + n + j] = memory.velocity[j] if moving else 0.0
    if at == 0:
        return outcome
    loops = arm.chain.loops > 0
    if loops and not _close(
        arm, memory, arrays.after(row, at), arrays.after(row, arm.chain.closure_at)
    ):
        return places.NOT_CLOSED + outcome // places.STARTED_ANEW * places.STARTED_ANEW
    if evaluation.evaluate_tail(arm.chain, row, at, loops) >= 0:
        return places.NOT_COMPUTABLE + outcome // places.STARTED_ANEW * places.STARTED_ANEW
    _write_continuous_quaternion(memory, row, at + 2 * n)
    return outcome


def check_fit(arm: Arm, memory: JointMemory, ours: OurJoints, count: int, at: int) -> None:
    """
    Raise TypeError where they do not go together: a message of `count` positions, a row `at` wide.
    """
    if (
        memory.joints != arm.chain.dof
        or ours.joints_needed > memory.joints
        or ours.places_needed > count
        or (at != 0 and at < arm.chain.pose_width)
        or (arm.chain.loops > 0 and memory.closure != arm.chain.closure.width)
    ):
        raise TypeError('an arm, its memory and a message do not go together')


def observe(
    arm: Arm,
    memory: JointMemory,
    ours: OurJoints,
    positions: Floats,
    velocities: Floats,
    stamp: Nanoseconds,
    received: Nanoseconds,
    arrival: Nanoseconds,
    row: Floats,
) -> int:
    """
    Take a message into the memory, and fill a row with the state it makes: all in one call.

    Returns SAID_WITHOUT_VELOCITIES to NOT_CLOSED, plus STARTED_ANEW if its stamp stepped back
    so far that everything before was forgotten.

    Parameters
    ----------
    arm, memory
        The arm, and the states of its joints.
    ours
        The joints of the arm that the message names.
    positions, velocities : rad or m, rad/s or m/s
        From the message; its velocities count if they are as many as its positions.
    stamp, received, arrival : ns
        As in joint_sample.JointSample.
    row : shape (width + 2 n + ROW_TAIL,)
        As `evaluate_one` fills it, but the quaternion at its end with its sign continuous over
        time. If the width is 0, q and qdot only.
    """
    at = arrays.size(row) - 2 * memory.joints - places.ROW_TAIL
    check_fit(arm, memory, ours, arrays.size(positions), at)
    return take(
        arm,
        memory,
        ours,
        arrays.numbers(positions, 0),
        arrays.numbers(velocities, 0),
        arrays.size(velocities) == arrays.size(positions),
        stamp,
        received,
        arrival,
        arrays.results(row, 0),
        at,
    )
