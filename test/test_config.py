# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What `config/ros` gives to ROS's own tools names what the node has, and the node takes it."""

import importlib.util
import sys
import types
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml

import kinematics_service as ks

CONFIG = Path(__file__).parents[1] / 'config' / 'ros'
pytestmark = pytest.mark.skipif(not CONFIG.is_dir(), reason='the folder is not beside the tests')
PARAMETER_FILES = ('one_arm.yaml', 'two_arms.yaml')


class Recorded:
    """An action of a launch file: what it was made with."""

    def __init__(self, *words, **options):
        self.words, self.options = words, options


class Argument(Recorded):
    """The value of an argument of a launch file."""

    def perform(self, context):
        return context[self.words[0]]


@pytest.fixture
def launch_file(monkeypatch):
    """Return the launch file as a module; launch is no package of PyPI, so this stands for it."""
    for name in ('launch', 'launch.actions', 'launch.substitutions'):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    sys.modules['launch'].LaunchDescription = list
    for name in ('DeclareLaunchArgument', 'ExecuteProcess', 'OpaqueFunction'):
        setattr(sys.modules['launch.actions'], name, Recorded)
    sys.modules['launch.substitutions'].LaunchConfiguration = Argument
    spec = importlib.util.spec_from_file_location('launched', CONFIG / 'kinematics.launch.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_launch_file_declares_its_arguments_and_starts_the_node(launch_file):
    *declared, started = launch_file.generate_launch_description()
    defaults = {one.words[0]: one.options['default_value'] for one in declared}
    assert defaults['robot'] in ks.bundled_robots()
    (process,) = started.options['function'](defaults)
    assert process.options['cmd'][:3] == ['python3', '-m', 'kinematics_service']
    assert '--params-file' not in process.options['cmd']


@pytest.mark.ros
def test_the_node_starts_with_what_the_launch_file_gives_it(launch_file, ros_domain):
    pytest.importorskip('rclpy')
    from node_process import NodeProcess

    words = launch_file.command('ur5e', '/cell', '/all_joints', str(CONFIG / 'one_arm.yaml'))
    node = NodeProcess(*words[3:])
    try:
        assert any('/all_joints' in line for line in node.lines)
        assert not [line for line in node.lines if 'WARN' in line or 'ERROR' in line]
    finally:
        node.kill()


@pytest.mark.parametrize('name', PARAMETER_FILES)
def test_the_parameters_are_those_of_the_node(name):
    table = pytest.importorskip('kinematics_service.node.parameters.table')
    known = {one.name: one.default for one in table.PARAMETERS}
    file = yaml.safe_load((CONFIG / name).read_text(encoding='utf-8'))
    for node in file.values():
        for key, value in node['ros__parameters'].items():
            assert type(value) is type(known[key]), key


@pytest.mark.ros
def test_the_analyzer_finds_the_statuses_of_the_node(arm):
    file = yaml.safe_load((CONFIG / 'diagnostics.yaml').read_text(encoding='utf-8'))
    (group,) = (
        value for value in file['/**']['ros__parameters'].values() if isinstance(value, dict)
    )
    one = arm('craig_3r', ['-r', '__ns:=/left'])
    assert any(word in one.diagnose().name for word in group['contains'])


def test_the_curves_of_plotjuggler_are_numbers_of_the_node():
    output_topics = pytest.importorskip('kinematics_service.node.messages.output_topics')
    kinds = {one.name.replace('~', '/kinematics'): one.type for one in output_topics.TOPICS}
    layout = ElementTree.parse(CONFIG / 'plotjuggler.xml').getroot()
    curves = [curve.get('name') for curve in layout.iter('curve')]
    assert len(curves) == len(set(curves)) > 8
    for curve in curves:
        topic = max((name for name in kinds if curve.startswith(f'{name}/')), key=len)
        value = kinds[topic]()
        for field in curve.removeprefix(f'{topic}/').split('/'):
            value = getattr(value, field)
        assert isinstance(value, float)
