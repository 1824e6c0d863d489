# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Who may import what, and how files look: the rules of the design that a program can check.

    python test/test_architecture.py [folder of the package]

prints the rooms of the package, the arrows of imports between them, layers and circles, and the
lines of the core's rooms and of the apps.
"""

import ast
import subprocess
import sys
from collections import Counter
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

import kinematics_service as ks

PACKAGE = Path(ks.__file__).parent
NAME = 'kinematics_service'

# The rooms from the lowest to the highest: a file imports from its own room and from lower ones.
ROOMS = (
    'kernel/layout',
    'kernel/forward',
    'kernel/loops',
    'kernel/measures',
    'kernel/singular_search',
    'kernel/clearance',
    'kernel/six_joints',
    'kernel/inverse',
    'kernel',
    '',  # errors, version, rotations, printing, signals: what every room may use
    'robot/file/text',
    'robot/file/parts',
    'robot/file/writing',
    'robot/file',
    'robot',
    'robot/urdf',
    'robot/tables',
    'kinematics',
    'kinematics/inverse/problem',
    'kinematics/inverse/self_motion',
    'kinematics/inverse',
    'kinematics/uncertainty',
    'estimation',
    'node/parameters',
    'node/drawing',
    'node/messages',
    'node',
    'node/process',
    'cli',
    'apps/checking',
    'apps/checking/commands',
    'apps/recordings',
    'apps/recordings/plans',
    'apps/recordings/readers',
    'apps/recordings/datasets',
    'apps/recordings/audit',
    'apps/recordings/audit/report',
    'apps/recordings/audit/dataset',
    'apps/recordings/commands',
    'apps/demo/motions',
    'apps/demo',
    'apps/demo/commands',
    'apps/export',
    'apps/export/commands',
    'apps/calibration/boards',
    'apps/calibration',
    'apps/calibration/output',
    'apps/calibration/commands',
    'apps/pictures/plots',
    'apps/pictures/view',
    'apps/pictures',
    'apps/pictures/commands',
    'apps/formulas/derive/algebra',
    'apps/formulas/arm',
    'apps/formulas/derive',
    'apps/formulas/derive/output',
    'apps/formulas/compare/text',
    'apps/formulas/compare/arm',
    'apps/formulas/compare/statements',
    'apps/formulas/compare/causes',
    'apps/formulas/compare',
    'apps/formulas/commands',
)
# The core, from the lowest to the highest; all else is an app of `apps/`.
CORE = ('kernel', '', 'robot', 'kinematics', 'estimation', 'node', 'cli')
# The other apps that an app may use; docs/architecture.md says what for.
OF_APPS = {
    'apps/recordings': {'apps/checking'},
    'apps/calibration': {'apps/recordings', 'apps/checking'},
    'apps/pictures': {'apps/recordings'},
    'apps/formulas': {'apps/pictures'},
}
# Lines of code, without docstrings, comments and blanks: of the core with the kernel, of an app.
CORE_LINES, APP_LINES = 30_000, 8_000
# Public annotations of functions, methods and fields with `Any` or `object`, where nothing
# narrower is true. The number only shrinks.
OPEN_ANNOTATIONS = 116
# They lead into the house: from them every room may be entered.
DOORS = ('__init__.py', '__main__.py')


def of_ros(module):
    top = module.split('.')[0]
    if top == 'rosbags':  # reads and writes bags without ROS
        return False
    return top.startswith(('rcl', 'ros', 'tf2_', 'ament')) or top.endswith(
        ('_msgs', '_srvs', '_interfaces')
    )


def one_of(*names):
    return lambda module: module.split('.')[0] in names


# What is imported, and the files or folders that may.
RULES = {
    'ROS': (
        of_ros,
        (
            'node/',
            'apps/demo/',
            'apps/calibration/calibration_session.py',
            'apps/pictures/view/node_facts.py',
            'apps/pictures/view/view_listener.py',
            'apps/pictures/view/view_outputs.py',
            'apps/pictures/view/view_session.py',
        ),
    ),
    'compilers': (one_of('numba', 'llvmlite', 'Cython', 'cython'), ()),
    'sympy': (one_of('sympy', 'mpmath'), ('apps/formulas/',)),
    'YAML': (
        one_of('yaml', 'ruamel'),
        (
            'robot/file/text/yaml_reader.py',
            'robot/file/writing/writer.py',
            'apps/calibration/file_sections.py',
        ),
    ),
    'matplotlib': (one_of('matplotlib'), ('apps/pictures/plots/',)),
    'the viewer': (one_of('viser', 'trimesh'), ('apps/pictures/view/',)),
    'XML': (
        one_of('xml', 'lxml', 'defusedxml'),
        ('robot/urdf/document.py', 'robot/urdf/writer.py'),
    ),
    'pyarrow and h5py': (
        one_of('pyarrow', 'h5py'),
        (
            'apps/recordings/datasets/',
            'apps/recordings/audit/dataset/labels.py',
            'apps/recordings/audit/dataset/episode_audit.py',
        ),
    ),
    'OpenCV': (one_of('cv2'), ('apps/calibration/boards/opencv.py',)),
    'dask': (one_of('dask', 'distributed'), ('apps/recordings/sweep.py',)),
    'rosbags': (
        one_of('rosbags'),
        (
            'apps/recordings/readers/bag_reader.py',
            'apps/recordings/readers/unpacking.py',
            'apps/recordings/audit/report/bag_writer.py',
        ),
    ),
    'scipy': (one_of('scipy'), ()),
}


DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


@cache
def files(package=PACKAGE):
    return sorted(path.relative_to(package).as_posix() for path in package.rglob('*.py'))


class Content(NamedTuple):
    """What the rules ask of a file."""

    documented: bool
    imports: frozenset[str]  # absolute names, also of what is imported inside functions
    calls: frozenset[str]  # names of functions that are called by their name alone
    classes: tuple[str, ...]
    lines_of_code: int  # without docstrings, comments and blank lines
    open_annotations: tuple[str, ...]  # `line: text` of public ones with Any or object


@cache
def content(file, package):
    """Return what stands in a file; the tree is not kept, it is what takes memory and time."""
    text = (package / file).read_text(encoding='utf-8')
    tree = ast.parse(text, file)
    imports, calls, classes = set(), set(), []
    docstrings, strings = set(), set()
    folder = [NAME, *file.split('/')[:-1]]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = folder[: len(folder) - node.level + 1] if node.level else []
            parts = [*above, *([node.module] if node.module else [])]
            imports.add('.'.join(parts))
            imports.update('.'.join([*parts, alias.name]) for alias in node.names)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            calls.add(node.func.id)
        elif isinstance(node, ast.ClassDef):
            classes.append(node.name)
        elif isinstance(node, (ast.Constant, ast.JoinedStr)):
            strings.update(range(node.lineno, node.end_lineno + 1))
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            docstrings.update(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    lines = {
        number
        for number, line in enumerate(text.splitlines(), start=1)
        if (number in strings or line.strip() and not line.lstrip().startswith('#'))
    }
    annotations = (f'{line}: {annotation}' for line, annotation in open_annotations(tree.body))
    return Content(
        documented=bool(ast.get_docstring(tree)),
        imports=frozenset(imports),
        calls=frozenset(calls),
        classes=tuple(classes),
        lines_of_code=len(lines - docstrings),
        open_annotations=tuple(annotations),
    )


@cache
def arrows(package=PACKAGE):
    """Return whom each file imports, of the package's own files."""
    file_of = {}
    for file in files(package):
        parts = [NAME, *file.removesuffix('.py').split('/')]
        file_of['.'.join(parts[:-1] if parts[-1] == '__init__' else parts)] = file
    result = {}
    for file in files(package):
        named = {
            module: file_of[module]
            for module in content(file, package).imports
            if module in file_of
        }
        # `from . import x` names the folder too, but imports the module.
        found = {
            target
            for module, target in named.items()
            if not any(other.startswith(f'{module}.') for other in named)
            or not target.endswith('__init__.py')
        }
        result[file] = found - {file}
    return result


