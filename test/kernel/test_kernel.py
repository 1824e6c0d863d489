# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The compiled functions on their own: sine and cosine, singular values, determinant, quaternions.
"""

import gc
import math
import os
import re
import subprocess
import sys
import weakref
from fractions import Fraction
from pathlib import Path

import kernel_numbers
import mpmath
import numpy as np
import pytest
from arms import BUNDLED, robot_of
from kernel_tour import functions
from refusal import refused
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.kernel.compiled import VARIABLE
from kinematics_service.kernel.layout import places

PACKAGE = Path(ks.__file__).parent
TESTS = Path(__file__).parent
compiled_only = pytest.mark.skipif(not kernel.is_compiled(), reason='about the compiled kernel')

# Errors of sine and cosine, in units in the last place; fdlibm promises less than one.
LAST_PLACES = 2.0


def angles():
    # Every magnitude, multiples of a quarter turn and their neighbours, and beyond the reduction.
    random = np.random.default_rng(0)
    magnitudes = 10.0 ** random.uniform(-300, 5, 2000) * random.choice([-1, 1], 2000)
    ordinary = random.uniform(-1000, 1000, 2000)
    quarters = random.integers(-63661, 63661, 1000) * (math.pi / 2)
    eighths = (random.integers(-31830, 31830, 500) + 0.5) * (math.pi / 2)  # where quarters change
    close = np.concatenate([quarters, eighths, [kernel.LARGEST_REDUCED]])
    neighbours = [np.nextafter(close, sign * np.inf) for sign in (1, -1)]
    huge = 10.0 ** random.uniform(5, 22, 500) * random.choice([-1, 1], 500)
    few = [0.0, -0.0, 5e-324, 1e-310, math.pi, -math.pi, 2 * math.pi, 1e300, 1.7e308]
    return np.concatenate([magnitudes, ordinary, close, *neighbours, huge, few])


def test_sine_and_cosine_to_two_units_in_the_last_place():
    worst = 0.0
    with mpmath.workdps(50):
        for x in angles().tolist():
            # mpmath reduces with the digits a huge angle needs by itself.
            for found, exact in zip(kernel.sine_and_cosine(x), (mpmath.sin(x), mpmath.cos(x))):
                place = math.ulp(float(exact))
                worst = max(worst, float(abs(mpmath.mpf(found) - exact)) / place)
    assert worst <= LAST_PLACES


def test_sine_and_cosine_lie_on_the_circle():
    s, c = np.array([kernel.sine_and_cosine(x) for x in angles().tolist()]).T
    np.testing.assert_allclose(s * s + c * c, 1.0, rtol=0, atol=4 * np.finfo(float).eps)


def test_angles_that_overflow_are_refused_and_raise_nothing_else():
    # theta3 - theta2 of finite angles that is not finite, and not a number in the next row.
    robot = robot_of('parallelogram_left')
    for q in ([0.0, -1.7e308, 1.7e308], [0.0, 1.7e308, -1.7e308]):
        with refused(ks.JointVectorError, 'too-large', 'row 0', '1.7e+308'):
            ks.jacobian(robot, q)
    assert all(
        map(math.isnan, (*kernel.sine_and_cosine(math.inf), *kernel.sine_and_cosine(math.nan)))
    )


def decomposed(A):
    # Rows of A as the kernel takes them: singular values, directions of the rows, turns.
    count, length = A.shape
    work, sigma = np.hstack([A, np.eye(count)]), np.empty(count)
    kernel.decompose(work, sigma)
    return sigma, work[:, :length], work[:, length:]


SHAPES = [(k, length) for k in range(1, 7) for length in (k, k + 1, 12) if length >= k]


@pytest.mark.parametrize(('count', 'length'), SHAPES)
def test_singular_values_are_those_of_numpy(count, length):
    random = np.random.default_rng(count * 100 + length)
    for _ in range(20):
        A = random.normal(size=(count, length)) * 10.0 ** random.uniform(-3, 3)
        sigma, rows, turns = decomposed(A)
        expected = np.linalg.svd(A, compute_uv=False)
        np.testing.assert_allclose(sigma, expected, rtol=0, atol=1e-13 * expected[0])
        # turns @ A = diag(sigma) rows, with orthonormal rows and orthogonal turns.
        np.testing.assert_allclose(
            turns.T @ np.diag(sigma) @ rows, A, rtol=0, atol=1e-14 * expected[0] * length
        )
        np.testing.assert_allclose(rows @ rows.T, np.eye(count), rtol=0, atol=ROUND_OFF)
        np.testing.assert_allclose(turns @ turns.T, np.eye(count), rtol=0, atol=ROUND_OFF)


def test_small_singular_values_of_graded_matrices_keep_their_digits():
    # Rows of lengths 1 to 1e-15: numpy keeps the largest's round-off, one-sided Jacobi each own.
    random = np.random.default_rng(1)
    for _ in range(10):
        A = 10.0 ** -np.arange(0.0, 18.0, 3.0)[:, None] * random.normal(size=(6, 6))
        with mpmath.workdps(60):
            exact = mpmath.svd_r(mpmath.matrix(A.tolist()), compute_uv=False)
        sigma = decomposed(A)[0]
        np.testing.assert_allclose(sigma, [float(value) for value in exact], rtol=1e-12)


@pytest.mark.parametrize('rank', range(6))
@pytest.mark.parametrize('length', [6, 9])
def test_directions_are_orthonormal_at_rank_loss(rank, length):
    random = np.random.default_rng(rank)
    for trial in range(10):
        A = random.normal(size=(6, rank)) @ random.normal(size=(rank, length))
        if trial % 2:  # exactly, not to round-off
            A = np.zeros((6, length))
            A[:rank, :rank] = np.diag(random.uniform(1, 2, rank))
        sigma, rows, turns = decomposed(A)
        assert np.all(sigma[rank:] <= kernel.RANK_TOLERANCE * sigma[0])
        np.testing.assert_allclose(rows @ rows.T, np.eye(6), rtol=0, atol=ROUND_OFF)
        np.testing.assert_allclose(turns @ turns.T, np.eye(6), rtol=0, atol=ROUND_OFF)


def test_equal_and_parallel_rows_are_decomposed_too():
    for A in (np.eye(6), np.ones((4, 4)), np.full((2, 5), 1e-30), np.diag([1.0, 1.0, 1e-9])):
        sigma, rows, turns = decomposed(A)
        np.testing.assert_allclose(
            sigma, np.linalg.svd(A, compute_uv=False), rtol=0, atol=1e-14 * max(sigma)
        )
        np.testing.assert_allclose(rows @ rows.T, np.eye(len(A)), rtol=0, atol=ROUND_OFF)


@pytest.mark.parametrize('size', range(1, 7))
def test_determinant(size):
    random = np.random.default_rng(size)
    for _ in range(20):
        A = random.normal(size=(size, size))
        assert kernel.determinant_of(A.copy()) == pytest.approx(np.linalg.det(A), rel=1e-12)
        whole = random.integers(-5, 6, (size, size))
        exact = exact_determinant(whole.tolist())
        found = kernel.determinant_of(whole.astype(float))
        assert found == pytest.approx(float(exact), rel=1e-13, abs=1e-11)


def exact_determinant(rows):
    if not rows:
        return Fraction(1)
    total = Fraction(0)
    for k, first in enumerate(rows[0]):
        minor = [row[:k] + row[k + 1 :] for row in rows[1:]]
        total += (-1) ** k * first * exact_determinant(minor)
    return total


def test_determinant_of_exactly_dependent_rows_is_zero():
    A = np.arange(9.0).reshape(3, 3)
    A[2] = 0.0
    assert kernel.determinant_of(A) == 0.0
    assert kernel.determinant_of(np.zeros((1, 1))) == 0.0


def rotations(axes, angles):
    # Rodrigues: R = I + sin(angle) K + (1 - cos(angle)) K^2.
    K = np.zeros((len(axes), 3, 3))
    for k, (x, y, z) in enumerate(axes):
        K[k] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    s, c = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.eye(3) + s * K + (1 - c) * (K @ K)


def test_quaternions_are_axis_and_half_angle():
    random = np.random.default_rng(2)
    axes = random.normal(size=(3000, 3))
    axes[:30] = np.repeat(np.eye(3), 10, axis=0)
    axes[30:60] = np.repeat([[1, 1, 0], [0, 1, 1], [1, 1, 1]], 10, axis=0)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angle = random.uniform(-math.pi, math.pi, 3000)
    # Where the textbook formula by the trace loses its digits: half a turn, and none.
    angle[:1500:3] = math.pi - 10.0 ** random.uniform(-12, -1, 500)
    angle[1:1500:3] = 10.0 ** random.uniform(-12, -1, 500)
    poses = np.zeros((3000, 4, 4))
    poses[:, :3, :3] = rotations(axes, angle)
    poses[:, 3, 3] = 1.0
    found = np.empty((3000, 4))
    kernel.quaternions(poses, found)
    expected = np.concatenate([axes * np.sin(angle / 2)[:, None], np.cos(angle / 2)[:, None]], 1)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, rtol=0, atol=1e-15)
    assert np.all(found[:, 3] >= 0.0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


def test_quaternion_of_half_turns_and_identity():
    poses = np.array([np.eye(4), np.diag([1.0, -1, -1, 1]), np.diag([-1.0, 1, -1, 1])])
    found = np.empty((3, 4))
    kernel.quaternions(poses, found)
    assert np.array_equal(found, [[0, 0, 0, 1], [1, 0, 0, 0], [0, 1, 0, 0]])


@pytest.mark.parametrize('name', ['panda', 'craig_3r', 'offset_stanford_shape'])
def test_the_pose_and_its_quaternion_are_one_rotation(name):
    robot = robot_of(name)
    q = np.random.default_rng(3).uniform(-math.pi, math.pi, (200, robot.dof))
    state = ks.evaluate(robot, q)
    x, y, z, w = state.quaternion_xyzw.T
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    np.testing.assert_allclose(
        np.moveaxis(R, -1, 0), state.pose[:, :3, :3], rtol=0, atol=ROUND_OFF
    )


def test_positions_may_be_handed_over_in_any_form():
    robot = robot_of('panda')
    q = np.full(7, 0.3)
    still = q.copy()
    still.setflags(write=False)
    forms = (
        q.tolist(),
        tuple(q),
        still,
        q.astype('>f8'),
        np.full((5, 7), 0.3, order='F'),
        np.full((7, 5), 0.3).T,
        np.full((10, 7), 0.3)[::2],
        np.full((5, 14), 0.3)[:, ::2],
        np.broadcast_to(q, (5, 7)),
        np.full((2, 3, 7), 0.3),
        np.zeros((0, 7)),
        np.full(8, 0.3)[1:],
        np.frombuffer(b'\0' + q.tobytes(), dtype='f8', offset=1),
    )
    frames, measured = ks.link_frames(robot, q), ks.singularity(robot, q, q)
    for form in forms:
        for found in (
            ks.link_frames(robot, form),
            ks.evaluate(robot, q, form, depth=2).link_frames,
        ):
            assert np.array_equal(found, np.broadcast_to(frames, found.shape))
        for found in (ks.singularity(robot, form, q), ks.singularity(robot, q, form)):
            distance = np.asarray(found.distance)
            assert np.array_equal(distance, np.full(distance.shape, measured.distance))


@pytest.mark.parametrize(
    'wrong',
    [
        [0.0] * 6,
        None,
        np.zeros(6, dtype=np.float32),
        np.zeros(6, dtype='>f8'),
        np.zeros(12)[::2],
        np.frombuffer(bytes(49), dtype='f8', offset=1),
    ],
    ids=['list', 'None', 'float32', 'big endian', 'strided', 'not aligned'],
)
def test_the_kernel_refuses_arrays_it_cannot_read(wrong):
    robot = robot_of('ur5e')
    row = np.empty(robot.chain.single_widths[kernel.JACOBIAN])
    with pytest.raises(TypeError):
        kernel.evaluate_one(robot.chain, wrong, np.zeros(6), row)
    with pytest.raises(TypeError, match='shorter than'):
        kernel.evaluate_one(robot.chain, np.zeros(6), np.zeros(6), np.empty(20))
    row.setflags(write=False)
    with pytest.raises(TypeError, match='array of float64'):
        kernel.evaluate_one(robot.chain, np.zeros(6), np.zeros(6), row)


def test_the_kernel_refuses_what_is_no_arm():
    chain, arm = robot_of('ur5e').chain, robot_of('ur5e').singularity.arm
    row = np.empty(chain.single_widths[kernel.JACOBIAN])
    with pytest.raises(TypeError, match='not None'):
        kernel.evaluate_one(None, np.zeros(6), np.zeros(6), row)
    with pytest.raises(TypeError, match='not None'):
        kernel.evaluate(None, np.zeros((1, 6)), np.zeros((1, 6)), kernel.POSE, row[None])
    other = robot_of('craig_3r').singularity.arm
    for task, tape in ((arm.task, other.tape), (other.task, arm.tape)):
        with pytest.raises(TypeError, match='do not go together'):
            kernel.Arm(other.chain, task, tape, False, kernel.DISTANCE, 0.1, 0.0)


@pytest.mark.parametrize(
    'wrong',
    [
        {'joint': np.array([0, 1, 2, 3, 4, 6])},
        {'joint': np.arange(5)},
        {'first_entry': np.array([0, 1, 2, 3, 5, 4, 6])},
        {'first_entry': np.arange(6)},
        {'frame_parent': np.array([-1, 0, 1, 2, 3, 4, 6])},
        {'by_d': np.zeros(5)},
        {'before': np.zeros((7, 3, 4), dtype=np.float32)},
    ],
    ids=lambda wrong: next(iter(wrong)),
)
def test_a_chain_whose_arrays_do_not_go_together_is_refused(wrong):
    table = robot_of('ur5e').chain.table
    assert table.joint.tolist() == list(range(6))
    with pytest.raises(TypeError):
        kernel.Chain(table._replace(**wrong))


def test_a_tape_whose_steps_need_later_ones_is_refused():
    factors = robot_of('ur5e').singularity.factors
    late = factors.operations.copy()
    late[-1, 1] = len(late)
    with pytest.raises(TypeError, match='do not go together'):
        kernel.Tape(late, factors.constants, factors.ends)
    with pytest.raises(TypeError, match='do not go together'):
        kernel.evaluate_factors(factors.tape, np.zeros((1, 2)), np.zeros((1, 9, 9)))


@pytest.mark.slow
def test_what_the_kernel_reads_of_an_arm_is_kept():
    task = robot_of('ur5e').singularity.task
    axes = task.axes.copy()
    rows = kernel.TaskRows(
        task.generic_rank, axes, task.rotation, task.row_scales, task.column_scales
    )
    kept = weakref.ref(axes)
    del axes
    gc.collect()
    assert kept() is not None
    del rows
    gc.collect()
    assert kept() is None


@pytest.mark.slow
@compiled_only
def test_nothing_grows_over_thirty_thousand_calls():
    robot = robot_of('ur3e')
    q = np.random.default_rng(4).uniform(-math.pi, math.pi, (100, 6))

    def call(times):
        for k in range(times):
            state = ks.evaluate(robot, q[k % 100], q[k % 100])
            if k % 10 == 0:
                ks.singularity(robot, q[k % 100])
            del state

    def resident_kib():
        pages = int(Path('/proc/self/statm').read_text().split()[1])
        return pages * os.sysconf('SC_PAGE_SIZE') / 1024

    if not Path('/proc/self/statm').exists():
        pytest.skip('reads the resident memory from /proc')
    call(5_000)
    before = resident_kib()
    call(30_000)
    # One leaked row of results a call would be 18 MiB, one a search 1.5 MiB.
    assert resident_kib() - before < 1024


# An arm with a closed form and factors, a redundant one that is searched, and one with a loop; by
# itself the tour visits all.
VISITED = ('puma560', 'panda', 'crank_slider')


def toured(environment):
    done = subprocess.run(
        [sys.executable, str(TESTS / 'kernel_tour.py'), *VISITED],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.slow
@compiled_only
def test_the_compiled_kernel_gives_the_numbers_of_its_source_to_the_last_bit():
    compiled, plain = toured({}), toured({VARIABLE: '1'})
    assert compiled == plain
    called = {line.split()[1] for line in compiled}
    assert called == functions()


# Every form of a chain. Plain Python takes seconds for each: square and wide tasks of six and of
# seven joints are among those of the tour.
UNCOMPILED = ('parallelogram_left', 'rrp_elementary')


def stored_numbers(names):
    lines = (TESTS / 'kernel_numbers.txt').read_text().splitlines()
    return [line for line in lines if line.split()[0] in names]


def test_the_numbers_are_those_of_every_other_machine():
    names = sorted(BUNDLED)
    with np.errstate(all='ignore'):
        assert list(kernel_numbers.lines(names)) == stored_numbers(names)


@pytest.mark.slow
@compiled_only
def test_the_numbers_of_every_machine_are_those_of_the_source():
    done = subprocess.run(
        [sys.executable, str(TESTS / 'kernel_numbers.py'), *UNCOMPILED],
        env={**os.environ, VARIABLE: '1'},
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == stored_numbers(UNCOMPILED)


def singular_poses(robot):
    # Random ones, and singular ones in the midst of them.
    q = np.random.default_rng(5).uniform(-4, 4, (3 * kernel.LANES + 5, robot.dof))
    q[3] = q[kernel.LANES :: 5] = 0.0
    q[kernel.LANES + 3] = np.pi / 2
    q[2 * kernel.LANES + 1] = 2.0 * kernel.LARGEST_REDUCED
    return q


@pytest.mark.parametrize('name', ['ur5e', 'panda', 'scara_hsr065', 'parallelogram_left'])
def test_measures_of_a_batch_are_those_of_its_poses_one_by_one_to_the_last_bit(name):
    robot = ks.load_robot(name)
    q = singular_poses(robot)
    rows = ks.evaluate(robot, q).row
    together, singly = np.empty((2, len(q), robot.singularity.measure_places.width))
    with np.errstate(all='ignore'):
        kernel.measure(robot.singularity.arm, rows, q, together)
        for k in range(len(q)):
            kernel.measure(robot.singularity.arm, rows[k : k + 1], q[k : k + 1], singly[k : k + 1])
    for k in range(len(q)):
        assert together[k].tobytes() == singly[k].tobytes(), k


def test_measures_of_a_huge_arm_are_those_of_its_poses_one_by_one_too():
    # Fourth powers of its lengths are not finite.
    robot = ks.load_robot('ur5e')
    q = singular_poses(robot)
    rows = ks.evaluate(robot, q).row * 1e90
    together, singly = np.empty((2, len(q), robot.singularity.measure_places.width))
    with np.errstate(all='ignore'):
        kernel.measure(robot.singularity.arm, rows, q, together)
        for k in range(len(q)):
            kernel.measure(robot.singularity.arm, rows[k : k + 1], q[k : k + 1], singly[k : k + 1])
    assert together.tobytes() == singly.tobytes()


def test_a_batch_gives_the_numbers_of_its_poses_one_by_one_to_the_last_bit():
    random = np.random.default_rng(3)
    for name in ('ur5e', 'scara_hsr065', 'craig_3r'):
        robot = ks.load_robot(name)
        # Two blocks side by side and a rest; then a huge angle, for which a block is left.
        q = random.uniform(-9, 9, (2 * kernel.LANES + 3, robot.dof))
        q[kernel.LANES + 1, 0] = 2.0 * kernel.LARGEST_REDUCED
        qdot = random.normal(size=q.shape)
        for rates in (qdot, qdot[:1]):
            batch = ks.evaluate(robot, q, np.broadcast_to(rates, q.shape))
            for k, row in enumerate(batch.row):
                one = ks.evaluate(robot, q[k], np.broadcast_to(rates, q.shape)[k])
                width = robot.chain.widths[kernel.JACOBIAN]
                assert row[:width].tobytes() == one.row[:width].tobytes()


@pytest.mark.parametrize('at', [0, kernel.LANES - 1, kernel.LANES + 5, 2 * kernel.LANES + 1])
def test_a_batch_stops_at_its_first_number_that_is_not_finite(at):
    chain = ks.load_robot('ur5e').chain
    q = np.full((2 * kernel.LANES + 3, 6), 0.3)
    q[at:, 2] = np.nan
    rows = np.zeros((len(q), chain.widths[kernel.JACOBIAN]))
    rest = np.zeros((1, 6))
    assert kernel.evaluate(chain, q, rest, kernel.JACOBIAN, rows) == at
    assert (rows[:at] == rows[0]).all() or at == 0


# Factors that cannot be computed, whose derivatives overflow, and a pose of angles that do.
NOT_COMPUTABLE = """
import numpy as np
import kinematics_service as ks
from kinematics_service import kernel

