# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The arms and poses the tests run over: every bundled robot, and random ones of every kind."""

import dataclasses
import functools
import math

import numpy as np
from random_robots import CONVENTIONS, random_arm

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.kinematics import singularity_rates
from kinematics_service.robot.robot import build_robot
from kinematics_service.robot.task import ROW_NAMES, generic_poses

# Those whose loops are closed by the kernel, and all others.
LOOPED = ('crank_slider', 'excavator', 'five_bar', 'flexpicker', 'four_bar_arm')
BUNDLED = tuple(name for name in ks.bundled_robots() if name not in LOOPED)
# Convention, number of joints, seed: `standard-7-0`.
RANDOM = tuple(f'{convention}-{dof}-0' for convention in CONVENTIONS for dof in range(1, 13))
EVERY_ARM = BUNDLED + RANDOM
# One of each kind, for what a formula says of any arm: 1 to 7, 9 and 12 joints; turning, sliding,
# helical, coupled; each convention; square, redundant, deficient, singular everywhere.
DISTINCT_BUNDLED = (
    *('planar_2r', 'craig_3r', 'rrp_elementary', 'parallelogram_left', 'scara_hsr065', 'so101'),
    *('puma560', 'six_joint_dh', 'offset_stanford_shape', 'panda'),
)
# Those, a closed loop, and loops that are closed together.
DISTINCT_MACHINES = (*DISTINCT_BUNDLED, 'five_bar', 'flexpicker')
DISTINCT = (
    *DISTINCT_BUNDLED,
    *('standard-1-0', 'modified-2-0', 'shape-4-0', 'elementary-6-0', 'standard-7-0'),
    *('standard-9-0', 'modified-12-0'),
)


@functools.cache
def arm_of(name):
    """Return the random arm of a name `convention-joints-seed`, as the generator has it."""
    convention, dof, seed = name.split('-')
    return random_arm(int(seed), int(dof), convention)


@functools.cache
def robot_of(name):
    """Return the robot of a bundled name, or of a random arm's."""
    return (
        ks.load_robot(name)
        if name in BUNDLED + LOOPED
        else ks.robot_from_text(arm_of(name).text())
    )


@functools.cache
def without_factors(name):
    """Return the robot of a name without its named singular factors: judged by J alone."""
    description = robot_of(name).description
    if not description.singularity.factors:
        return robot_of(name)
    judged = dataclasses.replace(description.singularity, factors=())
    return build_robot(dataclasses.replace(description, singularity=judged))


def without_known_poses(name):
    """Return the text of a bundled robot file up to its known poses."""
    return ks.bundled_robots()[name].read_text(encoding='utf-8').split('known_poses')[0]


def other_branch_text():
    """
    Return the general loop of the source document with the coupler on the other side: branch -1.
    """
    text = without_known_poses('four_bar_arm')
    return text.replace('psi1: -1.52, psi2: -1.50', 'psi1: -2.34, psi2: 1.50')


def first_order_distances(robot, q):
    """Return the distance by first order, where a search begins to look for singular poses."""
    measures = singularity_rates.measures_of(ks.evaluate(robot, q))
    column = robot.singularity.measure_places.judged + kernel.FIRST_ORDER
    return measures[:, column].reshape(np.shape(q)[:-1])


def sliding(robot):
    """Return whether each joint slides."""
    return np.array([kind == 'prismatic' for kind in robot.joint_types])


def poses(robot, count=20, seed=0):
    """Return joint positions where it hurts: uniform, zero, +-pi, the limits, all but singular."""
    random = np.random.default_rng(seed)
    low, high = np.clip(robot.limits, -math.pi, math.pi).T
    uniform = random.uniform(low, high, (count, robot.dof))
    zero = np.zeros((1, robot.dof))
    straight = np.where(random.random((2, robot.dof)) < 0.5, 0.0, np.pi / 2)
    near = 1e-7 * random.uniform(-1, 1, (3, robot.dof)) + np.concatenate([zero, straight])
    turns = np.full((2, robot.dof), math.pi) * [[1.0], [-1.0]]
    return np.concatenate([uniform, zero, straight, near, turns, [low, high]])


def searched_poses(robot):
    """Return `poses`, of few uniform ones where a search among many redundant joints is long."""
    return poses(robot, 20 if robot.dof < 8 else 4)


def random_poses(robot, count, seed=0):
    """Return joint positions (count, n) inside the limits, of full turns where there are none."""
    low, high = np.clip(robot.limits, -math.pi, math.pi).T
    return np.random.default_rng(seed).uniform(low, high, (count, robot.dof))


@functools.lru_cache(maxsize=16)
def _closed(robot):
    return generic_poses(robot.chain, robot.limits, sliding(robot))


def seeded(robot, count):
    """Return random positions at which the loops of an arm close, if it has any."""
    return _closed(robot)[:count].copy()


def away_from_flat(robot, q, least=0.1):
    """Return those of many poses that are no nearer to flat than this, rad: differences suffer."""
    return q[first_order_distances(robot, q) > least]


def calm_poses(robot, count=20):
    """Return `poses` of an arm without loops; of others those that are not nearly flat."""
    if not robot.chain.loops:
        return poses(robot, count)
    return away_from_flat(robot, seeded(robot, 20 * count))[:count]


@functools.cache
def elementary_arm(links, types='rrr', settings=''):
    """Return an arm of elementary transforms; of its joints p slide, R need not be there."""
    kinds = {'r': 'revolute', 'p': 'prismatic', 'R': 'revolute, unused: true'}
    joints = ', '.join(f'{{name: q{k}, type: {kinds[t]}}}' for k, t in enumerate(types, start=1))
    return ks.robot_from_text(
        f'robot: small\nsource: a test\nconvention: elementary\njoints: [{joints}]\n'
        f'links: [{links}]\n{settings}\n'
    )


def task_jacobian(robot, q):
    """Return the rows of J that an arm is judged by, in the axes of frame 0."""
    to_frame_0 = robot.description.base.motion.matrix[:3, :3].T
    J = ks.jacobian(robot, q)
    J = np.concatenate([to_frame_0 @ J[..., :3, :], to_frame_0 @ J[..., 3:, :]], axis=-2)
    return J[..., [ROW_NAMES.index(row) for row in robot.singularity.task.rows], :]


def scaled(robot, J_t):
    """Return those rows, angles and slides in units of the characteristic length."""
    length = robot.singularity.task.length
    rows = [length if row.startswith('r') else 1.0 for row in robot.singularity.task.rows]
    return J_t * np.array(rows)[:, None] * np.where(sliding(robot), length, 1.0)
