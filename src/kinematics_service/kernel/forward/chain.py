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
    variables, loops, groups
        Number of joints and passive variables, of loops, and of groups of them.
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
        self.closure: Closure = closure
        self.variables: int = variables
        self.loops: int = 0 if closure is None else closure.loops
        self.groups: int = 0 if closure is None else closure.groups
        self.table: ChainTable = table
        self.dof: int = n
        self.elements, self.entries = len(table.theta_0), len(table.joint)
        self.frames: int = len(table.frame_parent)
        self.form: int = _form(table) if closure is None else places.CLOSED
        # If entry k is joint k, the screws of the entries are J itself and share its columns.
        mixed = self.form == places.MIXED or self.form == places.CLOSED
        after_twist = places.JACOBIAN_AT + 6 * n + 6
        self.screws_at: int = after_twist if mixed else places.JACOBIAN_AT
        self.closure_at: int = after_twist + (6 * self.entries if mixed else 0)
        self.frames_at: int = self.closure_at + (0 if closure is None else closure.width)
        self.width: int = self.frames_at + 16 * self.frames
        # A pose of a closed loop needs the variables behind it.
        self.pose_width: int = places.JACOBIAN_AT if closure is None else self.frames_at
        self.widths: tuple[int, ...] = (self.pose_width, self.frames_at, self.width)
        self.single_widths: tuple[int, ...] = tuple(
            width + 2 * n + places.ROW_TAIL for width in self.widths
        )
        self.at_rest: Floats = np.zeros(n)
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
    axes : shape (r,)
        Components that coincide, in the axes of the frame where both begin: 0 to 2 of the
        position, 3 to 5 of the rotation.
    row
        How many components the loops before it in its group have.
    following
        The next loop of its group; None behind the last.

    Attributes
    ----------
    count
        Number r of its components.
    entries
        Of both chains.
    """

    def __init__(
        self,
        there: Chain,
        back: Chain,
        axes: Integers,
        row: int,
        following: 'Loop | None' = None,
    ) -> None:
        count = len(axes)
        if (
            not 0 < count <= 6
            or not bool(np.all((axes >= 0) & (axes < 6)))
            or back.dof != there.dof
            or max(there.entries, back.entries) > places.MOST_LOOP_ENTRIES
            or following is not None
            and (following.arguments[3] != row + count or following.arguments[0].dof != there.dof)
        ):
            raise TypeError('the parts of a loop do not go together')
        self.arguments: tuple[Any, ...] = there, back, axes, row, following
        axes.setflags(write=False)
        self.there, self.back, self.row, self.count = there, back, row, count
        self.following: Loop = following  # type: ignore[assignment]  # nobody asks for one behind the last
        self.entries = there.entries + back.entries
        self.axis = arrays.whole(axes, count)

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Rebuild by the constructor."""
        return Loop, self.arguments

    def axes(self) -> Integers:
        """Return the components that coincide, shape (r,)."""
        axes: Integers = self.arguments[2]
        return axes


