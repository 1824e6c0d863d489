# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Name families of singular poses, such as wrist or elbow, by the geometry of the joint axes.

Also find the tool motions that are impossible in a family, from singular vectors of the Jacobian.
Both results are computed at sampled configurations of the family. A name must fit at every sampled
configuration.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from ....kernel import Floats, Integers

# A distance (m), a sine of an angle between axes, or a ratio of singular values counts as 0 if it
# is below this. At a configuration found by Newton's method, a value that is 0 in theory has a
# round-off of 1e-12. Values that are not 0 exceed 1e-3.
ZERO = 1e-7
AXES = 'xyz'


@dataclass(frozen=True)
class ArmAtPoses:
    """
    Jacobian, frames and axes of an arm at N configurations, m and rad.

    Attributes
    ----------
    J_t : shape (N, m, n)
        The task rows of J, scaled so that metres and radians are comparable.
    frames : shape (N, rows + 1, 4, 4)
        Poses of frame 0 and of the frame at the end of each row of the table, in the base frame.
    axes, origins : shape (N, n, 3)
        Unit vector of each revolute joint's axis, and a point on the axis; nan for prismatic
        joints.
    tool : shape (N, 3)
        Position of the tool in the base frame.
    turns
        Whether each joint is revolute.
    names
        Names of the joint variables.
    """

    J_t: Floats
    frames: Floats
    axes: Floats
    origins: Floats
    tool: Floats
    turns: tuple[bool, ...]
    names: tuple[str, ...]


@dataclass(frozen=True)
class Lost:
    """
    A motion of the tool that no joint motion gives.

    Attributes
    ----------
    text
        The motion as text.
    axis, frame
        The axis `axis` (0 to 2) of frame number `frame`. It is the direction of the lost motion,
        or, if `others` is true, the only direction in which the tool can translate. `axis` is None
        if the direction is not an axis of a frame.
    angular
        Whether the lost motion is a rotation.
    point
        Number of a frame; None means the tool. If the lost motion is a translation, the origin of
        this frame cannot move in the lost direction.
    held
        Whether a lost rotation becomes possible if the origin of frame `point` may move. True: the
        tool cannot turn about the axis while the origin stays at its place. False: the tool cannot
        turn about the axis at all.
    others
        True: the tool can translate along the axis `axis` only; every other translation is lost.
        False: the motion along or about the axis is lost.
    """

    text: str
    axis: int | None = None
    frame: int = 0
    angular: bool = False
    point: int | None = None
    held: bool = False
    others: bool = False


SOMEWHERE = Lost('a line that depends on the pose')


def together(arms: Sequence[ArmAtPoses]) -> ArmAtPoses:
    """Return the data of several arms with equal joints as one `ArmAtPoses`."""
    first, *_ = arms
    stacked: dict[str, Any] = {
        name: np.concatenate([getattr(arm, name) for arm in arms])
        for name, value in vars(first).items()
        if isinstance(value, np.ndarray)
    }
    return replace(first, **stacked)


def parallel(u: Floats, v: Floats) -> bool:
    """Return whether unit vectors of shape (N, 3) are parallel at every configuration."""
    return bool(np.all(np.linalg.norm(np.cross(u, v), axis=-1) < ZERO))


def wrist_point(arm: ArmAtPoses, angular: bool) -> Floats:
    """
    Return the wrist point of the arm, shape (N, 3).

    The wrist point is the point in which the last three revolute axes meet. If the last three do
    not meet, it is the point in which the last two revolute axes meet. If the last two do not meet
    either, it is the tool's origin. It is also the tool's origin if the task has no angular rows,
    or if the arm has fewer than three revolute joints.
    """
    turning = [j for j, turns in enumerate(arm.turns) if turns]
    if not angular or len(turning) < 3:
        return arm.tool
    points = (_meeting_point(arm, turning[-count:]) for count in (3, 2))
    return next((point for point in points if point is not None), arm.tool)


def _meeting_point(arm: ArmAtPoses, joints: Sequence[int]) -> Floats | None:
    # Return the point in which the axes of `joints` meet, or None. An axis has the direction z and
    # contains the point o. The point p nearest to all axes, by least squares, solves sum (I - z
    # z^T)(p - o) = 0, with a summand for each axis. The axes meet if p lies on all of them.
    z, o = arm.axes[:, joints], arm.origins[:, joints]
    if np.isnan(z).any() or parallel(z[:, 0], z[:, 1]):
        return None
    P = np.eye(3) - z[..., :, None] * z[..., None, :]
    A = P.sum(axis=1)
    b = (P @ o[..., None]).sum(axis=1)
    p = np.linalg.lstsq(A[0], b[0], rcond=None)[0] if len(A) == 1 else np.linalg.pinv(A) @ b
    p = np.asarray(p).reshape(-1, 3)
    miss = np.linalg.norm((P @ (p[:, None, :] - o)[..., None])[..., 0], axis=-1)
    return p if bool(np.all(miss < ZERO)) else None