def room_of(file):
    folder = file.rpartition('/')[0]
    while folder and folder not in ROOMS:
        folder = folder.rpartition('/')[0]
    return folder


def area_of(file):
    """Return the room of the core, or the app, that a file belongs to."""
    folders = file.split('/')[:-1]
    return '/'.join(folders[: 2 if folders[:1] == ['apps'] else 1])


def lines_of_areas(package=PACKAGE):
    lines = Counter()
    for file in files(package):
        lines[area_of(file)] += content(file, package).lines_of_code
    return lines


def open_annotations(nodes, is_open=frozenset({'Any', 'object'})):
    """Yield the line and text of each public annotation in nodes that contains Any or object."""
    for node in nodes:
        annotations = []
        if isinstance(node, (ast.If, ast.Try)):
            yield from open_annotations([*node.body, *node.orelse])
            continue
        if isinstance(node, ast.AnnAssign):
            name, annotations = ast.unparse(node.target), [node.annotation]
        elif isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            name = node.name
        else:
            continue
        if name.startswith('_') and not name.endswith('__') or name in ('__eq__', '__ne__'):
            continue
        if isinstance(node, ast.ClassDef):
            yield from open_annotations(node.body)
        elif isinstance(node, ast.FunctionDef):
            a = node.args
            given = [*a.posonlyargs, *a.args, a.vararg, *a.kwonlyargs, a.kwarg]
            annotations = [*(one.annotation for one in given if one), node.returns]
        for annotation in filter(None, annotations):
            words = {w.id for w in ast.walk(annotation) if isinstance(w, ast.Name)}
            if words & is_open:
                yield node.lineno, f'{name}: {ast.unparse(annotation)}'


