# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which rows singularities are judged by, the measures, their thresholds and levels."""

import dataclasses
import math

import numpy as np
import pytest
from arms import (
    BUNDLED,
    DISTINCT,
    elementary_arm,
    first_order_distances,
    poses,
    robot_of,
    scaled,
    task_jacobian,
)
from random_robots import Constant
from tolerances import QUOTIENT, ROUND_OFF

import kinematics_service as ks
from kinematics_service.estimation.status_text import singularity_status
from kinematics_service.robot.file.parts.description import Placement, RigidMotion
from kinematics_service.robot.measures import HYSTERESIS, MEASURES, Thresholds, thresholds_for
from kinematics_service.robot.robot import build_robot, with_singularity
from kinematics_service.robot.task import find_task

every_arm = pytest.mark.parametrize('name', DISTINCT)
NAMES = tuple(MEASURES)


# Links, joints, rows of the default task, generic rank, joints that cancel.
DEFAULT_TASKS = {
    'one revolute joint with a link': ('Rz(q1), Tx(0.5)', 'r', 'x y', 1, ''),
    'one revolute joint on the tool': ('Rz(q1)', 'r', 'rz', 1, ''),
    'one prismatic joint': ('Ty(q1)', 'p', 'y', 1, ''),
    'planar 2R': ('Rz(q1), Tx(1), Rz(q2), Tx(1)', 'rr', 'x y', 2, ''),
    'planar 2R, upright': ('Ry(q1), Tx(1), Ry(q2), Tx(1)', 'rr', 'x z', 2, ''),
    'planar 3R': ('Rz(q1), Tx(1), Rz(q2), Tx(1), Rz(q3), Tx(1)', 'rrr', 'x y rz', 3, ''),
    'planar 7R': (
        ', '.join(f'Rz(q{k}), Tx(0.{k})' for k in range(1, 8)),
        'r' * 7,
        'x y rz',
        3,
        '',
    ),
    'spatial 3R': ('Rz(q1), Ry(q2), Tx(1), Ry(q3), Tx(1)', 'rrr', 'x y z', 3, ''),
    'wrist alone': ('Rz(q1), Ry(q2), Rz(q3)', 'rrr', 'rx ry rz', 3, ''),
    'Cartesian 3P': ('Tx(q1), Ty(q2), Tz(q3)', 'ppp', 'x y z', 3, ''),
    'pan and tilt without links': ('Rz(q1), Ry(q2)', 'rr', 'rx ry rz', 2, ''),
    'SCARA': ('Rz(q1), Tx(1), Rz(q2), Tx(1), Tz(q3), Rz(q4)', 'rrpr', 'x y z rz', 4, ''),
    'four joints in space': (
        'Rz(q1), Ry(q2), Tx(1), Ry(q3), Tx(1), Ry(q4), Tx(0.3)',
        'rrrr',
        'x y z rx ry rz',
        4,
        '',
    ),
    'five joints': (
        'Rz(q1), Ry(q2), Tx(1), Ry(q3), Tx(1), Ry(q4), Tx(0.3), Rx(q5)',
        'rrrrr',
        'x y z rx ry rz',
        5,
        '',
    ),
    'six joints': (
        'Rz(q1), Ry(q2), Tx(1), Ry(q3), Tx(1), Rx(q4), Ry(q5), Rx(q6), Tx(0.1)',
        'r' * 6,
        'x y z rx ry rz',
        6,
        '',
    ),
    'two parallel prismatic joints': ('Tz(q1), Tz(q2)', 'pp', 'z', 1, 'q1 q2'),
    'two parallel prismatic joints and a turn': (
        'Tz(q1), Tz(q2), Rz(q3), Tx(1)',
        'ppr',
        'x y z rz',
        2,
        'q1 q2',
    ),
    'parallel slides around a turn about their axis': (
        'Tz(q1), Rz(q2), Tx(0.5), Tz(q3), Ry(q4), Tx(0.4)',
        'prpr',
        'x y z rx ry rz',
        3,
        'q1 q3',
    ),
    'two joints on one axis': (
        'Rz(q1), Rz(q2), Ry(q3), Tx(1), Ry(q4), Tx(1), Rx(q5), Ry(q6), Tx(0.1)',
        'r' * 6,
        'x y z rx ry rz',
        5,
        'q1 q2',
    ),
    'four parallel axes, in another way at each pose': (
        'Rz(q1), Rx(0.7), Rz(q2), Tx(1), Rz(q3), Tx(0.8), Rz(q4), Tx(0.6), Rz(q5), Rx(0.5), '
        'Tx(0.3), Rz(q6), Tx(0.1)',
        'r' * 6,
        'x y z rx ry rz',
        5,
        'q2 q3 q4 q5',
    ),
    'a joint that moves nothing': (
        'Rz(q1), Tx(1), Rz(q2), Tx(1), Rx(0*q3)',
        'rrR',
        'x y rz',
        2,
        'q3',
    ),
}


