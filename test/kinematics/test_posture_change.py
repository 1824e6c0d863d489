"""
Whether an arm can change its posture: paths, proofs, and arms of which neither is known.

Every number is checked by an own road: a table multiplied out in plain numpy, its Jacobian by
complex steps, and the aspects of three joints on a dense grid.
"""

import functools
import itertools
import math
import re

import numpy as np
import pytest
from arms import robot_of
from general_arms import DEGREE, TABLES, general_arm, text_of
from scipy import ndimage, sparse

import kinematics_service as ks
from kinematics_service.kinematics.postures import passage
from kinematics_service.kinematics.postures.passage import Passages
from kinematics_service.kinematics.postures.position_arm import NO_CUSPS
from kinematics_service.kinematics.postures.proof import (
    PARALLEL_AXES,
    PLANAR,
    WRIST,
    proof_of_no_change,
)

H = math.pi / 2
# The tool is at the target to what a Newton step ends at.
AT_TARGET = 1e-9
STEP = 1e-30
# Random targets of an arm on the torus: of Wenger's, ten show that it changes posture.
TARGETS = 15
# Wenger's arm (2007): the best known one that changes posture.
WENGER = {'d2': 1.0, 'alpha2': -H, 'd3': 2.0, 'alpha3': H, 'd4': 1.5, 'r2': 1.0, 'r3': 0.0}


def pose_of(convention, rows, kinds, q):
    """Return the poses of a table's end at joint positions (..., n), complex ones allowed."""
    q = np.asarray(q)
    T, zero = np.eye(4, dtype=q.dtype), np.zeros(q.shape[:-1])
    for (a, alpha, d, theta), kind, x in zip(rows, kinds, np.moveaxis(q, -1, 0)):
        d, theta = (d + x, theta + zero) if kind == 'P' else (d + zero, theta + x)
        c, s, ca, sa = np.cos(theta), np.sin(theta), math.cos(alpha), math.sin(alpha)
        turn = np.zeros((*zero.shape, 4, 4), dtype=q.dtype) + np.diag([0, 0, 1, 1])
        turn[..., 0, 0], turn[..., 0, 1], turn[..., 1, 0], turn[..., 1, 1] = c, -s, s, c
        turn[..., 2, 3] = d
        fixed = np.array([[1, 0, 0, a], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1]])
        T = T @ (fixed @ turn if convention == 'modified' else turn @ fixed)
    return T


def determinant(convention, rows, kinds, q):
    """Return det J (N,) by complex steps: of the position of three joints, of the pose of six."""
    q, columns = np.asarray(q, dtype=complex), []
    R = pose_of(convention, rows, kinds, q)[:, :3, :3].real
    for step in 1j * STEP * np.eye(q.shape[1]):
        T = pose_of(convention, rows, kinds, q + step).imag / STEP
        W = T[:, :3, :3] @ np.swapaxes(R, 1, 2)
        column = [*T[:, :3, 3].T, W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]]
        columns.append(column[: q.shape[1]])
    return np.linalg.det(np.moveaxis(np.array(columns), -1, 0))


def assert_the_path_holds(change, convention, rows, kinds):
    """The ends are two postures of the target, and det keeps its sign densely between them."""
    assert change.verdict == 'yes'
    q, check = change.path.q, change.path.check
    assert check.singularity.verdict == 'proved'
    assert check.singularity.lower >= check.singularity.threshold
    turning = np.array([kind == 'R' for kind in kinds])
    away = q[-1] - q[0]
    away = np.where(turning, (away + math.pi) % (2 * math.pi) - math.pi, away)
    assert np.max(np.abs(away)) > 1e-3
    for end in (q[0], q[-1]):
        T = pose_of(convention, rows, kinds, end)
        reached = T if change.target.ndim == 2 else T[:3, 3]
        np.testing.assert_allclose(reached, change.target, rtol=0, atol=AT_TARGET)
    dense = np.concatenate([np.linspace(a, b, 300) for a, b in itertools.pairwise(q)])
    signs = set(np.sign(determinant(convention, rows, kinds, dense)).tolist())
    assert signs in ({1.0}, {-1.0})


def table_of(d2, alpha2, d3, alpha3, d4, r2, r3):
    """Return the modified rows of three turning joints and a tool, as Wenger has them."""
    return [(0.0, 0.0, 0.0, 0.0), (d2, alpha2, r2, 0.0), (d3, alpha3, r3, 0.0)], d4


