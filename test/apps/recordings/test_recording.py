# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Recordings as CSV files: what is read, and what is refused in which words."""

import os
from threading import Thread

import numpy as np
import pytest
from arms import robot_of
from refusal import refused

from kinematics_service.apps.recordings.readers.recording import read_recording
from kinematics_service.errors import RecordingError

HEADER = 'stamp,position.q1,position.q2'


@pytest.fixture
def read(tmp_path):
    """Return a function that reads a recording of planar_2r from text or bytes."""
    file = tmp_path / 'motion.csv'

    def read(text):
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_recording(file, robot_of('planar_2r'))

    return read


def test_positions_and_stamps_are_those_of_the_file(read):
    recording = read(f'{HEADER}\n1700000000.123456789,0.5,-1e-3\n1700000000.133456789,0.6,2\n')
    assert recording.stamps.tolist() == [1700000000123456789, 1700000000133456789]
    assert recording.positions.tolist() == [[0.5, -1e-3], [0.6, 2.0]]
    assert recording.velocities is None
    assert recording.due == pytest.approx([0.0, 0.01], abs=1e-12)


def test_columns_come_in_any_order(read):
    recording = read(
        'velocity.q2, position.q2 ,velocity.q1,stamp,position.q1\n4,2,3,1,1\n8,6,7,2,5\n'
    )
    assert recording.positions.tolist() == [[1.0, 2.0], [5.0, 6.0]]
    assert recording.velocities is not None
    assert recording.velocities.tolist() == [[3.0, 4.0], [7.0, 8.0]]


@pytest.mark.parametrize(
    'text',
    [
        b'\xef\xbb\xbf' + HEADER.encode() + b'\n0,1,2\n',
        f'\n\n{HEADER}\n\n0,1,2\n,,\n\n',
        f'{HEADER}\r\n0,1,2\r\n',
        'stamp,"position.q1","position.q2"\n"0","1","2"',
    ],
    ids=['byte order mark', 'empty lines', 'line ends of Windows', 'quotes'],
)
def test_harmless_things_do_no_harm(read, text):
    recording = read(text)
    assert recording.stamps.tolist() == [0]
    assert recording.positions.tolist() == [[1.0, 2.0]]


UR = 'timestamp actual_q_0 actual_q_1 actual_qd_0 actual_qd_1 output_bit_registers0_to_31'


@pytest.mark.parametrize(
    'text',
    [
        'stamp;position.q1;position.q2;velocity.q1;velocity.q2\n7;0.25;-1.5;3;0.5\n',
        'velocity.q2\tposition.q1\tstamp\tvelocity.q1\tposition.q2\n0.5\t0.25\t7\t3\t-1.5\n',
        f'{UR}\n7 0.25 -1.5 3 0.5 12\n',
        'stamp,position.1,position.2,velocity.1,velocity.2,note\n7,0.25,-1.5,3,0.5,begin\n',
    ],
    ids=['semicolons', 'tabs', "UR's recorder", 'numbered joints and a note'],
)
def test_all_known_layouts_are_read(read, text):
    recording = read(text)
    assert recording.stamps.tolist() == [7_000_000_000]
    assert recording.positions.tolist() == [[0.25, -1.5]]
    assert recording.velocities is not None
    assert recording.velocities.tolist() == [[3.0, 0.5]]


def test_a_pipe_is_read_once(tmp_path):
    pipe = tmp_path / 'pipe'
    os.mkfifo(pipe)
    writer = Thread(target=pipe.write_text, args=(f'{HEADER}\n0,1,2\n1,3,4\n',))
    writer.start()
    recording = read_recording(pipe, robot_of('planar_2r'))
    writer.join()
    assert recording.positions.tolist() == [[1.0, 2.0], [3.0, 4.0]]


def test_a_step_back_in_time_takes_no_time(read):
    recording = read(f'{HEADER}\n10,0,0\n11,0,0\n5,0,0\n5,0,0\n6.5,0,0\n')
    assert recording.stamps.tolist() == [k * 10**9 for k in (10, 11, 5, 5)] + [6_500_000_000]
    assert recording.due.tolist() == [0.0, 1.0, 1.0, 1.0, 2.5]


@pytest.mark.parametrize(
    ('text', 'code', 'where', 'word'),
    [
        ('', 'empty', '', 'position.<joint>'),
        ('\n\n', 'empty', '', 'position.<joint>'),
        (f'{HEADER}\n', 'empty', '', 'header'),
        ('stamp,position.q1\n0,1\n', 'missing-column', '', "'position.q2'"),
        ('position.q1,position.q2\n0,1\n', 'missing-column', '', "'stamp'"),
        (f'{HEADER},velocity.q1\n0,1,2,3\n', 'missing-column', '', "'velocity.q2'"),
        (f'{HEADER},stamp\n', 'duplicate-name', '', "'stamp'"),
        (f'{HEADER}\n0,1,2\n\n0,one,2\n', 'not-a-number', "4: column 'position.q1'", "'one'"),
        (f'{HEADER}\n0,1,nan\n', 'not-finite', "2: column 'position.q2'", "'nan'"),
        (f'{HEADER}\n0,,2\n', 'not-a-number', "2: column 'position.q1'", 'empty cell'),
        (f'{HEADER}\n0,1\n', 'wrong-length', '2', '2 cells'),
        (f'{HEADER}\n0,1,2,3\n', 'wrong-length', '2', '4 cells'),
        (f'{HEADER}\nnow,1,2\n', 'not-a-time', "2: column 'stamp'", "'now'"),
        (f'{HEADER}\n-1,1,2\n', 'not-a-time', "2: column 'stamp'", '0 to 2147483648'),
        (f'{HEADER}\n1e300,1,2\n', 'not-a-time', "2: column 'stamp'", "'1e300'"),
        (b'\xff\xfe\x00\x01', 'encoding', '', 'UTF-8'),
    ],
)
def test_a_bad_recording_is_refused_with_line_and_column(read, tmp_path, text, code, where, word):
    with refused(RecordingError, code, word) as raised:
        read(text)
    assert str(raised.value).startswith(f'{tmp_path}/motion.csv:{where}')


def test_the_columns_that_are_accepted_are_listed(read, tmp_path):
    with refused(RecordingError, 'missing-column') as raised:
        read('stamp,position.q1\n0,1\n')
    assert str(raised.value) == (
        f"{tmp_path}/motion.csv: there is no column 'position.q2' for joint 'q2' of planar_2r; "
        "the header has 'stamp', 'position.q1'; accepted, separated by commas, semicolons, tabs "
        'or spaces: stamp in seconds, position.<joint> for every joint, and velocity.<joint> for '
        "all of them or none; or the columns of UR's RTDE recorder; joints of planar_2r: q1, q2"
    )


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with refused(RecordingError, 'missing-file', 'nothing.csv', '.csv'):
        read_recording(tmp_path / 'nothing.csv', robot_of('planar_2r'))
    with refused(RecordingError, 'unreadable', str(tmp_path)):
        read_recording(tmp_path, robot_of('planar_2r'))


def test_noise_is_read_or_refused_in_one_line(read):
    random = np.random.default_rng(1)
    refusals = []
    alphabet = np.frombuffer(b'stamp,position.q12\n"\'0-e;\xc3\xa9\x00\t ', dtype=np.uint8)
    for _ in range(300):
        noise = random.choice(alphabet, random.integers(1, 80)).tobytes()
        for text in (noise, f'{HEADER}\n'.encode() + noise):
            try:
                read(text)
            except RecordingError as refused:
                refusals.append(str(refused))
    assert len(refusals) > 300
    assert not any('\n' in refusal for refusal in refusals)