def circles(graph):
    """Return the groups of nodes that reach each other."""
    reach = {node: reached_from(graph, node) for node in graph}
    found = set()
    for node in graph:
        group = frozenset(other for other in reach[node] if node in reach[other])
        if group:
            found.add(group)
    return found


def rooms(package=PACKAGE):
    """Return the rooms, and of each those that it imports."""
    # A folder is a room; so is each file that stands beside the folders at the top.
    graph = {}
    for file, targets in arrows(package).items():
        if file not in DOORS:
            room = file.rpartition('/')[0] or file
            graph.setdefault(room, set())
            for target in targets - set(DOORS):
                graph[room].add(target.rpartition('/')[0] or target)
    for room, targets in graph.items():
        targets.discard(room)
    return graph


def reached_from(graph, start):
    seen, waiting = set(), list(graph[start])
    while waiting:
        node = waiting.pop()
        if node not in seen:
            seen.add(node)
            waiting += graph[node]
    return seen


def test_there_is_something_to_check():
    assert {'kernel/forward/chain_pass.py', 'node/node.py', 'cli/fk.py'} <= set(files())
    assert all(any(room_of(file) == room for file in files()) for room in ROOMS)
    assert 'robot/chain.py' in arrows()['robot/robot.py']


def test_imports_run_downwards():
    upward = {
        (file, target)
        for file, targets in arrows().items()
        if file not in DOORS
        for target in targets
        if ROOMS.index(room_of(target)) > ROOMS.index(room_of(file))
    }
    assert not upward


def test_the_core_imports_no_app_and_an_app_no_other():
    found = set()
    for file, targets in arrows().items():
        for target in targets if file not in DOORS else ():
            above, below = area_of(file), area_of(target)
            if above in CORE:
                may = CORE[: CORE.index(above) + 1]
            else:
                may = {*CORE, above, *OF_APPS.get(above, ())}
            if below not in may:
                found.add((file, target))
    assert not found


def test_the_apps_are_those_of_the_page():
    page = (Path(__file__).parents[1] / 'docs' / 'architecture.md').read_text(encoding='utf-8')
    apps = {area for area in map(area_of, files()) if area.startswith('apps/')}
    assert OF_APPS.keys() < apps
    assert all(f'`{app}/`' in page for app in apps)
    for app, used in OF_APPS.items():
        names = ', '.join(sorted(one.removeprefix('apps/') for one in used))
        assert f'{app.removeprefix("apps/")} -> {names}' in page


@pytest.mark.slow
def test_the_core_and_each_app_can_be_held():
    lines = lines_of_areas()
    sums = {'core': sum(lines[room] for room in CORE)}
    sums |= {area: count for area, count in lines.items() if area not in CORE}
    larger = {
        area: count
        for area, count in sums.items()
        if count > (CORE_LINES if area == 'core' else APP_LINES)
    }
    assert not larger


def test_public_annotations_say_their_types():
    found = [
        f'{file}:{text}' for file in files() for text in content(file, PACKAGE).open_annotations
    ]
    assert len(found) <= OPEN_ANNOTATIONS, '\n'.join(found)


def test_imports_never_run_in_a_circle():
    inside = {file: targets for file, targets in arrows().items() if file not in DOORS}
    assert not circles({file: targets & inside.keys() for file, targets in inside.items()})
    assert not circles(rooms())


def test_only_these_files_import():
    offenders = {
        (name, file)
        for name, (concerns, may) in RULES.items()
        for file in files()
        if not file.startswith(may or ('-',))
        and any(map(concerns, content(file, PACKAGE).imports))
    }
    assert not offenders


