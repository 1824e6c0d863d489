"""The kernel's extension modules: compiled where that can be, never in the way."""

import hashlib
import os
import sys
import sysconfig
import threading
from pathlib import Path

from setuptools import Extension
from setuptools.command.build_ext import build_ext

PACKAGE = 'kinematics_service'
FOLDER = Path('src', PACKAGE, 'kernel')
# These say where things stand and how arrays are handed over: included where they are used.
INCLUDED = ('places', 'arrays', 'pairs')
# Every operation is rounded by itself, so that the compiled kernel gives the numbers of its source
# to the last bit, on every machine. Nobody asks for the flags of floating-point errors, and the
# loops over lanes need what they call inline.
OPTIONS = [
    *('-O3', '-g0', '-ffp-contract=off', '-fno-math-errno', '-fno-trapping-math'),
    '-finline-limit=300',
]
# Where it is set, to anything, every access beyond an array, on the heap or the stack, ends the
# process with its place: see CONTRIBUTING.md.
CHECKED = 'KINEMATICS_BOUNDSCHECK'
CHECKS = ['-fsanitize=address,bounds', '-fno-sanitize-recover=all', '-fno-omit-frame-pointer']
DIRECTIVES = {
    'language_level': 3,
    'annotation_typing': False,
    'boundscheck': False,
    'wraparound': False,
    'initializedcheck': False,
    'cdivision': True,
    'infer_types': True,
}


def built_from() -> str:
    """Return the hash of the kernel's source and the files it is of; compiled.py compares it."""
    files = sorted(name_of(file) for file in source_files())
    digest = hashlib.sha256(b''.join((FOLDER / name).read_bytes() for name in files)).hexdigest()
    return ' '.join([digest, *files])


def source_files() -> list[Path]:
    """Return the files that the kernel is built from."""
    return [*FOLDER.rglob('*.py'), *FOLDER.rglob('*.pxd')]


def name_of(file: Path) -> str:
    """Return the path of a file of the kernel, seen from its folder."""
    return file.relative_to(FOLDER).as_posix()


def extension_modules() -> list[Extension]:
    """Return the modules to compile, whose source is read when they are built."""
    checks = CHECKS if os.environ.get(CHECKED) else []
    return [
        Extension(
            '.'.join([PACKAGE, 'kernel', *types.relative_to(FOLDER).with_suffix('').parts]),
            [str(types.with_suffix('.py'))],
            extra_compile_args=[*OPTIONS, *(['-g1', *checks] if checks else [])],
            extra_link_args=checks,
            define_macros=[('NPY_NO_DEPRECATED_API', 'NPY_1_7_API_VERSION')],
        )
        for types in sorted(FOLDER.rglob('*.pxd'))
        if types.stem not in INCLUDED
    ]


def compilers_at_once() -> int:
    """Return how many compilers run side by side: as many as there are cores and GiB of memory."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else os.cpu_count()
    try:
        memory = os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES')
    except (AttributeError, ValueError, OSError):
        return 1
    return max(1, min(cores or 1, memory >> 30))


class BuildIfPossible(build_ext):
    """Builds all modules or none: without them the same source runs as plain Python."""

    def finalize_options(self) -> None:
        """Let several modules be compiled at once."""
        super().finalize_options()
        self.parallel = self.parallel or compilers_at_once()
        self._translating, self._failed = threading.Lock(), False

    def run(self) -> None:
        """Build; where that fails, say so and go on."""
        in_place, self.inplace = self.inplace, False
        wanted = self._paths()  # where they are built, and where they are copied to
        self.inplace = in_place
        wanted |= self._paths()
        folders = {path.parent for path in wanted}
        try:
            super().run()
        except Exception as error:
            print(f'the kernel is not compiled, it stays plain Python: {error}', file=sys.stderr)
            self.inplace, self.extensions, wanted = in_place, [], set()
        # Left of another build they would be imported, not the source of that name.
        for folder in folders:
            for path in set(folder.glob(f'*{sysconfig.get_config_var("EXT_SUFFIX")}')) - wanted:
                path.unlink()

    def _paths(self) -> set[Path]:
        return {Path(self.get_ext_fullpath(module.name)) for module in self.extensions}

    def build_extension(self, ext: Extension) -> None:
        """Translate a module to C, one at a time, and compile it while others are translated."""
        with self._translating:
            if self._failed:
                return
            self._translate(ext)
        try:
            super().build_extension(ext)
        except Exception:
            self._failed = True
            raise

    def _is_behind(self, source: str) -> bool:
        # Whether what a module includes has changed since it was translated: Cython does not see
        # that `from ..layout cimport arrays` depends on arrays.pxd.
        written = Path(self.build_temp, 'cython', source).with_suffix('.c')
        included = [file for file in FOLDER.rglob('*.pxd') if file.stem in INCLUDED]
        return written.exists() and any(
            file.stat().st_mtime > written.stat().st_mtime for file in included
        )

    def _translate(self, ext: Extension) -> None:
        # Imported here: that the package is described needs neither of them.
        import numpy
        from Cython.Build import cythonize

        (source,) = ext.sources
        translated = cythonize(
            [Extension(ext.name, [source])],
            compiler_directives=DIRECTIVES,
            build_dir=str(Path(self.build_temp, 'cython')),
            force=self.force or self._is_behind(source),
            quiet=True,
        )
        ext.sources = translated[0].sources
        ext.include_dirs.append(numpy.get_include())
        if source == str(FOLDER / 'origin.py'):
            ext.define_macros.append(('KINEMATICS_SOURCE', f'"{built_from()}"'))
            ext.depends = sorted(map(str, source_files()))
