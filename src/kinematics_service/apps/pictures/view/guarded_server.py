# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Start viser's server with stricter checks of connections and of messages from clients.

The checks depend on three details of viser. It starts its server by one call of
`websockets.asyncio.server.serve` with keywords, reads messages by `recv`, and keeps the elements
of the panel in `gui._gui_input_handle_from_uuid`. At each start the module tests the checks: it
opens a connection as the page of another site, and sends a message that no panel would send. If
viser has changed and accepts one of the two, the server is stopped.
"""

import io
import logging
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from typing import Any

import viser
import websockets.asyncio.server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed, ConnectionClosedError, InvalidStatus
from websockets.http11 import Request, Response
from websockets.sync.client import connect

from ....errors import ViewError
from .client_messages import MessageError, is_taken
from .origin_check import FORBIDDEN, OriginCheck

# The websocket code for a violated policy (RFC 6455, 7.4.1).
POLICY = 1008
# Largest accepted message of a page, bytes. A message with a slider's value or a camera has some
# hundred bytes.
MAX_MESSAGE_SIZE = 16_384
# Time limit of an answer to a test connection on a busy computer, s.
CONNECT_TIMEOUT = 20.0
PROTOCOL = f'viser-v{viser.__version__}'
HEADERS = {
    # Other sites must not embed the page in a frame of their own, where they could trick the user
    # into clicking. The page may connect only to its own server.
    'Content-Security-Policy': "frame-ancestors 'none'; connect-src 'self' data: blob:",
    'X-Frame-Options': 'DENY',
    'X-Content-Type-Options': 'nosniff',
    'Referrer-Policy': 'no-referrer',
}


@contextmanager
def guarded_server(
    host: str, port: int, label: str, origin_check: OriginCheck
) -> Iterator[viser.ViserServer]:
    """
    Run a viser server within the `with` block, for clients that pass the origin check.

    Raises
    ------
    ViewError
        Pages of other sites could connect to the server.
    """
    panel: dict[str, Any] = {}
    discarded = io.StringIO()  # receives the text that viser prints
    with redirect_stdout(discarded), _serving(origin_check, lambda: panel):
        server = viser.ViserServer(host=host, port=port, label=label, verbose=False)
    try:
        panel = server.gui._gui_input_handle_from_uuid
        _try_out(host, server.get_port(), origin_check)
        yield server
    finally:
        with redirect_stdout(discarded):
            server.stop()


@contextmanager
def _serving(origin_check: OriginCheck, panel: Callable[[], Mapping[str, Any]]) -> Iterator[None]:
    # Replace the `serve` of websockets within the `with` block by a function that adds the checks
    # of origin and messages.
    original = websocket_server.serve

    class PageConnection(ServerConnection):  # type: ignore[misc]
        async def recv(self, decode: bool | None = None) -> bytes | str:
            while True:
                data: bytes | str = await super().recv(decode)
                try:
                    if is_taken(data, panel()):
                        return data
                except MessageError as error:
                    await self.close(POLICY, str(error)[:100])
                    # Raise an error, so that messages that arrive while the connection closes are
                    # dropped.
                    raise ConnectionClosedError(None, None) from None

    def serve(
        *arguments: Any, process_request: Callable[..., Response | None], **options: Any
    ) -> websocket_server.serve:
        def check(connection: ServerConnection, request: Request) -> Response | None:
            refusal = origin_check.refusal(
                request.path, request.headers, connection.local_address[:2], PROTOCOL
            )
            if refusal is not None:
                return connection.respond(refusal.status, refusal.sentence + '\n')
            return process_request(connection, request)

        def complete(connection: ServerConnection, request: Request, response: Response) -> None:
            for name, value in HEADERS.items():
                response.headers[name] = value
            if origin_check.token and response.status_code == 200:
                port = connection.local_address[1]
                response.headers['Set-Cookie'] = origin_check.cookie(port)

        rules = {
            'process_request': check,
            'process_response': complete,
            'create_connection': PageConnection,
            'max_size': MAX_MESSAGE_SIZE,
            'logger': _logger(),
        }
        return original(*arguments, **(options | rules))

    websocket_server.serve = serve
    try:
        yield
    finally:
        websocket_server.serve = original


def _logger() -> logging.Logger:
    # Return a logger that does not print errors of clients.
    logger = logging.getLogger(__name__)
    if not os.environ.get('KINEMATICS_TRACEBACK'):
        logger.propagate = False
        logger.addHandler(logging.NullHandler())
        # asyncio would print a line for each message to a client that has disconnected.
        logging.getLogger('asyncio').setLevel(logging.ERROR)
    return logger


def _try_out(host: str, port: int, origin_check: OriginCheck) -> None:
    address = {'0.0.0.0': '127.0.0.1', '::': '::1'}.get(host, host)
    netloc = f'[{address}]:{port}' if ':' in address else f'{address}:{port}'
    options: Any = {
        'subprotocols': [PROTOCOL],
        'open_timeout': CONNECT_TIMEOUT,
        'additional_headers': {'Cookie': origin_check.cookie(port)},
        'max_size': None,
        'proxy': None,
    }
    refused = False
    try:
        connect(f'ws://{netloc}', origin='http://other.invalid', **options).close()
    except InvalidStatus as error:
        refused = error.response.status_code == FORBIDDEN
    closed = False
    with connect(f'ws://{netloc}', origin=f'http://{netloc}', **options) as connection:
        connection.send(b'no message')
        try:
            while True:
                connection.recv(timeout=CONNECT_TIMEOUT)
        except ConnectionClosed as error:
            closed = error.rcvd is not None and error.rcvd.code == POLICY
        except TimeoutError:
            pass
    if not (refused and closed):
        raise ViewError(
            f'viser {viser.__version__} does not let the page refuse pages of others, so nothing '
            'is served; install viser 1.1',
            code='unsupported',
        )
