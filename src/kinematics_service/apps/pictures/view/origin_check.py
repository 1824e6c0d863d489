# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check the origin of a request: the host name, the page that sends it, and the token.

A page of another site must not move the sliders. A browser would let such a page connect to this
server. The site can also make its own host name resolve to this computer (DNS rebinding). So the
server checks each request before it reads a message of the client.
"""

import hmac
import ipaddress
import secrets
import socket
from collections.abc import Sequence
from typing import NamedTuple, Protocol
from urllib.parse import parse_qsl, urlsplit

# Status codes of HTTP.
BAD_REQUEST = 400
FORBIDDEN = 403
TOKEN = 'token'
# Hosts that mean all addresses of this computer.
ANYWHERE = ('0.0.0.0', '::')
# The name of the cookie contains the port, because browsers share cookies between ports.
COOKIE = 'kinematics_view_{port}'
# Number of random bytes of a token, so that it cannot be guessed.
TOKEN_BYTES = 24


class Headers(Protocol):
    """The headers of a request; a name may occur several times."""

    def get_all(self, key: str) -> list[str]:
        """Return all values of a header."""


class HttpRefusal(NamedTuple):
    """The refusal of an HTTP request: a status code, and a sentence for the client."""

    status: int
    sentence: str


class OriginCheck(NamedTuple):
    """
    Decides which clients get the page and may open its websocket.

    Attributes
    ----------
    names
        Host names, in lower case, under which a browser may open the page. `localhost` and IP
        addresses of this computer are accepted, too.
    token
        The token that the URL or a cookie of a request must contain; empty if every user of this
        computer may see the page.
    """

    names: frozenset[str]
    token: str

    def refusal(
        self, path: str, headers: Headers, called: tuple[str, int], protocol: str
    ) -> HttpRefusal | None:
        """
        Return the refusal of a request, or None if the request is accepted.

        Parameters
        ----------
        path
            The path of the request, with its query.
        headers
            The headers of the request.
        called
            The address and the port of this computer that received the request.
        protocol
            The websocket protocol of the page's own client.
        """
        hosts, origins = headers.get_all('Host'), headers.get_all('Origin')
        if len(hosts) != 1 or len(origins) > 1:
            return HttpRefusal(BAD_REQUEST, 'A request has one Host, and at most one Origin.')
        if not self._is_served_as(hosts[0], called[0]):
            return HttpRefusal(
                FORBIDDEN,
                f'This page is not served as {hosts[0]!a}. '
                'If it should be, start the view with --allow-host NAME.',
            )
        # Check the origin only if the request has one: a browser always sends the origin of the
        # page that opens a websocket, but other programs may omit the origin.
        if origins and _netloc(origins[0]) != hosts[0]:
            return HttpRefusal(FORBIDDEN, 'Pages of other sites may not connect to this one.')
        if any(name != TOKEN for name, _ in _query(path)):
            # Refuse an address with any parameter other than the token. A parameter could name
            # another server, and viser's page would connect to that server and obey it.
            return HttpRefusal(
                FORBIDDEN, f'The address of this page takes no parameter except {TOKEN}.'
            )
        if not (self.is_shown_by(path) or self._is_remembered(headers, called[1])):
            return HttpRefusal(
                FORBIDDEN,
                'This page needs its token: open the address that the command has printed, '
                f'which ends with /?{TOKEN}=...',
            )
        if headers.get_all('Upgrade') and headers.get_all('Sec-WebSocket-Protocol') != [protocol]:
            return HttpRefusal(BAD_REQUEST, f'This server speaks {protocol}: reload the page.')
        return None

    def is_shown_by(self, path: str) -> bool:
        """
        Return whether a client may see the page at this address: the address contains the token,
        or no token is needed.
        """
        shown = (value for name, value in _query(path) if name == TOKEN)
        return not self.token or any(map(self._is_token, shown))

    def address(self, host: str, port: int) -> str:
        """Return the address to open in a browser."""
        shown = 'localhost' if host in ANYWHERE else host
        name = f'[{shown}]' if ':' in shown else shown
        return f'http://{name}:{port}' + (f'/?{TOKEN}={self.token}' if self.token else '')

    def cookie(self, port: int) -> str:
        """
        Return the cookie with the token, which a browser does not send for pages of other sites.
        """
        return f'{COOKIE.format(port=port)}={self.token}; Path=/; HttpOnly; SameSite=Strict'

    def _is_served_as(self, host: str, called: str) -> bool:
        try:
            parts = urlsplit(f'//{host}')
            name, _ = parts.hostname or '', parts.port  # a wrong port raises ValueError
        except ValueError:
            return False
        if '@' in parts.netloc:
            return False
        # Refuse an unknown host name, because a foreign site can make its own host name resolve to
        # this computer (DNS rebinding). Accept the IP address of this computer, because a foreign
        # site cannot have this address.
        return is_loopback(name) or name in self.names or name == called.removeprefix('::ffff:')

    def _is_remembered(self, headers: Headers, port: int) -> bool:
        cookies = (part.strip() for line in headers.get_all('Cookie') for part in line.split(';'))
        start = f'{COOKIE.format(port=port)}='
        tokens = (cookie.removeprefix(start) for cookie in cookies if cookie.startswith(start))
        return any(map(self._is_token, tokens))

    def _is_token(self, text: str) -> bool:
        return hmac.compare_digest(text.encode(errors='surrogateescape'), self.token.encode())


def origin_check_of(host: str, more_names: Sequence[str]) -> OriginCheck:
    """
    Return the HTTP origin check of the live view: the host names it accepts, and the token it
    needs.

    Parameters
    ----------
    host
        The host of the page. The page needs a token unless `host` is a loopback address.
    more_names
        Further host names of the page, for example those of a proxy. If names are given, the page
        needs a token.
    """
    if is_loopback(host) and not more_names:
        return OriginCheck(frozenset(), '')
    hostname = socket.gethostname().lower()
    names = {host.lower(), hostname, f'{hostname.partition(".")[0]}.local'} - set(ANYWHERE)
    names |= {name.lower() for name in more_names}
    return OriginCheck(frozenset(names), secrets.token_urlsafe(TOKEN_BYTES))


def is_loopback(host: str) -> bool:
    """Return whether a host name or address is local to this computer."""
    if host == 'localhost':
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _netloc(origin: str) -> str:
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return ''


def _query(path: str) -> list[tuple[str, str]]:
    return parse_qsl(path.partition('?')[2], keep_blank_values=True)