def test_every_module_has_a_docstring():
    assert not [file for file in files() if not content(file, PACKAGE).documented]


def test_a_class_name_stands_for_one_thing():
    homes = {}
    for file in files():
        for name in content(file, PACKAGE).classes:
            homes.setdefault(name.lstrip('_'), []).append(file)
    assert not {name: where for name, where in homes.items() if len(where) > 1}


def test_nothing_is_evaluated_from_text():
    evaluating = {'eval', 'exec', 'compile', '__import__'}
    assert not [file for file in files() if content(file, PACKAGE).calls & evaluating]


def modules_after(code, whole=False):
    """Return the modules loaded after some lines: their whole names, or the first words."""
    part = 'name' if whole else "name.split('.')[0]"
    names = f"print(*{{{part} for name in __import__('sys').modules}})"
    result = subprocess.run(
        [sys.executable, '-c', f'{code}\n{names}'],
        capture_output=True,
        text=True,
        timeout=100,
        check=True,
    )
    return set(result.stdout.split())


def test_the_library_needs_neither_ros_nor_sympy_nor_matplotlib():
    loaded = modules_after(
        'import kinematics_service as ks\n'
        'formulas = ".apps.formulas."\n'
        'names = [name for name, home in ks._HOME.items() if not home.startswith(formulas)]\n'
        '[getattr(ks, name) for name in names]\n'
        "ks.singularity(ks.load_robot('craig_3r'), [0.1, 0.2, 0.3])"
    )
    assert 'numpy' in loaded
    assert not loaded & {'rclpy', 'sympy', 'matplotlib', 'viser', 'typer', 'rich'}
    # A wheel of ROS may put a module of its own into every start of Python.
    assert not {name for name in loaded - modules_after('') if of_ros(name)}


def test_importing_the_package_alone_loads_nothing_heavy():
    loaded = modules_after(f'import {NAME}') - modules_after('')
    assert not loaded & {'numpy', 'yaml', 'sympy', 'rclpy'}


# What the command line, a page or a picture needs, and a message or a second does not.
NOT_AT_THE_START = {
    *('typer', 'click', 'pydantic', 'rich', 'sympy', 'matplotlib', 'viser', 'rosbags', 'scipy'),
    *('importlib.metadata', 'email', 'http', 'xml.etree', 'ruamel'),
    *(f'{NAME}.{room}' for room in ('apps', 'robot.urdf', 'robot.tables', 'node.drawing')),
    *(f'{NAME}.{file}' for file in ('cli.commands', 'printing', 'version')),
}


def test_the_start_of_the_node_loads_nothing_that_only_a_command_needs(ros_domain):
    loaded = modules_after(
        'from kinematics_service.cli.command_line import run\n'
        'from kinematics_service.node.process.spin import Spinner\n'
        # Everything up to the first message that could come.
        'Spinner.spin = lambda self, stopped, turn: True\n'
        "assert run(['--robot', 'ur5e']) == 0",
        whole=True,
    )
    assert {'numpy', f'{NAME}.node.node', f'{NAME}.kernel.forward.chain_pass'} <= loaded
    # A package of others may put a module into every start of Python.
    assert not (loaded - modules_after('', whole=True)) & NOT_AT_THE_START


def layers_of(graph):
    """Return how many nodes stand one above the other; those of a circle count as one."""
    groups = {node: node for node in graph}
    for group in circles(graph):
        first = min(group)
        groups.update(dict.fromkeys(group, first))
    above = {}
    for node, targets in graph.items():
        one = groups[node]
        above.setdefault(one, set()).update(groups[target] for target in targets)
        above[one].discard(one)

    @cache
    def height(node):
        return 1 + max(map(height, above[node]), default=0)

    return max(map(height, above))


def main():
    package = Path(sys.argv[1]) if len(sys.argv) > 1 else PACKAGE
    graph = rooms(package)
    count = sum(map(len, graph.values()))
    found = circles(graph)
    print(f'{len(files(package))} files in {len(graph)} rooms, {count} arrows between rooms,')
    print(f'{layers_of(graph)} layers, {len(found)} circles')
    for group in found:
        print('  circle:', *sorted(group))
    lines = lines_of_areas(package)
    print(f'{sum(lines[room] for room in CORE):,} lines of {sum(lines.values()):,} are the core')
    for area, count in lines.most_common():
        print(f'  {area or "beside the rooms"} {count:,}')


if __name__ == '__main__':
    main()
