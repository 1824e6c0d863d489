# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""A node without the app that compares poses says what to run instead."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from rclpy.serialization import serialize_message
from target_harness import pose_target

import kinematics_service as ks
from kinematics_service.node import reference
from kinematics_service.node.parameters.settings import ReferenceLimits
from kinematics_service.robot.measures import Level

LIMITS = ReferenceLimits(0.004, 0.02, np.radians(0.5), np.radians(2.0))


def test_poses_of_a_second_source_are_refused_with_the_command_that_compares_them(monkeypatch):
    monkeypatch.setattr(reference, 'app_module', lambda task: None)
    topic = SimpleNamespace(topic_name='/tracker')
    node = SimpleNamespace(create_subscription=lambda *a, **k: topic)
    robot = ks.load_robot('ur5e')
    one = reference.Reference(node, lambda: robot, lambda: LIMITS)
    assert one.status_text() is None
    pose = ks.forward_kinematics(robot, np.full(6, 0.3))
    one._on_pose(serialize_message(pose_target(pose, 'base', 10**9)))
    one.note(SimpleNamespace(stamp=10**9, state=SimpleNamespace(q=np.full(6, 0.3))))
    status = one.status_text()
    assert status.level == Level.WARN
    assert status.sentence.startswith('pose of /tracker refused: ')
    assert '`kinematics_service audit`' in status.sentence
