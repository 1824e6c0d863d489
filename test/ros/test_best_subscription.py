"""A subscription that is replaced ends only when the executor has let go of it."""

from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from kinematics_service.ros.node.best_subscription import _Numbered


def test_the_executor_lets_go_of_a_subscription_before_it_is_destroyed():
    done, tasks = [], []
    subscription = SimpleNamespace(destroy=lambda: done.append('destroyed'))
    executor = SimpleNamespace(wake=lambda: done.append('woken'), create_task=tasks.append)
    node = SimpleNamespace(_subscriptions=[subscription], executor=executor)
    one = SimpleNamespace(_node=node, subscription=subscription)
    _Numbered.end(one, lambda: done.append('then'))
    assert node._subscriptions == []
    # It is woken to look at the node anew; only its next tasks destroy and go on.
    assert done == ['woken']
    for expected in (['woken', 'destroyed'], ['woken', 'destroyed', 'then']):
        tasks.pop(0)()
        assert done == expected
