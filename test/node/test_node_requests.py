# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""`set` and `reload`: what they do to a running node, what they print, and their exit codes."""

import threading
from contextlib import contextmanager

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from refusal import refused

from kinematics_service.__main__ import main
from kinematics_service.errors import SettingsError
from kinematics_service.node.process.node_requests import value_from

ROBOT = """
robot: elbow
convention: standard
joints: [{name: a, variable: q1, type: revolute}, {name: b, variable: q2, type: revolute}]
links:
  - {a: 1, alpha: 0, d: 0, theta: q1}
  - {a: 0.8, alpha: 0, d: 0, theta: q2}
"""


@contextmanager
def turned(one):
    """Turn the executor of a node in a thread within the block."""
    over = threading.Event()

    def turn():
        while not over.is_set():
            one.executor.spin_once(timeout_sec=0.1)

    thread = threading.Thread(target=turn)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


@pytest.fixture
def told(capfd):
    """Return a function for exit code, output and errors of a command in this process."""

    def run(*arguments):
        capfd.readouterr()
        code = main([*arguments])
        output, errors = capfd.readouterr()
        ours = [line for line in errors.splitlines() if line.startswith('kinematics_service: ')]
        return code, output, '\n'.join(ours) or errors

    return run


def test_a_parameter_is_set(arm, told):
    one = arm('craig_3r')
    with turned(one):
        code, output, _ = told('set', 'tool.xyz', '[0, 0, 150]')
        assert code == 0
        assert output.startswith('/kinematics: tool.xyz is now [0, 0, 150]; ')
        assert output.endswith('are these millimetres? write 0.15\n')
        assert one.node.settings.robot.description.tool.motion.matrix[2, 3] == 150.0
        code, output, _ = told('set', 'kinematics', 'scale.rise', '3')
        assert (code, output) == (0, '/kinematics: scale.rise is now 3\n')
        assert one.node.settings.values['scale.rise'] == 3.0
        assert told('set', 'tool.xyz', '[]')[0] == told('set', 'joint_prefix', 'l_')[0] == 0
        assert one.node.settings.joint_names[0] == 'l_q1'
        assert told('set', 'joint_prefix', '')[0] == 0
        assert one.node.settings.joint_names[0] == 'q1'


REFUSED = [
    (('jacobian_frame', 'bass'), "jacobian_frame: 'bass' is not accepted; give one of base, tool"),
    (('scale.ryse', '3'), "no parameter 'scale.ryse'; similar: scale.rise, "),
    (('zzz', '3'), "no parameter 'zzz'; similar: "),
    (('scale.rise', '-1'), 'scale.rise is refused: '),
    (('tool.xyz', '{a: 1}'), "'{a: 1}' is not"),
    (('robot', 'ur5e'), 'read-only'),
    (('scale.rise', 'fast'), 'number got a text'),
    (('joint_prefix', 'true'), 'text got true or false'),
    (('/arm/kinematics', 'scale.rise', '3'), 'nodes here: /kinematics'),
]


def test_a_refusal_names_its_reason(arm, told):
    with turned(arm('craig_3r')):
        for words, sentence in REFUSED:
            code, output, errors = told('set', *words)
            assert (code, output) == (1, '')
            assert sentence in errors
            assert errors.count(',') < 6


def test_a_node_that_is_not_there_is_answered_with_those_that_are(arm, told):
    one, other = arm('craig_3r', namespace='/right'), arm('planar_2r', namespace='/left')
    with turned(one), turned(other):
        code, _, errors = told('reload')
        assert code == 1
        assert 'here: /left/kinematics, /right/kinematics' in errors
        code, output, _ = told('reload', '/left/kinematics')
    assert code == 0
    assert 'robot planar_2r' in output


@pytest.mark.parametrize(
    'words', [('scale.rise',), ('a', 'b', 'c', 'd'), ('bad name', 'scale.rise', '3')]
)
def test_wrong_usage_has_its_exit_code(told, words):
    code, output, errors = told('set', *words)
    assert (code, output) == (2, '')
    assert 'Traceback' not in errors


def test_a_robot_file_is_read_again_or_its_faults_are_printed(arm, told, tmp_path):
    file = tmp_path / 'elbow.yaml'
    file.write_text(ROBOT)
    with turned(arm(str(file))):
        code, output, _ = told('reload')
        assert code == 0
        assert output == f'/kinematics: {file} is in force: robot elbow, 2 joints, standard\n'
        file.write_text(ROBOT.replace('links', 'linx'))
        code, output, errors = told('reload')
    assert (code, output) == (1, '')
    assert 'linx: unknown key' in errors


@pytest.mark.parametrize(
    ('text', 'field', 'value'),
    [
        ('1', 'double_value', 1.0),
        ('1e-3', 'double_value', 0.001),
        ('true', 'bool_value', True),
        ("'1_'", 'string_value', '1_'),
        ("'1'", 'string_value', '1'),
        ("''", 'string_value', ''),
        ('', 'string_value', ''),
        ('[0, 0, 0.15]', 'double_array_value', [0.0, 0.0, 0.15]),
        ('[a, b]', 'string_array_value', ['a', 'b']),
    ],
)
def test_a_value_is_read_as_yaml_and_whole_numbers_as_doubles(text, field, value):
    found = getattr(value_from(text), field)
    assert (list(found) if isinstance(value, list) else found) == value


@pytest.mark.parametrize('text', ['a: b: c', '[1, 2', '1, 2]', '{a: 1}', '{a', '"a'])
def test_a_text_that_is_no_value_is_refused(text):
    with refused(SettingsError, 'syntax', text):
        value_from(text)
