# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read the YAML of a robot file as a tree of mappings, lists and texts, without numbers.

Inside `[...]` and `{...}`, YAML ends an unquoted text at every comma, so it would split
`atan2(1, 2)`. Such a file is refused with the advice to quote the expression.
"""

from collections.abc import Iterable
from itertools import chain

from ....errors import Fault, RobotFileError
from .fault_report import quoted
from .yaml_document import Document, ListNode, MappingNode, Node, ScalarNode
from .yaml_reader import MappingStart, Scalar, SequenceStart, YamlError, YamlReader, node_of

MAX_BYTES = 256 * 1024
MAX_DEPTH = 16
MAX_NODES = 20_000  # twice the number of values in a file with 128 joints and 512 rows


def read_document(text: str, file: str) -> Document:
    """
    Return the tree of a YAML text; every scalar is the text that the user wrote.

    Raises
    ------
    RobotFileError
        The text is not YAML, empty, too large, or refused by `YamlReader`.
    """
    try:
        if not isinstance(text, str):
            raise YamlError(0, f'expected a text, not {type(text).__name__}', 'wrong-type')
        if len(text.encode('utf-8', 'surrogatepass')) > MAX_BYTES:
            raise YamlError(
                0, f'larger than {MAX_BYTES // 1024} KiB: not a robot file', 'too-large'
            )
        second = 'a second document; one file is one robot, so delete the line ---'
        roots = _TreeReader(MAX_DEPTH, MAX_NODES, 'not a robot file', second).documents(text)
        if not roots or roots[0] == ScalarNode('', roots[0].line, False):
            message = 'the file is empty; `kinematics_service new NAME` writes an example'
            raise YamlError(0, message, 'empty')
    except YamlError as error:
        raise RobotFileError((Fault(file, error.line, '', error.reason, error.code),)) from None
    return Document(file, roots[0])


class _TreeReader(YamlReader[Node]):
    def scalar(self, event: Scalar) -> Node:
        return node_of(event)

    def sequence(self, start: SequenceStart, items: list[Node]) -> Node:
        if start.flow_style:
            _refuse_split(items)
        return ListNode(tuple(items), start.start_mark.line + 1)

    def mapping(self, start: MappingStart, entries: list[tuple[ScalarNode, Node]]) -> Node:
        for key, _ in entries:
            if not key.text.isprintable():
                message = f'the key {quoted(key.text)} has control characters'
                raise YamlError(key.line, message, 'control-characters')
        if start.flow_style:
            _refuse_split(chain.from_iterable(entries))
        return MappingNode(tuple(entries), start.start_mark.line + 1)


def _refuse_split(nodes: Iterable[Node]) -> None:
    opened: ScalarNode | None = None
    for node in nodes:
        if not isinstance(node, ScalarNode) or node.quoted:
            continue
        depth = node.text.count('(') - node.text.count(')')
        if opened and depth < 0:
            advice = 'quote expressions that contain commas'
            message = f'YAML splits {quoted(opened.text)} at its comma: {advice}'
            raise YamlError(opened.line, message, 'split-expression')
        opened = node if depth > 0 else opened
