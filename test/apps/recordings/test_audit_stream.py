# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""An audit that reads its states in pieces says the same, and several of them at once do, too."""

import functools
import json
import math

import numpy as np
import pytest
from arms import robot_of
from audits import JOINT_STATE, audited, blocks_of, document, joint_states, refusal, run, write_bag
from recordings import BEGIN, SECOND, awkward, motion, samples_of

from kinematics_service.apps.recordings.audit.report.document import document_of
from kinematics_service.apps.recordings.audit.report.page import page_of
from kinematics_service.apps.recordings.audit.stream import StreamWatch
from kinematics_service.apps.recordings.readers import stored_columns
from kinematics_service.estimation.joint_state_columns import columns_of
from kinematics_service.estimation.motion_checks import joint_steps
from kinematics_service.printing import json_text
from kinematics_service.robot.measures import Level

# Sums of squares in other pieces.
ROUND_OFF = 1e-12


def faulty(robot):
    """Return samples in which much is wrong, also over long intervals and at their ends."""
    t, q, qdot = motion(robot, 2500, 100.0, 3)
    random = np.random.default_rng(2)
    t = t + np.cumsum(random.choice([0.0, 1e-3, 0.5], 2500, p=[0.9, 0.09, 0.01]))
    q[700:, 1] += 0.3
    qdot[:, 0] = np.roll(qdot[:, 0], 4)
    qdot[:, 2] *= -1.0
    qdot[900:1200] = np.nan
    samples = samples_of(robot, t, q, qdot)
    samples[40] = samples[39]
    for k in range(1500, 1510):
        samples[k] = samples[k]._replace(stamp=0)
    for k in range(2000, 2500):
        samples[k] = samples[k]._replace(stamp=samples[k].stamp - 9 * SECOND)
    return samples


@pytest.mark.slow
def test_columns_on_disk_change_no_bit(monkeypatch):
    robot = robot_of('kinova_gen3')
    for samples in (faulty(robot)[1450:1650], awkward(robot, 6)[60:160]):
        whole, _ = audited(samples, robot)
        expected = json_text(document_of(whole)), page_of(whole)
        monkeypatch.setattr(stored_columns, 'MAX_HELD_NUMBERS', 100)
        monkeypatch.setattr('kinematics_service.apps.recordings.readers.block.LARGEST_BLOCK', 77)
        written, _ = audited(samples, robot)
        assert (json_text(document_of(written)), page_of(written)) == expected
        monkeypatch.undo()


def almost(found, expected):
    """Check that two documents are the same but for the rounding of sums."""
    assert type(found) is type(expected)
    if isinstance(found, dict):
        assert list(found) == list(expected)
        for key in found:
            almost(found[key], expected[key])
    elif isinstance(found, list):
        assert len(found) == len(expected)
        for pair in zip(found, expected):
            almost(*pair)
    elif isinstance(found, float):
        assert found == pytest.approx(expected, rel=ROUND_OFF, abs=ROUND_OFF)
    else:
        assert found == expected


@functools.cache
def in_one_piece(name, first, last):
    whole, _ = audited(faulty(robot_of(name))[first:last], robot_of(name))
    return json.loads(json_text(document_of(whole))), page_of(whole)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('name', 'size', 'first', 'last'),
    # Each piece takes its time: of the small ones those around a repeated message, a jump, a lag.
    [
        *(('ur5e', 1, 0, 40), ('ur5e', 31, 500, 1250)),
        *(('kinova_gen3', 1, 690, 710), ('kinova_gen3', 100, 1480, 2030)),
    ],
)
def test_pieces_of_any_size_give_the_same_verdict(name, size, first, last, monkeypatch):
    robot = robot_of(name)
    samples = faulty(robot)[first:last]
    expected, page = in_one_piece(name, first, last)
    checks = [joint['check'] for joint in expected['joints']]
    if (name, size) == ('ur5e', 31):
        assert any(check['lag'] for check in checks)
        assert any(check['scale'] != 1.0 for check in checks)
    monkeypatch.setattr(stored_columns, 'MAX_PIECE_ROWS', size)
    monkeypatch.setattr(stored_columns, 'MAX_HELD_NUMBERS', 3 * size)
    pieces, _ = audited(samples, robot)
    found = json.loads(json_text(document_of(pieces)))
    assert found['verdict'] == expected['verdict']
    almost(found, expected)
    assert page_of(pieces) == page


def test_a_median_of_pieces_is_that_of_all(monkeypatch):
    random = np.random.default_rng(1)
    for numbers in (
        random.normal(size=2001),
        np.full(1500, 1e6),
        1_000_000 + random.integers(-2, 3, 1800),
        np.exp(20.0 * random.normal(size=1777)),
        np.repeat([-1.5, 2.5e100], 700),
        np.array([3]),
    ):
        expected = np.median(numbers)
        for size in (5, 900, 5000):
            monkeypatch.setattr(stored_columns, 'MAX_HELD_NUMBERS', size)
            pieces = [numbers[k : k + 97] for k in range(0, len(numbers), 97)]
            assert stored_columns.median(pieces) == expected
    assert stored_columns.median([]) == 0.0


