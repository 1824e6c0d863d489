# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What README and reference say of topics, parameters, commands and the robot file is so."""

import re
from pathlib import Path
from urllib.parse import urlparse

import pytest

import kinematics_service as ks

ROOT = Path(__file__).parent.parent
README = ROOT / 'README.md'
REFERENCE = ROOT / 'docs' / 'reference'


@pytest.fixture
def made(monkeypatch):
    """Return the makers of the tables that the site makes from the code."""
    monkeypatch.syspath_prepend(str(ROOT / 'docs'))
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    import from_code

    return from_code.MAKERS


def rows(text):
    lines = text.splitlines()
    return [
        [cell.strip() for cell in re.split(r'(?<!\\)\|', line)[1:-1]]
        for line in lines
        if line.startswith('| `')
    ]


def test_every_topic_stands_in_its_table_with_its_type(made):
    topics = pytest.importorskip('kinematics_service.node.messages.topics')
    output_topics = pytest.importorskip('kinematics_service.node.messages.output_topics')
    cells = {row[0].strip('`'): row[1] for row in rows(made['topics']())}
    told = {name: re.match(r'\*\w+/(\w+)\*: .', cell)[1] for name, cell in cells.items()}
    expected = {topic.name: topic.type.__name__ for topic in output_topics.TOPICS}
    expected |= {
        topics.WARNING: 'DiagnosticStatus',
        topics.DIAGNOSTICS: 'DiagnosticArray',
        '/tf': 'TFMessage',
        topics.ROBOT_DESCRIPTION: 'String',
        topics.IK_JOINT_STATES: 'JointState',
        topics.IK_SOLUTIONS: 'Float64MultiArray',
        topics.IK_JOINT_VELOCITY: 'JointState',
        topics.IK_STATUS: 'DiagnosticStatus',
        topics.COMMAND: 'JointState',
        topics.SCALE: 'Float64',
        topics.SCALE_REASON: 'DiagnosticStatus',
        topics.SERVO_STATUS: 'Int8',
        topics.TARGET_POSE: 'PoseStamped',
        topics.TARGET_TWIST: 'TwistStamped',
        topics.REFERENCE_POSE: 'PoseStamped',
        topics.JOINT_STATES: 'JointState',
    }
    assert told == expected


def test_every_parameter_stands_in_its_table_with_its_default(made):
    table = pytest.importorskip('kinematics_service.node.parameters.table')
    told = {row[0].strip('`'): row[1].strip('`') for row in rows(made['parameters']())}
    assert told == {
        parameter.name: written(parameter.default)
        for parameter in (table.ROBOT, table.TRANSPORT, table.POINTS, *table.PARAMETERS)
    }


def written(default):
    """Return a default as YAML has it."""
    if isinstance(default, bool):
        return str(default).lower()
    return str(default) or "''"


def test_the_robot_file_of_the_reference_is_one():
    page = (REFERENCE / 'robot_file.md').read_text(encoding='utf-8')
    text = re.search(
        r'```\{code-block\} yaml\n:caption: [^\n]*\n\n(.*?)```', page, re.DOTALL
    ).group(1)
    robot = ks.robot_from_text(text, 'reference')
    assert robot.description.known_poses
    for pose in robot.description.known_poses:
        found = ks.forward_kinematics(robot, pose.q)
        assert found == pytest.approx(pose.motion.matrix, abs=1e-9)


def test_the_library_in_one_look_has_these_names():
    for page in (README, REFERENCE / 'python.md'):
        names = set(re.findall(r'\bks\.(\w+)\(', page.read_text(encoding='utf-8')))
        assert len(names) > 4
        assert names <= set(ks.__all__)


@pytest.mark.parametrize('page', ['README.md', 'CONTRIBUTING.md', 'QUALITY_DECLARATION.md'])
def test_every_link_to_a_file_is_to_one_of_these_files(page):
    text = (ROOT / page).read_text(encoding='utf-8')
    targets = [
        target for target in re.findall(r'\]\(([^)]+)\)', text) if not urlparse(target).scheme
    ]
    assert targets
    assert not [target for target in targets if not (ROOT / target.partition('#')[0]).exists()]


def test_the_readme_begins_with_how_to_run_and_to_test_it():
    first = README.read_text(encoding='utf-8').partition('\n## Your own arm')[0].splitlines()
    assert "    pip install '.[ros]' && python -m kinematics_service demo" in first
    assert "    pip install '.[ros,test]' && python -m pytest" in first


@pytest.mark.parametrize('extra', ['bag', 'dataset', 'view'])
def test_the_readme_names_what_its_commands_need(extra):
    recordings = README.read_text(encoding='utf-8').partition('**Recordings and plans**')[2]
    assert f".[{extra}]'" in recordings.partition('**Calibration**')[0]


def test_the_pictures_of_the_readme_are_shown_and_small():
    text = README.read_text(encoding='utf-8')
    files = [file for file in (ROOT / 'docs' / 'front').iterdir() if file.suffix != '.js']
    assert {f'docs/front/{file.name}' for file in files} == set(
        re.findall(r'!\[.+?\]\((.+?)\)', text)
    )
    assert sum(file.stat().st_size for file in files) < 1_000_000
