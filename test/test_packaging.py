# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
How the kernel comes to be compiled, and what is said where it is not, or not from its source.
"""

import ast
import graphlib
import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path

import pytest

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.kernel.compiled import VARIABLE

PACKAGE = Path(ks.__file__).parent
ROOT = Path(__file__).parents[1]
ENDING = sysconfig.get_config_var('EXT_SUFFIX')
NAME = 'kinematics_service'
in_clone = pytest.mark.skipif(
    not (ROOT / 'packaging').is_dir(), reason='there is no setup.py beside the tests'
)
# Python 3.10 writes `(a, b) = ...` where later versions write `a, b = ...`.
unparsed_without_brackets = pytest.mark.skipif(
    sys.version_info < (3, 11), reason='Python 3.10 puts tuples in brackets'
)
compiled_only = pytest.mark.skipif(not kernel.is_compiled(), reason='about the compiled kernel')
SAY = 'from kinematics_service import kernel; print(kernel.is_compiled(), kernel.notice())'
FK = (sys.executable, '-m', NAME, 'fk', '--robot', 'craig_3r', '--q', '0.1,0.2,0.3', '--json')


def copy_of_the_package(folder, compiled=True):
    left_out = ['__pycache__'] if compiled else ['__pycache__', f'*{ENDING}']
    shutil.copytree(PACKAGE, folder / NAME, ignore=shutil.ignore_patterns(*left_out))
    return folder / NAME


def run(command, folder, **environment):
    # With the package of this folder.
    around = {name: value for name, value in os.environ.items() if name != VARIABLE}
    return subprocess.run(
        command,
        cwd=folder,
        env={**around, 'PYTHONPATH': str(folder), 'PYTHONDONTWRITEBYTECODE': '', **environment},
        capture_output=True,
        text=True,
        timeout=280,
    )


def said_in(folder):
    done = run([sys.executable, '-c', SAY], folder)
    assert done.returncode == 0, done.stderr
    compiled, _, notice = done.stdout.strip().partition(' ')
    return compiled == 'True', notice


def test_the_package_has_its_types_and_nothing_of_the_build():
    assert {file.name for file in PACKAGE.rglob('*.pxd')} == {
        *('arrays.pxd', 'math.pxd', 'stop_timer.pxd')
    }
    assert not [*PACKAGE.rglob('*.c'), *PACKAGE.rglob('*.html')]


@compiled_only
def test_every_file_is_compiled_but_the_included_ones_and_those_of_python_alone():
    folder = PACKAGE / 'kernel'
    names = [file.relative_to(folder).with_suffix('') for file in folder.rglob('*.py')]
    modules = {name: sys.modules[f'{kernel.__name__}.{".".join(name.parts)}'] for name in names
               if name.name not in ('__init__', 'reinstallation')}  # fmt: skip
    left_out = {name.name for name, module in modules.items() if module.__file__.endswith('.py')}
    assert left_out == {'arrays', 'compiled', 'pairs', 'places', 'stop_timer'}
    compiled = {module.__file__ for module in modules.values()} - {
        str(folder / f'{name}.py') for name in modules
    }
    origin = str(folder / f'_origin{ENDING}')
    assert {str(file) for file in folder.rglob(f'*{ENDING}')} == {*compiled, origin}


@pytest.mark.slow
@compiled_only
@pytest.mark.parametrize('name', ['forward/vectors.py', 'layout/arrays.pxd'])
def test_a_library_older_than_its_source_is_named_and_not_used(tmp_path, name):
    package = copy_of_the_package(tmp_path)
    assert said_in(tmp_path) == (True, '')
    # Neither a file that another version left behind nor a new one is in the way.
    (package / 'kernel' / 'left_behind.py').write_text('')
    assert said_in(tmp_path) == (True, '')
    file = package / 'kernel' / name
    file.write_text(file.read_text() + '\n')
    compiled, notice = said_in(tmp_path)
    assert not compiled
    assert 'the source of the kernel has changed since it was compiled' in notice
    assert 'pip install --force-reinstall' in notice
    file.unlink()
    if name.endswith('.pxd'):
        assert said_in(tmp_path) == (compiled, notice)


@pytest.mark.slow
@compiled_only
def test_modules_of_different_ages_never_meet(tmp_path):
    kernel = copy_of_the_package(tmp_path) / 'kernel'
    # A class of another name, as after an update of a clone.
    for file in [*kernel.rglob('*.py'), *kernel.rglob('*.pyi'), *kernel.rglob('*.pxd')]:
        text = file.read_text().replace('Tape', 'FactorTape')
        file.write_text(text.replace('as FactorTape', 'as Tape'))
    done = run(FK, tmp_path)
    assert done.returncode == 0, done.stderr
    assert 'has changed since it was compiled' in done.stderr


@pytest.mark.slow
def test_a_kernel_that_is_not_compiled_works_and_every_command_says_so(tmp_path):
    copy_of_the_package(tmp_path, compiled=False)
    compiled, notice = said_in(tmp_path)
    assert not compiled
    done = run(FK, tmp_path)
    assert done.returncode == 0
    assert done.stderr == f'{NAME}: {notice}\n'
    asked_for = run(FK, tmp_path, **{VARIABLE: '1'})
    assert (asked_for.stdout, asked_for.stderr) == (done.stdout, '')


def installed(folder, **files):
    # As an installer describes what it has put there.
    about = folder / f'{NAME}-0.1.0.dist-info'
    about.mkdir()
    (about / 'METADATA').write_text(f'Metadata-Version: 2.1\nName: {NAME}\nVersion: 0.1.0\n')
    for name, text in files.items():
        (about / name).write_text(text)


AGAIN = ' -m pip install --force-reinstall --no-deps '


@pytest.mark.slow
@pytest.mark.parametrize(
    ('origin', 'again'),
    [
        (None, NAME),
        ({'url': 'file:///a%20b/clone', 'dir_info': {}}, "'/a b/clone'"),
        (
            {'url': 'https://host/a.git', 'vcs_info': {'vcs': 'git', 'commit_id': 'c0ffee'}},
            'git+https://host/a.git@c0ffee',
        ),
    ],
    ids=['index', 'folder', 'git'],
)
def test_what_pip_installed_is_compiled_by_what_pip_was_given(tmp_path, origin, again):
    copy_of_the_package(tmp_path, compiled=False)
    files = {'INSTALLER': 'pip'} | ({'direct_url.json': json.dumps(origin)} if origin else {})
    installed(tmp_path, **files)
    assert said_in(tmp_path)[1].endswith(f'{AGAIN}{again}')


def test_a_clone_is_compiled_in_its_place(tmp_path):
    (tmp_path / 'setup.py').touch()
    (tmp_path / 'src').mkdir()
    copy_of_the_package(tmp_path / 'src', compiled=False)
    assert said_in(tmp_path / 'src')[1].endswith(f'{AGAIN}-e {tmp_path}')


@pytest.mark.slow
def test_what_colcon_installed_is_compiled_by_colcon(tmp_path):
    site = tmp_path / 'install' / NAME / 'lib' / 'site-packages'
    site.mkdir(parents=True)
    copy_of_the_package(site, compiled=False)
    installed(site)
    again = f'cd {tmp_path} && rm -r build/{NAME} && colcon build --packages-select {NAME}'
    assert said_in(site)[1].endswith(again)


def test_a_symlinked_workspace_is_compiled_by_colcon(tmp_path):
    source, build = tmp_path / 'source', tmp_path / 'build' / NAME
    for folder in (source, build):
        folder.mkdir(parents=True)
    (source / 'setup.py').touch()
    (build / 'setup.py').symlink_to(source / 'setup.py')
    copy_of_the_package(build / 'src', compiled=False)
    assert said_in(build / 'src')[1].endswith(
        f'colcon build --symlink-install --packages-select {NAME}'
    )


@pytest.fixture
def clone(tmp_path):
    """Return a copy of the clone's source, where this runs from a clone and can build."""
    return copy_of_the_clone(tmp_path)