@pytest.mark.parametrize('case', DEFAULT_TASKS)
def test_default_task(case):
    links, types, rows, rank, dependent = DEFAULT_TASKS[case]
    task = elementary_arm(links, types).singularity.task
    assert ' '.join(task.rows) == rows
    assert task.generic_rank == rank
    assert ' '.join(task.dependent_joints) == dependent
    assert task.structurally_deficient == (rank < min(len(task.rows), len(types)))
    assert task.square == (len(task.rows) == len(types))


@pytest.mark.parametrize(
    ('name', 'rows'),
    [
        ('planar_2r', 'x y'),
        ('planar_3r', 'x y rz'),
        ('scara_hsr065', 'x y z rz'),
        ('craig_3r', 'x y z'),
        ('rrp_elementary', 'x y z'),
        ('puma560', 'x y z rx ry rz'),
        ('panda', 'x y z rx ry rz'),
    ],
)
def test_default_task_of_bundled_arms(name, rows):
    assert ' '.join(robot_of(name).singularity.task.rows) == rows


@pytest.mark.parametrize('name', BUNDLED)
def test_only_the_arm_of_document_004_is_deficient_at_every_pose(name):
    task = robot_of(name).singularity.task
    assert task.structurally_deficient == name.startswith('six_joint_dh')
    expected = ('theta1', 'theta2') if name.startswith('six_joint_dh') else ()
    assert task.dependent_joints == expected


def test_an_arm_that_moves_nothing_is_refused():
    with pytest.raises(ks.RobotFileError, match=r'\(task tool\)'):
        elementary_arm('Rz(0*q1)', 'R')
    with pytest.raises(ks.RobotFileError, match=r'\(task z\)'):
        elementary_arm('Rz(q1), Tx(1)', 'r', 'singularity: {task: [z]}')


def test_the_task_is_found_from_the_same_poses_each_time():
    one, other = (
        robot_of('kuka_iiwa14').singularity.task,
        ks.load_robot('kuka_iiwa14').singularity.task,
    )
    assert one.length == other.length
    assert one.reach == other.reach
    for name in ('axes', 'rotation', 'row_scales', 'column_scales'):
        assert np.array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.slow
@every_arm
def test_singular_values_are_of_the_scaled_task_rows(name):
    robot = robot_of(name)
    task, q = robot.singularity.task, poses(robot)
    found = ks.singularity(robot, q)
    J_t = task_jacobian(robot, q)
    sigma = np.linalg.svd(scaled(robot, J_t), compute_uv=False)
    largest = np.max(sigma)
    np.testing.assert_allclose(found.singular_values, sigma, rtol=0, atol=ROUND_OFF * largest)
    smallest = found.singular_values[:, task.generic_rank - 1]
    assert np.array_equal(found.smallest_singular_value, smallest)
    regular = found.rank >= task.generic_rank
    np.testing.assert_allclose(
        found.condition_number[regular],
        sigma[regular, 0] / sigma[regular, task.generic_rank - 1],
        rtol=1e-5,  # the smallest may be 1e-7 of the largest, with numpy's round-off in it
    )
    shares = sigma / sigma[:, :1]
    clear = np.all((shares > 1e-9) | (shares < 1e-12), axis=1)
    assert np.array_equal(found.rank[clear], np.sum(shares > 1e-10, axis=1)[clear])
    plain = np.linalg.svd(J_t, compute_uv=False)
    product = np.prod(plain[:, : task.generic_rank], axis=1)
    np.testing.assert_allclose(
        found.manipulability, product, rtol=1e-9, atol=1e-13 * max(1.0, np.max(product))
    )
    if not task.square:
        assert found.determinant is None
    elif task.structurally_deficient:
        assert np.all(found.determinant == 0.0)
    else:
        exact = np.linalg.det(J_t)
        np.testing.assert_allclose(
            found.determinant, exact, rtol=1e-9, atol=1e-13 * max(1.0, np.max(product))
        )
        assert np.array_equal(found.manipulability, np.abs(found.determinant))


