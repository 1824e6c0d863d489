# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Arms of six joints without a closed form, prismatic ones too, and what searches find of them.

Tables are (a, alpha, d, theta) a row, in m and rad, as their makers or papers print them.
"""

import functools
import itertools
import math

import numpy as np

import kinematics_service as ks
from kinematics_service.kinematics.inverse.problem.plan import plan_for
from kinematics_service.kinematics.inverse.problem.target import ik_target_of
from kinematics_service.kinematics.inverse.search import distinct, refined, starts

H, DEGREE = math.pi / 2, math.pi / 180

TABLES = {
    # Manseur and Doty (1989): a target of it has 16 real solutions.
    'manseur': (
        'standard',
        [(0.3, H, 0.0, 0.0), (1.0, DEGREE, 0.0, 0.0), (0.0, H, 0.2, 0.0)]
        + [(1.5, DEGREE, 0.0, 0.0), (0.0, H, 0.0, 0.0), (0.0, DEGREE, 0.0, 0.0)],
    ),
    # Collaborative arms whose wrists are no spherical ones.
    'crx10': (
        'modified',
        [(0.0, 0.0, 0.0, 0.0), (0.0, -H, 0.0, -H), (0.54, math.pi, 0.0, 0.0)]
        + [(0.0, -H, -0.54, 0.0), (0.0, H, 0.15, 0.0), (0.0, -H, -0.16, 0.0)],
    ),
    'xarm6': (
        'modified',
        [(0.0, 0.0, 0.267, 0.0), (0.0, -H, 0.0, -1.3849179), (0.28948866, 0.0, 0.0, 1.3849179)]
        + [(0.0775, -H, 0.3425, 0.0), (0.0, H, 0.0, 0.0), (0.076, -H, 0.097, 0.0)],
    ),
    'gen3_lite': (
        'standard',
        [(0.0, H, 0.2433, 0.0), (0.28, math.pi, 0.03, H), (0.0, H, 0.02, H)]
        + [(0.0, H, 0.245, H), (0.0, H, 0.057, math.pi), (0.0, 0.0, 0.235, H)],
    ),
    'jaco': (
        'standard',
        [(0.0, H, 0.2755, 0.0), (0.41, math.pi, 0.0, 0.0), (0.0, H, -0.0098, 0.0)]
        + [(0.0, math.pi / 3, -0.2502, 0.0), (0.0, math.pi / 3, -0.0858, 0.0)]
        + [(0.0, math.pi, -0.2116, 0.0)],
    ),
    # A small industrial arm whose wrist axes miss each other by 30 mm.
    'skew_wrist': (
        'standard',
        [(0.05, -H, 0.33, 0.0), (0.33, math.pi, 0.0, 0.0), (0.035, -H, 0.0, 0.0)]
        + [(0.0, H, -0.335, 0.0), (0.03, -H, 0.0, 0.0), (0.0, math.pi, -0.08, 0.0)],
    ),
}
# Random arms: all revolute, lengths of four decades, and by the joints that slide.
RANDOM = tuple(f'random-{k}' for k in range(16))
MIXED = tuple(f'mixed-{k}' for k in range(4))
SLIDING = tuple(
    f'{kinds}-{k}' for kinds in ('RRRRPR', 'RPRRRR', 'PRRRRR', 'RRRRRP') for k in (0, 1)
)
# Two joints that slide, in every order.
TWO_SLIDE = tuple(
    ''.join('P' if i in pair else 'R' for i in range(6)) + '-0'
    for pair in itertools.combinations(range(6), 2)
)
THREE_SLIDE = ('PRRRPP-0', 'PRPRPR-0', 'RRRPPP-0', 'RPPPRR-0')
GENERAL = (*TABLES, *RANDOM, *MIXED, *SLIDING, *TWO_SLIDE)


def text_of(convention, rows, kinds='RRRRRR', limits=None, gears=None):
    """Return the robot file of a table; `gears` are turns of an axis per turn of its joint."""
    text = f'robot: general\nconvention: {convention}\njoints:\n'
    for i, kind in enumerate(kinds):
        word = 'revolute' if kind == 'R' else 'prismatic'
        bounds = f', limits: {list(limits[i])}' if limits else ''
        text += f'  - {{name: j{i + 1}, variable: q{i + 1}, type: {word}{bounds}}}\n'
    text += 'links:\n'
    for i, (a, alpha, d, theta) in enumerate(rows):
        turn, way = f'q{i + 1} + ({theta!r})', repr(d)
        if gears:
            turn = f'{gears[i]!r}*{turn}'
        if kinds[i] == 'P':
            turn, way = repr(theta), f'q{i + 1} + ({d!r})'
        text += f'  - {{a: {a!r}, alpha: {alpha!r}, d: {way}, theta: {turn}}}\n'
    return text


@functools.cache
def general_arm(name):
    """Return the robot of a name of `GENERAL`."""
    if name in TABLES:
        return ks.robot_from_text(text_of(*TABLES[name]))
    kind, _, seed = name.rpartition('-')
    random = np.random.default_rng([int(seed), *kind.encode()])
    lengths = random.uniform(-0.6, 0.6, (6, 2))
    if kind == 'mixed':
        lengths = 10.0 ** random.uniform(-3, 1, (6, 2))
    angles = random.uniform(-math.pi, math.pi, (6, 2))
    rows = [
        (*map(float, (a, alpha, d, theta)),) for (a, d), (alpha, theta) in zip(lengths, angles)
    ]
    return ks.robot_from_text(text_of('standard', rows, kind if kind.isupper() else 'RRRRRR'))


def general_poses(name, count):
    """Return the same random joint positions of an arm each time."""
    slides = np.array([kind == 'prismatic' for kind in general_arm(name).joint_types])
    random = np.random.default_rng([7, *name.encode()])
    turns, ways = (
        random.uniform(-math.pi, math.pi, (count, 6)),
        random.uniform(-0.7, 0.7, (count, 6)),
    )
    return np.where(slides, ways, turns)


def met_by_starts(robot, target, count, seed=0):
    """Return the distinct solutions (m, 6) that so many random starts lead to."""
    target = ik_target_of(robot, target)
    plan = plan_for(robot, target.rows)
    q = starts(robot, plan, np.random.default_rng(seed), count)
    found, _ = distinct(target, plan, refined(target, plan, q, far=True))
    return found.q


def apart(robot, a, b):
    """Return the largest difference of joint positions, full turns left out."""
    turning = np.array([kind != 'prismatic' for kind in robot.joint_types])
    away = np.asarray(a) - np.asarray(b)
    return np.max(np.abs(np.where(turning, (away + math.pi) % (2 * math.pi) - math.pi, away)), -1)