def copy_of_the_clone(folder):
    for module in ('setuptools', 'Cython'):
        pytest.importorskip(module)
    for name in (
        'setup.py',
        'setup.cfg',
        'package.xml',
        'README.md',
        'MANIFEST.in',
        'CHANGELOG.rst',
        'LICENSE',
        'NOTICE',
    ):
        shutil.copy(ROOT / name, folder)
    for name in ('packaging', 'src', 'config', 'resource'):
        left_out = shutil.ignore_patterns('*.so', '*.egg-info', '__pycache__')
        shutil.copytree(ROOT / name, folder / name, ignore=left_out)
    return folder


@pytest.fixture(scope='module')
def packed(tmp_path_factory):
    """Return a whole clone that was described, gathered for a build, and packed as source."""
    clone = copy_of_the_clone(tmp_path_factory.mktemp('packed'))
    for name in ('test', 'docs', 'examples', 'bench', '.ci', '.github'):
        left_out = shutil.ignore_patterns('__pycache__')
        shutil.copytree(ROOT / name, clone / name, ignore=left_out)
    for file in ROOT.glob('*.md'):
        shutil.copy(file, clone)
    commands = ['egg_info', 'build_py', '--build-lib', 'built', 'sdist', '--formats', 'tar']
    done = run([sys.executable, 'setup.py', '-q', *commands], clone)
    assert done.returncode == 0, done.stderr
    return clone


def compiled_files(folder):
    return [*folder.rglob('*.so'), *folder.rglob('*.o')]


