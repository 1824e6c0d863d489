# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the corners of a ChArUco board (a chessboard with markers in white squares) in images."""

from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ....errors import RecordingError
from ....kernel import Floats
from .intrinsics import Intrinsics
from .opencv import MAX_PIXELS, opencv

# Smallest number of corners from which the pose of a board is computed. Four corners determine the
# pose; two more corners are required as a reserve.
CORNERS = 6
# Least spread of the corners perpendicular to a line through them, divided by the edge of a
# square. If the spread is smaller, the corners are in one line and determine no pose.
LINE_WIDTH_RATIO = 0.5
# HALF_WINDOWS: smallest and largest half width (px) of the window in which a corner is refined.
# REFINED: OpenCV's refinement of a corner stops after 50 steps, or if a step moves the corner by
# less than 1e-3 px. The flag 3 asks for both tests.
HALF_WINDOWS, REFINED = (2, 10), (3, 50, 1e-3)


class Board(NamedTuple):
    """
    The geometry of a ChArUco board.

    Attributes
    ----------
    columns, rows
        Numbers of squares along and down the board.
    square, marker : m
        Edge lengths of squares and markers.
    dictionary
        OpenCV's name of the dictionary of the markers.
    legacy
        Whether the board was made by OpenCV before 4.6: then a board with an even number of rows
        begins with a white square.
    """

    columns: int
    rows: int
    square: float
    marker: float
    dictionary: str
    legacy: bool = False

    @property
    def corners(self) -> Floats:
        """
        Return the inner corners in the frame of the board, (K, 3), m: row by row, as OpenCV does.
        """
        y, x = np.mgrid[1 : self.rows, 1 : self.columns]
        return self.square * np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)


class SeenCorners(NamedTuple):
    """
    The corners of a board in an image.

    Attributes
    ----------
    name
        The name of the image.
    points : shape (K, 3), m
        Corners in the frame of the board: x along its rows of squares, y along the columns, z into
        the board.
    pixels : shape (K, 2)
        Corners in the image, px.
    """

    name: str
    points: Floats
    pixels: Floats


class BoardFinder:
    """
    Detects a ChArUco board in images.

    Raises
    ------
    RecordingError
        OpenCV is not installed, has no such dictionary, or the dictionary has too few markers.
    """

    def __init__(self, board: Board, camera: Intrinsics) -> None:
        self.board, self.camera = board, camera
        aruco = opencv().aruco
        number = getattr(aruco, board.dictionary, None)
        if not isinstance(number, int):
            known = ', '.join(name for name in dir(aruco) if name.startswith('DICT_'))
            message = f'--board: unknown dictionary {board.dictionary!r}; write one of {known}'
            raise RecordingError(message, code='unknown-name')
        markers = aruco.getPredefinedDictionary(number)
        needed = board.columns * board.rows // 2
        if needed > len(markers.bytesList):
            raise RecordingError(
                f'--board: {board.dictionary} has {len(markers.bytesList)} markers, a board of '
                f'{board.columns}x{board.rows} squares needs {needed}; write a larger dictionary',
                code='too-few',
            )
        size = board.columns, board.rows
        made = aruco.CharucoBoard(size, board.square, board.marker, markers)
        made.setLegacyPattern(board.legacy)
        settings = aruco.CharucoParameters()
        settings.cameraMatrix, settings.distCoeffs = camera.matrix, camera.distortion
        settings.tryRefineMarkers = True
        self._finder: Any = aruco.CharucoDetector(made, settings)

    def corners_in(self, file: Path) -> SeenCorners | str:
        """
        Return the corners of the board in an image, or a sentence that says why the corners
        determine no pose.

        Raises
        ------
        RecordingError
            The file is not an image, or the image does not have the camera's size.
        """
        image = None
        with suppress(opencv().error):  # hide OpenCV's message, which names source lines
            image = opencv().imread(str(file), opencv().IMREAD_GRAYSCALE)
        if image is None:
            raise RecordingError(
                f'{file}: not a readable image of at most {MAX_PIXELS:,} pixels; write '
                'PNG or JPEG',
                code='unreadable',
            )
        high, wide = image.shape
        if (wide, high) != (self.camera.width, self.camera.height):
            raise RecordingError(
                f'{file}: the image has {wide}x{high} pixels, and {self.camera.file} is for '
                f'{self.camera.width}x{self.camera.height}; give the intrinsics of these images',
                code='mismatch',
            )
        pixels, numbers, _, markers = self._finder.detectBoard(image)
        corners, marked = (0 if ids is None else len(ids) for ids in (numbers, markers))
        if corners < CORNERS:
            return f'{corners} corners and {marked} markers are seen, {CORNERS} corners are needed'
        points = self.board.corners[numbers.reshape(-1)]
        narrow = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1]
        if narrow < LINE_WIDTH_RATIO * self.board.square:
            return 'all corners that are seen are in one line'
        return SeenCorners(file.name, points, self._refined(image, pixels))

    def _refined(self, image: Any, corners: Any) -> Floats:
        # Refine the corners, because some corners that the detector returns are wrong by a tenth
        # of a pixel or more. Choose a window around each corner so small that it reaches no
        # marker, even in the smallest squares of the image.
        between = np.linalg.norm(corners.reshape(-1, 1, 2) - corners.reshape(1, -1, 2), axis=2)
        edge = float(np.min(between[between > 0.0]))
        half = int(0.5 * edge * (1.0 - self.board.marker / self.board.square))
        window = (min(max(half, HALF_WINDOWS[0]), HALF_WINDOWS[1]),) * 2
        start = corners.reshape(-1, 1, 2).copy()
        refined = opencv().cornerSubPix(image, start, window, (-1, -1), REFINED)
        return np.asarray(refined.reshape(-1, 2), dtype=np.float64)

    def is_mirrored_in(self, file: Path) -> bool:
        """Return whether the board is found after the image is mirrored left to right."""
        image = opencv().imread(str(file), opencv().IMREAD_GRAYSCALE)
        return self._finder.detectBoard(np.ascontiguousarray(image[:, ::-1]))[1] is not None
