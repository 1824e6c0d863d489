# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Set the address of the repository, from which all others are made:

    python packaging/repository.py https://github.com/owner/name

It writes `package.xml` (which setup.py reads) and `CITATION.cff`. Without an address the page on
PyPI has neither pictures nor links to files.
"""

import argparse
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ADDRESS = re.compile(r'https://[\w.-]+/[\w./-]*\w')
URLS = re.compile(r'  <url type="\w+">.*</url>\n')
CODE = re.compile(r'^repository-code: .*\n', re.MULTILINE)


def set_repository(address: str, root: Path = ROOT) -> None:
    """Write the address into the files of a clone; an empty one takes it out of them."""
    urls = {'repository': address, 'bugtracker': f'{address}/issues'} if address else {}
    manifest, citation = root / 'package.xml', root / 'CITATION.cff'
    lines = ''.join(f'  <url type="{kind}">{url}</url>\n' for kind, url in urls.items())
    text = URLS.sub('', manifest.read_text(encoding='utf-8'))
    license_line = re.search(r'  <license>.*</license>\n', text)
    assert license_line is not None
    text = text[: license_line.end()] + lines + text[license_line.end() :]
    manifest.write_text(text, encoding='utf-8')
    text = CODE.sub('', citation.read_text(encoding='utf-8'))
    citation.write_text(text + (f'repository-code: {address}\n' if address else ''), 'utf-8')


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description='Set the address of the repository.')
    parser.add_argument('address', help="such as https://github.com/owner/name; '' for none")
    given = parser.parse_args().address.rstrip('/')
    if given and not ADDRESS.fullmatch(given):
        parser.error(f'{given!r} is not an address such as https://github.com/owner/name')
    set_repository(given)
