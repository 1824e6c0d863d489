"""What the README says of topics, parameters, commands and the robot file is so."""

import re
from pathlib import Path

import pytest

import kinematics_service as ks
from kinematics_service.cli.commands import app

README = Path(__file__).parent.parent / 'README.md'


def section(title):
    text = README.read_text(encoding='utf-8')
    return text.partition(f'## {title}\n')[2].partition('\n## ')[0]


def rows(title):
    lines = section(title).splitlines()
    return [
        [cell.strip() for cell in re.split(r'(?<!\\)\|', line)[1:-1]]
        for line in lines
        if line.startswith('| `')
    ]


def test_every_topic_stands_in_its_table_with_its_type():
    topics = pytest.importorskip('kinematics_service.ros.messages.topics')
    told = {row[0].strip('`'): row[1].rpartition('/')[2] for row in rows('Topics')}
    expected = {topic.name: topic.type.__name__ for topic in topics.TOPICS}
    expected |= {
        topics.WARNING: 'DiagnosticStatus',
        topics.DIAGNOSTICS: 'DiagnosticArray',
        '/tf': 'TFMessage',
        topics.ROBOT_DESCRIPTION: 'String',
        topics.IK_JOINT_STATES: 'JointState',
        topics.IK_SOLUTIONS: 'Float64MultiArray',
        topics.IK_JOINT_VELOCITY: 'JointState',
        topics.IK_STATUS: 'DiagnosticStatus',
        topics.TARGET_POSE: 'PoseStamped',
        topics.TARGET_TWIST: 'TwistStamped',
        topics.REFERENCE_POSE: 'PoseStamped',
    }
    assert told == expected


def test_every_parameter_stands_in_its_table_with_its_default():
    table = pytest.importorskip('kinematics_service.ros.parameters.table')
    told = {row[0].strip('`'): row[1].strip('`') for row in rows('Parameters')}
    assert told == {
        parameter.name: written(parameter.default)
        for parameter in (table.ROBOT, table.TRANSPORT, *table.PARAMETERS)
    }


def written(default):
    """Return a default as YAML has it."""
    if isinstance(default, bool):
        return str(default).lower()
    return str(default) or "''"


def test_every_command_stands_in_its_table():
    told = ' '.join(row[0] for row in rows('Commands'))
    for command in app.registered_commands:
        name = command.name or command.callback.__name__
        assert re.search(rf'`{name}\b', told), name


def test_the_robot_file_of_the_readme_is_one():
    text = re.search(r'```yaml\n(.*?)```', section('The robot file'), re.DOTALL).group(1)
    robot = ks.robot_from_text(text, 'README')
    for pose in robot.description.known_poses:
        found = ks.forward_kinematics(robot, pose.q)
        assert found == pytest.approx(pose.motion.matrix, abs=1e-9)


def test_the_library_of_the_readme_has_these_names():
    names = set(re.findall(r'\bks\.(\w+)', section('The library')))
    assert names
    assert names <= set(ks.__all__)
