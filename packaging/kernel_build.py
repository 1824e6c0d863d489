# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Build the kernel's extension modules with Cython and a C compiler.

Each module costs the compiler as much time as 300 lines of the kernel before its first line.
Therefore a module contains all files of a folder that have the same compiler options.
"""

import gc
import hashlib
import os
import sysconfig
import threading
from pathlib import Path

from kernel_types import KernelTypes
from setuptools import Extension
from setuptools.command.build_ext import build_ext
from setuptools.errors import ExecError

PACKAGE = 'kinematics_service'
FOLDER = Path('src', PACKAGE, 'kernel')
# These files define array indices and array access. Each module that uses them includes them.
INCLUDED = ('places', 'arrays', 'pairs', 'stop_timer')
# These files are not compiled.
PLAIN = ('__init__', 'compiled', 'reinstallation')
# -ffp-contract=off rounds every operation by itself, so the compiled kernel gives the bits of its
# source on every machine. No code reads the flags of floating-point errors. Loops over lanes need
# inlined functions (-finline-limit). The last four options leave out passes that take an eighth of
# the compiler's time and make no call faster. Without -ftree-vrp the compiler wrongly warns of
# uninitialized numbers.
OPTIONS = [
    *('-O3', '-g0', '-ffp-contract=off', '-fno-math-errno', '-fno-trapping-math'),
    '-finline-limit=300',
    # Clang would compute sines of constants itself, with other last bits than libm.
    *(f'-fno-builtin-{name}' for name in ('sin', 'cos', 'atan2', 'exp', 'log', 'pow')),
    *('-fno-gcse', '-fno-schedule-insns2', '-fno-tree-vrp', '-Wno-maybe-uninitialized'),
]
# Inline the functions that have an argument `lanes`, because their callers give it as a constant.
INLINE = '-DCYTHON_INLINE=inline __attribute__((always_inline))'
# For modules that run once for each arm, or that call other modules for their arithmetic. With -O1
# the compiler takes half the time, and a call takes as long as with -O3.
PLAINLY = ['-O1', '-fstrict-aliasing', '-finline-small-functions']
# Vectorized loops over a few joints take 1.1 of the time. Some loops over LANES poses need
# vectorization.
AT_ONCE: list[str] = []
STEP_BY_STEP = ['-fno-tree-vectorize', '-ftree-slp-vectorize']
# If the steps of Newton's method are inlined, a pose of closed loops takes 1.04 of the time, and
# the compiler 1.4.
CALLED = ['-fno-inline-functions', '-fno-inline-functions-called-once']
CALLED += ['-fno-inline-small-functions', *STEP_BY_STEP]
# The files of each module. A folder stands for all its files that no other module has. Modules
# that take the compiler longest come first.
UNITS = {
    '_clearance': ('clearance',),
    '_self_motion': ('self_motion',),
    '_lanes': ('measures/task_rows', 'measures/factors', 'measures/singular_values'),
    '_six_joints': ('six_joints',),
    '_chain': ('forward/chain', 'layout/blocks'),
    '_residuals': (
        *('inverse/roots', 'inverse/three_joints', 'inverse/residuals', 'inverse/refinement'),
        'inverse/servo_step',
    ),
    '_forward': ('forward',),
    '_inverse': ('inverse',),
    '_measures': ('measures',),
    '_messages': ('.',),
    '_judging': ('evaluation', 'judging'),
    '_loops': ('loops',),
    '_singular_search': ('singular_search',),
    '_chain_pass': ('forward/chain_pass',),
}
OPTIONS_OF = {
    **dict.fromkeys(('_lanes', '_chain_pass'), AT_ONCE),
    **dict.fromkeys(('_messages', '_inverse', '_chain'), PLAINLY),
    '_loops': CALLED,
}
# The module that stores the hash of the source.
ORIGIN = '_origin'
# If this environment variable is set, any access beyond an array ends the process and prints the
# place: see CONTRIBUTING.md.
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
    # Make the modules smaller: no class of functions, and no pickles of objects with addresses.
    'binding': False,
    'auto_pickle': False,
}


def source_files() -> list[Path]:
    """Return the source files of the kernel."""
    return [*FOLDER.rglob('*.py'), *FOLDER.rglob('*.pxd'), FOLDER / '__init__.pyi']


def name_of(file: Path) -> str:
    """Return the path of a file relative to the kernel's folder."""
    return file.relative_to(FOLDER).as_posix()


def units() -> dict[str, list[str]]:
    """
    Return the files of each module, relative to the kernel's folder and without suffix.

    Raises
    ------
    ValueError
        If `UNITS` names a file that does not exist, or no module has a file.
    """
    names = sorted(name_of(file.with_suffix('')) for file in FOLDER.rglob('*.py'))
    names = [name for name in names if Path(name).name not in (*INCLUDED, *PLAIN)]
    named = {part for parts in UNITS.values() for part in parts}
    parts = {name: name if name in named else str(Path(name).parent) for name in names}
    if wrong := named ^ set(parts.values()):
        raise ValueError(f'UNITS and the folders of the kernel differ in: {sorted(wrong)}')
    return {unit: [name for name in names if parts[name] in UNITS[unit]] for unit in UNITS}