def three_joints(limits=None, **lengths):
    rows, d4 = table_of(**lengths)
    text = text_of('modified', rows, 'RRR', limits)
    return ks.robot_from_text(text + f'tool: {{xyz: [{d4!r}, 0, 0]}}\n')


def random_lengths(random):
    names = ('d2', 'alpha2', 'd3', 'alpha3', 'd4', 'r2', 'r3')
    low, high = (0.1, -3.0, 0.1, -3.0, 0.1, -1.0, -1.0), (2.0, 3.0, 2.0, 3.0, 2.0, 1.0, 1.0)
    return dict(zip(names, map(float, random.uniform(low, high))))


class Torus:
    """
    Aspects and solutions of three joints on the torus of the last two, without the library.

    By signs alone, aspects seem to touch where two curves of singular poses cross between points
    of the grid. With `crossing` what is within a step of a curve is in none.
    """

    def __init__(self, side, d2, alpha2, d3, alpha3, d4, r2, r3, crossing=False):
        self.numbers = d2, alpha2, d3, alpha3, d4, r2, r3
        self.side = side
        self.crossing = crossing

    @functools.cached_property
    def labels(self):
        """Return of each point of the grid the number of its aspect, with the sign of det."""
        side = self.side
        at = 2.0 * math.pi * np.arange(side) / side
        det = self.det(*np.meshgrid(at, at, indexing='ij'))
        if self.crossing:
            slopes = np.gradient(det, 2.0 * math.pi / side)
            near = 2.0 * math.pi / side * np.max(np.abs(slopes))
            det = np.where(np.abs(det) > near, det, 0.0)
        return self.parts_of(det > 0.0) - self.parts_of(det < 0.0)

    @staticmethod
    def parts_of(inside):
        """Return the numbers of the parts of a torus, from 1; 0 outside of them."""
        parts, count = ndimage.label(inside)
        edges = np.hstack([parts[[-1, 0]], parts[:, [-1, 0]].T])
        first, second = edges[:, np.all(edges > 0, axis=0)]
        meeting = sparse.coo_array((first > 0, (first, second)), (count + 1, count + 1))
        _, whole = sparse.csgraph.connected_components(meeting, directed=False)
        return whole[parts]

    def numbers_at(self, x, y):
        """Return the height along the first axis and half the square of the distance from it."""
        d2, alpha2, d3, alpha3, d4, r2, r3 = self.numbers
        p = np.array([d4 * np.cos(y), d4 * np.sin(y), r3 + 0 * y])
        c, s = math.cos(alpha3), math.sin(alpha3)
        p = np.array([d3 + p[0], c * p[1] - s * p[2], r2 + s * p[1] + c * p[2]])
        p = np.array(
            [np.cos(x) * p[0] - np.sin(x) * p[1], np.sin(x) * p[0] + np.cos(x) * p[1], p[2]]
        )
        c, s = math.cos(alpha2), math.sin(alpha2)
        p = np.array([d2 + p[0], c * p[1] - s * p[2], s * p[1] + c * p[2]])
        return np.array([p[2], 0.5 * (p[0] ** 2 + p[1] ** 2)])

    def slopes(self, x, y):
        by_x = self.numbers_at(x + 1j * STEP, y + 0j).imag / STEP
        return by_x, self.numbers_at(x + 0j, y + 1j * STEP).imag / STEP

    def det(self, x, y):
        a, b = self.slopes(x, y)
        return a[0] * b[1] - a[1] * b[0]

    def solutions(self, targets):
        """Return of targets (2, N) a list of solutions each, by Newton steps from a grid."""
        at = 2.0 * math.pi * np.arange(12) / 12
        z = np.array(np.meshgrid(at, at)).reshape(2, 1, -1) + np.zeros((2, targets.shape[1], 1))
        for _ in range(40):
            f = self.numbers_at(*z) - targets[:, :, None]
            a, b = self.slopes(*z)
            det = a[0] * b[1] - a[1] * b[0]
            det = np.where(np.abs(det) > 1e-12, det, 1e-12)
            step = np.array([b[1] * f[0] - b[0] * f[1], a[0] * f[1] - a[1] * f[0]]) / det
            z = z - step * np.minimum(1.0, 0.5 / np.maximum(np.linalg.norm(step, axis=0), 1e-300))
        away = np.linalg.norm(self.numbers_at(*z) - targets[:, :, None], axis=0)
        return [self.distinct(z[:, k, own].T) for k, own in enumerate(away < 1e-11)]

    @staticmethod
    def distinct(z):
        found = []
        for one in z % (2.0 * math.pi):
            if all(np.max(np.abs(np.sin((one - two) / 2))) > 1e-4 for two in found):
                found.append(one)
        return found

    def two_in_one_aspect(self, targets, random):
        """Return whether two solutions of a random target are clearly in one aspect."""
        q = random.uniform(0.0, 2.0 * math.pi, (targets, 2))
        for found in self.solutions(self.numbers_at(*q.T)):
            seen = set()
            for x, y in found:
                i, j = int(x / (2 * math.pi) * self.side), int(y / (2 * math.pi) * self.side)
                corners = {
                    int(self.labels[(i + k) % self.side, (j + m) % self.side])
                    for k, m in itertools.product((0, 1), (0, 1))
                }
                if len(corners) == 1 and corners != {0}:
                    if corners <= seen:
                        return True
                    seen |= corners
        return False


