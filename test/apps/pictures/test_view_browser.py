# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The live view in a real browser: what people see, click and drag.

With the variable KINEMATICS_SCREENSHOTS the pictures are kept in the folder it names.
"""

import math
import os
import re
import signal
import subprocess
import sys
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('viser', reason="needs viser: pip install '.[view]'")

from chromium import DEADLINE, chromium_tab, find_chromium
from view_client import PROTOCOL, Served, panel_of, served, update

import kinematics_service as ks
from kinematics_service.node.drawing.scene import JOINT_COLOUR, LEVEL_COLOURS

pytestmark = pytest.mark.browser

ROBOT = 'puma560'
LEVEL = "document.querySelector('#kin-gauges [data-level]').dataset.level"
# The width of the panel is about a quarter of this.
WIDTH, HEIGHT = 900, 520


def fact(name):
    return f"(document.querySelector('[data-fact={name}]') || {{}}).textContent"


def button(text):
    return f"[...document.querySelectorAll('button')].find(b => b.textContent == '{text}')"


def numbers(text):
    return [
        float(word) for word in re.findall(r'[-+]?\d+\.\d+', text.replace('\N{MINUS SIGN}', '-'))
    ]


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    named = os.environ.get('KINEMATICS_SCREENSHOTS')
    return Path(named) if named else tmp_path_factory.mktemp('screenshots')


@pytest.fixture(scope='module')
def page():
    # The page of the command itself, and a browser that has it open.
    find_chromium()
    process = subprocess.Popen(
        [sys.executable, '-m', 'kinematics_service', 'view']
        + ['--sliders', '--robot', ROBOT, '--port', '0'],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        line = process.stdout.readline()
        address = re.match(r'http://127\.0\.0\.1:\d+', line)
        assert address, line + process.stderr.read()
        with chromium_tab() as tab:
            tab.open(address[0], WIDTH, HEIGHT)
            tab.wait_for("document.querySelectorAll('[role=slider]').length == 6", 'six sliders')
            tab.wait_for(f'{fact("position")} != null', 'the position of the tool')
            yield tab
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
        assert process.returncode == 0
        assert not err
    finally:
        process.kill()
        process.wait()


def picture(tab, path):
    """Return a screenshot as an array (height, width, 3)."""
    from PIL import Image  # viser brings it

    tab.screenshot(path)
    return np.asarray(Image.open(path).convert('RGB'), dtype=np.int16)


def wait_for_picture(tab, path, true):
    """Return the first picture of which something is true; software draws some frames a second."""
    deadline = time.monotonic() + DEADLINE
    while True:
        image = picture(tab, path)
        if true(image):
            return image
        if time.monotonic() > deadline:
            pytest.fail(f'see {path}')
        time.sleep(0.2)


def scene(image):
    """Return the part of a picture beside the panel."""
    return image[:, : int(0.6 * WIDTH)]


def blueish(image):
    red, green, blue = np.moveaxis(image, 2, 0)
    return np.sum((blue > red + 40) & (blue > green))


def near(image, colour, distance=60):
    return np.sum(np.abs(image - np.array(colour)).sum(axis=2) < distance)


@pytest.mark.slow
def test_the_page_says_what_the_library_says(page, folder):
    # Joint positions, and what the tool's position and the Jacobian are there.
    boxes = page.evaluate(
        "[...document.querySelectorAll('[role=slider]')].map(s => s.ariaValueNow)"
    )
    robot = ks.load_robot(ROBOT)
    q = [float(value) for value in boxes]
    shown = numbers(page.evaluate(fact('position')))
    assert shown == pytest.approx(ks.forward_kinematics(robot, q)[:3, 3], abs=2e-3)
    cells = page.evaluate(
        "[...document.querySelectorAll('#kin-jacobian td.num')].map(c => c.textContent)"
    )
    J = np.array([float(cell.replace('\N{MINUS SIGN}', '-')) for cell in cells]).reshape(6, 6)
    assert pytest.approx(ks.jacobian(robot, q), abs=5e-3) == J
    radii = numbers(page.evaluate(fact('radii-v')))
    assert radii == pytest.approx(np.linalg.svd(J[:3])[1], abs=5e-3)
    assert page.evaluate(LEVEL) == 'OK'
    # Dark joints and blue axes of the arm are drawn.
    wait_for_picture(
        page,
        folder / 'view_regular.png',
        lambda image: near(scene(image), JOINT_COLOUR) > 300 and blueish(scene(image)) > 100,
    )


@pytest.mark.slow
def test_a_slider_moves_the_arm(page, folder):
    before = page.evaluate(fact('position'))
    picture_before = scene(picture(page, folder / 'view_before.png'))
    page.evaluate("document.querySelectorAll('[role=slider]')[0].focus()")
    page.press('End')
    page.wait_for(f"{fact('position')} != '{before}'", 'another position of the tool')
    robot = ks.load_robot(ROBOT)
    upper = robot.limits[0, 1]
    value = float(page.evaluate("document.querySelectorAll('[role=slider]')[0].ariaValueNow"))
    assert value == pytest.approx(upper, abs=2e-3)
    # Joint 1 turns the arm about the vertical: the radius and the height stay.
    x, y, z = numbers(page.evaluate(fact('position')))
    x0, y0, z0 = numbers(before)
    assert math.hypot(x, y) == pytest.approx(math.hypot(x0, y0), abs=2e-3)
    assert z == pytest.approx(z0, abs=1e-3)
    assert 'near upper limit' in page.evaluate("document.querySelector('#kin-joints').textContent")
    wait_for_picture(
        page,
        folder / 'view_moved.png',
        lambda image: np.sum(np.abs(scene(image) - picture_before).sum(axis=2) > 60) > 2000,
    )


@pytest.mark.slow
def test_a_singular_pose_turns_the_gauge_red_and_says_its_name(page, folder):
    page.evaluate(f'{button("Regular pose")}.click()')
    page.wait_for(f"{LEVEL} == 'OK'", 'a regular pose')
    red = LEVEL_COLOURS[2]
    before = near(scene(picture(page, folder / 'view_regular_again.png')), red)
    page.evaluate(f'{button("Singular pose")}.click()')
    page.wait_for(f"{LEVEL} == 'ERROR'", 'level ERROR')
    head = "document.querySelector('#kin-gauges [data-level]')"
    assert page.evaluate(f'getComputedStyle({head}).backgroundColor') == f'rgb{red}'
    text = page.evaluate(f'{head}.textContent')
    name = text.partition('AT A SINGULARITY: ')[2]
    assert name in ks.load_robot(ROBOT).singularity.factors.names
    assert '0.000 rad' in page.evaluate(
        "document.querySelector('[data-gauge=measure]').textContent"
    )
    assert page.evaluate(fact('lost'))
    # The lost direction appears in the picture, in red.
    wait_for_picture(
        page,
        folder / 'view_singular.png',
        lambda image: near(scene(image), red) > before + 300,
    )


@pytest.mark.slow
def test_a_narrow_screen_shows_the_arm_above_the_panel(page, folder):
    width, height = 500, 900
    page.resize(width, height)
    title = "document.querySelector('#kin-title').getBoundingClientRect()"
    # Two thirds of the picture are the arm's, once the page is laid out anew.
    page.wait_for(
        f'innerWidth == {width} && {title}.top < {height} && {title}.top > {0.6 * height}',
        'the title below the arm',
    )

    def arm_is_seen(image):
        return near(image[: int(0.6 * height)], JOINT_COLOUR) > 300

    wait_for_picture(page, folder / 'view_narrow.png', arm_is_seen)


def test_nothing_was_complained_of_and_nobody_else_was_asked(page):
    assert page.errors == []
    asked = {url.split('/')[2] for url in page.requests if url.startswith(('http:', 'https:'))}
    assert len(asked) == 1
    assert asked.pop().startswith('127.0.0.1:')


@pytest.mark.slow
def test_a_page_of_somebody_else_opens_no_connection(page):
    address = page.evaluate('location.host')
    # It would go on drawing, which takes a whole core here.
    page.call('Page.navigate', url='about:blank')
    host, _, port = address.partition(':')
    view = Served(None, host, int(port), '')
    slider = next(thing for thing in panel_of(view) if isinstance(thing.value, float))
    message = list(update(slider.uuid, value=slider.value + 0.123))
    attack = f"""<script>
        const attacked = globalThis.attacked = {{opened: 0, ended: 0}};
        for (let k = 0; k < 150; k++) {{
            const s = new WebSocket('ws://{address}', ['{PROTOCOL}']);
            s.onopen = () => {{ attacked.opened++; s.send(new Uint8Array({message})); }};
            s.onclose = () => attacked.ended++;
        }}
    </script>"""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header('Content-Type', 'text/html')
            self.end_headers()
            self.wfile.write(attack.encode())

        def log_message(self, *_):
            pass

    with ThreadingHTTPServer(('127.0.0.1', 0), Handler) as server:
        threading.Thread(target=server.serve_forever).start()
        try:
            with chromium_tab() as tab:
                tab.open(f'http://127.0.0.1:{server.server_port}/', 300, 200)
                tab.wait_for('globalThis.attacked?.ended == 150', 'all connections ended', 240.0)
                assert tab.evaluate('attacked.opened') == 0
                # Nor can it put the page into its own.
                tab.evaluate(
                    "new Promise(done => {const f = document.createElement('iframe');"
                    f"f.onload = done; f.src = 'http://{address}/'; document.body.append(f)}})"
                    '.then(() => 1)'
                )
                assert any('frame-ancestors' in error for error in tab.errors)
        finally:
            server.shutdown()
    now = next(thing.value for thing in panel_of(view) if thing.uuid == slider.uuid)
    assert now == slider.value


@pytest.mark.slow
def test_the_address_with_the_token_opens_the_page_and_its_sliders():
    find_chromium()
    address = ('--host', '0.0.0.0')
    slider = "document.querySelectorAll('[role=slider]')[0]"
    at_end = f'{slider}.ariaValueNow == {slider}.ariaValueMax'
    with served('--sliders', '--robot', 'planar_2r', *address) as view, chromium_tab() as tab:
        tab.open(f'http://{view.netloc}/', 600, 400, scene=False)
        tab.wait_for("document.body.innerText.includes('needs its token')", 'the refusal')
        tab.call('Page.navigate', url=f'http://{view.netloc}/?token={view.token}')
        tab.wait_for(f'{fact("position")} != null', 'the position of the tool')
        assert tab.evaluate("document.querySelector('#kin-title').textContent") == 'planar_2r'
        assert not tab.evaluate(at_end)
        tab.evaluate(f'{slider}.focus()')
        tab.press('End')
        tab.wait_for(at_end, 'the slider at its end')
        # The browser remembers it, out of reach of scripts.
        tab.call('Page.navigate', url=f'http://{view.netloc}/')
        tab.wait_for(f'location.search == "" && {fact("position")} != null', 'the page again')
        # And the page what the slider said.
        tab.wait_for(at_end, 'the slider where it was')
        assert view.token not in tab.evaluate('document.cookie')