def extension_modules() -> list[Extension]:
    """Return the modules to compile. Their sources are written when they are built."""
    checks = CHECKS if os.environ.get(CHECKED) else []
    files = {unit: [FOLDER / f'{name}.py' for name in names] for unit, names in units().items()}
    files[ORIGIN] = [FOLDER / 'compiled.py']
    return [
        Extension(
            f'{PACKAGE}.kernel.{unit}',
            list(map(str, sources)),
            extra_compile_args=[
                *options_of(unit, sources),
                *(['-g1', *checks] if checks else []),
            ],
            extra_link_args=checks,
            define_macros=[('NPY_NO_DEPRECATED_API', 'NPY_1_7_API_VERSION')],
        )
        for unit, sources in files.items()
    ]


def options_of(unit: str, sources: list[Path]) -> list[str]:
    """Return the compiler's options for a module of these files."""
    # Functions with an argument `lanes` serve one pose and many; the compiler must inline them.
    by_lanes = any('lanes: int' in file.read_text(encoding='utf-8') for file in sources)
    return [*OPTIONS, *([INLINE] if by_lanes else []), *OPTIONS_OF.get(unit, STEP_BY_STEP)]


def write(file: Path, text: str) -> None:
    """Write a text to a file, unless the file has it: setuptools rebuilds what is newer."""
    if not file.exists() or file.read_text(encoding='utf-8') != text:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding='utf-8')


def compilers_at_once() -> int:
    """Return the number of parallel compilers: one for each core, and for each GiB of memory."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else os.cpu_count()
    try:
        memory = os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES')
    except (AttributeError, ValueError, OSError):
        return 1
    return max(1, min(cores or 1, memory >> 30))


WITHOUT = (
    'Install a C compiler and the headers of Python (on Debian and Ubuntu: gcc python3-dev). '
    'With KINEMATICS_UNCOMPILED=1 set, the kernel is installed as plain Python, which is hundreds '
    'of times slower.'
)


class BuildKernel(build_ext):
    """
    Builds all modules or fails, because the source as plain Python is hundreds of times slower.

    If KINEMATICS_UNCOMPILED is set, setup.py asks for no modules.
    """

    def finalize_options(self) -> None:
        """Compile several modules at the same time."""
        super().finalize_options()
        self.parallel = self.parallel or compilers_at_once()
        self._translating, self._failed = threading.Lock(), False

    def run(self) -> None:
        """Build the modules. If this fails, delete all of them and raise ExecError with a cure."""
        in_place, self.inplace = self.inplace, False
        wanted = self._paths()  # where they are built, and where they are copied to
        self.inplace = in_place
        wanted |= self._paths()
        folders = {path.parent for path in wanted}
        # Garbage collection would take half of Cython's time.
        collected = gc.isenabled()
        gc.disable()
        try:
            self._write_sources()
            super().run()
        except Exception as error:
            wanted = set()
            raise ExecError(f'the kernel cannot be compiled: {error}\n{WITHOUT}') from error
        finally:
            if collected:
                gc.enable()
            # Delete modules of earlier builds, because Python would import them.
            suffix = sysconfig.get_config_var('EXT_SUFFIX')
            for path in {file for folder in folders for file in folder.rglob(f'*{suffix}')}:
                if path not in wanted:
                    path.unlink()

    def _paths(self) -> set[Path]:
        return {Path(self.get_ext_fullpath(module.name)).resolve() for module in self.extensions}

    def build_extension(self, ext: Extension) -> None:
        """Translate modules to C one after the other, and compile them at the same time."""
        with self._translating:
            if self._failed:
                return
            self._translate(ext)
        try:
            super().build_extension(ext)
        except Exception:
            self._failed = True
            raise

    def _source_of(self, unit: str) -> Path:
        return Path(self.build_temp, 'units', PACKAGE, 'kernel', f'{unit}.pyx')

    def _write_sources(self) -> None:
        # Writes the .pyx and .pxd files of the modules, and the .pxd files of included files.
        files = units()
        by_name = {unit: [Path(name).name for name in names] for unit, names in files.items()}
        types = KernelTypes(FOLDER, INCLUDED, by_name)
        types.check()
        for file in source_files():
            place = self._source_of('').parent / name_of(file)
            if file.stem in (*INCLUDED, 'math'):
                write(place.with_suffix('.pxd'), types.included_text(file))
                write(place.with_name('__init__.pxd'), '')
        write(self._source_of('').parent.with_name('__init__.pxd'), '')
        write(self._source_of('__init__').with_suffix('.pxd'), '')
        for unit in files:
            write(self._source_of(unit), types.source(unit))
            write(self._source_of(unit).with_suffix('.pxd'), types.declarations(unit))
        write(self._source_of(ORIGIN), origin(files))

    def _translate(self, ext: Extension) -> None:
        # Imported here, because reading the package's metadata needs neither of them.
        import numpy
        from Cython.Build import cythonize

        unit = ext.name.rpartition('.')[2]
        translated = cythonize(
            [Extension(ext.name, [str(self._source_of(unit))])],
            compiler_directives=DIRECTIVES,
            include_path=[str(Path(self.build_temp, 'units'))],
            build_dir=str(Path(self.build_temp, 'cython')),
            force=self.force,
            quiet=True,
        )
        ext.sources = translated[0].sources
        ext.include_dirs.append(numpy.get_include())


def origin(files: dict[str, list[str]]) -> str:
    """Return a module that stores the hash of the source; compiled.py compares it."""
    names = sorted(map(name_of, source_files()))
    digest = hashlib.sha256(b''.join((FOLDER / name).read_bytes() for name in names)).hexdigest()
    modules = {unit: [name.replace('/', '.') for name in files[unit]] for unit in files}
    return f'HASH = {digest!r}\nFILES = {names!r}\nMODULES = {modules!r}\n'
