# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Store the kinematic chain of an arm as arrays. The tool pose is a product: a constant transform, a
screw motion about z, a constant transform, a screw motion, and so on. Joint positions set the
angles and translations of the screw motions. If the arm has closed loops, passive variables set
the angles or translations of some screw motions. The loop equations determine the passive
variables from the joint positions.
"""

from typing import Any, NamedTuple

import numpy as np

from ..layout import arrays, places
from ..layout.arrays import Floats, Integers


class ChainTable(NamedTuple):
    """
    The arrays that describe a kinematic chain of screws about z.

    An element is one screw about its own z axis. An entry is a pair: an element, and a joint that
    moves the element. Most elements are moved by one joint only, so they have one entry.

    Attributes
    ----------
    dof
        Number of joints n.
    before : shape (elements + 1, 3, 4)
        The constant transform before each element, and after the last element; each is the first
        three rows of a 4 x 4 matrix.
    theta_0, d_0 : shape (elements,), rad, m
        Angle and translation of each element if all joint positions are 0.
    first_entry : shape (elements + 1,)
        First entry of each element; the last number is the number of entries.
    joint : shape (entries,)
        Index of the joint of each entry.
    by_theta, by_d : shape (entries,)
        Angle and translation by which the element moves if the joint of the entry moves by 1 rad
        or 1 m.
    frame_parent : shape (frames,)
        For each frame of the DH table, in the order from base to tool: the index of the last
        element before the frame, its parent; -1 if no element is before it, so that the frame is
        fixed.
    frame_offset : shape (frames, 3, 4)
        The pose of each frame relative to its parent element, or to the base.
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
    # Returns whether all indices in the table are valid for a chain with `variables` joints and
    # passive variables.
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
    # Returns whether `motion` (3, 4) is Rx(alpha) Tx(a), as in a row of a Denavit-Hartenberg
    # table.
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
    The kinematic chain of an arm for the kernel, immutable.

    Parameters
    ----------
    table
        The arrays of the chain.
    closure
        The closed loops of the arm, a `Closure`; None for an arm without loops.

    Attributes
    ----------
    table
        The arrays of the chain, read-only. `Chain` also has one field for each array, with the
        same name, for example `chain.theta_0`. The kernel reads the array through this field, as a
        flat array. In the compiled kernel these fields are pointers, which Python code cannot
        read.
    dof, elements, entries, frames
        Number of joints n, number of elements (screws about z), number of entries (pairs: an
        element, and a joint that moves the element; see `ChainTable`), and number of frames of the
        DH table.
    form
        TWISTED: the joint of entry k is joint k, and all constant transforms between elements are
        Rx(alpha) Tx(a). PLAIN: the joint of entry k is joint k. MIXED: the joint of entry k is not
        always joint k. CLOSED: the arm has closed loops.
    variables, loops, groups
        Number of joints and passive variables together, number of loops, and number of groups of
        loops.
    screws_at, closure_at, frames_at, width
        `width` is the length of a row of results, which `evaluate` fills. The other three are
        indices in this row, where three parts begin: the screws of the entries (6, entries), the
        section (the values that describe the closed loops, see `Closure`), and the frames of the
        DH table.
    widths, single_widths
        Length of a row at each depth (POSE, JACOBIAN, ALL_FRAMES). Rows of `single_widths` have q,
        qdot and a quaternion at the end; `evaluate_one` fills such rows.
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
        # An entry is a pair: an element of the chain, and a joint that moves the element. Each
        # entry has a screw. Column j of J is the sum of the screws of all entries with joint j. If
        # the joint of entry k is joint k for all k, column k of J is the screw of entry k. The row
        # of results then has no separate screws: `screws_at` is the index of J.
        mixed = self.form == places.MIXED or self.form == places.CLOSED
        after_twist = places.JACOBIAN_AT + 6 * n + 6
        self.screws_at: int = after_twist if mixed else places.JACOBIAN_AT
        self.closure_at: int = after_twist + (6 * self.entries if mixed else 0)
        self.frames_at: int = self.closure_at + (0 if closure is None else closure.width)
        self.width: int = self.frames_at + 16 * self.frames
        # `evaluate` fills a row of results up to a depth: POSE, JACOBIAN or ALL_FRAMES. At depth
        # POSE the row normally ends after the pose and the quaternion. If the arm has loops, it
        # also includes the passive variables, because the pose depends on them.
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
        """Return the constructor and its arguments, by which pickle rebuilds the object."""
        return Chain, (self.table, self.closure)


