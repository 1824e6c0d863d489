"""A ChArUco board, a chessboard with a marker in each white square, and its corners in images."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ....errors import RecordingError
from ....kernel import Floats
from .intrinsics import Intrinsics
from .opencv import MAX_PIXELS, opencv

# Corners by which the pose of a board is found, with some to spare.
CORNERS = 6
# Corners closer to one line than half a square do not determine a pose.
LINE_WIDTH_RATIO = 0.5
# Half windows (px) in which a corner is refined; steps, and the last change (px), with OpenCV's
# flag that both end it.
HALF_WINDOWS, REFINED = (2, 10), (3, 50, 1e-3)


class Board(NamedTuple):
    """
    A board.

    Attributes
    ----------
    columns, rows
        Numbers of its squares.
    square, marker : m
        Lengths of their edges.
    dictionary
        The dictionary of its markers, by OpenCV's name.
    legacy
        Whether it was printed by OpenCV before 4.6: then an even number of rows begins with a
        white square.
    """

    columns: int
    rows: int
    square: float
    marker: float
    dictionary: str
    legacy: bool = False

    @property
    def corners(self) -> Floats:
        """Return where its inner corners are, by their numbers, (K, 3), m."""
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
        In the frame of the board: x along its rows of squares, y along the columns, z into it.
    pixels : shape (K, 2)
    """

    name: str
    points: Floats
    pixels: Floats


class BoardFinder:
    """
    Finds a board in images.

    Raises
    ------
    RecordingError
        OpenCV is not there, has no such dictionary, or makes no such board.
    """

    def __init__(self, board: Board, camera: Intrinsics) -> None:
        self.board, self.camera = board, camera
        aruco = opencv().aruco
        number = getattr(aruco, board.dictionary, None)
        if not isinstance(number, int):
            known = ', '.join(name for name in dir(aruco) if name.startswith('DICT_'))
            raise RecordingError(f'there is no dictionary {board.dictionary!r}; there are {known}')
        markers = aruco.getPredefinedDictionary(number)
        needed = board.columns * board.rows // 2
        if needed > len(markers.bytesList):
            raise RecordingError(
                f'{board.dictionary} has {len(markers.bytesList)} markers, and a board of '
                f'{board.columns}x{board.rows} squares {needed}'
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
        Return the corners in an image, or why they tell no pose.

        Raises
        ------
        RecordingError
            The file is not an image, or the image does not have the camera's size.
        """
        try:
            image = opencv().imread(str(file), opencv().IMREAD_GRAYSCALE)
        except opencv().error:  # what it says of the file's size names lines of its source
            image = None
        if image is None:
            raise RecordingError(
                f'{file}: this is no image that can be read, or it has more than '
                f'{MAX_PIXELS:,} pixels'
            )
        high, wide = image.shape
        if (wide, high) != (self.camera.width, self.camera.height):
            raise RecordingError(
                f'{file}: the image has {wide}x{high} pixels, and {self.camera.file} is for '
                f'{self.camera.width}x{self.camera.height}: give the intrinsics of these images'
            )
        found, numbers, _, markers = self._finder.detectBoard(image)
        corners, marked = (0 if one is None else len(one) for one in (numbers, markers))
        if corners < CORNERS:
            return f'{corners} corners and {marked} markers are seen, {CORNERS} corners are needed'
        points = self.board.corners[numbers.reshape(-1)]
        narrow = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1]
        if narrow < LINE_WIDTH_RATIO * self.board.square:
            return 'all corners that are seen are in one line'
        return SeenCorners(file.name, points, self._refined(image, found))

    def _refined(self, image: Any, corners: Any) -> Floats:
        # The detector leaves some corners a tenth of a pixel or more off. The window ends before
        # the markers where squares are smallest.
        between = np.linalg.norm(corners.reshape(-1, 1, 2) - corners.reshape(1, -1, 2), axis=2)
        edge = float(np.min(between[between > 0.0]))
        half = int(0.5 * edge * (1.0 - self.board.marker / self.board.square))
        window = (min(max(half, HALF_WINDOWS[0]), HALF_WINDOWS[1]),) * 2
        start = corners.reshape(-1, 1, 2).copy()
        refined = opencv().cornerSubPix(image, start, window, (-1, -1), REFINED)
        return np.asarray(refined.reshape(-1, 2), dtype=np.float64)

    def is_mirrored_in(self, file: Path) -> bool:
        """Return whether the board is found in the mirror image."""
        image = opencv().imread(str(file), opencv().IMREAD_GRAYSCALE)
        return self._finder.detectBoard(np.ascontiguousarray(image[:, ::-1]))[1] is not None
