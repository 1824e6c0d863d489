# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""JavaScript of `derive`, also on the documentation's first page, gives the library's numbers."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from chromium import chromium_tab
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service.apps.formulas.derive.output.code import code_of

DOCS = Path(__file__).parents[1] / 'docs'
SCRIPTS = [DOCS / 'front' / name for name in ('arms.js', 'live.js')]
ARMS = ('planar_2r', 'craig_3r')
PAGE = '<html><meta charset="utf-8"><body><div class="live-arm"></div>{}</body></html>'
ONE_JOINT = """
robot: one
convention: standard
joints: [{name: turn, type: revolute, variable: q}]
links: [{a: 0.5, alpha: 0, d: 0, theta: q}]
"""
pytestmark = pytest.mark.skipif(not DOCS.is_dir(), reason='the pages are not beside the tests')


def poses_of(name):
    rng = np.random.default_rng(45)
    return rng.uniform(-np.pi, np.pi, (200, ks.load_robot(name).dof))


def assert_are_the_librarys(name, numbers):
    robot, q = ks.load_robot(name), poses_of(name)
    T, J = ks.forward_kinematics(robot, q), ks.jacobian(robot, q)
    measures = ks.singularity(robot, q)
    assert len(numbers) == len(q)
    for key, values in (('pose', T), ('jacobian', J), ('determinant', measures.determinant)):
        given = np.array([one[key] for one in numbers])
        np.testing.assert_allclose(given, values, rtol=0, atol=ROUND_OFF)
    factors = np.array([one['factors'] for one in numbers])
    product = np.abs(factors).prod(axis=1) * np.prod(list(ks.derive(robot).lengths.values())[-2:])
    np.testing.assert_allclose(product, np.abs(measures.determinant), rtol=0, atol=ROUND_OFF)
    if name == 'planar_2r':
        # The library searches within 1 rad.
        distance = [min(1.0, one['distance']) for one in numbers]
        np.testing.assert_allclose(distance, measures.distance, rtol=0, atol=ROUND_OFF)


@pytest.mark.parametrize('name', ARMS)
@pytest.mark.skipif(shutil.which('node') is None, reason='needs Node.js')
def test_the_formulas_are_the_library(name):
    scripts = '\n'.join(file.read_text(encoding='utf-8') for file in SCRIPTS)
    q = json.dumps(poses_of(name).tolist())
    program = f"{scripts}\nconsole.log(JSON.stringify({q}.map((q) => liveNumbers('{name}', q))));"
    done = subprocess.run(
        ['node', '-'], input=program, capture_output=True, text=True, timeout=60, check=True
    )
    assert_are_the_librarys(name, json.loads(done.stdout))


@pytest.mark.slow
@pytest.mark.parametrize('name', ['puma560', 'rrp_elementary', 'one'])
@pytest.mark.skipif(shutil.which('node') is None, reason='needs Node.js')
def test_the_code_of_an_arm_is_the_library(name, tmp_path):
    # The variable of the last one has the name of the argument of the functions.
    robot = ks.robot_from_text(ONE_JOINT) if name == 'one' else ks.load_robot(name)
    derivation = ks.derive(robot)
    q = np.random.default_rng(45).uniform(-1.0, 1.0, (20, robot.dof))
    lengths = ', '.join(map(repr, derivation.lengths.values()))
    file = tmp_path / 'arm.mjs'
    file.write_text(
        f'{code_of(derivation, "js")}\nconsole.log(JSON.stringify({q.tolist()}.map((one) => '
        f'[pose(one, {lengths}), jacobian(one, {lengths})])));'
    )
    done = subprocess.run(['node', file], capture_output=True, text=True, timeout=60, check=True)
    for one, (T, J) in zip(q, json.loads(done.stdout)):
        np.testing.assert_allclose(T, ks.forward_kinematics(robot, one), rtol=0, atol=ROUND_OFF)
        np.testing.assert_allclose(J, ks.jacobian(robot, one), rtol=0, atol=ROUND_OFF)


def test_the_formulas_are_made_from_the_code(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    import from_code

    assert from_code.live_arms() == from_code.LIVE_FILE.read_text(encoding='utf-8')


@pytest.mark.slow
@pytest.mark.browser
def test_the_page_shows_them_and_follows_the_sliders(tmp_path):
    tags = ''.join(f'<script src="{file.as_uri()}"></script>' for file in SCRIPTS)
    page = tmp_path / 'page.html'
    page.write_text(PAGE.format(tags), encoding='utf-8')
    with chromium_tab() as tab:
        tab.open(page.as_uri())
        tab.wait_for("document.querySelector('.det') !== null", 'the numbers')
        for name in ARMS:
            q = json.dumps(poses_of(name).tolist())
            assert_are_the_librarys(
                name, tab.evaluate(f"{q}.map((q) => liveNumbers('{name}', q))")
            )
            tab.evaluate(
                f"(() => {{ const s = document.querySelector('select'); s.value = '{name}';"
                "s.dispatchEvent(new Event('change'));"
                "const sliders = document.querySelectorAll('input');"
                'sliders.forEach((one, k) => { one.value = 10 * (k + 1); });'
                "sliders[0].dispatchEvent(new Event('input')); })()"
            )
            robot = ks.load_robot(name)
            degrees = 10.0 * np.arange(1, robot.dof + 1)
            wanted = ks.singularity(robot, np.deg2rad(degrees)).determinant
            assert tab.evaluate("document.querySelector('.det').textContent") == f'{wanted:.6f}'
            assert tab.evaluate("document.querySelectorAll('input').length") == robot.dof
        assert tab.errors == []
