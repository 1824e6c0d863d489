"""
The chain of an arm: constant motions with one screw about z between each two of them.

Where the arm has closed loops, some variables of its screws are no joints of the arm: they are
passive, and follow from its joints.
"""

from typing import Any, NamedTuple

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


def _goes_together(table: ChainTable, variables: int) -> bool:
    # Returns whether every index exists.
    elements, entries = len(table.theta_0), len(table.joint)
    first = table.first_entry
    return bool(
        len(first) == elements + 1
        and (first[0], first[len(first) - 1]) == (0, entries)
        and np.all(np.diff(first) >= 0)
        and np.all((table.joint >= 0) & (table.joint < variables))
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

    Parameters
    ----------
    table
        Its arrays.
    closure
        The loops whose passive variables move it, a `Closure`; None for most arms.

    Attributes
    ----------
    table
        Its arrays, read-only. The kernel has the same ones, flat and under the same names; to the
        compiled kernel they are addresses that Python does not see.
    dof, elements, entries, frames
        Their number.
    form
        MIXED, PLAIN, TWISTED or CLOSED.
    variables, loops
        Number of joints and passive variables, and of loops.
    screws_at, closure_at, frames_at, width
        Where the screws of the entries, (6, entries), the numbers of the closure, and the frames
        of the table start in a row of results, and its length.
    widths, single_widths
        Length of a row at each depth: POSE, JACOBIAN, ALL_FRAMES; of the row of one pose, with its
        q, qdot and quaternion at the end.
    at_rest : shape (n,)
        Zero velocities; read-only.
    """

    def __init__(self, table: ChainTable, closure: Any = None) -> None:
        variables = table.dof if closure is None else closure.variables
        for array in table[1:]:
            array.setflags(write=False)
        if (
            not _goes_together(table, variables)
            or closure is not None
            and closure.dof != table.dof
        ):
            raise TypeError('the arrays of a chain do not go together')
        n = table.dof
        self.closure = closure
        self.variables, self.loops = variables, 0 if closure is None else closure.loops
        self.table = table
        self.dof = n
        self.elements = len(table.theta_0)
        self.entries = len(table.joint)
        self.frames = len(table.frame_parent)
        self.form = _form(table) if closure is None else places.CLOSED
        # If entry k is joint k, the screws of the entries are J itself and share its columns.
        mixed = self.form == places.MIXED or self.form == places.CLOSED
        after_twist = places.JACOBIAN_AT + 6 * n + 6
        self.screws_at = after_twist if mixed else places.JACOBIAN_AT
        self.closure_at = after_twist + (6 * self.entries if mixed else 0)
        self.frames_at = self.closure_at + (0 if closure is None else closure.width)
        self.width = self.frames_at + 16 * self.frames
        # A pose of a closed loop needs the variables behind it.
        self.pose_width = places.JACOBIAN_AT if closure is None else self.frames_at
        self.widths = (self.pose_width, self.frames_at, self.width)
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

    def __reduce__(self) -> tuple[type, tuple[ChainTable, Any]]:
        """Rebuild by the constructor."""
        return Chain, (self.table, self.closure)


class Loop:
    """
    One closed loop, frozen: two chains that begin in one frame, and whose ends coincide.

    The chains are of the joints and of the passive variables of all loops, in this order.

    Parameters
    ----------
    there, back
        The chains; the residual is that of the end of `back` from the end of `there`.
    axes : shape (p,)
        Components that coincide, in the axes of the frame where both begin: 0 to 2 of the
        position, 3 to 5 of the rotation.
    first
        Index of the first of its p passive variables.
    size : m
        What a metre of the residual is compared with.
    units : shape (variables,), rad or m
        What counts as a rad of each variable.
    following
        The next loop, which may move with this one's variables; None behind the last.

    Attributes
    ----------
    count
        Number p of its components and of its variables.
    scale
        A determinant of the residual's slopes times this has no unit.
    """

    def __init__(
        self,
        there: Chain,
        back: Chain,
        axes: Integers,
        first: int,
        size: float,
        units: Floats,
        following: 'Loop | None' = None,
    ) -> None:
        count, variables = len(axes), there.variables
        if (
            not 0 < count <= 6
            or not bool(np.all((axes >= 0) & (axes < 6)))
            or not 0 <= first <= variables - count
            or back.dof != variables
            or len(units) != variables
            or max(there.entries, back.entries) > places.MOST_LOOP_ENTRIES
            or not size > 0.0
        ):
            raise TypeError('the parts of a loop do not go together')
        self.arguments = there, back, axes, first, size, units, following
        for array in (axes, units):
            array.setflags(write=False)
        self.there = there
        self.back = back
        self.following: Any = following  # nobody asks for one behind the last
        self.count, self.first, self.size = count, first, size
        self.axis = arrays.whole(axes, count)
        self.unit = arrays.numbers(units, variables)
        self.scale = 1.0
        for i in range(count):
            self.scale *= float(units[first + i]) / (size if axes[i] < 3 else 1.0)

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Rebuild by the constructor."""
        return Loop, self.arguments

    def axes(self) -> Integers:
        """Return the components that coincide, shape (p,)."""
        axes: Integers = self.arguments[2]
        return axes


def section_width(dof: int, loops: int, first: Loop) -> int:
    """Return how many numbers a `Closure` has of a position."""
    variables = first.there.variables
    width, loop = 2 * variables + (variables - dof) * dof + 3 * loops, first
    for _ in range(loops):
        width += 6 * (loop.there.entries + loop.back.entries)
        loop = loop.following
    return width


class Closure:
    """
    The closed loops of an arm with n joints and P passive variables, frozen.

    Parameters
    ----------
    dof
        Number of joints n.
    loops
        Their number.
    first
        The first of them.
    turns : shape (n,)
        1 for each joint that turns without end, and with it the loops: a turn changes nothing.
    start : shape (width,)
        What `closing.assemble` makes of the positions at which the loops are known to close. A row
        of results has the same numbers of its own position: the variables (n + P), their rates
        (n + P), how passive variables follow the joints (P, n), and for each loop the determinant
        of the slopes of its residual by its passive variables, the largest component of the
        residual, as a share of the loop's size or in rad, and the number of Newton's steps;
        and the screws of each loop's entries.

    Attributes
    ----------
    variables, passive
        n + P, and P.
    """

    def __init__(self, dof: int, loops: int, first: Loop, turns: Integers, start: Floats) -> None:
        variables = first.there.variables
        passive = variables - dof
        width = section_width(dof, loops, first)
        if (
            not 0 < passive <= places.MOST_PASSIVE
            or not 0 < dof <= places.MOST_JOINTS
            or len(turns) != dof
            or len(start) != width
        ):
            raise TypeError('the parts of a closure do not go together')
        self.arguments = dof, loops, first, turns, start
        for array in (turns, start):
            array.setflags(write=False)
        self.dof, self.loops, self.variables, self.passive = dof, loops, variables, passive
        self.first = first
        self.width = width
        self.coupling_at = 2 * variables
        self.told_at = 2 * variables + passive * dof
        self.turns = arrays.whole(turns, dof)
        self.start = arrays.numbers(start, width)

    def assembled(self) -> Floats:
        """Return the joint positions at which the loops are known to close, shape (n,)."""
        start: Floats = self.arguments[4]
        return start[: self.dof].copy()

    def variables_at_start(self) -> Floats:
        """Return the joint positions and passive variables there, shape (n + P,)."""
        start: Floats = self.arguments[4]
        return start[: self.variables].copy()

    def is_periodic(self) -> tuple[bool, ...]:
        """Return for each joint whether a turn of it leaves the loops as they are."""
        turns = self.arguments[3] != 0
        return tuple((turns | np.isinf(self.units())).tolist())

    def units(self) -> Floats:
        """Return what counts as a rad of each joint, shape (n,); infinite for one of no loop."""
        units: Floats = self.first.arguments[5]
        return units[: self.dof].copy()

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Rebuild by the constructor."""
        return Closure, self.arguments
