"""
A robot's table folded into the constants of the kernel.

The chain is C_0 screw_z(1) C_1 screw_z(2) ... C_K: every moving row is one screw about its own z
axis, and everything that stands still between two of them (conventions, fixed rows, base, tool) is
one constant. So the kernel knows neither conventions nor joint types.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
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
    Base of frozen dataclasses whose fields that are arrays are frozen too.

    Copies and unpickled ones are rebuilt by the constructor: otherwise their arrays would be
    writable.
    """

    READ_ONLY: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        """Find the fields that are arrays."""
        super().__init_subclass__()
        own = (name for name, kind in cls.__annotations__.items() if kind in ARRAYS)
        cls.READ_ONLY = (*cls.READ_ONLY, *own)

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in self.READ_ONLY:
            getattr(self, name).setflags(write=False)

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Rebuild by the constructor."""
        values = (getattr(self, field.name) for field in fields(self))  # type: ignore[arg-type]
        return type(self), tuple(values)


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


def fold(
    rows: Sequence[Row],
    variables: Sequence[str],
    base: Floats,
    tool: Floats,
    closure: Closure | None = None,
) -> Chain:
    """
    Return the chain of a table.

    Parameters
    ----------
    rows
        Rows of the table, base to tool.
    variables : n names
        The joint variables, in the order of the Jacobian's columns; where loops are closed, the
        passive ones behind them.
    base, tool : shape (4, 4)
        Frame 0 in the base frame; the tool in the frame after the last row.
    closure
        The loops that move the passive variables; left out where no row moves with one.
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
    entries = [entry for element in elements for entry in element.entries]
    dof = len(variables) if closure is None else closure.dof
    if all(entry[0] < dof for entry in entries):
        closure = None
    return Chain(
        ChainTable(
            dof=dof,
            before=np.array([motion[:3] for motion in constants]),
            theta_0=np.array([element.theta_0 for element in elements]),
            d_0=np.array([element.d_0 for element in elements]),
            first_entry=np.cumsum([0] + [len(element.entries) for element in elements]),
            joint=np.array([entry[0] for entry in entries], dtype=np.int64),
            by_theta=np.array([entry[1] for entry in entries]),
            by_d=np.array([entry[2] for entry in entries]),
            frame_parent=np.array(frame_parents, dtype=np.int64),
            frame_offset=np.array([offset[:3] for offset in frame_offsets]),
        ),
        closure,
    )


def poses_and_jacobians(chain: Chain, q: Floats) -> tuple[Floats, Floats]:
    """
    Return the poses of a chain's end (N, 4, 4) and J in base axes (N, 6, n) at variables (N, n).
    """
    rows = np.empty((len(q), chain.widths[kernel.JACOBIAN]))
    q, at_rest = np.ascontiguousarray(q), chain.at_rest.reshape(1, -1)
    kernel.evaluate(chain, q, at_rest, kernel.JACOBIAN, rows)
    J = rows[:, kernel.JACOBIAN_AT : kernel.JACOBIAN_AT + 6 * chain.dof]
    return rows[:, :16].reshape(-1, 4, 4), J.reshape(-1, 6, chain.dof)


def poses_and_frames(chain: Chain, q: Floats) -> tuple[Floats, Floats]:
    """
    Return the poses of a chain's end (N, 4, 4), and frame 0 and the frame after each row of the
    table (N, rows + 1, 4, 4), at variables (N, n).
    """
    rows = np.empty((len(q), chain.widths[kernel.ALL_FRAMES]))
    q, at_rest = np.ascontiguousarray(q), chain.at_rest.reshape(1, -1)
    kernel.evaluate(chain, q, at_rest, kernel.ALL_FRAMES, rows)
    frames = rows[:, chain.widths[kernel.JACOBIAN] :]
    return rows[:, :16].reshape(-1, 4, 4), frames.reshape(len(q), chain.frames, 4, 4)


def first_entries(chain: Chain) -> Integers:
    """Return for each entry of a chain the first entry of its element."""
    first = chain.table.first_entry
    return np.repeat(first[:-1], np.diff(first))
