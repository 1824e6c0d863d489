# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Join the kernel's files to units. The files of a unit are compiled as one module.

In a unit, functions and constants have the name of their file as a prefix: `vectors.cross` becomes
`vectors_cross`. Classes and exported names stay as they are.
"""

import ast
import copy
import graphlib
from collections.abc import Mapping, Sequence


class KernelUnits:
    """
    The units of the kernel, with the names that functions and constants have in them.

    Parameters
    ----------
    trees
        The syntax tree of each file, by the file's name.
    units
        The names of the files of each unit, by the name of its module.
    exported
        Names that Python can import.

    Attributes
    ----------
    joined
        The statements of each file, with the names of the unit.
    shared
        For each unit, its functions and constants that other units use.
    used
        For each unit, the functions and constants of other units that it uses, as unit and name.

    Raises
    ------
    graphlib.CycleError
        If units, or files of one unit, import each other.
    """

    def __init__(
        self,
        trees: Mapping[str, ast.Module],
        units: Mapping[str, Sequence[str]],
        exported: set[str],
    ) -> None:
        self.trees, self.exported = trees, exported
        self._plain_names = {name: plain_names(tree) for name, tree in trees.items()}
        self.unit_of = {name: unit for unit, names in units.items() for name in names}
        self.files = {unit: self._ordered(names) for unit, names in units.items()}
        # Python cannot import modules that import each other.
        graphlib.TopologicalSorter(
            {unit: self._imported_by(unit) - {unit} for unit in units}
        ).prepare()
        self.shared: dict[str, set[str]] = {unit: set() for unit in units}
        self.used: dict[str, set[tuple[str, str]]] = {unit: set() for unit in units}
        self.joined = {
            name: [self._renamed(node, name) for node in trees[name].body] for name in self.unit_of
        }

    def imports(self, file: str) -> dict[str, tuple[str, str]]:
        """
        Return the imports of a file from other files of the kernel: for each local name the file,
        and the name in this file or '' for the whole file.
        """
        found = {}
        for node in self.trees[file].body:
            if isinstance(node, ast.ImportFrom) and node.level:
                of = (node.module or '').rpartition('.')[2]
                for alias in node.names:
                    whole = alias.name in self.trees
                    found[alias.name] = (alias.name, '') if whole else (of, alias.name)
        return found

    def name_of(self, file: str, name: str) -> str:
        """Return the name that a function, constant or class of a file has in its unit."""
        renamed = file in self.unit_of and name in self._plain_names[file]
        if name in self.exported or not renamed:
            return name
        begin = '_' if name[0] == '_' else ''
        return f'{begin}{file.upper() if name.isupper() else file}_{name.removeprefix("_")}'

    def _imported_by(self, unit: str) -> set[str]:
        others = {of for name in self.files[unit] for of, _ in self.imports(name).values()}
        return {self.unit_of[name] for name in others & self.unit_of.keys()}

    def _ordered(self, names: Sequence[str]) -> list[str]:
        # Returns the files so that each file comes after the files that it imports.
        imported = {
            name: [of for of, _ in self.imports(name).values() if of in names]
            for name in sorted(names)
        }
        return list(graphlib.TopologicalSorter(imported).static_order())

    def _renamed(self, node: ast.stmt, file: str) -> ast.stmt:
        renamed = _Renaming(self, file).visit(copy.deepcopy(node))
        if isinstance(node, ast.FunctionDef):
            renamed.name = self.name_of(file, node.name)
        return ast.fix_missing_locations(renamed)  # type: ignore[no-any-return]


class _Renaming(ast.NodeTransformer):
    # Replaces the names of functions and constants by their names in the unit.

    def __init__(self, units: KernelUnits, file: str) -> None:
        self.units, self.file = units, file
        self.imports = units.imports(file)
        self.local: set[str] = set()

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        of_others = self.local
        self.local = of_others | {one.arg for one in ast.walk(node) if isinstance(one, ast.arg)}
        self.local |= names_set_by(node)
        self.generic_visit(node)
        self.local = of_others
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.ClassDef:
        # Do not rename fields, because a field may have the name of a function.
        for one in node.body:
            if not isinstance(one, ast.AnnAssign):
                self.visit(one)
        return node

    def visit_Name(self, node: ast.Name) -> ast.Name:
        file, name = self.imports.get(node.id, (self.file, node.id))
        if name and node.id not in self.local:
            node.id = self.units.name_of(file, name)
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        self.generic_visit(node)
        of = node.value.id if isinstance(node.value, ast.Name) else ''
        file, name = self.imports.get(of, ('', ''))
        if of in self.local or name or file not in self.units.unit_of:
            return node
        here, there = self.units.unit_of[self.file], self.units.unit_of[file]
        joined = self.units.name_of(file, node.attr)
        if joined in self.local:
            raise TypeError(f'{self.file}.py: {joined} is {of}.{node.attr}; rename the variable')
        if here != there:
            self.units.shared[there].add(joined)
            self.units.used[here].add((there, joined))
        return ast.Name(joined, node.ctx)


def plain_names(tree: ast.Module) -> set[str]:
    """Return the names of the functions and constants that a file defines."""
    names = set()
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            names |= names_set_by(node)
    return names


def names_set_by(node: ast.AST) -> set[str]:
    """Return the names to which a statement assigns values, also inside of blocks."""
    return {
        one.id
        for one in ast.walk(node)
        if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store)
    }
