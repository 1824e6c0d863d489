# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Update the joint memory with a message, and compute the tool state from the memory."""

import math

from . import evaluation, joint_memory
from .forward import angles
from .joint_memory import JointMemory, OurJoints, ReportedJoints
from .layout import arrays, places
from .layout.arrays import Flat, Floats, Nanoseconds
from .loops import closing
from .singular_search.arm import Arm

# Smallest change of a reported position that is taken as a jump, rad or m. Jumps show that two
# publishers report different positions of one joint: the position then jumps and returns
# repeatedly.
MIN_JUMP = 1e-3
# A joint has returned after a jump if its distance from the position before the jump is below this
# fraction of the jump.
RETURN_RATIO = 0.2


def _note_jump(memory: JointMemory, j: int, arrival: Nanoseconds) -> None:
    count = memory.jump_count[j]
    memory.jumps[places.JUMPS_KEPT * j + count % places.JUMPS_KEPT] = arrival
    memory.jump_count[j] = count + 1


def _note_late(memory: JointMemory, reported: ReportedJoints) -> None:
    # The message was refused, because its stamp is not newer than the stamp of an earlier message.
    # Perhaps a second publisher, whose clock is late, has sent it. If the two publishers report
    # different positions of one joint, the position jumps. So record a jump for each joint whose
    # reported position is impossible. A position is impossible if the joint could not reach it
    # between the two stamps, even at twice its present velocity.
    for k in range(reported.ours.count):
        j = reported.ours.joint[k]
        if memory.known[j] == 0:
            continue
        velocity = memory.velocity[j]
        speed = 0.0 if math.isnan(velocity) else abs(velocity)
        moved = 2.0 * speed * abs(memory.stamp[j] - reported.stamp) * 1e-9
        away = abs(reported.positions[reported.ours.place[k]] - memory.position[j])
        if away > MIN_JUMP + moved:
            _note_jump(memory, j, reported.arrival)


def _store(memory: JointMemory, reported: ReportedJoints, use_velocities: bool) -> None:
    # Stores the joint positions of a message in the memory. Stores a velocity for each joint, too.
    # If `use_velocities` is set, the velocities are those of the message. If not, they are
    # differences of positions divided by time. But if the memory's velocity source is
    # FROM_MESSAGE, they are unknown (NaN).
    at = reported.stamp if reported.stamp != 0 else reported.received
    for k in range(reported.ours.count):
        j, place = reported.ours.joint[k], reported.ours.place[k]
        position = reported.positions[place]
        last = memory.position[j]
        jump = abs(position - last)
        back = abs(position - memory.before[j])
        if jump > MIN_JUMP and back < RETURN_RATIO * jump:
            _note_jump(memory, j, reported.arrival)
        velocity, differenced = places.NAN, 0
        if use_velocities:
            velocity = reported.velocities[place]
        elif memory.velocity_source != places.FROM_MESSAGE:
            differenced = 1
            since = at - memory.stamp[j]
            if memory.known[j] != 0 and 0 < since <= memory.timeout:
                step = position - last
                if memory.wraps[j] != 0:
                    step = angles.shortest_angle(step)
                velocity = step / (since * 1e-9)
                if not math.isfinite(velocity):
                    velocity = places.NAN
        memory.before[j] = last
        memory.position[j] = position
        memory.velocity[j] = velocity
        memory.differenced[j] = differenced
        memory.known[j] = 1
        memory.stamp[j] = at
        memory.stamped[j] = 1 if reported.stamp != 0 else 0
        memory.arrival[j] = reported.arrival


def _all_computable(numbers: Flat, ours: OurJoints) -> bool:
    computable = True
    for k in range(ours.count):
        computable = computable and abs(numbers[ours.place[k]]) <= places.LARGEST
    return computable


def _latest_stamp(memory: JointMemory, ours: OurJoints) -> Nanoseconds:
    # Returns the latest stamp of the joints in `ours`, ns. Returns a time before all stamps if
    # none of these joints has a stamp.
    latest = -places.LARGEST_STAMP
    for k in range(ours.count):
        j = ours.joint[k]
        if memory.stamped[j] != 0:
            latest = max(latest, memory.stamp[j])
    return latest