# That of skew axes takes as long as three of the others.
@pytest.mark.parametrize('name', [name for name in TABLES if name != 'skew_wrist'])
def test_arms_without_a_spherical_wrist_change_posture(name):
    convention, rows = TABLES[name]
    change = ks.posture_change(general_arm(name))
    assert_the_path_holds(change, convention, rows, 'RRRRRR')
    assert max(len(group.q) for group in change.groups) > 1


@pytest.mark.parametrize('name', ['crx10ia_l', 'offset_stanford_printed'])
def test_bundled_arms_change_posture_inside_their_limits(name):
    robot = robot_of(name)
    change = ks.posture_change(robot)
    assert change.verdict == 'yes'
    assert change.path.check.verdict != 'refuted'
    assert all(joint.limits == 'proved' for joint in change.path.check.joints)
    q = np.concatenate([np.linspace(a, b, 200) for a, b in itertools.pairwise(change.path.q)])
    assert len(set(np.sign(ks.singularity(robot, q).determinant))) == 1
    np.testing.assert_allclose(
        ks.forward_kinematics(robot, q[0]), ks.forward_kinematics(robot, q[-1]), atol=AT_TARGET
    )


@pytest.mark.parametrize(
    ('name', 'says'),
    [
        ('ur3e', PARALLEL_AXES),
        ('ur5e', PARALLEL_AXES),
        ('ur10e', PARALLEL_AXES),
        ('puma560', WRIST),
        ('offset_stanford_dh', WRIST),
        ('offset_stanford_shape', WRIST),
        ('anthropomorphic_3r', 'one after the other'),
        ('craig_3r', 'plane or a sphere'),
        ('parallelogram_left', 'one after the other'),
        ('rrp_elementary', 'one after the other'),
        ('spherical_rrp', 'one after the other'),
        ('planar_2r', PLANAR),
        ('planar_3r', PLANAR),
        ('scara_hsr065', PLANAR),
    ],
)
def test_simple_arms_are_proved_to_change_no_posture(name, says):
    change = ks.posture_change(name)
    assert change.verdict == 'no'
    assert says in change.reason
    assert change.path is None
    # Each sign of the factors is one aspect or more: none has two postures.
    assert sum(len(group.q) for group in change.groups) > 1
    assert all(len(group.q) == 1 for group in change.groups)


@pytest.mark.parametrize('name', ['anthropomorphic_3r', 'craig_3r', 'parallelogram_right'])
def test_aspects_that_touch_in_a_pose_are_told_apart(name):
    # Two curves of singular poses cross: by signs on a grid, opposite aspects would seem to touch.
    change = ks.posture_change(name)
    assert change.aspects == 4
    assert sorted(group.aspect for group in change.groups) == [1, 2, 3, 4]