def name_of(
    arm: ArmAtPoses, elsewhere: ArmAtPoses, joints: Sequence[int], angular: bool
) -> str | None:
    """
    Return the name of a family of singular poses: wrist, elbow, shoulder or boom_length. Return
    None if the geometry fits none of these.

    Parameters
    ----------
    arm
        The arm at configurations of the family.
    elsewhere
        The arm at random configurations. Each name has a geometric condition, such as parallel
        wrist axes. A name fits if its condition is true at all configurations in `arm`, and false
        at some configuration in `elsewhere`.
    joints
        Indices of the joints in the factor of the determinant that is 0 on the family.
    angular
        Whether the task has angular rows.
    """
    if all(not arm.turns[j] for j in joints):
        return 'boom_length'
    tests: dict[str, Callable[[ArmAtPoses], bool]] = {
        'wrist': lambda seen: angular and _is_wrist(seen),
        'elbow': lambda seen: _is_elbow(seen, joints, wrist_point(seen, angular), angular),
        'shoulder': lambda seen: _is_shoulder(seen, wrist_point(seen, angular)),
    }
    return next(
        (name for name, holds in tests.items() if holds(arm) and not holds(elsewhere)), None
    )


def _is_wrist(arm: ArmAtPoses) -> bool:
    turning = [j for j, turns in enumerate(arm.turns) if turns][-3:]
    apart = [(i, j) for i, j in combinations(turning, 2) if j - i > 1]
    return len(turning) == 3 and any(parallel(arm.axes[:, i], arm.axes[:, j]) for i, j in apart)


def _is_elbow(arm: ArmAtPoses, joints: Sequence[int], point: Floats, angular: bool) -> bool:
    # Return whether the arm is at an elbow singularity. One of two conditions must hold.
    # First: two neighbouring joint axes are parallel, and the plane through the two axes contains
    # the wrist point. Instead of the wrist point, the plane may contain a third joint axis that
    # is parallel to the two axes.
    # Second, only if the factor of the determinant contains a single joint: to first order, this
    # joint does not change the distance from shoulder to wrist point. The shoulder is the point in
    # which the axes of the first two joints meet.
    n = len(arm.turns)
    for i in range(n - 1):
        if not (arm.turns[i] and arm.turns[i + 1]) or i + 1 not in joints:
            continue
        z, o = arm.axes[:, i], arm.origins[:, i]
        if np.isnan(z).any() or not parallel(z, arm.axes[:, i + 1]):
            continue
        ends = [point] + [
            arm.origins[:, k] for k in range(i + 2, n) if parallel(z, arm.axes[:, k])
        ]
        across = np.cross(z, arm.origins[:, i + 1] - o)
        if any(np.all(np.abs(np.sum(across * (e - o), axis=-1)) < ZERO) for e in ends):
            return True
    if len(joints) == 1 and angular and arm.turns[joints[0]] and 1 < joints[0] < n - 3:
        k = joints[0]
        shoulder = _meeting_point(arm, [0, 1])
        if shoulder is not None:
            rate = np.cross(arm.axes[:, k], point - arm.origins[:, k])
            return bool(np.all(np.abs(np.sum(rate * (point - shoulder), axis=-1)) < ZERO))
    return False


def _is_shoulder(arm: ArmAtPoses, point: Floats) -> bool:
    # Return whether the arm is at a shoulder singularity: the wrist point lies in the plane that
    # contains the axis of the first joint and is parallel to the axis of the second joint. In an
    # arm without offset along the second axis, the wrist point of a shoulder singularity lies on
    # the first axis.
    if len(arm.turns) < 2 or not arm.turns[0]:
        return False
    z, o = arm.axes[:, 0], arm.origins[:, 0]
    second = arm.axes[:, 1]
    if np.isnan(z).any() or np.isnan(second).any() or parallel(z, second):
        return False
    normal = np.cross(z, second)
    return bool(np.all(np.abs(np.sum(normal * (point - o), axis=-1)) < ZERO))


def rank_at(J_t: Floats) -> int:
    """Return the most frequent rank of J_t over the N configurations."""
    return int(np.bincount(ranks_at(J_t)).argmax())


def ranks_at(J_t: Floats) -> Integers:
    """Return the rank of J_t at each configuration, shape (N,)."""
    sigma = np.linalg.svd(J_t, compute_uv=False)
    return np.asarray(np.sum(sigma > ZERO * np.max(sigma), axis=1))


