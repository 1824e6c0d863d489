# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the kernel's Python source as Cython source, with C types from its annotations.

Files that are compiled together become one .pyx file. Its .pxd file declares the names that other
modules use.

A function becomes a C function if each of its annotations has a C type and its body needs only C.
Python can call a function if `kernel/__init__.pyi` exports it. Such a function refuses None as an
object. A class without a base becomes a C structure. Its fields have annotations, or `__init__`
gives them values of a C type. If the class is exported, Python can read its numbers and objects.
An object keeps the arrays whose addresses it holds, and frees the memory that it asked for. The
compiler finds the types of most local variables; the others are annotated in the source.
"""

import ast
import copy
import functools
import hashlib
import re
import runpy
from collections.abc import Mapping, Sequence
from pathlib import Path

from kernel_units import KernelUnits

# The C type of each annotation: numbers, and addresses of numbers.
C_TYPES = {
    'float': 'double',
    'int': 'Py_ssize_t',
    'bool': 'bint',
    'None': 'void',
    'Int32': 'int',
    'Nanoseconds': 'long long',
    'Numbers': 'double*',
    'Flat': 'double*',
    'WholeNumbers': 'long long*',
    'FlatIntegers': 'long long*',
    'FlatBytes': 'unsigned char*',
    'Vector': 'Triple',
    'Complex': 'Pair',
}
OBJECTS = dict.fromkeys(('Floats', 'Integers', 'Bytes'), 'ndarray') | {'bytes': 'bytes'}
TUPLES = {'(double, double)': 'Pair', '(double, double, double)': 'Triple'}
# Functions that give an object memory of its own, and functions that return addresses of arrays.
ROOMS = {'arrays.rooms': 'double*', 'arrays.whole_rooms': 'long long*'}
ADDRESSES = [
    *('arrays.numbers', 'arrays.results', 'arrays.whole', 'arrays.whole_results'),
    *('arrays.octets', 'arrays.octets_to_fill'),
]
ONLY_PYTHON = (ast.GeneratorExp, ast.ListComp, ast.SetComp, ast.DictComp)
# Functions that are compiled a second time for processors with AVX2. There, the measures of one
# pose take 0.85 of the time.
AVX2 = {
    'chain_pass': ['sines_and_cosines'],
    'singular_values': ['orthogonalise'],
}
INLINE = {
    'chain_pass': ['_sincos_reduced'],
    'jacobian_changes': ['_write_cross', '_add_turn'],
}
# Classes that have subclasses in Python. All other classes are final, so calls of their methods
# are direct.
OPEN = ('JointMemory',)
IN_C = {'nan': 'Py_NAN', 'inf': 'Py_HUGE_VAL', "b''": '""'}
CLONES = '''cdef extern from *:
    """
    #if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
    static {result} {symbol}({kinds}) __attribute__((target_clones("avx2", "default")));
    #endif
    """
'''


class KernelTypes:
    """
    The types of the modules in a kernel's folder.

    Parameters
    ----------
    folder
        The folder. Its files `layout/arrays.pxd` and `layout/math.pxd` are written by hand.
    included
        Files that are compiled as a part of each module that imports them.
    units
        For each compiled module, the other files that it contains.
    """

    def __init__(
        self, folder: Path, included: tuple[str, ...], units: Mapping[str, Sequence[str]]
    ) -> None:
        self.folder, self.included = folder, included
        self.trees = {
            file: ast.parse(file.read_text(encoding='utf-8')) for file in folder.rglob('*.py')
        }
        self.files = {file.stem: file for file in self.trees if file.stem != '__init__'}
        self.exported = {
            alias.name
            for node in ast.parse((folder / '__init__.pyi').read_text(encoding='utf-8')).body
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        nodes = [(node, file) for file, tree in self.trees.items() for node in tree.body]
        self.classes = {node.name: (node, file) for node, file in nodes if is_structure(node)}
        arrays = (folder / 'layout' / 'arrays.pxd').read_text(encoding='utf-8')
        declared = re.findall(r'(\w+)\([^()]*\) (except|noexcept)', arrays)
        self._of_arrays = {f'arrays.{name}': how == 'except' for name, how in declared}
        trees = {name: self.trees[file] for name, file in self.files.items()}
        self.units = KernelUnits(trees, units, self.exported)

    def check(self) -> None:
        """Raise TypeError if a function that AVX2 or INLINE names does not exist."""
        for tables in (AVX2, INLINE):
            for module, names in tables.items():
                for name in names:
                    if f'{module}.{name}' not in self._functions:
                        raise TypeError(
                            f'kernel_types.py names {module}.{name}, which does not exist'
                        )

    @functools.cached_property
    def _functions(self) -> dict[str, tuple[ast.FunctionDef, Path, ast.ClassDef | None]]:
        # Maps `module.function` or `Class.method` to the function, its file and its class.
        found = {}
        for file, tree in self.trees.items():
            for owner in (None, *(node for node in tree.body if is_structure(node))):
                for node in (owner or tree).body:
                    if isinstance(node, ast.FunctionDef) and not node.name.startswith('__'):
                        key = f'{owner.name if owner else file.stem}.{node.name}'
                        found[key] = node, file, owner
        return found

    def included_text(self, file: Path) -> str:
        """Return the .pxd of an included file; it may be written by hand."""
        if (written := file.with_suffix('.pxd')).exists():
            return written.read_text(encoding='utf-8')
        functions = [node for node in self.trees[file].body if isinstance(node, ast.FunctionDef)]
        if not functions:
            return included_numbers(file)
        up = '.' * len(file.relative_to(self.folder).parts)
        lines = [f'from {up}layout.arrays cimport Pair, Triple, ndarray']
        for node in functions:
            lines += self._function(node, file, None)
            lines += indented(node.body[1:])
        return '\n'.join(lines) + '\n'

    @functools.cached_property
    def _hash_of_included(self) -> str:
        texts = [self.included_text(self.files[name]) for name in self.included]
        return hashlib.sha256(''.join(texts).encode()).hexdigest()

    def declarations(self, unit: str) -> str:
        """Return the .pxd of a unit: its classes, and its names that other units use."""
        lines = []
        for file, nodes in self._statements(unit):
            shared = self.units.shared[unit]
            lines += [f'cdef class {node.name}' for node, _ in nodes if is_structure(node)]
            lines += numbers([new for _, new in nodes], shared)
            for node, _ in nodes:
                if is_structure(node):
                    lines += self._structure(node, file)
                elif (
                    isinstance(node, ast.FunctionDef)
                    and self.units.name_of(file.stem, node.name) in shared
                ):
                    lines += self._function(node, file, None, declared=True)
        return '\n'.join([*needed_cimports(self._cimports(unit), lines), *lines]) + '\n'

    def source(self, unit: str) -> str:
        """Return the .pyx of a unit: its files, one after the other."""
        # Cython does not notice changes of included files, so the first line holds their hash.
        lines = [f'# {self._hash_of_included}', *self._cimports(unit), *self._imports(unit)]
        for file, nodes in self._statements(unit):
            lines += numbers([new for _, new in nodes], self.units.shared[unit], others=True)
            for node, new in nodes:
                if is_structure(node):
                    lines += self._class(node, new, file)
                elif isinstance(node, ast.FunctionDef):
                    lines += self._defined(node, new, file, None)
                else:
                    lines += ast.unparse(new).splitlines()
        # Cython refuses an object of Python, or a call that may raise, in such a block.
        return '\n'.join(lines).replace('with arrays.without_lock():', 'with nogil:') + '\n'

    def _statements(self, unit: str) -> list[tuple[Path, list[tuple[ast.stmt, ast.stmt]]]]:
        # Returns for each file its statements, as in the file and as in the unit, without imports
        # and docstring.
        return [
            (
                self.files[name],
                [
                    (node, new)
                    for node, new in zip(
                        self.trees[self.files[name]].body, self.units.joined[name]
                    )
                    if not isinstance(node, ast.Import | ast.ImportFrom | ast.Expr)
                ],
            )
            for name in self.units.files[unit]
        ]

    def _place(self, name: str) -> str:
        # Returns the package of an included file, relative to the units.
        *rooms, _ = self.files[name].relative_to(self.folder).parts
        return '.'.join(['', *rooms]) if rooms else '.'

    def _cimports(self, unit: str) -> list[str]:
        lines = ['cimport cython', 'from .layout.arrays cimport Pair, Triple, ndarray']
        lines += ['from .layout cimport math']
        lines += [f'from .{of} cimport {name}' for of, name in sorted(self.units.used[unit])]
        for module, name in self._imported(unit):
            if module in self.included and not name:
                lines.append(f'from {self._place(module)} cimport {module}')
            elif name in self.classes and self.units.unit_of[module] != unit:
                lines.append(f'from .{self.units.unit_of[module]} cimport {name}')
        return lines

    def _imports(self, unit: str) -> list[str]:
        # Returns the imports of names that exist only in Python.
        lines = []
        for name in self.units.files[unit]:
            for node in self.trees[self.files[name]].body:
                if (
                    isinstance(node, ast.Import)
                    or isinstance(node, ast.ImportFrom)
                    and not node.level
                ):
                    lines.append(ast.unparse(node))
        for module, name in self._imported(unit):
            if module in self.included:
                place = self._place(module)
                of = f'{place.rstrip(".")}.{module}' if name else place
                lines.append(f'from {of} import {name or module}')
            elif name and name not in self.classes and self.units.unit_of[module] != unit:
                joined = self.units.name_of(module, name)
                lines.append(f'from .{self.units.unit_of[module]} import {joined}')
        return list(dict.fromkeys(lines))

    def _imported(self, unit: str) -> list[tuple[str, str]]:
        # Returns the names that the files of a unit import from other files, without repetition.
        files = self.units.files[unit]
        return sorted({one for name in files for one in self.units.imports(name).values()})

    def _structure(self, node: ast.ClassDef, file: Path) -> list[str]:
        exported = node.name in self.exported
        lines = [] if node.name in OPEN else ['@cython.final']
        lines.append(f'cdef class {node.name}:')
        for name, kind in self._fields(node, file).items():
            kind = kind.replace('ndarray', '') or 'object'
            is_public = 'Public[' in ast.unparse(fields(node).get(name, ast.Constant(None)))
            access = 'public ' if is_public else 'readonly '
            seen = exported and '*' not in kind and not name.startswith('_')
            lines.append(f'    cdef {access if seen else ""}{kind} {name}')
        for method in node.body:
            if isinstance(method, ast.FunctionDef) and not method.name.startswith('__'):
                declared = self._function(method, file, node, declared=True)
                lines += [f'    {line}' for line in declared]
        return lines

    def _fields(self, node: ast.ClassDef, file: Path) -> dict[str, str]:
        # Returns the type of each field, from its annotation or from its value in `__init__`.
        found = {name: self.c_type(annotation) for name, annotation in fields(node).items()}
        constants = dict(pair for one in self.trees[file].body for pair in pairs_of(one))
        for init in (one for one in node.body if is_init(one)):
            given = {name: self._kind(value, {}, file) for name, value in constants.items()}
            given |= {one.arg: self.c_type(one.annotation) or 'object' for one in init.args.args}
            pairs = (pair for one in init.body for pair in assigned(one))
            for target, value in pairs:
                given |= {f'self.{name}': kind for name, kind in found.items()}
                kind = self._kind(value, given, file)
                if isinstance(target, ast.Name):
                    given[target.id] = kind
                elif isinstance(target, ast.Attribute) and kind:
                    found.setdefault(target.attr, kind)
            found |= {'_kept': ''} if kept_by(init) and '_arrays' not in found else {}
            found |= {'_room': 'double*'} if rooms_of(init) else {}
        return found

    def _kind(self, value: ast.expr, given: Mapping[str, str], file: Path) -> str:
        # Returns the type of the value of a field, or '' if the value does not show it.
        match value:
            case ast.Constant(bool() | int() as one):
                return C_TYPES[type(one).__name__]
            case ast.IfExp(_, one, _) | ast.UnaryOp(ast.USub(), one):
                return self._kind(one, given, file)
            case ast.BinOp(one, operator, other):
                kinds = {self._kind(one, given, file), self._kind(other, given, file)}
                whole = kinds == {C_TYPES['int']} and not isinstance(operator, ast.Div)
                return C_TYPES['int' if whole else 'float'] if whole or 'double' in kinds else ''
            case ast.Call(ast.Name('len')):
                return C_TYPES['int']
            case ast.Call(ast.Name(name)) if name in self.classes:
                return name
            case ast.Call(function) if ast.unparse(function).startswith('math.'):
                return C_TYPES['float']
            case ast.Call(function):
                node, *_ = self._functions.get(called(value, file.stem, ''), (None,))
                return ROOMS.get(ast.unparse(function)) or self.c_type(node and node.returns)
            case ast.Attribute(one, name) if (of := self._kind(one, given, file)) in self.classes:
                return self._fields(*self.classes[of]).get(name, '')
        return given.get(ast.unparse(value), kind_of(value))

    def _doors(self, node: ast.FunctionDef, owner: ast.ClassDef | None) -> list[str]:
        # Returns the arguments that Python gives to a function or class and that may be None.
        if owner and not is_init(node) or (owner or node).name not in self.exported:
            return []
        return [
            one.arg
            for one in node.args.args
            if self.c_type(one.annotation) in self.classes
            and 'None' not in ast.unparse(one.annotation)
        ]

    def _class(self, node: ast.ClassDef, new: ast.ClassDef, file: Path) -> list[str]:
        lines = [] if node.name in OPEN else ['@cython.final']
        lines.append(f'cdef class {node.name}:')
        keeps = '_arrays' not in fields(node)
        for one, renamed in zip(node.body, new.body):
            if is_init(one):
                renamed = with_memory(renamed, keeps)
                if rooms_of(one):
                    lines += ['    def __dealloc__(self):', '        arrays.give_back(self._room)']
            if isinstance(one, ast.FunctionDef):
                lines += [f'    {line}' for line in self._defined(one, renamed, file, node)]
            elif not isinstance(one, ast.AnnAssign):
                lines += indented([renamed])
        return lines

    def _defined(
        self, node: ast.FunctionDef, new: ast.FunctionDef, file: Path, owner: ast.ClassDef | None
    ) -> list[str]:
        lines = [] if node.name.startswith('__') else self._function(node, file, owner)
        if doors := self._doors(node, owner):
            new, at = copy.copy(new), 1 if ast.get_docstring(new) else 0
            refusals = [f'arrays.given({name})' for name in doors]
            new.body = [*new.body[:at], *ast.parse('\n'.join(refusals)).body, *new.body[at:]]
        return [*lines, *indented(new.body)] if lines else ast.unparse(new).splitlines()

    def _function(
        self,
        node: ast.FunctionDef,
        file: Path,
        owner: ast.ClassDef | None,
        declared: bool = False,
    ) -> list[str]:
        # Returns the head of a C function, as definition or declaration; [] for a Python function.
        module = file.stem
        seen = (owner or node).name in self.exported and not node.name.startswith('_')
        key = f'{owner.name if owner else module}.{node.name}'
        names = [one.arg for one in node.args.args]
        kinds = [self.c_type(one.annotation) for one in node.args.args if one.arg != 'self']
        result = self.c_type(node.returns)
        if (
            node.decorator_list
            or not (result and all(kinds))
            or result in OBJECTS.values()
            or not seen
            and set(kinds) == {'ndarray'}
            or any(isinstance(one, ONLY_PYTHON) for one in ast.walk(node))
        ):
            return []
        raising = key in self._raising or set(OBJECTS.values()) & {*kinds, result}
        how = 'cpdef' if seen and not any('*' in kind for kind in kinds) else 'cdef'
        lines, symbol = [], ''
        if node.name in AVX2.get(module, ()):
            name = f'kinematics_{module}_{node.name}'
            symbol = f' "{name}"'
            lines = CLONES.format(result=result, symbol=name, kinds=', '.join(kinds)).splitlines()
        # Its callers give the number of lanes as a constant, so the compiler makes two versions.
        inline = node.name[0] == '_' and names[-1:] == ['lanes']
        inline = inline or module in self.included or node.name in INLINE.get(module, ())
        if own := ', '.join(f"{name}='{kind}'" for name, kind in self._own(node).items()):
            lines.append(f'@cython.locals({own})')
        typed = [name for name in names if name == 'self']
        typed += [f'{kind} {name}' for kind, name in zip(kinds, names[len(typed) :])]
        result = result.replace('void', 'object') if raising else result
        joined = node.name if owner else self.units.name_of(module, node.name)
        head = (
            f'{result} {joined}{symbol}({", ".join(typed)}){"" if raising else " noexcept nogil"}'
        )
        if declared:
            return [f'{how} {head}']
        return [*lines, f'{how} {"inline " * inline}{head}:']

    def _own(self, node: ast.FunctionDef) -> dict[str, str]:
        # Returns the types of local variables whose type the compiler does not find.
        found, annotated = {}, {}
        for one in ast.walk(node):
            if isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name):
                annotated[one.target.id] = self.c_type(one.annotation)
            elif isinstance(one, ast.stmt):
                pairs = [(name, kind_of(value)) for name, value in pairs_of(one)]
                found |= {name: kind for name, kind in pairs if kind}
        return found | annotated

    def c_type(self, annotation: ast.expr | None) -> str:
        """Return the C type of an annotation, or '' if it has none."""
        match annotation:
            case ast.Constant(str(quoted)):
                return self.c_type(ast.parse(quoted, mode='eval').body)
            case ast.Constant(None):
                return C_TYPES['None']
            case ast.BinOp(wanted, ast.BitOr(), ast.Constant(None)):
                return self.c_type(wanted)
            case ast.Subscript(ast.Name('Public'), wanted):
                return self.c_type(wanted)
            case ast.Subscript(ast.Name('tuple'), ast.Tuple(parts)):
                kinds = [self.c_type(part) for part in parts]
                written = f'({", ".join(kinds)})'
                plain = all(kinds) and not set(kinds) & {*OBJECTS.values(), *self.classes}
                return TUPLES.get(written, written) if plain else ''
            case ast.Name(name):
                return (C_TYPES | OBJECTS | {one: one for one in self.classes}).get(name, '')
        return ''

    @functools.cached_property
    def _raising(self) -> set[str]:
        # Returns the functions that may raise, as `module.function` or `Class.method`.
        found = {name for name, raises in self._of_arrays.items() if raises}
        calls = {
            key: called_by(node, file.stem, key.partition('.')[0])
            for key, (node, file, _) in self._functions.items()
            if file.stem not in self.included
        }
        found |= {key for key, names in calls.items() if 'raise' in names}
        found |= {key for key, (node, _, of) in self._functions.items() if self._doors(node, of)}
        while more := {key for key, names in calls.items() if names & found} - found:
            found |= more
        return found


def needed_cimports(cimports: list[str], lines: list[str]) -> list[str]:
    """Return the cimports of a module whose names occur in its declarations."""
    words = set(re.findall(r'\w+', '\n'.join(lines)))
    needed = []
    for cimport in cimports:
        start, _, names = cimport.rpartition('cimport ')
        if kept := [name for name in names.split(', ') if name in words]:
            needed.append(f'{start}cimport {", ".join(kept)}')
    return needed


def called_by(node: ast.FunctionDef, module: str, owner: str) -> set[str]:
    """
    Return the functions and methods that a function calls, and `raise` if it raises or makes an
    object.
    """
    calls = [one for one in ast.walk(node) if isinstance(one, ast.Call)]
    names = {called(call, module, owner) for call in calls}
    raises = any(isinstance(one, ast.Raise) for one in ast.walk(node))
    return names | ({'raise'} if raises else set())


def called(call: ast.Call, module: str, owner: str) -> str:
    """Return the called function as `module.function` or `Class.method`, `raise` for a class."""
    match call.func:
        case ast.Name(name):
            return 'raise' if name[0].isupper() else f'{module}.{name}'
        case ast.Attribute(ast.Name(of), name):
            return f'{owner if of == "self" else of}.{name}'
        case ast.Attribute(_, name):
            return f'?.{name}'
    return '?'


def is_structure(node: ast.stmt) -> bool:
    """Return whether a statement is a class without a base."""
    return isinstance(node, ast.ClassDef) and not node.bases


def fields(node: ast.ClassDef) -> dict[str, ast.expr]:
    """Return the annotations of a class's fields."""
    typed = [one for one in ast.walk(node) if isinstance(one, ast.AnnAssign)]
    set_by_methods = [one for one in typed if isinstance(one.target, ast.Attribute)]
    return {
        ast.unparse(one.target).removeprefix('self.'): one.annotation
        for one in [*set_by_methods, *(one for one in typed if one in node.body)]
    }