@pytest.mark.parametrize(
    'name', ['ur5e', 'puma560', 'offset_stanford_dh', 'craig_3r', 'spherical_rrp', 'scara_hsr065']
)
def test_the_signs_of_the_factors_tell_all_postures_apart(name):
    robot = robot_of(name)
    random = np.random.default_rng(4)
    # Inside these ways of the joints that slide, and all turns of the others.
    q = random.uniform(-math.pi, math.pi, (40, robot.dof))
    q[:, robot.prismatic] = random.uniform(0.1, 0.5, (40, int(np.sum(robot.prismatic))))
    seen = 0
    for T in ks.forward_kinematics(robot, q):
        found = ks.inverse_kinematics(robot, T, rows=robot.task.rows, respect_limits=False)
        postures = np.array([one.q for one in found if one.multiplicity == 1])
        signs = np.sign(robot.factors.evaluate(postures)[..., 0])
        seen += len(signs)
        assert len(np.unique(signs, axis=0)) == len(signs)
    assert seen >= 2 * len(q)


def test_an_arm_of_three_orthogonal_axes_changes_posture():
    change = ks.posture_change(three_joints(**WENGER))
    rows, d4 = table_of(**WENGER)
    # The tool as a further row that stands still.
    q = np.column_stack([change.path.q, np.zeros(len(change.path.q))])
    tool = [*rows, (d4, 0.0, 0.0, 0.0)]
    positions = [pose_of('modified', tool, 'RRRR', one)[:3, 3] for one in (q[0], q[-1])]
    np.testing.assert_allclose(positions, [change.target] * 2, atol=AT_TARGET)
    torus, dense = Torus(64, **WENGER), np.linspace(0.0, 1.0, 500)[:, None]
    signs = {
        sign
        for a, b in itertools.pairwise(change.path.q)
        for sign in np.sign(torus.det(*(a + dense * (b - a)).T[1:]))
    }
    assert len(signs) == 1
    # Two aspects, and two postures in each.
    assert change.aspects == 2
    assert [len(group.q) for group in change.groups] == [2, 2]


@pytest.mark.parametrize(
    'simpler',
    [
        {'d2': 0.0},  # axes 1 and 2 meet
        {'d2': 0.0, 'r2': 0.3, 'r3': 0.1, 'alpha2': 1.0, 'alpha3': 2.0},
        {'alpha2': 0.0, 'alpha3': 1.0},  # axes 1 and 2 are parallel
        {'alpha3': 0.0, 'r3': 0.3, 'alpha2': 1.1},  # axes 2 and 3 are parallel
        {'d3': 0.0, 'r3': 0.3, 'alpha2': 0.7, 'alpha3': 1.1},  # axes 2 and 3 meet
        {'r2': 0.0},  # orthogonal without offsets
        {'r2': 0.0, 'd4': 2.5},
        {'d3': 0.3, 'd4': 0.2, 'r2': 0.1},  # two solutions everywhere
    ],
)
def test_simple_arms_of_three_joints_change_no_posture(simpler):
    lengths = WENGER | simpler
    assert ks.posture_change(three_joints(**lengths)).verdict == 'no'
    torus = Torus(200, **lengths, crossing=True)
    assert not torus.two_in_one_aspect(TARGETS, np.random.default_rng(1))


@pytest.mark.parametrize('error', [1e-2, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11])
def test_nearly_simple_arms_are_not_said_to_change_none(error):
    # Axes 2 and 3 are nearly parallel, axes 1 and 2 nearly meet, offsets are nearly none.
    for simple in ({'alpha3': 0.0, 'r3': 0.3}, {'d2': 0.0, 'r3': 0.1}, {'r2': 0.0}):
        lengths = WENGER | simple
        for name in lengths:
            lengths[name] += error * (1.0 + len(name) / 7.0)
        assert not proof_of_no_change(three_joints(**lengths)).sentence


@pytest.mark.parametrize('name', ['d2', 'alpha2'])
def test_axes_that_meet_or_are_parallel_but_for_round_off_alone_have_aspects(name):
    # What is farther off is another arm than the one whose aspects would be told.
    grids = [
        proof_of_no_change(three_joints(**WENGER | {name: error})).grid for error in (1e-13, 1e-10)
    ]
    assert grids[0] is not None
    assert grids[1] is None


def test_an_arm_that_is_nearly_simple_changes_posture():
    lengths = WENGER | {'alpha3': 1e-3, 'r3': 0.3}
    change = ks.posture_change(three_joints(**lengths))
    assert change.verdict == 'yes'
    assert change.path.check.singularity.lower < 0.05


