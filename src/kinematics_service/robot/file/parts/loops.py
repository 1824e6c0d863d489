"""The closed loops of a robot file: second chains that part from the table and meet it again."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..text.entries import checked, checked_list, checked_word
from ..text.expression_syntax import why_no_name
from ..text.fault_report import Place, quoted
from ..text.plain_expression import known_names_in
from ..text.yaml_document import ScalarNode, Yaml, texts_in
from .convention_table import Convention
from .description import (
    IDENTITY,
    Link,
    LoopDescription,
    PassiveJoint,
    PointDescription,
)
from .links import likely_convention, names_in_rows, read_links
from .loop_groups import loop_groups, names_in_loop, passive_of
from .motions import pose_motion
from .points import check_row
from .quantities import KIND_OF, Quantities
from .schema import LoopEndEntry, LoopEntry, PassiveEntry, assembled_entry
from .singularity import read_rows

MAX_LOOPS = 12
MAX_PASSIVE = 24
MAX_TOGETHER = 18


def read_passive(data: Yaml, taken: Sequence[str], at: Place) -> tuple[PassiveJoint, ...]:
    """
    Return the passive joints of all loops, without those whose names have faults.

    Parameters
    ----------
    data
        The list of loops as the file has it; None where there is none.
    taken
        The names of constants and of joints in expressions.
    at
        The place of the list.
    """
    if data is None:
        return ()
    found: list[PassiveJoint] = []
    owner: dict[str, int] = {}
    loops = checked_list(data, at, 'a list of loops')
    if len(loops) > MAX_LOOPS:
        at.fault(f'{len(loops)} loops (at most {MAX_LOOPS})')
        return ()
    for k, loop in enumerate(loops):
        items = loop.get('passive') if isinstance(loop, dict) else None
        if items is None:
            continue
        inside = at[k, 'passive']
        for i, item in enumerate(checked_list(items, inside, 'a list of passive joints')):
            place = inside[i]
            joint = _passive_joint(item, place)
            if joint is None:
                continue
            if reason := why_no_name(joint.name):
                place.fault(f'{quoted(joint.name)} {reason}')
            elif joint.name in taken or joint.name == 'q':
                place.fault(
                    f'{quoted(joint.name)} is also the name of a constant or of a joint with a '
                    'motor: a passive joint has a name of its own'
                )
            elif joint.name in owner:
                place.fault(
                    f'{quoted(joint.name)} is moved by loops[{owner[joint.name]}] already: a '
                    'passive joint belongs to one loop'
                )
            else:
                owner[joint.name] = k
                found.append(joint)
    if len(found) > MAX_PASSIVE:
        at.fault(f'{len(found)} passive joints (at most {MAX_PASSIVE})')
        return ()
    return tuple(found)


def _passive_joint(item: Yaml, at: Place) -> PassiveJoint | None:
    if not isinstance(item, dict):
        name = checked_word(item, at)
        return None if name is None else PassiveJoint(name, 'revolute')
    entry = checked(PassiveEntry, item, at)
    if entry.name is None:
        return None
    return PassiveJoint(entry.name, 'prismatic' if entry.type == 'prismatic' else 'revolute')


def moving_loops(data: Yaml, known: Collection[str]) -> frozenset[str]:
    """Return the names in the rows of the loops' own chains, as they are known."""
    loops = data if isinstance(data, list) else ()
    rows = [loop['links'] for loop in loops if isinstance(loop, dict) and 'links' in loop]
    return frozenset().union(*(known_names_in(text, known) for text in texts_in(rows)))


def read_loops(
    data: Yaml,
    passive: Sequence[PassiveJoint],
    table: Sequence[Link] | None,
    points: Sequence[PointDescription],
    convention: Convention | None,
    quantities: Quantities,
) -> tuple[LoopDescription, ...]:
    """
    Return the loops in the order of the file; none where one has faults.

    Parameters
    ----------
    data
        The list as the file has it; None where there is none.
    passive
        As `read_passive` returns them.
    table, points, convention
        What is known of the arm; None where it has faults.
    quantities
        What the names in expressions mean.
    """
    if not isinstance(data, list):
        return ()
    at = quantities.top['loops']
    names = {joint.name: joint for joint in passive}
    reader = _LoopReader(names, table, points, convention, quantities)
    loops = [reader.read(item, at[k]) for k, item in enumerate(data[:MAX_LOOPS])]
    found = tuple(loop for loop in loops if loop is not None)
    if table is None or len(found) < len(data) or not at.intact:
        return ()
    if sum(len(loop.passive) for loop in found) > len(passive):
        return ()  # one of them belongs to two loops, which has been said
    called = [loop.name for loop in found]
    for k, name in enumerate(called):
        if name in called[:k]:
            first = called.index(name)
            at[k, 'name'].fault(f'{quoted(name)} is already the name of loops[{first}]')
    _check_effect(found, table, at)
    for k, loop in enumerate(found):
        if loop.q != found[0].q:
            at[k, 'assembled', 'q'].fault(
                f'is not that of {quoted(found[0].name)}: all loops are assembled at one position'
            )
    return found


