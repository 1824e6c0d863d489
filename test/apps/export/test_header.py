# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The headers of `export --cpp` and `--c` give the kernel's results, bit for bit."""

import contextlib
import ctypes
import functools
import io
import re
import shutil
import subprocess
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from arms import DISTINCT, DISTINCT_BUNDLED, arm_of
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.export.header import header_of
from kinematics_service.robot.task import generic_poses

pytestmark = pytest.mark.slow  # compiles C++

WARNINGS = ('-Wall', '-Wextra', '-Wconversion', '-Wpedantic', '-Werror')
COMPILERS = {
    'g++': ('--cpp', '-std=c++17'),
    'clang++': ('--cpp', '-std=c++17'),
    'gcc': ('--c', '-std=c99'),
    'clang': ('--c', '-std=c99'),
}
# Calls each function of an arm's header at many positions.
BATCH = """
#include "{name}.h"
{head}void batch_{name}(const {real} *q, const {real} *qdot, int count, {real} *T, {real} *J,
    {real} *V, {real} *F, {real} *values, {real} *J_tool, {real} *measures)
{{
    for (int k = 0; k < count; ++k) {{
        {real} P[12], unequal = 0;
        {arm}jacobian{of}(q, T, J);
        {arm}pose{of}(q, P);
        for (int i = 0; i < 12; ++i) {{
            unequal += P[i] != T[i] && P[i] == P[i];
        }}
        {arm}twist(q, qdot, P, V);
        for (int i = 0; i < 12; ++i) {{
            unequal += P[i] != T[i] && P[i] == P[i] && !{at_point};
        }}
        {arm}frames(q, F);
        {factors};
        {arm}in_axes_of(T, J, J_tool);
        measures[0] = ({real}){arm}manipulability(J);
        measures[1] = ({real}){arm}smallest_singular_value(J);
        measures[2] = unequal + ({real}){arm}self_test();
        q += {arm}dof, qdot += {arm}dof, T += 12, J += 6 * {arm}dof, V += 6;
        F += 12 * {arm}frame_count, values += {arm}factor_count, J_tool += 6 * {arm}dof;
        measures += 3;
    }}
}}
"""


class Arm(NamedTuple):
    """An arm, its header, and the compiled function that calls the functions of the header."""

    robot: ks.Robot
    header: str
    batch: object


def bits(numbers):
    return np.ascontiguousarray(numbers, dtype=float).view(np.int64)


@functools.cache
def header(file, *options):
    """Return the header of a robot, as the command writes it."""
    with contextlib.redirect_stdout(io.StringIO()) as written:
        assert main(['export', str(file), options[0], '-', *options[1:]]) == 0
    return written.getvalue()


@pytest.fixture(scope='module')
def arms(tmp_path_factory):
    """Return a function that compiles the headers of several arms as one library."""

    @functools.cache
    def compiled(files, compiler, level='-O2', *others, of=''):
        if not shutil.which(compiler):
            pytest.skip(f'{compiler} is not installed')
        folder, (option, standard) = tmp_path_factory.mktemp('header'), COMPILERS[compiler]
        cpp = option == '--cpp'
        source, found = folder / f'batch.{"cpp" if cpp else "c"}', {}
        for file in files:
            robot, text = ks.load_robot(file), header(file, option, *others)
            (folder / f'{robot.name}.h').write_text(text)
            arm = f'kinematics_{robot.name}{"::" if cpp else "_"}'
            given = {'name': robot.name, 'arm': arm, 'of': of, 'at_point': int(bool(of))}
            given['head'] = 'extern "C" ' if cpp else ''
            given['real'] = 'float' if others else 'double'
            has_factors = len(robot.singularity.factors.ends) > 0
            given['factors'] = f'{arm}factors(q, values)' if has_factors else '(void)values'
            with source.open('a') as program:
                program.write(BATCH.format(**given))
            found[file] = robot, text
        library = source.with_suffix('.so')
        flags = [standard, level, '-march=native', '-shared', '-fPIC', *WARNINGS]
        command = [compiler, *flags, str(source), '-o', str(library), '-lm']
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        loaded = ctypes.CDLL(str(library))
        return {
            file: Arm(robot, text, getattr(loaded, f'batch_{robot.name}'))
            for file, (robot, text) in found.items()
        }

    return compiled


