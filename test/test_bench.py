"""The benchmarks are run by hand: what they take from the package must still be there."""

import ast
import importlib
from importlib.util import find_spec

from folders import BENCH

from kinematics_service import kernel

NAME = 'kinematics_service'
FILES = sorted(BENCH.glob('*.py'))


def nodes(file):
    return list(ast.walk(ast.parse(file.read_text(encoding='utf-8'))))


def imported(file):
    for node in nodes(file):
        if isinstance(node, ast.ImportFrom) and (node.module or '').split('.')[0] == NAME:
            yield from ((node.module, alias.name) for alias in node.names)


def test_what_benchmarks_import_of_the_package_exists():
    taken = {place for file in FILES for place in imported(file)}
    if find_spec('rclpy') is None:
        taken = {place for place in taken if not place[0].startswith(f'{NAME}.ros')}
    assert len(taken) > 20
    for module, name in taken:
        if not hasattr(importlib.import_module(module), name):
            importlib.import_module(f'{module}.{name}')


def test_what_benchmarks_take_of_the_kernel_exists():
    taken = {
        (file.name, node.attr)
        for file in FILES
        for node in nodes(file)
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == 'kernel'
    }
    assert ('kernel.py', 'evaluate_one') in taken
    assert not {place for place in taken if not hasattr(kernel, place[1])}