# A kernel that is translated in a moment: a module with a class, one that uses it, one that uses
# both, and one that uses neither.
SMALLEST_KERNEL = {
    '__init__.py': '',
    '__init__.pyi': '',
    'pairs.py': 'def real(a: Complex) -> float:\n    """Return a part."""\n    return a[0]\n',
    'layout/__init__.py': '',
    'layout/places.py': 'LANES = 16\n',
    'points.py': """
from .layout import arrays
from .layout.arrays import Floats

class Points:
    def __init__(self, table: Floats) -> None:
        self.most: int = arrays.size(table)
""",
    'sums.py': """
from .layout import places
from .points import Points

def total(one: Points) -> float:
    turns = 2.0 * float(one.most)
    return turns * places.LANES
""",
    'means.py': """
from . import sums
from .points import Points

def mean(one: Points) -> float:
    return sums.total(one) / float(one.most)
""",
    'alone.py': """
def half(x: float) -> float:
    return 0.5 * x
""",
}
SMALLEST_UNITS = {f'_{name}': (name,) for name in ('points', 'sums', 'means', 'alone')}
SMALLEST_SETUP = f"""
import runpy, sys
sys.path.insert(0, 'packaging')
import kernel_build, kernel_types
kernel_build.UNITS = {SMALLEST_UNITS}
kernel_types.AVX2 = kernel_types.INLINE = {{}}
runpy.run_path('setup.py', run_name='__main__')
"""


def write_smallest(folder):
    """Write the smallest kernel, with the arrays of the package's, into a folder."""
    for name, text in SMALLEST_KERNEL.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    of_package = PACKAGE / 'kernel'
    of_layout = ('arrays.py', 'arrays.pxd', 'math.pxd', 'stop_timer.py', 'stop_timer.pxd')
    for name in ('compiled.py', *(f'layout/{name}' for name in of_layout)):
        shutil.copy(of_package / name, folder / name)


@pytest.fixture
def small_clone(clone):
    """Return a clone with the smallest kernel, which `SMALLEST_SETUP` builds."""
    shutil.rmtree(clone / 'src' / NAME / 'kernel')
    write_smallest(clone / 'src' / NAME / 'kernel')
    return clone


# What extras bring, of which ROS's package manager knows nothing.
OF_EXTRAS = {
    'cv2',
    'dask',
    'distributed',
    'h5py',
    'lz4',
    'matplotlib',
    'mpl_toolkits',  # of matplotlib
    'msgspec',
    'pyarrow',
    'rosbags',
    'typing_extensions',  # type checkers alone import it, and have it
    'viser',
    'websockets',
}
OF_ROS = re.compile('rclpy|.*_(msgs|srvs|interfaces)')


# One import a line, which the linter sees to.
IMPORT = re.compile(r'^ *(?:import (\w+)|from (\w+)[\w.]* import )', re.MULTILINE)


def modules_imported():
    for file in PACKAGE.rglob('*.py'):
        if file.name.endswith('.launch.py'):  # read by `ros2 launch`, which has them
            continue
        for pair in IMPORT.findall(file.read_text(encoding='utf-8')):
            yield ''.join(pair)


@in_clone
def test_rosdep_installs_what_the_package_imports_and_nothing_else():
    manifest = ElementTree.parse(ROOT / 'package.xml').getroot()
    keys = [depend.text for depend in manifest.findall('exec_depend')]
    names = set(modules_imported()) - sys.stdlib_module_names - OF_EXTRAS - {NAME, 'cython'}
    wanted = {name if OF_ROS.fullmatch(name) else f'python3-{name}' for name in names}
    assert sorted(keys) == sorted(wanted)


@in_clone
def test_the_oldest_versions_tested_are_those_that_the_package_asks_for():
    floors = dict(re.findall('^(.+)==(.+)$', (ROOT / 'packaging/floors.txt').read_text(), re.M))
    (wanted,) = (
        ast.literal_eval(node.value)
        for node in ast.walk(ast.parse((ROOT / 'setup.py').read_text()))
        if isinstance(node, ast.keyword) and node.arg == 'install_requires'
    )
    for line in wanted:
        name, least = line.partition(',')[0].split('>=')
        assert f'{floors[name]}.'.startswith(f'{least}.')


@pytest.mark.slow
def test_describing_the_package_translates_nothing(packed):
    assert (packed / 'src' / f'{NAME}.egg-info' / 'PKG-INFO').exists()
    assert not [*packed.rglob('*.c')]


WITHOUT_CYTHON = "import sys; sys.modules['Cython'] = None\n"


@pytest.mark.slow
def test_a_build_that_cannot_compile_fails_and_leaves_no_module(small_clone):
    clone = small_clone
    kernel_folder = clone / 'src' / NAME / 'kernel'
    # A module of an older build: with the others gone the set would be half built.
    older = kernel_folder / f'vectors{ENDING}'
    for before, command, left in (
        ('', ['build_ext'], [older]),
        ('', ['build_ext', '--inplace'], []),
        (WITHOUT_CYTHON, ['build'], [older]),
    ):
        older.touch()
        build = [sys.executable, '-c', before + SMALLEST_SETUP, '-q', *command]
        done = run(build, clone, CC='false', LDSHARED='false')
        assert done.returncode != 0
        assert 'the kernel cannot be compiled' in done.stderr
        assert 'KINEMATICS_UNCOMPILED=1' in done.stderr
        assert compiled_files(clone) == left