@pytest.mark.slow
@pytest.mark.parametrize('name', [name for name in DISTINCT if robot_of(name).dof < 9])
def test_a_tilted_base_changes_no_measure(name):
    robot = robot_of(name)
    B = Constant((0.7, -0.2, 1.1, 0.4, -1.0, 2.0)).matrix() @ robot.description.base.motion.matrix
    base = Placement('wall', RigidMotion(B, ('0',) * 6))
    tilted = build_robot(dataclasses.replace(robot.description, base=base))
    assert tilted.singularity.task.rows == robot.singularity.task.rows
    assert tilted.singularity.task.length == pytest.approx(
        robot.singularity.task.length, rel=ROUND_OFF
    )
    q = poses(robot)
    q = q[ks.singularity(robot, q).distance > 1e-4]
    one, other = ks.singularity(robot, q), ks.singularity(tilted, q)
    sigma = one.singular_values
    np.testing.assert_allclose(other.singular_values, sigma, rtol=0, atol=1e-11 * np.max(sigma))
    np.testing.assert_allclose(other.distance, one.distance, rtol=1e-7)
    np.testing.assert_allclose(other.manipulability, one.manipulability, rtol=1e-7, atol=1e-15)
    assert np.array_equal(other.level, one.level)
    # The lost direction is in base axes, so it turns with the base (and may come out reversed).
    apart = sigma[:, :-1] - sigma[:, 1:] if sigma.shape[1] > 1 else np.ones((len(q), 1))
    single = np.all(apart > 1e-3 * sigma[:, :1], axis=1)
    R = B[:3, :3] @ robot.description.base.motion.matrix[:3, :3].T
    turned = (one.lost_direction.reshape(-1, 2, 3) @ R.T).reshape(-1, 6)[single]
    along = np.abs(np.sum(turned * other.lost_direction[single], axis=1))
    np.testing.assert_allclose(along, 1.0, rtol=0, atol=1e-6)


def test_rows_are_in_the_axes_of_frame_0():
    links = 'Rz(q1), Tx(1), Rz(q2), Tx(1)'
    level = elementary_arm(links, 'rr')
    wall = elementary_arm(links, 'rr', 'base: {rpy: [0.3, 1.2, -2.0]}')
    assert wall.singularity.task.rows == level.singularity.task.rows == ('x', 'y')
    q = [0.4, 0.9]
    assert ks.singularity(wall, q).determinant == pytest.approx(math.sin(0.9), abs=ROUND_OFF)


@pytest.mark.parametrize('name', ['puma560', 'scara_hsr065', 'six_joint_dh', 'panda'])
def test_another_length_scales_angular_rows_and_prismatic_columns(name):
    robot = robot_of(name)
    q = poses(robot)
    for length in (1.0, 0.25, 3.0):
        other = with_singularity(robot, length=length)
        assert other.singularity.task.length == length
        assert other.singularity.task.rows == robot.singularity.task.rows
        one, found = ks.singularity(robot, q), ks.singularity(other, q)
        sigma = np.linalg.svd(scaled(other, task_jacobian(other, q)), compute_uv=False)
        np.testing.assert_allclose(
            found.singular_values, sigma, rtol=0, atol=1e-12 * np.max(sigma)
        )
        # Never scaled.
        assert np.array_equal(found.manipulability, one.manipulability)
        if robot.singularity.task.square:
            assert np.array_equal(found.determinant, one.determinant)
    if name == 'puma560':  # all revolute and square: w changes by a constant factor, ln w' by none
        distance = first_order_distances(robot, q)
        np.testing.assert_allclose(
            first_order_distances(other, q), distance, rtol=1e-6, atol=QUOTIENT
        )
        near = one.distance < 0.1
        np.testing.assert_allclose(found.distance[near], one.distance[near], rtol=1e-4)


