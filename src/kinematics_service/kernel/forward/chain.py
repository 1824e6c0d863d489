"""The chain of an arm: constant motions with one screw about z between each two of them."""

from typing import NamedTuple

import numpy as np

from ..layout import arrays, places
from ..layout.arrays import Floats, Integers


class ChainTable(NamedTuple):
    """
    The arrays of a chain.

    An element is one screw about its own z axis. An entry is the share of one joint in the screw
    of one element: most elements have one.

    Attributes
    ----------
    dof
        Number of joints n.
    before : shape (elements + 1, 3, 4)
        The constant motion before each element, and after the last; rows of a 4 x 4 motion.
    theta_0, d_0 : shape (elements,), rad, m
        The screw of each element with all joints at zero.
    first_entry : shape (elements + 1,)
        First entry of each element, and one past the last.
    joint : shape (entries,)
        The joint of each entry.
    by_theta, by_d : shape (entries,)
        Turn and translation of the element per unit of the entry's joint.
    frame_parent : shape (frames,)
        The last element in front of each frame of the table, base to tool; -1 for none.
    frame_offset : shape (frames, 3, 4)
        Each frame in that of its parent.
    """

    dof: int
    before: Floats
    theta_0: Floats
    d_0: Floats
    first_entry: Integers
    joint: Integers
    by_theta: Floats
    by_d: Floats
    frame_parent: Integers
    frame_offset: Floats


def _goes_together(table: ChainTable) -> bool:
    # Returns whether every index exists.
    elements, entries = len(table.theta_0), len(table.joint)
    first = table.first_entry
    return bool(
        len(first) == elements + 1
        and (first[0], first[len(first) - 1]) == (0, entries)
        and np.all(np.diff(first) >= 0)
        and np.all((table.joint >= 0) & (table.joint < table.dof))
        and np.all((table.frame_parent >= -1) & (table.frame_parent < elements))
    )


def _is_twist(motion: Floats) -> bool:
    # Returns whether it is Rx(alpha) Tx(a) and nothing else, as in a row of a table.
    c, s = motion[1, 1], motion[2, 1]
    return np.array_equal(motion, [[1, 0, 0, motion[0, 3]], [0, c, -s, 0], [0, s, c, 0]])


def _form(table: ChainTable) -> int:
    if table.joint.tolist() != list(range(table.dof)):
        return places.MIXED
    one_each = len(table.theta_0) == len(table.joint)
    return (
        places.TWISTED
        if one_each and all(map(_is_twist, table.before[1 : len(table.before) - 1]))
        else places.PLAIN
    )


class Chain:
    """
    A chain as the kernel reads it: frozen.

    Attributes
    ----------
    table
        Its arrays, read-only. The kernel has the same ones, flat and under the same names; to the
        compiled kernel they are addresses that Python does not see.
    dof, elements, entries, frames
        Their number.
    form
        MIXED, PLAIN or TWISTED.
    screws_at, frames_at, width
        Where the screws of the entries, (6, entries), and the frames of the table start in a row
        of results, and its length.
    widths, single_widths
        Length of a row at each depth: POSE, JACOBIAN, ALL_FRAMES; of the row of one pose, with its
        q, qdot and quaternion at the end.
    at_rest : shape (n,)
        Zero velocities; read-only.
    """

    def __init__(self, table: ChainTable) -> None:
        for array in table[1:]:
            array.setflags(write=False)
        if not _goes_together(table):
            raise TypeError('the arrays of a chain do not go together')
        n = table.dof
        self.table = table
        self.dof = n
        self.elements = len(table.theta_0)
        self.entries = len(table.joint)
        self.frames = len(table.frame_parent)
        self.form = _form(table)
        # If entry k is joint k, the screws of the entries are J itself and share its columns.
        mixed = self.form == places.MIXED
        after_twist = places.JACOBIAN_AT + 6 * n + 6
        self.screws_at = after_twist if mixed else places.JACOBIAN_AT
        self.frames_at = after_twist + (6 * self.entries if mixed else 0)
        self.width = self.frames_at + 16 * self.frames
        self.widths = (places.JACOBIAN_AT, self.frames_at, self.width)
        self.single_widths = tuple(width + 2 * n + places.ROW_TAIL for width in self.widths)
        self.at_rest = np.zeros(n)
        self.at_rest.setflags(write=False)

        self.before = arrays.numbers(table.before, 12 * self.elements + 12)
        self.theta_0 = arrays.numbers(table.theta_0, self.elements)
        self.d_0 = arrays.numbers(table.d_0, self.elements)
        self.first_entry = arrays.whole(table.first_entry, self.elements + 1)
        self.joint = arrays.whole(table.joint, self.entries)
        self.by_theta = arrays.numbers(table.by_theta, self.entries)
        self.by_d = arrays.numbers(table.by_d, self.entries)
        self.frame_parent = arrays.whole(table.frame_parent, self.frames)
        self.frame_offset = arrays.numbers(table.frame_offset, 12 * self.frames)

    def __reduce__(self) -> tuple[type, tuple[ChainTable]]:
        """Rebuild by the constructor."""
        return Chain, (self.table,)
