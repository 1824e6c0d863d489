"""
The solver of targets, made ready beside the node's work.

"""

import threading
from collections.abc import Callable

from ..inverse.ready import make_ready
from ..inverse.servo import joint_velocity
from ..inverse.solve import inverse_kinematics
from .settings import Settings
from .topics import sample_report


class Solver:
    """
    Whether inverse kinematics is compiled; it is begun when this is made.

    The first time on a machine that takes half a minute, later a fraction of a second: too long
    to wait for in front of joint states, so it has a thread. Nothing else runs in one.

    Parameters
    ----------
    settings
        The arm to be ready for.
    fail
        Called, in the thread, with a sentence if it cannot be made ready.

    """

    def __init__(self, settings: Settings, fail: Callable[[str], object]) -> None:
        self._settings = settings
        self._fail = fail
        self._there = threading.Event()
        self._thread = threading.Thread(target=self._load, daemon=True)
        self._thread.start()

    @property
    def is_there(self) -> bool:
        """
        Return whether targets can be answered.

        """
        return self._there.is_set()

    @property
    def is_loading(self) -> bool:
        """
        Return whether it is being compiled or read from its cache.

        """
        return self._thread.is_alive()

    def wait(self, seconds: float) -> bool:
        """
        Return whether it is there, within a time.

        """
        return self._there.wait(seconds)

    def _load(self) -> None:
        settings = self._settings
        robot = settings.robot
        try:
            make_ready()
            # What is found out about an arm once.
            state = sample_report(settings).answer.state
            inverse_kinematics(robot, state.pose, near=state.q, rows=settings.target_rows)
            joint_velocity(robot, state, state.twist, settings.servo)
        except Exception as error:  # the node's other work goes on
            self._fail(f'targets cannot be answered: {error!a}')
            return
        self._there.set()
