# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""A subscription that is replaced: when it ends, what it lost, and what is passed over of it."""

from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from rclpy.qos import QoSProfile, ReliabilityPolicy

from kinematics_service.node import best_subscription
from kinematics_service.node.best_subscription import _CountedSubscription
from kinematics_service.node.process import passed_over


def test_the_executor_lets_go_of_a_subscription_before_it_is_destroyed():
    done, tasks = [], []
    subscription = SimpleNamespace(destroy=lambda: done.append('destroyed'))
    executor = SimpleNamespace(wake=lambda: done.append('woken'), create_task=tasks.append)
    node = SimpleNamespace(_subscriptions=[subscription], executor=executor)
    one = SimpleNamespace(_node=node, subscription=subscription)
    _CountedSubscription.end(one, lambda: done.append('then'))
    assert node._subscriptions == []
    # It is woken to look at the node anew; only its next tasks destroy and go on.
    assert done == ['woken']
    for expected in (['woken', 'destroyed'], ['woken', 'destroyed', 'then']):
        tasks.pop(0)()
        assert done == expected


class _Node:
    # What a subscription asks of its node.

    executor = None

    def __init__(self):
        self.subscriptions = self._subscriptions = []

    def create_subscription(self, kind, topic, callback, qos, **options):
        one = SimpleNamespace(callback=callback, topic_name=topic, destroy=lambda: None)
        one.get_publisher_count = lambda: 1
        self.subscriptions.append(one)
        return one


def test_lost_messages_are_counted_once_while_two_subscriptions_hear_them(monkeypatch):
    monkeypatch.setattr(best_subscription, 'take_waiting', lambda *_: ((), 0))
    qos, counts = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE), []
    one = best_subscription.BestSubscription(_Node(), None, 'joint_states', qos, lambda data: None)

    def send(*numbers):
        # Each to all subscriptions that are there.
        for number in numbers:
            for subscription in list(one._node.subscriptions):
                info = {'publication_sequence_number': number, 'source_timestamp': number}
                subscription.callback(b'', info)
            counts.append(one.lost)

    send(1, 4)
    one.fit(100_000)  # a shorter queue: the next message opens its subscription
    send(5)
    assert len(one._node.subscriptions) == 2
    send(6)
    assert len(one._node.subscriptions) == 1
    send(9, 11)
    assert counts == [0, 2, 2, 2, 4, 5]
    assert not one.lost_is_lower_bound


def test_messages_that_are_passed_over_are_not_kept(monkeypatch):
    monkeypatch.setattr(passed_over, 'take_waiting', lambda *_: ((), 0))
    answered, tasks, left_out = [], [], []
    executor = SimpleNamespace(wake=lambda: None, create_task=tasks.append)
    given = {'callback': answered.append, '_callback': answered.append, '_callback_type': 0}
    ends, stays = SimpleNamespace(**given), SimpleNamespace(**given)
    node = SimpleNamespace(subscriptions=[ends, stays])
    node._subscriptions = node.subscriptions
    kept = passed_over.PassedOver(executor, [node], left_out.append)._passed.copy()
    node.subscriptions.remove(ends)
    for one in (ends, *[stays] * 12):
        one._callback(b'large')
    while tasks:
        tasks.pop(0)()
    assert (len(answered), left_out) == (passed_over.KEPT_OF_FULLEST, [2])
    assert node.subscriptions == [stays]
    assert [len(one._newest) for one in kept] == [0, 0]
    ends._callback(b'to what listened before')
    assert len(answered) == passed_over.KEPT_OF_FULLEST + 1
