"""Rows of a table: which lengths are constant, and which way they go in which frame."""

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.robot.conventions import fixed_lengths

ROW = """\
robot: row
convention: {convention}
joints: [{{name: q1, type: revolute}}]
links: [{{a: {a}, alpha: 0.7, d: {d}, theta: q1}}]
"""
STEP = 1e-3


def robot(convention, a=0.3, d=0.2):
    return ks.robot_from_text(ROW.format(convention=convention, a=a, d=d))


@pytest.mark.parametrize(
    ('convention', 'expected'),
    [
        ('standard', {'d': (False, [0, 0, 1]), 'a': (True, [1, 0, 0])}),
        ('modified', {'a': (False, [1, 0, 0]), 'd': (True, [0, 0, 1])}),
    ],
)
def test_a_length_moves_the_frame_after_the_row_along_its_direction(convention, expected):
    one = robot(convention)
    lengths = {fixed.name: fixed for fixed in fixed_lengths(one.description.links[0], convention)}
    assert set(lengths) == {'a', 'd'}
    for name, (of_frame_after, direction) in expected.items():
        found = lengths[name]
        assert found.of_frame_after == of_frame_after
        for q in ([0.0], [1.1]):
            longer = robot(convention, **{name: {'a': 0.3, 'd': 0.2}[name] + STEP})
            T, moved = ks.forward_kinematics(one, q), ks.forward_kinematics(longer, q)
            R = T[:3, :3] if of_frame_after else np.eye(3)
            step = R.T @ (moved - T)[:3, 3] / STEP
            np.testing.assert_allclose(found.direction, step, atol=1e-10)
        np.testing.assert_allclose(found.direction, direction, atol=1e-12)
