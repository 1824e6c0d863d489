"""A slider along the self-motion of the posture shown: the joints move, and the tool stays."""

import numpy as np
import viser

from ....kernel import Floats
from ....kinematics.forward import forward_kinematics
from ....kinematics.inverse.problem.target import ik_target_of
from ....kinematics.inverse.self_motion.arcs import IkArc
from ....kinematics.inverse.self_motion.best_posture import has_arcs, place_on_arc
from ....robot.robot import Robot
from ....robot.task import ROW_NAMES
from .sliders import Sliders

STEP = 0.001


class SelfMotionSlider:
    """
    A slider from one end to the other of the arc inside the limits of the posture that is shown.

    The arc is found where the joints' sliders come to rest; until then it is locked.

    Parameters
    ----------
    server
        The server whose panel's current folder gets the slider, of an arm with one joint more
        than a pose of its tool asks for, or a position of it. Of other arms there is none.
    robot
        The arm.
    """

    def __init__(self, server: viser.ViserServer, robot: Robot) -> None:
        self._robot = robot
        ways = (ROW_NAMES, ROW_NAMES[:3])
        self._rows = next((rows for rows in ways if has_arcs(robot, rows, '')), None)
        self._arc: IkArc | None = None
        self._looked = False
        # The positions of the joints' sliders, and those on the arc that they are rounded from.
        self._shown = self._q = np.empty(0)
        self._share = 0.5
        if self._rows is None:
            return
        kept = 'pose' if self._rows == ROW_NAMES else 'position'
        self._handle = server.gui.add_slider(
            'self-motion',
            min=0.0,
            max=1.0,
            step=STEP,
            initial_value=self._share,
            disabled=True,
            hint=f'the joints move and the {kept} of the tool stays; it ends where a joint is '
            'at a limit, or at a singular pose',
        )

    def lead(self, sliders: Sliders) -> Floats:
        """Return the joint positions (n,) to be shown, the joints' sliders moved there."""
        shown = sliders.positions
        if self._rows is None:
            return shown
        if not np.array_equal(shown, self._shown):
            self.release()
            self._shown = shown
            return shown
        if not self._looked:
            self._find(shown)
        share = float(self._handle.value)
        if self._arc is None:
            return shown
        if share != self._share:
            self._share = share
            self._q = self._arc.at(share * self._arc.length)
            sliders.move(self._q)
            self._shown = sliders.positions
        return self._q

    def release(self) -> None:
        """Lock the slider: another posture is shown."""
        self._arc, self._looked = None, False
        if self._rows is not None and not self._handle.disabled:
            self._handle.disabled = True

    def _find(self, q: Floats) -> None:
        self._looked = True
        pose = forward_kinematics(self._robot, q)
        place = place_on_arc(self._robot, ik_target_of(self._robot, pose, self._rows), q)
        if place is None or not place.arc.length > 0.0:
            return
        self._arc, self._q = place.arc, q
        self._share = float(np.clip(round(place.s / place.arc.length, 3), 0.0, 1.0))
        self._handle.value = self._share
        self._handle.disabled = False