@in_clone
def test_after_a_failed_build_nothing_more_is_translated_or_installed(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / 'packaging'))
    monkeypatch.chdir(tmp_path)
    pytest.importorskip('Cython')
    import kernel_build
    from setuptools import Distribution, Extension

    def refuse(*_):
        raise OSError('no compiler')

    modules = [Extension(f'kernel._{name}', [f'{name}.c']) for name in ('first', 'second')]
    build = kernel_build.BuildKernel(Distribution({'ext_modules': modules}))
    build.inplace = True
    build.ensure_finalized()
    translated = []
    monkeypatch.setattr(build, '_translate', translated.append)
    monkeypatch.setattr(build, '_write_sources', lambda: None)
    monkeypatch.setattr(kernel_build.build_ext, 'build_extension', refuse)
    with pytest.raises(OSError, match='no compiler'):
        build.build_extension(modules[0])
    build.build_extension(modules[1])
    assert translated == modules[:1]


@pytest.mark.slow
def test_a_wheel_of_plain_python_is_made_if_it_is_asked_for(small_clone):
    if importlib.util.find_spec('setuptools.command.bdist_wheel') is None:
        pytest.importorskip('wheel')
    build = [sys.executable, '-c', SMALLEST_SETUP, '-q', 'bdist_wheel']
    done = run(build, small_clone, CC='false', KINEMATICS_UNCOMPILED='1')
    assert done.returncode == 0, done.stderr
    (wheel,) = small_clone.glob('dist/*')
    assert wheel.name.endswith('-py3-none-any.whl')
    with zipfile.ZipFile(wheel) as archive:
        names = [name.rpartition('/')[2] for name in archive.namelist()]
    # Each robot once, and the launch file, which a ROS workspace also has in its share.
    assert names.count('ur5e.yaml') == names.count('kinematics.launch.py') == 1


README = """\
<img src="logo.svg" alt="">

![A picture](docs/a.svg), [a page](docs/b.md#part), [elsewhere](https://a.org/c.md).
<!-- file: a.csv -->
"""


@in_clone
def test_the_page_on_pypi_has_whole_addresses_or_none(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / 'packaging'))
    from description import long_description

    at = 'https://host/owner/name'
    assert long_description(README, at, '1.2.3') == (
        f'<img src="{at}/raw/v1.2.3/logo.svg" alt="">\n\n'
        f'![A picture]({at}/raw/v1.2.3/docs/a.svg), [a page]({at}/blob/v1.2.3/docs/b.md#part), '
        '[elsewhere](https://a.org/c.md).\n'
    )
    without = ', a page, [elsewhere](https://a.org/c.md).\n'
    assert long_description(README, '', '1.2.3') == without
    page = long_description((ROOT / 'README.md').read_text(encoding='utf-8'), '', '1.2.3')
    assert not re.findall(r'\]\((?!https:)[^)]*\)|<img|!\[', page)


@in_clone
def test_the_notes_of_a_release_are_the_part_of_its_version(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / 'packaging'))
    from release_notes import notes

    text = (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8')
    heading = 'Forthcoming\n-----------\n'
    assert text.count(heading) == 1
    later = '0.2.0 (2027-02-01)\n------------------\n* New.\n\n'
    dated = text.replace(heading, f'{later}0.1.0 (2027-01-15)\n------------------\n')
    assert notes('0.2.0', dated) == '* New.\n'
    assert notes('0.1.0', dated).startswith('The first release.\n\n* ')
    assert '``' not in notes('0.1.0', dated)
    with pytest.raises(ValueError, match=r"no section '0\.1\.0 "):
        notes('0.1.0', text)


@in_clone
def test_one_command_sets_the_address_of_the_repository(clone, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / 'packaging'))
    from repository import set_repository

    shutil.copy(ROOT / 'CITATION.cff', clone)
    files = [clone / name for name in ('package.xml', 'CITATION.cff')]
    before = [file.read_text() for file in files]
    for _ in range(2):
        set_repository('https://host/owner/name', clone)
    manifest = ElementTree.parse(files[0]).getroot()
    assert {url.get('type'): url.text for url in manifest.findall('url')} == {
        'repository': 'https://host/owner/name',
        'bugtracker': 'https://host/owner/name/issues',
    }
    done = run([sys.executable, 'setup.py', '-q', 'egg_info'], clone)
    assert done.returncode == 0, done.stderr
    about = (clone / 'src' / f'{NAME}.egg-info' / 'PKG-INFO').read_text()
    assert 'Project-URL: Source, https://host/owner/name\n' in about
    assert '](https://host/owner/name/raw/v' in about
    set_repository('', clone)
    assert [file.read_text() for file in files] == before


def test_colcons_folder_of_symlinks_describes_the_package_too(packed, tmp_path):
    for name in ('setup.py', 'setup.cfg', 'package.xml', 'src', 'config', 'resource'):
        (tmp_path / name).symlink_to(packed / name)
    done = run([sys.executable, 'setup.py', '-q', '--version'], tmp_path)
    assert (done.returncode, done.stdout.strip()) == (0, ks.__version__), done.stderr