@pytest.mark.parametrize('size', [1, 3, 1000])
def test_turns_are_neither_jumps_nor_velocities_in_pieces_of_any_size(size, monkeypatch):
    robot = robot_of('kinova_gen3')
    assert robot.continuous[0]
    t = 0.01 * np.arange(400)
    q, qdot = np.zeros((400, robot.dof)), np.zeros((400, robot.dof))
    q[:, 0] = np.mod(1.2 * t + 2.5 + math.pi, math.tau) - math.pi
    q[250:, 0] += 0.2
    qdot[:, 0] = -1.2 - 0.01 * np.sin(t)
    monkeypatch.setattr(stored_columns, 'MAX_PIECE_ROWS', size)
    result, _ = audited(samples_of(robot, t, q, qdot), robot)
    (jump,) = result.jumps
    assert (jump.row, jump.joint) == (250, robot.joint_names[0])
    assert jump.step == pytest.approx(0.212, abs=1e-6)
    assert result.joints[0].check.scale == pytest.approx(-1.0, abs=0.1)


def test_the_steps_of_a_joint_that_wraps_are_the_shortest():
    q = np.random.default_rng(3).uniform(-4.0, 4.0, 1000)
    np.testing.assert_allclose(joint_steps(q, True), np.diff(np.unwrap(q)), atol=1e-12)
    np.testing.assert_array_equal(joint_steps(q, False), np.diff(q))


def test_gaps_are_counted_across_blocks_and_pieces(monkeypatch):
    robot = robot_of('planar_2r')
    samples = samples_of(robot, *motion(robot, 600))
    del samples[100:140], samples[300:420]
    monkeypatch.setattr(stored_columns, 'MAX_PIECE_ROWS', 50)
    watch = StreamWatch(robot.joint_names)
    for block in blocks_of(samples):
        watch.take(block)
    stream = watch.stream()
    assert [gap.message for gap in stream.gaps] == [100, 300]
    assert [gap.seconds for gap in stream.gaps] == pytest.approx([0.41, 1.21])
    assert stream.median_interval == 0.01


# Several at once


@pytest.fixture
def tables(tmp_path):
    """Return tables of a motion that keeps away from singular poses, and of one that does not."""
    files = []
    for name, elbow in (('safe', (1.0, 2.0)), ('close', (1.0, -1.0)), ('again', (0.5, 2.0))):
        q2 = np.linspace(*elbow, 100).tolist()
        rows = [f'{1.7e9 + 0.01 * k!r},0.2,{q2[k]!r}' for k in range(100)]
        files.append(tmp_path / f'{name}.csv')
        files[-1].write_text('\n'.join(['stamp,position.q1,position.q2', *rows]))
    return files


@pytest.mark.slow
@pytest.mark.parametrize('jobs', [1, 2])
def test_each_of_several_recordings_has_its_verdict(tables, tmp_path, capsys, jobs):
    robot = ('--robot', 'planar_2r')
    alone = [document(capsys, file, *robot) for file in tables]
    pages, data = tmp_path / 'pages', tmp_path / 'data'
    options = [*robot, '--html', pages, '--json', data, '--fail-on', 'stop']
    files = [tables[0], tmp_path / 'none.csv', *tables[1:]]
    code, out, err = run(capsys, *files, *options, '--jobs', jobs)
    assert code == 1
    assert err.strip().startswith(f'{files[1]}: there is no such file; ')
    assert len(err.splitlines()) == 1
    headings = [line for line in out.splitlines() if ': table, ' in line]
    assert [line.split(':')[0] for line in headings] == [str(file) for file in tables]
    for file, expected in zip(tables, alone):
        assert json.loads((data / f'{file.stem}.json').read_text()) == expected
        assert f'Audit of {file.name}' in (pages / f'{file.stem}.html').read_text()
    good = run(capsys, tables[0], tables[2], *robot, '--fail-on', 'stop')
    assert good[0] == 0


@pytest.mark.slow
def test_several_recordings_need_folders_and_names_of_their_own(tables, tmp_path, capsys):
    pytest.importorskip('distributed', reason='needs dask[distributed]')

    def wrong(*argv):
        code, _, err = run(capsys, *argv, '--robot', 'planar_2r')
        assert code == 2
        return ' '.join(err.split())

    assert 'folder for 3' in wrong(*tables, '--json', '-')
    assert f'--html: {tables[0]} is a file' in wrong(*tables, '--html', tables[0])
    other = tmp_path / 'sub'
    other.mkdir()
    (other / 'safe.csv').write_text(tables[0].read_text())
    assert 'would both be' in wrong(tables[0], other / 'safe.csv', '--json', tmp_path / 'data')
    assert '--jobs: 0 ' in wrong(tables[0], '--jobs', '0')
    assert '--jobs or --out' in wrong(tables[0], '--jobs', 2, '--workers', 'dask://a:1')
    nobody = ('--workers', 'dask://127.0.0.1:9')
    assert 'no dask scheduler' in refusal(capsys, *tables, '--robot', 'planar_2r', *nobody)


# What a flaw would change in silence


