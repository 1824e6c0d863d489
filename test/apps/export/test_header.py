# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The headers of `export --cpp` and `--c` give the kernel's results, bit for bit."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest
from arms import DISTINCT_BUNDLED, robot_of

import kinematics_service as ks
from kinematics_service.__main__ import main

WARNINGS = ('-Wall', '-Wextra', '-Wconversion', '-Wpedantic', '-Werror')
COMPILERS = {
    'g++': ('--cpp', '-std=c++17'),
    'clang++': ('--cpp', '-std=c++17'),
    'gcc': ('--c', '-std=c99'),
    'clang': ('--c', '-std=c99'),
}
BATCH = """
#include "arm.h"
{using}
{head}void batch(const double *q, int count, double *T, double *J)
{{
    for (int k = 0; k < count; ++k) {{
        {name}jacobian(q + k * {name}dof, T + 12 * k, J + 6 * {name}dof * k);
    }}
}}
"""
OPEN = [name for name in DISTINCT_BUNDLED if not robot_of(name).chain.loops]


def bits(numbers):
    return np.ascontiguousarray(numbers, dtype=float).view(np.int64)


def compiled(folder, robot, compiler):
    """Return the library of a header, compiled without a warning; skip without the compiler."""
    if not shutil.which(compiler):
        pytest.skip(f'{compiler} is not installed')
    option, standard = COMPILERS[compiler]
    assert main(['export', robot, option, str(folder / 'arm.h')]) == 0
    space = f'kinematics_{ks.load_robot(robot).name}'
    cpp = option == '--cpp'
    program = BATCH.format(
        using=f'using namespace {space};' if cpp else '',
        head='extern "C" ' if cpp else '',
        name='' if cpp else f'{space}_',
    )
    source = folder / f'batch.{"cpp" if cpp else "c"}'
    source.write_text(program)
    library = folder / 'batch.so'
    flags = [standard, '-O2', '-ffp-contract=off', '-shared', '-fPIC', *WARNINGS]
    command = [compiler, *flags, str(source), '-o', str(library), '-lm']
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return ctypes.CDLL(str(library))


def pointer(numbers):
    return numbers.ctypes.data_as(ctypes.c_void_p)


def positions(robot, count):
    """Return positions in all turns, with zeros, -0.0, quarter turns, denormals and huge ones."""
    q = np.random.default_rng(7).uniform(-7, 7, (count, robot.dof))
    q[:5], q[5:10] = 0.0, -0.0
    q[10:60] = np.round(q[10:60]) * (np.pi / 2)
    q[60:80] *= 1e-310
    q[80:150] *= 1e5
    q[150:160] *= 1e13
    return q


@pytest.mark.parametrize('compiler', COMPILERS)
@pytest.mark.parametrize('name', OPEN)
def test_pose_and_jacobian_have_the_bits_of_the_kernel(tmp_path, name, compiler):
    library, robot = compiled(tmp_path, name, compiler), ks.load_robot(name)
    q = positions(robot, 1000)
    T, J = np.zeros((1000, 3, 4)), np.zeros((1000, 6, robot.dof))
    library.batch(pointer(q), len(q), pointer(T), pointer(J))
    assert np.array_equal(bits(T), bits(ks.forward_kinematics(robot, q)[:, :3]))
    assert np.array_equal(bits(J), bits(ks.jacobian(robot, q)))
