# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Detect orientations that were read by a wrong convention: Euler angles XYZ read as ZYX, say.

Let A_i be the rotation of pose i by the robot file, and B_i the measured rotation. If
B_i = X A_i Y with constant offsets X and Y, then trace(B_i^T B_j) = trace(A_i^T A_j) for all poses
i and j. So the search compares conventions by these traces, without a fit of X and Y.

The wrong convention gives the same rotation matrix B_i for two triples of angles. The right
convention gives a different rotation for each triple. So the search tries both triples for each
pose. It takes the triple whose traces with the other poses agree best with the traces of the robot
file.
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
# Number of the likeliest orders of angles for which base and tool offsets are fitted. Orders such
# as XYX and XZX give equal traces trace(B_i^T B_j), so the traces cannot distinguish them. A fit
# can, because it also compares the positions of the poses.
MAX_ORDERS = 150
# Two triples of angles, such as (a, b, c) and (a + pi, -b, c + pi), give the same rotation. The
# search first chooses one triple for each pose, pose after pose. Then it repeats the choice for
# all poses this number of times.
ROUNDS = 2
# Two rotation matrices are taken as equal if their entries differ by at most this value.
TOLERANCE = 1e-6


class _Taken(NamedTuple):
    # `written` is the convention of the numbers in the file: an order of Euler angles, or
    # `rotvec`. `read` is the convention by which the numbers were read.
    written: str
    read: str


class LikelyOrder(NamedTuple):
    """
    A likely mistake: orientations were written in one convention and read by another.

    Attributes
    ----------
    sentence
        The mistake, as a statement.
    written, read
        The convention in which the orientations were written, and the convention by which they
        were read: an order of Euler angles, such as XYZ, or `rotvec`.
    chosen, of_file : shape (F, 9)
        Rotation matrices of F poses, row by row. `chosen`: measured, with the mistake corrected.
        `of_file`: computed from the robot file.
    """

    sentence: str
    written: str
    read: str
    chosen: Floats
    of_file: Floats

    def undone(self, poses: Floats, A: Floats) -> Hypothesis:
        """
        Return this mistake as a hypothesis with corrected poses.

        `poses` (N, 4, 4) are the measured poses, and A (N, 4, 4) the poses of the robot file.
        """
        # Two triples of numbers give the same rotation in the convention `read`. In the convention
        # `written`, the two triples give different rotations. So each pose has two candidate
        # rotations R. Let A be the rotation of the pose by the robot file. Let C_f be rotation f
        # in `chosen`, and A_f rotation f in `of_file`. Take the candidate R with the smaller sum
        # over f of (trace(R^T C_f) - trace(A^T A_f))^2.
        rotations = _rotations(self.written, _numbers(self.read, poses[:, :3, :3]))
        traces = rotations.reshape(2, -1, 9) @ self.chosen.T
        wrong = np.sum((traces - A[:, :3, :3].reshape(-1, 9) @ self.of_file.T) ** 2, axis=2)
        undone = np.array(poses)
        undone[:, :3, :3] = rotations[np.argmin(wrong, axis=0), np.arange(len(poses))]
        return Hypothesis('angle_order', self.sentence, poses=undone)


def likely_orders(poses: Floats, A: Floats, read: str = '') -> list[LikelyOrder]:
    """
    Return the likeliest conventions (orders of Euler angles, or rotation vector) of the poses.

    Parameters
    ----------
    poses, A : shape (N, 4, 4)
        Poses of the second source, and of the robot file.
    read
        The convention by which the orientations were read: `rpy`, one of `EULER_ORDERS`, or
        `rotvec`. Any other text means unknown.
    """
    R = poses[:, :3, :3]
    few = few_of(len(R))
    pairs = _pairs(read)
    numbers = {name: _numbers(name, R[few]) for name in dict.fromkeys(pair.read for pair in pairs)}
    made = np.empty((len(pairs), 2, len(few), 3, 3))
    for kind in dict.fromkeys(pair.written for pair in pairs):
        indices = [k for k, pair in enumerate(pairs) if pair.written == kind]
        made[indices] = _rotations(kind, np.stack([numbers[pairs[k].read] for k in indices]))
    of_file = A[few, :3, :3].reshape(-1, 9)
    chosen, off = _chosen(made.reshape(*made.shape[:3], 9), of_file @ of_file.T)
    # If `read` is unknown, several pairs of conventions (written, read) give the same rotations.
    # Keep the first of them, because pairs with usual conventions come first.
    likely: list[int] = []
    for k in sorted(np.argsort(off, kind='stable')[:MAX_ORDERS].tolist()):
        first = np.max(np.abs(chosen[likely, 0] - chosen[k, 0]), axis=1)
        near = [likely[i] for i in np.flatnonzero(first <= TOLERANCE).tolist()]
        alike = np.max(np.abs(chosen[near] - chosen[k]), axis=(1, 2), initial=0.0) <= TOLERANCE
        if not np.any(alike):
            likely.append(k)
    return [LikelyOrder(_sentence(pairs[k], read), *pairs[k], chosen[k], of_file) for k in likely]


