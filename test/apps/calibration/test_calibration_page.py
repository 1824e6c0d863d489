# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The page of a calibration: its numbers, its pictures, and that it needs nothing else."""

import re

import numpy as np
import pytest
from arms import robot_of
from calibrated_arms import BASE, measured_arm, touching_arm
from chromium import chromium_tab

import kinematics_service as ks
from kinematics_service.apps.calibration.checking import not_nothing
from kinematics_service.apps.calibration.output.page import (
    BOTTOM,
    HEIGHT,
    PointPlot,
    page_of,
)

NOISE = 5e-5
ORIGIN = ('tracker <1>.csv',), 'ur5e.yaml', '2031-02-03', ('A remark',)


@pytest.fixture(scope='module')
def found():
    arm = measured_arm('ur5e', 40, NOISE)
    poses = arm.poses.copy()
    poses[7, :3, 3] += 0.02
    return ks.calibrate(arm.robot, arm.q, poses, check=False)


def test_the_page_says_what_was_found(found):
    page = page_of(found, *ORIGIN)
    assert 'tracker &lt;1&gt;.csv' in page
    assert 'd2 + d3 + d4' in page
    assert 'A remark.' in page
    assert '<td>shoulder_pan_joint' not in page
    assert page.count('<svg class="bar"') == len(found.parameters)
    # Two plots of the poses have a point before and after for each, those of joints no outlier.
    assert page.count('<circle class="before"') == 2 * 40 + 6 * 39
    assert page.count('<circle class="outlier"') == 2
    assert page == page_of(found, *ORIGIN)


def test_an_error_far_below_the_others_is_not_drawn_beside_them():
    x = np.arange(3.0)
    series = (('before', np.array([0.1, 0.2, 0.25])), ('after', np.array([0.0, 1e-9, 0.01])))
    page = PointPlot('error', 'deg', 'pose', x, series).html()
    rows = [
        float(y) for y in re.findall(r'<circle class="after" cx="[0-9.]+" cy="([0-9.]+)"', page)
    ]
    edge = HEIGHT - BOTTOM
    assert rows[0] == rows[1] == pytest.approx(edge, abs=0.1)
    # Four decades over the height: 0.01 is a good one below 0.25, and far above the edge.
    assert 0.3 * edge < rows[2] < 0.5 * edge
    assert 'points on the lower edge are below it' in page
    near = PointPlot('error', 'deg', 'pose', x, series[:1]).html()
    assert 'lower edge' not in near


def test_no_deviation_is_nothing():
    assert not_nothing('0 deg') == 'below 1e-6 deg'
    assert not_nothing('0.2 deg') == '0.2 deg'


def test_the_page_needs_nothing_else(found):
    page = page_of(found, *ORIGIN)
    assert not re.findall(r'(?:src|href)=|url\(|@import|https?:', page)


@pytest.mark.slow
def test_positions_touches_and_several_sets_have_pages():
    arm = measured_arm('scara_hsr065', 20, NOISE)
    poses = arm.poses.copy()
    poses[10:] = np.linalg.inv(BASE) @ poses[10:]
    sets = np.repeat([0, 1], 10)
    found = ks.calibrate(arm.robot, arm.q, poses, sets=sets, check=False)
    assert 'of the orientation by pose' in page_of(found, *ORIGIN)
    found = ks.calibrate(arm.robot, arm.q, arm.poses[:, :3, 3], check=False)
    assert 'of the orientation by pose' not in page_of(found, *ORIGIN)
    arm = touching_arm('puma560', (('A', (0.4, 0.2, 0.1)),), 20, NOISE)
    found = ks.calibrate(robot_of('puma560'), arm.q, same_point=arm.marks, check=False)
    assert 'of the position by touch' in page_of(found, *ORIGIN)


@pytest.mark.slow
@pytest.mark.parametrize(('width', 'scheme'), [(1000, 'dark'), (390, 'light')])
def test_the_page_fits_the_window(found, tmp_path, width, scheme):
    page = tmp_path / 'page.html'
    page.write_text(page_of(found, *ORIGIN))
    with chromium_tab() as tab:
        tab.open(page.as_uri(), width, 900)
        feature = {'name': 'prefers-color-scheme', 'value': scheme}
        tab.call('Emulation.setEmulatedMedia', media='screen', features=[feature])
        tab.wait_for('document.readyState === "complete" && location.protocol === "file:"', 'it')
        assert tab.evaluate('document.documentElement.scrollWidth') <= width
        assert tab.errors == []
        assert tab.requests == [page.as_uri()]