def test_messages_that_name_other_joints_are_read_with_their_own_names(store):
    robot = robot_of('planar_2r')
    samples = samples_of(robot, *motion(robot, 12))
    # The same length and the same numbers; the names change places.
    samples[5] = samples[5]._replace(names=samples[5].names[::-1])
    raws = [
        bytes(store.serialize_cdr(message, JOINT_STATE))
        for *_, message in joint_states(store, samples)
    ]
    assert len({len(raw) for raw in raws}) == 1
    assert np.flatnonzero(~columns_of(raws).alike).tolist() == [5]


def test_joints_that_change_places_in_a_bag_are_matched_by_name(tmp_path, capsys, store):
    robot = robot_of('planar_2r')
    t, q, qdot = motion(robot, 40)
    samples = samples_of(robot, t, q, qdot)
    for k in range(20, 30):
        one = samples[k]
        samples[k] = one._replace(
            names=one.names[::-1],
            positions=one.positions[::-1],
            velocities=one.velocities[::-1],
        )
    bag = write_bag(tmp_path / 'bag', store, joint_states(store, samples))
    found = document(capsys, bag, '--robot', 'planar_2r')
    assert found['series']['q'] == q.tolist()
    assert found['stream']['changes_of_order'] == 2


def test_a_state_holds_until_the_next_one():
    robot = robot_of('planar_2r')
    # Unequal times between messages; at stop are the 3rd and the 4th.
    stamps = np.array([0.0, 0.1, 0.3, 0.7, 1.5, 1.6, 1.8])
    elbow = np.array([1.0, 0.05, 0.02, 0.01, 0.06, 1.0, 1.1])
    q = np.column_stack([np.zeros(7), elbow])
    result, _ = audited(samples_of(robot, stamps, q, np.zeros((7, 0))), robot)
    (interval,) = result.intervals
    assert (interval.first, interval.last, interval.level) == (1, 4, Level.ERROR)
    assert interval.stopped == pytest.approx(0.4 + 0.8)
    assert interval.seconds == pytest.approx(1.5)


def test_a_joint_beyond_its_limit_does_not_touch_it():
    robot = robot_of('puma560')
    t, q, qdot = motion(robot, 300, 100.0)
    lower, upper = robot.limits[0]
    q[:, 0] = np.linspace(0.5 * lower, 0.5 * upper, 300)
    q[50:54, 0] = upper + 2e-3
    q[90:96, 0] = upper - 1e-3
    q[99, 0] = lower
    result, _ = audited(samples_of(robot, t, q, qdot), robot)
    assert (result.joints[0].beyond, result.joints[0].touching) == (4, 7)
    assert BEGIN > 0


def test_an_interval_ends_with_its_last_message_where_nothing_comes_after_it():
    robot = robot_of('planar_2r')
    # Near the elbow's singular pose: alone after a silence, and until a silence begins.
    t = np.array([0.0, 0.1, 0.2, 0.3, 5.0, 5.1, 9.0, 9.1, 9.2])
    near = np.array([0, 1, 1, 1, 1, 0, 1, 1, 1])
    q = np.column_stack([np.zeros(9), np.where(near, 0.001, 1.2)])
    result, _ = audited(samples_of(robot, t, q, np.zeros((9, 2))), robot)
    found = [(one.first, one.last, one.begin, one.end) for one in result.intervals]
    begin = result.timeline.t[0]
    # It lasts until the next message, if that comes in time; else to its own last one.
    expected = [(1, 3, 0.1, 0.3), (4, 4, 5.0, 5.1), (6, 8, 9.0, 9.2)]
    assert [one[:2] for one in found] == [one[:2] for one in expected]
    np.testing.assert_allclose(
        [one[2:] for one in found], np.array([one[2:] for one in expected]) + begin, atol=1e-9
    )


def test_an_interval_of_a_message_after_a_silence_lasts_until_the_next():
    robot = robot_of('planar_2r')
    t = np.array([0.0, 0.1, 5.0, 5.1, 5.3])
    q = np.column_stack([np.zeros(5), [1.2, 1.2, 0.001, 0.001, 1.2]])
    result, _ = audited(samples_of(robot, t, q, np.zeros((5, 2))), robot)
    (interval,) = result.intervals
    assert interval.seconds == pytest.approx(0.3, abs=1e-9)


def test_delays_are_those_between_stamp_and_receipt_of_the_stamped():
    robot = robot_of('planar_2r')
    samples = samples_of(robot, *motion(robot, 40))
    delays = [20_000_000 + 1_000_000 * (k % 3) for k in range(40)]
    delays[7] = 350_000_000
    samples = [
        one._replace(received=one.stamp + delay, arrival=one.stamp + delay)
        for one, delay in zip(samples, delays)
    ]
    samples[11] = samples[11]._replace(stamp=0)
    watch = StreamWatch(robot.joint_names)
    for block in blocks_of(samples):
        watch.take(block)
    stream = watch.stream()
    assert stream.delay_median == pytest.approx(0.021, abs=1e-12)
    assert stream.delay_longest == pytest.approx(0.35, abs=1e-12)
    assert stream.unstamped == 1
