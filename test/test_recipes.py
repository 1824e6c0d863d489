# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The recipes of CONTRIBUTING.md, each followed in a copy of the package and run.

A test edits the files its recipe names and no others. Where the kernel is among them its source
runs as plain Python.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import kinematics_service as ks
from kinematics_service.kernel.compiled import VARIABLE

PACKAGE = Path(ks.__file__).parent
ROOT = Path(__file__).parents[1]
NAME = 'kinematics_service'
needs_pages = pytest.mark.skipif(
    not (ROOT / 'docs').is_dir(), reason='the pages are not beside the tests'
)
pytestmark = needs_pages


def files_of(recipe, own=''):
    """Return the files in the first column of a recipe's table; `own` is its NAME."""
    text = (ROOT / 'CONTRIBUTING.md').read_text(encoding='utf-8')
    part = re.search(rf'^### {recipe}\n(.*?)(?=^##)', text, re.MULTILINE | re.DOTALL)
    return {
        file.replace('NAME', own)
        for file in re.findall(r'^\| `([^`]+)` \|', part[1], re.MULTILINE)
    }


EACH_COMMAND = """
import contextlib, io, json, sys
from kinematics_service.__main__ import main
said = []
for words in json.loads(sys.argv[1]):
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        code = main(words)
    said.append((code, printed.getvalue()))
print(json.dumps(said))
"""


