# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Build with setuptools, and install a C compiler from PyPI if this machine has none."""

import contextlib
import importlib.util
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403


def _compiler():
    # Returns the compiler in CC, or one of this machine, or '' if there is none.
    if named := os.environ.get('CC'):
        return named
    names = (_usual_compiler(), 'cc', 'gcc', 'clang')
    return next((name for name in names if shutil.which(name)), '')


def _usual_compiler():
    return (sysconfig.get_config_var('CC') or 'cc').split()[0]


def _pip(*arguments):
    # Runs pip outside of the isolated build: PYTHONPATH would keep it inside.
    around = {name: value for name, value in os.environ.items() if name != 'PYTHONPATH'}
    return subprocess.run(
        [sys.executable, '-m', 'pip', *arguments], env=around, stdout=2, check=False
    )


def _ziglang_from_front_end():
    # With pip, ziglang is installed only at its use, because an index without it must not stop the
    # installation. Without pip, the front end must install it.
    return [] if _compiler() or _pip('--version').returncode == 0 else ['ziglang']


@contextlib.contextmanager
def _build_folder():
    # Build in a new folder, so that no files of an earlier build or another compiler are used.
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder, 'setup.cfg')
        text = f'[build]\nbuild_base = {folder}/build\n'
        if os.name == 'nt':  # the options of the kernel are those of GCC and Clang
            text += '[build_ext]\ncompiler = mingw32\n'
        settings.write_text(text, encoding='utf-8')
        os.environ.setdefault('DIST_EXTRA_CONFIG', str(settings))
        _choose_compiler(folder)
        yield


def _choose_compiler(folder):
    if command := _compiler():
        # Python may name a compiler that this machine does not have.
        if command not in (os.environ.get('CC'), _usual_compiler()):
            os.environ.update(CC=command, LDSHARED=f'{command} -shared')
        return
    if not importlib.util.find_spec('ziglang'):
        print('no C compiler is found: trying ziglang from PyPI', file=sys.stderr)
        _pip('install', '--quiet', '--no-deps', '--target', f'{folder}/site', 'ziglang')
        paths = [f'{folder}/site', os.environ.get('PYTHONPATH')]
        os.environ['PYTHONPATH'] = os.pathsep.join(filter(None, paths))
    zig = f'{sys.executable} -m ziglang cc'
    os.environ.update(CC=zig, LDSHARED=f'{zig} -shared', ZIG_GLOBAL_CACHE_DIR=f'{folder}/cache')


def get_requires_for_build_wheel(config_settings=None):
    """Return the requirements for building a wheel, with the compiler."""
    return build_meta.get_requires_for_build_wheel(config_settings) + _ziglang_from_front_end()


def get_requires_for_build_editable(config_settings=None):
    """Return the requirements of an editable installation, with the compiler."""
    return build_meta.get_requires_for_build_editable(config_settings) + _ziglang_from_front_end()


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Build a wheel."""
    with _build_folder():
        return build_meta.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """Build an editable wheel."""
    with _build_folder():
        return build_meta.build_editable(wheel_directory, config_settings, metadata_directory)