def results(arm, q, qdot, kind=np.float64):
    """Return all results of a header at some positions."""
    robot, (count, n) = arm.robot, q.shape
    shapes = {
        'pose': (3, 4),
        'jacobian': (6, n),
        'twist': (6,),
        'frames': (robot.chain.frames, 3, 4),
        'factors': (len(robot.singularity.factors.ends),),
        'tool_jacobian': (6, n),
        'measures': (3,),
    }
    found = {name: np.zeros((count, *shape), kind) for name, shape in shapes.items()}
    arrays = [one.ctypes.data_as(ctypes.c_void_p) for one in (q, qdot, *found.values())]
    arm.batch(*arrays[:2], count, *arrays[2:])
    return found


def inside(robot, count):
    """Return positions inside the limits at which closed loops close."""
    return generic_poses(robot.chain, robot.limits, robot.prismatic)[:count]


def positions(robot, count):
    """Return positions in all turns, with zeros, -0.0, quarter turns, denormals and huge ones."""
    if robot.chain.loops:
        return inside(robot, count)
    q = np.random.default_rng(7).uniform(-7, 7, (count, robot.dof))
    q[:5], q[5:10] = 0.0, -0.0
    q[10:60] = np.round(q[10:60]) * (np.pi / 2)
    q[60:80] *= 1e-310
    q[80:150] *= 1e5
    q[150:160] *= 1e13
    return q


# Six joints, seven, a prismatic joint, coupled joints, and closed loops.
OPTIMIZED = ('ur5e', 'panda', 'rrp_elementary', 'parallelogram_left', 'five_bar')
OTHERS = tuple(name for name in ks.bundled_robots() if name not in OPTIMIZED)
IN_C = ('ur5e', 'five_bar')
CASES = [
    *((name, compiler) for name in ks.bundled_robots() for compiler in ('g++', 'clang++')),
    *((name, compiler) for name in IN_C for compiler in ('gcc', 'clang')),
]


@pytest.mark.parametrize(('name', 'compiler'), CASES)
def test_the_results_have_the_bits_of_the_kernel(arms, name, compiler):
    # Without optimization a header compiles in half the time. That is enough for the arms that
    # repeat the operations of others.
    if compiler in ('gcc', 'clang'):
        arm = arms(IN_C, compiler)[name]
    elif name in OPTIMIZED:
        arm = arms(OPTIMIZED, compiler)[name]
    else:
        arm = arms(OTHERS, compiler, '-O0')[name]
    robot = arm.robot
    q = positions(robot, 1000)
    qdot = np.random.default_rng(8).uniform(-2, 2, q.shape)
    found = results(arm, q, qdot)
    measures = [ks.singularity(robot, one) for one in q[:40]]
    J = ks.jacobian(robot, q)
    wanted = {
        'pose': ks.forward_kinematics(robot, q)[:, :3],
        'jacobian': J,
        'twist': ks.twist(robot, q, qdot),
        'frames': ks.link_frames(robot, q)[:, :, :3],
        'factors': robot.singularity.factors.evaluate(q)[..., 0],
    }
    for what, numbers in wanted.items():
        assert np.array_equal(bits(found[what]), bits(numbers)), what
    kept = found['measures'][:40]
    assert np.array_equal(bits(kept[:, 0]), bits([one.manipulability for one in measures]))
    assert np.array_equal(
        bits(kept[:, 1]), bits([one.smallest_singular_value for one in measures])
    )
    assert not np.any(found['measures'][:, 2])
    near = np.abs(q).max(axis=1) < 10
    in_tool_axes = ks.jacobian(robot, q[near], axes='tool')
    assert np.abs(found['tool_jacobian'][near] - in_tool_axes).max() < ROUND_OFF


