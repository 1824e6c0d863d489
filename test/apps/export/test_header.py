# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The headers of `export --cpp` and `--c` give the kernel's results, bit for bit."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest
from arms import DISTINCT_MACHINES
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.robot.task import generic_poses

WARNINGS = ('-Wall', '-Wextra', '-Wconversion', '-Wpedantic', '-Werror')
COMPILERS = {
    'g++': ('--cpp', '-std=c++17'),
    'clang++': ('--cpp', '-std=c++17'),
    'gcc': ('--c', '-std=c99'),
    'clang': ('--c', '-std=c99'),
}
# Calls each function of a header at many positions.
BATCH = """
#include "arm.h"
{using}
#if FACTORS == 0
#define ARM_factors(q, values) (void)(values)
#else
#define ARM_factors(q, values) ARM(factors)(q, values)
#endif
{head}void batch(const double *q, const double *qdot, int count, double *T, double *J, double *V,
    double *F, double *values, double *J_tool, double *measures)
{{
    for (int k = 0; k < count; ++k) {{
        double P[12], unequal = 0;
        ARM(jacobian)(q, T, J);
        ARM(pose)(q, P);
        for (int i = 0; i < 12; ++i) {{
            unequal += P[i] != T[i] && P[i] == P[i];
        }}
        ARM(twist)(q, qdot, P, V);
        for (int i = 0; i < 12; ++i) {{
            unequal += P[i] != T[i] && P[i] == P[i];
        }}
        ARM(frames)(q, F);
        ARM_factors(q, values);
        ARM(in_axes_of)(T, J, J_tool);
        measures[0] = ARM(manipulability)(J);
        measures[1] = ARM(smallest_singular_value)(J);
        measures[2] = unequal + ARM(self_test)();
        q += ARM(dof), qdot += ARM(dof), T += 12, J += 6 * ARM(dof), V += 6;
        F += 12 * ARM(frame_count), values += ARM(factor_count), J_tool += 6 * ARM(dof);
        measures += 3;
    }}
}}
"""


def bits(numbers):
    return np.ascontiguousarray(numbers, dtype=float).view(np.int64)


def program(folder, file, option):
    """Write the header of a robot and a program with it, and return robot and program."""
    header = folder / 'arm.h'
    assert main(['export', str(file), option, str(header)]) == 0
    robot, cpp = ks.load_robot(file), option == '--cpp'
    space = f'kinematics_{robot.name}'
    text = BATCH.format(
        using=f'using namespace {space};' if cpp else '', head='extern "C" ' if cpp else ''
    )
    source = folder / f'batch.{"cpp" if cpp else "c"}'
    count = len(robot.singularity.factors.ends)
    name = 'name' if cpp else f'{space}_##name'
    source.write_text(f'#define ARM(name) {name}\n#define FACTORS {count}\n{text}')
    return robot, source


def compiled(folder, file, compiler, *flags):
    """Return robot and library of a header, compiled without a warning."""
    if not shutil.which(compiler):
        pytest.skip(f'{compiler} is not installed')
    option, standard = COMPILERS[compiler]
    robot, source = program(folder, file, option)
    library = folder / 'batch.so'
    flags = [standard, '-O2', '-ffp-contract=off', '-shared', '-fPIC', *WARNINGS, *flags]
    command = [compiler, *flags, str(source), '-o', str(library), '-lm']
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return robot, ctypes.CDLL(str(library))


def results(robot, library, q, qdot):
    """Return all results of a header at some positions."""
    count, n = q.shape
    shapes = {
        'pose': (3, 4),
        'jacobian': (6, n),
        'twist': (6,),
        'frames': (robot.chain.frames, 3, 4),
        'factors': (len(robot.singularity.factors.ends),),
        'tool_jacobian': (6, n),
        'measures': (3,),
    }
    found = {name: np.zeros((count, *shape)) for name, shape in shapes.items()}
    arrays = [one.ctypes.data_as(ctypes.c_void_p) for one in (q, qdot, *found.values())]
    library.batch(*arrays[:2], count, *arrays[2:])
    return found


def positions(robot, count):
    """Return positions in all turns, with zeros, -0.0, quarter turns, denormals and huge ones."""
    if robot.chain.loops:
        return generic_poses(robot.chain, robot.limits, robot.prismatic)[:count]
    q = np.random.default_rng(7).uniform(-7, 7, (count, robot.dof))
    q[:5], q[5:10] = 0.0, -0.0
    q[10:60] = np.round(q[10:60]) * (np.pi / 2)
    q[60:80] *= 1e-310
    q[80:150] *= 1e5
    q[150:160] *= 1e13
    return q


CASES = [
    *((name, compiler) for name in ks.bundled_robots() for compiler in ('g++', 'clang++')),
    *((name, compiler) for name in DISTINCT_MACHINES for compiler in ('gcc', 'clang')),
]


@pytest.mark.parametrize(('name', 'compiler'), CASES)
def test_the_results_have_the_bits_of_the_kernel(tmp_path, name, compiler):
    robot, library = compiled(tmp_path, name, compiler)
    q = positions(robot, 1000)
    qdot = np.random.default_rng(8).uniform(-2, 2, q.shape)
    found = results(robot, library, q, qdot)
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
