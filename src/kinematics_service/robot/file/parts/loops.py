# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read the closed loops of a robot file. A loop is a second chain between two rows of the table.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..text.entries import checked, checked_list, checked_word
from ..text.expression_syntax import NameRefusal, why_no_name
from ..text.fault_report import Place, quoted
from ..text.plain_expression import known_names_in
from ..text.yaml_document import Yaml, texts_in
from .convention_table import Convention
from .description import (
    IDENTITY,
    Link,
    LoopDescription,
    PassiveJoint,
    PointDescription,
)
from .links import names_in_rows, read_links
from .loop_groups import loop_groups, names_in_loop, passive_of
from .motions import pose_motion
from .points import check_row
from .quantities import KIND_OF, Quantities
from .schema import LoopEndEntry, LoopEntry, PassiveEntry, assembled_entry
from .singularity import read_rows

MAX_LOOPS = 12
MAX_PASSIVE = 24
MAX_TOGETHER = 18


def read_passive(
    data: Yaml, taken: Sequence[str], at: Place
) -> tuple[tuple[PassiveJoint, ...], ...]:
    """
    Return the passive joints of each closed loop, and report joint names that are not allowed.

    Parameters
    ----------
    data
        The value of the key `loops`; None if the file does not have the key.
    taken
        Names that a passive joint may not have: the names of constants and joint variables.
    at
        The place of the list of loops in the file.
    """
    if data is None:
        return ()
    loops = checked_list(data, at, 'a list of loops')
    if len(loops) > MAX_LOOPS:
        at.fault(f'{len(loops)} loops (at most {MAX_LOOPS})', 'too-many')
        return ()
    owner: dict[str, int] = {}
    passive = []
    for k, loop in enumerate(loops):
        items, place = loop.get('passive') if isinstance(loop, dict) else None, at[k, 'passive']
        if items is not None:
            items = checked_list(items, place, 'a list of passive joints')
        joints = [_passive_joint(item, place[i]) for i, item in enumerate(items or ())]
        for i, joint in enumerate(joints):
            if joint and (fault := _why_not_passive(joint.name, taken, owner)):
                place[i].fault(f'{quoted(joint.name)} {fault.message}', fault.code)
            elif joint:
                owner[joint.name] = k
        passive.append(tuple(joint for joint in joints if joint))
    if len(owner) > MAX_PASSIVE:
        at.fault(f'{len(owner)} passive joints (at most {MAX_PASSIVE})', 'too-many')
        return ()
    return tuple(passive)


def _why_not_passive(
    name: str, taken: Sequence[str], owner: Mapping[str, int]
) -> NameRefusal | None:
    if name in taken or name == 'q':
        message = 'is also the name of a constant or of a driven joint; write another name'
        return NameRefusal(message, 'duplicate-name')
    if name in owner:
        message = f'is already passive in loops[{owner[name]}]; write another name'
        return NameRefusal(message, 'duplicate-name')
    return why_no_name(name)


def _passive_joint(item: Yaml, at: Place) -> PassiveJoint | None:
    if isinstance(item, dict):
        entry = checked(PassiveEntry, item, at)
        name, prismatic = entry.name, entry.type == 'prismatic'
    else:
        name, prismatic = checked_word(item, at), False
    return None if name is None else PassiveJoint(name, 'prismatic' if prismatic else 'revolute')


def names_in_loops(data: Yaml, known: Collection[str]) -> frozenset[str]:
    """Return the names in `known` that occur in the rows (key `links`) of at least one loop."""
    loops = data if isinstance(data, list) else ()
    rows = [loop['links'] for loop in loops if isinstance(loop, dict) and 'links' in loop]
    return frozenset().union(*(known_names_in(text, known) for text in texts_in(rows)))