def is_init(node: ast.stmt) -> bool:
    """Return whether a statement is the method `__init__`."""
    return isinstance(node, ast.FunctionDef) and node.name == '__init__'


def rooms_of(init: ast.FunctionDef) -> list[ast.Assign]:
    """Return the statements of `__init__` that give the object memory of its own."""
    calls = [one for one in init.body if isinstance(getattr(one, 'value', None), ast.Call)]
    return [one for one in calls if ast.unparse(one.value.func) in ROOMS]


def kept_by(init: ast.FunctionDef) -> list[str]:
    """Return the arrays whose addresses `__init__` takes, without arrays that are fields."""
    pairs = [pair for one in init.body for pair in assigned(one)]
    held = {ast.unparse(value) for target, value in pairs if isinstance(target, ast.Attribute)}
    held |= {ast.unparse(one.value) for one in init.body if isinstance(one, ast.AnnAssign)}
    calls = [one for one in ast.walk(init) if isinstance(one, ast.Call)]
    arrays = [ast.unparse(one.args[0]) for one in calls if ast.unparse(one.func) in ADDRESSES]
    return [array for array in arrays if array.partition('.')[0] not in {'self', *held}]


def with_memory(init: ast.FunctionDef, keeps: bool) -> ast.FunctionDef:
    """
    Return `__init__` with one allocation for all memory that the object asks for, and with the
    arrays whose addresses the object holds stored in `_kept`.
    """
    rooms, lines, place = rooms_of(init), [], '0'
    at = init.body.index(rooms[0]) if rooms else 0
    if rooms != init.body[at : at + len(rooms)]:
        raise TypeError(f'put calls of arrays.rooms next to each other: {ast.unparse(rooms[0])}')
    for one in rooms:
        whole = ast.unparse(one.value.func) == 'arrays.whole_rooms'
        for (name, _), count in zip(assigned(one), one.value.args, strict=True):
            room = f'arrays.after(self._room, {place})'
            lines.append(f'{ast.unparse(name)} = {f"arrays.as_whole({room})" if whole else room}')
            place += f' + ({ast.unparse(count)})'
    lines[:0] = [f'self._room = arrays.scratch({place})'] if rooms else []
    arrays = ', '.join(dict.fromkeys(kept_by(init)))
    last = ast.parse(f'self._kept = ({arrays},)' if keeps and arrays else '').body
    new = copy.copy(init)
    behind = init.body[at + len(rooms) :]
    new.body = [*init.body[:at], *ast.parse('\n'.join(lines)).body, *behind, *last]
    return new


