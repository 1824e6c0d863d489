# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Whether a family, or where families meet, is inside the joint limits: shown or proved not."""

import dataclasses
import functools

import numpy as np
import pytest
from arms import robot_of
from derivations import derived, marked

import kinematics_service as ks
from kinematics_service.apps.formulas.derive.algebra.numeric import Numbers
from kinematics_service.apps.formulas.derive.algebra.zeros import Box, common_zero
from kinematics_service.apps.formulas.derive.minors import minors_of, product_of, simplest_view
from kinematics_service.apps.formulas.derive.output.report import Sentence, report_of
from kinematics_service.apps.formulas.derive.singular_set import FamilySearch
from kinematics_service.robot.robot import build_robot

ARMS = ['anthropomorphic_3r', 'scara_hsr065', 'rrp_elementary', 'offset_stanford_dh']
NARROW = 0.02


def limited(robot, low, high):
    """Return an arm with other joint limits."""
    joints = tuple(
        dataclasses.replace(joint, lower=float(a), upper=float(b))
        for joint, a, b in zip(robot.description.joints, low, high)
    )
    return build_robot(dataclasses.replace(robot.description, joints=joints))


@functools.cache
def families(name):
    """Return each factor of an arm as a function, with poses on it, rad and m."""
    exact, factors = derived(name).exact, derived(name).singular_set.factors
    n = len(exact.sampler.moving)
    rows = exact.sampler.rows
    view = simplest_view(exact.J, exact.frames, rows, range(n), n == 6)
    minors = minors_of(view, rows, range(n), n)
    functions = [
        Numbers(factor.value, exact.arithmetic)
        for factor in product_of(minors, exact.arithmetic)[0].factors
    ]
    search = FamilySearch(exact.sampler, exact.sampler.in_random_letters)
    return [(f, g, search.poses([g])) for f, g in zip(factors, functions)]


def sigma(robot, q):
    """Return the singular values of the task rows in the axes of frame 0."""
    R = ks.link_frames(robot, q)[0, :3, :3]
    J = ks.jacobian(robot, q)
    rows = np.concatenate([R.T @ J[:3], R.T @ J[3:]])[robot.singularity.task.axes]
    return np.linalg.svd(rows, compute_uv=False)


def decided(name, low, high, *functions):
    """Return what is known of the zeros of functions of an arm within limits."""
    robot = limited(robot_of(name), low, high)
    sampler = dataclasses.replace(derived(name).exact.sampler, robot=robot)
    search = FamilySearch(sampler, (sampler,))
    return search.zero_within_limits(functions)


@pytest.mark.parametrize('name', marked(ARMS))
def test_a_family_through_narrow_limits_is_shown_by_a_singular_pose_inside(name):
    robot = robot_of(name)
    for _, function, poses in families(name):
        for pose in poses[:2]:
            off = pose + NARROW / 2 * np.sin(np.arange(robot.dof) + 1.0)
            zero = decided(name, off - NARROW, off + NARROW, function)
            assert zero.exists is True
            assert np.all(np.abs(zero.pose - off) <= NARROW)
            assert sigma(robot, zero.pose)[-1] < 1e-8


@pytest.mark.parametrize('name', marked(ARMS))
def test_narrow_limits_off_every_family_are_proved_to_hold_none(name):
    robot = robot_of(name)
    away = next(
        q for q in derived(name).exact.sampler.random(200) if sigma(robot, q)[-1] > 4 * NARROW
    )
    for _, function, _ in families(name):
        assert decided(name, away - NARROW, away + NARROW, function).exists is False


@pytest.mark.slow
def test_the_decision_is_that_of_a_grid():
    random = np.random.default_rng(8)
    outcomes = set()
    for _, function, _ in families('anthropomorphic_3r'):
        for _ in range(8):
            middle, half = random.uniform(-3, 3, 3), random.uniform(0.05, 0.7, 3)
            axes = np.linspace(middle - half, middle + half, 41)[:, 1:]
            grid = np.stack(np.meshgrid(*axes.T), axis=-1).reshape(-1, 2)
            values = function(np.column_stack([np.zeros(len(grid)), grid]))
            changes = bool(values.min() < 0 < values.max())
            zero = decided('anthropomorphic_3r', middle - half, middle + half, function)
            # Between the points of the grid a family may just cut a corner of the box.
            assert zero.exists is not None
            assert zero.exists == changes or np.min(np.abs(values)) < 0.01
            outcomes.add(zero.exists)
    assert outcomes == {True, False}


def test_a_limit_on_the_family_belongs_to_it():
    elbow = next(f for f in families('anthropomorphic_3r') if f[0].name == 'elbow')[1]
    zero = decided('anthropomorphic_3r', [-1, -1, 0], [1, 1, 2.5], elbow)
    assert zero.exists is True
    assert zero.pose[2] == 0.0
    assert decided('anthropomorphic_3r', [-1, -1, 1e-6], [1, 1, 2.5], elbow).exists is False


def test_families_that_meet_outside_the_limits_only():
    both = [f[1] for f in families('anthropomorphic_3r')]
    # Elbow: theta3 = 0. Shoulder: L2 c2 + L3 c23 = 0, at theta3 = 0 with theta2 = pi/2 only.
    low, high = [-1, 1.6, -0.4], [1, 2.2, 0.4]
    assert [decided('anthropomorphic_3r', low, high, f).exists for f in both] == [True, True]
    assert decided('anthropomorphic_3r', low, high, *both).exists is False
    met = decided('anthropomorphic_3r', [-1, 1.5, -0.4], high, *both)
    assert met.exists is True
    assert np.allclose(met.pose[1:], [np.pi / 2, 0.0])


def test_of_a_free_length_the_far_end_is_decided_too():
    length = next(f for f in families('rrp_elementary') if f[0].name == 'boom_length')[1]
    inf = np.inf
    assert decided('rrp_elementary', [-1, -1, 0], [1, 1, inf], length).exists is False
    assert decided('rrp_elementary', [-1, -1, -inf], [1, 1, -0.5], length).exists is False
    assert decided('rrp_elementary', [-1, -1, -inf], [1, 1, inf], length).exists is True


@pytest.mark.slow
def test_a_zero_that_is_only_touched_is_not_decided():
    derivation = derived('planar_2r')
    ring = derivation.exact.arithmetic.ring
    z = ring.power(derivation.exact.arithmetic.angle_index(derivation.variables[1]))
    back = ring.power(derivation.exact.arithmetic.angle_index(derivation.variables[1]), -1)

    def exists(constant):
        function = Numbers(ring.number(*constant) + z + back, derivation.exact.arithmetic)
        box = Box(np.full(2, -4.0), np.full(2, 4.0))
        return common_zero([function], box, derivation.exact.sampler.random()).exists

    assert exists((2, 1)) is None  # 2 + 2 cos q
    assert exists((199, 100)) is True
    assert exists((201, 100)) is False


def test_the_report_says_which():
    robot = limited(ks.load_robot('anthropomorphic_3r'), [-1, 0.1, 0.5], [1, 0.9, 0.7])
    derivation = ks.derive(robot)
    assert [f.within_limits for f in derivation.singular_set.factors] == [False, False]
    said = [b.parts[0] for b in report_of(derivation) if isinstance(b, Sentence)]
    assert said.count('No pose of it is inside the joint limits.') == 2
    assert any(s.endswith('(outside the joint limits)') for s in said)
