# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
What the pages of docs/ show is so: their commands run and print that, and their Python runs.

A block with `$` lines is run in a folder of its page, unless the comment before it says why it is
not; then its command lines are only parsed. The last one may end with exit code 1 where the
comment says so. A block with a caption, or after a comment `file: NAME`, is the file of that name.
"""

import contextlib
import doctest
import io
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import typer

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.demo.motions.passage import smooth_trajectory
from kinematics_service.cli.arguments import join_numbers, name_robots, split_ros_arguments
from kinematics_service.cli.commands import COMMANDS, app
from kinematics_service.estimation.status_text import singularity_status
from kinematics_service.robot.measures import HYSTERESIS

ROOT = Path(__file__).parent.parent
DOCS = ROOT / 'docs'
PACKAGE = Path(ks.__file__).parent
PAGES = sorted(
    page.relative_to(ROOT).as_posix()
    for page in [*DOCS.rglob('*.md'), ROOT / 'CONTRIBUTING.md', ROOT / 'README.md']
)
RUN = ['python', '-m', 'kinematics_service']
WITH_EXAMPLES = [
    '.'.join(file.relative_to(PACKAGE.parent).with_suffix('').parts)
    for file in sorted(PACKAGE.rglob('*.py'))
    if '>>> ' in file.read_text(encoding='utf-8')
]
BLOCK = re.compile(
    r'(?:^<!-- (?P<comment>[^\n]*) -->\n)?'
    r'^```(?:\{code-block\} )?(?P<language>\w+)\n(?P<body>.*?)^```$',
    re.MULTILINE | re.DOTALL,
)
CAPTION = re.compile(r':caption: (\S+)\n\n?')
CHECKER = doctest.OutputChecker()
# The first typer that writes help as the reference shows it.
NEW_HELP = (0, 12)
LANGUAGES = {'console', 'pycon', 'python', 'yaml', 'text', 'cmake', 'xml', 'cpp'}


class Block(NamedTuple):
    language: str
    comment: str
    caption: str
    body: str
    line: int


def blocks_of(page):
    text = (ROOT / page).read_text(encoding='utf-8')
    for found in BLOCK.finditer(text):
        body, caption = found['body'], ''
        if titled := CAPTION.match(body):
            caption, body = titled[1], body[titled.end() :]
        elif (found['comment'] or '').startswith('file: '):
            caption = found['comment'].removeprefix('file: ')
        line = text.count('\n', 0, found.start('body')) + 1
        yield Block(found['language'], found['comment'] or '', caption, body, line)


def commands_of(body):
    """Yield each command line of a block, its lines joined, with the output shown for it."""
    command, shown = None, []
    for line in body.splitlines():
        if command is not None and command.endswith('\\'):
            command = command[:-1] + line.strip()
        elif line.startswith('$ '):
            if command is not None:
                yield command, shown
            command, shown = line[2:], []
        else:
            shown.append(line)
    assert command is not None, 'a console block begins with $'
    yield command, shown


class Shell:
    """Runs the command lines of a page; this package's own in this process, to save its start."""

    def __init__(self):
        self.code = 0

    def run(self, command):
        command = re.sub(r'\s# .*$', '', command)
        if command == 'echo $?':
            code, self.code = self.code, 0
            return f'{code}\n'
        line, _, file = command.partition(' > ')
        words = shlex.split(line)
        printed = io.StringIO()
        if words[:1] == ['python']:
            with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
                self.code = python(words)
        else:
            result = subprocess.run(
                ['bash', '-c', line], capture_output=True, text=True, timeout=60, check=False
            )
            self.code = result.returncode
            printed.write(result.stdout + result.stderr)
        if file:
            Path(file.strip()).write_text(printed.getvalue(), encoding='utf-8')
            return ''
        return printed.getvalue()


def python(words):
    if words[:3] == RUN:
        return main(words[3:])
    before = sys.argv
    sys.argv = words[1:]
    try:
        runpy.run_path(words[1], run_name='__main__')
    except SystemExit as end:
        return end.code or 0
    finally:
        sys.argv = before
    return 0


def stripped(lines):
    return '\n'.join(line.rstrip() for line in lines).strip('\n') + '\n'


def assert_shown(shown, printed, where):
    want, got = stripped(shown), stripped(printed.splitlines())
    fits = CHECKER.check_output(want, got, doctest.ELLIPSIS)
    assert fits, f'{where}\nthe page shows:\n{want}\nbut this is printed:\n{got}'


