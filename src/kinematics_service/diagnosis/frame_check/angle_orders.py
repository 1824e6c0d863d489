"""
Orientations whose three numbers were taken for others: Euler angles of another order.

Of B = X A Y the product trace(B_i^T B_j) is that of A, whatever base and tool are: so all orders
are compared without a fit. A matrix does not say which of two triples of angles it was made of;
what agrees with the other poses does.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...formats.recordings.pose_format import MAKERS
from ...kernel import Floats
from ...rigid_motion import (
    EULER_ORDERS,
    euler_angles,
    exponential,
    rotation_of_euler,
    rotation_vector,
)
from .hypotheses import Hypothesis

ROTVEC = 'rotvec'
# Poses by which the orders are compared, orders that are then tried, and rounds in which the
# triple of each pose is chosen again. The six orders of two axes that move are one order, turned:
# products are alike for each two of them, and positions alone tell them apart.
SIFTED, KEPT, ROUNDS = 40, 150, 2
# Rotations that differ by less are the same, from whatever kinds they are.
SAME = 1e-6


class _Taken(NamedTuple):
    # Numbers were written as one kind and read as another.
    written: str
    read: str


def order_hypotheses_of(poses: Floats, A: Floats, read: str = '') -> Iterator[Hypothesis]:
    """
    Yield the likeliest orders of the three numbers that the orientations were made of.

    Parameters
    ----------
    poses, A : shape (N, 4, 4)
        Of the second source, and of the robot file.
    read
        How the orientations were read, `rpy`, one of `EULER_ORDERS` or `rotvec`; of others nothing
        is known of what they were made of.
    """
    R = poses[:, :3, :3]
    few = np.unique(np.linspace(0, len(R) - 1, SIFTED).astype(int))
    pairs = _pairs(read)
    reads = dict.fromkeys(one.read for one in pairs)
    numbers = {name: _numbers(name, R) for name in reads}
    every = np.empty((len(pairs), 2, len(few), 3, 3))
    for kind in dict.fromkeys(one.written for one in pairs):
        own = [k for k, one in enumerate(pairs) if one.written == kind]
        every[own] = _rotations(kind, np.stack([numbers[pairs[k].read][:, few] for k in own]))
    of_file = A[few, :3, :3].reshape(-1, 9)
    chosen, off = _chosen(every.reshape(*every.shape[:3], 9), of_file @ of_file.T)
    # Where nothing is known of the reading several kinds come to the same: the usual one is named.
    likely: list[int] = []
    for k in sorted(np.argsort(off, kind='stable')[:KEPT].tolist()):
        if not likely or np.min(np.max(np.abs(chosen[likely] - chosen[k]), axis=(1, 2))) > SAME:
            likely.append(k)
    for k in likely:
        # Of each pose the triple that agrees with those that were chosen.
        rotations = _rotations(pairs[k].written, numbers[pairs[k].read])
        found = rotations.reshape(2, -1, 9) @ chosen[k].T
        wrong = np.sum((found - A[:, :3, :3].reshape(-1, 9) @ of_file.T) ** 2, axis=2)
        undone = np.array(poses)
        undone[:, :3, :3] = rotations[np.argmin(wrong, axis=0), np.arange(len(R))]
        yield Hypothesis('angle_order', _sentence(pairs[k], read), poses=undone)


def _pairs(read: str) -> list[_Taken]:
    # Numbers in reverse are those of the opposite kind of axes: xyz read for zyx is ZYX for XYZ.
    orders = (*EULER_ORDERS, ROTVEC)
    known = 'xyz' if read == 'rpy' else read
    if known in orders:
        return [_Taken(one, known) for one in orders if one != known]
    still = sorted((one for one in EULER_ORDERS if one.islower()), key=lambda one: one != 'xyz')
    pairs = [_Taken(one, other) for other in (*still, ROTVEC) for one in orders if one != other]
    return pairs + [_Taken(ROTVEC, one) for one in EULER_ORDERS if one.isupper()]


def _numbers(kind: str, R: Floats) -> Floats:
    # Both triples (2, N, 3) that make rotations (N, 3, 3).
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
    # Of every pair of kinds the triple of each pose that agrees with the others, from both of the
    # first: rotations (H, N, 9) of (H, 2, N, 9), and by how much their products (N, N) are off.
    best, least = every[:, 0], np.full(len(every), np.inf)
    for start in (0, 1):
        chosen = np.array(every[:, start])
        for k in range(1, chosen.shape[1]):
            _choose(chosen, every, products, k, slice(k))
        for _ in range(ROUNDS):
            for k in range(chosen.shape[1]):
                _choose(chosen, every, products, k, slice(None))
        off = np.sum((chosen @ np.swapaxes(chosen, 1, 2) - products) ** 2, axis=(1, 2))
        best = np.where((off < least)[:, None, None], chosen, best)
        least = np.minimum(off, least)
    return best, least


def _choose(chosen: Floats, every: Floats, products: Floats, k: int, others: slice) -> None:
    found = every[:, :, k] @ np.swapaxes(chosen[:, others], 1, 2)
    wrong = (found - products[k, others]) ** 2
    if others.stop is None:
        wrong[:, :, k] = 0.0
    branch = np.argmin(np.sum(wrong, axis=2), axis=1)
    chosen[:, k] = every[np.arange(len(every)), branch, k]


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
