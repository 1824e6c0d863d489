# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""setuptools' own build backend, and a C compiler from PyPI where this machine has none."""

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
    # The one that is asked for, by name or path, or else any of this machine; '' without one.
    if named := os.environ.get('CC'):
        return named
    names = (_usual_compiler(), 'cc', 'gcc', 'clang')
    return next((name for name in names if shutil.which(name)), '')


def _usual_compiler():
    return (sysconfig.get_config_var('CC') or 'cc').split()[0]


def _pip(*arguments):
    # That of the installation around this build, which is shut off from it by these variables.
    around = {name: value for name, value in os.environ.items() if name != 'PYTHONPATH'}
    return subprocess.run(
        [sys.executable, '-m', 'pip', *arguments], env=around, stdout=2, check=False
    )


def _ziglang_from_front_end():
    # Who builds without pip has to provide it; with pip it is tried when it is needed, since an
    # index without it must not stop the installation.
    return [] if _compiler() or _pip('--version').returncode == 0 else ['ziglang']


@contextlib.contextmanager
def _build_folder():
    # What was left of another build, or of another compiler, is not used.
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
        # Python's own may be another than this machine has.
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
    """Return what a wheel needs to be built, the compiler among it."""
    return build_meta.get_requires_for_build_wheel(config_settings) + _ziglang_from_front_end()


def get_requires_for_build_editable(config_settings=None):
    """Return what an editable installation needs, the compiler among it."""
    return build_meta.get_requires_for_build_editable(config_settings) + _ziglang_from_front_end()


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Build a wheel."""
    with _build_folder():
        return build_meta.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """Build what an editable installation installs."""
    with _build_folder():
        return build_meta.build_editable(wheel_directory, config_settings, metadata_directory)
