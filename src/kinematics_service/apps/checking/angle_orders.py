# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Detect orientations whose three numbers were read as a wrong kind, for example Euler angles of
another order.

Let A_i be the rotation of pose i by the robot file, and B_i the measured rotation. If
B_i = X A_i Y with constant offsets X and Y, then trace(B_i^T B_j) = trace(A_i^T A_j) for all poses
i and j. So all orders are compared without a fit. Two triples of angles give the same rotation
matrix. The search takes the triple that agrees with the other poses.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...kernel import Floats, Integers
from ...rigid_motion import exponential, rotation_vector
from .euler_orders import EULER_ORDERS, euler_angles, rotation_of_euler
from .hypotheses import Hypothesis
from .pose_format import MAKERS

ROTVEC = 'rotvec'
# Largest number of poses from which the orders of angles are compared.
SAMPLES = 40
# Number of the likeliest orders of angles for which base and tool offsets are fitted. The fit is
# needed because orders such as XYX and XZX have equal traces; only the positions of the poses
# distinguish them.
MAX_ORDERS = 150
# The angles of a rotation are given by two triples of numbers, such as (a, b, c) and (a + pi, -b,
# c + pi). After a first choice between the two, pose by pose, the choice is repeated in this
# number of rounds.
ROUNDS = 2
# Two rotation matrices are taken as equal if their entries differ by at most this value.
TOLERANCE = 1e-6


class _Taken(NamedTuple):
    # `written` is the kind of the numbers (an order of angles, or `rotvec`). `read` is the kind as
    # which the numbers were read.
    written: str
    read: str


class LikelyOrder(NamedTuple):
    """
    One of the likeliest conventions of three angles, such as XYZ or ZYX, for an orientation.

    Attributes
    ----------
    sentence
        The mistake, as a statement.
    written, read
        The kind as which the numbers were written, and the kind as which they were read.
    chosen, of_file : shape (F, 9)
        Rotation matrices, row by row, of F poses: measured ones with the mistake corrected, and
        those of the robot file.
    """

    sentence: str
    written: str
    read: str
    chosen: Floats
    of_file: Floats

    def undone(self, poses: Floats, A: Floats) -> Hypothesis:
        """
        Return the hypothesis that the three numbers of each orientation were read as the wrong
        kind. It has the measured poses with this mistake corrected. `poses` (N, 4, 4) are
        measured; A (N, 4, 4) are the poses of the robot file.
        """
        # Two triples of numbers give each measured rotation. For each pose, test the rotations R
        # of both triples. Compare trace(R^T C) for the F corrected rotations C in `chosen` with
        # the traces of the robot file's rotations, and take the triple whose traces agree best.
        rotations = _rotations(self.written, _numbers(self.read, poses[:, :3, :3]))
        found = rotations.reshape(2, -1, 9) @ self.chosen.T
        wrong = np.sum((found - A[:, :3, :3].reshape(-1, 9) @ self.of_file.T) ** 2, axis=2)
        undone = np.array(poses)
        undone[:, :3, :3] = rotations[np.argmin(wrong, axis=0), np.arange(len(poses))]
        return Hypothesis('angle_order', self.sentence, poses=undone)


def likely_orders(poses: Floats, A: Floats, read: str = '') -> list[LikelyOrder]:
    """
    Return the likeliest orders of the three numbers from which the orientations were computed.

    Parameters
    ----------
    poses, A : shape (N, 4, 4)
        Poses of the second source, and of the robot file.
    read
        The kind as which the orientations were read: `rpy`, one of `EULER_ORDERS`, or `rotvec`.
        Any other text means unknown.
    """
    R = poses[:, :3, :3]
    few = few_of(len(R))
    pairs = _pairs(read)
    numbers = {name: _numbers(name, R[few]) for name in dict.fromkeys(one.read for one in pairs)}
    made = np.empty((len(pairs), 2, len(few), 3, 3))
    for kind in dict.fromkeys(one.written for one in pairs):
        own = [k for k, one in enumerate(pairs) if one.written == kind]
        made[own] = _rotations(kind, np.stack([numbers[pairs[k].read] for k in own]))
    of_file = A[few, :3, :3].reshape(-1, 9)
    chosen, off = _chosen(made.reshape(*made.shape[:3], 9), of_file @ of_file.T)
    # If it is unknown as which kind the numbers were read, several pairs (kind written, kind read)
    # give the same rotations. Keep the first of these pairs, which has the usual kinds.
    likely: list[int] = []
    for k in sorted(np.argsort(off, kind='stable')[:MAX_ORDERS].tolist()):
        first = np.max(np.abs(chosen[likely, 0] - chosen[k, 0]), axis=1)
        near = [likely[i] for i in np.flatnonzero(first <= TOLERANCE).tolist()]
        alike = np.max(np.abs(chosen[near] - chosen[k]), axis=(1, 2), initial=0.0) <= TOLERANCE
        if not np.any(alike):
            likely.append(k)
    return [LikelyOrder(_sentence(pairs[k], read), *pairs[k], chosen[k], of_file) for k in likely]


