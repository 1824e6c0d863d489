"""
A chain whose constants carry corrections: small elementary motions at named places of the product.

Every correction is a turn about, or a translation along, one axis of a frame that stands between
two joints. So a pose's derivative with respect to it is a screw about that axis: exact, and for
all poses at once.
"""

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ... import rigid_motion
from ...kernel import Floats, Integers


class CorrectingMotion(NamedTuple):
    """A turn (rad) about axis 0, 1 or 2 of the frame reached so far, or a translation (m)."""

    turns: bool
    axis: int
    column: int


class GearMotion(NamedTuple):
    """A joint, counted from 0, that moves by a share more than it says; its correction."""

    joint: int
    column: int


Part: TypeAlias = Floats | CorrectingMotion


class JointScrew(NamedTuple):
    """Rz(theta) Tz(d), theta = theta_0 + by_theta q, d = d_0 + by_d q; by_theta, by_d (n,)."""

    theta_0: float
    d_0: float
    by_theta: Floats
    by_d: Floats


class CorrectedChain(NamedTuple):
    """
    The product of an arm: still parts, a screw, still parts, and so on.

    Attributes
    ----------
    still : elements + 1 sequences of parts
        Constant motions (4, 4) and corrections, from left to right.
    screws : elements
        One between each two of them.
    gears
        Joints whose gear ratio has a correction.
    """

    still: tuple[tuple[Part, ...], ...]
    screws: tuple[JointScrew, ...]
    gears: tuple[GearMotion, ...] = ()


class PoseChange(NamedTuple):
    """
    Poses (N, 4, 4), and how they move with each correction: (N, 6, P), linear rows first.

    The rows are those of a Jacobian: the linear velocity of the tool's origin, the angular
    velocity, in the axes that the poses are given in.
    """

    pose: Floats
    jacobian: Floats


class _Still(NamedTuple):
    # A constant product, and the axes of its corrections in the frame where it begins.
    motion: Floats
    axes: Floats
    origins: Floats
    turns: list[bool]
    indices: list[int]


def small_motion(turns: bool, axis: int, value: float) -> Floats:
    """Return the turn (rad) about, or the translation (m) along, axis 0, 1 or 2."""
    return rigid_motion.screw('xyz'[axis], *((value, 0.0) if turns else (0.0, value)))


def motion_of(six: Floats) -> Floats:
    """Return the motion (4, 4) of the corrections x y z rx ry rz of a base or tool."""
    T = np.eye(4)
    for k, value in enumerate(six.tolist()):
        T = T @ small_motion(k > 2, k % 3, value)
    return T


def _still(parts: Sequence[Part], values: Floats) -> _Still:
    M = np.eye(4)
    axes, origins, turns, indices = [], [], [], []
    for part in parts:
        if isinstance(part, CorrectingMotion):
            axes.append(M[:3, part.axis])
            origins.append(M[:3, 3])
            turns.append(part.turns)
            indices.append(part.column)
            part = small_motion(part.turns, part.axis, float(values[part.column]))
        M = M @ part
    return _Still(M, np.reshape(axes, (-1, 3)).T, np.reshape(origins, (-1, 3)).T, turns, indices)


def _screws(screw: JointScrew, q: Floats) -> Floats:
    theta, d = screw.theta_0 + q @ screw.by_theta, screw.d_0 + q @ screw.by_d
    T = np.zeros((len(q), 4, 4))
    T[:, 0, 0] = T[:, 1, 1] = np.cos(theta)
    T[:, 1, 0] = np.sin(theta)
    T[:, 0, 1] = -T[:, 1, 0]
    T[:, 2, 3] = d
    T[:, 2, 2] = T[:, 3, 3] = 1.0
    return T


def _driven(chain: CorrectedChain, values: Floats, q: Floats) -> Floats:
    # Where the joints are, by their gears.
    if not chain.gears:
        return q
    driven = np.array(q)
    for gear in chain.gears:
        driven[:, gear.joint] *= 1.0 + values[gear.column]
    return driven


