"""
The loop behind the page: hear or read the sliders, look, show; some thirty times a second.

"""

import sys
import time
from collections.abc import Callable
from typing import Protocol

from ..kernel import Floats
from ..robot import Robot
from .observation import Observation, observe
from .page import Page, serve

PERIOD = 1.0 / 30.0


class Source(Protocol):
    """
    Where joint states come from; `ros.view_listener` has one.

    """

    def listen(self, seconds: float) -> None:
        """
        Hear what comes for so long.

        """

    def observation(self) -> Observation | None:
        """
        Return the newest observation; None while no joint states come.

        """

    @property
    def status(self) -> str:
        """
        Return in a line where the observation comes from, or why there is none.

        """

    def publish(self, q: Floats) -> str:
        """
        Publish joint positions; return a reason where that is refused, empty where it is done.

        """


class Silence:
    """
    The source of a page without ROS: it hears nothing.

    """

    def __init__(self, status: str) -> None:
        self.status = status

    def listen(self, seconds: float) -> None:
        """
        Let the time pass.

        """
        time.sleep(seconds)

    def observation(self) -> Observation | None:
        """
        Return nothing.

        """
        return None

    def publish(self, q: Floats) -> str:
        """
        Refuse.

        """
        return 'there is no ROS here'


def run_page(
    robot: Robot,
    source: Source,
    host: str,
    port: int,
    publishable: bool,
    ended: Callable[[], bool],
) -> int:
    """
    Serve a page of an arm; return the port it was served at.

    Parameters
    ----------
    robot
        The arm.
    source
        Where joint states come from; the sliders move the arm while none come.
    host, port
        Where to serve it.
    publishable
        Whether to offer to publish the sliders.
    ended
        Whether to stop.

    Raises
    ------
    ServerAddressError
        The port is taken, or the host is no address of this computer.

    """
    with serve(robot, host, port, publishable) as (page, address):
        print(f'{address} shows {robot.name}; {source.status}; Ctrl-C ends it', flush=True)
        if host in ('0.0.0.0', '::'):
            print(f'kinematics_service: {host}: everybody on the network sees it', file=sys.stderr)
        while not ended():
            begin = time.monotonic()
            turn(page, source)
            # At least a little rest: where drawing is slow the page stays slow, not the computer.
            source.listen(max(0.2 * PERIOD, PERIOD - (time.monotonic() - begin)))
    return int(address.rpartition(':')[2])


def turn(page: Page, source: Source) -> None:
    """
    Show what is to be seen now.

    """
    seen = source.observation()
    if page.wants_to_publish:
        q, qdot = page.lead()
        refusal = source.publish(q)
        if not refusal:
            page.show(seen or observe(page.robot, q, qdot), f'publishing; {source.status}')
            return
        status = f'not publishing: {refusal}'
    else:
        status = source.status
    if seen is not None:
        page.follow(seen.q)
        page.show(seen, status)
        return
    q, qdot = page.lead()
    page.show(observe(page.robot, q, qdot), status)
