# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The nearest singular pose by brute force, by numpy alone: many starts, and J by differences.

Nothing of the kernel but the Jacobian is used, so that this is a second road to the distance.
"""

import numpy as np
from arms import random_poses

import kinematics_service as ks

# Step of the central differences of J, in rad: its error is some 1e-10 of J.
STEP = 1e-6
# A pose that was found and moves no farther in a step stands, rad.
STANDS = 1e-8
# A search has ended where the step onto the singular set is below this, rad.
ENDED = 1e-9
SINGULAR = 1e-8
STEPS, LAST_STEPS, LONGEST, FARTHEST = 32, 6, 0.2, 1.2
# Poses from which singular ones are looked for anywhere.
SEEDS = 1200


def scaled_jacobian(robot, q):
    """Return J_t (..., m, n) as singularities are judged by it."""
    task = robot.singularity.task
    J = ks.jacobian(robot, q)
    turned = np.swapaxes(task.rotation, 0, 1)
    J = np.concatenate([turned @ J[..., :3, :], turned @ J[..., 3:, :]], axis=-2)
    return J[..., task.axes, :] * task.row_scales[:, None] * task.column_scales


def slopes_of_jacobian(robot, q):
    """Return dJ_t/du_j (..., n, m, n) by central differences; u as `column_scales` has it."""
    shift = STEP * np.diag(robot.singularity.task.column_scales)
    ahead = scaled_jacobian(robot, q[..., None, :] + shift)
    return (ahead - scaled_jacobian(robot, q[..., None, :] - shift)) / (2.0 * STEP)


def equations(robot, q, above=0):
    """
    Return s (N, min), right-hand sides c (N, e) and A (N, e, n): c + A d = 0 near a singular pose.

    `above` counts singular values from the least one upwards.
    """
    U, s, Vt = np.linalg.svd(scaled_jacobian(robot, q))
    D = slopes_of_jacobian(robot, q)
    k = robot.singularity.task.generic_rank - 1 - above
    if U.shape[-1] <= Vt.shape[-1]:
        A = np.einsum('Nr,Njrc,Nec->Nej', U[:, :, k], D, Vt[:, k:, :])
    else:
        A = np.einsum('Nre,Njrc,Nc->Nej', U[:, :, k:], D, Vt[:, k, :])
    c = np.zeros(A.shape[:2])
    c[:, 0] = s[:, k]
    return s, c, A


def least(A, b):
    """Return the least d with A d = b, directions in which A hardly changes left out."""
    if A.shape[1] == 1:
        squares = np.sum(A**2, axis=2)
        return A[:, 0] * np.divide(b, squares, out=np.zeros_like(b), where=squares > 0.0)
    return np.einsum('Nje,Ne->Nj', np.linalg.pinv(A, rcond=1e-5), b)


def descend(robot, origin, d):
    """
    Return distances (N,) and poses (N, n) of relaxed Newton from motions d; infinite where none
    ended.
    """
    scales, rank = robot.singularity.task.column_scales, robot.singularity.task.generic_rank
    distance = np.full(len(d), np.inf)
    poses = np.full(d.shape, np.nan)
    moving = np.arange(len(d))
    for step in range(STEPS):
        s, c, A = equations(robot, origin + d * scales)
        onto = least(A, -c)
        size, left = np.linalg.norm(d, axis=1), np.linalg.norm(onto, axis=1)
        ended = (s[:, rank - 1] < SINGULAR * s[:, 0]) & (left < ENDED) & (size < distance[moving])
        distance[moving[ended]] = size[ended]
        poses[moving[ended]] = (origin + d * scales)[ended]
        slide = least(A, np.einsum('Nej,Nj->Ne', A, d) - c) - d - onto
        share = 0.0 if step >= STEPS - LAST_STEPS else 1.0 if step % 8 < 4 else 0.5
        move = onto + share * slide
        length = np.linalg.norm(move, axis=1, keepdims=True)
        d = d + move * (LONGEST / np.maximum(length, LONGEST))
        d = np.where(np.linalg.norm(d, axis=1, keepdims=True) > FARTHEST, 0.0, d)
        # What stands where it is nearest stays there.
        goes_on = (length[:, 0] > STANDS) | ~ended
        d, origin, moving = d[goes_on], origin[goes_on], moving[goes_on]
        if not len(moving):
            break
    return distance, poses


def _joints_that_matter(robot, random):
    # Whether the singular values change with each joint; its period in rad, endless without one.
    n, scales = robot.dof, robot.singularity.task.column_scales
    q = random.uniform(-np.pi, np.pi, (8, n)) * scales
    s = np.linalg.svd(scaled_jacobian(robot, q), compute_uv=False)
    changes, periods = np.zeros(n, dtype=bool), np.full(n, np.inf)
    for j in range(n):
        for angle in (0.7, 2.0 * np.pi):
            there = scaled_jacobian(robot, q + angle * np.eye(n)[j] * scales)
            same = np.allclose(s, np.linalg.svd(there, compute_uv=False), rtol=0.0, atol=1e-9)
            if angle < 1.0:
                changes[j] = not same
            elif same and robot.joint_types[j] == 'revolute':
                periods[j] = angle
    return changes, periods


def _known(robot, q, count, random):
    # Singular poses from anywhere, as motions (starts, N, n) from each of q to the nearest ones.
    n, scales = robot.dof, robot.singularity.task.column_scales
    changes, periods = _joints_that_matter(robot, random)
    low, high = (
        np.where(np.isfinite(periods), -np.pi, np.min(q / scales, axis=0) - 1.0),
        np.where(np.isfinite(periods), np.pi, np.max(q / scales, axis=0) + 1.0),
    )
    seeds = random.uniform(low, high, (SEEDS, n)) * scales
    d = np.zeros(seeds.shape)
    for _ in range(12):
        onto = least(*_onto(robot, seeds + d * scales))
        length = np.linalg.norm(onto, axis=1, keepdims=True)
        d = d + onto * (LONGEST / np.maximum(length, LONGEST))
    s = np.linalg.svd(scaled_jacobian(robot, seeds + d * scales), compute_uv=False)
    poses = (seeds / scales + d)[s[:, robot.singularity.task.generic_rank - 1] < 1e-6 * s[:, 0]]
    starts = np.zeros((count, len(q), n))
    if not len(poses):
        return starts
    for i, one in enumerate(q / scales):
        away = poses - one
        whole = np.where(np.isfinite(periods), periods, 1.0)
        away -= np.where(np.isfinite(periods), whole * np.round(away / whole), 0.0)
        away[:, ~changes] = 0.0
        order = np.argsort(np.linalg.norm(away, axis=1))
        # The nearest ones, and as many of those that follow at larger and larger steps.
        ranks = np.unique(np.geomspace(1, len(order), count).astype(int) - 1)
        ranks = np.concatenate([ranks, np.arange(count)])[:count]
        starts[:, i] = away[order[np.minimum(np.sort(ranks), len(order) - 1)]]
    return starts


def _onto(robot, q):
    _, c, A = equations(robot, q)
    return A, -c


def nearest_singular(robot, q, starts=24, seed=3, known=0):
    """
    Return distances (N,) and poses (N, n); infinite and NaN where no start found one within 1 rad.

    Half of the starts are near, half up to 1 rad; `known` more are singular poses from anywhere.
    """
    random = np.random.default_rng(seed)
    N, n = q.shape
    spreads = 0.5 * np.arange(starts) / max(starts, 1) / np.sqrt(n)
    motions = [random.normal(size=(N, n)) * spread for spread in spreads]
    if known:
        # Of the same number of starts, spread over 1 rad.
        motions += [
            random.normal(size=(N, n)) * (k + 1) / known / np.sqrt(n) for k in range(known)
        ]
        motions += list(_known(robot, q, known, random))
    # All at once: one by one most of the time goes into calls.
    found, where = descend(robot, np.tile(q, (len(motions), 1)), np.concatenate(motions))
    nearest = np.argmin(found.reshape(-1, N), axis=0), np.arange(N)
    return found.reshape(-1, N)[nearest], where.reshape(-1, N, n)[nearest]


def saddles(robot, count, seed=7):
    """
    Return poses (count, n) at which the two least singular values all but vanish together.

    Branches of the singular set meet there or just miss each other, and first-order estimates are
    at their worst: half of them exactly there, half up to a thousandth of a radian beside.
    """
    random = np.random.default_rng(seed)
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    q = random.uniform(low, high, (count, robot.dof))
    scales, rank = robot.singularity.task.column_scales, robot.singularity.task.generic_rank
    if rank < 2:
        return q
    for _ in range(12):
        U, s, Vt = np.linalg.svd(scaled_jacobian(robot, q))
        D = slopes_of_jacobian(robot, q)
        last = [rank - 2, rank - 1]
        A = np.einsum('Nrl,Njrc,Nlc->Nlj', U[:, :, last], D, Vt[:, last, :])
        step = least(A, -s[:, last])
        length = np.linalg.norm(step, axis=1, keepdims=True)
        q = q + step * (LONGEST / np.maximum(length, LONGEST)) * scales
    beside = random.normal(size=q.shape) * 1e-3 * (np.arange(count) % 2)[:, None]
    return q + beside * scales


def judged_poses(robot, count):
    """Return random poses, and a quarter as many saddles."""
    return np.concatenate([random_poses(robot, count), saddles(robot, count // 4)])