def test_length_of_the_file():
    text = ks.bundled_robots()['puma560'].read_text()
    robot = ks.robot_from_text(text.replace('singularity:', 'singularity:\n  length: 0.5'))
    assert robot.singularity.task.length == 0.5


def test_default_length_is_the_rms_distance_of_the_tool():
    # Planar 2R over full turns: mean of |1 + e^(i q2)|^2 = 2.
    assert robot_of('planar_2r').singularity.task.length == pytest.approx(math.sqrt(2), rel=0.05)
    assert robot_of('planar_2r').singularity.task.reach == pytest.approx(2.0, abs=0.01)
    assert elementary_arm('Rz(q1), Ry(q2), Rz(q3)').singularity.task.length == 1.0


@pytest.mark.parametrize(
    ('name', 'measure', 'warn', 'stop', 'words'),
    [
        ('puma560', 'volume', None, None, ["'volume'", *MEASURES]),
        ('panda', 'determinant', 0.1, 0.01, ['6 rows', '7 joints', 'distance or manipulability']),
        ('six_joint_dh', 'determinant', 0.1, 0.01, ['rank 5 of 6', 'distance']),
        ('puma560', 'determinant', None, None, ['determinant', 'warn and stop']),
        ('panda', 'manipulability', 0.1, None, ['manipulability', 'warn and stop']),
        ('puma560', 'distance', 0.02, None, ['stop (0.03)', 'below warn (0.02)']),
        ('puma560', 'distance', 0.1, 0.1, ['stop (0.1)', 'below warn (0.1)']),
        ('puma560', 'distance', 3.2, 0.1, ['warn', '1 rad', '3.2 rad (183 deg)']),
        ('puma560', 'distance', 0.1, 0.0, ['stop', 'above 0', '0 rad (0 deg)']),
        ('puma560', 'distance', -1.0, 0.1, ['warn', 'above 0', '-1 rad (-57 deg)']),
        ('puma560', 'distance', math.nan, 0.1, ['warn', 'nan']),
        ('puma560', 'distance', math.inf, 0.1, ['warn', 'inf']),
        ('puma560', 'distance', 1.00007, 0.1, ['warn', '1 rad (57 deg)', '1.00007']),
        ('puma560', 'condition_number', 30.0, 17.0, ['stop (17)', 'above warn (30)']),
        ('puma560', 'condition_number', 1.0, 17.0, ['warn of condition_number', 'above 1']),
    ],
)
def test_refused_measures_and_thresholds(name, measure, warn, stop, words):
    with pytest.raises(ks.KinematicsError) as refusal:
        thresholds_for(robot_of(name).singularity.task, measure, warn, stop)
    for word in words:
        assert word in str(refusal.value)


def test_the_farthest_distance_is_a_threshold():
    task = robot_of('panda').singularity.task
    assert thresholds_for(task, 'distance', 1.0) == Thresholds('distance', 1.0, 0.03)


def test_a_distance_of_one_is_said_to_be_none():
    distance, condition = MEASURES['distance'], MEASURES['condition_number']
    assert distance.farther(1.0) == 'none found within 1 rad (57 deg)'
    assert distance.farther(math.nextafter(1.0, 0.0)) == ''
    assert distance.farther(math.nan) == condition.farther(math.inf) == ''


def test_default_thresholds():
    task = robot_of('panda').singularity.task
    assert thresholds_for(task, 'distance') == Thresholds('distance', 0.1, 0.03)
    # MoveIt Servo's numbers.
    assert thresholds_for(task, 'condition_number') == Thresholds('condition_number', 17.0, 30.0)
    assert robot_of('panda').singularity.thresholds == Thresholds('distance', 0.1, 0.03)


def test_a_determinant_refused_in_the_file_names_the_file():
    text = ks.bundled_robots()['panda'].read_text()
    text += '\nsingularity: {measure: determinant, warn: 0.1, stop: 0.01}\n'
    with pytest.raises(ks.RobotFileError, match='singularity: .*determinant'):
        ks.robot_from_text(text)