def parse(command, where):
    """Check the words of a command line that cannot be run here."""
    words = shlex.split(re.sub(r'\s# .*$', '', command.split(' | ')[0].split(' > ')[0]))
    while words and re.fullmatch(r'\w+=.*', words[0]):
        words.pop(0)
    for extras in re.findall(r'\.\[([\w,]+)\]', command):
        assert set(extras.split(',')) <= extras_of_setup(), where
    if words[: len(RUN)] != RUN:
        return
    ours, ros = split_ros_arguments(words[len(RUN) :])
    group = typer.main.get_command(app)
    words = join_numbers(ours if ours[:1] == ['import'] else name_robots(ours))
    at = next((k for k, word in enumerate(words) if word in COMMANDS), len(words))
    assert not words or at == 0 or words[0].startswith('-'), f'{where}: no command {words[0]}'
    context = group.make_context('kinematics_service', words[:at])
    for name in words[at : at + 1]:
        command = group.get_command(context, name)
        command.make_context(name, words[at + 1 :], parent=context)
    for name in re.findall(r'-p ([\w.]+):=', ' '.join(ros)):
        assert name in parameters(), f'{where}: no parameter {name}'


def extras_of_setup():
    text = (ROOT / 'setup.py').read_text(encoding='utf-8')
    return set(re.findall(r"^ +'([\w-]+)': ", text, re.MULTILINE))


def parameters():
    table = pytest.importorskip('kinematics_service.node.parameters.table')
    return {one.name for one in (table.ROBOT, table.TRANSPORT, table.POINTS, *table.PARAMETERS)}


@pytest.fixture(scope='module')
def derived_once():
    """Let the command `derive` derive each arm once: pages show it in several formats."""
    from kinematics_service.apps.formulas.derive import derivation

    whole, known = ks.derive, {}

    def derive(robot, locked, progress):
        key = robot.description, *locked.items()
        if key not in known:
            known[key] = whole(robot, locked, progress)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(derivation, 'derive', derive)
        yield


@pytest.mark.slow
@pytest.mark.usefixtures('derived_once')
@pytest.mark.parametrize('page', PAGES)
def test_every_block_of_a_page_does_what_it_shows(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shell, names = Shell(), {'__name__': 'page'}
    for block in blocks_of(page):
        where = f'{page}:{block.line}'
        assert block.language in LANGUAGES, where
        if block.caption:
            Path(block.caption).write_text(block.body, encoding='utf-8')
            if block.language == 'python':
                compile(block.body, where, 'exec')
        elif block.comment.startswith('not run'):
            assert block.comment.partition(':')[2], f'{where}: say why it is not run'
            if block.language == 'console':
                for command, _ in commands_of(block.body):
                    parse(command, where)
        elif block.language == 'console':
            if 'kinematics_service plot ' in block.body:
                pytest.importorskip('matplotlib', reason="needs matplotlib: pip install '.[plot]'")
            if '--images' in block.body:
                pytest.importorskip('cv2', reason="needs opencv: pip install '.[camera]'")
            if 'g++ ' in block.body and not shutil.which('g++'):
                pytest.skip('needs g++')
            run_console(shell, block, where)
        elif block.language == 'pycon':
            run_doctest(names, block, page)
        elif block.language == 'python':
            exec(compile(block.body, where, 'exec'), names)


def run_console(shell, block, where):
    lines = list(commands_of(block.body))
    for index, (command, shown) in enumerate(lines):
        printed = shell.run(command)
        last = index + 1 == len(lines)
        asked = not last and lines[index + 1][0] == 'echo $?'
        expected = 1 if last and block.comment == 'exit code 1' else 0
        assert asked or shell.code == expected, f'{where}: {command}: {shell.code}: {printed}'
        if any(shown):
            assert_shown(shown, printed, f'{where}: {command}')


def run_doctest(names, block, page):
    test = doctest.DocTestParser().get_doctest(block.body, names, page, page, block.line)
    said = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS, verbose=False)
    runner.run(test, out=said.append, clear_globs=False)
    assert runner.failures == 0, ''.join(said)
    names.update(test.globs)


@pytest.mark.parametrize('module', WITH_EXAMPLES)
def test_the_examples_of_docstrings_are_true(module):
    failed, tried = doctest.testmod(import_module(module), optionflags=doctest.ELLIPSIS)
    assert (failed, tried > 0) == (0, True)


def test_every_indented_command_line_of_the_readme_can_be_given():
    lines = re.findall(
        r'^    ([^ ].*)$', (ROOT / 'README.md').read_text(encoding='utf-8'), re.MULTILINE
    )
    commands = [command for line in lines for command in line.split(' && ')]
    assert ' '.join(RUN) + ' demo' in commands
    for command in commands:
        parse(command, f'README.md: {command}')


def test_every_page_has_been_found():
    assert {'docs/index.md', 'docs/tutorials/own_arm.md', 'CONTRIBUTING.md'} <= set(PAGES)


@pytest.mark.parametrize(
    'written', ['', 'singularity:\n  factors: [{name: elbow, expression: sin(q3)}]\n']
)
def test_the_arm_of_the_tutorial_moves_through_a_singular_pose_of_its_own(written):
    (block,) = (b for b in blocks_of('docs/tutorials/own_arm.md') if b.caption == 'my_arm.yaml')
    robot = ks.robot_from_text(
        block.body.replace('-pi/2', '90').replace('tetha', 'theta') + written
    )
    path = smooth_trajectory(robot)
    near = ks.singularity(robot, path.at(np.linspace(0.0, path.period, 501)).q)
    assert {0, 1, 2} <= set(near.level.tolist())


