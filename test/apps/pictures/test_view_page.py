# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""When the page of `view` computes and draws: after a change, and not while everything rests."""

from collections import Counter

import pytest

pytest.importorskip('viser', reason="needs viser: pip install '.[view]'")

import viser

import kinematics_service as ks
from kinematics_service.apps.pictures.view import page as room
from kinematics_service.apps.pictures.view.address import Address
from kinematics_service.apps.pictures.view.run import ArmSource, turn
from kinematics_service.apps.pictures.view.viewpoint import Viewpoint


class Counted:
    """A page of its own, and how often it has computed (`observe`) and drawn (`scene_of`)."""

    def __init__(self, server, monkeypatch):
        self.counts = Counter()
        for name in ('observe', 'scene_of'):
            monkeypatch.setattr(room, name, self._counted(name, getattr(room, name)))
        self.clicks = {}
        monkeypatch.setattr(
            viser.GuiButtonHandle,
            'on_click',
            lambda button, call: self.clicks.update({button.label: call}),
        )
        self.source = ArmSource(ks.load_robot('planar_2r'), 'sliders')
        self.page = room.Page(server, Viewpoint(server), self.source.robot, False)
        # The velocity of sliders that have moved stays for a while; here it is that of one turn.
        self.qdot = None
        monkeypatch.setattr(self.page.sliders, 'velocities', lambda q: self.qdot)

    def _counted(self, name, function):
        def call(*arguments):
            self.counts[name] += 1
            return function(*arguments)

        return call

    def turn(self):
        """Turn the loop once and return how often it has computed and drawn."""
        self.counts.clear()
        turn(self.page, self.source)
        return self.counts['observe'], self.counts['scene_of']


@pytest.fixture
def counted(monkeypatch):
    with room.serve(Address('127.0.0.1', 0), 'planar_2r') as (server, _):
        yield Counted(server, monkeypatch)


def test_a_page_at_rest_neither_computes_nor_draws(counted):
    assert counted.turn() == (0, 1)
    assert counted.turn() == (0, 0)


def test_a_moved_slider_is_computed_and_drawn_once(counted):
    counted.turn()
    moved = counted.page.sliders.positions + 0.1
    counted.page.sliders.move(moved)
    counted.qdot = moved
    assert counted.turn() == (1, 1)
    assert counted.page.last.twist is not None
    counted.qdot = None
    # It rests, and its velocity is no longer shown.
    assert counted.turn() == (1, 1)
    assert counted.page.last.twist is None
    assert counted.page.last.q == pytest.approx(moved)
    assert counted.turn() == (0, 0)


def test_another_title_or_status_or_switch_is_drawn(counted):
    counted.turn()
    counted.source._status = 'another'
    assert counted.turn() == (0, 1)
    assert 'another' in counted.page._gauges.content
    counted.page.show(counted.page.last, 'title', 'another')
    assert 'title' in counted.page._gauges.content
    counted.turn()
    counted.page._switches['axes'].value ^= True
    assert counted.turn() == (0, 1)
    assert counted.turn() == (0, 0)


def test_a_trail_is_cleared_while_the_arm_rests(counted):
    for _ in range(3):
        counted.page.sliders.move(counted.page.sliders.positions + 0.1)
        counted.turn()
    assert counted.page._drawing._path.visible
    counted.clicks['Clear the trail'](None)
    assert counted.turn() == (0, 1)
    assert not counted.page._drawing._path.visible


def test_what_a_node_says_after_the_same_positions_is_drawn(counted, monkeypatch):
    counted.turn()
    seen = ks.load_robot('planar_2r')
    live = room.observe(seen, counted.page.last.q)
    monkeypatch.setattr(counted.source, 'observation', lambda: live)
    assert counted.turn() == (0, 1)
    assert counted.page.last is live
    monkeypatch.setattr(counted.source, 'observation', lambda: None)
    # The sliders lead again, and what they show is their own.
    assert counted.turn() == (0, 1)
    assert counted.page.last is not live
