# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Group closed loops whose equations must be solved together, because each loop moves the others.
"""

from collections.abc import Sequence

from .description import LoopDescription, PassiveJoint
from .links import names_in_rows

BETWEEN = ' + '  # separates the names of the loops in the name of a group


def names_in_loop(loop: LoopDescription) -> frozenset[str]:
    """Return the names of joints and passive joints that move the two chains of a loop."""
    return names_in_rows((*loop.there, *loop.links))


def loop_groups(loops: Sequence[LoopDescription]) -> tuple[tuple[LoopDescription, ...], ...]:
    """
    Return the closed loops of an arm in groups. The loops of a group are solved together.

    Most groups have one loop. Loop A needs loop B if a passive joint of B moves one of the two
    chains of A, directly or through further loops. A and B are in one group if A needs B and B
    needs A. Groups are in the order of the file.
    """
    needed = _needed(loops)
    groups: list[list[int]] = []
    for k in range(len(loops)):
        group = next(
            (group for group in groups if group[0] in needed[k] and k in needed[group[0]]), None
        )
        if group is None:
            groups.append([k])
        else:
            group.append(k)
    return tuple(tuple(loops[k] for k in group) for group in groups)


def _needed(loops: Sequence[LoopDescription]) -> list[set[int]]:
    # Return, for each loop A, the indices of the loops that A needs. A needs loop B if a passive
    # joint of B moves one of the two chains of A, directly or through other loops.
    owner = {joint.name: k for k, loop in enumerate(loops) for joint in loop.passive}
    needed = [
        {owner[name] for name in names_in_loop(loop) if name in owner} - {k}
        for k, loop in enumerate(loops)
    ]
    for _ in loops:
        for indices in needed:
            indices.update(*(needed[k] for k in tuple(indices)))
    return needed


def passive_of(group: Sequence[LoopDescription]) -> tuple[PassiveJoint, ...]:
    """Return the passive joints of all loops in a group."""
    return tuple(joint for loop in group for joint in loop.passive)


def group_name(group: Sequence[LoopDescription]) -> str:
    """Return the name of a group of loops: the names of its loops, joined by ` + `."""
    return BETWEEN.join(loop.name for loop in group)


def group_key(name: str) -> str:
    """Return the name of a group of loops as a key of a message: `a_b` for the group `a + b`."""
    return name.replace(BETWEEN, '_')


def closed_together(name: str) -> bool:
    """Return whether a group of loops, given by its name, has more than one loop."""
    return BETWEEN in name


def group_in_words(name: str) -> str:
    """Return a group of loops as text: `loop a`, or `loops a, b and c together`."""
    return all_in_words((name,)) + (' together' if closed_together(name) else '')


def all_in_words(names: Sequence[str]) -> str:
    """Return the loops of several groups as text: `loop a`, or `loops a, b and c`."""
    *others, last = (name for group in names for name in group.split(BETWEEN))
    return f'loops {", ".join(others)} and {last}' if others else f'loop {last}'
