"""Joint efforts: the bias is the mean of the last messages, and of none before a gap."""

import numpy as np

from kinematics_service.estimation.joint_efforts import AVERAGED, JointEfforts
from kinematics_service.kernel import OurJoints


def ours(joints):
    """Return the joints of an arm at the same places in a message."""
    return OurJoints(np.arange(joints), np.arange(joints))


def test_the_bias_is_the_mean_of_the_last_messages():
    efforts = JointEfforts(2)
    for k in range(AVERAGED + 10):
        efforts.take(ours(2), 2, np.array([float(k), 1.0]))
    assert efforts.take_bias() == AVERAGED
    np.testing.assert_allclose(efforts.bias, [9.5 + AVERAGED / 2, 1.0], rtol=1e-12)


def test_the_bias_is_not_averaged_across_a_gap_of_efforts():
    efforts = JointEfforts(2)
    efforts.take(ours(2), 2, np.array([1.0, 1.0]))
    for gap in (np.array([np.nan, 1.0]), np.zeros(0)):
        efforts.take(ours(2), 2, gap)
        assert efforts.torques() is None
        assert efforts.take_bias() == 0
        efforts.take(ours(2), 2, np.array([3.0, 5.0]))
        assert efforts.take_bias() == 1
        assert efforts.bias.tolist() == [3.0, 5.0]
        assert efforts.torques().tolist() == [0.0, 0.0]
