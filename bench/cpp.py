# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The header of `export --cpp` beside KDL and Pinocchio, all in one process: what counts are ratios.

    python bench/cpp.py [--robot ur5e] [--site FOLDER] [--flags='-O3']

KDL is Debian's liborocos-kdl-dev: `JntToCart`, with `JntToJac` for the Jacobian. `--site` is the
site-packages folder of an environment with `pip install pin casadi`; without it Pinocchio is left
out. Its code is compiled twice: as a library (`computeJointJacobians`, `getFrameJacobian`), and as
C that CasADi generates from Pinocchio for this arm, with common subexpressions joined. All code is
compiled with the same compiler and flags. That takes 2 minutes with Pinocchio.
"""

import argparse
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np

import kinematics_service as ks
from kinematics_service.__main__ import main as run
from kinematics_service.robot.urdf.plan import plan_of

PEERS = Path(__file__).parent / 'cpp_peers'
EIGEN = '-I/usr/include/eigen3'
# What Pinocchio asks of Boost.
BOOST = ('-DBOOST_MPL_LIMIT_LIST_SIZE=30', '-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS')
ABOUT_X = np.diag([1.0, -1.0, -1.0, 1.0])  # turns z to -z


def still_poses(robot):
    """Return the constant poses between the joints, each about its z axis, and which slide."""
    plan = plan_of(robot)
    above = {joint.child: joint for joint in plan.joints}
    path, link = [], plan.tool
    while link in above:
        path.append(above[link])
        link = above[link].parent
    still, slides = [np.eye(4)], []
    for joint in reversed(path):
        still[-1] = still[-1] @ joint.origin
        if joint.type != 'fixed':
            assert not joint.mimic, f'{robot.name}: couples joints, which KDL does not'
            turned = np.eye(4) if joint.sign > 0 else ABOUT_X
            still[-1] = still[-1] @ turned
            still.append(turned)
            slides.append(joint.type == 'prismatic')
    return still, slides


def write_arm(robot, folder):
    """Write the header, and the same arm as constants for the peers."""
    still, slides = still_poses(robot)
    numbers = [', '.join(map(repr, T[:3].ravel().tolist())) for T in still]
    rows = ',\n'.join(f'{{{row}}}' for row in numbers)
    kinds = ', '.join('true' if slide else 'false' for slide in slides)
    assert run(['export', robot.name, '--cpp', str(folder / 'header.hpp')]) == 0
    (folder / 'arm_of_run.hpp').write_text(f'constexpr int joints = {len(slides)};\n')
    (folder / 'arm_of_run.cpp').write_text(
        f'#include "arm.hpp"\nconst double still[joints + 1][12] = {{{rows}}};\n'
        f'const bool slides[joints] = {{{kinds}}};\n'
    )
    (folder / 'header_of_run.hpp').write_text(
        f'#include "header.hpp"\nnamespace header = kinematics_{robot.name};\n'
    )


def versions(site):
    """Print the versions of the compiler and of the peers."""
    print(subprocess.check_output(['g++', '--version'], text=True).splitlines()[0])
    kdl = Path('/usr/include/kdl/config.h').read_text()
    print('KDL', *re.findall(r'define KDL_VERSION_STRING "(.*)"', kdl))
    for folder in sorted(site.glob('*.dist-info')) if site else ():
        if folder.name.split('-')[0] in ('pin', 'casadi'):
            print(*folder.name.removesuffix('.dist-info').split('-'))


def timed(folder, flags, site):
    """Compile and run; yield name, ns a call, and the largest difference from the header."""

    def do(*command):
        subprocess.run(list(map(str, command)), cwd=folder, check=True)

    sources = [folder / 'arm_of_run.cpp', PEERS / 'timing.cpp', PEERS / 'kdl.cpp']
    common = ['g++', '-std=c++17', f'-I{folder}', f'-I{PEERS}', EIGEN]
    links = ['-lorocos-kdl']
    if site is not None:
        prefix = site / 'cmeel.prefix'
        common += [f'-isystem{prefix / "include"}', f'-isystem{site / "casadi/include"}', *BOOST]
        libraries = [f'-L{prefix / "lib"}', f'-Wl,-rpath,{prefix / "lib"}', '-lpinocchio_default']
        casadi = [f'-L{site / "casadi"}', f'-Wl,-rpath,{site / "casadi"}', '-lcasadi']
        generator = [PEERS / 'pinocchio_code.cpp', sources[0], '-o', 'generator']
        do(*common, *generator, *libraries, *casadi)
        do('./generator')
        do('gcc', *flags, '-c', 'pinocchio_code.c')
        common.append('-DWITH_PINOCCHIO')
        sources += [PEERS / 'pinocchio.cpp', 'pinocchio_code.o']
        links += libraries
    do(*common, *flags, *sources, '-o', 'timing', *links)
    printed = subprocess.check_output(['./timing'], cwd=folder, text=True)
    for line in printed.splitlines():
        name, best, difference = line.split(';')
        yield name, float(best), float(difference)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('--robot', default='ur5e')
    parser.add_argument('--site', type=Path)
    parser.add_argument('--flags', default='-O3')
    given = parser.parse_args()
    robot = ks.load_robot(given.robot)
    flags = [*given.flags.split(), '-ffp-contract=off']
    print(f'{robot.name}, {robot.dof} joints;', *flags)
    versions(given.site)
    with tempfile.TemporaryDirectory() as name:
        write_arm(robot, Path(name))
        rows = list(timed(Path(name), flags, given.site))
    header = {name.split(': ')[1]: best for name, best, _ in rows[:2]}
    print(f'\n{"":42} {"ns":>7} {"to the header":>14} {"difference":>11}')
    for name, best, difference in rows:
        ratio = best / header[name.split(': ')[1]]
        print(f'{name:42} {best:7.0f} {ratio:14.2f} {difference:11.0e}')


if __name__ == '__main__':
    main()
