"""
The kernel's types for the compiler: a .pxd for each module, made from its annotations.

A function is C where all its annotations are in this vocabulary and its body has nothing that only
Python can do; Python sees those that `kernel/__init__.py` exports. A class without a base is a C
structure of the fields that are annotated, in its body or where `__init__` sets them; Python sees
the numbers and objects of one that is exported. What a function keeps for itself is found by the
compiler, or annotated.
"""

import ast
import functools
import re
import runpy
from pathlib import Path

# Numbers and addresses, and Python's objects.
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
ONLY_PYTHON = (ast.GeneratorExp, ast.ListComp, ast.SetComp, ast.DictComp)
# Compiled once more for processors with AVX2: with it the measures of one pose take 0.85 of the
# time.
AVX2 = {
    'forward/chain_pass': ['sines_and_cosines'],
    'measures/singular_values': ['orthogonalise'],
}
INLINE = {
    'forward/chain_pass': ['_sincos_reduced'],
    'nearest/jacobian_changes': ['_write_cross', '_add_turn'],
}
# Classes that classes of Python derive from; calls of the others' methods are direct.
OPEN = ('JointMemory',)
# Calls that are arithmetic of C.
ARITHMETIC = ('abs', 'min', 'max', 'range', 'int', 'float')
IN_C = {'nan': 'Py_NAN', 'inf': 'Py_HUGE_VAL', "b''": '""'}
CLONES = '''cdef extern from *:
    """
    #if defined(__PYX_HAVE__kinematics_service__kernel__{guard}) \\
        && defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
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
        With `layout/arrays.pxd` and `layout/math.pxd`, which are written by hand.
    included
        Modules that are compiled wherever they are used.
    """

    def __init__(self, folder: Path, included: tuple[str, ...]) -> None:
        self.folder, self.included = folder, included
        self.trees = {
            file: ast.parse(file.read_text(encoding='utf-8')) for file in folder.rglob('*.py')
        }
        self.exported = {
            alias.name
            for node in self.trees[folder / '__init__.py'].body
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        nodes = [node for tree in self.trees.values() for node in tree.body]
        self.classes = {node.name for node in nodes if is_structure(node)}
        arrays = (folder / 'layout' / 'arrays.pxd').read_text(encoding='utf-8')
        declared = re.findall(r'(\w+)\([^()]*\) (except|noexcept)', arrays)
        self._of_arrays = {f'arrays.{name}': how == 'except' for name, how in declared}

    def check(self) -> None:
        """
        Raise TypeError where a function of the tables above is not there, and where, while other
        threads have the interpreter's lock, something is called that may raise or is Python's.
        """
        for tables in (AVX2, INLINE):
            for module, names in tables.items():
                for name in names:
                    if f'{module.rpartition("/")[2]}.{name}' not in self._functions:
                        raise TypeError(f'kernel_types.py names {module}: {name}, which is not')
        for key, (node, file, _) in self._functions.items():
            for call in calls_without_lock(node):
                if not self._is_calm(called(call, file.stem, key.partition('.')[0])):
                    raise TypeError(
                        f'{file}:{call.lineno}: {ast.unparse(call.func)} is called without the '
                        "interpreter's lock, and may raise or need Python"
                    )

    def _is_calm(self, name: str) -> bool:
        # Whether what is called is a function of C that never raises.
        of, _, last = name.rpartition('.')
        if name in self._of_arrays:
            return not self._of_arrays[name]
        if of == 'math' or last in ARITHMETIC:
            return True
        # The class of a variable is not known: each that has a method of that name.
        keys = [key for key in self._functions if key == name] or [
            key
            for key in self._functions
            if key.endswith(f'.{last}') and key.partition('.')[0] in self.classes
        ]
        return bool(keys) and not any(self._may_raise(key) for key in keys)

    def _may_raise(self, key: str) -> bool:
        lines = self._function(*self._functions[key])
        return not any(' noexcept nogil' in line for line in lines)

    @functools.cached_property
    def _functions(self) -> dict[str, tuple[ast.FunctionDef, Path, ast.ClassDef | None]]:
        # By `module.function` or `Class.method`: each with its file and class.
        found = {}
        for file, tree in self.trees.items():
            for owner in (None, *(node for node in tree.body if is_structure(node))):
                for node in (owner or tree).body:
                    if isinstance(node, ast.FunctionDef) and not node.name.startswith('__'):
                        key = f'{owner.name if owner else file.stem}.{node.name}'
                        found[key] = node, file, owner
        return found

    def text(self, file: Path, own: bool = True) -> str:
        """
        Return the .pxd of a module: its own, or, shorter, that for the modules which use it.
        """
        if (written := file.with_suffix('.pxd')).exists():
            return written.read_text(encoding='utf-8')
        body = self.trees[file].body
        if not any(isinstance(node, ast.ClassDef | ast.FunctionDef) for node in body):
            return included_numbers(file)
        classes = [node for node in body if is_structure(node)]
        lines = [*(f'cdef class {node.name}' for node in classes), *numbers(body)]
        for node in classes:
            lines += self._structure(node, file)
        for node in body:
            if isinstance(node, ast.FunctionDef):
                lines += self._function(node, file, None)
        cimports = self._cimports(file)
        if not own and file.stem not in self.included:
            cimports = needed_cimports(cimports, lines)
        return '\n'.join([*cimports, *lines]) + '\n'

    def _cimports(self, file: Path) -> list[str]:
        up = '.' * len(file.relative_to(self.folder).parts)
        lines = ['cimport cython', f'from {up}layout.arrays cimport Pair, Triple, ndarray']
        for node in self.trees[file].body:
            if isinstance(node, ast.Import) and node.names[0].name == 'math':
                lines.append(f'from {up}layout cimport math')
            if isinstance(node, ast.ImportFrom) and node.level:
                of = node.module or ''
                place = file.parents[node.level - 1].joinpath(*of.split('.'))
                names = [alias.name for alias in node.names]
                wanted = [
                    name
                    for name in names
                    if name in self.classes or place / f'{name}.py' in self.trees
                ]
                if wanted:
                    lines.append(f'from {"." * node.level}{of} cimport {", ".join(wanted)}')
        return lines

    def _structure(self, node: ast.ClassDef, file: Path) -> list[str]:
        exported = node.name in self.exported
        lines = [] if node.name in OPEN else ['@cython.final']
        lines.append(f'cdef class {node.name}:')
        for name, annotation in fields(node).items():
            kind = self.c_type(annotation).replace('ndarray', '') or 'object'
            access = 'public ' if 'Public[' in ast.unparse(annotation) else 'readonly '
            seen = exported and '*' not in kind and not name.startswith('_')
            lines.append(f'    cdef {access if seen else ""}{kind} {name}')
        for method in node.body:
            if isinstance(method, ast.FunctionDef) and not method.name.startswith('__'):
                lines += [f'    {line}' for line in self._function(method, file, node)]
        return lines

    def _function(
        self, node: ast.FunctionDef, file: Path, owner: ast.ClassDef | None
    ) -> list[str]:
        module = file.relative_to(self.folder).with_suffix('').as_posix()
        seen = (owner or node).name in self.exported and not node.name.startswith('_')
        key = f'{owner.name if owner else file.stem}.{node.name}'
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
        raising = key in self._raising or set(OBJECTS.values()) & {
            *kinds,
            result,
        }
        how = 'cpdef' if seen and not any('*' in kind for kind in kinds) else 'cdef'
        inline = node.name in INLINE.get(module, ())
        body, lines, symbol = [], [], ''
        if module.rpartition('/')[2] in self.included:
            inline, body = True, [ast.unparse(one) for one in node.body[1:]]
        if node.name in AVX2.get(module, ()):
            name = f'kinematics_{module.rpartition("/")[2]}_{node.name}'
            guard, symbol = module.replace('/', '__'), f' "{name}"'
            lines = CLONES.format(
                guard=guard, result=result, symbol=name, kinds=', '.join(kinds)
            ).splitlines()
        # Compiled once for one lane and once for LANES, by those that call it.
        inline = inline or node.name[0] == '_' and names[-1:] == ['lanes']
        if own := ', '.join(f"{name}='{kind}'" for name, kind in self._own(node).items()):
            lines.append(f'@cython.locals({own})')
        typed = [name for name in names if name == 'self']
        typed += [f'{kind} {name}' for kind, name in zip(kinds, names[len(typed) :])]
        result = result.replace('void', 'object') if raising else result
        lines.append(
            f'{how} {"inline " * inline}{result} {node.name}{symbol}({", ".join(typed)})'
            f'{"" if raising else " noexcept nogil"}{":" if body else ""}'
        )
        return lines + [f'    {line}' for line in body]

    def _own(self, node: ast.FunctionDef) -> dict[str, str]:
        # The types of a function's variables that the compiler does not find.
        found, annotated = {}, {}
        for one in ast.walk(node):
            if isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name):
                annotated[one.target.id] = self.c_type(one.annotation)
            elif isinstance(one, ast.Assign):
                pairs = [(name, kind_of(value)) for name, value in pairs_of(one)]
                found |= {name: kind for name, kind in pairs if kind}
        return found | annotated

    def c_type(self, annotation: ast.expr | None) -> str:
        """Return the C type of an annotation, or nothing where it has none."""
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
        # The functions that raise, and those that call them: `module.function`, `Class.method`.
        found = {name for name, raises in self._of_arrays.items() if raises}
        calls = {
            key: called_by(node, file.stem, key.partition('.')[0])
            for key, (node, file, _) in self._functions.items()
            if file.stem not in self.included
        }
        found |= {key for key, names in calls.items() if 'raise' in names}
        while more := {key for key, names in calls.items() if names & found} - found:
            found |= more
        return found


def needed_cimports(cimports: list[str], lines: list[str]) -> list[str]:
    """Return those of a module's cimports whose names its declarations hold."""
    words = set(re.findall(r'\w+', '\n'.join(lines)))
    needed = []
    for cimport in cimports:
        start, _, names = cimport.rpartition('cimport ')
        if kept := [name for name in names.split(', ') if name in words]:
            needed.append(f'{start}cimport {", ".join(kept)}')
    return needed


def called_by(node: ast.FunctionDef, module: str, owner: str) -> set[str]:
    """
    Return the functions and own methods that a function calls, and `raise` where it raises or
    makes an object.
    """
    calls = [one for one in ast.walk(node) if isinstance(one, ast.Call)]
    names = {called(call, module, owner) for call in calls}
    raises = any(isinstance(one, ast.Raise) for one in ast.walk(node))
    return names | ({'raise'} if raises else set())


def called(call: ast.Call, module: str, owner: str) -> str:
    """Return what is called: `module.function`, `Class.method`, `raise` for a new object."""
    match call.func:
        case ast.Name(name):
            return 'raise' if name[0].isupper() else f'{module}.{name}'
        case ast.Attribute(ast.Name(of), name):
            return f'{owner if of == "self" else of}.{name}'
        case ast.Attribute(_, name):
            return f'?.{name}'
    return '?'


def calls_without_lock(node: ast.FunctionDef) -> list[ast.Call]:
    """Return the calls of a function between its `let_go` and its `take_back`."""
    calls = sorted(
        (one for one in ast.walk(node) if isinstance(one, ast.Call)), key=lambda one: one.lineno
    )
    written = [ast.unparse(call.func) for call in calls]
    if 'arrays.let_go' not in written:
        return []
    return calls[written.index('arrays.let_go') + 1 : written.index('arrays.take_back')]


def is_structure(node: ast.stmt) -> bool:
    """Return whether a statement is a class without a base and with fields."""
    return isinstance(node, ast.ClassDef) and not node.bases and bool(fields(node))


def fields(node: ast.ClassDef) -> dict[str, ast.expr]:
    """Return the annotations of a class's fields."""
    typed = [one for one in ast.walk(node) if isinstance(one, ast.AnnAssign)]
    set_by_methods = [one for one in typed if isinstance(one.target, ast.Attribute)]
    return {
        ast.unparse(one.target).removeprefix('self.'): one.annotation
        for one in [*set_by_methods, *(one for one in typed if one in node.body)]
    }


def pairs_of(node: ast.Assign) -> list[tuple[str, ast.expr]]:
    """Return each name that an assignment sets, with its value."""
    target, value = node.targets[0], node.value
    several = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
    pairs = zip(target.elts, value.elts) if several else [(target, value)]
    return [(name.id, one) for name, one in pairs if isinstance(name, ast.Name)]


def kind_of(value: ast.expr) -> str:
    """Return the type of what the compiler takes for an object: `[0.0] * 16`, `a < b`."""
    match value:
        case ast.BinOp(ast.List([ast.Constant(zero)]), ast.Mult(), ast.Constant(count)):
            return f'{"double" if isinstance(zero, float) else "long long"}[{count}]'
        case ast.List([ast.Constant(float())]):
            return 'double[1]'
        case ast.Compare() | ast.BoolOp() | ast.UnaryOp(ast.Not()) | ast.Constant(bool()):
            return 'bint'
        case ast.Tuple([_, _]):
            return 'Pair'
        case ast.Tuple([_, _, _]):
            return 'Triple'
    return ''


def numbers(body: list[ast.stmt]) -> list[str]:
    """Return the declarations of a module's constants that are written as numbers."""
    pairs = [pair for one in body if isinstance(one, ast.Assign) for pair in pairs_of(one)]
    lines = []
    for name, value in pairs:
        leaves = [one for one in ast.walk(value) if isinstance(one, ast.Constant | ast.Name)]
        kinds = {
            float if ast.unparse(one) == 'math' else type(getattr(one, 'value', one))
            for one in leaves
        }
        if name.isupper() and not isinstance(value, ast.Tuple) and kinds <= {int, float}:
            lines.append(f'cdef {"double" if float in kinds else "int"} {name}')
    return lines


def included_numbers(file: Path) -> str:
    """Return constants of C of a module of numbers, which the compiler sees through."""
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