def test_random_arms_of_three_joints_are_decided_as_a_dense_grid_has_them():
    random = np.random.default_rng(11)
    verdicts = []
    for _ in range(8):
        lengths = random_lengths(random)
        change = ks.posture_change(three_joints(**lengths))
        verdicts.append(change.verdict)
        torus = Torus(200, **lengths)
        if change.verdict == 'no':
            assert change.reason == NO_CUSPS
            assert not torus.two_in_one_aspect(TARGETS, random)
        else:
            dense = np.linspace(0.0, 1.0, 300)[:, None]
            parts = [a + dense * (b - a) for a, b in itertools.pairwise(change.path.q)]
            assert len(set(np.sign(torus.det(*np.vstack(parts).T[1:])))) == 1
    assert set(verdicts) == {'yes', 'no'}


def test_lengths_of_many_decades_change_none_of_what_is_proved():
    random, decided = np.random.default_rng(5), 0
    for _ in range(40):
        lengths = random_lengths(random)
        for name in ('d2', 'd3', 'd4', 'r2', 'r3'):
            lengths[name] = float(10.0 ** random.uniform(-2, 2))
        if decided < 4 and proof_of_no_change(three_joints(**lengths)).sentence:
            decided += 1
            assert not Torus(200, **lengths).two_in_one_aspect(TARGETS, random)
    assert decided == 4


def test_postures_with_one_number_are_in_one_aspect():
    # The boxes are proved: the dense grid, by signs alone, must have them connected, too.
    random = np.random.default_rng(2)
    for lengths in (WENGER, random_lengths(random), random_lengths(random)):
        change = ks.posture_change(three_joints(**lengths))
        torus, side = Torus(300, **lengths), 300
        for group in change.groups:
            if group.aspect:
                cells = np.floor(group.q[:, 1:] / (2 * math.pi) * side).astype(int) % side
                assert len({int(torus.labels[i, j]) for i, j in cells}) == 1


def ur5e_off_by(error):
    """Return a UR5e whose lengths and angles are off, without the factors of the exact one."""
    random = np.random.default_rng(3)
    pieces = ks.bundled_robots()['ur5e'].read_text(encoding='utf-8').split('singularity:')

    def off(row):
        a, alpha = (f'{x} + {error * random.normal():.17g}' for x in row.groups())
        return f'{{a: {a}, alpha: {alpha},'

    return ks.robot_from_text(re.sub(r'\{a: *([^,]*), *alpha: *([^,]*),', off, pieces[0]))


# By 1e-10 the closed form recognises its axes as parallel.
@pytest.mark.parametrize('error', [0.0, 1e-14, 1e-11, 1e-10, 1e-9, 1e-5])
def test_a_calibrated_arm_is_not_taken_for_the_exact_one(error):
    proved = proof_of_no_change(ur5e_off_by(error)).sentence
    assert proved == (PARALLEL_AXES if error < 1e-12 else '')