@pytest.mark.slow
def test_what_is_packed_as_source_can_be_built(packed):
    (archive,) = (packed / 'dist').iterdir()
    with tarfile.open(archive) as opened:
        names = {name.partition('/')[2] for name in opened.getnames()}
    assert {
        f'packaging/{name}.py'
        for name in ('kernel_build', 'kernel_types', 'kernel_units', 'backend')
    } <= names
    assert 'package.xml' in names
    assert {
        'src/kinematics_service/kernel/layout/arrays.pxd',
        'config/ur5e.yaml',
        'config/ros/kinematics.launch.py',
        'README.md',
        'CHANGELOG.rst',
    } <= names
    assert not [name for name in names if name.endswith(('.pyc', '.so'))]
    git = ['git', 'ls-files', 'test', 'docs', 'examples', 'bench', '.ci', '.github', '*.md']
    tracked = subprocess.run(git, cwd=ROOT, capture_output=True, text=True, check=False)
    assert set(tracked.stdout.split()) <= names


@pytest.mark.slow
def test_everything_that_is_no_python_is_installed_too(packed):
    beside = {
        file.relative_to(packed / 'src')
        for file in (packed / 'src' / NAME).rglob('*')
        if file.is_file() and file.suffix != '.py'
    }
    assert {file.suffix for file in beside} >= {'.pxd', '.css', '.js', '.xml'}
    assert not [file for file in beside if not (packed / 'built' / file).exists()]


SMALL_KERNEL = {
    '__init__.py': '',
    '__init__.pyi': 'from .sums import total as total\n',
    'layout/arrays.pxd': 'cdef inline double* numbers(ndarray array) except NULL:\n    ...\n',
    'layout/arrays.py': '',
    'layout/places.py': 'NAN = float("nan")\nFIRST, SECOND = range(2)\n',
    'pairs.py': 'def real(a: Complex) -> float:\n    """Return a part."""\n    return a[0]\n',
    'sums.py': """
import math
from . import pairs
from .layout import arrays, places
LEAST, MOST = 0.5, 3
NAME = 'sum'

class Sum:
    most: int
    def __init__(self, table: Table) -> None:
        self.table: Table = table
        self.room: Flat = table.room
        self.wanted: Public[Nanoseconds] = 0
        self.most = 3

    def add(self, x: float) -> None:
        small = x < LEAST

    def check(self) -> bool:
        return self.add(1.0)

    def _from(self, row: Numbers) -> tuple[int, int]:
        total: Complex = (0.0, 0.0)
        spare, terms = [0.0] * 16, [0] * 3

class Table(NamedTuple):
    room: Floats

def total(one: Sum, rows: Floats) -> float:
    return mean(arrays.numbers(rows), 3)

def mean(row: Flat, count: int) -> float:
    return row[0]

def check(one: 'Sum | None') -> None:
    raise TypeError

def both(one: Sum) -> bool:
    check(one)
    return True

def calls_a_method(one: Sum) -> bool:
    return one.check()

def alone(one: Sum, count: int) -> float:
    with arrays.without_lock():
        for k in range(count):
            one.add(abs(float(k)))
    return arrays.numbers(one.table)

def names(one: Sum) -> bool:
    return all(one for _ in 'ab')

def fits(table: Floats) -> bool:
    return True
""",
    'rows.py': """
import math
from .layout import arrays
from . import sums
from .sums import Sum, names
LONGEST = 2.0

def longest(one: Sum, row: Flat) -> float:
    fits = sums.mean(row, sums.MOST) < LONGEST
    return sums.mean(row, 1)

def named(one: Sum) -> object:
    return names(one)
""",
}
SMALL_DECLARATIONS = """
cimport cython
cdef class Sum
cdef int SUMS_MOST
@cython.final
cdef class Sum:
    cdef object table
    cdef double* room
    cdef long long wanted
    cdef Py_ssize_t most
    cdef void add(self, double x) noexcept nogil
    cdef bint check(self) noexcept nogil
    cdef (Py_ssize_t, Py_ssize_t) _from(self, double* row) noexcept nogil
cdef double sums_mean(double* row, Py_ssize_t count) noexcept nogil
"""
SMALL_SOURCE = """
cimport cython
from .layout.arrays cimport Pair, Triple, ndarray
from .layout cimport math
from .layout cimport arrays
from . cimport pairs
from .layout cimport places
import math
from .layout import arrays
from . import pairs
from .layout import places
cdef double SUMS_LEAST
SUMS_LEAST, SUMS_MOST = (0.5, 3)
SUMS_NAME = 'sum'
@cython.final
cdef class Sum:
    def __init__(self, table: Table) -> None:
        self.table: Table = table
        self.room: Flat = table.room
        self.wanted: Public[Nanoseconds] = 0
        self.most = 3
    @cython.locals(small='bint')
    cdef void add(self, double x) noexcept nogil:
        small = x < SUMS_LEAST
    cdef bint check(self) noexcept nogil:
        return self.add(1.0)
    @cython.locals(spare='double[16]', terms='long long[3]', total='Pair')
    cdef (Py_ssize_t, Py_ssize_t) _from(self, double* row) noexcept nogil:
        total: Complex = (0.0, 0.0)
        spare, terms = ([0.0] * 16, [0] * 3)
class Table(NamedTuple):
    room: Floats
cpdef double total(Sum one, ndarray rows):
    arrays.given(one)
    return sums_mean(arrays.numbers(rows), 3)
cdef double sums_mean(double* row, Py_ssize_t count) noexcept nogil:
    return row[0]
cdef object sums_check(Sum one):
    raise TypeError
cdef bint sums_both(Sum one):
    sums_check(one)
    return True
cdef bint sums_calls_a_method(Sum one) noexcept nogil:
    return one.check()
cdef double sums_alone(Sum one, Py_ssize_t count):
    with nogil:
        for k in range(count):
            one.add(abs(float(k)))
    return arrays.numbers(one.table)
def sums_names(one: Sum) -> bool:
    return all((one for _ in 'ab'))
def sums_fits(table: Floats) -> bool:
    return True
"""
OF_OTHERS = """
from ._sums cimport SUMS_MOST
from ._sums cimport sums_mean
from .layout cimport arrays
from ._sums cimport Sum
import math
from .layout import arrays
from ._sums import sums_names
cdef double ROWS_LONGEST
ROWS_LONGEST = 2.0
@cython.locals(fits='bint')
cdef double rows_longest(Sum one, double* row) noexcept nogil:
    fits = sums_mean(row, SUMS_MOST) < ROWS_LONGEST
    return sums_mean(row, 1)
def rows_named(one: Sum) -> object:
    return sums_names(one)
"""


