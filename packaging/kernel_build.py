"""The kernel's extension modules: compiled where that can be, never in the way."""

import gc
import hashlib
import os
import re
import sys
import sysconfig
import threading
from pathlib import Path

from kernel_types import AVX2, KernelTypes
from setuptools import Extension
from setuptools.command.build_ext import build_ext
from setuptools.errors import ExecError

PACKAGE = 'kinematics_service'
FOLDER = Path('src', PACKAGE, 'kernel')
# These say where things stand and how arrays are handed over: included where they are used.
INCLUDED = ('places', 'arrays', 'pairs')
# These are Python's alone.
PLAIN = ('__init__', 'compiled', 'reinstallation')
# Every operation is rounded by itself, so that the compiled kernel gives the numbers of its source
# to the last bit, on every machine. Nobody asks for the flags of floating-point errors, and the
# loops over lanes need what they call inline. The passes that are left out are an eighth of the
# compiler's time, and no call is slower without them; without ranges of values it takes numbers
# that are set in every branch for unset.
OPTIONS = [
    *('-O3', '-g0', '-ffp-contract=off', '-fno-math-errno', '-fno-trapping-math'),
    '-finline-limit=300',
    *('-fno-gcse', '-fno-schedule-insns2', '-fno-tree-vrp', '-Wno-maybe-uninitialized'),
]
# Functions whose number of lanes is known where they are called become part of their callers.
INLINE = '-DCYTHON_INLINE=inline __attribute__((always_inline))'
# What is made once an arm, and what has others do its arithmetic: the compiler takes half its time
# without its highest level, and a call takes as long.
PLAINLY = (
    *('joint_memory', 'messages', 'observing', 'origin', 'outgoing'),
    *('forward/angles', 'forward/chain', 'inverse/closed_forms', 'inverse/dependence'),
    *('inverse/joints', 'inverse/posture', 'inverse/searching', 'inverse/servoing'),
    *('inverse/solutions', 'inverse/solving', 'inverse/targets', 'measures/task_rows'),
    *('nearest/arm', 'nearest/nearest_closed', 'six_joints/six_joints'),
)
AT_FIRST_LEVEL = ['-O1', '-fstrict-aliasing', '-finline-small-functions']
# A loop over a few joints takes a tenth longer where several of its steps are computed at once,
# but here those over LANES poses need it.
AT_ONCE = (*AVX2, 'measures/factors', 'nearest/atlas')
STEP_BY_STEP = ['-fno-tree-vectorize', '-ftree-slp-vectorize']
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
    # Less of what each module carries: a class of functions, and pickles of what has addresses.
    'binding': False,
    'auto_pickle': False,
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
            '.'.join([PACKAGE, 'kernel', *file.relative_to(FOLDER).with_suffix('').parts]),
            [str(file)],
            extra_compile_args=[*options_of(file), *(['-g1', *checks] if checks else [])],
            extra_link_args=checks,
            define_macros=[('NPY_NO_DEPRECATED_API', 'NPY_1_7_API_VERSION')],
        )
        for file in sorted(FOLDER.rglob('*.py'))
        if file.stem not in (*INCLUDED, *PLAIN)
    ]


def options_of(file: Path) -> list[str]:
    """Return the compiler's options for a module."""
    name = name_of(file.with_suffix(''))
    if name in PLAINLY:
        return [*OPTIONS, *AT_FIRST_LEVEL]
    # The same text for one pose and for many, whose number of lanes the compiler has to know.
    inline = [INLINE] if 'lanes: int' in file.read_text(encoding='utf-8') else []
    return [*OPTIONS, *inline, *([] if name in AT_ONCE else STEP_BY_STEP)]


def write(file: Path, text: str) -> None:
    """Write a file of a text, unless it holds that text: the time of its change says something."""
    if not file.exists() or file.read_text(encoding='utf-8') != text:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding='utf-8')


def compilers_at_once() -> int:
    """Return how many compilers run side by side: as many as there are cores and GiB of memory."""
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


class BuildIfPossible(build_ext):
    """
    Builds all modules or none: without them the same source runs as plain Python.

    A wheel, which others may install, has them, unless KINEMATICS_UNCOMPILED asks for one without.
    """

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
        # Half of the time of translating would be the search for circles of dead objects.
        collected = gc.isenabled()
        gc.disable()
        try:
            self._types = self._write_types()
            super().run()
        except Exception as error:
            if 'bdist_wheel' in self.distribution.command_obj:
                raise ExecError(f'the kernel cannot be compiled: {error}\n{WITHOUT}') from error
            print(f'the kernel is not compiled, it stays plain Python: {error}', file=sys.stderr)
            self.inplace, self.extensions, wanted = in_place, [], set()
        finally:
            if collected:
                gc.enable()
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

    def _write_types(self) -> dict[str, Path]:
        # Where the types of each module stand: those for the modules that use it by its name, its
        # own by its path. Cython looks for packages there.
        types, written = KernelTypes(FOLDER, INCLUDED), {}
        types.check()
        for file in source_files():
            into = Path(self.build_temp, 'types', file.relative_to('src')).with_suffix('.pxd')
            if file.stem in PLAIN and file.stem != '__init__':
                continue
            written[file.stem] = into
            write(into, '' if file.stem == '__init__' else types.text(file, own=False))
        for module in self.extensions:
            (source,) = module.sources
            written[source] = Path(self._folder_of(module), f'{module.name}.pxd')
            write(written[source], types.text(Path(source)))
        return written

    def _folder_of(self, module: Extension) -> str:
        # With a module's own types, which Cython finds there by its whole name.
        return str(Path(self.build_temp, 'own', module.name))

    def _is_behind(self, source: str) -> bool:
        # Whether types that a module has from any other have changed since it was translated:
        # Cython looks for them beside the source.
        translated = Path(self.build_temp, 'cython', source).with_suffix('.c')
        needed, more = set(), {source}
        while more:
            needed |= more
            lines = [self._types[name].read_text(encoding='utf-8') for name in more]
            words = re.findall(r'\w+', ' '.join(re.findall('^from .*', '\n'.join(lines), re.M)))
            more = self._types.keys() & set(words) - needed
        return translated.exists() and any(
            self._types[name].stat().st_mtime > translated.stat().st_mtime for name in needed
        )

    def _translate(self, ext: Extension) -> None:
        # Imported here: that the package is described needs neither of them.
        import numpy
        from Cython.Build import cythonize

        (source,) = ext.sources
        translated = cythonize(
            [Extension(ext.name, [source])],
            compiler_directives=DIRECTIVES,
            include_path=[self._folder_of(ext), str(Path(self.build_temp, 'types'))],
            build_dir=str(Path(self.build_temp, 'cython')),
            force=self.force or self._is_behind(source),
            quiet=True,
        )
        ext.sources = translated[0].sources
        ext.include_dirs.append(numpy.get_include())
        if source == str(FOLDER / 'origin.py'):
            ext.define_macros.append(('KINEMATICS_SOURCE', f'"{built_from()}"'))
            ext.depends = sorted(map(str, source_files()))