def test_a_calibrated_arm_is_not_decided(monkeypatch):
    # Its four postures of a sign are apart but for passages of the size of its errors: no number
    # of poses finds them.
    monkeypatch.setattr(passage, 'POSES', passage.POSES // 4)
    change = ks.posture_change(ur5e_off_by(1e-5))
    assert change.verdict == 'not decided'
    assert 'no path was found' in change.reason
    assert [len(group.q) for group in change.groups] == [4, 4]


def test_a_spherical_wrist_leaves_what_its_arm_can():
    wrist = [(0.0, H, 0.4, 0.0), (0.0, -H, 0.0, 0.0), (0.0, 0.0, 0.1, 0.0)]
    for arm, verdict in (
        ([(1.0, -H, 0.0, 0.0), (2.0, H, 1.0, 0.0), (1.5, 30 * DEGREE, 0.2, 0.0)], 'yes'),
        ([(1.0, -H, 0.0, 0.0), (0.3, H, 0.1, 0.0), (0.0, 30 * DEGREE, 0.0, 0.0)], 'no'),
    ):
        rows = [*arm, *wrist]
        change = ks.posture_change(ks.robot_from_text(text_of('standard', rows)))
        assert change.verdict == verdict
        if verdict == 'yes':
            assert_the_path_holds(change, 'standard', rows, 'RRRRRR')


@pytest.mark.parametrize(
    ('kinds', 'seed', 'verdict'),
    [
        ('RRP', 7, 'yes'),
        ('RPR', 7, 'yes'),
        ('PRR', 7, 'yes'),
        ('RPR', 3, 'not decided'),
        ('RPP', 3, 'no'),
        ('PPR', 3, 'no'),
    ],
)
def test_arms_with_joints_that_slide(kinds, seed, verdict):
    random = np.random.default_rng(seed)
    rows = [tuple(map(float, random.uniform(0.2, 1.0, 4))) for _ in kinds]
    change = ks.posture_change(ks.robot_from_text(text_of('standard', rows, kinds)))
    assert change.verdict == verdict
    if verdict == 'yes':
        assert_the_path_holds(change, 'standard', rows, kinds)


@pytest.mark.parametrize('kinds', ['R', 'P'])
def test_one_joint_changes_no_posture(kinds):
    robot = ks.robot_from_text(text_of('standard', [(0.5, 1.0, 0.2, 0.3)], kinds))
    assert ks.posture_change(robot).verdict == 'no'


def test_gears_change_nothing():
    rows, d4 = table_of(**WENGER)
    text = text_of('modified', rows, 'RRR', gears=[1.0, -1.0, 1.0])
    geared = ks.robot_from_text(text + f'tool: {{xyz: [{d4}, 0, 0]}}\n')
    change = ks.posture_change(geared)
    assert (change.verdict, change.aspects) == ('yes', 2)


def test_the_path_stays_inside_the_limits_unless_told():
    narrow = three_joints(limits=[(-0.2, 0.2)] * 3, **WENGER)
    change = ks.posture_change(narrow)
    assert change.verdict == 'not decided'
    assert change.path is None
    free = ks.posture_change(narrow, respect_limits=False)
    assert free.verdict == 'yes'
    assert free.path.check.singularity.verdict == 'proved'
    wide = three_joints(limits=[(-3.0, 3.0)] * 3, **WENGER)
    change = ks.posture_change(wide)
    assert np.all(np.abs(change.path.q) <= 3.0)
    assert change.path.check.verdict == 'proved'


def test_the_path_keeps_the_distance_that_is_asked_for():
    robot = robot_of('xarm6')
    change = ks.posture_change(robot, distance=0.02)
    assert change.verdict == 'yes'
    assert change.path.check.singularity.lower >= 0.02
    # Nowhere is an arm a rad from all its singular poses.
    assert ks.posture_change(three_joints(**WENGER), distance=1.0).verdict == 'not decided'


def test_the_same_seed_gives_the_same_answer():
    robot = three_joints(**WENGER)
    one, two, other = (ks.posture_change(robot, seed=seed) for seed in (0, 0, 1))
    assert np.array_equal(one.path.q, two.path.q)
    assert not np.array_equal(one.path.q, other.path.q)
    assert not one.path.q.flags.writeable
    assert repr(one) == f'PostureChange(yes, {one.reason})'


def test_a_path_that_is_not_proved_is_no_answer(monkeypatch):
    # Straight to the other posture, wherever that leads; then by turns beyond the last limit.
    between = Passages.between
    monkeypatch.setattr(Passages, 'between', lambda self, first, last: np.array([first, last]))
    assert ks.posture_change(ur5e_off_by(1e-5)).verdict == 'not decided'

    def far(self, first, last):
        q = between(self, first, last)
        return None if q is None else np.vstack([q, q[-1] + [50, 0, 0], q[-1]])

    monkeypatch.setattr(Passages, 'between', far)
    robot = three_joints(limits=[(-3.0, 3.0)] * 3, **WENGER)
    assert ks.posture_change(robot).verdict == 'not decided'
    assert ks.posture_change(robot, respect_limits=False).verdict == 'yes'


@pytest.mark.parametrize(
    ('name', 'says'),
    [
        ('panda', 'panda has 7 joints, but moves the tool (x y z rx ry rz) in 6 ways only'),
        ('six_joint_dh', 'six_joint_dh has 6 joints, but moves the tool'),
        ('five_bar', 'five_bar has closed loops'),
        ('crank_slider', 'crank_slider has closed loops'),
    ],
)
def test_arms_without_isolated_postures_or_with_loops_are_refused(name, says):
    with pytest.raises(ks.PlanError, match=re.escape(says)):
        ks.posture_change(name)


@pytest.mark.parametrize('distance', [0.0, -1.0, 2.0, math.nan])
def test_a_distance_that_means_nothing_is_refused(distance):
    with pytest.raises(ks.PlanError, match='distance'):
        ks.posture_change('ur5e', distance=distance)
