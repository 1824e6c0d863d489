# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute tool poses of a chain whose constants have corrections, and the exact derivatives of the
poses by the corrections.

Each correction is a rotation about, or a translation along, one axis of a frame between two
joints. So the derivative of a pose by a correction is a screw whose axis is the axis of the
correction.
"""

from dataclasses import dataclass
from functools import cached_property, reduce
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ... import rigid_motion
from ...kernel import Floats, Integers


class CorrectingMotion(NamedTuple):
    """
    A correction of a chain: a small rotation (rad) about, or translation (m) along, axis 0, 1 or
    2, as one factor in the product of motions that makes the chain. `column` is its index among
    all corrections.
    """

    turns: bool
    axis: int
    column: int


class GearMotion(NamedTuple):
    """
    The relative error of a joint's gear ratio as a correction. The fields are the index of the
    joint, and the index of the correction among all corrections.
    """

    joint: int
    column: int


Part: TypeAlias = Floats | CorrectingMotion


class MovingScrews(NamedTuple):
    """
    The joint screws of a chain: Rz(theta) Tz(d), with theta = theta_0 + by_theta q and d = d_0 +
    by_d q.

    `theta_0` and `d_0` have a number for each joint screw. `by_theta` and `by_d` have a row for
    each joint screw and a column for each of the n joints.
    """

    theta_0: Floats
    d_0: Floats
    by_theta: Floats
    by_d: Floats


class _PartPlaces(NamedTuple):
    # A chain is the product F0 S1 F1 S2 F2 ... of joint screws Sk and motions Fk between the
    # screws. Each Fk is a product of constant motions and corrections. The array `parts` has shape
    # (largest number of factors, number of joint screws + 1, 4, 4); parts[i, k] is factor i of Fk,
    # a 4 x 4 matrix. The other arrays
    # have one number for each correction: its indices i (`depths`) and k (`places`), whether it is
    # a rotation (`turns`), its axis 0, 1 or 2 (`along`), and its column in the Jacobian
    # (`columns`).
    parts: Floats
    depths: Integers
    places: Integers
    turns: npt.NDArray[np.bool_]
    along: Integers
    columns: Integers


@dataclass(frozen=True, eq=False)
class CorrectedChain:
    """
    The chain of an arm as a product: constant motions and corrections, a joint screw, constant
    motions and corrections, the next joint screw, and so on.

    Attributes
    ----------
    still : sequences, one more than joint screws
        Constant motions (4, 4) and corrections before, between and after the joint screws, in the
        order from base to tool.
    screws
        The joint screws.
    gears
        Joints whose gear ratio has a correction.
    """

    still: tuple[tuple[Part, ...], ...]
    screws: MovingScrews
    gears: tuple[GearMotion, ...] = ()

    @cached_property
    def _layout(self) -> _PartPlaces:
        parts = np.zeros((max(map(len, self.still)), len(self.still), 4, 4))
        parts[:, :, range(4), range(4)] = 1.0
        rows = []
        for k, product in enumerate(self.still):
            for level, part in enumerate(product):
                if isinstance(part, CorrectingMotion):
                    rows.append((level, k, part.turns, part.axis, part.column))
                else:
                    parts[level, k] = part
        depths, places, turning, along, columns = np.reshape(rows, (-1, 5)).T.astype(np.int64)
        return _PartPlaces(parts, depths, places, turning > 0, along, columns)


class PoseChange(NamedTuple):
    """
    Poses (N, 4, 4) of a chain, and the Jacobian (N, 6, P) of the poses by P corrections.

    The rows of the Jacobian are the linear velocity of the tool's origin and the angular velocity,
    in the axes in which the poses are given.
    """

    pose: Floats
    jacobian: Floats


class _Stills(NamedTuple):
    # A chain is the product F0 S1 F1 S2 F2 ... of joint screws Sk and motions Fk between the
    # screws. Each Fk is a product of constant motions and corrections. `motions` has the matrices
    # Fk, shape (number of joint screws + 1, 4, 4). The other arrays have one entry for each
    # correction: the index k of the Fk that contains the correction (`places`), the column of the
    # correction in the Jacobian (`columns`), whether the correction is a rotation (`turns`), and
    # the axis of the correction: a direction (`axes`) and a point (`origins`). Direction and point
    # are given in the frame directly before Fk.
    motions: Floats
    places: Integers
    columns: Integers
    turns: npt.NDArray[np.bool_]
    axes: Floats
    origins: Floats


def small_motion(turns: bool, axis: int, value: float) -> Floats:
    """
    Return the matrix (4, 4) of a rotation about, or a translation along, axis 0, 1 or 2. `value`
    is the angle, rad, or the distance, m.
    """
    return rigid_motion.screw('xyz'[axis], *((value, 0.0) if turns else (0.0, value)))


def _stills(chain: CorrectedChain, values: Floats) -> _Stills:
    # A chain is the product F0 S1 F1 S2 F2 ... of joint screws Sk and motions Fk between the
    # screws. Each Fk is a product of constant motions and corrections. Computes all Fk at once:
    # step i multiplies each Fk by its factor i.
    parts, depths, places, turns, along, columns = chain._layout
    parts, by = parts.copy(), values[columns]
    parts[depths[~turns], places[~turns], along[~turns], 3] = by[~turns]
    depth, place = depths[turns], places[turns]
    i, j = (along[turns] + 1) % 3, (along[turns] + 2) % 3
    parts[depth, place, i, i] = parts[depth, place, j, j] = np.cos(by[turns])
    parts[depth, place, j, i] = np.sin(by[turns])
    parts[depth, place, i, j] = -parts[depth, place, j, i]
    motions = np.broadcast_to(np.eye(4), parts.shape[1:])
    before = np.empty_like(parts)
    for level, factors in enumerate(parts):
        before[level] = motions
        motions = motions @ factors
    axes, origins = before[depths, places, :3, along], before[depths, places, :3, 3]
    return _Stills(motions, places, columns, turns, axes, origins)


def _screws(chain: CorrectedChain, q: Floats) -> Floats:
    # Returns the matrices (4, 4) of all joint screws at joint positions q (N, n), shape (number of
    # joint screws, N, 4, 4).
    theta_0, d_0, by_theta, by_d = chain.screws
    theta, d = theta_0[:, None] + by_theta @ q.T, d_0[:, None] + by_d @ q.T
    T = np.zeros((*theta.shape, 4, 4))
    T[..., 0, 0] = T[..., 1, 1] = np.cos(theta)
    T[..., 1, 0] = np.sin(theta)
    T[..., 0, 1] = -T[..., 1, 0]
    T[..., 2, 3] = d
    T[..., 2, 2] = T[..., 3, 3] = 1.0
    return T


def _driven(chain: CorrectedChain, values: Floats, q: Floats) -> Floats:
    # Returns the joint positions (N, n) after the corrections of the gear ratios.
    if not chain.gears:
        return q
    driven = np.array(q)
    for gear in chain.gears:
        driven[:, gear.joint] *= 1.0 + values[gear.column]
    return driven


def poses_of(chain: CorrectedChain, values: Floats, q: Floats) -> Floats:
    """
    Return the tool poses (N, 4, 4) of a chain with corrections `values` (P,), rad and m, at q (N,
    n).
    """
    motions = _stills(chain, values).motions
    moved = _screws(chain, _driven(chain, values, q)) @ motions[1:, None]
    return reduce(np.matmul, moved, np.broadcast_to(motions[0], (len(q), 4, 4)))


def pose_change(chain: CorrectedChain, values: Floats, q: Floats) -> PoseChange:
    """
    Return the tool poses of a chain at N joint positions, and their derivatives by the
    corrections.

    Parameters
    ----------
    values : shape (P,), rad and m
        The corrections.
    q : shape (N, n), rad or m
        Joint positions.
    """
    count, many, still = len(values), len(q), _stills(chain, values)
    screws = _screws(chain, _driven(chain, values, q))
    joints: list[Floats] = []
    axes, origins = np.zeros((many, 3, count)), np.zeros((many, 3, count))
    frame = np.broadcast_to(np.eye(4), (many, 4, 4))
    ends = np.searchsorted(still.places, np.arange(len(still.motions) + 1)).tolist()
    for k, motion in enumerate(still.motions):
        if k:
            joints.append(frame)
            frame = frame @ screws[k - 1]
        part = slice(*ends[k : k + 2])
        R, at = frame[:, :3, :3], still.columns[part]
        axes[:, :, at] = R @ still.axes[part].T
        origins[:, :, at] = R @ still.origins[part].T + frame[:, :3, 3:4]
        frame = frame @ motion
    turns = np.zeros(count, dtype=bool)
    turns[still.columns] = still.turns
    lever = frame[:, :3, 3:4] - origins
    jacobian = np.empty((many, 6, count))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        turned = axes[:, j] * lever[:, k] - axes[:, k] * lever[:, j]
        jacobian[:, i] = np.where(turns, turned, axes[:, i])
    jacobian[:, 3:] = np.where(turns, axes, 0.0)
    for gear in chain.gears:
        _, _, thetas, ds = chain.screws
        for by_theta, by_d, before in zip(thetas[:, gear.joint], ds[:, gear.joint], joints):
            z, arm = before[:, :3, 2], frame[:, :3, 3] - before[:, :3, 3]
            linear = by_theta * np.cross(z, arm) + by_d * z
            moved = np.concatenate([linear, by_theta * z], axis=1)
            jacobian[:, :, gear.column] += q[:, gear.joint, None] * moved
    return PoseChange(frame, jacobian)


class ErrorScrews(NamedTuple):
    """
    The corrections of a chain as screws, each in a frame in which the screw is constant.

    Attributes
    ----------
    after : shape (P,)
        For each correction, the number k of joint screws between the base and the correction.
    screws : shape (P, 6)
        Each correction as a screw: linear velocity of the frame's origin, and angular velocity. It
        is given in frame k, the frame after the first k joint screws.
    starts : shape (number of joint screws + 1, 4, 4)
        Poses of the frames k = 0, 1, ... with all joints at zero.
    """

    after: Integers
    screws: Floats
    starts: Floats


def error_screws(chain: CorrectedChain, values: Floats) -> ErrorScrews:
    """
    Return the corrections of a chain as screws; `values` (P,) are the corrections, rad and m.
    """
    count, still = len(values), _stills(chain, values)
    after, screws = np.zeros(count, dtype=np.int64), np.zeros((count, 6))
    after[still.columns], turns = still.places, still.turns[:, None]
    screws[still.columns, :3] = np.where(turns, np.cross(still.origins, still.axes), still.axes)
    screws[still.columns, 3:] = np.where(turns, still.axes, 0.0)
    zero = np.zeros((1, chain.screws.by_theta.shape[1]))
    starts = [np.eye(4)]
    for motion, screw in zip(still.motions, _screws(chain, zero)):
        starts.append(starts[-1] @ motion @ screw[0])
    return ErrorScrews(after, screws, np.array(starts))


def seen_from(T: Floats, screws: Floats) -> Floats:
    """Transform screws (P, 6) from a frame A to a frame B. T (4, 4) is the pose of A in B."""
    linear, angular = screws[:, :3] @ T[:3, :3].T, screws[:, 3:] @ T[:3, :3].T
    return np.concatenate([linear + np.cross(T[:3, 3], angular), angular], axis=1)