class Loop:
    """
    A closed loop: two chains that begin in the same frame and whose end frames coincide;
    immutable.

    Both chains depend on all variables: the joints, then the passive variables of all loops.

    Parameters
    ----------
    there, back
        The two chains. The residual is the pose of the end of `back` relative to the end of
        `there`.
    axes : shape (r,)
        The components in which the two end frames coincide: 0 to 2 are x, y and z of the position,
        3 to 5 of the rotation, in the axes of the frame in which both chains begin.
    row
        Index of the first component of this loop in the residual of its group. The residual of a
        group (`LoopGroup`) is one vector with the components of all loops of the group.
    following
        The next loop of the group; None for the last loop of the group.

    Attributes
    ----------
    count
        Number r of components.
    entries
        Number of entries of both chains together. An entry is a pair: an element of a chain, and a
        joint or passive variable that moves the element (see `ChainTable`).
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
            or max(there.entries, back.entries) > places.MAX_LOOP_ENTRIES
            or following is not None
            and (following.arguments[3] != row + count or following.arguments[0].dof != there.dof)
        ):
            raise TypeError('the parts of a loop do not go together')
        self.arguments: tuple[Any, ...] = there, back, axes, row, following
        axes.setflags(write=False)
        self.there, self.back, self.row, self.count = there, back, row, count
        self.following: Loop | None = following
        self.entries = there.entries + back.entries
        self.axis = arrays.whole(axes, count)

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Return the constructor and its arguments, by which pickle rebuilds the object."""
        return Loop, self.arguments

    def axes(self) -> Integers:
        """
        Return the indices of the components in which the ends of the loop coincide, shape (r,): 0
        to 2 position, 3 to 5 rotation.
        """
        axes: Integers = self.arguments[2]
        return axes


