# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Offer a slider along the self-motion of a redundant arm: the joints move, the tool stays."""

import numpy as np
import viser

from ....kernel import Floats
from ....kinematics.forward import forward_kinematics
from ....kinematics.inverse.problem.target import ik_target_of
from ....kinematics.inverse.self_motion.arcs import IkArc
from ....kinematics.inverse.self_motion.best_posture import has_arcs, place_on_arc
from ....robot.robot import Robot
from ....robot.task import ROW_NAMES
from .sliders import STEP, Sliders


class SelfMotionSlider:
    """
    A slider along the self-motion through the shown configuration, as far as the limits allow.

    The slider is locked until the joints' sliders rest and the arc of configurations is computed.

    Parameters
    ----------
    server
        The web server. If the arm has one joint more than the task needs, the slider is added to
        the panel of the page, in the folder that the caller has opened by
        `with server.gui.add_folder(...)`. The task is the tool's pose, or its position.
    robot
        The arm.
    """

    def __init__(self, server: viser.ViserServer, robot: Robot) -> None:
        self._robot = robot
        tasks = (ROW_NAMES, ROW_NAMES[:3])
        self._rows = next((rows for rows in tasks if has_arcs(robot, rows, '')), None)
        self._arc: IkArc | None = None
        self._searched = False
        # `_shown` are the joint positions that the joints' sliders show, rounded to slider steps.
        # `_q` are the exact joint positions on the arc.
        self._shown = self._q = np.empty(0)
        self._ratio = 0.5
        if self._rows is None:
            return
        kept = 'pose' if self._rows == ROW_NAMES else 'position'
        self._handle = server.gui.add_slider(
            'self-motion',
            min=0.0,
            max=1.0,
            step=STEP,
            initial_value=self._ratio,
            disabled=True,
            hint=f'the joints move and the {kept} of the tool stays; it ends where a joint is '
            'at a limit, or at a singular pose',
        )

    def lead(self, sliders: Sliders) -> Floats:
        """Return the joint positions (n,) to show, and move the joints' sliders to them."""
        shown = sliders.positions
        if self._rows is None:
            return shown
        if not np.array_equal(shown, self._shown):
            self.release()
            self._shown = shown
            return shown
        if not self._searched:
            self._find_arc(shown)
        ratio = float(self._handle.value)
        if self._arc is None:
            return shown
        if ratio != self._ratio:
            self._ratio = ratio
            self._q = self._arc.at(ratio * self._arc.length)
            sliders.move(self._q)
            self._shown = sliders.positions
        return self._q

    def release(self) -> None:
        """Lock the slider, because another configuration is shown."""
        self._arc, self._searched = None, False
        if self._rows is not None and not self._handle.disabled:
            self._handle.disabled = True

    def _find_arc(self, q: Floats) -> None:
        self._searched = True
        pose = forward_kinematics(self._robot, q)
        on_arc = place_on_arc(self._robot, ik_target_of(self._robot, pose, self._rows), q)
        if on_arc is None or not on_arc.arc.length > 0.0:
            return
        self._arc, self._q = on_arc.arc, q
        self._ratio = float(np.clip(round(on_arc.s / on_arc.arc.length, 3), 0.0, 1.0))
        self._handle.value = self._ratio
        self._handle.disabled = False
