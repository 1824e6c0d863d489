# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The slider along the self-motion of the page of `view`: the joints move, and the tool stays."""

import time

import numpy as np
import pytest

pytest.importorskip('viser', reason="needs viser: pip install '.[view]'")

from chromium import chromium_tab, find_chromium
from redundant_arms import random_arm
from view_client import PATIENCE, own_connection, panel_of, served, update

import kinematics_service as ks
from kinematics_service.apps.pictures.view.self_motion_slider import SelfMotionSlider
from kinematics_service.apps.pictures.view.sliders import STEP, Sliders

ROBOT = 'panda'


class Handle:
    """A slider as the panel has it."""

    def __init__(self, value, disabled, least, most):
        self.value, self.disabled, self.least, self.most = value, disabled, least, most


class Panel:
    """A panel without a page."""

    def __init__(self):
        self.gui, self.handles = self, {}

    def add_slider(self, label, initial_value, disabled=False, **other):
        handle = Handle(initial_value, disabled, other['min'], other['max'])
        self.handles[label] = handle
        return handle


def sliders_of(robot):
    panel = Panel()
    sliders = Sliders(panel, robot)
    return sliders, SelfMotionSlider(panel, robot), panel.handles.get('self-motion')


@pytest.mark.parametrize('robot', [ks.load_robot(ROBOT), random_arm('RRRR', 3)], ids=str)
def test_the_slider_moves_the_joints_and_the_tool_stays(robot):
    sliders, self_motion, handle = sliders_of(robot)
    rows = slice(None) if robot.dof == 7 else (slice(3), 3)
    assert handle.disabled
    # Not a special pose: where axes meet its arc ends.
    sliders.jump(robot.limits.mean(axis=1) + 0.3)
    self_motion.lead(sliders)
    start = self_motion.lead(sliders)
    assert not handle.disabled
    pose = ks.forward_kinematics(robot, start)
    at = handle.value
    for share in (0.0, 1.0, 0.37, 0.5, at):
        handle.value = share
        q = self_motion.lead(sliders)
        assert np.max(np.abs((ks.forward_kinematics(robot, q) - pose)[rows])) < 1e-12
        assert np.all(q >= robot.limits[:, 0] - 1e-9)
        assert np.all(q <= robot.limits[:, 1] + 1e-9)
        assert np.max(np.abs(sliders.positions - q)) < STEP
        # Nothing moves by itself.
        assert np.array_equal(self_motion.lead(sliders), q)
    assert np.max(np.abs(q - start)) < 0.05
    # It begins where a joint is at a limit.
    handle.value = 0.0
    first = self_motion.lead(sliders)
    assert np.min(np.abs(np.concatenate(robot.limits.T) - np.tile(first, 2))) < 1e-9


def test_another_posture_locks_it_until_it_rests():
    sliders, self_motion, handle = sliders_of(ks.load_robot(ROBOT))
    for _ in range(2):
        self_motion.lead(sliders)
    assert not handle.disabled
    sliders.jump(sliders.positions + 0.1)
    moved = sliders.positions
    handle.value = 0.9  # too late: it is the old arc's
    assert np.array_equal(self_motion.lead(sliders), moved)
    assert handle.disabled
    assert np.array_equal(self_motion.lead(sliders), moved)
    assert not handle.disabled


def test_a_singular_posture_has_no_arc_and_other_arms_no_slider():
    sliders, self_motion, handle = sliders_of(ks.load_robot('kuka_iiwa14'))
    sliders.jump(np.array([0.3, 0.0, -0.4, 1.0, 0.2, 0.0, 0.5]))
    for _ in range(3):
        shown = self_motion.lead(sliders)
    assert np.array_equal(shown, sliders.positions)
    sliders, self_motion, handle = sliders_of(ks.load_robot('ur5e'))
    assert handle is None
    assert np.array_equal(self_motion.lead(sliders), sliders.positions)
    self_motion.release()


@pytest.fixture(scope='module')
def view():
    with served('--sliders', '--robot', ROBOT) as running:
        yield running


@pytest.mark.slow
def test_a_page_moves_the_arm_along_it(view):
    robot = ks.load_robot(ROBOT)
    things = [thing for thing in panel_of(view) if isinstance(thing.value, float)]
    assert [thing.label for thing in things][robot.dof :] == ['self-motion']
    before = np.array([thing.value for thing in things[: robot.dof]])
    slider, end = things[robot.dof], time.monotonic() + PATIENCE
    while time.monotonic() < end:
        with own_connection(view) as connection:
            connection.send(update(slider.uuid, value=0.2))
        time.sleep(0.2)
        now = [thing.value for thing in panel_of(view) if isinstance(thing.value, float)]
        if now[: robot.dof] != before.tolist():
            break
    after = np.array(now[: robot.dof])
    assert np.max(np.abs(after - before)) > 0.1
    poses = ks.forward_kinematics(robot, np.array([before, after]))
    assert np.max(np.abs(poses[0] - poses[1])) < 7 * STEP


@pytest.mark.slow
@pytest.mark.browser
def test_it_is_seen_and_dragged(view):
    find_chromium()
    label = "document.body && document.body.innerText.includes('self-motion')"
    slider = "document.querySelectorAll('[role=slider]')[7]"
    position = "(document.querySelector('[data-fact=position]') || {}).textContent"
    with chromium_tab() as tab:
        tab.open(f'http://{view.netloc}/', 900, 700, scene=False)
        tab.wait_for(f'{label} && {slider} && {position}', 'the slider')
        joints = "[...document.querySelectorAll('[role=slider]')].map(s => s.ariaValueNow)"
        before, tool = tab.evaluate(joints), tab.evaluate(position)
        tab.evaluate(f'{slider}.focus()')
        tab.press('End')
        tab.wait_for(f'{slider}.ariaValueNow == 1', 'the end of the arc')
        tab.wait_for(f"{joints}[0] != '{before[0]}'", 'another posture')
        assert tab.evaluate(position) == tool