class LoopGroup:
    """
    One closed loop, or several loops that share passive variables and are solved together;
    immutable.

    Parameters
    ----------
    loop
        The first loop of the group.
    first
        Index of the first passive variable of the group.
    size : m
        Length scale by which position residuals are divided.
    units : shape (variables,), rad or m
        For each variable, the motion that is taken as equal to a rotation by 1 rad. It is infinite
        for a joint outside of all loops.
    following
        The next group of loops; None for the last group. Passive variables of this group may move
        the loops of later groups.

    Attributes
    ----------
    loops
        Number of loops.
    count
        Number p of components of the residual, which is also the number of passive variables of
        the group.
    entries
        Number of entries of all chains of the group. An entry is a pair: an element of a chain,
        and a joint or passive variable that moves the element (see `ChainTable`).
    variables
        Number of all variables of the arm: joints, and passive variables of all groups.
    spans : shape (p,), m or rad
        Scale of each component of the residual: `size` for a position, 1 for a rotation.
    scale
        The loop determinant is the determinant of the derivatives of the group's residual by the
        group's passive variables. `scale` times this determinant is dimensionless.
    """

    def __init__(
        self,
        loop: Loop,
        first: int,
        size: float,
        units: Floats,
        following: 'LoopGroup | None' = None,
    ) -> None:
        self.arguments: tuple[Any, ...] = loop, first, size, units, following
        self.loop, self.first = loop, first
        self.following: LoopGroup = following  # type: ignore[assignment]
        self.variables = loop.there.dof
        members = self.members()
        self.loops: int = len(members)
        self.count: int = sum(member.count for member in members)
        self.entries: int = sum(member.entries for member in members)
        if (
            loop.row != 0
            or self.count > places.MAX_LOOP_ROWS
            or not 0 <= first <= self.variables - self.count
            or len(units) != self.variables
            or not size > 0.0
            or following is not None
            and (following.first != first + self.count or following.variables != self.variables)
        ):
            raise TypeError('the parts of a group of loops do not go together')
        axes = np.concatenate([member.axes() for member in members])
        self.spans: Floats = np.where(axes < 3, size, 1.0)
        for array in (units, self.spans):
            array.setflags(write=False)
        self.unit = arrays.numbers(units, self.variables)
        self.span = arrays.numbers(self.spans, self.count)
        self.scale = 1.0
        for i in range(self.count):
            self.scale *= float(units[first + i]) / float(self.spans[i])

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Return the constructor and its arguments, by which pickle rebuilds the object."""
        return LoopGroup, self.arguments

    def members(self) -> list[Loop]:
        """Return all loops of the group as a list."""
        members, loop = [self.loop], self.loop.following
        while loop is not None:
            members.append(loop)
            loop = loop.following
        return members


def groups_from(first: LoopGroup) -> list[LoopGroup]:
    """Return the loop group `first` and all later loop groups, as a list."""
    groups, group = [first], first
    while group.arguments[4] is not None:
        group = group.following
        groups.append(group)
    return groups


def section_width(dof: int, first: LoopGroup) -> int:
    """
    Return the length of a section: the part of a row of results that describes the closed loops
    (see `Closure`).
    """
    groups, variables = groups_from(first), first.variables
    entries = sum(group.entries for group in groups)
    return 2 * variables + (variables - dof) * dof + 3 * len(groups) + 6 * entries


class Closure:
    """
    All closed loops of an arm with n joints and P passive variables; immutable.

    A section is an array that describes the loops at one pose. `evaluate` writes it into the row
    of results of the pose. It has, in this order: the values of the n joints and P passive
    variables; their rates; the (P, n) derivatives of the passive variables with respect to the
    joints; the status of each group of loops; the screws of each loop.

    A loop consists of two chains. An entry of a chain is a pair: an element, and a joint or
    passive variable that moves the element (see `ChainTable`). Each entry has one screw: the
    motion of the chain's end frame if the variable moves at unit velocity.

    The status of a group has three numbers. The first is the loop determinant (see `LoopGroup`).
    The second is the largest component of the residual; a position component is divided by
    `LoopGroup.size`, and a rotation component is in rad. The third is the number of Newton steps.

    Parameters
    ----------
    dof
        Number of joints n.
    first
        The first group of loops.
    turns : shape (n,)
        1 for a joint without limits whose full turns do not change the loops; 0 for other joints.
    start : shape (width,)
        The section of a pose at which the loops are known to close; `closing.assemble` has
        computed it from the variables.

    Attributes
    ----------
    variables, passive
        n + P, and P.
    loops, groups
        Numbers of loops and of groups.
    coupling_at, status_at, screws_at
        First indices, in a section, of the derivatives of the passive variables, of the status of
        the groups, and of the screws.
    """

    def __init__(self, dof: int, first: LoopGroup, turns: Integers, start: Floats) -> None:
        variables = first.variables
        passive = variables - dof
        width, groups = section_width(dof, first), groups_from(first)
        if (
            not 0 < passive <= places.MAX_PASSIVE_VARIABLES
            or not 0 < dof <= places.MAX_LOOP_JOINTS
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
        self.coupling_at, self.status_at = 2 * variables, 2 * variables + passive * dof
        self.screws_at = self.status_at + 3 * self.groups
        self.turns = arrays.whole(turns, dof)
        self.start = arrays.numbers(start, width)

    def assembled(self) -> Floats:
        """
        Return the joint positions, given in the robot file, at which the loops close, shape (n,).
        """
        start: Floats = self.arguments[3]
        return start[: self.dof].copy()

    def variables_at_start(self) -> Floats:
        """
        Return the joint positions and passive variables at which the loops are known to close,
        shape (n + P,).
        """
        start: Floats = self.arguments[3]
        return start[: self.variables].copy()

    def is_periodic(self) -> tuple[bool, ...]:
        """
        Return flags (n,). The flag of a joint is True if a full turn of the joint leaves all loops
        unchanged.
        """
        turns = self.arguments[2] != 0
        return tuple((turns | np.isinf(self.units())).tolist())

    def units(self) -> Floats:
        """
        Return for each joint the motion, rad or m, that is taken as equivalent to a rotation by 1
        rad, shape (n,). It is infinite for a joint outside of all loops.
        """
        units: Floats = self.first.arguments[3]
        return units[: self.dof].copy()

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Return the constructor and its arguments, by which pickle rebuilds the object."""
        return Closure, self.arguments
