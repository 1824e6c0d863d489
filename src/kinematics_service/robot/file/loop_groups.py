"""Closed loops that are solved together: those that need each other's passive joints."""

from collections.abc import Sequence

from .description import LoopDescription, PassiveJoint
from .links import variables_of


def names_in_loop(loop: LoopDescription) -> frozenset[str]:
    """Return the joints and passive joints that move the chains of a loop."""
    return frozenset().union(*(variables_of(row) for row in (*loop.there, *loop.links)))


def loop_groups(loops: Sequence[LoopDescription]) -> tuple[tuple[LoopDescription, ...], ...]:
    """
    Return the groups of loops, in the order of the file: most often each loop alone.

    Two loops are of one group where each needs passive joints of the other, by itself or through
    other loops.
    """
    needed = _needed(loops)
    groups: list[list[int]] = []
    for k in range(len(loops)):
        group = next((one for one in groups if one[0] in needed[k] and k in needed[one[0]]), None)
        if group is None:
            groups.append([k])
        else:
            group.append(k)
    return tuple(tuple(loops[k] for k in group) for group in groups)


def _needed(loops: Sequence[LoopDescription]) -> list[set[int]]:
    # Which loops each one needs, by itself or through others.
    owner = {joint.name: k for k, loop in enumerate(loops) for joint in loop.passive}
    needed = [
        {owner[name] for name in names_in_loop(loop) if name in owner} - {k}
        for k, loop in enumerate(loops)
    ]
    for _ in loops:
        for own in needed:
            own.update(*(needed[k] for k in tuple(own)))
    return needed


def passive_of(group: Sequence[LoopDescription]) -> tuple[PassiveJoint, ...]:
    """Return the passive joints of a group of loops."""
    return tuple(joint for loop in group for joint in loop.passive)


def group_name(group: Sequence[LoopDescription]) -> str:
    """Return the name of a group of loops: that of a loop alone, or all with + between them."""
    return ' + '.join(loop.name for loop in group)
