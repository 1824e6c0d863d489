# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Images of a ChArUco board, rendered with distortion, blur and noise; and their camera's file."""

from functools import cache

import cv2
import numpy as np

from kinematics_service.apps.calibration.boards.board import BoardFinder

# Pixels of the printed board along a square, rays along a pixel, grey of the surroundings.
PRINTED, RAYS, AROUND = 60, 2, 110
# Blur and noise of an image, px and grey levels of 255.
BLUR, NOISE = 0.7, 2.0

ROS_FILE = """image_width: {width}
image_height: {height}
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: [{matrix}]
distortion_model: {model}
distortion_coefficients:
  rows: 1
  cols: {count}
  data: [{distortion}]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
"""


def ros_file(camera, model='plumb_bob'):
    """Return intrinsics as camera_calibration of ROS writes them."""
    return ROS_FILE.format(
        width=camera.width,
        height=camera.height,
        matrix=', '.join(map(repr, camera.matrix.reshape(-1).tolist())),
        model=model,
        count=len(camera.distortion),
        distortion=', '.join(map(repr, camera.distortion.tolist())),
    )


def printed(board):
    """Return the image of a board on paper."""
    markers = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    size = board.columns, board.rows
    made = cv2.aruco.CharucoBoard(size, board.square, board.marker, markers)
    made.setLegacyPattern(board.legacy)
    return made.generateImage((PRINTED * board.columns, PRINTED * board.rows))


@cache
def rays_of(camera):
    """Return the directions (N, 3) in which a camera sees, without distortion."""
    wide, high = camera.width * RAYS, camera.height * RAYS
    u, v = ((np.arange(count) + 0.5) / RAYS - 0.5 for count in (wide, high))
    pixels = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 1, 2)
    rays = cv2.undistortPoints(pixels, camera.matrix, camera.distortion).reshape(-1, 2)
    return np.column_stack([rays, np.ones(len(rays))]).astype(np.float32)


def picture(board, camera, pose, random):
    """Return the image of a board at a pose (4, 4) in the frame of the camera."""
    wide, high = camera.width * RAYS, camera.height * RAYS
    rays = rays_of(camera) @ pose[:3, :3].astype(np.float32)
    origin = -pose[:3, :3].T @ pose[:3, 3]
    far = -origin[2] / np.where(rays[:, 2] == 0.0, 1e-9, rays[:, 2])
    at = (origin + far[:, None] * rays)[:, :2] * PRINTED / board.square - 0.5
    at = np.where(far[:, None] > 0.0, at, -1e4).astype(np.float32).reshape(high, wide, 2)
    rim = PRINTED // 2
    paper = cv2.copyMakeBorder(printed(board), *4 * [rim], cv2.BORDER_CONSTANT, value=255)
    seen = cv2.remap(
        paper, at[..., 0] + rim, at[..., 1] + rim, cv2.INTER_LINEAR, borderValue=AROUND
    )
    seen = seen.reshape(camera.height, RAYS, camera.width, RAYS).mean(axis=(1, 3))
    seen = cv2.GaussianBlur(20.0 + 0.8 * seen, (0, 0), BLUR)
    seen += NOISE * random.normal(size=seen.shape)
    return np.clip(np.rint(seen), 0.0, 255.0).astype(np.uint8)


def written(folder, arm, board, camera, random):
    """Write the images of an arm into a folder, which is made."""
    folder.mkdir()
    for one, pose in zip(arm.seen, arm.poses):
        cv2.imwrite(str(folder / one.name), picture(board, camera, pose, random))


def with_pictures(folder, arm, board, camera, random):
    """Return an arm with the corners that are found in its images, rendered into a folder."""
    written(folder, arm, board, camera, random)
    finder = BoardFinder(board, camera)
    return arm._replace(seen=[finder.corners_in(folder / one.name) for one in arm.seen])
