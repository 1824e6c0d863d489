"""
Who may import what, and how files look: the rules of the design that a program can check.

"""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import kinematics_service as ks

PACKAGE = Path(ks.__file__).parent
FILES = sorted(path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob('*.py'))

# Files that may be longer than 300 lines, and why.
LONGEST = 300
LONGER = {
    'estimator.py': 'the one object with memory',
    'symbols/formula_syntax.py': 'one grammar, one parser',
    # Each one step of the comparison, a few lines over: to be split before it grows.
    'symbols/formula_comparison.py': 'comparison',
    'symbols/formula_edits.py': 'repairs of an expression',
    'symbols/formula_explanation.py': 'explanation',
    'symbols/formula_file.py': 'the file',
    'symbols/formula_statements.py': 'its statements',
    'symbols/formula_table.py': 'right values',
}


def of_ros(module):
    top = module.split('.')[0]
    if top == 'rosbags':  # reads and writes bags without ROS
        return False
    return top.startswith(('rcl', 'ros', 'tf2_', 'ament')) or top.endswith(
        ('_msgs', '_srvs', '_interfaces')
    )


def one_of(*names):
    return lambda module: module.split('.')[0] in names


# What is imported, and the files that may.
RULES = {
    'ROS': (of_ros, lambda file: file.startswith('ros/')),
    'compilers': (one_of('Cython', 'cython'), lambda file: False),
    'sympy': (one_of('sympy', 'mpmath'), lambda file: 'symbol' in file),
    'YAML': (
        one_of('ruamel', 'yaml'),
        lambda file: file in ('yaml_reader.py', 'robot_file_writer.py', 'audit/plan_yaml.py'),
    ),
    'matplotlib': (one_of('matplotlib'), lambda file: 'plot' in file),
    'the viewer': (one_of('viser', 'trimesh'), lambda file: 'view' in file),
    'XML': (
        one_of('xml', 'lxml', 'defusedxml'),
        lambda file: file in ('urdf/document.py', 'urdf/writer.py'),
    ),
    'dask': (one_of('dask', 'distributed'), lambda file: file == 'sweep.py'),
    'rosbags': (
        one_of('rosbags'),
        lambda file: (
            file
            in (
                'audit/bag_reader.py',
                'audit/bag_writer.py',
                'audit/ros1_index.py',
            )
        ),
    ),
    'scipy': (one_of('scipy'), lambda file: False),
}


def tree(file):
    return ast.parse((PACKAGE / file).read_text(encoding='utf-8'), file)


def imports(file):
    # Absolute names of every module imported anywhere in a file, inside functions too.
    package = ['kinematics_service', *file.split('/')[:-1]]
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            parts = [*above, *([node.module] if node.module else [])]
            yield '.'.join(parts)
            yield from ('.'.join([*parts, alias.name]) for alias in node.names)


def test_there_is_something_to_check():
    assert {'kernel/chain_pass.py', 'ros/node.py', 'commands/fk.py'} <= set(FILES)
    assert 'kinematics_service.kernel' in set(imports('ros/messages.py')) | set(imports('task.py'))


@pytest.mark.parametrize('rule', RULES)
def test_only_these_files_import(rule):
    concerns, may = RULES[rule]
    offenders = {
        file: sorted({module for module in imports(file) if concerns(module)})
        for file in FILES
        if not may(file) and any(map(concerns, imports(file)))
    }
    assert not offenders


def test_the_library_knows_neither_the_node_nor_the_command_line():
    for file in FILES:
        if file == '__main__.py' or file.startswith(('ros/', 'commands/')):
            continue
        outer = ('kinematics_service.ros', 'kinematics_service.commands')
        assert not [module for module in imports(file) if module.startswith(outer)], file


@pytest.mark.parametrize('file', FILES)
def test_every_module_has_a_docstring(file):
    docstring = ast.get_docstring(tree(file), clean=False)
    assert docstring
    assert docstring.startswith('\n') or len(docstring.splitlines()) == 1


@pytest.mark.parametrize('file', FILES)
def test_files_are_short(file):
    lines = len((PACKAGE / file).read_text(encoding='utf-8').splitlines())
    assert lines <= LONGEST or file in LONGER


@pytest.mark.parametrize('file', FILES)
def test_nothing_is_evaluated_from_text(file):
    called = {
        node.func.id
        for node in ast.walk(tree(file))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    assert not called & {'eval', 'exec', 'compile', '__import__'}


def modules_after(code):
    names = "print(*{name.split('.')[0] for name in __import__('sys').modules})"
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
        'names = [name for name, home in ks._HOME.items() if not home.startswith("symbols")]\n'
        '[getattr(ks, name) for name in names]\n'
        "ks.singularity(ks.load_robot('craig_3r'), [0.1, 0.2, 0.3])"
    )
    assert 'numpy' in loaded
    assert not loaded & {'rclpy', 'sympy', 'matplotlib', 'viser', 'typer', 'rich'}
    # A wheel of ROS may put a module of its own into every start of Python.
    assert not {name for name in loaded - modules_after('') if of_ros(name)}


def test_importing_the_package_alone_loads_nothing_heavy():
    loaded = modules_after('import kinematics_service')
    assert not loaded & {'numpy', 'ruamel', 'sympy', 'rclpy'}