SMALL_IS_BAD = Thresholds('distance', 0.1, 0.03)
LARGE_IS_BAD = Thresholds('condition_number', 17.0, 30.0)
OK, WARN, ERROR, STALE = ks.Level


@pytest.mark.parametrize(
    ('thresholds', 'value', 'previous', 'level'),
    [
        (SMALL_IS_BAD, 0.2, OK, OK),
        (SMALL_IS_BAD, 0.1, OK, WARN),
        (SMALL_IS_BAD, 0.1000001, OK, OK),
        (SMALL_IS_BAD, 0.1000001, WARN, WARN),
        (SMALL_IS_BAD, 0.149, WARN, WARN),
        (SMALL_IS_BAD, 0.151, WARN, OK),
        (SMALL_IS_BAD, 0.03, WARN, ERROR),
        (SMALL_IS_BAD, 0.031, WARN, WARN),
        (SMALL_IS_BAD, 0.044, ERROR, ERROR),
        (SMALL_IS_BAD, 0.046, ERROR, WARN),
        (SMALL_IS_BAD, 0.149, ERROR, WARN),
        (SMALL_IS_BAD, 0.151, ERROR, OK),
        (SMALL_IS_BAD, 0.12, STALE, OK),
        (SMALL_IS_BAD, 0.0, OK, ERROR),
        # A distance of 1 rad means at least that: no level begins there, or holds.
        (Thresholds('distance', 0.8, 0.7), 1.0, WARN, OK),
        (Thresholds('distance', 0.8, 0.7), 1.0, ERROR, OK),
        (Thresholds('distance', 0.8, 0.7), 0.999, ERROR, ERROR),
        (Thresholds('distance', 1.0, 0.5), 1.0, OK, OK),
        (Thresholds('distance', 1.0, 0.5), 1.0, WARN, OK),
        (Thresholds('distance', 1.0, 0.5), 0.999, OK, WARN),
        (SMALL_IS_BAD, math.nan, OK, ERROR),
        (LARGE_IS_BAD, 10.0, OK, OK),
        (LARGE_IS_BAD, 17.0, OK, WARN),
        (LARGE_IS_BAD, 30.0, OK, ERROR),
        (LARGE_IS_BAD, 12.0, WARN, WARN),
        (LARGE_IS_BAD, 11.0, WARN, OK),
        (LARGE_IS_BAD, 21.0, ERROR, ERROR),
        (LARGE_IS_BAD, 19.0, ERROR, WARN),
        (LARGE_IS_BAD, 11.0, ERROR, OK),
        (LARGE_IS_BAD, math.inf, OK, ERROR),
        (LARGE_IS_BAD, math.nan, OK, ERROR),
    ],
)
def test_levels_and_their_hysteresis(thresholds, value, previous, level):
    assert thresholds.level(value, previous) is level


@pytest.mark.parametrize('thresholds', [SMALL_IS_BAD, LARGE_IS_BAD])
def test_noise_at_a_threshold_gives_one_warning(thresholds):
    random = np.random.default_rng(0)
    for threshold in (thresholds.warn, thresholds.stop):
        within = 0.99 * HYSTERESIS
        values = threshold * random.uniform(1 / within, within, 1000)
        level, changes = OK, 0
        for value in values:
            following = thresholds.level(value, level)
            changes += following != level
            level = following
        assert changes <= 2  # to the first level and, from there, perhaps to the second


def test_what_is_farther_than_the_threshold_of_one_is_fine():
    robot = with_singularity(robot_of('planar_2r'), thresholds=Thresholds('distance', 1.0, 0.5))
    q = np.array([[0.0, 1.4], [0.0, 0.9], [0.0, 0.4]])
    assert ks.singularity(robot, q).level.tolist() == [OK, WARN, ERROR]
    assert [ks.singularity(robot, one).level for one in q] == [OK, WARN, ERROR]


@pytest.mark.parametrize('measure', NAMES)
def test_the_level_is_that_of_the_watched_measure(measure):
    robot = robot_of('puma560')
    defaults = MEASURES[measure]
    warn, stop = (defaults.warn or 0.02), (defaults.stop or 0.005)
    judged = with_singularity(robot, thresholds=Thresholds(measure, warn, stop))
    q = poses(robot, 200)
    found = ks.singularity(judged, q)
    values = np.abs(getattr(found, measure)).tolist()
    assert found.level.tolist() == [judged.singularity.thresholds.level(value) for value in values]
    assert set(found.level.tolist()) == {0, 1, 2}
    one = ks.singularity(judged, q[0])
    assert isinstance(one.level, ks.Level)
    assert one.level == found.level[0]