class LoopGroup:
    """
    Closed loops that are solved together, frozen: a loop alone, or several of which each needs
    passive variables of the others.

    Parameters
    ----------
    loop
        The first of them.
    loops
        Their number.
    first
        Index of the first of the passive variables of the group.
    size : m
        What a metre of the residual is compared with.
    units : shape (variables,), rad or m
        What counts as a rad of each variable.
    following
        The next group, which may move with this one's variables; None behind the last.

    Attributes
    ----------
    count
        Number p of its components, and of its passive variables.
    entries
        Of all its chains.
    variables
        Joints and passive variables of all groups.
    spans : shape (p,), m or rad
        What each component of the residual is compared with: the size, or 1.
    scale
        A determinant of the residual's slopes times this has no unit.
    """

    def __init__(
        self,
        loop: Loop,
        loops: int,
        first: int,
        size: float,
        units: Floats,
        following: 'LoopGroup | None' = None,
    ) -> None:
        self.arguments: tuple[Any, ...] = loop, loops, first, size, units, following
        self.loop, self.loops, self.first, self.size = loop, loops, first, size
        self.following: LoopGroup = following  # type: ignore[assignment]
        self.variables = loop.there.dof
        members = self.members()
        self.count: int = sum(one.count for one in members)
        self.entries: int = sum(one.entries for one in members)
        if (
            loop.row != 0
            or members[loops - 1].arguments[4] is not None
            or self.count > places.MOST_LOOP_ROWS
            or not 0 <= first <= self.variables - self.count
            or len(units) != self.variables
            or not size > 0.0
            or following is not None
            and (following.first != first + self.count or following.variables != self.variables)
        ):
            raise TypeError('the parts of a group of loops do not go together')
        axes = np.concatenate([one.axes() for one in members])
        self.spans: Floats = np.where(axes < 3, size, 1.0)
        for array in (units, self.spans):
            array.setflags(write=False)
        self.unit = arrays.numbers(units, self.variables)
        self.span = arrays.numbers(self.spans, self.count)
        self.scale = 1.0
        for i in range(self.count):
            self.scale *= float(units[first + i]) / float(self.spans[i])

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Rebuild by the constructor."""
        return LoopGroup, self.arguments

    def members(self) -> list[Loop]:
        """Return the loops of the group."""
        members, loop = [self.loop], self.loop
        while len(members) < self.loops and loop.arguments[4] is not None:
            loop = loop.following
            members.append(loop)
        if len(members) != self.loops:
            raise TypeError('the parts of a group of loops do not go together')
        return members


def groups_from(first: LoopGroup) -> list[LoopGroup]:
    """Return a group and all that follow it."""
    groups, group = [first], first
    while group.arguments[5] is not None:
        group = group.following
        groups.append(group)
    return groups


def section_width(dof: int, first: LoopGroup) -> int:
    """Return how many numbers a `Closure` has of a position."""
    groups, variables = groups_from(first), first.variables
    entries = sum(group.entries for group in groups)
    return 2 * variables + (variables - dof) * dof + 3 * len(groups) + 6 * entries


class Closure:
    """
    The closed loops of an arm with n joints and P passive variables, frozen.

    Parameters
    ----------
    dof
        Number of joints n.
    first
        The first group of loops that are solved together; most often a loop alone.
    turns : shape (n,)
        1 for each joint that turns without end, and with it the loops: a turn changes nothing.
    start : shape (width,)
        What `closing.assemble` makes of the positions at which the loops are known to close. A row
        of results has the same numbers of its own position: the variables (n + P), their rates
        (n + P), how passive variables follow the joints (P, n), and for each group the determinant
        of the slopes of its residual by its passive variables, the largest component of the
        residual, as a share of the loops' size or in rad, and the number of Newton's steps;
        and the screws of each loop's entries.

    Attributes
    ----------
    variables, passive
        n + P, and P.
    loops, groups
        Number of loops, and of groups.
    screws_at
        Where the screws begin.
    """

    def __init__(self, dof: int, first: LoopGroup, turns: Integers, start: Floats) -> None:
        variables = first.variables
        passive = variables - dof
        width, groups = section_width(dof, first), groups_from(first)
        if (
            not 0 < passive <= places.MOST_PASSIVE
            or not 0 < dof <= places.MOST_JOINTS
            or first.first != dof
            or groups[len(groups) - 1].first + groups[len(groups) - 1].count != variables
            or len(turns) != dof
            or len(start) != width
        ):
            raise TypeError('the parts of a closure do not go together')
        self.arguments: tuple[Any, ...] = dof, first, turns, start
        for array in (turns, start):
            array.setflags(write=False)
        self.dof, self.variables, self.passive = dof, variables, passive
        self.first, self.groups, self.width = first, len(groups), width
        self.loops: int = sum(group.loops for group in groups)
        self.coupling_at, self.told_at = 2 * variables, 2 * variables + passive * dof
        self.screws_at = self.told_at + 3 * self.groups
        self.turns = arrays.whole(turns, dof)
        self.start = arrays.numbers(start, width)

    def assembled(self) -> Floats:
        """Return the joint positions at which the loops are known to close, shape (n,)."""
        start: Floats = self.arguments[3]
        return start[: self.dof].copy()

    def variables_at_start(self) -> Floats:
        """Return the joint positions and passive variables there, shape (n + P,)."""
        start: Floats = self.arguments[3]
        return start[: self.variables].copy()

    def is_periodic(self) -> tuple[bool, ...]:
        """Return for each joint whether a turn of it leaves the loops as they are."""
        turns = self.arguments[2] != 0
        return tuple((turns | np.isinf(self.units())).tolist())

    def units(self) -> Floats:
        """Return what counts as a rad of each joint, shape (n,); infinite for one of no loop."""
        units: Floats = self.first.arguments[4]
        return units[: self.dof].copy()

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Rebuild by the constructor."""
        return Closure, self.arguments