def test_arms_of_every_convention_have_the_bits(arms, tmp_path):
    files = []
    for name in (one for one in DISTINCT if '-' in one):
        files.append(tmp_path / f'{name}.yaml')
        text = re.sub(
            '(?m)^robot: .*', f'robot: arm_{name.replace("-", "_")}', arm_of(name).text()
        )
        files[-1].write_text(text)
    for arm in arms(tuple(files), 'g++', '-O0').values():
        robot = arm.robot
        q = positions(robot, 300)
        found = results(arm, q, q)
        assert np.array_equal(bits(found['pose']), bits(ks.forward_kinematics(robot, q)[:, :3]))
        assert np.array_equal(bits(found['jacobian']), bits(ks.jacobian(robot, q)))
        assert np.array_equal(bits(found['frames']), bits(ks.link_frames(robot, q)[:, :, :3]))
        assert not np.any(found['measures'][:, 2])


POINTS = """\
robot: 2_points
source: 'a path ends in \\, a question ??/'
convention: modified
base: {frame: base, xyz: [0.1, 0.2, 0.3], rpy: [0.1, 0, 1]}
tool: {frame: tool, xyz: [0.05, 0, 0.1], rpy: [0, 0.4, 0]}
joints:
  - {name: 'a "first"\\??/', variable: q1, type: revolute, limits: [-2, 2]}
  - {name: slide, variable: q2, type: prismatic, limits: [0, 1]}
  - {name: q3, type: helical, limits: [-3, 3]}
links:
  - {a: 0, alpha: 0, d: 0.3, theta: q1}
  - {a: 0.2, alpha: pi/2, d: q2, theta: 0.1}
  - {a: 0.3, alpha: 1, d: 0.02*q3, theta: q3 + 0.1*q1}
points:
  elbow: {row: 1, xyz: [0.1, 0, 0]}
  while: {row: 3, xyz: [0, 0.2, 0], rpy: [1, 0, 0]}
"""


def test_points_have_functions_of_their_own(arms, tmp_path):
    file, closed = tmp_path / 'points.yaml', tmp_path / 'closed.yaml'
    file.write_text(POINTS)
    text = ks.bundled_robots()['five_bar'].read_text()
    closed.write_text(f'{text}\npoints: {{while: {{row: 1, xyz: [0.1, 0.2, 0]}}}}\n')
    for arm in arms((file, closed), 'g++', of='_of_while').values():
        robot = arm.robot
        q = positions(robot, 200)
        found = results(arm, q, q)
        T, J = (
            ks.forward_kinematics(robot, q, of='while')[:, :3],
            ks.jacobian(robot, q, of='while'),
        )
        assert np.array_equal(bits(found['pose']), bits(T))
        assert np.array_equal(bits(found['jacobian']), bits(J))
        assert not np.any(found['measures'][:, 2])
        assert ('void jacobian_of_elbow(' in arm.header) == (robot.name == '2_points')


FACTORS = """\
robot: two_joints_{k}
convention: standard
joints: [{name: q1, type: revolute}, {name: q2, type: revolute}]
links: [{a: 1, alpha: 0, d: 0, theta: q1}, {a: 1, alpha: 0, d: 0, theta: q2}]
singularity:
  factors:
    - {name: plain, expression: sin(q2)}
    - {name: other, expression: "{text}"}
"""


def test_factors_may_have_every_operation(arms, tmp_path):
    texts = (
        'sin(sin(q2))*(2 + cos(cos(q1)))',
        'sin(q2)/(2 + cos(q1))',
        'sin(q2)*sqrt(2 + cos(q1))',
        'atan2(sin(q2), 3 + cos(q1))',
    )
    files = [tmp_path / f'{k}.yaml' for k in range(len(texts))]
    for k, (file, text) in enumerate(zip(files, texts)):
        file.write_text(FACTORS.replace('{text}', text).replace('{k}', str(k)))
    for arm in arms(tuple(files), 'g++').values():
        q = positions(arm.robot, 200)
        found = results(arm, q, q)['factors']
        assert np.array_equal(bits(found), bits(arm.robot.singularity.factors.evaluate(q)[..., 0]))


