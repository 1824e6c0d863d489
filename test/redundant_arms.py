# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Arms with one joint more than their target asks for, and their solutions by dense slices."""

import functools
import math

import calibrated_arms
import general_arms
import numpy as np
from arms import robot_of

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.kinematics.inverse.problem.target import ik_target_of
from kinematics_service.kinematics.inverse.self_motion import sliced_arm
from kinematics_service.kinematics.inverse.self_motion.sliced_arm import sliced_arm_of

WHOLE = ('x', 'y', 'z', 'rx', 'ry', 'rz')
BUNDLED = ('panda', 'fr3', 'kuka_iiwa14', 'kinova_gen3', 'xarm7')
# Errors of about 1e-3 rad and 1e-3 m.
CALIBRATED = ('panda-calibrated', 'kuka_iiwa14-calibrated')
RANDOM = ('RRRRRRR-0', 'RRRRRRR-1', 'RRRRRRR-2')
SLIDING = ('RRPRRRR-0', 'RRRRPRR-0', 'PRRRRRR-0')
LIMITS = (-2.5, 2.0)
# A candidate is a solution if the tool is so near to the target, m and rad.
REACHED = 1e-9
# Solutions are on an arc, and may be on one that has a sample as near to them (rad or m).
ON_ARC, NEAR = 1e-6, 0.2


@functools.cache
def redundant_arm(name):
    """Return the robot of a name of the lists above."""
    if name in BUNDLED:
        return robot_of(name)
    kind, _, seed = name.rpartition('-')
    if seed == 'calibrated':
        return calibrated_arms.true_arm(kind, 3, 0.3)[2]
    return random_arm(kind, int(seed))


def random_arm(kinds, seed, limits=LIMITS):
    """Return an arm of random lengths and angles; `limits` are each joint's, or one for all."""
    random = np.random.default_rng([seed, *kinds.encode()])
    n = len(kinds)
    lengths, angles = random.uniform(-0.5, 0.5, (n, 2)), random.uniform(-math.pi, math.pi, (n, 2))
    rows = [
        (*map(float, (a, alpha, d, theta)),) for (a, d), (alpha, theta) in zip(lengths, angles)
    ]
    each = limits if isinstance(limits, list) else [limits] * n
    bounds = [(-0.4, 0.6) if kind == 'P' else one for kind, one in zip(kinds, each)]
    return ks.robot_from_text(general_arms.text_of('standard', rows, kinds, bounds))


def poses_within(robot, count, seed=1):
    """Return random joint positions inside the limits, turns of at most half a turn."""
    low, high = np.clip(robot.limits, -math.pi, math.pi).T
    return np.random.default_rng(seed).uniform(low, high, (count, robot.dof))


def held_by(robot, rows=WHOLE, axis=''):
    """Return at which end the joint is that slices are best taken of: 0 or -1."""
    return 0 if sliced_arm_of(robot, rows, axis).held == 0 else -1


@functools.cache
def _slices_of(robot, held, rows, axis):
    arm = sliced_arm_of(robot, rows, axis)
    return sliced_arm.sliced(arm, 0 if held == 0 else len(arm.screws.axes) - 1)


def in_a_slice(robot, target, position, held, rows=WHOLE, axis=''):
    """
    Return all solutions (m, n) with a joint at a position; `held` is 0 or -1: at which end.
    """
    checked = ik_target_of(robot, target, None if axis else rows, axis or None)
    q = _slices_of(robot, held, rows, axis).solutions(checked.pose, position)
    return q[[max(kernel.parts_of_error(checked.residual, one)) < REACHED for one in q]]


def farthest_from_curves(robot, result, q):
    """Return how far a solution inside the limits is from the arcs of a result, in rad."""
    return float(all_from_curves(result, q[None])[0])


def all_from_curves(result, solutions):
    """Return how far solutions (m, n) inside the limits are from the arcs of a result, in rad."""
    arcs = [(arc, f.periods) for f in result.families for arc in f.intervals]
    least = np.full(len(solutions), math.inf)
    if not arcs or not len(solutions):
        return least
    away = np.stack([_from_samples(arc, turns, solutions) for arc, turns in arcs])
    for k, q in enumerate(solutions):
        # The arc with the nearest sample first, others only where that is not the one.
        for i in np.argsort(away[:, k]):
            if least[k] <= ON_ARC or away[i, k] > NEAR:
                break
            least[k] = min(least[k], _from_arc(*arcs[i], q))
    return least


def _from_samples(arc, periods, solutions):
    turning, least = np.isfinite(periods), np.empty(len(solutions))
    for k in range(0, len(solutions), 256):
        away = solutions[k : k + 256, None] - arc.q
        away -= np.where(turning, math.tau * np.round(away / math.tau), 0.0)
        least[k : k + 256] = np.min(np.max(np.abs(away), axis=2), axis=1)
    return least


def _from_arc(arc, periods, q):
    away = q - arc.q
    turns = np.where(np.isfinite(periods), math.tau * np.round(away / math.tau), 0.0)
    near = q - turns[int(np.argmin(np.max(np.abs(away - turns), axis=1)))]
    return float(np.max(np.abs(arc.nearest_to(near) - near)))


def missed(robot, target, result, positions, held, **asked):
    """Return the solutions of dense slices that are inside the limits and on no arc."""
    inside = in_slices(robot, target, positions, held, **asked)
    return list(inside[all_from_curves(result, inside) > ON_ARC])


def in_slices(robot, target, positions, held, **asked):
    """Return all solutions (m, n) of dense slices that are inside the limits by full turns."""
    low, high = robot.limits.T
    found = [in_a_slice(robot, target, float(one), held, **asked) for one in positions]
    q = np.vstack([*found, np.empty((0, robot.dof))])
    turns = np.where(np.isfinite(low), np.ceil((low - q) / math.tau), 0.0)
    turns[:, np.array(robot.prismatic)] = 0.0
    q = q + math.tau * turns
    return q[np.all((q >= low) & (q <= high), axis=1)]
