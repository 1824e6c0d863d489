# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read the YAML text of a planned trajectory as Python values.

A plain scalar is a number by the rules of YAML 1.2: `1e-3` is a number, `1_0` and `0o7` are texts.
"""

import re
from typing import TypeAlias

from ....robot.file.text.yaml_document import ScalarNode
from ....robot.file.text.yaml_reader import (
    MappingStart,
    Scalar,
    SequenceStart,
    YamlError,
    YamlReader,
)

MAX_DEPTH = 40
# Largest number of values in a file: 100,000 points of a six-joint arm have about 3 million.
MAX_VALUES = 4_000_000
NUMBER = re.compile(r'[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?')
WORDS = {
    **dict.fromkeys(('', '~', 'null', 'Null', 'NULL')),
    **dict.fromkeys(('true', 'True', 'TRUE'), True),
    **dict.fromkeys(('false', 'False', 'FALSE'), False),
    **dict.fromkeys(('.nan', '.NaN', '.NAN'), float('nan')),
    **{sign + word: float(f'{sign}inf') for word in ('.inf', '.Inf', '.INF') for sign in '+-'},
    **dict.fromkeys(('.inf', '.Inf', '.INF'), float('inf')),
}


Values: TypeAlias = None | bool | float | str | list['Values'] | dict[str, 'Values']


def read_documents(text: str) -> list[Values]:
    """
    Return the documents of a YAML text as dicts, lists, numbers, texts, truth values or None.

    Raises
    ------
    YamlError
        The text is not YAML, has a key twice, or has something that `YamlReader` refuses.
    """
    documents = _ValueReader(MAX_DEPTH, MAX_VALUES, 'write it as a bag').documents(text)
    return [document for document in documents if document is not None]


class _ValueReader(YamlReader[Values]):
    def scalar(self, event: Scalar) -> Values:
        text: str = event.value
        if not event.implicit[0]:
            return text  # the scalar is in quotes, or spans several lines
        if NUMBER.fullmatch(text):
            return float(text)
        return WORDS.get(text, text)

    def sequence(self, start: SequenceStart, items: list[Values]) -> Values:
        return items

    def mapping(self, start: MappingStart, entries: list[tuple[ScalarNode, Values]]) -> Values:
        values: dict[str, Values] = {}
        for key, value in entries:
            if key.text in values:
                raise YamlError(key.line, f'the key {key.text[:40]!a} occurs twice; delete one')
            values[key.text] = value
        return values
