"""
The kernel's extension modules: compiled where that can be, never in the way.

"""

import contextlib
import hashlib
import io
import sys
from pathlib import Path

from setuptools import Extension
from setuptools.command.build_ext import build_ext

PACKAGE = 'kinematics_service'
FOLDER = Path('src', PACKAGE, 'kernel')
# These say where things stand and how arrays are handed over: included where they are used.
INCLUDED = ('places', 'arrays')
# Every operation is rounded by itself, so that the compiled kernel gives the numbers of its source
# to the last bit, on every machine. Nobody asks for the flags of floating-point errors, and the
# loops over lanes need what they call inline.
OPTIONS = [
    *('-O3', '-g0', '-ffp-contract=off', '-fno-math-errno', '-fno-trapping-math'),
    '-finline-limit=300',
]
DIRECTIVES = {
    'language_level': 3,
    'annotation_typing': False,
    'boundscheck': False,
    'wraparound': False,
    'initializedcheck': False,
    'cdivision': True,
    'infer_types': True,
}


def source_hash(folder: Path) -> str:
    """Return the hash of a kernel's source, as kernel/compiled.py computes it."""
    files = sorted([*folder.glob('*.py'), *folder.glob('*.pxd')], key=lambda file: file.name)
    return hashlib.sha256(b''.join(file.read_bytes() for file in files)).hexdigest()


def extension_modules() -> list[Extension]:
    """Return the modules to compile, none without Cython and numpy."""
    try:
        import numpy
        from Cython.Build import cythonize
    except ImportError as error:
        _tell(error)
        return []
    sources = sorted([*map(str, FOLDER.glob('*.py')), *map(str, FOLDER.glob('*.pxd'))])
    extensions = [
        Extension(
            f'{PACKAGE}.kernel.{types.stem}',
            [str(types.with_suffix('.py'))],
            include_dirs=[numpy.get_include()],
            extra_compile_args=OPTIONS,
            define_macros=[('NPY_NO_DEPRECATED_API', 'NPY_1_7_API_VERSION')],
        )
        for types in sorted(FOLDER.glob('*.pxd'))
        if types.stem not in INCLUDED
    ]
    for extension in extensions:
        if extension.name.endswith('.origin'):
            extension.define_macros.append(('KINEMATICS_SOURCE', f'"{source_hash(FOLDER)}"'))
            extension.depends = sources
    # colcon reads what setup.py prints.
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return cythonize(
                extensions, compiler_directives=DIRECTIVES, build_dir='build/cython', quiet=True
            )
    except Exception as error:  # an old Cython, a folder that cannot be written
        sys.stderr.write(said.getvalue())
        _tell(error)
        return []


def _tell(error: Exception) -> None:
    print(f'the kernel is not compiled, it stays plain Python: {error}', file=sys.stderr)


class BuildIfPossible(build_ext):
    """Builds all modules or none: without them the same source runs as plain Python."""

    def run(self) -> None:
        """Build; where that fails, say so and go on."""
        try:
            super().run()
        except Exception as error:
            _tell(error)
            for output in map(Path, self.get_outputs()):
                output.unlink(missing_ok=True)
            self.extensions = []
