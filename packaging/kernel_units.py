# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The kernel's files, joined: those of a unit are compiled as one module.

A file's functions and constants have its name in front there: `vectors.cross` is `vectors_cross`.
Classes, and what Python sees, keep their names.
"""

import ast
import copy
import graphlib
from collections.abc import Mapping, Sequence


class KernelUnits:
    """
    Files of the kernel in the units that they are compiled in.

    Parameters
    ----------
    trees
        The files' trees, by their names.
    units
        Names of the files of each unit, which is named as its module.
    exported
        Names that Python sees.

    Attributes
    ----------
    joined
        The statements of each file, with the names that they have in its unit.
    shared
        Names of each unit's functions and constants that others use.
    used
        The units, and names there, of functions and constants of others that each unit uses.

    Raises
    ------
    graphlib.CycleError
        If units, or files of one, import each other.
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
        # Circles of modules cannot be imported.
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
        Return what a file has from others of the kernel, by its names for it: their names, and the
        name there, none of a whole file.
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
        # Behind those that they import.
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
    # Gives names of other files, and of its own, those that they have in a unit.

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
        # Its fields may have the names of functions.
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
            raise TypeError(f'{self.file}.py: {joined} is {of}.{node.attr}, and a variable')
        if here != there:
            self.units.shared[there].add(joined)
            self.units.used[here].add((there, joined))
        return ast.Name(joined, node.ctx)


def plain_names(tree: ast.Module) -> set[str]:
    """Return the names of what a file defines, apart from its classes."""
    names = set()
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            names |= names_set_by(node)
    return names


def names_set_by(node: ast.AST) -> set[str]:
    """Return the names that a statement, or any in it, sets."""
    return {
        one.id
        for one in ast.walk(node)
        if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store)
    }