def test_an_unknown_row_and_a_row_that_does_not_move():
    robot = robot_of('planar_2r')
    with pytest.raises(ks.KinematicsError, match=r'\(task z\)'):
        find_task(robot.chain, robot.joint_names, poses(robot), [False] * 2, ('z',))


def test_a_wrist_whose_tool_is_in_its_centre_is_judged_by_its_turns():
    # Turned base and lengths that cancel leave 1e-17 m, which is no motion of the tool.
    robot = ks.robot_from_text(
        'robot: wrist\nsource: a test\nconvention: standard\n'
        'joints:\n'
        '  - {name: j1, variable: q1, type: revolute}\n'
        '  - {name: j2, variable: q2, type: revolute}\n'
        '  - {name: j3, variable: q3, type: revolute}\n'
        'base: {frame: base, xyz: [0.1, 0.2, 0.7], rpy: [0.3, 0.4, 0.5]}\n'
        'tool: {frame: tool, xyz: [0, 0, -0.1]}\n'
        'links:\n'
        '  - {a: 0, alpha: pi/2, d: 0.3, theta: q1}\n'
        '  - {a: 0, alpha: -pi/2, d: 0, theta: q2}\n'
        '  - {a: 0, alpha: 0, d: 0.1, theta: q3}\n'
    )
    assert robot.singularity.task.rows == ('rx', 'ry', 'rz')
    assert ks.singularity(robot, [0.1, 0.05, 0.3]).distance == pytest.approx(0.05)


def many_joints(tmp_path, joints, more=''):
    """Return the file of an arm of so many joints, their axes in turn."""
    axes = ('Rx', 'Ry', 'Rz')
    rows = ', '.join(f'{axes[k % 3]}(q{k}), Tz(0.1), Tx(0.0{1 + k % 7})' for k in range(joints))
    names = ', '.join(f'{{name: q{k}, type: revolute}}' for k in range(joints))
    file = tmp_path / 'many.yaml'
    file.write_text(
        f'robot: many\nconvention: elementary\njoints: [{names}]\nlinks: [{rows}]\n{more}'
    )
    return file


@pytest.mark.parametrize(('joints', 'measure'), [(16, 'distance'), (17, 'condition_number')])
def test_above_sixteen_joints_the_default_measure_is_the_condition_number(
    tmp_path, joints, measure
):
    robot = ks.load_robot(many_joints(tmp_path, joints))
    assert robot.singularity.thresholds.measure == measure


@pytest.mark.parametrize(('position', 'unknown'), [(9e4, False), (2e5, True)])
def test_the_distance_at_far_positions_is_unknown(position, unknown):
    robot = ks.load_robot('planar_2r')
    found = ks.singularity(robot, [position, 1.4])
    sentence = singularity_status(robot, found, ks.Level.OK, 'base').sentence
    for words in (repr(found), sentence):
        assert ('unknown: ' in words) == unknown
        assert ('none found within 1 rad' in words) != unknown
    assert ('not near' in sentence) != unknown


def test_the_distance_of_sixty_joints_is_unknown_and_refused_as_a_measure(tmp_path):
    robot = ks.load_robot(many_joints(tmp_path, 60))
    assert robot.singularity.thresholds == Thresholds('condition_number', 17.0, 30.0)
    found = ks.singularity(robot, np.full(60, 0.3))
    assert found.distance == 1.0
    assert found.nearest_singular is None
    assert found.clearance == 0.0
    assert 'distance unknown: ' in repr(found)
    assert 'up to 16' in repr(found)
    with pytest.raises(ks.KinematicsError, match='16 joints, not 60'):
        thresholds_for(robot.singularity.task, 'distance')
    with pytest.raises(ks.KinematicsError, match='16 joints, not 60'):
        ks.load_robot(many_joints(tmp_path, 60, 'singularity: {measure: distance}\n'))
