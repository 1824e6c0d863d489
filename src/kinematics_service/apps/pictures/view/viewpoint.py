"""Aim the camera of each page at the middle of the arm, so that the whole arm is visible."""

import numpy as np
import viser

from ....kernel import Floats
from ....node.drawing.scene import Scene

# Position of the camera, in front of the arm and above it, divided by the arm's size.
OFFSET = np.array([0.85, 0.7, 0.4])


class Viewpoint:
    """
    The camera of the pages of a server when they are opened, and when another arm is shown.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._middle, self._offset = np.zeros(3), OFFSET
        server.on_client_connect(self._aim)

    def look_at(self, scene: Scene) -> None:
        """Aim all cameras at an arm, now and when further pages are opened."""
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
        # The arm must fit into the width of a tall picture.
        if 0 < width < height:
            away: Floats = self._offset * min(height / width, 3.0)
            client.camera.position = self._middle + away
