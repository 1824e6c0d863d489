# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Run the loop behind the page, 30 times a second: read messages or sliders, compute, show."""

import sys
import time
from collections.abc import Callable

from ....errors import LoopError
from ....kernel import Floats
from ....node.drawing.observation import Observation
from ....robot.robot import Robot
from .address import Address
from .origin_check import ANYWHERE
from .page import Page, serve
from .viewpoint import Viewpoint

# Period of the loop, s.
PERIOD = 1.0 / 30.0


class ArmSource:
    """
    The arm that the page shows, and the source of its joint states. Without ROS only sliders move
    the arm.

    Sources with ROS inherit from this class.

    Attributes
    ----------
    robot
        The arm to show; if the arm changes, this becomes another object.
    nodes
        Full names of the nodes whose arms can be shown.
    """

    nodes: tuple[str, ...] = ()

    def __init__(self, robot: Robot, status: str = '') -> None:
        self.robot, self._status = robot, status

    @property
    def title(self) -> str:
        """Return the title of the page's panel: the name of the arm."""
        return self.robot.name

    @property
    def status(self) -> str:
        """
        Return one line of text: the source of the observation, or the reason why the observation
        is missing.
        """
        return self._status

    @property
    def node(self) -> str:
        """Return the full name of the arm's node; empty without ROS."""
        return ''

    def choose(self, node: str) -> None:
        """Show the arm of another node; without ROS do nothing."""

    def listen(self, seconds: float) -> None:
        """Receive messages for `seconds`; without ROS only wait."""
        time.sleep(seconds)

    def observation(self) -> Observation | None:
        """Return the newest observation, or None while joint states are missing."""
        return None

    def publish(self, q: Floats) -> str:
        """Publish joint positions; return the reason of a refusal, or an empty text."""
        return 'there is no ROS here'


def run_page(
    source: ArmSource, address: Address, publishable: bool, ended: Callable[[], bool]
) -> None:
    """
    Serve a page that shows an arm, until `ended` returns True.

    Parameters
    ----------
    source
        The arm and the source of its joint states. The sliders move the arm while joint states are
        missing.
    address
        Host and port of the page.
    publishable
        Whether the page has a check box that lets the sliders publish joint states.
    ended
        Function that returns whether to stop.

    Raises
    ------
    ViewError
        The port is taken, the host is not an address of this computer, or the installed viser
        cannot refuse pages of other sites.
    """
    with serve(address, source.robot.name) as (server, url):
        viewpoint = Viewpoint(server)
        page = Page(server, viewpoint, source.robot, publishable)
        print(f'{url} shows {source.title}; {source.status}; Ctrl-C ends it', flush=True)
        if address.host in ANYWHERE:
            print(
                f'kinematics_service: {address.host}: anyone on the network sees the page who '
                'has this address, with its token and a name of this computer',
                file=sys.stderr,
            )
        was_live = False
        while not ended():
            begin = time.monotonic()
            if source.robot is not page.robot:
                page = Page(server, viewpoint, source.robot, publishable)
                print(f'it shows {source.title}', flush=True)
            live = source.observation() is not None
            if live != was_live:
                print(f'now {source.status}', flush=True)
                was_live = live
            turn(page, source)
            # Wait at least a fifth of the period, so that slow drawing does not use all of the
            # processor.
            source.listen(max(0.2 * PERIOD, PERIOD - (time.monotonic() - begin)))


def turn(page: Page, source: ArmSource) -> None:
    """Show the current observation, or change to the node that a user has chosen."""
    chosen = page.offer(source.nodes, source.node)
    if chosen != source.node:
        source.choose(chosen)
        return
    seen, status, publishes = source.observation(), source.status, page.wants_to_publish
    if publishes or seen is None:
        q, qdot = page.lead()
        observed, status = _observed(page, q, qdot, status)
    if publishes:
        refusal = source.publish(q)
        publishes = not refusal
        status = f'not publishing: {refusal}' if refusal else f'publishing; {status}'
    if seen is not None and not publishes:
        page.follow(seen.q)
    page.show(seen or observed, source.title, status)


def _observed(page: Page, q: Floats, qdot: Floats | None, status: str) -> tuple[Observation, str]:
    # Return the observation at the sliders' positions, and the status. If a loop does not close,
    # return the last observation, and the reason as status.
    try:
        return page.observed(q, qdot), status
    except LoopError as error:
        return page.last, str(error)
