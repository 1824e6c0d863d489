# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Who can see the page of `view` and talk to it: tried by programs that send whatever they like.
"""

import asyncio
import contextlib
import logging
import re
import socket
import struct
import threading
import time

import numpy as np
import pytest

pytest.importorskip('viser', reason="needs viser: pip install '.[view]'")

import msgspec
from refusal import refused
from view_client import (
    PATIENCE,
    Served,
    exchange,
    frame,
    get,
    handshake,
    own_connection,
    panel_of,
    served,
    status_of,
    update,
)
from websockets.exceptions import ConnectionClosed

import kinematics_service as ks
from kinematics_service.apps.pictures.view import guarded_server
from kinematics_service.apps.pictures.view.address import Address
from kinematics_service.apps.pictures.view.computed import observe
from kinematics_service.apps.pictures.view.origin_check import OriginCheck, origin_check_of
from kinematics_service.apps.pictures.view.run import run_page
from kinematics_service.errors import ViewError

ROUNDS = 6
OK, SWITCHED, BAD_REQUEST, FORBIDDEN = 200, 101, 400, 403
POLICY = 1008
RANDOM = np.random.default_rng(29)
# Values of sliders come back as they were sent.
SAME = 1e-12


@pytest.fixture(scope='module')
def view():
    with served('--sliders', '--robot', 'scara_hsr065') as running:
        yield running


@pytest.fixture(scope='module')
def slider(view):
    return next(thing for thing in panel_of(view) if isinstance(thing.value, float))


def value_of(view, uuid):
    return next(thing.value for thing in panel_of(view) if thing.uuid == uuid)


def test_what_a_foreign_page_sends_with_its_handshake_moves_nothing(view, slider):
    before = value_of(view, slider.uuid)
    moved = 0
    for k in range(ROUNDS):
        value = 0.3 + 0.01 * k
        origin = ('http://other.example', f'http://127.0.0.1:{view.port + 1}', 'null')[k % 3]
        sent = handshake(view, f'Host: {view.netloc}', f'Origin: {origin}')
        answer = exchange(view, sent + 5 * frame(update(slider.uuid, value=value)))
        assert status_of(answer) == FORBIDDEN
        assert b'Pages of other sites' in answer
        moved += value_of(view, slider.uuid) != before
    assert moved == 0


@pytest.mark.slow
def test_the_page_itself_moves_a_slider_and_so_does_a_program(view, slider):
    for headers, value in (
        ((f'Host: {view.netloc}', f'Origin: http://{view.netloc}'), 0.25),
        ((f'Host: localhost:{view.port}', f'Origin: http://localhost:{view.port}'), 0.35),
        ((f'Host: {view.netloc}',), 0.45),
    ):
        answer = exchange(
            view, handshake(view, *headers) + frame(update(slider.uuid, value=value))
        )
        assert status_of(answer) == SWITCHED
        assert value_of(view, slider.uuid) == pytest.approx(value, abs=SAME)


@pytest.mark.parametrize(
    'host',
    [
        'other.example',
        'other.example:{port}',
        '192.0.2.7:{port}',
        '[',
        '',
        '127.0.0.1.x',
        'evil@localhost:{port}',
        'user:word@127.0.0.1:{port}',
        '127.0.0.1:1:{port}',
    ],
)
def test_a_name_bent_to_this_computer_gets_neither_page_nor_socket(view, host):
    host = host.format(port=view.port)
    request = f'GET / HTTP/1.1\r\nHost: {host}\r\n\r\n'.encode()
    assert status_of(exchange(view, request)) == FORBIDDEN
    answer = exchange(view, handshake(view, f'Host: {host}', f'Origin: http://{host}'))
    assert status_of(answer) == FORBIDDEN


@pytest.mark.parametrize(
    'headers',
    [
        (),
        ('Host: {own}', 'Host: {own}'),
        ('Host: {own}', 'Host: other.example'),
        ('Host: {own}', 'Origin: http://{own}', 'Origin: http://other.example'),
        ('Host: {own}', 'Origin: http://{own}', 'Sec-WebSocket-Protocol: viser-v0.0.0'),
    ],
)
def test_a_header_that_is_missing_or_doubled_is_a_bad_request(view, headers):
    sent = handshake(view, *(header.format(own=view.netloc) for header in headers))
    assert status_of(exchange(view, sent)) == BAD_REQUEST


def test_an_address_that_names_another_server_is_refused(view):
    # viser's page would connect there and carry out what it says, in the name of this page.
    assert get(view, '/?websocket=ws://other.example')[0] == FORBIDDEN
    assert get(view, '/?token=x&playbackPath=http://other.example/x')[0] == FORBIDDEN
    status, headers = get(view)
    assert status == OK
    assert "frame-ancestors 'none'" in headers['Content-Security-Policy']
    assert "connect-src 'self'" in headers['Content-Security-Policy']
    assert 'Set-Cookie' not in headers


def closed_after(view, message):
    """Return the code with which the server closes a connection of the page after a message."""
    with own_connection(view) as connection:
        connection.send(message)
        try:
            while True:
                connection.recv(timeout=PATIENCE)
        except ConnectionClosed as error:
            return error.rcvd.code


def packed(**message):
    return msgspec.msgpack.encode(message)


def test_nothing_but_a_value_can_be_changed(view, slider):
    before = panel_of(view)
    for updates in (
        {'removed': True},
        {'disabled': True},
        {'value': 0.2, 'removed': True},
        {'update_cb': []},
        {'no_such_attribute': 1},
        {},
        {'value': 'x'},
        {'value': True},
        {'value': float('nan')},
        {'value': 10**25},
        {'value': [0.1]},
        {'value': None},
    ):
        try:
            message = update(slider.uuid, **updates)
        except OverflowError:  # beyond what the format has
            continue
        assert closed_after(view, message) == POLICY, updates
    assert panel_of(view) == before


def test_what_no_page_of_ours_says_ends_its_connection_only(view, slider):
    camera = {
        'wxyz': (1.0, 0.0, 0.0, 0.0),
        'position': (1.0, 1.0, 1.0),
        'fov': 1.0,
        'near': 0.01,
        'far': 100.0,
        'image_height': 500,
        'image_width': 300,
        'look_at': (0.0, 0.0, 0.0),
        'up_direction': (0.0, 0.0, 1.0),
    }
    good = update(slider.uuid, value=0.1)
    for message in (
        b'',
        b'\xc1',
        b'\x91' * 3000,
        'text',
        packed(type='ShareUrlRequest'),
        packed(type='RunJavascriptMessage', source='1'),
        packed(type='FileTransferStartUpload'),
        packed(type='ViewerCameraMessage', **(camera | {'wxyz': (1.0,)})),
        packed(type='ViewerCameraMessage', **(camera | {'position': (float('nan'), 0.0, 0.0)})),
        packed(type='ViewerCameraMessage', **(camera | {'image_width': -1})),
        packed(type=None),
        *(bytes(RANDOM.integers(0, 256, 40, dtype=np.uint8)) for _ in range(5)),
        *(good[:k] for k in range(1, len(good), 21)),
    ):
        assert closed_after(view, message) == POLICY, message
    assert closed_after(view, b'x' * 1_000_000) == 1009  # too big to be read at all
    # What is not even a frame: bits that mean nothing, lengths that are not kept.
    ours = handshake(view, f'Host: {view.netloc}')
    for garbage in (b'\xff' * 30, b'\x00' * 30, frame(good)[:-3], frame(good, opcode=11)):
        exchange(view, ours + garbage)
    with own_connection(view) as connection:
        connection.send(packed(type='ViewerCameraMessage', **camera))
        connection.send(update('no-such-thing', value=1.0))  # too late, not wrong
        assert connection.recv(timeout=PATIENCE)
    assert value_of(view, slider.uuid) == pytest.approx(slider.value, abs=10.0)


def test_requests_that_are_none_end_nothing(view):
    for request in (
        b'\r\n\r\n',
        b'GET / HTTP/1.1\r\nHost: \xff\xfe\r\n\r\n',
        b'POST / HTTP/1.1\r\nHost: localhost\r\n\r\n',
        b'GET /../../etc/passwd HTTP/1.1\r\nHost: localhost\r\n\r\n',
        b'GET /?%ff=%ff&token=\xe9 HTTP/1.1\r\nHost: localhost\r\n\r\n',
        b'\x16\x03\x01\x02\x00' + bytes(100),
    ):
        assert status_of(exchange(view, request)) not in (OK, SWITCHED)
    assert get(view)[0] == OK


def test_a_box_that_is_not_offered_cannot_be_ticked(view):
    hidden = next(thing for thing in panel_of(view) if thing.label == 'publish joint states')
    own = handshake(view, f'Host: {view.netloc}') + frame(update(hidden.uuid, value=True))
    assert status_of(exchange(view, own)) == SWITCHED
    assert value_of(view, hidden.uuid) is False


# Beyond this computer


@pytest.fixture(scope='module')
def open_view():
    with served(
        '--sliders', '--robot', 'planar_3r', '--host', '0.0.0.0', '--allow-host', 'Arm.Lab'
    ) as running:
        yield running


def test_the_token_is_printed_and_each_start_has_another(open_view):
    assert re.fullmatch(r'[\w-]{32}', open_view.token)
    tokens = {origin_check_of('0.0.0.0', ()).token for _ in range(20)}
    assert len(tokens | {open_view.token}) == 21


def test_the_page_needs_the_token(open_view):
    cookie = f'kinematics_view_{open_view.port}='
    assert get(open_view)[0] == FORBIDDEN
    for wrong in ('', 'x', open_view.token[:-1], open_view.token + 'x', '\N{WHITE SMILING FACE}'):
        path = '/?token=' + wrong.encode('ascii', 'xmlcharrefreplace').decode()
        assert get(open_view, path)[0] == FORBIDDEN
        assert get(open_view, Cookie=cookie + wrong.encode().decode('latin-1'))[0] == FORBIDDEN
    status, headers = get(open_view, f'/?token={open_view.token}')
    assert status == OK
    assert headers['Set-Cookie'] == (
        f'{cookie}{open_view.token}; Path=/; HttpOnly; SameSite=Strict'
    )
    assert get(open_view, Cookie=f'a=b; {cookie}{open_view.token}')[0] == OK


def test_without_the_token_nothing_moves(open_view):
    slider = next(thing for thing in panel_of(open_view) if isinstance(thing.value, float))
    host = f'Host: {open_view.netloc}'
    for headers in (
        (host,),
        (host, f'Origin: http://{open_view.netloc}'),
        (host, 'Cookie: kinematics_view=1'),
        (host, f'Cookie: kinematics_view_{open_view.port + 1}={open_view.token}'),
    ):
        sent = handshake(open_view, *headers) + 5 * frame(update(slider.uuid, value=0.77))
        assert status_of(exchange(open_view, sent)) == FORBIDDEN
        assert value_of(open_view, slider.uuid) == slider.value
    shown = handshake(open_view, host, path=f'/?token={open_view.token}')
    assert status_of(exchange(open_view, shown + frame(update(slider.uuid, value=0.77)))) == (
        SWITCHED
    )
    assert value_of(open_view, slider.uuid) == pytest.approx(0.77, abs=SAME)


def test_only_names_of_this_computer_are_served(open_view):
    here = socket.gethostname()
    for host, status in (
        (here, OK),
        (f'{here.upper()}:9', OK),
        ('arm.lab', OK),
        (f'ARM.lab:{open_view.port}', OK),
        ('127.0.0.1', OK),
        ('other.example', FORBIDDEN),
        ('arm.lab.other.example', FORBIDDEN),
        ('0.0.0.0', FORBIDDEN),
        ('192.0.2.7', FORBIDDEN),
    ):
        assert get(open_view, f'/?token={open_view.token}', Host=host)[0] == status, host


class Headers(dict):
    def get_all(self, key):
        return self.get(key, [])


def test_the_address_that_was_called_is_a_name():
    origin_check = OriginCheck(frozenset({'robot'}), '')
    called = ('10.0.0.4', 8080)
    for host, origin, admitted in (
        ('10.0.0.4:8080', 'http://10.0.0.4:8080', True),
        ('robot:8080', 'http://robot:8080', True),
        ('10.0.0.5:8080', 'http://10.0.0.5:8080', False),
        ('robot:8080', 'http://10.0.0.4:8080', False),
        ('robot:8080', 'http://robot:8081', False),
        ('robot:8080', 'http://[', False),
    ):
        headers = Headers(Host=[host], Origin=[origin])
        assert (origin_check.refusal('/', headers, called, 'p') is None) == admitted, (
            host,
            origin,
        )
    mapped = ('::ffff:10.0.0.4', 8080)
    assert origin_check.refusal('/', Headers(Host=['10.0.0.4']), mapped, 'p') is None


def test_a_viser_that_goes_round_the_rules_is_not_served(monkeypatch):
    # As if viser no longer asked `serve`, or no longer read by `recv`.
    monkeypatch.setattr(guarded_server.OriginCheck, 'refusal', lambda *_: None)
    with (
        refused(ViewError, 'unsupported', 'install viser'),
        guarded_server.guarded_server('127.0.0.1', 0, 'x', origin_check_of('127.0.0.1', ())),
    ):
        pytest.fail('it was served')


# One page for several arms


class TwoArms:
    """A source of two arms that stand still, without ROS."""

    nodes = ('/left/kinematics', '/right/kinematics')
    status = 'moved by the sliders'

    def __init__(self):
        self.choose(self.nodes[0])

    def choose(self, node):
        self.node = node
        self.robot = ks.load_robot('planar_2r' if 'left' in node else 'craig_3r')

    @property
    def title(self):
        return f'{self.robot.name} of {self.node}'

    def listen(self, seconds):
        time.sleep(seconds)

    def observation(self):
        return None

    def publish(self, q):
        return 'nobody listens'


def sliders_of(view):
    return sum(isinstance(thing.value, float) for thing in panel_of(view))


class ComesAndGoes(TwoArms):
    """An arm whose joint states are heard from the third turn to the fifth."""

    turns = 0

    def listen(self, seconds):
        self.turns += 1

    @property
    def status(self):
        return 'live' if 3 <= self.turns <= 5 else 'moved by the sliders'

    def observation(self):
        return observe(self.robot, [0.1, 0.2]) if self.status == 'live' else None


def test_the_terminal_says_when_an_arm_becomes_live_and_when_no_more(capfd):
    source = ComesAndGoes()
    run_page(source, Address('127.0.0.1', 0), False, lambda: source.turns > 8)
    first, *others = capfd.readouterr().out.splitlines()
    assert 'moved by the sliders; Ctrl-C' in first
    assert others == ['now live', 'now moved by the sliders']


@pytest.mark.slow
def test_the_list_of_arms_changes_the_arm_the_page_shows(capfd):
    ended, source = threading.Event(), TwoArms()
    address = Address('127.0.0.1', 0)
    page = threading.Thread(target=run_page, args=(source, address, True, ended.is_set))
    page.start()
    try:
        out, deadline = '', time.monotonic() + PATIENCE
        while 'shows' not in out and time.monotonic() < deadline:
            time.sleep(0.05)
            out += capfd.readouterr().out
        assert 'shows planar_2r of /left/kinematics' in out
        view = Served(None, '127.0.0.1', int(re.search(r':(\d+) ', out)[1]), '')
        assert sliders_of(view) == 2
        chooser = next(thing for thing in panel_of(view) if thing.label == 'arm of')
        assert chooser.value == '/left/kinematics'
        # A node that is not in the list cannot be chosen.
        assert closed_after(view, update(chooser.uuid, value='/other/kinematics')) == POLICY
        own = handshake(view, f'Host: {view.netloc}')
        exchange(view, own + frame(update(chooser.uuid, value='/right/kinematics')))
        deadline = time.monotonic() + 3.0 * PATIENCE
        while sliders_of(view) != 3:
            assert time.monotonic() < deadline, 'still two joints'
        assert source.title == 'craig_3r of /right/kinematics'
        # Whoever opens the page now finds the other arm chosen; the sliders of the first are gone.
        while not any(thing.value == '/right/kinematics' for thing in panel_of(view)):
            assert time.monotonic() < deadline, 'the other arm is listed'
    finally:
        ended.set()
        page.join()


async def write_to_a_client_that_vanishes():
    """Send a hundred messages to a client after it has reset its connection."""
    told = asyncio.get_running_loop().create_future()

    async def vanished(reader, writer):
        with contextlib.suppress(ConnectionResetError):
            await reader.read()
        for _ in range(100):
            writer.write(b'a picture')
        told.set_result(None)

    server = await asyncio.start_server(vanished, '127.0.0.1', 0)
    client = socket.create_connection(server.sockets[0].getsockname())
    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack('ii', 1, 0))
    client.close()
    await told
    server.close()


def test_messages_to_a_client_that_has_gone_leave_no_line_in_the_log(caplog):
    # Without the guard asyncio's own logger has a line for each of them. A page that was served
    # before in this process has silenced it.
    caplog.set_level(logging.WARNING, 'asyncio')
    asyncio.run(write_to_a_client_that_vanishes())
    assert sum('socket.send()' in one.message for one in caplog.records) > 50
    caplog.clear()
    with guarded_server.guarded_server('127.0.0.1', 0, 'x', origin_check_of('127.0.0.1', ())):
        asyncio.run(write_to_a_client_that_vanishes())
    assert not [one for one in caplog.records if one.name == 'asyncio']