def few_of(count: int) -> Integers:
    """Return the indices of at most 40 of `count` poses, evenly spread, to compare orders."""
    return np.unique(np.linspace(0, count - 1, SAMPLES).astype(int))


def order_hypotheses_of(poses: Floats, A: Floats, read: str = '') -> Iterator[Hypothesis]:
    """Yield a hypothesis for each likely order of angles (see `likely_orders`)."""
    for one in likely_orders(poses, A, read):
        yield one.undone(poses, A)


def _pairs(read: str) -> list[_Taken]:
    # Return the pairs (kind written, kind read) to be tried. If `read` is unknown, skip pairs that
    # another pair repeats: xyz read as zyx gives the same rotations as ZYX read as XYZ. So kinds
    # with moving axes (capitals) are tried as `read` only for numbers written as rotation vectors.
    orders = (*EULER_ORDERS, ROTVEC)
    known = 'xyz' if read == 'rpy' else read
    if known in orders:
        return [_Taken(one, known) for one in orders if one != known]
    still = sorted((one for one in EULER_ORDERS if one.islower()), key=lambda one: one != 'xyz')
    pairs = [_Taken(one, other) for other in (*still, ROTVEC) for one in orders if one != other]
    return pairs + [_Taken(ROTVEC, one) for one in EULER_ORDERS if one.isupper()]


def _numbers(kind: str, R: Floats) -> Floats:
    # Two triples of numbers describe the same rotation. Return both triples for each rotation in R
    # (N, 3, 3), as angles in the order `kind` or as rotation vectors; shape (2, N, 3).
    if kind == ROTVEC:
        vectors = rotation_vector(R)
        turns = np.linalg.norm(vectors, axis=1, keepdims=True)
        other = vectors - 2.0 * np.pi * vectors / np.where(turns > 0.0, turns, 1.0)
        return np.stack([vectors, other])
    angles = euler_angles(kind, R)
    other = angles + np.pi
    other[:, 1] = (0.0 if kind[0] == kind[2] else np.pi) - angles[:, 1]
    return np.stack([angles, np.remainder(other + np.pi, 2.0 * np.pi) - np.pi])


def _rotations(kind: str, numbers: Floats) -> Floats:
    return exponential(numbers) if kind == ROTVEC else rotation_of_euler(kind, numbers)


def _chosen(every: Floats, products: Floats) -> tuple[Floats, Floats]:
    # Try H pairs (kind written, kind read). For each pair, choose for each pose one of its two
    # triples of angles: the one whose rotation agrees best with the rotations of the other poses.
    # `every` (H, 2, N, 9) has the rotations R of both triples. `products` (N, N) has the traces
    # trace(A_i^T A_j) of the robot file's rotations A. Return the chosen rotations (H, N, 9), and
    # the sums (H,) of the squared differences between trace(R_i^T R_j) and trace(A_i^T A_j). Run
    # the choice twice, starting with the first and with the second triple of pose 0, and keep the
    # better result.
    count, _, many, _ = every.shape
    flat = every.reshape(count, 2 * many, 9)
    wrong = (flat @ np.swapaxes(flat, 1, 2)).reshape(count, 2, many, 2, many)
    wrong = (wrong - products[:, None]) ** 2
    pairs, pose = np.arange(count), np.arange(many)
    pair = pairs[:, None]
    wrong[:, :, pose, :, pose] = 0.0  # do not compare a pose with itself
    best, least = np.zeros((count, many), dtype=np.int64), np.full(count, np.inf)
    for start in (0, 1):
        # First choose pose by pose: sum the squared differences of the traces between each triple
        # and the triples chosen for earlier poses. Later rounds sum the squared differences over
        # the triples chosen for all poses.
        sums = wrong[:, start, 0]
        for k in range(1, many):
            sums = sums + wrong[pairs, np.argmin(sums[:, :, k], axis=1), k]
        for _ in range(ROUNDS):
            branches = np.argmin(sums, axis=1)
            sums = np.sum(wrong[pair, branches, pose], axis=1)
        off = np.sum(sums[pair, branches, pose], axis=1)
        best = np.where((off < least)[:, None], branches, best)
        least = np.minimum(off, least)
    return every[pair, best, pose], least


def _sentence(pair: _Taken, read: str) -> str:
    written, taken = _words(pair.written), _words(pair.read)
    how = 'are read' if read else 'were read'
    advice = f' (--pose-format {pair.written})' if read else ''
    return f'the orientations are {written}, and {how} as {taken}{advice}'


def _words(kind: str) -> str:
    if kind == ROTVEC:
        return 'rotation vectors'
    axes = 'axes that move along' if kind.isupper() else 'axes that stand still'
    also = ['roll pitch yaw'] if kind == 'xyz' else []
    usual = 'rpy' if kind == 'xyz' else kind
    also += [name.upper() for name, form in MAKERS.items() if form.kind == usual]
    return f'angles {kind} ({", ".join([axes, *also])})'