C, J, D = kernel.CONSTANT, kernel.JOINT, kernel.DIFFERENCE
steps = [(J, 0, 0), (C, 0, 0), (D, 0, 1), (D, 0, 0), (kernel.SQUARE_ROOT, 2, 0)]
steps += [(kernel.QUOTIENT, 1, 3), (kernel.QUOTIENT, 1, 0), (kernel.PRODUCT, 6, 6)]
constants = np.array([1.0, 9.0] + [1.0] * 6)
tape = kernel.Tape(np.array(steps).ravel(), constants, np.arange(4, 8))
found = np.zeros((1, 4, 2))
kernel.evaluate_factors(tape, np.array([[1e-300]]), found)
print(found.tolist())
try:
    ks.jacobian(ks.load_robot('parallelogram_left'), [0.0, 1.7e308, -1.7e308])
except ks.JointVectorError:
    print('refused')
"""


@pytest.mark.slow
@pytest.mark.parametrize('environment', [{}, {VARIABLE: '1'}], ids=['as it is', 'uncompiled'])
def test_what_cannot_be_computed_is_no_number_and_raises_nothing(environment):
    done = subprocess.run(
        [sys.executable, '-W', 'error', '-c', NOT_COMPUTABLE],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    values, refused = done.stdout.splitlines()
    # sqrt(1e-300 - 9), 9 / 0, 9 / 1e-300 whose slope overflows, and its square, which does too.
    assert values == '[[[nan, nan], [nan, nan], [9e+300, -inf], [inf, -inf]]]'
    assert refused == 'refused'


@compiled_only
def test_the_compiled_kernel_is_that_of_the_source_beside_it():
    assert kernel.notice() == ''


def test_an_uncompiled_kernel_is_said(monkeypatch):
    monkeypatch.setenv(VARIABLE, '1')
    assert 'runs as plain Python' in kernel.notice()


ENUMERATOR = re.compile(r'^    ([A-Z][A-Z_0-9]*)(?: = (\S+))?$', re.MULTILINE)
DEFINED = re.compile(r'#define KINEMATICS_([A-Z_]+) ([-0-9.e]+)$', re.MULTILINE)


def test_places_and_constants_are_the_same_to_the_compiler(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / 'packaging'))
    types = pytest.importorskip('kernel_types', reason='there is no setup.py beside the tests')
    folder = PACKAGE / 'kernel'
    text = types.included_numbers(folder / 'layout' / 'places.py')
    values, last = {}, -1
    for name, value in ENUMERATOR.findall(text):
        last = int(value, 0) if value else last + 1
        values[name] = last
    values |= {name: float(value) for name, value in DEFINED.findall(text)}
    own = {name for name in vars(places) if name.isupper()}
    assert own - values.keys() == {'NAN', 'INFINITY'}
    for name, value in values.items():
        assert getattr(places, name) == value, name