@pytest.fixture
def small_kernel(tmp_path, monkeypatch):
    """Return the types of a kernel with one module of each kind, and its folder."""
    monkeypatch.syspath_prepend(str(ROOT / 'packaging'))
    from kernel_types import KernelTypes

    for name, text in SMALL_KERNEL.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    units = {'_sums': ['sums'], '_rows': ['rows']}
    return lambda: KernelTypes(tmp_path, ('places', 'arrays', 'pairs'), units), tmp_path


@in_clone
@unparsed_without_brackets
def test_the_compilers_source_has_the_types_of_the_annotations(small_kernel):
    types, folder = small_kernel
    assert types().declarations('_sums') == SMALL_DECLARATIONS.lstrip()
    head, _, source = types().source('_sums').partition('\n')
    assert source == SMALL_SOURCE.lstrip()
    # What others use has the name there that it has in its module.
    assert types().source('_rows').endswith(OF_OTHERS)
    assert types().included_text(folder / 'layout/arrays.py') == SMALL_KERNEL['layout/arrays.pxd']
    pairs = types().included_text(folder / 'pairs.py')
    assert pairs.endswith('cdef inline double real(Pair a) noexcept nogil:\n    return a[0]\n')
    places = types().included_text(folder / 'layout/places.py')
    assert '#define KINEMATICS_NAN Py_NAN' in places
    assert places.endswith('cdef enum:\n    FIRST = 0\n    SECOND = 1\n')
    # Cython does not see that an included file has changed, but that the source has.
    (folder / 'layout/places.py').write_text('FIRST = 1\n')
    assert types().source('_sums').partition('\n')[::2] != (head, source)
    assert types().source('_sums').partition('\n')[2] == source


WITH_MEMORY = """
    def __init__(self, rows: Floats, sum: Sum, other: 'Sum | None', scale: float):
        self.count, self.scale = rows.size, 2.0 * scale
        self.sum, self.most, self.size = sum, sum.most, 3 + sum.most
        self.whole, self.mean = scale > 1.0, mean(rows, 3)
        self.rows = arrays.numbers(rows, 3)
        self.a, self.b = arrays.rooms(3, self.size)
        (self.c,) = arrays.whole_rooms(self.size)
        self.last = LEAST
"""


