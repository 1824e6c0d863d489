"""The viewpoint of pages: at the middle of the arm, with all of it in the picture."""

import numpy as np
import viser

from ....kernel import Floats
from ....node.drawing.scene import Scene

# Position in front and a little above, in sizes of the arm.
OFFSET = np.array([0.85, 0.7, 0.4])
# A picture narrower than this (width by height) shows the arm from further away.
SQUARE = 1.0


class Viewpoint:
    """
    The viewpoint of the pages of a server when they are opened, and when another arm is shown.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._middle, self._offset = np.zeros(3), OFFSET
        server.on_client_connect(self._aim)

    def look_at(self, scene: Scene) -> None:
        """Show an arm in the middle of the picture from now on."""
        self._middle = scene.links.reshape(-1, 3).mean(axis=0)
        self._offset = scene.size * OFFSET
        camera = self._server.initial_camera
        camera.look_at = tuple(self._middle)
        camera.position = tuple(self._middle + self._offset)
        for client in self._server.get_clients().values():
            client.camera.look_at = self._middle
            client.camera.position = self._middle + self._offset
            self._aim(client)

    def _aim(self, client: viser.ClientHandle) -> None:
        width, height = client.camera.image_width, client.camera.image_height
        if 0 < width < SQUARE * height:
            away: Floats = self._offset * min(SQUARE * height / width, 3.0)
            client.camera.position = self._middle + away
