# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the command that reinstalls this copy of the package, so that its kernel is compiled."""

import json
import shlex
import sys
import sysconfig
from importlib import metadata
from pathlib import Path
from urllib.parse import unquote, urlsplit

_FOLDER = Path(__file__).parent
_PACKAGE = __name__.partition('.')[0]


def command() -> str:
    """Return the command line that compiles the kernel of this copy of the package."""
    root = _FOLDER.parents[2]
    if (root / 'setup.py').is_symlink():
        return _by_colcon(root, '--symlink-install ')
    if (root / 'setup.py').exists():
        return _by_pip(f'-e {shlex.quote(str(root))}')
    try:
        installed = metadata.distribution(_PACKAGE)
    except metadata.PackageNotFoundError:
        return _by_pip(_PACKAGE)
    prefix = next((folder for folder in _FOLDER.parents if folder.name == 'install'), None)
    if prefix and not installed.read_text('INSTALLER'):
        return _by_colcon(prefix.parent / 'build' / _PACKAGE)
    return _by_pip(_origin(installed.read_text('direct_url.json')))


def _by_pip(source: str) -> str:
    command = f'{shlex.quote(sys.executable)} -m pip install --force-reinstall --no-deps {source}'
    # If Python's C headers are missing, put a command that installs them before the pip command,
    # because the compiler needs the headers.
    headers = Path(sysconfig.get_path('include'), 'Python.h').exists()
    return command if headers else f'sudo apt install python3-dev && {command}'


def _by_colcon(build: Path, option: str = '') -> str:
    workspace = shlex.quote(str(build.parents[1]))
    return (
        f'cd {workspace} && rm -r build/{build.name} && '
        f'colcon build {option}--packages-select {_PACKAGE}'
    )


def _origin(written: str | None) -> str:
    # Returns the source from which pip can install the package again. It is the source that pip
    # recorded (PEP 610), or the name of the package if pip installed it from an index.
    if not written:
        return _PACKAGE
    record = json.loads(written)
    url = record['url']
    if 'vcs_info' in record:
        url = f'{record["vcs_info"]["vcs"]}+{url}@{record["vcs_info"]["commit_id"]}'
    elif url.startswith('file:'):
        url = unquote(urlsplit(url).path)
    return shlex.quote(url)
