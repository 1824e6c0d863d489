# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
An audit says what the node would have said, bit for bit, and what a person planted in a recording.
"""

import math

import numpy as np
import pytest
from arms import robot_of
from audits import SETTINGS, audited, blocks_of
from recordings import BEGIN, SECOND, awkward, motion, recorded, samples_of
from refusal import refused

from kinematics_service.apps.recordings.audit.auditing import AuditSettings, audit
from kinematics_service.apps.recordings.audit.curves import curve_of
from kinematics_service.apps.recordings.audit.ingest import Ingest, JointTimeout
from kinematics_service.apps.recordings.audit.report.document import document_of
from kinematics_service.apps.recordings.audit.verdict import verdict_of
from kinematics_service.apps.recordings.readers.open_file import open_source
from kinematics_service.apps.recordings.readers.source import Selection
from kinematics_service.errors import RecordingError
from kinematics_service.estimation import outcomes
from kinematics_service.estimation.estimator import Estimator, EstimatorOutput, EstimatorSettings
from kinematics_service.estimation.joint_state_columns import columns_of
from kinematics_service.estimation.status_text import singularity_status
from kinematics_service.kinematics.singularity import singularity_of
from kinematics_service.printing import json_text
from kinematics_service.robot.measures import MEASURES, Level


class Live:
    """What a node does with samples, one by one."""

    def __init__(self, samples, robot, settings=SETTINGS):
        self.estimator = Estimator(robot, settings)
        self.answers, self.singularities, self.levels, self.warnings = [], [], [], []
        started, stale = samples[0].arrival, False
        for sample in samples:
            late = sample.arrival - started > settings.timeout
            if late and not stale and (missing := self.estimator.joints.missing(sample.arrival)):
                stale = True
                if self.estimator.go_stale(sample.arrival):
                    self.warnings.append((len(self.answers), missing))
            answer = self.estimator.take(sample)
            if not isinstance(answer, EstimatorOutput):
                continue
            stale = False
            singularity = singularity_of(answer.state)
            level, say = self.estimator.judge(singularity, sample.arrival)
            if say:
                status_text = singularity_status(robot, singularity, level, robot.base_frame)
                self.warnings.append((len(self.answers), status_text))
            self.answers.append(answer)
            self.singularities.append(singularity)
            self.levels.append(level)


def assert_same(result, parts, live):
    """Check an audit against the node's own sequence of calls, without any tolerance."""
    timeline = result.timeline
    assert {k: n for k, n in result.counts.items() if n} == {
        k: n for k, n in live.estimator.counts.items() if n
    }
    assert timeline.stamps[:].tolist() == [answer.stamp for answer in live.answers]
    assert timeline.levels[:].tolist() == live.levels
    states = [answer.state for answer in live.answers]
    np.testing.assert_array_equal(timeline.q, [state.q for state in states])
    unknown = np.full(result.robot.dof, math.nan)
    qdot = [unknown if state.qdot is None else state.qdot for state in states]
    np.testing.assert_array_equal(timeline.qdot, qdot)
    sources = [answer.velocity_source == 'difference' for answer in live.answers]
    assert timeline.differenced[:].tolist() == sources
    np.testing.assert_array_equal(timeline.position, [state.position for state in states])
    quaternions = np.concatenate([part.quaternion_xyzw for part in parts])
    np.testing.assert_array_equal(
        quaternions, [answer.state.continuous_quaternion_xyzw for answer in live.answers]
    )
    jacobians = np.concatenate([part.state.jacobian for part in parts])
    np.testing.assert_array_equal(jacobians, [state.jacobian for state in states])
    series = document_of(result)['series']
    assert not series['thinned']
    np.testing.assert_array_equal(series['quaternion_xyzw'], quaternions)
    twists = [np.full(6, math.nan) if s.qdot is None else s.twist for s in states]
    np.testing.assert_array_equal(series['twist'], twists)
    for name in MEASURES:
        values = [getattr(singularity, name) for singularity in live.singularities]
        if values[0] is not None:
            np.testing.assert_array_equal(series[name], values)
    times = [s.time_to_warning for s in live.singularities]
    times = [math.nan if time is None else time for time in times]
    np.testing.assert_array_equal(series['time_to_warning'], times)
    assert len(timeline.warnings) == len(live.warnings)
    for one, (row, warning) in zip(timeline.warnings, live.warnings):
        assert one.row == row
        if isinstance(warning, tuple):
            assert one.status_text.level == Level.STALE
            assert all(name in one.status_text.sentence for name in warning)
        else:
            assert one.status_text == warning


# The same as the node


