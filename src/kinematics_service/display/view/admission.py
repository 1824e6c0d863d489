"""
Who is let in: names under which the page is asked for, pages that may talk to it, and the token.

A browser lets every page it shows open connections to any server it can reach, and somebody's name
server may say that his name is this computer's address. A page of somebody else must not move the
sliders. The request alone decides, before anything else that a client sends is looked at.
"""

import hmac
import ipaddress
import secrets
import socket
from collections.abc import Sequence
from typing import NamedTuple, Protocol
from urllib.parse import parse_qsl, urlsplit

BAD_REQUEST, FORBIDDEN = 400, 403
TOKEN = 'token'
# Hosts that mean all addresses of this computer.
ANYWHERE = ('0.0.0.0', '::')
# Cookies do not tell ports apart: the port is in the name.
COOKIE = 'kinematics_view_{port}'
# Random bytes of a token: beyond guessing.
TOKEN_BYTES = 24


class Headers(Protocol):
    """Headers of a request, of which a name may stand there several times."""

    def get_all(self, key: str) -> list[str]:
        """Return all values of a header."""


class HttpRefusal(NamedTuple):
    """A status of HTTP, and a sentence for whoever asked."""

    status: int
    sentence: str


class OriginCheck(NamedTuple):
    """
    Who may ask for the page, and who may open its websocket.

    Attributes
    ----------
    names
        Host names under which it is served, in lower case, besides `localhost` and addresses.
    token
        What the address or a cookie must hold; empty where whoever uses this computer may look.
    """

    names: frozenset[str]
    token: str

    def refusal(
        self, path: str, headers: Headers, called: tuple[str, int], protocol: str
    ) -> HttpRefusal | None:
        """
        Return why a request is refused; None for one that is let in.

        Parameters
        ----------
        path
            What is asked for, with its query.
        headers
            The headers of the request.
        called
            The address and the port of this computer at which the request came in.
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
                'Where it should be, start the view with --allow-host NAME.',
            )
        # A browser always says whose page opens a websocket; a program need not.
        if origins and _netloc(origins[0]) != hosts[0]:
            return HttpRefusal(FORBIDDEN, 'Pages of others may not talk to this one.')
        if any(name != TOKEN for name, _ in _query(path)):
            # The page would connect to any server that its address names, and obey it.
            return HttpRefusal(
                FORBIDDEN, f'The address of this page has no parameter but {TOKEN}.'
            )
        if not (self.is_shown_by(path) or self._is_remembered(headers, called[1])):
            return HttpRefusal(
                FORBIDDEN,
                'This page needs its token: open the address that the command has printed, '
                f'which ends with /?{TOKEN}=...',
            )
        if headers.get_all('Upgrade') and headers.get_all('Sec-WebSocket-Protocol') != [protocol]:
            return HttpRefusal(BAD_REQUEST, f'This server speaks {protocol}: load the page anew.')
        return None

    def is_shown_by(self, path: str) -> bool:
        """Return whether an address holds the token, or none is needed."""
        shown = (value for name, value in _query(path) if name == TOKEN)
        return not self.token or any(map(self._is_token, shown))

    def address(self, host: str, port: int) -> str:
        """Return the address to open in a browser."""
        shown = 'localhost' if host in ANYWHERE else host
        name = f'[{shown}]' if ':' in shown else shown
        return f'http://{name}:{port}' + (f'/?{TOKEN}={self.token}' if self.token else '')

    def cookie(self, port: int) -> str:
        """
        Return the cookie by which a browser remembers the token, for no page of anybody else.
        """
        return f'{COOKIE.format(port=port)}={self.token}; Path=/; HttpOnly; SameSite=Strict'

    def _is_served_as(self, host: str, called: str) -> bool:
        try:
            name = urlsplit(f'//{host}').hostname or ''
        except ValueError:
            return False
        # A name can be bent to this computer by whoever owns it, an address cannot.
        return is_loopback(name) or name in self.names or name == called.removeprefix('::ffff:')

    def _is_remembered(self, headers: Headers, port: int) -> bool:
        cookies = (part.strip() for line in headers.get_all('Cookie') for part in line.split(';'))
        start = f'{COOKIE.format(port=port)}='
        return any(
            self._is_token(cookie.removeprefix(start))
            for cookie in cookies
            if cookie.startswith(start)
        )

    def _is_token(self, text: str) -> bool:
        return hmac.compare_digest(text.encode(errors='surrogateescape'), self.token.encode())


def origin_check_of(host: str, more_names: Sequence[str]) -> OriginCheck:
    """
    Return who is let in to a page served at a host.

    Parameters
    ----------
    host
        Where it is served. Anything but this computer's own address makes the token.
    more_names
        Names under which it is reached besides, through a proxy for instance; they do so too.
    """
    if is_loopback(host) and not more_names:
        return OriginCheck(frozenset(), '')
    here = socket.gethostname().lower()
    names = {host.lower(), here, f'{here.partition(".")[0]}.local'} - set(ANYWHERE)
    return OriginCheck(
        frozenset(names.union(name.lower() for name in more_names)),
        secrets.token_urlsafe(TOKEN_BYTES),
    )


def is_loopback(host: str) -> bool:
    """Return whether a host name or address is that of the computer itself."""
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