@in_clone
def test_a_class_keeps_its_arrays_and_gives_its_rooms_back(small_kernel):
    types, folder = small_kernel
    file = folder / 'sums.py'
    file.write_text(f'{file.read_text()}\nclass Room:{WITH_MEMORY}')
    arrays = 'def numbers(array: Floats, count: int) -> Flat:\n    return array\n'
    (folder / 'layout/arrays.py').write_text(arrays)
    (folder / '__init__.pyi').write_text('from .sums import Room as Room\n')
    head, _, fields = types().declarations('_sums').partition('cdef class Room:\n')
    # What an attribute of Python is set to has no type of C: the compiler would say so.
    assert fields.splitlines()[:12] == [
        f'    cdef {field}'
        for field in (
            'readonly double scale',
            'readonly Sum sum',
            'readonly Py_ssize_t most',
            'readonly Py_ssize_t size',
            'readonly bint whole',
            'readonly double mean',
            'double* rows',
            'double* a',
            'double* b',
            'long long* c',
            'readonly double last',
            'object _kept',
        )
    ]
    assert fields.splitlines()[12] == '    cdef double* _room'
    body = types().source('_sums').partition('cdef class Room:\n')[2]
    for lines in (
        ['def __dealloc__(self):', '    arrays.give_back(self._room)'],
        [
            'self._room = arrays.scratch(0 + 3 + self.size + self.size)',
            'self.a = arrays.after(self._room, 0)',
            'self.b = arrays.after(self._room, 0 + 3)',
            'self.c = arrays.as_whole(arrays.after(self._room, 0 + 3 + self.size))',
            'self.last = SUMS_LEAST',
            'self._kept = (rows,)',
        ],
    ):
        assert [line.strip() for line in lines] == [
            line.strip()
            for line in body.splitlines()
            if line.strip() in [one.strip() for one in lines]
        ]
    # Of what Python gives only what may be None is not refused.
    assert body.count('arrays.given') == body.count('arrays.given(sum)') == 1
    # One piece of memory: nothing comes between.
    file.write_text(file.read_text().replace('(self.c,)', 'self.d = 1\n        (self.c,)'))
    with pytest.raises(TypeError, match='next to each other'):
        types().source('_sums')


@in_clone
@pytest.mark.parametrize('together', [False, True])
def test_names_of_other_files_are_not_taken_for_a_functions_own(small_kernel, together):
    from kernel_types import KernelTypes

    _, folder = small_kernel
    file = folder / 'rows.py'
    units = {'_all': ['rows', 'sums']} if together else {'_sums': ['sums'], '_rows': ['rows']}
    types = KernelTypes(folder, ('places', 'arrays', 'pairs'), units)
    # The file that another one imports comes first.
    source = types.source('_all' if together else '_rows')
    assert source.endswith(OF_OTHERS.partition('ROWS_LONGEST = 2.0')[2])
    assert ('class Sum' in source) is together
    file.write_text(file.read_text().replace('fits', 'sums_mean'))
    with pytest.raises(TypeError, match=re.escape('rows.py: sums_mean is sums.mean; rename')):
        KernelTypes(folder, ('places', 'arrays', 'pairs'), units)
    # What imports each other has no order.
    file.write_text(SMALL_KERNEL['rows.py'])
    sums = folder / 'sums.py'
    sums.write_text(f'from . import rows\n{sums.read_text()}')
    with pytest.raises(graphlib.CycleError):
        KernelTypes(folder, ('places', 'arrays', 'pairs'), units)
    sums.write_text(SMALL_KERNEL['sums.py'])
    # A variable of a function's own that has the name of a function of the file, or of a file.
    text = SMALL_KERNEL['rows.py'].replace('fits', 'longest')
    file.write_text(f'{text}\ndef other(sums: Sum, mean: float) -> float:\n    return sums.most\n')
    source = KernelTypes(folder, ('places', 'arrays', 'pairs'), units).source(list(units)[-1])
    assert '    longest = sums_mean(row, SUMS_MOST) < ROWS_LONGEST\n' in source
    assert source.endswith(
        'cdef double rows_other(Sum sums, double mean) noexcept nogil:\n    return sums.most\n'
    )


WITHOUT_LOCK = """
from .layout import arrays

def check(count: int) -> None:
    raise TypeError

def steps(count: int) -> int:
    {start}
    with arrays.without_lock():
        while k < count:
            {step}
    return k
"""


@in_clone
@pytest.mark.parametrize(
    ('start', 'step', 'is_refused'),
    [
        ('k: int = 0', 'k += 1', False),
        # Changes the reference count of an object, which other threads change at the same time.
        ('k = 0', 'k += 1', True),
        ('k: int = 0', 'check(k)', True),
    ],
)
def test_python_is_refused_without_the_interpreters_lock(
    tmp_path, monkeypatch, start, step, is_refused
):
    Main = pytest.importorskip('Cython.Compiler.Main')
    monkeypatch.syspath_prepend(str(ROOT / 'packaging'))
    from kernel_types import KernelTypes

    folder = tmp_path / 'kernel'
    shutil.copytree(ROOT / 'src' / NAME / 'kernel/layout', folder / 'layout')
    (folder / '__init__.pyi').write_text('from .counting import steps as steps\n')
    (folder / 'counting.py').write_text(WITHOUT_LOCK.format(start=start, step=step))
    included = ('places', 'arrays')
    types = KernelTypes(folder, included, {'_counting': ['counting']})
    (folder / 'layout/places.pxd').write_text(types.included_text(folder / 'layout/places.py'))
    for package in (folder, folder / 'layout'):
        (package / '__init__.pxd').write_text('')
    (folder / '_counting.pyx').write_text(types.source('_counting'))
    (folder / '_counting.pxd').write_text(types.declarations('_counting'))
    monkeypatch.chdir(tmp_path)
    result = Main.compile_single(
        'kernel/_counting.pyx', Main.CompilationOptions(language_level=3), 'kernel._counting'
    )
    assert bool(result.num_errors) is is_refused