@pytest.mark.slow
@pytest.mark.parametrize(
    'name', ['planar_2r', 'parallelogram_left', 'scara_hsr065', 'puma560', 'panda']
)
def test_an_awkward_stream_gives_what_the_node_says(name):
    robot = robot_of(name)
    samples = awkward(robot)
    result, parts = audited(samples, robot)
    live = Live(samples, robot)
    assert result.counts[outcomes.RESETS] == 1
    assert len(result.counts) >= 7
    assert_same(result, parts, live)


@pytest.mark.parametrize('source', ['message', 'difference'])
def test_each_source_of_velocities_gives_what_the_node_says(source):
    robot, settings = robot_of('craig_3r'), EstimatorSettings('', source, SECOND // 2)
    samples = awkward(robot, 3)
    result, parts = audited(samples, robot, settings)
    assert_same(result, parts, Live(samples, robot, settings))


def test_columns_and_single_messages_are_the_same(monkeypatch):
    robot = robot_of('kinova_gen3')  # joints without limits: differences take the shortest angle
    t, q, qdot = motion(robot, 120, 20.0)
    q = (3.0 * q + math.pi) % math.tau - math.pi
    samples = samples_of(robot, t, q, np.zeros((120, 0)))
    fast, parts = audited(samples, robot)
    monkeypatch.setattr('kinematics_service.apps.recordings.audit.ingest.MIN_RUN', 10**9)
    slow, _ = audited(samples, robot)
    np.testing.assert_array_equal(fast.timeline.qdot, slow.timeline.qdot)
    assert np.all(np.isfinite(fast.timeline.qdot[1:]))
    assert_same(fast, parts, Live(samples, robot))


@pytest.mark.slow
def test_blocks_of_any_size_are_the_same(monkeypatch):
    robot = robot_of('planar_2r')
    samples = awkward(robot, 5)
    live = Live(samples, robot)
    for size in (1, 2, 7, 50):
        monkeypatch.setattr('audits.LARGEST_BLOCK', size)
        assert_same(*audited(samples, robot), live)


@pytest.mark.parametrize('bag', ['rad_ur3e_mcap', 'rad_ur3e_sqlite3'])
def test_a_real_recording_gives_what_the_node_says(bag):
    path, robot = recorded(f'derived_ros2_bags/{bag}'), robot_of('ur3e')
    result, parts, samples = _of_bag(path, robot)
    assert len(samples) == 225
    assert_same(result, parts, Live(samples, robot))
    (interval,) = result.intervals
    assert [one.name for one in interval.factors] == ['wrist', 'shoulder']
    assert interval.level == Level.ERROR
    assert result.timeline.messages[interval.worst] == 92  # where sigma_min is 2.3e-5


def _of_bag(path, robot):
    pytest.importorskip('rosbags', reason='needs rosbags')
    samples, parts = [], []
    with open_source(path, Selection(robot)) as source:
        for block in source.blocks:
            samples += [block.sample(k) for k in range(len(block))]
    with open_source(path, Selection(robot)) as source:
        result = audit(source, robot, path.name, AuditSettings(SETTINGS), write=parts.append)
    return result, parts, samples


@pytest.mark.parametrize('bag', ['C-Shape-1_joints', 'ptp-trajectory'])
def test_messages_without_stamps_give_what_the_node_says(bag):
    path = recorded(f'dmp_ros1_bags_malformed/{bag}.bag')
    robot = robot_of('kuka_iiwa14')
    result, parts, samples = _of_bag(path, robot)
    assert_same(result, parts, Live(samples, robot))
    text = ' '.join(sentence.text for sentence in verdict_of(result))
    assert '150 messages without stamp' in text
    assert ('may be in degrees' in text) == (bag == 'ptp-trajectory')


def test_the_columns_of_a_bag_are_its_messages():
    rosbags = pytest.importorskip('rosbags.highlevel', reason='needs rosbags')
    with rosbags.AnyReader([recorded('derived_ros2_bags/rad_ur3e_mcap')]) as reader:
        wanted = [c for c in reader.connections if c.topic == '/joint_states']
        raws = [raw for _, _, raw in reader.messages(wanted)]
        messages = [reader.deserialize(raw, wanted[0].msgtype) for raw in raws]
    columns = columns_of(raws)
    assert np.all(columns.alike)
    assert columns.names == tuple(messages[0].name)
    np.testing.assert_array_equal(columns.positions, [m.position for m in messages])
    np.testing.assert_array_equal(columns.velocities, [m.velocity for m in messages])
    stamps = [m.header.stamp.sec * SECOND + m.header.stamp.nanosec for m in messages]
    assert columns.stamps.tolist() == stamps
    # Another name of the same length is another message.
    raws[7] = raws[7].replace(b'wrist_1', b'wrist_9')
    assert np.flatnonzero(~columns_of(raws).alike).tolist() == [7]
    assert columns_of([raws[0][:-3]]) is None


# Findings


def test_a_start_that_is_reported_three_messages_late_is_no_jump():
    robot = robot_of('ur5e')
    t, late = 0.02 * np.arange(300), 3
    qdot = np.zeros((300, 6))
    qdot[100:, 2] = 1.5
    q = np.cumsum(qdot, axis=0) * 0.02
    told = np.roll(qdot, late, axis=0)
    result, _ = audited(samples_of(robot, t, q, told), robot)
    assert not result.jumps
    q[200:, 2] += 0.3
    (jump,) = audited(samples_of(robot, t, q, told), robot)[0].jumps
    assert jump.row == 200


def test_planted_faults_of_a_stream_are_found():
    robot = robot_of('ur5e')
    t, q, qdot = motion(robot, 1000, 100.0)
    q[500:, 2] += 0.2  # a jump
    qdot[:, 1] *= math.degrees(1.0)  # degrees a second
    qdot[:, 3] *= -1.0
    samples = samples_of(robot, t, q, qdot)
    del samples[300:340]  # a gap of 0.41 s
    samples.insert(700, samples[699])
    turned = samples[800]
    samples[800] = turned._replace(
        names=turned.names[::-1],
        positions=turned.positions[::-1],
        velocities=turned.velocities[::-1],
    )
    result, _ = audited(samples, robot)
    (gap,) = result.stream.gaps
    assert gap.seconds == pytest.approx(0.41)
    assert gap.message == 300
    (jump,) = result.jumps
    assert jump.joint == robot.joint_names[2]
    assert jump.step == pytest.approx(0.2, abs=0.05)
    assert result.stream.repeated == result.stream.identical == 1
    assert result.stream.changes_of_order == 2
    assert result.stream.orders == 2
    checks = [joint.check for joint in result.joints]
    assert checks[1].scale == pytest.approx(math.degrees(1.0), rel=0.05)
    assert checks[3].scale == pytest.approx(-1.0, rel=0.05)
    assert checks[0].rms < 1e-3 < checks[3].rms
    sentences = [sentence.text for sentence in verdict_of(result)]
    assert any(': degrees?' in text for text in sentences)
    assert any(': wrong sign' in text for text in sentences)


@pytest.mark.parametrize('lag', [0.03, -0.02])
def test_late_velocities_are_found(lag):
    robot = robot_of('puma560')
    t, q, _ = motion(robot, 800, 100.0)
    _, _, late = motion(robot, 801, 100.0)
    steps = round(lag * 100)
    late = np.roll(late[:800], steps, axis=0)
    late[: max(steps, 0)] = late[max(steps, 0)]
    late[800 + min(steps, 0) :] = late[799 + min(steps, 0)]
    result, _ = audited(samples_of(robot, t, q, late), robot)
    for joint in result.joints:
        assert joint.check.lag == pytest.approx(lag, abs=3e-3)


@pytest.mark.parametrize(('reach', 'compared'), [(5.0, False), (50.0, True)])
def test_a_way_of_a_few_jitters_is_no_motion_to_compare(reach, compared):
    # A fast tremor is surely a motion; where it goes no farther than a few jitters of a position,
    # nothing can be said of what the joint reports.
    robot, jitter, turning = robot_of('planar_2r'), 1e-4, 20.0
    t = np.arange(4000) / 100.0
    truth = reach * jitter * np.sin(turning * t)
    q = np.zeros((len(t), 2))
    q[:, 0] = truth + np.random.default_rng(6).normal(0.0, jitter, len(t))
    qdot = np.zeros_like(q)
    qdot[:, 0] = 3.0 * turning * reach * jitter * np.cos(turning * t)
    result, _ = audited(samples_of(robot, t, q, qdot), robot)
    assert (result.joints[0].check is not None) == compared


def test_limits_that_are_touched_are_told():
    robot = robot_of('puma560')
    t, q, qdot = motion(robot, 300, 100.0)
    q[100:110, 0] = robot.limits[0, 1] + 0.1
    q[200:203, 1] = robot.limits[1, 0] + 1e-3
    result, _ = audited(samples_of(robot, t, q, qdot), robot)
    first, second, *_ = result.joints
    assert first.beyond == 10
    assert first.worst_beyond == pytest.approx(0.1)
    assert (second.beyond, second.touching) == (0, 3)
    text = ' '.join(sentence.text for sentence in verdict_of(result))
    assert f'Beyond its limits: {robot.joint_names[0]}.' in text


def test_intervals_are_those_of_the_levels():
    robot = robot_of('ur5e')
    t, q, qdot = motion(robot, 1200, 50.0, 4)
    result, _ = audited(samples_of(robot, t, q, qdot), robot)
    levels = result.timeline.levels[:]
    inside = np.zeros(len(levels), dtype=bool)
    for interval in result.intervals:
        span = slice(interval.first, interval.last + 1)
        assert np.all(levels[span] > 0)
        assert not np.any(inside[span])
        inside[span] = True
        assert interval.level == max(levels[span])
        worst = result.timeline.measures['distance'][span]
        assert interval.value == worst.min() == worst[interval.worst - interval.first]
        assert interval.begin == result.timeline.t[interval.first]
        assert interval.seconds == pytest.approx(
            0.02 * (interval.last - interval.first + 1), abs=0.021
        )
    assert len(result.intervals) > 3
    np.testing.assert_array_equal(inside, levels > 0)


def test_a_thinned_curve_keeps_every_spike_however_it_is_read(monkeypatch):
    random = np.random.default_rng(0)
    values = random.normal(size=200_000)
    spikes = random.choice(200_000, 50, replace=False)
    values[spikes] = random.choice([-99.0, 99.0], 50)
    values[150_000:150_010] = math.nan
    breaks = np.zeros(200_000, dtype=bool)
    breaks[100_000] = True
    t = np.linspace(0.0, 1000.0, 200_000)

    def thinned(size):
        spans = [slice(k, k + size) for k in range(0, 200_000, size)]
        return curve_of('a', 'c0', 1000.0, ((t[s], values[s], breaks[s]) for s in spans))

    whole = thinned(200_000)
    assert len(whole.t) < 4000
    assert np.all(np.diff(whole.t) > 0)
    assert np.isin(whole.t[whole.begins], t[[0, 100_000, 150_010]]).all()
    column = np.minimum(t * 0.8, 799).astype(int)
    kept_column = np.minimum(whole.t * 0.8, 799).astype(int)
    for k in range(0, 800, 7):
        own, kept = values[column == k], whole.values[kept_column == k]
        assert (kept.min(), kept.max()) == (np.nanmin(own), np.nanmax(own))
    monkeypatch.setattr('kinematics_service.apps.recordings.audit.curves.MAX_HELD_POINTS', 5000)
    for size in (777, 30_000):
        curve = thinned(size)
        np.testing.assert_array_equal(curve.t, whole.t)
        np.testing.assert_array_equal(curve.values, whole.values)
        np.testing.assert_array_equal(curve.begins, whole.begins)


def test_the_document_is_strict_json_with_everything_in_it():
    import json

    robot = robot_of('ur3e')
    result, _ = audited(awkward(robot), robot)
    document = json.loads(json_text(document_of(result)))
    assert document['messages']['states'] == len(result.timeline)
    assert len(document['series']['t']) == len(result.timeline)
    assert document['series']['q'][3] == result.timeline.q[3].tolist()
    assert document['verdict'][0]['sentence'].startswith('The arm ')
    assert {interval['level'] for interval in document['intervals']} <= {'WARN', 'ERROR'}
    assert len(document['warnings']) == len(result.timeline.warnings)


def test_no_state_is_a_sentence_that_names_both_sides():
    robot = robot_of('ur5e')
    t, q, qdot = motion(robot, 20)
    other = samples_of(robot, t, q, qdot, names=[f'a{k}' for k in range(6)])
    with refused(RecordingError, 'missing-joint', 'made_up: /joint_states', 'ur5e', 'a0, a1'):
        audited(other, robot)
    half = [
        sample._replace(names=sample.names[:3], positions=[0.0] * 3)
        for sample in samples_of(robot, t, q, qdot)
    ]
    with refused(RecordingError, 'no-states', '20 waiting'):
        audited(half, robot)
    with refused(RecordingError, 'empty', '/joint_states'):
        audited([], robot)


def test_a_joint_times_out_after_its_last_message():
    robot = robot_of('planar_2r')
    samples = samples_of(robot, np.array([0.0, 0.01, 0.02, 3.0, 3.01]), *np.ones((2, 5, 2)))
    ingest = Ingest(robot, Estimator(robot, SETTINGS))
    (known,) = map(ingest.take, blocks_of(samples))
    (timeout,) = known.timeouts.items()
    moment = samples[2].arrival + SETTINGS.timeout
    assert timeout == (3, JointTimeout(moment, robot.joint_names))


def test_the_estimator_is_left_as_the_messages_alone_would_leave_it():
    robot = robot_of('ur5e')
    t, q, qdot = motion(robot, 100)
    samples = samples_of(robot, t, q, qdot)
    one, other = Estimator(robot, SETTINGS), Estimator(robot, SETTINGS)
    ingest = Ingest(robot, one)
    for block in blocks_of(samples[:90]):
        ingest.take(block)
    for sample in samples[:90]:
        other.accept(sample)
    assert one.counts == other.counts
    for sample in samples[90:]:
        bare = sample._replace(velocities=[])
        ours, theirs = one.accept(bare), other.accept(bare)
        np.testing.assert_array_equal(ours.qdot, theirs.qdot)
        np.testing.assert_array_equal(ours.q, theirs.q)
    assert samples[0].stamp + 1 > BEGIN
