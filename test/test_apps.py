# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The core stands without its apps: to remove an app is to delete its folder."""

import ast
import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import kinematics_service as ks
from kinematics_service.app_modules import APP_MODULES, app_module
from kinematics_service.cli.commands import APPS, COMMANDS, home_of

PACKAGE = Path(ks.__file__).parent
ALL = sorted(file.parent.name for file in PACKAGE.glob('apps/*/__init__.py'))
RUN = """
import contextlib, io, json, sys

def each_of(lines):
    from kinematics_service.__main__ import main
    for line in lines:
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(out):
            code = main(line.split())
        yield code, out.getvalue()

results = []
for folder, lines in json.loads(sys.argv[1]):
    sys.path.insert(0, folder)
    results.append([*each_of(lines)])
    sys.path.remove(folder)
    for name in [name for name in sys.modules if name.startswith('kinematics_service')]:
        del sys.modules[name]
print(json.dumps(results))
"""
EACH_MODULE = """
import sys
from importlib import import_module
for name in sys.argv[1:]:
    import_module(name)
"""


def without(folder, *apps):
    """Return a folder with the package without some apps: links to all others."""
    package = folder / PACKAGE.name
    (package / 'apps').mkdir(parents=True)
    for path in [*PACKAGE.iterdir(), *PACKAGE.glob('apps/*')]:
        name = path.relative_to(PACKAGE)
        if path.name not in ('apps', '__pycache__', *apps):
            (package / name).symlink_to(path)
    return folder


def python(folder, program, *arguments):
    done = subprocess.run(
        [sys.executable, '-c', program, *arguments],
        cwd=folder,
        env={'PYTHONPATH': str(folder), 'PYTHONDONTWRITEBYTECODE': '1', 'HOME': str(folder)},
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def commands(folder, *lines):
    return json.loads(python(folder, RUN, json.dumps([(str(folder), lines)])))[0]


@pytest.fixture(scope='module')
def help_without(tmp_path_factory):
    """Return the help of the package without each of the apps; one process asks for all."""
    at = tmp_path_factory.mktemp('removed')
    asked = [(str(without(at / app, app)), ['--help']) for app in ALL]
    told = json.loads(python(at, RUN, json.dumps(asked)))
    return dict(zip(ALL, told))


def test_each_app_says_in_ten_lines_what_it_does():
    assert set(APPS.values()) == set(ALL)
    for app in ALL:
        text = (PACKAGE / 'apps' / app / '__init__.py').read_text(encoding='utf-8')
        tree = ast.parse(text)
        assert 3 <= len(ast.get_docstring(tree).splitlines()) <= 10, app
        assert len(tree.body) == 1, app  # nothing but these lines


def test_each_app_has_what_the_core_asks_of_it():
    pytest.importorskip('rclpy')
    for command in COMMANDS:
        assert find_spec(home_of(command)), command
    for task in APP_MODULES:
        assert app_module(task), task


def test_the_core_is_imported_without_any_app(tmp_path):
    folder = without(tmp_path, *ALL)
    # An installed package has the robot files, too, and a launch file among them.
    core = [path for path in PACKAGE.rglob('*.py') if not {'apps', 'config'} & {*path.parts}]
    names = [path.relative_to(PACKAGE.parent).with_suffix('') for path in core]
    modules = [
        '.'.join(name.parts).removesuffix('.__init__')
        for name in names
        if name.name != '__main__' and (find_spec('rclpy') or name.parts[1] != 'node')
    ]
    # The kernel is compiled, and its files are imported by their compiled units.
    python(folder, EACH_MODULE, *(name for name in modules if '.kernel.' not in name))


def test_the_core_works_without_any_app(tmp_path):
    folder = without(tmp_path, *ALL)
    (folder / 'table.csv').write_text('a,alpha,d,theta\n0.5,0,0,q1\n0.4,0,0,q2\n')
    printed, help_text, made, factory, check = commands(
        folder,
        'fk planar_2r --q 0.1,0.2',
        '--help',
        'new my_arm --table table.csv --convention standard --units rad,m',
        'import --ur-calibration table.csv --robot ur5e',
        'check ur5e',
    )
    assert printed[0] == made[0] == 0, (printed, made)
    assert (folder / 'my_arm.yaml').is_file()
    listed = listed_by(help_text[1])
    assert listed == {command for command in COMMANDS if command not in APPS}
    assert factory[0] == 2
    assert 'the app calibration, which reads it, was removed' in ' '.join(factory[1].split())
    assert check[0] == 2
    assert "unknown command 'check'" in check[1]
    program = 'import kinematics_service as ks; print(ks.load_robot("ur5e")._repr_html_())'
    assert python(folder, program) == 'None\n'


def listed_by(text):
    """Return the commands of a help, which follow its options."""
    lines = text.partition('Options:')[2].partition('\n\n')[2].splitlines()
    return {line.split()[0] for line in lines if line.startswith('  ')}


@pytest.mark.parametrize('app', ALL)
def test_a_removed_app_takes_its_commands_along(help_without, app):
    ((_, text),) = help_without[app]
    listed = listed_by(text)
    assert listed == {command for command in COMMANDS if APPS.get(command) != app}


@pytest.mark.ros
def test_without_recordings_the_demo_replays_none(tmp_path, ros_domain):
    folder = without(tmp_path, 'recordings', 'calibration', 'pictures')
    (folder / 'some.csv').write_text('')
    ((code, said),) = commands(folder, 'demo --replay some.csv')
    assert code == 1
    assert '--replay: the app recordings, which reads it, was removed' in said


def test_without_the_demo_a_plot_says_where_its_motions_were(tmp_path):
    pytest.importorskip('matplotlib')
    folder = without(tmp_path, 'demo')
    ((code, said),) = commands(folder, 'plot measures --robot planar_2r --path smooth')
    assert code == 2
    assert 'the app demo, which has the built-in motions, was removed' in ' '.join(said.split())
