# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The package of `export --ros2-control` compiles, and its plugin gives the library's numbers."""

import ctypes
import re
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.__main__ import main

pytestmark = pytest.mark.slow  # compiles C++

STUB = Path(__file__).parent / 'plugin_stub'
EIGEN = Path('/usr/include/eigen3')
WARNINGS = ('-Wall', '-Wextra', '-Wconversion', '-Wpedantic', '-Werror')
ROUND_OFF = 1e-12  # m and rad: results that the library computes by other operations
ALPHA = 1e-4  # damping; larger than the round-off of J^T J
# A coupled arm with points on its way, one of which no joint moves.
ARM = """
robot: Coupled_arm
source: made up for this test
convention: standard
joints:
  - {name: joint_1, type: revolute, limits: [-3, 3]}
  - {name: "joint 2", type: revolute, variable: q2, limits: [-3, 3]}
  - {name: joint_3, type: prismatic, limits: [0, 1]}
  - {name: joint_4, type: revolute, limits: [-3, 3]}
links:
  - {a: 0.1, alpha: pi/2, d: 0.4, theta: joint_1}
  - {a: 0.5, alpha: 0.3, d: 0, theta: q2}
  - {a: 0.2, alpha: -pi/2, d: joint_3, theta: -q2/2}
  - {a: 0, alpha: 0, d: 0.1, theta: joint_4 - q2}
base: {frame: base_link, xyz: [0, 0, 0.2]}
tool: {frame: tool0, xyz: [0, 0, 0.1], rpy: [0.1, 0.2, 0.3]}
points:
  foot: {row: 0, xyz: [0.1, 0, 0], rpy: [0, 0, 1]}
  forearm: {row: 2, xyz: [0, 0.1, 0]}
  elbow: {row: 1}
"""
ROWS = {'base_link': 0, 'foot': 0, 'elbow': 1, 'forearm': 2, 'tool0': 4}
JOINTS_OF_ROWS = ({0}, {1}, {1, 2}, {1, 3})
Q = np.array([0.3, -0.7, 0.2, 1.1])
NAMES = ' '.join(f'"{name}"' for name in ('joint_1', 'joint 2', 'joint_3', 'joint_4'))


class Plugin:
    """A plugin that was compiled against the stub of its interface."""

    def __init__(self, library):
        self.library = library
        library.errors.restype = ctypes.c_char_p

    def initialize(self, tip, base=None, description=NAMES):
        texts = (text and text.encode() for text in (description, tip, base))
        return self.library.initialize(*texts, ctypes.c_double(ALPHA))

    def errors(self):
        return self.library.errors().decode()

    def call(self, name, q, link, shape, size=None):
        """Return the result of a call, or None where the plugin refuses its input."""
        q = np.array(q)
        result = np.zeros(shape[::-1] if name != 'pose' else shape)
        pointer = result.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
        sizes = () if size is None else (size,)
        given = q.ctypes.data_as(ctypes.c_void_p), len(q), link.encode(), *sizes, pointer
        accepted = getattr(self.library, name)(*given)
        return (result if name == 'pose' else result.T) if accepted else None

    def pose(self, q, link):
        return self.call('pose', q, link, (4, 4))

    def jacobian(self, q, link, columns=None):
        columns = len(q) if columns is None else columns
        return self.call('jacobian', q, link, (6, columns), columns)


def exported(robot, folder):
    assert main(['export', str(robot), '--ros2-control', str(folder)]) == 0
    return folder