MADE = re.compile(r'^<!-- made from the code: (\w+) -->$', re.MULTILINE)


@pytest.mark.parametrize(
    ('page', 'what'),
    [(page, what) for page in PAGES for what in MADE.findall((ROOT / page).read_text('utf-8'))],
)
def test_what_is_made_from_the_code_is_as_the_code_makes_it(page, what, monkeypatch):
    if what in ('topics', 'parameters'):
        pytest.importorskip('rclpy')
    if what == 'commands' and tuple(map(int, typer.__version__.split('.')[:2])) < NEW_HELP:
        pytest.skip('an older typer writes help another way')
    monkeypatch.syspath_prepend(str(DOCS))
    import from_code

    monkeypatch.setitem(os.environ, 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    text = (ROOT / page).read_text('utf-8')
    (shown,) = (place for place in from_code.PLACE.finditer(text) if place['what'] == what)
    assert len(shown[0].splitlines()) > 5
    assert from_code.renewed(shown[0]) == shown[0], 'python docs/from_code.py renews it'


def test_a_page_that_is_old_is_renewed(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    import from_code

    monkeypatch.setitem(from_code.MAKERS, 'measures', lambda: '| new |')
    old = 'a\n<!-- made from the code: measures -->\n\n| old |\n\n<!-- made until here -->\nb\n'
    assert from_code.renewed(old) == old.replace('old', 'new')
    assert from_code.renewed('without') == 'without'


def test_every_picture_of_a_page_is_there():
    for page in PAGES:
        for name in re.findall(r'!\[[^\]]*\]\(([^):]+)\)', (ROOT / page).read_text('utf-8')):
            assert (ROOT / page).parent.joinpath(name).is_file(), f'{page}: {name}'


def test_a_name_without_a_sentence_is_refused(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    import from_code

    with pytest.raises(from_code.MissingSentenceError, match='the key b has no sentence'):
        from_code.explained(['a', 'b'], {'a': 'first'}, 'the key')


@pytest.mark.parametrize(
    'words',
    [
        'no joint state was received',
        'no complete joint state was received',
        'name no joint of',
        'a second node, ',
        'waiting for other joints',
        'positions jump: ',
        'reported velocities contradict the positions: ',
        'time by stamps is wrong: it passes ',
        'fine; velocities are differences of positions',
        'it has no publisher',
        'no kinematics node runs here',
        'it reports: ',
        'joint state rejected:',
        'position not finite',
        'did you mean --deg?',
        'two ROS installations are mixed',
        'this needs ROS 2 and its rclpy',
    ],
)
def test_messages_that_troubleshooting_quotes_are_those_of_the_code(words):
    assert words in (DOCS / 'how_to' / 'troubleshooting.md').read_text(encoding='utf-8')
    sources = (path.read_text(encoding='utf-8') for path in PACKAGE.rglob('*.py'))
    joined = re.compile(r"'\s*\n\s*f?'")
    assert any(words in joined.sub('', text) for text in sources)


@pytest.mark.parametrize('page', ['tutorials/warning.md', 'explanation/guarantees.md'])
def test_the_hysteresis_that_is_told_is_that_of_the_code(page):
    text = ' '.join((DOCS / page).read_text(encoding='utf-8').split())
    assert f'A level is left only at {HYSTERESIS:g} times its threshold' in text


def test_the_sentence_that_is_taken_apart_is_that_of_the_node():
    robot = ks.load_robot('ur5e')
    found = ks.singularity(robot, [0.1, -1.2, 1.4, -1.6, 0.02, 0.2], [0, 0, 0, 0, -0.1, 0])
    sentence = singularity_status(robot, found, found.level, 'base', '').sentence
    page = (DOCS / 'tutorials' / 'warning.md').read_text(encoding='utf-8')
    assert f'```text\n{sentence}\n```' in page


def test_every_file_that_a_recipe_or_the_architecture_names_is_there():
    recipes = (ROOT / 'CONTRIBUTING.md').read_text(encoding='utf-8').partition('## Recipes')[2]
    named = set(re.findall(r'`([\w/]+\.(?:py|pxd|xml|rst))`', recipes)) - {
        *('cli/NAME.py', 'estimation/NAME.py')
    }
    assert len(named) > 10
    page = (
        (DOCS / 'architecture.md').read_text(encoding='utf-8').partition('## Where to change')[2]
    )
    shown = set(re.findall(r'`([\w/]+(?:\.py|/))`', page)) - {'src/kinematics_service/'}
    assert len(shown) > 10
    named |= shown
    assert not {name for name in named if not any((at / name).exists() for at in (ROOT, PACKAGE))}
