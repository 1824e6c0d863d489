# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write singular factors into a robot file without changing its comments and layout.

The YAML is parsed only to find the section `singularity`, into which lines are inserted. The
caller checks the result before it replaces the file.
"""

import re
from collections.abc import Mapping, Sequence

import yaml
from yaml import MappingNode, Node

from ..text.yaml_reader import LOADER

BOM = '\ufeff'


def with_factors(text: str, factors: Mapping[str, str]) -> str:
    """
    Return the text of a robot file, changed only in the value of `singularity.factors`.

    Parameters
    ----------
    text
        A valid robot file.
    factors
        Expressions by name, in the file's units.
    """
    if text.startswith(BOM):  # libyaml does not count the BOM as a character
        return BOM + with_factors(text.removeprefix(BOM), factors)
    root = yaml.compose(text, Loader=LOADER)
    assert isinstance(root, MappingNode)  # the root of a valid robot file is a mapping
    section = entry_of(root, 'singularity')
    if section is None:
        ended = text if text.endswith('\n') else f'{text}\n'
        return ''.join([ended, 'singularity:\n', *_factor_lines(factors, '  ', {})])
    value = section[1]
    assert isinstance(value, MappingNode)
    old = entry_of(value, 'factors')
    if value.flow_style:
        start = old[0].start_mark.index if old else value.start_mark.index + 1
        end = old[1].end_mark.index if old else start
        comma = ', ' if value.value and not old else ''
        entries = ',\n    '.join(_entry(*factor) for factor in factors.items())
        return f'{text[:start]}factors: [\n    {entries}]{comma}{text[end:]}'
    lines = text.splitlines(keepends=True)
    start = old[0].start_mark.line if old else last_line(value) + 1
    end = last_line(old[1]) + 1 if old else start
    new = _factor_lines(factors, ' ' * value.start_mark.column, _comments(lines[start:end]))
    return ''.join([*lines[:start], *new, *lines[end:]])


def entry_of(mapping: MappingNode, name: str) -> tuple[Node, Node] | None:
    """
    Return key and value of the entry `name` of a YAML mapping; None if the mapping has no such
    entry.
    """
    return next((pair for pair in mapping.value if pair[0].value == name), None)


def last_line(node: Node) -> int:
    """Return the last line of a YAML node, counted from 0."""
    # Use the last inner node of a block. The end mark of the block itself comes after the comments
    # and blank lines that follow the block.
    if isinstance(node, MappingNode) and not node.flow_style and node.value:
        return last_line(node.value[-1][1])
    if isinstance(node.value, list) and not node.flow_style and node.value:
        return last_line(node.value[-1])
    return int(node.end_mark.line)


def written_entries(text: str, value: Node, without: Sequence[str]) -> dict[str, str]:
    """
    Return a dictionary from each key of a YAML mapping to the text of its entry in the file,
    except the keys in `without`. The result is empty if the node is not a mapping.
    """
    return {
        key.value: text[key.start_mark.index : item.end_mark.index].rstrip()
        for key, item in (value.value if isinstance(value, MappingNode) else ())
        if key.value not in without
    }


def _comments(lines: list[str]) -> dict[str, str]:
    # Return the comments at the ends of the lines of `factors`, by the name of the factor in each
    # line. The name is empty for the line of the key `factors`.
    comments = {}
    for line in lines:
        comment = re.search(r'\s+#.*$', line.rstrip('\n'))
        named = re.search(r'name:\s*"?([^,"}]+?)"?\s*[,}]', line)
        if comment:
            comments[named[1] if named and 'factors:' not in line else ''] = comment[0]
    return comments


def _factor_lines(
    factors: Mapping[str, str], indent: str, comments: Mapping[str, str]
) -> list[str]:
    lines = [f'{indent}factors:{comments.get("", "")}\n']
    for factor in factors.items():
        lines.append(f'{indent}  - {_entry(*factor)}{comments.get(factor[0], "")}\n')
    return lines


def _entry(name: str, expression: str) -> str:
    return f'{{name: {scalar(name)}, expression: {scalar(expression)}}}'


def scalar(text: str) -> str:
    """Return a text as YAML, in quotes if YAML needs quotes for the text inside `{...}`."""
    plain = re.fullmatch(r'-?[\w./()+][\w .*/()+-]*', text)
    return text if plain else '"' + text.replace('\\', '\\\\').replace('"', '\\"') + '"'