def poses_of(chain: CorrectedChain, values: Floats, q: Floats) -> Floats:
    """Return the poses (N, 4, 4) with corrections (P,), rad and m, at joint positions (N, n)."""
    q = _driven(chain, values, q)
    frame = np.broadcast_to(_still(chain.still[0], values).motion, (len(q), 4, 4))
    for parts, screw in zip(chain.still[1:], chain.screws):
        frame = frame @ _screws(screw, q) @ _still(parts, values).motion
    return frame


def pose_change(chain: CorrectedChain, values: Floats, q: Floats) -> PoseChange:
    """
    Return poses and their derivatives by the corrections.

    Parameters
    ----------
    values : shape (P,), rad and m
        The corrections.
    q : shape (N, n), rad or m
        Joint positions.
    """
    count, many, driven = len(values), len(q), _driven(chain, values, q)
    joints: list[Floats] = []
    axes, origins = np.zeros((many, 3, count)), np.zeros((many, 3, count))
    turns = np.zeros(count, dtype=bool)
    frame = np.broadcast_to(np.eye(4), (many, 4, 4))
    for k, parts in enumerate(chain.still):
        if k:
            joints.append(frame)
            frame = frame @ _screws(chain.screws[k - 1], driven)
        still = _still(parts, values)
        if still.indices:
            R, at = frame[:, :3, :3], still.indices
            axes[:, :, at] = R @ still.axes
            origins[:, :, at] = R @ still.origins + frame[:, :3, 3:4]
            turns[at] = still.turns
        frame = frame @ still.motion
    lever = frame[:, :3, 3:4] - origins
    jacobian = np.empty((many, 6, count))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        turned = axes[:, j] * lever[:, k] - axes[:, k] * lever[:, j]
        jacobian[:, i] = np.where(turns, turned, axes[:, i])
    jacobian[:, 3:] = np.where(turns, axes, 0.0)
    for gear in chain.gears:
        for screw, before in zip(chain.screws, joints):
            by_theta, by_d = screw.by_theta[gear.joint], screw.by_d[gear.joint]
            z, arm = before[:, :3, 2], frame[:, :3, 3] - before[:, :3, 3]
            linear = by_theta * np.cross(z, arm) + by_d * z
            moved = np.concatenate([linear, by_theta * z], axis=1)
            jacobian[:, :, gear.column] += q[:, gear.joint, None] * moved
    return PoseChange(frame, jacobian)


class ErrorScrews(NamedTuple):
    """
    How each correction moves what is behind it, from frames that stand still to it.

    Attributes
    ----------
    after : shape (P,)
        Number of joint screws before it.
    screws : shape (P, 6)
        Linear velocity of the frame's origin and angular velocity, in the axes of the frame that
        the last of these screws leads to.
    starts : shape (elements + 1, 4, 4)
        These frames with all joints at zero.
    """

    after: Integers
    screws: Floats
    starts: Floats


def error_screws(chain: CorrectedChain, values: Floats) -> ErrorScrews:
    """Return the screws of corrections (P,), rad and m, at these values."""
    count = len(values)
    after, screws = np.zeros(count, dtype=np.int64), np.zeros((count, 6))
    zero = np.zeros((1, len(chain.screws[0].by_theta)))
    starts = [np.eye(4)]
    for k, parts in enumerate(chain.still):
        still = _still(parts, values)
        for axis, origin, turns, index in zip(
            still.axes.T, still.origins.T, still.turns, still.indices
        ):
            after[index] = k
            screws[index, :3] = np.cross(origin, axis) if turns else axis
            screws[index, 3:] = axis if turns else 0.0
        if k < len(chain.screws):
            starts.append(starts[-1] @ still.motion @ _screws(chain.screws[k], zero)[0])
    return ErrorScrews(after, screws, np.array(starts))


def seen_from(T: Floats, screws: Floats) -> Floats:
    """Return screws (P, 6) of a frame as those of another one, in which its pose is T (4, 4)."""
    linear, angular = screws[:, :3] @ T[:3, :3].T, screws[:, 3:] @ T[:3, :3].T
    return np.concatenate([linear + np.cross(T[:3, 3], angular), angular], axis=1)