def lost_motion(
    arm: ArmAtPoses, task_rows: Sequence[int], rank: int, generic: int, scales: Floats
) -> Lost | None:
    """
    Return the motion of the tool that no joint motion gives, or None if it has no short
    description.

    Parameters
    ----------
    arm
        The arm at configurations of the family.
    task_rows
        Indices of the task rows in (x y z rx ry rz), axes of frame 0.
    rank
        The rank of J_t on the family.
    generic
        The rank of J_t at almost all configurations. If this rank is not full, the tool lacks some
        motion at every configuration.
    scales : shape (m,)
        Scale factors of the rows of `J_t`.
    """
    good = ranks_at(arm.J_t) == rank
    missing = len(task_rows) - rank
    if generic < min(arm.J_t.shape[1:]):
        return Lost(f'{generic - rank} of the {generic} directions there are elsewhere')
    if missing < 1 or not good.any():
        return None
    frames, tool, U = arm.frames[good], arm.tool[good], np.linalg.svd(arm.J_t[good]).U
    R0 = frames[:, 0, :3, :3]
    if missing > 1:
        if rank == 1 and tuple(task_rows) == (0, 1, 2):
            where = _direction((R0 @ U[:, :, :1])[..., 0], frames)
            if where is None:
                return None
            text = f'every translation of the tool but that along {where.text}'
            return replace(where, text=text, others=True)
        return Lost(f'{missing} of {len(task_rows)} directions')
    vectors = U[:, :, -1] * scales
    wrench = np.zeros((len(vectors), 6))
    wrench[:, list(task_rows)] = vectors
    force = (R0 @ wrench[:, :3, None])[..., 0]
    moment = (R0 @ wrench[:, 3:, None])[..., 0]
    if np.all(np.linalg.norm(moment, axis=1) < ZERO):
        where = _direction(force, frames) or SOMEWHERE
        return replace(where, text=f'translation of the tool along {where.text}')
    if np.all(np.linalg.norm(force, axis=1) < ZERO):
        where = _direction(moment, frames) or SOMEWHERE
        return replace(where, text=f'rotation about {where.text}', angular=True)
    return _lost_screw(force, moment, frames, tool)


def _lost_screw(force: Floats, moment: Floats, frames: Floats, tool: Floats) -> Lost | None:
    size = np.linalg.norm(force, axis=1) + np.linalg.norm(moment, axis=1)
    turning = None
    for k in reversed(range(frames.shape[1])):
        about = moment + np.cross(tool - frames[:, k, :3, 3], force)
        if np.all(np.linalg.norm(about, axis=1) < ZERO * size):
            where = _direction(force, frames) or SOMEWHERE
            text = f'translation of the origin of frame {k} along {where.text}'
            return replace(where, text=text, point=k)
        line = _direction(about, frames)
        if line and turning is None:
            text = f'rotation about {line.text} with the origin of frame {k} held still'
            turning = replace(line, text=text, angular=True, point=k, held=True)
    return turning


def _direction(vectors: Floats, frames: Floats) -> Lost | None:
    # Let `vectors` (N, 3) be a direction in base axes at each of N configurations. Find a frame in
    # whose axes the direction is equal at all configurations. Return None if no frame
    # fits. If several frames fit, prefer a frame with an axis along the direction.
    length = np.linalg.norm(vectors, axis=1)
    if np.any(length < ZERO):
        return None
    unit = vectors / length[:, None]
    constant = None
    for k in range(frames.shape[1]):
        seen = np.einsum('nji,nj->ni', frames[:, k, :3, :3], unit)
        upright = seen * np.sign(seen[:, np.argmax(np.abs(seen[0]))])[:, None]
        if np.max(np.abs(upright - upright[0])) > 1e-6:
            continue
        main = int(np.argmax(np.abs(upright[0])))
        if abs(upright[0, main] - 1.0) < 1e-6:
            return Lost(f'{AXES[main]} of frame {k}', main, k)
        if constant is None:
            numbers = ', '.join(f'{x:.3g}' for x in upright[0])
            constant = Lost(f'({numbers}) in the axes of frame {k}')
    return constant


@dataclass(frozen=True)
class Idle:
    """
    A joint motion in the null space of the task Jacobian: it moves the tool in no direction of the
    task.

    Attributes
    ----------
    text
        The motion as text.
    joints
        Indices of the joints that move.
    """

    text: str
    joints: tuple[int, ...]


def idle_motion(arm: ArmAtPoses, rank: int) -> Idle | None:
    """
    Return the joint motion in the null space of J_t, or None. The result is None if the null space
    has more than one dimension, if the moving joints vary by configuration, or if all joints move.
    """
    n = arm.J_t.shape[2]
    good = ranks_at(arm.J_t) == rank
    if n - rank != 1 or not good.any():
        return None
    idle = np.linalg.svd(arm.J_t[good]).Vh[:, -1]
    idle = idle / np.max(np.abs(idle), axis=1, keepdims=True)
    idle = idle * np.sign(idle[:, np.argmax(np.abs(idle[0]))])[:, None]
    move = np.abs(idle) > 1e-6
    moving = np.any(move, axis=0)
    if not np.all(move == moving):
        return None
    joints = tuple(np.flatnonzero(moving).tolist())
    names = [arm.names[j] for j in joints]
    if len(joints) == 1:
        return Idle(f'{names[0]} moves nothing', joints)
    if len(joints) == n:
        return None
    return Idle(f'{", ".join(names[:-1])} and {names[-1]} work against each other', joints)