def assigned(node: ast.stmt) -> list[tuple[ast.expr, ast.expr]]:
    """Return the targets of an assignment, each with its value or with the call that gives it."""
    if not isinstance(node, ast.Assign):
        return []
    target, value = node.targets[0], node.value
    if not isinstance(target, ast.Tuple):
        return [(target, value)]
    several = value.elts if isinstance(value, ast.Tuple) else [value] * len(target.elts)
    return list(zip(target.elts, several))


def pairs_of(node: ast.stmt) -> list[tuple[str, ast.expr]]:
    """Return each name to which a statement assigns, with its value."""
    return [(name.id, one) for name, one in assigned(node) if isinstance(name, ast.Name)]


def kind_of(value: ast.expr) -> str:
    """Return the type of values that Cython would make objects: `[0.0] * 16`, `a < b`."""
    match value:
        case ast.BinOp(ast.List([ast.Constant(zero)]), ast.Mult(), ast.Constant(count)):
            return f'{"double" if isinstance(zero, float) else "long long"}[{count}]'
        case ast.List([ast.Constant(float())]):
            return 'double[1]'
        case ast.Constant(float()) | ast.UnaryOp(ast.USub(), ast.Constant(float())):
            return 'double'
        case ast.Compare() | ast.BoolOp() | ast.UnaryOp(ast.Not()) | ast.Constant(bool()):
            return 'bint'
        case ast.Tuple([_, _]):
            return 'Pair'
        case ast.Tuple([_, _, _]):
            return 'Triple'
    return ''


