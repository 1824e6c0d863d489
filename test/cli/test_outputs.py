# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What commands write: files that keep what they are, devices, pipes, and disks that fill."""

import io
import os
import re
import resource
import stat
import subprocess
import sys
import tempfile
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.cli.command_line import READER_GONE
from kinematics_service.cli.standard_output import checked_output
from kinematics_service.errors import KinematicsError
from kinematics_service.output_file import new_file, write_file

ROOT = os.geteuid() == 0
# What fits on the disk of the tests, and what does not (bytes).
ROOM, LARGE = 50, 30_000

URDF = """<robot name="two"><link name="a"/><link name="b"/><link name="c"/>
<joint name="q1" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="q2" type="revolute"><parent link="b"/><child link="c"/><origin xyz="1 0 0"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
ROWS = 'stamp,position.q1,position.q2\n' + ''.join(
    f'{1 + 0.1 * k:.1f},{0.02 * k:.2f},0.5\n' for k in range(20)
)

# Commands with one output, by the ending that its file needs: texts, a page and a bag.
WRITERS = {
    'export': ('export planar_2r --urdf {}', ''),
    'new': ('new arm --dof 2 --force --out {}', ''),
    'import': ('import --urdf two.urdf --base a --tip c --out {}', ''),
    'audit-html': ('audit run.csv --robot planar_2r --html {}', ''),
    'audit-out': ('audit run.csv --robot planar_2r --out {}', ''),
}
PACKAGES = {'audit-out': 'rosbags'}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path('two.urdf').write_text(URDF)
    Path('run.csv').write_text(ROWS)
    return tmp_path


def writer_called(name):
    command, suffix = WRITERS[name]
    if name in PACKAGES:
        pytest.importorskip(PACKAGES[name])

    def run(file):
        return main(command.format(file).split())

    return run, suffix


@pytest.fixture(params=WRITERS)
def writer(request, folder):
    """Return a function that runs a command with an output, and the ending its file needs."""
    return writer_called(request.param)


@pytest.fixture(params=['new', 'audit-out'])
def one_writer(request, folder):
    """
    Return those of one text, by `write_file`, and of one bag, by `new_file`.

    Every command writes by one of them.
    """
    return writer_called(request.param)


def device(path, minor):
    # A device of its own: the system's must not be at stake.
    if not ROOT:
        pytest.skip('needs root')
    try:
        os.mknod(path, 0o666 | stat.S_IFCHR, os.makedev(1, minor))
    except OSError as error:
        pytest.skip(f'no devices can be made here: {error}')
    try:
        os.close(os.open(path, os.O_WRONLY))
    except OSError as error:
        pytest.skip(f'devices cannot be opened here: {error}')
    return path


@contextmanager
def full_disk():
    # What is written beyond ROOM fails, with a part of it written: as on a disk that is full.
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def left_over(folder):
    return [path for path in folder.iterdir() if path.name.startswith('.')]


@pytest.mark.slow
def test_a_device_is_written_to_and_stays_a_device(one_writer, folder, capsys):
    run, suffix = one_writer
    null = device(folder / f'null{suffix}', 3)
    assert run(null) == 0, capsys.readouterr().err
    assert null.is_char_device()
    assert left_over(folder) == []


@pytest.mark.slow
def test_a_device_that_is_full_is_a_sentence(one_writer, folder, capsys):
    run, suffix = one_writer
    full = device(folder / f'full{suffix}', 7)
    assert run(full) == 1
    error = capsys.readouterr().err.strip()
    assert f'{full}: ' in error
    assert error.endswith('No space left on device')
    assert len(error.splitlines()) == 1
    assert full.is_char_device()


@pytest.mark.slow
def test_a_named_pipe_gets_the_whole_output(one_writer, folder, capsys):
    run, suffix = one_writer
    file = folder / f'file{suffix}'
    assert run(file) == 0, capsys.readouterr().err
    expected = file.stat().st_size
    pipe = folder / f'pipe{suffix}'
    os.mkfifo(pipe)
    read = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()), daemon=True)
    reader.start()
    assert run(pipe) == 0, capsys.readouterr().err
    reader.join(60.0)
    # A page and a bag tell the time.
    assert read
    assert abs(len(read[0]) - expected) <= 64
    assert pipe.is_fifo()


@pytest.mark.slow
def test_links_are_followed_and_stay_whether_they_dangle_or_not(one_writer, folder, capsys):
    run, suffix = one_writer
    (folder / 'deep').mkdir()
    real = folder / 'deep' / f'real{suffix}'
    middle, first = folder / f'middle{suffix}', folder / 'deep' / f'first{suffix}'
    middle.symlink_to(Path('deep') / real.name)
    first.symlink_to(Path('..') / middle.name)
    for _ in range(2):
        assert run(first) == 0, capsys.readouterr().err
        assert first.is_symlink()
        assert middle.is_symlink()
        assert real.stat().st_size > ROOM
        assert not real.is_symlink()
        real.write_text('old')


@pytest.mark.slow
def test_permissions_owner_and_hard_links_of_a_file_are_kept(one_writer, folder, capsys):
    run, suffix = one_writer
    file, other = folder / f'file{suffix}', folder / 'other'
    file.write_text('old')
    file.chmod(0o640)
    if ROOT:
        os.chown(file, 12345, 54321)
    before = file.stat()
    assert run(file) == 0, capsys.readouterr().err
    after = file.stat()
    assert after.st_size > ROOM
    assert (after.st_mode, after.st_uid, after.st_gid) == (
        before.st_mode,
        before.st_uid,
        before.st_gid,
    )
    os.link(file, other)
    file.write_text('old')
    assert run(file) == 0, capsys.readouterr().err
    assert other.samefile(file)
    assert other.stat().st_size > ROOM


@pytest.mark.slow
def test_a_disk_that_fills_leaves_the_old_file(writer, request, folder, capsys):
    run, suffix = writer
    file, pair = folder / f'file{suffix}', folder / 'pair'
    # A file with another name is written in its place: by `write_file`, whatever the command.
    for links in (1, 2) if 'new' in request.node.name else (1,):
        file.write_text('old' * 1000)
        capsys.readouterr()
        with full_disk():
            assert run(file) == 1
        error = capsys.readouterr().err
        assert f'{file}: ' in error
        assert error.endswith('File too large\n')
        assert file.read_text() == 'old' * 1000
        assert left_over(folder) == []
        if links == 1:
            os.link(file, pair)


def test_every_file_is_written_by_one_module():
    # So what these tests say of some commands holds for all.
    package = Path(ks.__file__).parent
    writes = re.compile(
        r"""\.write_(?:text|bytes)\(|\.savefig\((?!content)|open\((?!os\.devnull)[^)]*['"][wax]b?\+?['"]"""
    )
    found = {
        str(file.relative_to(package))
        for file in package.rglob('*.py')
        if writes.search(file.read_text(encoding='utf-8'))
    }
    assert found == {'output_file.py'}


@pytest.mark.parametrize('size', [0, 1, 5, LARGE])
def test_a_file_that_must_stay_in_its_place_gets_exactly_the_new_content(folder, size):
    file = folder / 'file'
    file.write_bytes(b'old' * 1000)
    os.link(file, folder / 'pair')
    write_file(file, b'x' * size)
    assert (folder / 'pair').read_bytes() == b'x' * size


def test_a_mount_or_the_file_of_another_is_written_in_its_place(folder, monkeypatch):
    # A file that is mounted into a container cannot be replaced; nor given away by its user.
    file = folder / 'file'
    for name, code in (('replace', 16), ('chown', 1)):
        file.write_text('old content')
        number = file.stat().st_ino

        def refuse(*_, code=code):
            raise OSError(code, os.strerror(code))

        with monkeypatch.context() as patch:
            patch.setattr(os, name, refuse)
            write_file(file, 'new')
        assert file.read_text() == 'new'
        assert file.stat().st_ino == number
        assert left_over(folder) == []


def test_a_file_that_stays_in_its_place_is_left_where_there_is_no_room(folder, monkeypatch):
    file = folder / 'file'
    file.write_text('old')
    os.link(file, folder / 'pair')

    def fill(descriptor, begin, length):
        os.ftruncate(descriptor, begin + length)
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(os, 'posix_fallocate', fill)
    with pytest.raises(KinematicsError, match='No space left'):
        write_file(file, 'new content')
    assert file.read_text() == 'old'


def test_a_file_is_made_beside_the_one_it_becomes(folder, monkeypatch):
    # On a disk of its own nothing else could take its place at once.
    monkeypatch.setattr(tempfile, 'tempdir', str(folder / 'none'))
    for content in ('new', 'newer'):
        write_file(folder / 'file', content)
        assert (folder / 'file').read_text() == content


def test_a_file_without_a_name_is_written_to(folder):
    with open('file', 'w+') as stream:
        os.unlink('file')
        write_file(Path(f'/proc/self/fd/{stream.fileno()}'), 'new')
        assert stream.read() == 'new'
    assert [path.name for path in folder.iterdir() if 'file' in path.name] == []


def test_what_was_printed_before_comes_first(folder):
    text = (
        'from pathlib import Path; from kinematics_service.output_file import write_file; '
        'print("first"); write_file(Path("/dev/stdout"), "second")'
    )
    with open('out', 'wb') as stream:
        subprocess.run(
            [sys.executable, '-c', text],
            stdout=stream, env={**os.environ, 'PYTHONUNBUFFERED': ''}, check=True,
        )  # fmt: skip
    assert Path('out').read_text() == 'first\nsecond'


def test_lines_of_an_unbuffered_output_are_there_at_once(folder):
    with open('out', 'wb', buffering=0) as file:
        unbuffered = io.TextIOWrapper(file, 'utf-8', write_through=True)
        stream = checked_output(unbuffered)
        stream.write('line\n')
        assert Path('out').read_text() == 'line\n'


def test_what_cannot_be_written_is_refused_in_a_sentence(folder):
    (folder / 'text').write_text('x')
    (folder / 'loop').symlink_to('loop')
    (folder / 'dangling').symlink_to(Path('none') / 'file')
    for name, reason in (
        ('.', 'Is a directory'),
        ('none/file', 'No such file or directory'),
        ('text/file', 'Not a directory'),
        ('loop', 'Too many levels of symbolic links'),
        ('dangling', 'No such file or directory'),
    ):
        path = folder / name
        with pytest.raises(KinematicsError) as refused:
            write_file(path, 'new')
        assert str(refused.value).startswith(f'{path}: ')
        assert reason in str(refused.value)
    assert (folder / 'dangling').is_symlink()
    assert left_over(folder) == []


def test_an_interruption_leaves_the_old_file(folder):
    (folder / 'file').write_text('old')
    with pytest.raises(KeyboardInterrupt), new_file(folder / 'file') as made:
        made.write_text('ne')
        raise KeyboardInterrupt
    assert (folder / 'file').read_text() == 'old'
    assert left_over(folder) == []


def test_a_new_file_has_the_permissions_that_the_user_gives_files(folder):
    before = os.umask(0o027)
    try:
        write_file(folder / 'file', 'new')
    finally:
        os.umask(before)
    assert stat.S_IMODE((folder / 'file').stat().st_mode) == 0o640


@pytest.mark.skipif(ROOT, reason='root may write everything')
def test_a_file_or_folder_that_is_protected_is_not_written(folder):
    (folder / 'file').write_text('old')
    (folder / 'file').chmod(0o444)
    with pytest.raises(KinematicsError, match='Permission denied'):
        write_file(folder / 'file', 'new')
    (folder / 'file').chmod(0o644)
    folder.chmod(0o555)
    try:
        write_file(folder / 'file', 'new')
        with pytest.raises(KinematicsError, match='Permission denied'):
            write_file(folder / 'other', 'new')
    finally:
        folder.chmod(0o755)
    assert (folder / 'file').read_text() == 'new'


def program(*argv, room=None, **options):
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))

    return subprocess.run(
        [sys.executable, '-m', 'kinematics_service', *argv],
        stderr=subprocess.PIPE, text=True, **{'preexec_fn': limit if room else None, **options},
    )  # fmt: skip


