"""
Factors written into a robot file, its comments and layout kept.

Nothing of the file is rebuilt: its YAML is parsed only for where the singularity section stands,
lines are put in there, and the result is read again and judged before it takes the file's place.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import yaml
from yaml import MappingNode, Node

from ....errors import RobotFileWriteError
from ....output_file import write_file
from ..text.yaml_reader import LOADER

BOM = '\ufeff'

Check = Callable[[str], None]


def with_factors(text: str, factors: Mapping[str, str]) -> str:
    """
    Return the text of a robot file with `singularity.factors` set, everything else unchanged.

    Parameters
    ----------
    text
        A valid robot file.
    factors
        Expressions by name, in the file's units.

    Raises
    ------
    RobotFileWriteError
        The section is written in braces that hold more than the factors.
    """
    if text.startswith(BOM):  # libyaml does not count it
        return BOM + with_factors(text.removeprefix(BOM), factors)
    root = yaml.compose(text, Loader=LOADER)
    assert isinstance(root, MappingNode)  # valid robot files are mappings
    lines = text.splitlines(keepends=True)
    if lines and not lines[-1].endswith('\n'):
        lines[-1] += '\n'
    section = entry_of(root, 'singularity')
    if section is None:
        known_poses = entry_of(root, 'known_poses')
        start = end = len(lines) if known_poses is None else known_poses[0].start_mark.line
        new = ['singularity:\n', *_factor_lines(factors, '  ', {})]
    elif not isinstance(section[1], MappingNode) or section[1].flow_style:
        key, value = section
        start, end = key.start_mark.line, value.end_mark.line + 1
        tail = text[value.end_mark.index :].split('\n', 1)[0]
        kept = _in_one_line(written_entries(text, value, ('factors',)))
        new = [f'singularity:{tail.rstrip()}\n', *kept, *_factor_lines(factors, '  ', {})]
    else:
        value = section[1]
        start = end = last_line(value) + 1
        if old := entry_of(value, 'factors'):
            start, end = old[0].start_mark.line, last_line(old[1]) + 1
        new = _factor_lines(factors, ' ' * value.start_mark.column, _comments(lines[start:end]))
    return ''.join([*lines[:start], *new, *lines[end:]])


def entry_of(mapping: MappingNode, name: str) -> tuple[Node, Node] | None:
    """Return key and value of an entry; None where there is none."""
    return next((pair for pair in mapping.value if pair[0].value == name), None)


def last_line(node: Node) -> int:
    """Return the line on which a node of YAML ends."""
    # A block's end mark is where the next thing begins, comments and blank lines between.
    if isinstance(node, MappingNode) and not node.flow_style and node.value:
        return last_line(node.value[-1][1])
    if isinstance(node.value, list) and not node.flow_style and node.value:
        return last_line(node.value[-1])
    return int(node.end_mark.line)


def written_entries(text: str, value: Node, without: Sequence[str]) -> dict[str, str]:
    """Return the entries of a mapping as they are written, by key; none of anything else."""
    return {
        key.value: text[key.start_mark.index : item.end_mark.index].rstrip()
        for key, item in (value.value if isinstance(value, MappingNode) else ())
        if key.value not in without
    }


def _in_one_line(entries: Mapping[str, str]) -> Iterator[str]:
    for key, written in entries.items():
        if '\n' in written:
            raise RobotFileWriteError(
                f'singularity.{key}: spread over several lines in braces; '
                'write the section as indented lines first'
            )
        yield f'  {written}\n'


def _comments(lines: list[str]) -> dict[str, str]:
    # The comment at the end of each line, by the factor the line names; '' for the key's own.
    found = {}
    for line in lines:
        comment = re.search(r'\s+#.*$', line.rstrip('\n'))
        named = re.search(r'name:\s*"?([^,"}]+?)"?\s*[,}]', line)
        if comment:
            found[named[1] if named and 'factors:' not in line else ''] = comment[0]
    return found


def _factor_lines(
    factors: Mapping[str, str], indent: str, comments: Mapping[str, str]
) -> list[str]:
    lines = [f'{indent}factors:{comments.get("", "")}\n']
    for name, expression in factors.items():
        entry = f'{{name: {scalar(name)}, expression: {scalar(expression)}}}'
        lines.append(f'{indent}  - {entry}{comments.get(name, "")}\n')
    return lines


def scalar(text: str) -> str:
    """Return a text as it may stand between braces, where a comma would end the entry."""
    plain = re.fullmatch(r'-?[\w./()+][\w .*/()+-]*', text)
    return text if plain else '"' + text.replace('\\', '\\\\').replace('"', '\\"') + '"'


def write_factors(path: Path, factors: Mapping[str, str], check: Check) -> None:
    """
    Set the factors in a robot file after `check` has accepted the new text.

    Parameters
    ----------
    path
        Of the file.
    factors
        Expressions by name, in the file's units.
    check
        Raises where the new text is not as it should be; the file is then left alone.
    """
    text = path.read_bytes().decode('utf-8')
    changed = with_factors(text, factors)
    check(changed)
    write_file(path, changed)