def _merge(memory: JointMemory, reported: ReportedJoints) -> int:
    # Updates the memory with a message. Returns a result code of `observe`, under the assumption
    # that the tool state can be computed from the new joint positions. If it cannot, `take`
    # returns another code.
    if not _all_computable(reported.positions, reported.ours):
        return places.BAD_POSITION

    # Refuse a message whose stamp is not newer than the last stamps of its joints. But if the
    # stamp steps back by more than the timeout, the clock was reset: clear the memory and accept
    # the message.
    new_start = 0
    if reported.stamp != 0:
        latest = _latest_stamp(memory, reported.ours)
        if reported.stamp <= latest:
            if latest - reported.stamp <= memory.timeout:
                _note_late(memory, reported)
                return places.NOT_NEWER
            joint_memory.clear(memory)
            memory.is_new_tool = True
            new_start = places.STARTED_ANEW

    use_velocities = (
        reported.has_velocities
        and memory.velocity_source != places.FROM_DIFFERENCE
        and _all_computable(reported.velocities, reported.ours)
    )
    _store(memory, reported, use_velocities)

    outcome = places.WITH_VELOCITIES
    for j in range(memory.joints):
        age = reported.arrival - memory.arrival[j]
        if memory.known[j] == 0 or age > memory.timeout:
            return places.INCOMPLETE + new_start
        if math.isnan(memory.velocity[j]):
            outcome = places.WITHOUT_VELOCITIES
        elif memory.differenced[j] != 0 and outcome == places.WITH_VELOCITIES:
            outcome = places.WITH_DIFFERENCES
    return outcome + new_start


def _write_continuous_quaternion(memory: JointMemory, row: Flat, at: int) -> None:
    # Writes the quaternion to `row`. Chooses the sign for which the scalar product with the last
    # quaternion is positive, so that the quaternion is continuous over time.
    along = 0.0
    for i in range(4):
        along += row[places.QUATERNION_AT + i] * memory.last_quaternion[i]
    sign = -1.0 if not memory.is_new_tool and along < 0.0 else 1.0
    for i in range(4):
        row[at + i] = sign * row[places.QUATERNION_AT + i]
        memory.last_quaternion[i] = row[at + i]
    memory.is_new_tool = False


def _close(arm: Arm, memory: JointMemory, q: Flat, section: Flat) -> bool:
    # Computes the passive variables of the loops at q. Starts from the last tool state if the
    # loops closed at this state, otherwise from the joint positions of the robot file. Returns
    # whether the loops close.
    if memory.is_closed:
        failed = closing.close_next(arm.chain.closure, memory.closed, q, section)
    else:
        failed = closing.close(arm.chain.closure, q, section)
    memory.is_closed = failed == 0
    if failed == 0:
        arrays.copy(memory.closed, memory.closure, section)
    return failed == 0


def take(arm: Arm, memory: JointMemory, reported: ReportedJoints, row: Flat, at: int) -> int:
    """
    Store the joints of a message in the memory, and fill `row` with the new tool state. In `row`,
    q begins at index `at`. Return a result code of `observe`.

    The caller must have checked the arguments with `check_fit`.
    """
    outcome = _merge(memory, reported)
    if outcome % places.STARTED_ANEW > places.WITH_DIFFERENCES:
        return outcome
    n = memory.joints
    moving = outcome % places.STARTED_ANEW != places.WITHOUT_VELOCITIES
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


def check_fit(arm: Arm, memory: JointMemory, ours: OurJoints, at: int) -> None:
    """
    Raise TypeError if the arm, the memory and the joints `ours` of a message do not fit.

    The memory must have the joints and the closed loops of the arm. `ours` must not have a joint
    that the arm does not have. `at` is the index of q in the row of results. If `at` is 0, the row
    has only q and qdot. Otherwise the results of `evaluate` are in front of q, and they must
    include at least the pose.
    """
    if (
        memory.joints != arm.chain.dof
        or ours.joints_needed > memory.joints
        or (at != 0 and at < arm.chain.pose_width)
        or (arm.chain.loops > 0 and memory.closure != arm.chain.closure.width)
    ):
        raise TypeError('an arm, its memory and a message do not go together')


def observe(arm: Arm, memory: JointMemory, reported: ReportedJoints, row: Floats) -> int:
    """
    Store the joints of a message in the memory, and fill `row` with the new tool state.

    Return a code from WITHOUT_VELOCITIES to NOT_CLOSED. STARTED_ANEW is added to the code if the
    stamp stepped back by more than the timeout, so that all joints were forgotten.

    Parameters
    ----------
    arm, memory
        The arm, and the memory of its joints.
    reported
        The content of the message.
    row : shape (width + 2 n + ROW_TAIL,)
        Filled as by `evaluate_one`, but the quaternion at the end has the sign that makes it
        continuous over time. If the width is 0, only q and qdot are filled.
    """
    at = arrays.size(row) - 2 * memory.joints - places.ROW_TAIL
    check_fit(arm, memory, reported.ours, at)
    return take(arm, memory, reported, arrays.results(row, 0), at)