@pytest.mark.slow
def test_standard_output_by_its_name_stays_in_order_and_in_its_file(folder):
    with open('both', 'wb') as stream:
        stream.write(b'before\n')
        stream.flush()
        command = ['export', 'planar_2r', '--urdf', '/dev/stdout']
        assert program(*command, stdout=stream).stderr == ''
    before, document, *_, summary = Path('both').read_text().splitlines()
    assert before == 'before'
    assert document.startswith('<?xml')
    assert summary.startswith('wrote /dev/stdout')


def test_standard_error_by_its_name_gets_the_output(folder, capfd):
    assert main(['export', 'planar_2r', '--urdf', '/dev/stderr']) == 0
    out, err = capfd.readouterr()
    assert err.startswith('<?xml')
    assert out.startswith('wrote /dev/stderr')


LARGE_OUTPUT = 'export planar_2r --urdf -'


@pytest.mark.slow
def test_a_disk_that_fills_under_standard_output_is_a_failure(folder):
    environment = {**os.environ, 'PYTHONUNBUFFERED': '1'}
    with open('out', 'wb') as stream:
        ended = program(*LARGE_OUTPUT.split(), room=1000, stdout=stream, env=environment)
    assert ended.returncode == 1
    assert ended.stderr.startswith('standard output ')
    assert ended.stderr.endswith('File too large\n')
    assert len(ended.stderr.splitlines()) == 1