def read_loops(
    data: Yaml,
    passive: Sequence[tuple[PassiveJoint, ...]],
    table: Sequence[Link] | None,
    points: Sequence[PointDescription],
    convention: Convention,
    quantities: Quantities,
) -> tuple[LoopDescription, ...]:
    """
    Read the closed loops in the order of the file. Report faults; after a fault return no loops.

    Parameters
    ----------
    data
        The value of the key `loops`; None if the file does not have the key.
    passive
        The passive joints of each loop.
    table, points, convention
        The rows of the table (None if they have faults), and the points and the convention of the
        file.
    quantities
        The meaning of the names in expressions.
    """
    at = quantities.top['loops']
    reader = _LoopReader(table, points, convention, quantities)
    results = [
        reader.read(item, joints, at[k])
        for k, (item, joints) in enumerate(zip(data if isinstance(data, list) else (), passive))
    ]
    loops = tuple(loop for loop in results if loop is not None)
    if table is None or len(loops) < len(results) or not at.intact:
        return ()
    if len(quantities.joint_types) - len(quantities.types) < sum(map(len, passive)):
        return ()  # two joints have the same name, which another function reports as a fault
    called = [loop.name for loop in loops]
    _check_effect(loops, table, at)
    for k, loop in enumerate(loops):
        first = called.index(loop.name)
        if first < k:
            message = f'{quoted(loop.name)} is already the name of loops[{first}]'
            at[k, 'name'].fault(message, 'duplicate-name')
        if loop.q != loops[0].q:
            at[k, 'assembled', 'q'].fault(
                f'differs from that of {quoted(loops[0].name)}; all loops have one assembled q',
                'mismatch',
            )
    return loops


def _check_effect(loops: Sequence[LoopDescription], table: Sequence[Link], at: Place) -> None:
    # Report three kinds of faults:
    # - A passive joint is in no row of its own loop.
    # - A row of a loop has a passive joint of a later loop in the file, and the two loops are not
    #   in one group. (The loops of a group are solved together.)
    # - The passive joints of a group are neither in a row of the table nor in a row of a later
    #   loop.
    places = {loop.name: k for k, loop in enumerate(loops)}
    used = names_in_rows(table)
    for group in reversed(loop_groups(loops)):
        indices = [places[loop.name] for loop in group]
        later = {
            joint.name: k
            for k, loop in enumerate(loops)
            for joint in loop.passive
            if k not in indices
        }
        for k, loop in zip(indices, group):
            names = names_in_loop(loop)
            for joint in loop.passive:
                if joint.name not in names:
                    at[k, 'passive'].fault(
                        f'{quoted(joint.name)} moves no row of this loop; use it in links, or in '
                        f'the table between row {loop.start.row} and row {loop.meets.row}',
                        'no-effect',
                    )
            for name in sorted(names & later.keys()):
                if later[name] > k:
                    at[k, 'links'].fault(
                        f'{quoted(name)} is passive in loops[{later[name]}], which comes later; '
                        'write that loop before this one',
                        'wrong-order',
                    )
        _check_group(group, indices, used, at)
        used = used.union(*map(names_in_loop, group))


def _check_group(
    group: Sequence[LoopDescription], indices: Sequence[int], used: frozenset[str], at: Place
) -> None:
    first, listed = at[indices[0]], [f'loops[{k}]' for k in indices]
    if indices[-1] - indices[0] >= len(indices):
        first.fault(
            f"{' and '.join(listed)} need each other's passive joints; "
            'write them one after the other',
            'wrong-order',
        )
    rows = sum(len(loop.rows) for loop in group)
    if rows > MAX_TOGETHER:
        first.fault(
            f"{rows} rows of loops that need each other's passive joints ({', '.join(listed)}); "
            f'at most {MAX_TOGETHER} are closed together',
            'too-many',
        )
    names = [joint.name for joint in passive_of(group)]
    if not used.intersection(names):
        first['passive'].fault(
            f'no row of the table or of a later loop has {" or ".join(map(quoted, names))}; use '
            f'it in links, or delete the {"loop" if len(group) == 1 else "loops"}',
            'no-effect',
        )


