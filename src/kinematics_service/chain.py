"""
A robot's table folded into the constants of the kernel.

The chain is C_0 screw_z(1) C_1 screw_z(2) ... C_K: every moving row is one screw about its own z
axis, and everything that stands still between two of them (conventions, fixed rows, base, tool) is
one constant. So the kernel knows neither conventions nor joint types.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from . import kernel
from .conventions import Row
from .kernel import Floats, Integers
from .rigid_motion import screw_z


class FrozenArrays:
    """
    Base of frozen dataclasses whose arrays, those named in `READ_ONLY`, are frozen too.

    Copies and unpickled ones are rebuilt by the constructor: otherwise their arrays would be
    writable.

    """

    READ_ONLY: ClassVar[tuple[str, ...]]

    def __post_init__(self) -> None:
        """
        Freeze the arrays.

        """
        for name in self.READ_ONLY:
            getattr(self, name).setflags(write=False)

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """
        Rebuild by the constructor.

        """
        values = (getattr(self, field.name) for field in fields(self))  # type: ignore[arg-type]
        return type(self), tuple(values)


@dataclass(frozen=True, eq=False)
class Chain(FrozenArrays):
    """
    The constants of one arm, packed as the kernel reads them.

    Attributes
    ----------
    integers, numbers
        Read-only arrays; the layout stands in `pack`.
    dof, frames
        Number of joints; number of link frames (rows + 1).
    widths
        Length of a row of results at each depth: pose, Jacobian, all frames.
    screws_at, entries
        Where the screws of the entries start in a row, and their number.
    at_rest : shape (n,)
        Zero velocities; read-only.

    """

    READ_ONLY = ('integers', 'numbers', 'at_rest')

    integers: Integers
    numbers: Floats
    dof: int
    frames: int
    widths: tuple[int, int, int]
    screws_at: int
    entries: int
    at_rest: Floats

    @cached_property
    def single_widths(self) -> tuple[int, ...]:
        """
        Return the length of the row of one pose at each depth: its q, qdot, quaternion at the end.

        """
        return tuple(width + 2 * self.dof + kernel.ROW_TAIL for width in self.widths)


@dataclass(frozen=True)
class _Element:
    theta_0: float
    d_0: float
    entries: tuple[tuple[int, float, float], ...]  # joint, c_theta, c_d


def _element(row: Row, variables: Sequence[str]) -> _Element:
    theta, d = dict(row.theta.coefficients), dict(row.d.coefficients)
    entries = tuple(
        (j, theta.get(variable, 0.0), d.get(variable, 0.0))
        for j, variable in enumerate(variables)
        if theta.get(variable, 0.0) != 0.0 or d.get(variable, 0.0) != 0.0
    )
    return _Element(row.theta.constant, row.d.constant, entries)


def fold(rows: Sequence[Row], variables: Sequence[str], base: Floats, tool: Floats) -> Chain:
    """
    Return the chain of a table.

    Parameters
    ----------
    rows
        Rows of the table, base to tool.
    variables : n names
        The joint variables, in the order of the Jacobian's columns.
    base, tool : shape (4, 4)
        Frame 0 in the base frame; the tool in the frame after the last row.

    """
    constants: list[Floats] = []
    elements: list[_Element] = []
    frame_parents, frame_offsets = [-1], [base]
    still = base  # what stands still since the last screw
    for row in rows:
        element = _element(row, variables)
        if element.entries:
            constants.append(still @ row.before)
            elements.append(element)
            still = row.after
        else:
            motion = screw_z(row.theta.constant, row.d.constant)
            still = still @ row.before @ motion @ row.after
        frame_parents.append(len(elements) - 1)
        frame_offsets.append(still)
    constants.append(still @ tool)
    return _pack(constants, elements, frame_parents, frame_offsets, len(variables))


def _is_twist(motion: Floats) -> bool:
    # Whether it is Rx(alpha) Tx(a) and nothing else, as a row of a table has it.
    c, s = motion[1, 1], motion[2, 1]
    return np.array_equal(motion[:3], [[1, 0, 0, motion[0, 3]], [0, c, -s, 0], [0, s, c, 0]])


def _pack(
    constants: Sequence[Floats],
    elements: Sequence[_Element],
    frame_parents: Sequence[int],
    frame_offsets: Sequence[Floats],
    dof: int,
) -> Chain:
    entries = [entry for element in elements for entry in element.entries]
    first_entry = np.cumsum([0] + [len(element.entries) for element in elements])
    # Where entry k is joint k, the screws of the entries are J itself and share its place.
    one_to_one = [entry[0] for entry in entries] == list(range(dof))
    twisted = len(elements) == len(entries) and all(map(_is_twist, constants[1:-1]))
    screws_at = kernel.JACOBIAN_AT if one_to_one else kernel.JACOBIAN_AT + 6 * dof + 6
    frames_at = kernel.JACOBIAN_AT + 6 * dof + 6 + (0 if one_to_one else 6 * len(entries))
    width = frames_at + 16 * len(frame_parents)

    header = np.zeros(kernel.CHAIN_HEADER, dtype=np.int64)
    header[kernel.JOINTS] = dof
    header[kernel.ELEMENTS] = len(elements)
    header[kernel.ENTRIES] = len(entries)
    header[kernel.FRAMES] = len(frame_parents)
    header[kernel.ONE_TO_ONE] = kernel.MIXED
    if one_to_one:
        header[kernel.ONE_TO_ONE] = kernel.TWISTED if twisted else kernel.PLAIN
    header[kernel.SCREWS_AT] = screws_at
    header[kernel.FRAMES_AT] = frames_at
    header[kernel.WIDTH] = width
    joints = np.array([entry[0] for entry in entries], dtype=np.int64)
    integers = np.concatenate([header, first_entry, joints, frame_parents]).astype(np.int64)
    numbers = np.concatenate(
        [constant[:3].ravel() for constant in constants]
        + [
            np.array([element.theta_0 for element in elements]),
            np.array([element.d_0 for element in elements]),
            np.array([entry[1] for entry in entries]),
            np.array([entry[2] for entry in entries]),
        ]
        + [offset[:3].ravel() for offset in frame_offsets]
    ).astype(np.float64)
    return Chain(
        integers=integers,
        numbers=numbers,
        dof=dof,
        frames=len(frame_parents),
        widths=(kernel.JACOBIAN_AT, frames_at, width),
        screws_at=screws_at,
        entries=len(entries),
        at_rest=np.zeros(dof),
    )