@pytest.mark.slow
def test_a_device_that_is_full_as_standard_output_is_a_failure(folder):
    full = device(folder / 'full', 7)
    with open(full, 'wb') as stream:
        ended = program('--version', stdout=stream)
    assert ended.returncode == 1
    # For a person to read.
    assert ended.stderr == 'standard output cannot be written: No space left on device\n'


@pytest.mark.slow
@pytest.mark.parametrize('unbuffered', ['1', ''])
def test_a_reader_that_has_gone_is_met_without_a_word(folder, unbuffered):
    environment = {**os.environ, 'PYTHONUNBUFFERED': unbuffered}
    # click prints the help itself.
    command = '--help' if unbuffered else '--version'
    reading, writing = os.pipe()
    os.close(reading)
    ended = program(command, stdout=writing, env=environment)
    os.close(writing)
    assert (ended.returncode, ended.stderr) == (READER_GONE, '')


@pytest.mark.slow
def test_a_process_without_standard_output_ends_without_a_word():
    ended = program('--version', preexec_fn=lambda: os.close(1))
    assert (ended.returncode, ended.stderr) == (0, '')


@pytest.mark.parametrize('option', ['--out', '--json', '--html'])
def test_a_recording_is_not_replaced_by_what_is_made_of_it(folder, capsys, option):
    bag = folder / 'bag'
    bag.mkdir()
    for recording, name in ((Path('run.csv'), 'link'), (bag / 'bag_0.mcap', bag)):
        recording.touch()
        output = recording
        if name == 'link':
            output = folder / name
            os.link(recording, output)
            name = recording
        command = ['audit', str(name), '--robot', 'planar_2r', option, str(output)]
        assert main(command) == 2
        assert 'recording itself' in capsys.readouterr().err


