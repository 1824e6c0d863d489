# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Aim the camera of each page at the middle of the arm, so that the whole arm is visible."""

import numpy as np
import viser

from ....kernel import Floats
from ....node.drawing.scene import Scene

# Position of the camera relative to the middle of the arm, in front and above, divided by the
# arm's size.
OFFSET = np.array([0.85, 0.7, 0.4])


class Viewpoint:
    """Aims the camera of each page of a server when the page opens and when the arm changes."""

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
        # In a tall window, move the camera back, so that the arm fits into the width of the
        # window.
        if 0 < width < height:
            away: Floats = self._offset * min(height / width, 3.0)
            client.camera.position = self._middle + away
