# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Errors by their code, their place and the words that a user needs."""

import contextlib
from collections.abc import Iterator

import pytest

from kinematics_service.errors import KinematicsError, RobotFileError


@contextlib.contextmanager
def refused(
    kind: type[KinematicsError], code: str, *words: str
) -> Iterator[pytest.ExceptionInfo[KinematicsError]]:
    """Fail unless an error of a kind and code is raised, with all these words in its text."""
    with pytest.raises(kind) as raised:
        yield raised
    assert raised.value.code == code, raised.value
    for word in words:
        assert word in str(raised.value)


def places(error: RobotFileError) -> list[tuple[int, str, str]]:
    """Return the line, the key and the code of each fault."""
    return [(fault.line, fault.where, fault.code) for fault in error.faults]