def test_the_bag_of_an_audit_has_checksums(folder, capsys):
    pytest.importorskip('rosbags')
    from kinematics_service.apps.recordings.readers.bag_checks import UNNOTICED, checked

    assert main(['audit', 'run.csv', '--robot', 'planar_2r', '--out', 'made.mcap']) == 0
    capsys.readouterr()
    assert list(checked(Path('made.mcap'))) == []
    content = Path('made.mcap').read_bytes()
    # Data, index, and their checksums: none of them changes without a remark.
    for at in (*range(100, len(content) - 100, 2999), len(content) - 20):
        Path('changed.mcap').write_bytes(
            content[:at] + bytes([content[at] ^ 4]) + content[at + 1 :]
        )
        try:
            told = list(checked(Path('changed.mcap')))
        except Exception:
            continue  # no MCAP file any more
        assert told, at
        assert UNNOTICED not in str(told)


def test_a_bundled_robot_that_is_written_to_standard_output_is_whole(folder, capfd):
    assert main(['new', 'arm', '--from', 'craig_3r', '--out', '/dev/stdout', '--force']) == 0
    text = capfd.readouterr().out
    Path('arm.yaml').write_text(text[: text.rindex('wrote /dev/stdout')])
    assert ks.load_robot('arm.yaml').dof == 3
