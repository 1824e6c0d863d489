"""setuptools' own build backend, and a C compiler from PyPI where this machine has none."""

import os
import shutil
import sys
import sysconfig

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403


def _has_compiler():
    named = (os.environ.get('CC') or sysconfig.get_config_var('CC') or 'cc').split()[0]
    return any(shutil.which(name) for name in (named, 'cc', 'gcc', 'clang'))


def _use_ziglang():
    if not _has_compiler():
        zig = f'{sys.executable} -m ziglang cc'
        os.environ.update(CC=zig, LDSHARED=f'{zig} -shared')


def get_requires_for_build_wheel(config_settings=None):
    """Return what a wheel needs to be built, the compiler among it."""
    needed = build_meta.get_requires_for_build_wheel(config_settings)
    return needed if _has_compiler() else [*needed, 'ziglang']


def get_requires_for_build_editable(config_settings=None):
    """Return what an editable installation needs, the compiler among it."""
    needed = build_meta.get_requires_for_build_editable(config_settings)
    return needed if _has_compiler() else [*needed, 'ziglang']


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Build a wheel."""
    _use_ziglang()
    return build_meta.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """Build what an editable installation installs."""
    _use_ziglang()
    return build_meta.build_editable(wheel_directory, config_settings, metadata_directory)