def numbers(body: list[ast.stmt], shared: set[str], others: bool = False) -> list[str]:
    """
    Return the declarations of a file's constants that are written as numbers: of those that are
    shared, or of the others.
    """
    pairs = [pair for one in body for pair in pairs_of(one)]
    lines = []
    for name, value in pairs:
        leaves = [one for one in ast.walk(value) if isinstance(one, ast.Constant | ast.Name)]
        kinds = {
            float if ast.unparse(one) == 'math' else type(getattr(one, 'value', one))
            for one in leaves
        }
        if (name in shared) is others or not name.isupper():
            continue
        if not isinstance(value, ast.Tuple) and kinds <= {int, float}:
            lines.append(f'cdef {"double" if float in kinds else "int"} {name}')
    return lines


def indented(body: list[ast.stmt]) -> list[str]:
    """Return the lines of statements, indented as a block."""
    return [f'    {line}' for one in body for line in ast.unparse(one).splitlines()]


def included_numbers(file: Path) -> str:
    """Return the constants of a module as C macros, whose values the compiler knows."""
    values = {name: value for name, value in runpy.run_path(str(file)).items() if name.isupper()}
    whole = {name: value for name, value in values.items() if isinstance(value, int)}
    others = {name: value for name, value in values.items() if name not in whole}
    lines = ['cdef extern from *:', '    """']
    for name, value in others.items():
        written = IN_C.get(repr(value), repr(value))
        lines += [f'    #ifndef KINEMATICS_{name}']
        lines += [f'    #define KINEMATICS_{name} {written}', '    #endif']
    lines += ['    """']
    for name, value in others.items():
        kind = 'double' if isinstance(value, float) else 'char*'
        lines.append(f'    const {kind} {name} "KINEMATICS_{name}"')
    lines += ['cdef enum:', *(f'    {name} = {value}' for name, value in whole.items())]
    return '\n'.join(lines) + '\n'
