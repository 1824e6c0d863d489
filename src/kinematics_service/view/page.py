"""
The web page: the picture, the panel beside it, and what people can switch.

"""

import io
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout

import numpy as np
import viser

from ..kernel import Floats
from ..robot import Robot
from .door import ServerAddressError, check_address, guard
from .drawing import Drawing
from .observation import Observation, observe
from .panel import facts_html, gauges_html, jacobian_html, joints_html
from .scene import Scene, scene_of
from .sliders import Sliders, singular_pose

SWITCHES = (
    ('linear', 'ellipsoid of velocities (blue)'),
    ('angular', 'ellipsoid of rotations (green)'),
    ('velocity', 'velocity (violet) and rotation (green) arrows'),
    ('trail', 'trail of the tool'),
    ('axes', 'joint axes'),
    ('frames', 'link frames'),
)


class Page:
    """
    A page that shows one arm.

    Parameters
    ----------
    server
        Its server.
    robot
        The arm.
    publishable
        Whether to offer to publish the sliders.

    Attributes
    ----------
    robot
        The arm.
    sliders
        The joints' sliders.

    """

    def __init__(self, server: viser.ViserServer, robot: Robot, publishable: bool) -> None:
        self.robot = robot
        self._server = server
        self._wish: Floats | None = None
        self._in_hand = True
        gui = server.gui
        gui.configure_theme(
            control_layout='fixed', control_width='large', show_logo=False, show_share_button=False
        )
        gui.set_panel_label(robot.name)
        self._gauges = gui.add_html('')
        with gui.add_folder('Joints'):
            self.sliders = Sliders(server, robot)
            self._publish = gui.add_checkbox(
                'publish joint states',
                False,
                visible=publishable,
                hint='the sliders speak as the robot would, on its topic',
            )
            self._add_buttons(self.sliders.positions)
        with gui.add_folder('Tool and measures'):
            self._facts = gui.add_html('')
        with gui.add_folder('Jacobian'):
            self._jacobian = gui.add_html('')
        with gui.add_folder('Limits'):
            self._joints = gui.add_html('')
        with gui.add_folder('Show', expand_by_default=False):
            first = scene_of(observe(robot, self.sliders.positions))
            self._drawing = Drawing(server, first)
            self._switches = {
                name: gui.add_checkbox(label, self._drawing.shown[name])
                for name, label in SWITCHES
            }
            gui.add_button('Clear the trail').on_click(lambda _: self._drawing.clear_trail())
        self._look(first)

    def _add_buttons(self, regular: Floats) -> None:
        singular = singular_pose(self.robot, self.sliders.ranges, regular)
        self._buttons = [
            (self._server.gui.add_button('Regular pose'), regular),
        ]
        if singular is not None:
            self._buttons.append((self._server.gui.add_button('Singular pose'), singular))
        for button, q in self._buttons:
            button.on_click(lambda _, q=q: setattr(self, '_wish', q))

    def _look(self, scene: Scene) -> None:
        # From in front, a little above; the arm fills the middle.
        camera = self._server.initial_camera
        middle = scene.links.reshape(-1, 3).mean(axis=0)
        camera.look_at = tuple(middle)
        camera.position = tuple(middle + scene.size * np.array([0.85, 0.7, 0.4]))

    @property
    def wants_to_publish(self) -> bool:
        """
        Return whether the sliders are to be published.

        """
        return bool(self._publish.visible and self._publish.value)

    def follow(self, q: Floats) -> None:
        """
        Show joint positions on the sliders, which nobody can move then.

        """
        self._change_hands(False)
        self.sliders.jump(q)

    def lead(self) -> tuple[Floats, Floats | None]:
        """
        Return what the sliders say, q and qdot, and let people move them.

        """
        self._change_hands(True)
        wish, self._wish = self._wish, None
        if wish is not None:
            self.sliders.jump(wish)
            self._drawing.clear_trail()
        q = self.sliders.positions
        return q, self.sliders.velocities(q)

    def _change_hands(self, people: bool) -> None:
        if people == self._in_hand:
            return
        self._in_hand = people
        self._drawing.clear_trail()
        self.sliders.enable(people)
        for button, _ in self._buttons:
            button.disabled = not people

    def show(self, seen: Observation, status: str) -> None:
        """
        Show an observation, and in a line where it comes from; nothing is sent that is known.

        """
        for name, switch in self._switches.items():
            self._drawing.shown[name] = bool(switch.value)
        scene = scene_of(seen)
        with self._server.atomic():
            self._drawing.draw(scene)
            for handle, content in (
                (self._gauges, gauges_html(seen, status)),
                (self._facts, facts_html(seen, scene)),
                (self._jacobian, jacobian_html(seen)),
                (self._joints, joints_html(seen)),
            ):
                if handle.content != content:
                    handle.content = content


@contextmanager
def serve(robot: Robot, host: str, port: int, publishable: bool) -> Iterator[tuple[Page, str]]:
    """
    Serve a page within the block; yield it and its address.

    Raises
    ------
    ServerAddressError
        The port is taken, or the host is no address of this computer.

    """
    check_address(host, port)
    silence = io.StringIO()  # what viser prints on its own
    with redirect_stdout(silence):
        server = viser.ViserServer(host=host, port=port, label=robot.name, verbose=False)
    try:
        if port not in (0, server.get_port()):  # taken in the meantime: viser went on to the next
            raise ServerAddressError(f'--port {port}: taken by another program on {host}')
        guard(server, host)
        shown = 'localhost' if host in ('0.0.0.0', '::') else host
        name = f'[{shown}]' if ':' in shown else shown
        yield Page(server, robot, publishable), f'http://{name}:{server.get_port()}'
    finally:
        with redirect_stdout(silence):
            server.stop()