class Copy:
    """A copy of the package in which a recipe is followed."""

    def __init__(self, folder):
        self.folder, self.edited = folder, set()
        self.package = folder / NAME
        # With its bytecode, which each run would make anew.
        shutil.copytree(PACKAGE, self.package)
        if not (self.package / 'config').is_dir():
            shutil.copytree(ROOT / 'config', self.package / 'config')
        shutil.copytree(ROOT / 'docs', folder / 'docs')
        (folder / 'turns.yaml').write_text(TURNS)

    def path(self, file):
        beside = file.startswith('docs/')
        return (self.folder if beside else self.package) / file

    def write(self, file, text):
        self.edited.add(file)
        assert not self.path(file).exists()
        self.path(file).write_text(text, encoding='utf-8')

    def insert(self, file, new, *, before=None, after=None):
        """Insert lines beside the one place where a text stands."""
        self.edited.add(file)
        text, mark = self.path(file).read_text(encoding='utf-8'), before or after
        assert text.count(mark) == 1, (file, mark)
        at = text.index(mark) + (len(mark) if after else 0)
        self.path(file).write_text(text[:at] + new + text[at:], encoding='utf-8')

    def replace(self, file, old, new):
        self.edited.add(file)
        text = self.path(file).read_text(encoding='utf-8')
        assert text.count(old) == 1, (file, old)
        self.path(file).write_text(text.replace(old, new), encoding='utf-8')

    def python(self, *arguments):
        around = {
            'PYTHONPATH': str(self.folder),
            'PYTHONDONTWRITEBYTECODE': '1',
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        }
        if any(file.startswith('kernel/') for file in self.edited):
            around[VARIABLE] = '1'
        done = subprocess.run(
            [sys.executable, *arguments],
            cwd=self.folder,
            env={**os.environ, **around},
            capture_output=True,
            text=True,
            timeout=280,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def commands(self, *lines, codes=None, after=''):
        """
        Return what command lines print, run in one process; all codes are 0 if not given.

        With a program to run before them in this process, what it prints comes first.
        """
        words = [shlex.split(line) for line in lines]
        printed = self.python('-c', after + EACH_COMMAND, json.dumps(words))
        first, _, last = printed.rstrip('\n').rpartition('\n')
        said = json.loads(last)
        assert [end for end, _ in said] == list(codes or [0] * len(said)), said
        return [*([first] if after else []), *(text for _, text in said)]


@pytest.fixture
def package(tmp_path):
    return Copy(tmp_path)


def recording(folder):
    """Write joint states of planar_2r that go through a singular pose."""
    lines = ['stamp,position.q1,position.q2']
    lines += [f'{0.1 * k:.2f},{0.04 * k:.3f},{0.8 - 0.08 * k:.3f}' for k in range(20)]
    file = folder / 'run.csv'
    file.write_text('\n'.join(lines) + '\n')
    return file


# The node of the page is of an arm whose singular poses take a kernel in plain Python seconds; one
# that turns about one axis is redundant, too.
TURNS = """
robot: turns
source: a test
convention: standard
joints: [{name: q1, type: revolute}, {name: q2, type: revolute}]
links: [{a: 0, alpha: 0, d: 0, theta: q1}, {a: 0, alpha: 0, d: 0, theta: q2}]
singularity:
  task: [rz]
"""
TOPICS_OF_A_NODE = """
import contextlib
from pathlib import Path
import kinematics_service as ks
ks.bundled_robots = lambda: {'planar_3r': Path('turns.yaml')}
with from_code.some_node() as node:
    print(*sorted({publisher.topic for publisher in node.publishers}))
    # The page asks for a node, too.
    from_code.some_node = lambda: contextlib.nullcontext(node)
    print(from_code.topics())
"""


FROM_CODE = """
import sys
sys.path.insert(0, 'docs')
import from_code
"""

LANES_AND_ONE = """
import dataclasses
import numpy as np
import kinematics_service as ks
robot = ks.load_robot('planar_2r')
# Two blocks of poses side by side, of which one is not full.
q = np.random.default_rng(3).uniform(-3.0, 3.0, (18, 2))
batch = ks.singularity(robot, q)
one = [ks.singularity(robot, row).isotropy for row in q]
assert batch.isotropy.tolist() == one
np.testing.assert_allclose(one, 1.0 / batch.condition_number, rtol=1e-12)
assert 'isotropy' in {field.name for field in dataclasses.fields(batch)}
"""


def add_isotropy(package):
    package.replace(
        'kernel/layout/places.py',
        '    LOST_AT,\n) = range(7)\n',
        '    ISOTROPY,\n    LOST_AT,\n) = range(8)\n',
    )
    package.insert(
        'kernel/measures/singularity.py',
        '        measures[places.ISOTROPY * lanes + lane] = smallest[lane] / sigma[lane]\n',
        before='        measures[places.SMALLEST_SINGULAR_VALUE * lanes + lane]',
    )
    package.insert(
        'robot/file/parts/measure_table.py',
        "        Measure('isotropy', 'of the scaled J_t: smallest over largest singular value',\n"
        '            kernel.ISOTROPY, warn=0.1, stop=0.05),\n',
        before="        Measure(\n            'condition_number',",
    )
    file = 'kinematics/singularity.py'
    package.insert(
        file,
        '    isotropy\n        Smallest over largest singular value of the scaled J_t.\n',
        before='    rank, generic_rank\n',
    )
    package.insert(file, '    isotropy: Number\n', before='    rank: Index\n')
    package.insert(
        file,
        '    isotropy = cached_property(lambda one: _column(one._first, kernel.ISOTROPY))\n\n',
        before='    @cached_property\n    def rank(',
    )


@pytest.mark.slow
def test_a_measure(package):
    add_isotropy(package)
    assert package.edited == files_of('A measure')
    text = package.path('config/planar_2r.yaml').read_text(encoding='utf-8')
    text = text.replace('\nsingularity:\n', '\nsingularity:\n  measure: isotropy\n')
    (package.folder / 'watched.yaml').write_text(text)
    text = text.replace('isotropy\n', 'isotropy\n  warn: 0.04\n')
    (package.folder / 'refused.yaml').write_text(text)
    recording(package.folder)
    table, told, printed, checked, near, _, refused = package.commands(
        'fk --robot planar_2r --q 0.1,0.7 --json',
        'fk --robot planar_2r --q 0.1,0.7 --all',
        'check watched.yaml',
        'fk --robot watched.yaml --q 0.1,0.1 --json',
        'audit run.csv --robot planar_2r --html page.html',
        'check refused.yaml',
        codes=(0, 0, 0, 0, 0, 1),
        after=f'{LANES_AND_ONE}{FROM_CODE}print(from_code.measures())',
    )
    assert '| `isotropy` | of the scaled J_t' in table
    found = json.loads(told)['singularity']
    value = found['isotropy']
    assert value == pytest.approx(1.0 / found['condition_number'], rel=1e-12)
    assert re.search(rf'^  isotropy +{value:.4g}$', printed, re.MULTILINE)
    assert 'isotropy: WARN below 0.1, ERROR below 0.05' in checked
    assert json.loads(near)['singularity']['level'] == 'ERROR'
    assert 'stop must be below warn for isotropy: warn 0.04, stop 0.05 (the default)' in refused
    assert 'data-name="isotropy"' in (package.folder / 'page.html').read_text()


@pytest.mark.slow
def test_a_measure_is_a_topic(package, ros_domain):
    pytest.importorskip('rclpy')
    add_isotropy(package)
    published, _, table = package.python('-c', FROM_CODE + TOPICS_OF_A_NODE).partition('\n')
    assert '/docs/' not in published
    assert any(topic.endswith('/singularity/isotropy') for topic in published.split())
    assert '| `~/singularity/isotropy` | *std_msgs/Float64*: of the scaled J_t' in table


SPEED = """

def speed(report: StateReport) -> float | None:
    \"\"\"Return the speed of the tool, m/s; None if the velocities are not known.\"\"\"
    state = report.answer.state
    return float(np.linalg.norm(state.twist[:3])) if state.moving else None
"""
TRAVEL = '''"""How far each joint has moved."""

import numpy as np

from ..kernel import Floats
from .estimator import EstimatorOutput, JointMessage, StreamQuantity
from .joint_memory import NamedJoints


class Travel(StreamQuantity):
    """How far each joint has moved since somebody listens, shape (n,), rad or m."""

    _total: Floats | None = None

    def take(
        self, answer: EstimatorOutput, message: JointMessage, joints: NamedJoints
    ) -> Floats | None:
        """Return the sums of the steps."""
        q = answer.state.q.copy()
        total = np.zeros_like(q) if self._total is None else self._total + np.abs(q - self._q)
        self._q, self._total = q, total
        return total
'''
LONGEST_TRAVEL = """

def longest_travel(report: StateReport) -> float | None:
    \"\"\"Return how far the joint has moved that has moved farthest, rad or m.\"\"\"
    travel = report.answer.quantities.get(Travel)
    return None if travel is None else float(travel.max())
"""
SHARE = """

def share_of_speed(report: StateReport) -> float | None:
    \"\"\"Return the speed of the tool as a share of the largest; None if it is not known.\"\"\"
    state, largest = report.answer.state, report.settings.values['speed.largest']
    return float(np.linalg.norm(state.twist[:3]) / largest) if state.moving else None
"""
LARGEST_SPEED = """    Parameter(
        'speed.largest', 2.0, 'The speed of the tool that `~/share` is 1 at.', range=(1e-3, 1e3)
    ),
"""
ONE_TOPIC_OF_A_NODE = """
import math, time
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from kinematics_service.node.node import KinematicsNode

def heard_after(topic, messages, enough, parameters=()):
    context = Context()
    rclpy.init(args=['recipe'], context=context)
    node, peer = KinematicsNode('planar_2r', context=context), Node('peer', context=context)
    for result in node.set_parameters(parameters):
        assert result.successful, result.reason
    heard = []
    peer.create_subscription(Float64, f'/kinematics/{topic}', heard.append, 10)
    publisher = peer.create_publisher(JointState, 'joint_states', 10)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    executor.add_node(peer)
    end = time.monotonic() + 60.0
    for q in messages:
        message = JointState(name=['q1', 'q2'], position=[q, 0.7], velocity=[0.5, 0.0])
        message.header.stamp = peer.get_clock().now().to_msg()
        publisher.publish(message)
        executor.spin_once(timeout_sec=0.05)
        if enough(heard) or time.monotonic() > end:
            break
    assert enough(heard), heard
    return [message.data for message in heard]

def at_rest():
    while True:
        yield 0.1

# A turn about the first axis: the speed is the distance to it, times 0.5.
reach = math.sqrt(2.0 + 2.0 * math.cos(0.7))
"""
TOPIC_KINDS = {
    '~/speed': """
(found,) = heard_after('speed', at_rest(), len)[:1]
assert abs(found - 0.5 * reach) < 1e-12, found
""",
    '~/travel': """
first, *others = heard_after('travel', (0.1 * (k % 2) for k in range(10**6)), lambda h: len(h) > 5)
assert first == 0.0
steps = [later - earlier for earlier, later in zip([first, *others], others)]
assert all(abs(step / 0.1 - round(step / 0.1)) < 1e-9 for step in steps), steps
assert others[-1] > 0.3, others
""",
    '~/share': """
largest = Parameter('speed.largest', value=4.0)
(found,) = heard_after('share', at_rest(), len, [largest])[:1]
assert abs(found - 0.5 * reach / 4.0) < 1e-12, found
""",
}


def add_topic(package, name, function, content, sentence):
    """Follow the recipe of a topic."""
    file = 'node/messages/output_topics.py'
    package.insert(file, function, before='\n\ndef link_frames_template(')
    row = f"    OutputTopic('{name}', Float64, {content}),\n"
    package.insert(file, row, before='    *(\n        OutputTopic(')
    package.insert(
        'docs/sentences.py', f"    '{name}': '{sentence}',\n", before="    '~/link_frames'"
    )


@pytest.mark.parametrize('name', TOPIC_KINDS)
def test_a_topic(package, ros_domain, name):
    pytest.importorskip('rclpy')
    sentence, recipe = f'what {name[2:]} means', files_of('A topic')
    if name == '~/speed':
        add_topic(package, name, SPEED, 'computed(speed)', sentence)
    elif name == '~/travel':
        recipe |= files_of('A topic of several messages', 'travel')
        package.write('estimation/travel.py', TRAVEL)
        add_topic(package, name, LONGEST_TRAVEL, 'computed(longest_travel, Travel)', sentence)
        package.insert(
            'node/messages/output_topics.py',
            'from ...estimation.travel import Travel\n',
            after='from ...estimation.joint_efforts import JointEfforts\n',
        )
    else:
        recipe |= files_of('A topic with parameters')
        package.insert(
            'node/parameters/table.py', LARGEST_SPEED, before="    Parameter('publish_tf', "
        )
        add_topic(package, name, SHARE, 'computed(share_of_speed)', sentence)
    assert package.edited == recipe
    program = f'{ONE_TOPIC_OF_A_NODE}{TOPIC_KINDS[name]}{FROM_CODE}{TOPICS_OF_A_NODE}'
    published, _, table = package.python('-c', program).partition('\n')
    assert any(topic.endswith(name[1:]) for topic in published.split())
    assert f'| `{name}` | *std_msgs/Float64*: {sentence} |' in table


COMMAND = '''"""The command `joints`: the joints of a robot."""

from .options import RobotOption, given_robot


def joints(robot: RobotOption) -> None:
    """Print the joints of a robot."""
    print(*given_robot(robot).joint_names)
'''


@pytest.mark.slow
def test_a_command(package):
    package.write('cli/joints.py', COMMAND)
    package.insert(
        'cli/commands.py',
        "        'joints': 'Print the joints of a robot.',\n",
        after="        'export': 'Write a robot as URDF, C++, C or ROS 2 plugin.',\n",
    )
    assert package.edited == files_of('A command', 'joints')
    printed, own, every = package.commands('joints --robot planar_2r', 'joints --help', '--help')
    assert printed == 'q1 q2\n'
    assert 'Print the joints of a robot.' in own
    listed = every.rstrip().splitlines()
    assert listed[-1].split(maxsplit=1) == ['joints', 'Print the joints of a robot.']


ROBOT = """
robot: one_slide
source: a test
convention: modified
joints: [{name: rail, type: prismatic}]
links: [{a: 0.5, alpha: 0, d: rail, theta: 0}]
"""


@pytest.mark.slow
def test_a_robot(package):
    package.write('config/one_slide.yaml', ROBOT)
    package.replace(
        'robot/bundled.py',
        "'planar_2r planar_3r",
        "'planar_2r one_slide planar_3r",
    )
    assert package.edited == files_of('A robot', 'one_slide')
    listed, told = package.commands('robots', 'fk --robot one_slide --q 0.25 --json')
    group = listed.partition('Textbook and course arms')[2]
    assert re.search(r'^one_slide +1 +P +modified +a test$', group, re.MULTILINE)
    assert json.loads(told)['position'] == [0.5, 0.0, 0.25]


# Hayati and Mirmirani 1985, for axes that are nearly parallel: beta instead of d.
CONVENTION = """        Convention(
            'hayati',
            'Rz(theta) Tx(a) Rx(alpha) Ry(beta)',
            author='Hayati-Mirmirani',
            also=('hayati_mirmirani',),
        ),
"""
NEARLY_PARALLEL = """
robot: nearly_parallel
source: a test
convention: hayati
constants: {L: 0.5}
joints: [{name: q1, type: revolute}, {name: q2, type: revolute}]
links:
  - {theta: q1, a: L, alpha: 0.01, beta: -0.02}
  - {theta: q2 + pi/2, a: 0.3, alpha: pi/2, beta: 0}
"""
BY_ELEMENTARY_MOTIONS = """
robot: nearly_parallel
source: a test
convention: elementary
constants: {L: 0.5}
joints: [{name: q1, type: revolute}, {name: q2, type: revolute}]
links: [Rz(q1), Tx(L), Rx(0.01), Ry(-0.02), Rz(q2 + pi/2), Tx(0.3), Rx(pi/2)]
"""
SAME_ARM = """
import numpy as np
import kinematics_service as ks
from kinematics_service.apps.formulas.derive.derivation import exact_of
rows, motions = ks.load_robot('rows.yaml'), ks.load_robot('motions.yaml')
q = np.random.default_rng(4).uniform(-3.0, 3.0, (20, 2))
for function in (ks.forward_kinematics, ks.jacobian):
    np.testing.assert_allclose(function(rows, q), function(motions, q), rtol=0, atol=1e-15)
exact = [exact_of(robot) for robot in (rows, motions)]
T = [one.writer.matrix(one.frames.T_base_tool) for one in exact]
J = [one.writer.matrix(one.J) for one in exact]
assert (T[0] - T[1]).expand().is_zero_matrix
assert (J[0] - J[1]).expand().is_zero_matrix
"""
BETA_TURNED_ROUND = """
T_01 = [
  -sin(0.01)*sin(0.02)*s1 + cos(0.02)*c1, -cos(0.01)*s1,
  sin(0.01)*cos(0.02)*s1 + sin(0.02)*c1, L*c1;
  sin(0.01)*sin(0.02)*c1 + cos(0.02)*s1, cos(0.01)*c1, sin(0.02)*s1 - sin(0.01)*cos(0.02)*c1, L*s1;
  -sin(0.02)*cos(0.01), sin(0.01), cos(0.01)*cos(0.02), 0; 0, 0, 0, 1]
"""


@pytest.mark.slow
def test_a_convention(package):
    package.insert(
        'robot/file/parts/convention_table.py', CONVENTION, before='    )\n}\n# The names'
    )
    sentence = "            'beta': 'angle of the joint axes about y',\n"
    package.insert('docs/sentences.py', sentence, before="            'd': 'distance along z; a")
    assert package.edited == files_of('A convention')
    (package.folder / 'rows.yaml').write_text(NEARLY_PARALLEL)
    (package.folder / 'motions.yaml').write_text(BY_ELEMENTARY_MOTIONS)
    printed = 'print(from_code.conventions(), from_code.robot_file())'
    (package.folder / 'formulas.txt').write_text(BETA_TURNED_ROUND)
    wrong = NEARLY_PARALLEL.replace('hayati', 'hayati_mirmirani').replace('beta', 'b')
    (package.folder / 'wrong.yaml').write_text(wrong)
    table, checked, refused, compared = package.commands(
        'check rows.yaml',
        'check wrong.yaml',
        'compare rows.yaml formulas.txt',
        codes=(0, 1, 1),
        after=f'{SAME_ARM}{FROM_CODE}{printed}',
    )
    assert '| `hayati` (Hayati-Mirmirani) | Rz(theta) Tx(a) Rx(alpha) Ry(beta) |' in table
    assert '| `beta` |' in table
    assert (
        '  convention  hayati (Hayati-Mirmirani), T = Rz(theta) Tx(a) Rx(alpha) Ry(beta)'
        in checked
    )
    assert re.search(r'^  i  a \[m\]  alpha \[rad\]  beta \[rad\]  theta \[rad\]$', checked, re.M)
    assert re.search(r'^  1  L +0.01 +-0.02 +q1$', checked, re.M)
    assert '  cause: beta of row 1 has the wrong sign' in compared
    assert "unknown 'hayati_mirmirani', did you mean 'hayati'?" in refused
