# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Make the kernel's chain from a DH table: one constant matrix between two successive joints.

A table row with a joint has a screw motion: a rotation about z and a translation along z. All
constant transforms between two successive screw motions are multiplied into one matrix. So the
kernel needs neither conventions nor joint types. There are four kinds of constant transforms: the
base, the tool, rows without a joint, and the constant part of rows with a joint.

Let K be the number of rows with a joint, S_k the screw motion of the k-th such row, and C_k the
constant matrix after S_k. The pose of the tool is the product C_0 S_1 C_1 S_2 ... S_K C_K.
"""

import itertools
from collections.abc import Sequence
from dataclasses import fields
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..kernel import Chain, ChainTable, Closure, Floats, Integers
from ..rigid_motion import screw_z
from .conventions import Row

ARRAYS = (Floats, Integers, npt.NDArray[np.bool_])


class FrozenArrays:
    """
    Base class of frozen dataclasses whose arrays are read-only.

    numpy makes copied and unpickled arrays writable. Therefore copying and unpickling an object
    call its constructor, which makes the arrays read-only again.
    """

    READ_ONLY: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        """Store the names of the fields that the subclass annotates as arrays."""
        super().__init_subclass__()
        names = (name for name, kind in cls.__annotations__.items() if kind in ARRAYS)
        cls.READ_ONLY = (*cls.READ_ONLY, *names)

    def __post_init__(self) -> None:
        """Make the array fields read-only."""
        for name in self.READ_ONLY:
            getattr(self, name).setflags(write=False)

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """
        Return the constructor and its arguments, with which `copy` and `pickle` make the object.
        """
        values = (getattr(self, field.name) for field in fields(self))  # type: ignore[arg-type]
        return type(self), tuple(values)


def _entries(row: Row, variables: Sequence[str]) -> list[tuple[int, float, float]]:
    # Return, for each joint variable in theta or d of the row: the index of its joint, and the
    # coefficients of the variable in theta and in d.
    theta, d = dict(row.theta.coefficients), dict(row.d.coefficients)
    entries = ((j, theta.get(v, 0.0), d.get(v, 0.0)) for j, v in enumerate(variables))
    return [entry for entry in entries if entry[1:] != (0.0, 0.0)]


def fold(
    rows: Sequence[Row],
    variables: Sequence[str],
    base: Floats,
    tool: Floats,
    closure: Closure | None = None,
) -> Chain:
    """
    Return the kernel's chain of a table: constant motions, separated by screws about z.

    Parameters
    ----------
    rows
        Rows of the table, base to tool.
    variables : n names
        The joint variables, in the order of the Jacobian's columns; after them the passive
        variables of closed loops.
    base, tool : shape (4, 4)
        The pose of frame 0 in the base frame, and of the tool in the frame after the last row.
    closure
        The closed loops that move the passive variables; ignored if no passive variable moves a
        row.
    """
    constants: list[Floats] = []
    elements: list[Row] = []
    entries: list[list[tuple[int, float, float]]] = []
    frame_parents, frame_offsets = [-1], [base]
    still = base  # product of the constant motions since the previous moving row
    for row in rows:
        if moved := _entries(row, variables):
            constants.append(still @ row.before)
            elements.append(row)
            entries.append(moved)
            still = row.after
        else:
            motion = screw_z(row.theta.constant, row.d.constant)
            still = still @ row.before @ motion @ row.after
        frame_parents.append(len(elements) - 1)
        frame_offsets.append(still)
    constants.append(still @ tool)
    joints, by_theta, by_d = np.reshape(list(itertools.chain.from_iterable(entries)), (-1, 3)).T
    dof = len(variables) if closure is None else closure.dof
    if np.all(joints < dof):
        closure = None
    return Chain(
        ChainTable(
            dof=dof,
            before=np.array([motion[:3] for motion in constants]),
            theta_0=np.array([row.theta.constant for row in elements]),
            d_0=np.array([row.d.constant for row in elements]),
            first_entry=np.cumsum([0, *map(len, entries)]),
            joint=joints.astype(np.int64),
            by_theta=by_theta.copy(),
            by_d=by_d.copy(),
            frame_parent=np.array(frame_parents, dtype=np.int64),
            frame_offset=np.array([offset[:3] for offset in frame_offsets]),
        ),
        closure,
    )


def poses_and_jacobians(chain: Chain, q: Floats) -> tuple[Floats, Floats]:
    """Return the tool poses (N, 4, 4) of a chain, and J in base axes, (N, 6, n), at q (N, n)."""
    rows = evaluated(chain, q)
    J = rows[:, kernel.JACOBIAN_AT : kernel.JACOBIAN_AT + 6 * chain.dof]
    return rows[:, :16].reshape(-1, 4, 4), J.reshape(-1, 6, chain.dof)


def evaluated(chain: Chain, q: Floats) -> Floats:
    """
    Return the kernel's results for a chain at rest, one row for each configuration in q (N, n).

    A row has the results that `kernel.evaluate` lists (tool pose, Jacobian, screws, and others),
    but not the frames of the DH table.
    """
    rows, rates = np.empty((len(q), chain.widths[kernel.JACOBIAN])), chain.at_rest.reshape(1, -1)
    kernel.evaluate(chain, np.ascontiguousarray(q), rates, kernel.JACOBIAN, rows)
    return rows


def first_entries(chain: Chain) -> Integers:
    """
    Return, for each (screw, joint) entry of a chain, the index of the screw's first entry.

    A chain has one entry for each screw and each joint that moves the screw. The entries of a
    screw follow one another.
    """
    first = chain.table.first_entry
    return np.repeat(first[:-1], np.diff(first))
