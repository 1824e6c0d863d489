"""
Who may come in: the port the page is served at, and the pages that may talk to it.

A browser lets every page it shows open a connection to a server on the same computer. A page of
somebody else must not move the sliders, so connections it opens are refused.
"""

import errno
import ipaddress
import socket
from typing import Any
from urllib.parse import urlsplit

import viser

from ..errors import KinematicsError

FORBIDDEN = 1008  # the websocket code for a violated policy (RFC 6455, 7.4.1)


class ServerAddressError(KinematicsError, ValueError):
    """
    The page cannot be served at this host and port; the message says why and what to change.

    """


def check_address(host: str, port: int) -> None:
    """
    Return if a server can listen there; port 0 means any free one.

    Raises
    ------
    ServerAddressError
        The port is taken, or the host is no address of this computer.

    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except OSError:
        raise ServerAddressError(f'--host {host}: no such host') from None
    try:
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
            probe.listen()
    except PermissionError:
        raise ServerAddressError(
            f'--port {port}: ports below 1024 need privileges; choose another with --port'
        ) from None
    except OSError as error:
        if error.errno == errno.EADDRNOTAVAIL:
            raise ServerAddressError(
                f'--host {host}: not an address of this computer; '
                '127.0.0.1 is for this computer only, 0.0.0.0 for all of the network'
            ) from None
        raise ServerAddressError(
            f'--port {port}: taken by another program on {host}; '
            f'choose another, such as --port {port + 1}, or 0 for any that is free'
        ) from None


def may_talk(origin: str | None, asked: str | None, loopback_only: bool) -> bool:
    """
    Return whether a connection comes from the page itself, or from a program that is no browser.

    Parameters
    ----------
    origin
        Header `Origin`: the page that opens the connection; a browser always says it.
    asked
        Header `Host`: the name under which this server was asked for.
    loopback_only
        Whether the server is for this computer only. A name that is not this computer's was then
        bent to it by somebody else's name server.

    """
    if origin is None:
        return True
    if asked is None or urlsplit(origin).netloc != asked:
        return False
    return not loopback_only or is_loopback(urlsplit(f'//{asked}').hostname or '')


def is_loopback(host: str) -> bool:
    """
    Return whether a host name or address is that of the computer itself.

    """
    if host == 'localhost':
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def guard(server: viser.ViserServer, host: str) -> None:
    """
    Close connections that other pages open, and keep the server from being shared outside.

    """
    loopback_only = is_loopback(host)
    sockets = server._websock_server

    async def admit(client: Any) -> None:
        connection = sockets._live_connections[client.client_id]
        headers = connection.request.headers
        if not may_talk(headers.get('Origin'), headers.get('Host'), loopback_only):
            await connection.close(FORBIDDEN, 'pages of others may not control this one')

    # Awaited before anything the client says is read.
    sockets.on_client_connect(admit)
    # viser's client can ask for a public address; nobody may.
    vars(server)['request_share_url'] = lambda *args, **options: None
