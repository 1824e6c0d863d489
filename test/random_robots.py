# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Random arms: the text of their robot file, and their pose multiplied out factor by factor.

An arm is a list of rows, a row a product of factors, a factor an elementary motion whose argument
is affine in the joints, or a constant matrix. `Arm.pose` multiplies these out with matrices of its
own; nothing of the library is used here, so it is a second road to every number.
"""

import functools
import math
from dataclasses import dataclass, replace

import numpy as np

CONVENTIONS = ('standard', 'modified', 'elementary', 'shape')
KINDS = ('revolute', 'prismatic', 'helical')
SI = ('rad', 'm')


@dataclass(frozen=True)
class Motion:
    """An elementary motion (Rx to Tz) by `constant + sum of factor * q[joint]`, in rad or m."""

    axis: str
    constant: float = 0.0
    terms: tuple[tuple[int, float], ...] = ()

    def value(self, q):
        return self.constant + sum(factor * q[joint] for joint, factor in self.terms)

    def matrix(self, q):
        value = self.value(q)
        T = np.eye(4)
        k = 'xyz'.index(self.axis[1])
        if self.axis[0] == 'T':
            T[k, 3] = value
            return T
        i, j = (k + 1) % 3, (k + 2) % 3
        T[i, i] = T[j, j] = math.cos(value)
        T[j, i] = math.sin(value)
        T[i, j] = -math.sin(value)
        return T


@dataclass(frozen=True)
class Constant:
    """A constant pose x y z (m) roll pitch yaw (rad), or the inverse of one."""

    numbers: tuple[float, ...]
    inverted: bool = False

    def matrix(self, q=None):
        x, y, z, roll, pitch, yaw = self.numbers
        T = Motion('Rz', yaw).matrix(()) @ Motion('Ry', pitch).matrix(())
        T = T @ Motion('Rx', roll).matrix(())
        T[:3, 3] = x, y, z
        return np.linalg.inv(T) if self.inverted else T


NOWHERE = Constant((0.0,) * 6)


@dataclass(frozen=True)
class Arm:
    """A random arm: kinds of its joints, rows of factors, base and tool."""

    convention: str
    kinds: tuple[str, ...]
    rows: tuple[tuple[Motion | Constant, ...], ...]
    base: Constant = NOWHERE
    tool: Constant = NOWHERE
    limited: tuple[int, ...] = ()
    settings: str = ''

    @property
    def dof(self):
        return len(self.kinds)

    def frames(self, q):
        """Return frame 0 and the frame after each row in the base frame."""
        frames = [self.base.matrix()]
        for row in self.rows:
            frames.append(functools.reduce(np.matmul, [f.matrix(q) for f in row], frames[-1]))
        return np.array(frames)

    def pose(self, q):
        """Return the tool in the base frame."""
        return self.frames(q)[-1] @ self.tool.matrix()

    def in_convention(self, convention):
        """
        Return the same arm, its table written in another convention.

        Every convention can be written as elementary motions and as shape matrices; a standard
        table also as a modified one, in which a and alpha stand one row further down.
        """
        motions = [motion for row in self.rows for motion in row]
        if convention == 'elementary':
            return replace(self, convention=convention, rows=tuple((m,) for m in motions))
        if convention == 'shape':
            rows = tuple((NOWHERE, motion, NOWHERE) for motion in motions)
            return replace(self, convention=convention, rows=rows)
        assert (self.convention, convention) == ('standard', 'modified')
        rows, alpha, a = [], Motion('Rx'), Motion('Tx')
        for theta, d, next_a, next_alpha in self.rows:
            rows.append((alpha, a, theta, d))
            alpha, a = next_alpha, next_a
        rows.append((alpha, a, Motion('Rz'), Motion('Tz')))
        return replace(self, convention=convention, rows=tuple(rows))

    def opened(self):
        """
        Return the open chain: each moving argument is a joint of its own, without its constant.
        """
        kinds, coupling, constants = [], [], []
        rows = []
        for row in self.rows:
            factors = []
            for factor in row:
                if isinstance(factor, Motion) and factor.terms:
                    constants.append(factor.constant)
                    coupling.append(np.zeros(self.dof))
                    for joint, ratio in factor.terms:
                        coupling[-1][joint] += ratio
                    factor = Motion(factor.axis, 0.0, ((len(kinds), 1.0),))
                    kinds.append('revolute' if factor.axis[0] == 'R' else 'prismatic')
                factors.append(factor)
            rows.append(tuple(factors))
        arm = replace(self, kinds=tuple(kinds), rows=tuple(rows), limited=())
        return OpenedArm(arm, np.array(coupling), np.array(constants))

    def scaled(self, factor):
        """
        Return the arm with every length (and every pitch and prismatic range) times a factor.
        """

        def longer(part):
            if isinstance(part, Constant):
                x, y, z, *angles = part.numbers
                return replace(part, numbers=(x * factor, y * factor, z * factor, *angles))
            if part.axis[0] == 'R':
                return part
            terms = tuple(
                (joint, ratio if self.kinds[joint] == 'prismatic' else ratio * factor)
                for joint, ratio in part.terms
            )
            return replace(part, constant=part.constant * factor, terms=terms)

        rows = tuple(tuple(longer(part) for part in row) for row in self.rows)
        return replace(self, rows=rows, base=longer(self.base), tool=longer(self.tool))

    def text(self, units=SI):
        """Return the robot file."""
        write = _Writer(self.kinds, *units)
        lines = [
            'robot: random',
            'source: "made at random"',
            f'convention: {self.convention}',
            f'units: {{angle: {units[0]}, length: {units[1]}}}',
            'joints:',
        ]
        for j, kind in enumerate(self.kinds):
            limits = ''
            if j in self.limited:
                low, high = (-0.4, 0.9) if kind == 'prismatic' else (-2.5, 2.0)
                written = [
                    write.number('T' if kind == 'prismatic' else 'R', x) for x in (low, high)
                ]
                limits = f', limits: [{written[0]}, {written[1]}]'
            lines.append(f'  - {{name: joint_{j}, variable: q{j}, type: {kind}{limits}}}')
        lines.append('links:')
        lines += [f'  - {write.row(self.convention, row)}' for row in self.rows]
        lines.append(f'base: {write.pose(self.base)}')
        lines.append(f'tool: {write.pose(self.tool)}')
        return '\n'.join([*lines, self.settings, ''])


@dataclass(frozen=True, eq=False)
class OpenedArm:
    """An open chain, and its joints as coupling @ q + constants."""

    arm: Arm
    coupling: np.ndarray
    constants: np.ndarray


@dataclass(frozen=True)
class _Writer:
    kinds: tuple[str, ...]
    angle: str
    length: str

    def number(self, kind, value):
        if kind == 'R' and self.angle == 'deg':
            value = math.degrees(value)
        if kind == 'T' and self.length == 'mm':
            value = value * 1000.0
        return repr(float(value))

    def argument(self, motion):
        kind = motion.axis[0]
        parts = [self.number(kind, motion.constant)]
        for joint, factor in motion.terms:
            if kind == 'T' and self.kinds[joint] != 'prismatic':  # a pitch: length per angle
                factor *= 1000.0 if self.length == 'mm' else 1.0
                factor *= math.pi / 180.0 if self.angle == 'deg' else 1.0
            parts.append(f'({factor!r})*q{joint}')
        if motion.terms and motion.constant == 0.0:
            parts = parts[1:]
        return ' + '.join(parts)

    def pose(self, constant):
        written = [
            self.number('T' if k < 3 else 'R', value) for k, value in enumerate(constant.numbers)
        ]
        return f'{{xyz: [{", ".join(written[:3])}], rpy: [{", ".join(written[3:])}]}}'

    def row(self, convention, row):
        if convention == 'standard':
            theta, d, a, alpha = map(self.argument, row)
        elif convention == 'modified':
            alpha, a, theta, d = map(self.argument, row)
        elif convention == 'elementary':
            return f'{row[0].axis}({self.argument(row[0])})'
        else:
            inner, motion, outer = row
            joint = f'{motion.axis}({self.argument(motion)})'
            return f'{{in: {self.pose(inner)}, joint: "{joint}", out: {self.pose(outer)}}}'
        return f'{{a: {a}, alpha: {alpha}, d: {d}, theta: {theta}}}'


def random_arm(seed, dof, convention, kinds=KINDS, plain=False):
    """Return an arm of `dof` joints; `plain`: no couplings, fixed rows, base or tool."""
    random = np.random.default_rng([seed, dof, CONVENTIONS.index(convention)])
    weights = np.array([{'revolute': 0.7, 'prismatic': 0.2, 'helical': 0.1}[k] for k in kinds])
    chosen = tuple(random.choice(kinds, dof, p=weights / weights.sum()).tolist())
    if 'revolute' in kinds and random.random() < 0.9:
        chosen = ('revolute', *chosen[1:])
    make = {'standard': _dh, 'modified': _dh, 'elementary': _elementary, 'shape': _shape}
    rows = []
    for joint, kind in enumerate(chosen):
        pitch = random.uniform(-0.1, 0.1) if kind == 'helical' else 0.0
        rows += make[convention](random, convention, joint, kind, pitch)
        turning = [j for j in range(joint + 1) if chosen[j] == 'revolute']
        if not plain and random.random() < 0.15:
            rows += make[convention](random, convention, None, '', 0.0)  # a fixed row
        if not plain and turning and random.random() < 0.2:
            # A passive joint, as in a parallelogram or behind a gear.
            terms = {int(random.choice(turning)): -1.0, int(random.choice(turning)): 0.5}
            rows += make[convention](random, convention, tuple(terms.items()), 'revolute', 0.0)
    somewhere = [] if plain else [_pose(random), _pose(random)]
    limited = () if plain else tuple(j for j in range(dof) if random.random() < 0.4)
    return Arm(convention, chosen, tuple(rows), *somewhere, limited=limited)


def _pose(random):
    return Constant((*random.uniform(-0.3, 0.3, 3).tolist(), *_angles(random, 3)))


def _angles(random, count):
    # Right angles as often as not: they are what tables are made of.
    right = random.choice([0.0, math.pi / 2, -math.pi / 2, math.pi], count)
    return np.where(random.random(count) < 0.5, right, random.uniform(-3, 3, count)).tolist()


def _length(random):
    return float(random.choice([0.0, 1.0], p=[0.3, 0.7]) * random.uniform(-0.5, 0.5))


def _terms(joint, sign=1.0):
    if joint is None or isinstance(joint, tuple):
        return joint or ()
    return ((joint, sign),)


def _dh(random, convention, joint, kind, pitch):
    sign = float(random.choice([1.0, 1.0, -1.0]))
    terms = _terms(joint, sign)
    turn = terms if kind in ('revolute', 'helical') else ()
    slide = terms if kind == 'prismatic' else tuple((j, pitch) for j, _ in terms if pitch)
    theta = Motion('Rz', _angles(random, 1)[0], turn)
    d = Motion('Tz', _length(random), slide)
    a, alpha = Motion('Tx', _length(random)), Motion('Rx', _angles(random, 1)[0])
    return [(theta, d, a, alpha) if convention == 'standard' else (alpha, a, theta, d)]


def _elementary(random, convention, joint, kind, pitch):
    axis = str(random.choice(list('xyz')))
    sign = float(random.choice([1.0, 1.0, -1.0]))
    moved = ('T' if kind == 'prismatic' else 'R') + axis
    rows = [
        (
            Motion(
                moved,
                _angles(random, 1)[0] if moved[0] == 'R' else _length(random),
                _terms(joint, sign),
            ),
        )
    ]
    if pitch:
        rows.append((Motion('T' + axis, 0.0, _terms(joint, pitch)),))
    for axis in random.permutation(list('xyz'))[:2]:
        rows.append((Motion('T' + axis, _length(random)),))
    rows.append((Motion('R' + str(random.choice(list('xyz'))), _angles(random, 1)[0]),))
    return rows


def _shape(random, convention, joint, kind, pitch):
    axis = str(random.choice(list('xyz')))
    inner, outer = _pose(random), replace(_pose(random), inverted=True)
    moved = ('T' if kind == 'prismatic' else 'R') + axis
    motion = Motion(moved, 0.1, _terms(joint))
    if not pitch:
        return [(inner, motion, outer)]
    slide = Motion('T' + axis, 0.0, _terms(joint, pitch))
    return [(inner, motion, NOWHERE), (NOWHERE, slide, outer)]