@pytest.mark.parametrize('name', ['rrp_elementary', 'parallelogram_left', 'five_bar'])
def test_results_are_nan_if_a_position_is_not_finite(arms, name):
    arm = arms(OPTIMIZED, 'g++')[name]
    robot = arm.robot
    q = np.zeros((3 * robot.dof, robot.dof))
    for k, row in enumerate(q):
        row[k % robot.dof] = (np.nan, np.inf, -np.inf)[k // robot.dof]
    found = results(arm, q, np.zeros_like(q))
    assert all(np.all(np.isnan(found[what])) for what in ('pose', 'jacobian', 'frames', 'twist'))


@pytest.mark.parametrize(
    ('name', 'compiler'),
    [*((name, 'g++') for name in DISTINCT_BUNDLED), ('puma560', 'gcc')],
)
def test_float_has_the_error_that_it_states(arms, name, compiler):
    names = DISTINCT_BUNDLED if compiler == 'g++' else (name,)
    arm = arms(names, compiler, '-O2', '--float')[name]
    robot = arm.robot
    q = inside(robot, 1000).astype(np.float32)
    found = results(arm, q, q, np.float32)
    stated = re.search(r'by at most (\S+) in T and\n// (\S+) in J', arm.header)
    T, J = ks.forward_kinematics(robot, q)[:, :3], ks.jacobian(robot, q)
    for what, exact, bound in (('pose', T, stated[1]), ('jacobian', J, stated[2])):
        error = np.abs(found[what] - exact).max()
        assert float(bound) / 8 < error <= float(bound)
    assert not np.any(found['measures'][:, 2])


def test_what_has_no_header_is_refused_in_a_sentence(tmp_path, capsys):
    file, header = tmp_path / 'points.yaml', tmp_path / 'arm.h'
    file.write_text(POINTS)
    refused = {
        ('five_bar', '--c', str(header), '--float'): 'closed loops',
        ('ur5e', '--urdf', str(header), '--float'): '--float is for --cpp and --c',
        ('ur5e', '--cpp', str(header), '--c', str(header)): 'give one of --urdf',
        (str(file), '--cpp', str(file)): 'is the robot file itself',
    }
    for arguments, words in refused.items():
        assert main(['export', *arguments]) in (1, 2)
        said = ' '.join(capsys.readouterr().err.split())
        assert words in said
        assert 'Traceback' not in said
    assert not header.exists()


def test_points_whose_functions_would_have_one_name_are_refused():
    robot = ks.robot_from_text(POINTS)
    points = [
        replace(point, name=name) for point, name in zip(robot.description.points, ('a/b', 'a_b'))
    ]
    robot = replace(robot, description=replace(robot.description, points=tuple(points)))
    with pytest.raises(ks.KinematicsError, match='names of points must differ'):
        header_of(robot, cpp=True)


ARM64 = ('aarch64-linux-gnu-g++', 'qemu-aarch64-static')


def test_another_processor_gives_the_same_numbers(tmp_path):
    for tool in ARM64:
        if not shutil.which(tool):
            pytest.skip(f'{tool} is not installed')
    source, built = tmp_path / 'main.cpp', tmp_path / 'main'
    names = ('ur5e', 'rrp_elementary', 'parallelogram_left', 'five_bar')
    for name in names:
        (tmp_path / f'{name}.h').write_text(header(name, '--cpp'))
    included = '\n'.join(f'#include "{name}.h"' for name in names)
    wrong = ' + '.join(f'kinematics_{name}::self_test()' for name in names)
    source.write_text(f'{included}\nint main() {{ return {wrong}; }}\n')
    command = [ARM64[0], '-std=c++17', '-O3', '-static', str(source), '-o', str(built)]
    subprocess.run(command, check=True)
    assert subprocess.run([ARM64[1], str(built)]).returncode == 0
