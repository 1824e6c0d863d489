# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Programs that talk to the page of `view` without a browser: a proper one, and one byte by byte.
"""

import base64
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import pytest

viser = pytest.importorskip('viser', reason="needs viser: pip install '.[view]'")

import msgspec  # noqa: E402
import zstandard  # noqa: E402
from websockets.sync.client import ClientConnection, connect  # noqa: E402

PROTOCOL = f'viser-v{viser.__version__}'
PATIENCE = 20.0


class Served(NamedTuple):
    """A running `view`: its process, host and port as a browser writes them, and its token."""

    process: 'subprocess.Popen[str]'
    host: str
    port: int
    token: str

    @property
    def netloc(self) -> str:
        """Return what stands in the headers Host and Origin of its own page."""
        return f'{self.host}:{self.port}'


@contextmanager
def served(*arguments: str, environment: dict[str, str] | None = None) -> Iterator[Served]:
    """Run the command `view` within the block; it must end with 0 and without a traceback."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'kinematics_service', 'view', '--port', '0', *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | (environment or {}),
    )
    try:
        line = process.stdout.readline() if process.stdout else ''
        address = re.match(r'http://([^/?\s]+):(\d+)(?:/\?token=(\S+))? shows ', line)
        assert address, line + (process.stderr.read() if process.stderr else '')
        yield Served(process, address[1], int(address[2]), address[3] or '')
        assert process.poll() is None, 'the view has ended by itself'
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
        assert process.returncode == 0, err
        assert 'Traceback' not in out + err
        assert 'Error' not in out + err
    finally:
        process.kill()
        process.wait()


def handshake(view: Served, *headers: str, path: str = '/') -> bytes:
    """
    Return the request for a websocket, with exactly these headers besides those of the protocol.
    """
    key = base64.b64encode(os.urandom(16)).decode()
    lines = (
        f'GET {path} HTTP/1.1',
        *headers,
        'Upgrade: websocket',
        'Connection: Upgrade',
        f'Sec-WebSocket-Key: {key}',
        'Sec-WebSocket-Version: 13',
        f'Sec-WebSocket-Protocol: {PROTOCOL}',
    )
    return '\r\n'.join((*lines, '', '')).encode()


def frame(payload: bytes, opcode: int = 2) -> bytes:
    """Return a masked frame, as clients send them."""
    mask = os.urandom(4)
    length = len(payload)
    if length < 126:
        head = struct.pack('!BB', 0x80 | opcode, 0x80 | length)
    else:
        head = struct.pack('!BBH', 0x80 | opcode, 0x80 | 126, length)
    return head + mask + bytes(byte ^ mask[k % 4] for k, byte in enumerate(payload))


def update(uuid: str, **updates: Any) -> bytes:
    """Return the message by which a client changes a thing of the panel."""
    return msgspec.msgpack.encode({'type': 'GuiUpdateMessage', 'uuid': uuid, 'updates': updates})


def exchange(view: Served, data: bytes) -> bytes:
    """Send bytes at once and return what comes back until the other end closes, or for a while."""
    target = '127.0.0.1' if view.host == 'localhost' else view.host
    with socket.create_connection((target, view.port), timeout=PATIENCE) as line:
        line.sendall(data)
        line.settimeout(0.5)
        answer = b''
        try:
            while piece := line.recv(65536):
                answer += piece
        except (TimeoutError, ConnectionResetError):
            pass
        return answer


def status_of(answer: bytes) -> int:
    """Return the status of an HTTP answer."""
    return int(answer.split(None, 2)[1]) if answer.startswith(b'HTTP/') else 0


def own_connection(view: Served, **options: Any) -> ClientConnection:
    """Return a connection as the page itself opens it."""
    if view.token:
        options['additional_headers'] = {'Cookie': f'kinematics_view_{view.port}={view.token}'}
    return connect(
        f'ws://{view.netloc}',
        origin=f'http://{view.netloc}',
        subprotocols=[PROTOCOL],
        max_size=None,
        **options,
    )


def get(view: Served, path: str = '/', **headers: str) -> tuple[int, dict[str, str]]:
    """Return status and headers of a plain request for the page."""
    request = urllib.request.Request(f'http://{view.netloc}{path}', headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
            answer.read()
            return answer.status, dict(answer.headers)
    except urllib.error.HTTPError as refusal:
        return refusal.code, dict(refusal.headers)


class Thing(NamedTuple):
    """A thing of the panel: its name for messages, label and value."""

    uuid: str
    label: str
    value: Any


def panel_of(view: Served) -> list[Thing]:
    """Return the things of the panel that have values, as a page that is opened now sees them."""
    found: dict[str, Thing] = {}
    with own_connection(view) as connection:
        while True:
            data = connection.recv(timeout=PATIENCE)
            assert isinstance(data, bytes)
            length = int.from_bytes(data[8:16], 'little')
            inner = zstandard.ZstdDecompressor().decompress(data[16 : 16 + length])
            for message in msgspec.msgpack.decode(inner)['messages']:
                kind, uuid = message['type'], message.get('uuid')
                if kind == 'ReplayDoneMessage':
                    return list(found.values())
                if kind.startswith('Gui') and 'value' in message:
                    label = message['props'].get('label', '')
                    found[uuid] = Thing(uuid, label, message['value'])
                if kind == 'GuiUpdateMessage' and uuid in found:
                    value = message['updates'].get('value', found[uuid].value)
                    found[uuid] = found[uuid]._replace(value=value)
