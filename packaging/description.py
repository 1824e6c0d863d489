# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The long description of the package, for PyPI: the README with addresses that work there."""

import re
from pathlib import PurePosixPath

LINK = re.compile(r'(?P<image>!)?\[(?P<text>[^\]]*)\]\((?P<target>[^)\s]+)\)')
TAG = re.compile(r'<img\b[^>]*\bsrc="(?P<target>[^"]+)"[^>]*>\n*')
COMMENT = re.compile(r'<!--.*?-->\n', re.DOTALL)
ADDRESS = re.compile(r'[a-z]+:|#')


def long_description(readme: str, repository: str, version: str) -> str:
    """
    Return the README for a place where the repository's files are not beside it.

    Parameters
    ----------
    readme
        The README, in Markdown.
    repository
        The address of the repository, such as `https://github.com/owner/name`; empty if it is not
        known. Then pictures are left out, and of a link to a file only its text stays.
    version
        The version whose tag `vVERSION` has the files.
    """

    def address(target: str, kind: str) -> str:
        path, mark, part = target.partition('#')
        return f'{repository}/{kind}/v{version}/{PurePosixPath(path)}{mark}{part}'

    def link(found: re.Match[str]) -> str:
        target = found['target']
        if ADDRESS.match(target):
            return found[0]
        if not repository:
            return '' if found['image'] else found['text']
        kind = 'raw' if found['image'] else 'blob'
        return f'{found["image"] or ""}[{found["text"]}]({address(target, kind)})'

    def tag(found: re.Match[str]) -> str:
        target = found['target']
        if ADDRESS.match(target):
            return found[0]
        return found[0].replace(target, address(target, 'raw')) if repository else ''

    return LINK.sub(link, TAG.sub(tag, COMMENT.sub('', readme)))
