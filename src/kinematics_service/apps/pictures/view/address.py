# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Check the host and the port of the live view's web page."""

import errno
import socket
from typing import NamedTuple

from ....errors import ViewError


class Address(NamedTuple):
    """
    Host and port of the page.

    Attributes
    ----------
    host, port
        The address at which the page is served; port 0 means any free port.
    more_names
        Further host names under which browsers may open the page.
    """

    host: str
    port: int
    more_names: tuple[str, ...] = ()


def check_address(host: str, port: int) -> None:
    """
    Raise an error unless a server can listen at this host and port; port 0 means any free port.

    Raises
    ------
    ViewError
        The port is taken, or the host is not an address of this computer.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except OSError:
        message = (
            f'--host {host}: no such host; give an address of this computer, such as 127.0.0.1'
        )
        raise ViewError(message, code='unknown-name') from None
    try:
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
            probe.listen()
    except PermissionError:
        message = f'--port {port}: ports below 1024 need privileges; choose another with --port'
        raise ViewError(message, code='not-permitted') from None
    except OSError as error:
        if error.errno == errno.EADDRNOTAVAIL:
            raise ViewError(
                f'--host {host}: not an address of this computer; give 127.0.0.1 for this '
                'computer only, or 0.0.0.0 for all of the network',
                code='wrong-address',
            ) from None
        raise ViewError(
            f'--port {port}: another program uses it on {host}; '
            f'choose another, such as --port {port + 1}, or 0 for any free port',
            code='port-in-use',
        ) from None