@in_clone
def test_a_function_that_is_compiled_in_another_way_has_to_be_there(small_kernel, monkeypatch):
    types, _ = small_kernel
    monkeypatch.setattr('kernel_types.AVX2', {'sums': ['median']})
    with pytest.raises(TypeError, match='names sums.median, which does not exist'):
        types().check()


@in_clone
def test_python_sees_the_fields_and_methods_of_exported_classes(small_kernel):
    types, folder = small_kernel
    (folder / '__init__.pyi').write_text('from .sums import Sum as Sum\n')
    written = types().declarations('_sums')
    for line in (
        'cdef readonly Py_ssize_t most',
        'cdef readonly object table',
        'cdef double* room',
        'cdef public long long wanted',
        'cpdef void add(self, double x) noexcept nogil',
        'cdef (Py_ssize_t, Py_ssize_t) _from(self, double* row) noexcept nogil',
    ):
        assert f'    {line}\n' in written


@in_clone
@pytest.mark.parametrize(
    ('room', 'files', 'wrong'),
    [('loops', (), 'loops'), ('loops', ('loops/opening',), 'loops/opening'), ('', (), '')],
)
def test_each_file_is_of_a_module(monkeypatch, room, files, wrong):
    monkeypatch.syspath_prepend(str(ROOT / 'packaging'))
    monkeypatch.chdir(ROOT)
    import kernel_build

    if not wrong:
        names = [name for of in kernel_build.units().values() for name in of]
        assert len(names) == len(set(names)) > 60
        return
    parts = files and (room, *files)
    monkeypatch.setitem(kernel_build.UNITS, f'_{room}', parts)
    with pytest.raises(ValueError, match=re.escape(f"differ in: ['{wrong}']")):
        kernel_build.units()


@pytest.mark.slow
@in_clone
def test_a_module_is_translated_again_when_what_it_uses_has_changed(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / 'packaging'))
    monkeypatch.chdir(tmp_path)
    import kernel_build
    from setuptools import Distribution

    kernel_folder = Path('src', NAME, 'kernel')
    write_smallest(kernel_folder)
    monkeypatch.setattr('kernel_types.AVX2', {})
    monkeypatch.setattr('kernel_types.INLINE', {})
    monkeypatch.setattr(kernel_build, 'UNITS', SMALLEST_UNITS)
    every = {*SMALLEST_UNITS, '_origin'}

    def translated():
        # The modules' sources, and those that are older than what they are made of.
        monkeypatch.setattr('Cython.Build.Dependencies._dep_tree', None)  # remembers ages
        modules = kernel_build.extension_modules()
        build = kernel_build.BuildKernel(Distribution({'ext_modules': modules}))
        build.build_temp = 'temporary'
        build.force = False
        build._write_sources()
        found = {}
        for module in modules:
            build._translate(module)
            unit = module.name.rpartition('.')[2]
            found[unit] = Path(module.sources[0]).stat().st_mtime_ns
        assert found.keys() == every
        return found

    def changed(name, old, new):
        before = translated()
        file = kernel_folder / name
        assert old in file.read_text()
        file.write_text(file.read_text().replace(old, new))
        return {unit for unit, when in translated().items() if when > before[unit]}

    assert changed('sums.py', 'turns', 'turns') == set()
    assert changed('sums.py', 'turns', 'quarters') == {'_sums', '_origin'}
    fields = 'self.most: int', 'self.spare: int = 0\n        self.most: int'
    assert changed('points.py', *fields) == every - {'_alone'}
    # An included file is in all modules, whether they use it or not.
    assert changed('layout/places.py', 'LANES = 16', 'LANES = 8') == every


LESSONS = re.compile(r'```python\n(.*?)```\n\n```text\n(.*?)```', re.DOTALL)


@in_clone
@unparsed_without_brackets
def test_the_page_of_the_kernel_shows_what_the_build_writes(tmp_path, monkeypatch):
    examples = LESSONS.findall((ROOT / 'docs' / 'explanation' / 'kernel.md').read_text())
    assert len(examples) == 10
    # The constant comes first, as in every file.
    texts = [text for text, _ in sorted(examples, key=lambda one: not one[0][0].isupper())]
    write_smallest(tmp_path)
    (tmp_path / '__init__.pyi').write_text(
        ''.join(
            f'from .lessons import {name} as {name}\n' for name in ('mean', 'Track', 'lengths')
        )
    )
    imports = 'import math\nfrom .layout import arrays\n'
    imports += 'from .layout.arrays import Flat, Floats, Public, Vector\n'
    (tmp_path / 'lessons.py').write_text(imports + '\n'.join(texts))
    monkeypatch.syspath_prepend(str(ROOT / 'packaging'))
    import kernel_types

    monkeypatch.setattr(kernel_types, 'AVX2', {})
    monkeypatch.setattr(kernel_types, 'INLINE', {})
    types = kernel_types.KernelTypes(
        tmp_path, ('places', 'arrays', 'pairs'), {'_lessons': ['lessons']}
    )
    types.check()
    written = types.source('_lessons')
    for _, cython in examples:
        assert cython in written, cython