def few_of(count: int) -> Integers:
    """Return the indices of at most 40 of `count` poses, evenly spread."""
    return np.unique(np.linspace(0, count - 1, SAMPLES).astype(int))


def order_hypotheses_of(poses: Floats, A: Floats, read: str = '') -> Iterator[Hypothesis]:
    """Yield a hypothesis for each likely order of angles (see `likely_orders`)."""
    for order in likely_orders(poses, A, read):
        yield order.undone(poses, A)


def _pairs(read: str) -> list[_Taken]:
    # Return the pairs of conventions (written, read) to try. Small letters are angles about fixed
    # axes, and capitals are angles about moving axes. If the convention `read` is unknown, most
    # pairs with `read` in capitals are left out. They give the same rotations as a pair with
    # `read` in small letters. For example, (ZYX, XYZ) gives the same rotations as (xyz, zyx). The
    # pairs (rotvec, capitals) are tried, because no other pair gives the same rotations.
    orders = (*EULER_ORDERS, ROTVEC)
    known = 'xyz' if read == 'rpy' else read
    if known in orders:
        return [_Taken(name, known) for name in orders if name != known]
    fixed = sorted(filter(str.islower, EULER_ORDERS), key=lambda name: name != 'xyz')
    pairs = [_Taken(name, other) for other in (*fixed, ROTVEC) for name in orders if name != other]
    return pairs + [_Taken(ROTVEC, name) for name in EULER_ORDERS if name.isupper()]


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


def _chosen(candidates: Floats, products: Floats) -> tuple[Floats, Floats]:
    # Choose one of two candidate rotations for each of N poses, and do so for each of H pairs of
    # conventions (written, read). `candidates` (H, 2, N, 9) has the rotations R. `products` (N, N)
    # has the traces trace(A_i^T A_j) of the robot file's rotations A. Choose candidates whose
    # traces trace(R_i^T R_j) agree with `products`. Return the chosen rotations (H, N, 9), and the
    # sums (H,) of the squared differences of the traces. Run the choice twice, starting with the
    # first and with the second candidate of pose 0, and keep the result with the smaller sum.
    count, _, many, _ = candidates.shape
    flat = candidates.reshape(count, 2 * many, 9)
    wrong = (flat @ np.swapaxes(flat, 1, 2)).reshape(count, 2, many, 2, many)
    wrong = (wrong - products[:, None]) ** 2
    pairs, pose = np.arange(count), np.arange(many)
    pair = pairs[:, None]
    wrong[:, :, pose, :, pose] = 0.0  # do not compare a pose with itself
    best, least = np.zeros((count, many), dtype=np.int64), np.full(count, np.inf)
    for start in (0, 1):
        # Let R_i be a candidate rotation of pose i, and A_i the rotation of pose i by the robot
        # file. `sums` (H, 2, N) has one sum for each candidate: the sum of
        # (trace(R_i^T R_j) - trace(A_i^T A_j))^2 over the poses j whose R_j is already chosen. The
        # candidate with the smaller sum is better. First choose a candidate for one pose after
        # another. Then repeat the choice for all poses at once.
        sums = wrong[:, start, 0]
        for k in range(1, many):
            sums = sums + wrong[pairs, np.argmin(sums[:, :, k], axis=1), k]
        for _ in range(ROUNDS):
            branches = np.argmin(sums, axis=1)
            sums = np.sum(wrong[pair, branches, pose], axis=1)
        off = np.sum(sums[pair, branches, pose], axis=1)
        best = np.where((off < least)[:, None], branches, best)
        least = np.minimum(off, least)
    return candidates[pair, best, pose], least


def _sentence(pair: _Taken, read: str) -> str:
    written, taken = _words(pair.written), _words(pair.read)
    verb = 'are read' if read else 'were read'
    advice = f' (--pose-format {pair.written})' if read else ''
    return f'the orientations are {written}, and {verb} as {taken}{advice}'


def _words(kind: str) -> str:
    if kind == ROTVEC:
        return 'rotation vectors'
    axes = 'axes that move along' if kind.isupper() else 'axes that stand still'
    also = ['roll pitch yaw'] if kind == 'xyz' else []
    usual = 'rpy' if kind == 'xyz' else kind
    also += [name.upper() for name, form in MAKERS.items() if form.kind == usual]
    return f'angles {kind} ({", ".join([axes, *also])})'
