# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Build the web page: the picture of the arm, the panel beside it, and the panel's switches."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import viser

from ....errors import ViewError
from ....kernel import Floats
from ....node.drawing.observation import Observation
from ....node.drawing.scene import scene_of
from ....robot.robot import Robot
from .address import Address, check_address
from .computed import observe
from .drawing import Drawing
from .guarded_server import guarded_server
from .origin_check import origin_check_of
from .panel import facts_html, gauges_html, jacobian_html, joints_html
from .self_motion_slider import SelfMotionSlider
from .sliders import Sliders, singular_pose
from .viewpoint import Viewpoint

# One entry for each group of drawn objects: name of the group, label of its check box, and whether
# the group is shown at first.
SWITCHES = (
    ('linear', 'ellipsoid of velocities (blue)', True),
    ('angular', 'ellipsoid of rotations (green)', False),
    ('velocity', 'velocity (violet) and rotation (green) arrows', True),
    ('trail', 'trail of the tool', True),
    ('axes', 'joint axes', True),
    ('frames', 'link frames', True),
)


class Page:
    """
    A page that shows one arm.

    Parameters
    ----------
    server
        The server of the page; elements of a former page are removed.
    viewpoint
        The camera of the page.
    robot
        The arm.
    publishable
        Whether the page has a check box that lets the sliders publish joint states.

    Attributes
    ----------
    robot
        The arm.
    sliders
        The sliders of the joints.
    """

    def __init__(
        self, server: viser.ViserServer, viewpoint: Viewpoint, robot: Robot, publishable: bool
    ) -> None:
        self.robot = robot
        self._server = server
        self._requested: Floats | None = None
        self._unlocked = True
        # The observation, title, status and layers that `show` drew last; None if `show` must draw
        # again.
        self._drawn: tuple[Observation, str, str, set[str]] | None = None
        server.scene.reset()
        gui = server.gui
        gui.reset()
        gui.configure_theme(control_width='large', show_logo=False, show_share_button=False)
        gui.set_panel_label(robot.name)
        gui.main_panel.dock_right()
        self._nodes = gui.add_dropdown('arm of', ('',), visible=False)
        self._gauges = gui.add_html('')
        with gui.add_folder('Joints'):
            self.sliders = Sliders(server, robot)
            self._self_motion = SelfMotionSlider(server, robot)
            hint = 'the sliders publish joint states, as the robot would'
            self._publish = gui.add_checkbox(
                'publish joint states', False, visible=publishable, hint=hint
            )
            regular = self.sliders.positions
            singular = singular_pose(robot, self.sliders.ranges, regular)
            self._buttons = [(gui.add_button('Regular pose'), regular)]
            if singular is not None:
                self._buttons.append((gui.add_button('Singular pose'), singular))
            for button, q in self._buttons:
                button.on_click(lambda _, q=q: setattr(self, '_requested', q))
        with gui.add_folder('Tool and measures'):
            self._facts = gui.add_html('')
        with gui.add_folder('Jacobian'):
            self._jacobian = gui.add_html('')
        with gui.add_folder('Limits'):
            self._joints = gui.add_html('')
        with gui.add_folder('Show', expand_by_default=False):
            self.last = self._at_rest = observe(robot, regular)
            first = scene_of(self.last)
            self._drawing = Drawing(server, first)
            self._switches = {name: gui.add_checkbox(label, on) for name, label, on in SWITCHES}
            gui.add_button('Clear the trail').on_click(lambda _: self._clear_trail())
        viewpoint.look_at(first)

    def offer(self, nodes: tuple[str, ...], node: str) -> str:
        """
        Put the running nodes into the page's list; return the node that the user has chosen.

        Parameters
        ----------
        nodes
            Full names of the running nodes.
        node
            The node whose arm is shown.
        """
        options = nodes if node in nodes else (node, *nodes)
        if self._nodes.options != options:
            self._nodes.options = options
            self._nodes.value = node
            self._nodes.visible = len(options) > 1
        return str(self._nodes.value)

    @property
    def wants_to_publish(self) -> bool:
        """Return whether the user has ticked the check box `publish joint states`."""
        return bool(self._publish.visible and self._publish.value)

    def follow(self, q: Floats) -> None:
        """Lock the sliders, and move them to the joint positions q (n,) of the arm."""
        self._set_unlocked(False)
        self._self_motion.release()
        self.sliders.jump(q)

    def lead(self) -> tuple[Floats, Floats | None]:
        """
        Unlock the sliders, and return the joint positions q (n,) and velocities qdot (n,) that
        they set; qdot: None at rest.
        """
        self._set_unlocked(True)
        requested, self._requested = self._requested, None
        if requested is not None:
            self.sliders.jump(requested)
            self._clear_trail()
        q = self._self_motion.lead(self.sliders)
        return q, self.sliders.velocities(q)

    def observed(self, q: Floats, qdot: Floats | None) -> Observation:
        """
        Return the observation at the sliders' positions q and velocities qdot, shape (n,) each.

        While the sliders rest (qdot is None), nothing is computed again.
        """
        if qdot is not None:
            return observe(self.robot, q, qdot)
        if not np.array_equal(q, self._at_rest.q):
            self._at_rest = observe(self.robot, q)
        return self._at_rest

    def _clear_trail(self) -> None:
        self._drawing.clear_trail()
        self._drawn = None

    def _set_unlocked(self, unlocked: bool) -> None:
        if unlocked == self._unlocked:
            return
        self._unlocked = unlocked
        self._clear_trail()
        self.sliders.enable(unlocked)
        for button, _ in self._buttons:
            button.disabled = not unlocked

    def show(self, seen: Observation, title: str, status: str) -> None:
        """
        Show an observation, a title and a status line; browsers receive only changes.

        If nothing has changed since the last call, return at once.
        """
        self.last = seen
        shown = {name for name, switch in self._switches.items() if switch.value}
        drawn = seen, title, status, shown
        if drawn == self._drawn:
            return
        # Set `_drawn` before drawing. If a button sets it to None during the drawing, the next
        # call of `show` draws again.
        self._drawn = drawn
        scene = scene_of(seen)
        with self._server.atomic():
            self._drawing.draw(scene, shown)
            for handle, content in (
                (self._gauges, gauges_html(seen, title, status)),
                (self._facts, facts_html(seen, scene)),
                (self._jacobian, jacobian_html(seen)),
                (self._joints, joints_html(seen)),
            ):
                if handle.content != content:
                    handle.content = content


@contextmanager
def serve(address: Address, label: str) -> Iterator[tuple[viser.ViserServer, str]]:
    """
    Run the web server within the `with` block; yield the server, and its URL for a browser.

    Raises
    ------
    ViewError
        The port is taken, the host is not an address of this computer, or the installed viser
        cannot refuse pages of other sites.
    """
    host, port, more_names = address
    check_address(host, port)
    origin_check = origin_check_of(host, more_names)
    with guarded_server(host, port, label, origin_check) as server:
        # viser takes the next free port if another program has just taken this port.
        if port not in (0, server.get_port()):
            message = f'--port {port}: another program uses it on {host}; choose another'
            raise ViewError(message, code='port-in-use')
        yield server, origin_check.address(host, server.get_port())
