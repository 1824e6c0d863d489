# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Print the part of CHANGELOG.rst on one version: python packaging/release_notes.py 0.1.0."""

import re
import sys
from pathlib import Path

CHANGELOG = Path(__file__).resolve().parents[1] / 'CHANGELOG.rst'


def notes(version: str, changelog: str) -> str:
    """
    Return the lines on a version, in Markdown.

    Raises
    ------
    ValueError
        The changelog has no section `VERSION (DATE)`.
    """
    heading = rf'^{re.escape(version)} \([\d-]+\)\n-+\n'
    found = re.search(
        rf'{heading}(.*?)(?=^\S[^\n]*\n-+\n|\Z)', changelog, re.MULTILINE | re.DOTALL
    )
    if found is None:
        raise ValueError(f"CHANGELOG.rst has no section '{version} (DATE)'; rename Forthcoming")
    return found[1].strip().replace('``', '`') + '\n'


if __name__ == '__main__':
    try:
        print(notes(sys.argv[1], CHANGELOG.read_text(encoding='utf-8')), end='')
    except ValueError as error:
        sys.exit(str(error))