def compiled(folder, *flags):
    if not shutil.which('g++') or not EIGEN.is_dir():
        pytest.skip('g++ or Eigen is not installed')
    library = folder / 'plugin.so'
    includes = (f'-I{folder}', f'-I{folder / "include"}', f'-I{STUB}', f'-isystem{EIGEN}')
    standard = ('-std=c++17', '-O1', '-ffp-contract=off', '-shared', '-fPIC')
    sources = (str(STUB / 'calls.cpp'), '-o', str(library))
    command = ['g++', *standard, '-DEIGEN_RUNTIME_NO_MALLOC', *flags, *WARNINGS, *includes]
    done = subprocess.run([*command, *sources], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return Plugin(ctypes.CDLL(str(library)))


@pytest.fixture(scope='module')
def arm(tmp_path_factory):
    file = tmp_path_factory.mktemp('arm') / 'arm.yaml'
    file.write_text(ARM)
    return file


@pytest.fixture(scope='module')
def package(arm):
    return exported(arm, arm.parent / 'new' / 'package')


@pytest.fixture(scope='module')
def plugin(package):
    return compiled(package, '-DINTERFACE_2')


def point_of(link):
    return {'base_link': 0, 'tool0': 'tool'}.get(link, link)


def pose_of(robot, link, q=Q):
    return np.eye(4) if link == 'base_link' else ks.forward_kinematics(robot, q, of=point_of(link))


def relative(robot, base, link):
    """Return pose and Jacobian of a link in another by numbers alone: differences of poses."""

    def pose(q):
        return np.linalg.inv(pose_of(robot, base, q)) @ pose_of(robot, link, q)

    T, h, columns = pose(Q), 1e-5, []
    for step in h * np.eye(len(Q)):
        dT = (pose(Q + step) - pose(Q - step)) / (2 * h)
        W = dT[:3, :3] @ T[:3, :3].T
        columns.append([*dT[:3, 3], W[2, 1], W[0, 2], W[1, 0]])
    return T, np.array(columns).T


@pytest.fixture(scope='module', params=['excavator'])
def bundled(request, tmp_path_factory):
    """Return a bundled arm and its plugin; excavator has closed loops."""
    package = exported(request.param, tmp_path_factory.mktemp('bundled') / 'package')
    arm, plugin = ks.load_robot(request.param), compiled(package)
    description = ' '.join(f"'{name}'" for name in arm.joint_names)
    assert plugin.initialize(arm.tool_frame, description=description), plugin.errors()
    return arm, plugin


def test_the_tool_has_the_bits_of_the_library(bundled):
    arm, plugin = bundled
    loops = arm.description.loops
    middle = np.array(loops[0].q if loops else np.zeros(arm.dof))
    for q in middle + np.random.default_rng(1).uniform(-0.1, 0.1, (20, arm.dof)):
        T, J = ks.forward_kinematics(arm, q), ks.jacobian(arm, q)
        assert np.array_equal(plugin.pose(q, arm.tool_frame), T)
        assert np.array_equal(plugin.jacobian(q, arm.tool_frame), J)


def test_a_pose_that_does_not_exist_is_refused(bundled):
    arm, plugin = bundled
    away = [np.full(arm.dof, np.nan)]
    if arm.description.loops:
        away.append(np.zeros(arm.dof))
        with pytest.raises(ks.KinematicsError, match='does not close'):
            ks.forward_kinematics(arm, away[-1])
    for q in away:
        assert plugin.pose(q, arm.tool_frame) is None
        assert plugin.jacobian(q, arm.tool_frame) is None
        assert plugin.call('joint_deltas', q, arm.tool_frame, (arm.dof,), arm.dof) is None
        errors = plugin.errors()
        assert errors.count('The joint positions are not finite, or no closed loop') == 3


@pytest.mark.parametrize('link', ROWS)
def test_each_point_is_a_link(plugin, arm, link):
    robot = ks.load_robot(arm)
    assert plugin.initialize('tool0')
    assert np.array_equal(plugin.pose(Q, link), pose_of(robot, link))
    J = ks.jacobian(robot, Q, of=point_of(link)) if ROWS[link] else np.zeros((6, 4))
    assert np.array_equal(plugin.jacobian(Q, link), J)


@pytest.mark.parametrize('base', ROWS)
@pytest.mark.parametrize('tip', ROWS)
def test_base_and_tip_select_a_part_of_the_arm(plugin, arm, base, tip):
    first, last = sorted((ROWS[base], ROWS[tip]))
    moving = sorted(set().union(*JOINTS_OF_ROWS[first:last]), reverse=ROWS[base] > ROWS[tip])
    assert plugin.initialize(tip, base), plugin.errors()
    T, J = relative(ks.load_robot(arm), base, tip)
    assert plugin.pose(Q[moving], tip) == pytest.approx(T, abs=ROUND_OFF)
    # The error of central differences with steps of 1e-5 is below 1e-9.
    assert plugin.jacobian(Q[moving], tip) == pytest.approx(J[:, moving], abs=1e-9)
    inside = {name for name in ROWS if name == base or first <= ROWS[name] <= last}
    accepted = {name for name in ROWS if plugin.pose(Q[moving], name) is not None}
    assert accepted == inside


def test_deltas_and_the_damped_inverse(plugin):
    assert plugin.initialize('tool0')
    J = plugin.jacobian(Q, 'tool0')
    inverse = np.linalg.inv(J.T @ J + ALPHA * np.eye(4)) @ J.T
    found = plugin.call('inverse', Q, 'tool0', (4, 6), 4)
    # The condition number of J^T J with this damping is below 1e5.
    assert found == pytest.approx(inverse, rel=1e-9, abs=1e-9)
    deltas = plugin.call('joint_deltas', Q, 'tool0', (4,), 4)
    assert deltas == pytest.approx(inverse @ [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], abs=1e-9)
    deltas = plugin.call('cartesian_deltas', Q, 'tool0', (6,), 4)
    assert deltas == pytest.approx(J @ [0.1, 0.2, 0.3, 0.4], abs=ROUND_OFF)


def test_frame_difference(plugin):
    half = np.sqrt(0.5)
    a, b = np.array([0, 1, 0, 0, 0, 0, 1.0]), np.array([2, 3, 0, 0, half, 0, half])
    delta = np.zeros(6)
    pointers = [one.ctypes.data_as(ctypes.c_void_p) for one in (a, b, delta)]
    call = plugin.library.frame_difference
    assert call(*pointers[:2], ctypes.c_double(0.5), pointers[2])
    assert delta == pytest.approx([4, 4, 0, 0, np.pi, 0], abs=ROUND_OFF)
    assert not call(*pointers[:2], ctypes.c_double(-0.1), pointers[2])
    assert 'must be a non-negative number' in plugin.errors()


def test_wrong_input_is_refused(plugin):
    assert plugin.initialize('tool0')
    plugin.errors()
    refused = {
        'The link hand was not found in the robot chain. Available links are: \nbase_link\ntool0'
        '\nfoot\nforearm\nelbow\n': lambda: plugin.pose(Q, 'hand'),
        'Invalid joint vector size (3). Expected size is 4.': lambda: plugin.pose(Q[:3], 'tool0'),
        'The size of the jacobian (6, 5) does not match the required size of (6, 4)': (
            lambda: plugin.jacobian(Q, 'tool0', 5)
        ),
        'The size of the jacobian (5, 6) does not match the required size of (4, 6)': (
            lambda: plugin.call('inverse', Q, 'tool0', (5, 6), 5)
        ),
        'Invalid joint vector size (5). Expected size is 4.': (
            lambda: plugin.call('joint_deltas', Q, 'tool0', (5,), 5)
        ),
        'Invalid joint vector size (2). Expected size is 4.': (
            lambda: plugin.call('cartesian_deltas', Q, 'tool0', (6,), 2)
        ),
    }
    for error, call in refused.items():
        assert call() is None
        found = plugin.errors()
        assert error in found
        assert 'Input verification failed in' in found


def test_wrong_parameters_are_refused(plugin):
    refused = {
        'Failed to find end effector name parameter [tip].': (None,),
        "failed to find chain from robot root '' to end effector ''": ('',),
        "failed to find chain from robot root 'hand' to end effector 'tool0'": ('tool0', 'hand'),
        "The robot description has no joint 'joint_3' of Coupled_arm": (
            'tool0',
            None,
            NAMES.replace('joint_3', 'joint_5'),
        ),
        'parameter robot_description not set': ('tool0', None, ''),
    }
    for error, given in refused.items():
        assert not plugin.initialize(*given)
        assert error in plugin.errors()
        assert plugin.pose(Q, 'tool0') is None
        assert 'was not initialized' in plugin.errors()


def test_the_package_names_its_plugin(package):
    plugin = ElementTree.parse(package / 'plugin.xml').getroot()
    described = ElementTree.parse(package / 'package.xml').getroot()
    name = described.findtext('name')
    assert re.fullmatch('[a-z][a-z0-9_]*', name)
    assert described.find('maintainer').get('email') == 'you@example.com'
    assert plugin.get('path') == name
    assert plugin.find('class').get('type') == f'{name}::Kinematics'
    assert f'project({name} ' in (package / 'CMakeLists.txt').read_text()
    assert 'links base_link, tool0, foot, forearm, elbow' in plugin.findtext('class/description')


def test_the_package_names_no_machine(package):
    texts = [file.read_text() for file in package.rglob('*') if file.suffix not in ('', '.so')]
    assert len(texts) == 5
    assert not [
        text
        for text in texts
        if str(package.parent) in text or '@' in text[:-1].replace('you@example.com', '')
    ]


def test_a_later_export_keeps_the_users_package_xml(arm, tmp_path):
    package = exported(arm, tmp_path / 'package')
    described, header = package / 'package.xml', package / 'CMakeLists.txt'
    text = described.read_text().replace('TODO: your name', 'Ada')
    described.write_text(text)
    header.write_text('')
    exported(arm, package)
    assert described.read_text() == text
    assert header.read_text()


def test_a_folder_of_something_else_is_refused(arm, tmp_path, capsys):
    (tmp_path / 'notes.txt').write_text('mine')
    for folder in (tmp_path, tmp_path / 'notes.txt'):
        assert main(['export', str(arm), '--ros2-control', str(folder)]) == 1
        assert 'give a new or empty folder' in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ['notes.txt']


@pytest.mark.parametrize('other', [('--float',), ('--cpp', 'arm.hpp')])
def test_options_that_do_not_go_together_are_refused(other, tmp_path, capsys):
    folder = tmp_path / 'package'
    assert main(['export', 'ur5e', '--ros2-control', str(folder), *other]) == 2
    assert other[0] in capsys.readouterr().err
    assert not folder.exists()
