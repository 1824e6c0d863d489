# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The status of a second source that is useless, silent, or of another arm."""

import time
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from rclpy.serialization import serialize_message
from second_source import NOMINAL, TRACKER, WatchedArm
from target_harness import pose_target

import kinematics_service as ks
from kinematics_service.apps.calibration.second_source import examined, frames_status
from kinematics_service.node import reference
from kinematics_service.node.parameters.settings import ReferenceLimits
from kinematics_service.robot.measures import Level

LIMITS = ReferenceLimits(0.004, 0.02, np.radians(0.5), np.radians(2.0))
SECOND = 1_000_000_000
START = 1000  # s


@pytest.mark.parametrize('still', [0, 30], ids=['moves', 'hardly moves at first'])
def test_poses_of_another_arm_are_an_error_that_names_it(still):
    arm = WatchedArm('ur3e', NOMINAL, TRACKER, np.random.default_rng(3))
    arm.true, file, known = arm.file, ks.load_robot('ur5e'), None
    poses = arm.poses(np.concatenate([arm.region(still, 0.02), arm.path(40)]))
    statuses = []
    for k in range(20, len(poses.q), 20):
        known = examined(file, LIMITS, known, poses.at(slice(k - 20, k)), [])
        statuses.append(frames_status(known, LIMITS))
    if not still:
        assert {one.level for one in statuses} == {Level.ERROR}
        assert not any('has moved' in one.sentence for one in statuses)
    assert 'the bundled robot ur3e leaves' in statuses[-1].sentence
    assert statuses[-1].level == Level.ERROR


class Watched:
    """A reference without a node, at a time that the test sets."""

    def __init__(self, monkeypatch):
        self.now, self.lines = 0.0, []
        monkeypatch.setattr(time, 'monotonic', lambda: self.now)
        log = SimpleNamespace(warning=self.lines.append, info=self.lines.append)
        topic = SimpleNamespace(topic_name='/tracker')
        node = SimpleNamespace(create_subscription=lambda *a, **k: topic, get_logger=lambda: log)
        robot = ks.load_robot('ur5e')
        self.reference = reference.Reference(node, lambda: robot, lambda: LIMITS)

    def run(self, seconds, shift=0.0, stamp=None, rate=20, source=True):
        """Send joint states and, after each, a pose; return the last status."""
        for _ in range(round(seconds * rate)):
            self.now += 1.0 / rate
            now = round((START + self.now) * SECOND)
            q = 0.4 + 0.3 * np.sin(self.now + np.arange(6))
            answer = SimpleNamespace(stamp=now, state=SimpleNamespace(q=q))
            self.reference.note(answer)
            if source:
                given = now + round(shift * SECOND) if stamp is None else stamp
                pose = ks.forward_kinematics(ks.load_robot('ur5e'), q)
                message = serialize_message(pose_target(pose, 'base', given))
                self.reference._on_pose(message)
            if round(self.now * rate) % rate == 0:
                status = self.reference.status_text()
                watch = self.reference.watch
                if watch and (thread := watch.thread):
                    thread.join()
        return status


@pytest.mark.parametrize(
    ('given', 'said'),
    [
        ({'shift': -3600.0}, 'stamps are 3600 s before'),
        ({'shift': 60.0}, 'stamps are 60 s after'),
        ({'stamp': 0}, f'stamps are {START + 8} s before'),
        ({'rate': 5, 'shift': -0.05}, 'within 0.1 s'),
    ],
)
def test_poses_that_cannot_be_used_are_a_warning_with_the_cause(monkeypatch, given, said):
    one = Watched(monkeypatch)
    assert one.run(4.0, **given).level == Level.OK
    status = one.run(4.0, **given)
    assert status.level == Level.WARN
    assert said in status.sentence


def test_a_source_that_falls_silent_is_a_warning_until_it_is_back(monkeypatch):
    one = Watched(monkeypatch)
    status = one.run(12.0)
    assert (status.level, 'no jump in' in status.sentence) == (Level.OK, True)
    status = one.run(8.0, source=False)
    assert status.level == Level.WARN
    assert status.sentence.startswith('no pose of the second source for 8 s')
    one.run(8.0, source=False)
    assert len([line for line in one.lines if 'no pose' in line]) == 1
    assert one.run(2.0).level == Level.OK


def test_joint_states_that_end_are_no_difference_of_clocks(monkeypatch):
    one = Watched(monkeypatch)
    one.run(12.0)
    monkeypatch.setattr(one.reference, 'note', lambda answer: None)
    assert one.run(10.0).level == Level.OK


def test_no_more_poses_are_counted_than_asked_for(monkeypatch):
    one = Watched(monkeypatch)
    one.run(12.0)
    one.reference.watch._examined = None
    assert one.reference.watch.status(LIMITS, '').sentence.startswith('20 of 20')