def _check_effect(loops: Sequence[LoopDescription], table: Sequence[Link], at: Place) -> None:
    # Every passive joint stands in its loop; no loop needs a later one, but those of one group
    # each other; and every group moves something.
    places = {id(loop): k for k, loop in enumerate(loops)}
    used, groups = names_in_rows(table), loop_groups(loops)
    owner = {
        joint.name: (places[id(loop)], g)
        for g, group in enumerate(groups)
        for loop in group
        for joint in loop.passive
    }
    for g, group in reversed([*enumerate(groups)]):
        members = [(places[id(loop)], loop) for loop in group]
        for k, loop in members:
            names = names_in_loop(loop)
            for joint in loop.passive:
                if joint.name not in names:
                    at[k, 'passive'].fault(
                        f'{quoted(joint.name)} moves no row of this loop: neither one of links, '
                        f'nor one of the table between row {loop.start.row} and row '
                        f'{loop.meets.row}'
                    )
            for name in sorted(names & owner.keys()):
                its_loop, its_group = owner[name]
                if its_loop > k and its_group != g:
                    at[k, 'links'].fault(
                        f'{quoted(name)} is moved by loops[{its_loop}], which comes later: a loop '
                        'may use the passive joints of those before it, and of later ones that '
                        'need its own'
                    )
        _check_group(members, used, at)
        used = used.union(*map(names_in_loop, group))


def _check_group(
    members: Sequence[tuple[int, LoopDescription]], used: frozenset[str], at: Place
) -> None:
    first, loop = members[0]
    places = [k for k, _ in members]
    passive = passive_of([loop for _, loop in members])
    if places != list(range(first, first + len(places))):
        listed = ' and '.join(f'loops[{k}]' for k in places)
        at[first].fault(
            f"{listed} need each other's passive joints and are closed together: write them one "
            'after the other'
        )
    rows = sum(len(loop.rows) for _, loop in members)
    if rows > MAX_TOGETHER:
        listed = ', '.join(f'loops[{k}]' for k in places)
        at[first].fault(
            f"{rows} rows of loops that need each other's passive joints ({listed}): at most "
            f'{MAX_TOGETHER} are closed together'
        )
    if not used & {joint.name for joint in passive}:
        listed = ' or '.join(quoted(joint.name) for joint in passive)
        what = 'loop' if len(members) == 1 else 'loops'
        at[first, 'passive'].fault(
            f'no row of the table and no later loop moves with {listed}: the {what} would move '
            'nothing'
        )


@dataclass(frozen=True)
class _LoopReader:
    """Reads loops one by one."""

    passive: Mapping[str, PassiveJoint]
    table: Sequence[Link] | None
    points: Sequence[PointDescription]
    convention: Convention | None
    quantities: Quantities

    def read(self, data: Yaml, at: Place) -> LoopDescription | None:
        """Return a loop, or None with its faults reported."""
        entry = checked(LoopEntry, data, at)
        names = _names_of(entry.passive)
        passive = tuple(self.passive[name] for name in names if name in self.passive)
        rows: tuple[str, ...] = ()
        if entry.rows is not None:
            rows = read_rows(entry.rows, 'row', at['rows'])
        if entry.name is not None and ',' in entry.name:
            at['name'].fault(f'{quoted(entry.name)} holds a comma')
        if entry.passive is not None and not names:
            at['passive'].fault('names no joint: at least one is needed')
        if passive and rows and len(names) != len(rows):
            at['passive'].fault(
                f'{len(names)} passive joints ({", ".join(names)}) for {len(rows)} rows that '
                f'coincide ({" ".join(rows)}): a loop moves as many joints as it has rows'
            )
        start, meets = self._ends(entry, at)
        convention = self.convention or likely_convention(entry.links)
        links = None
        if entry.links is not None:
            links = read_links(entry.links, convention, at['links'], self.quantities)
        q, assembled = self._assembled(entry.assembled, names, at['assembled'])
        if not at.intact or self.table is None:
            return None
        if not (entry.name and start and meets and links):
            return None
        there = tuple(self.table[start.row : meets.row])
        line = at['assembled'].line
        return LoopDescription(
            entry.name, passive, start, meets, there, links, rows, q, assembled, line
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
                f'row {meets.row} comes before row {start.row}, where the loop begins: exchange '
                'them'
            )
        return start, meets

    def _end(self, data: Yaml, at: Place) -> PointDescription | None:
        entry = checked(LoopEndEntry, data, at)
        if entry.point is not None:
            if entry.row is not None or entry.xyz is not None or entry.rpy is not None:
                at.fault('has a point and a row, xyz or rpy too: give one of them')
            return self._point(entry.point, at['point'])
        if entry.row is None and at.intact:
            at.fault('needs a row of the table, or a point')
        motion = pose_motion(entry, at, self.quantities)
        rows = None if self.table is None else len(self.table)
        check_row(entry.row, rows, at)
        if entry.row is None or motion is None or not at.intact:
            return None
        return PointDescription(f'row {entry.row}', entry.row, motion)

    def _point(self, name: str, at: Place) -> PointDescription | None:
        found = next((point for point in self.points if point.name == name), None)
        if found is None:
            known = ', '.join(point.name for point in self.points) or 'none'
            at.fault(f'unknown point {quoted(name)} (known: {known})')
        return found

    def _assembled(
        self, data: Yaml, names: Sequence[str], at: Place
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        if data is None:
            return (), ()
        entry: Any = checked(assembled_entry(tuple(names)), data, at)
        q = self.quantities.positions(entry.q, at['q'])
        values = [
            self.quantities.fixed(
                getattr(entry, name), KIND_OF[self.passive[name].type], at[name], usual=False
            )
            for name in names
            if name in self.passive
        ]
        return q, tuple(value for value in values if value is not None)


def _names_of(items: Yaml) -> list[str]:
    # Of a list of passive joints as the file has it.
    names = []
    for item in items if isinstance(items, list) else ():
        named = item.get('name') if isinstance(item, dict) else item
        if isinstance(named, ScalarNode):
            names.append(named.text)
    return names