@dataclass(frozen=True)
class _LoopReader:
    """Read the entries of closed loops, given the table and the points of the arm."""

    table: Sequence[Link] | None
    points: Sequence[PointDescription]
    convention: Convention
    quantities: Quantities

    def read(
        self, data: Yaml, passive: tuple[PassiveJoint, ...], at: Place
    ) -> LoopDescription | None:
        """Read the entry of a loop. Report faults; after a fault return None."""
        entry = checked(LoopEntry, data, at)
        rows: tuple[str, ...] = ()
        if entry.rows is not None:
            rows = read_rows(entry.rows, 'row', at['rows'])
        if entry.name is not None and ',' in entry.name:
            at['name'].fault(f'{quoted(entry.name)} has a comma; write another name', 'wrong-name')
        if entry.passive == []:
            at['passive'].fault('at least one passive joint is needed', 'empty')
        if passive and rows and len(passive) != len(rows):
            names = ', '.join(joint.name for joint in passive)
            at['passive'].fault(
                f'{len(passive)} passive joints ({names}) for {len(rows)} rows '
                f'({" ".join(rows)}); write one passive joint for each row',
                'wrong-length',
            )
        start, meets = self._ends(entry, at)
        links = None
        if entry.links is not None:
            links = read_links(entry.links, self.convention, at['links'], self.quantities)
        q, assembled = self._assembled(entry.assembled, passive, at['assembled'])
        if not at.intact or self.table is None:
            return None
        if not (entry.name and start and meets and links):
            return None
        table_links = tuple(self.table[start.row : meets.row])
        line = at['assembled'].line
        return LoopDescription(
            entry.name, passive, start, meets, table_links, links, rows, q, assembled, line
        )

    def _ends(
        self, entry: LoopEntry, at: Place
    ) -> tuple[PointDescription | None, PointDescription | None]:
        start: PointDescription | None = PointDescription('start', 0, IDENTITY)
        if entry.from_ is not None:
            start = self._end(entry.from_, at['from'])
        meets = None if entry.meets is None else self._end(entry.meets, at['meets'])
        if start and meets and start.row > meets.row:
            at['meets'].fault(
                f'row {meets.row} comes before row {start.row}, where the loop begins; exchange '
                'from and meets',
                'wrong-order',
            )
        return start, meets

    def _end(self, data: Yaml, at: Place) -> PointDescription | None:
        entry = checked(LoopEndEntry, data, at)
        if entry.point is not None:
            if entry.row is not None or entry.xyz is not None or entry.rpy is not None:
                at.fault('has a point and also row, xyz or rpy; write one of the two', 'conflict')
            return self._point(entry.point, at['point'])
        if entry.row is None and at.intact:
            at.fault('write a row of the table, or a point', 'missing-key')
        motion = pose_motion(entry, at, self.quantities)
        if self.table is not None:
            check_row(entry.row, len(self.table), at)
        if entry.row is None or motion is None or not at.intact:
            return None
        return PointDescription(f'row {entry.row}', entry.row, motion)

    def _point(self, name: str, at: Place) -> PointDescription | None:
        point = next((point for point in self.points if point.name == name), None)
        if point is None:
            known = ', '.join(point.name for point in self.points) or 'none'
            at.fault(f'unknown point {quoted(name)} (known: {known})', 'unknown-name')
        return point

    def _assembled(
        self, data: Yaml, passive: Sequence[PassiveJoint], at: Place
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        if data is None:
            return (), ()
        entry: Any = checked(assembled_entry(tuple(joint.name for joint in passive)), data, at)
        q = self.quantities.positions(entry.q, at['q'])
        values = [
            self.quantities.fixed(
                getattr(entry, joint.name), KIND_OF[joint.type], at[joint.name], usual=False
            )
            for joint in passive
        ]
        return q, tuple(value for value in values if value is not None)
