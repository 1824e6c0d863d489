"""`calibrate --camera` by images: the folder, the board and the camera's calibration file."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ..formats.images.board import Board, BoardFinder
from ..formats.images.intrinsics import read_intrinsics
from ..formats.recordings.open_file import TABLES
from .frame_options import given_limit
from .options import WrongUsage

BOARD = re.compile(r'(\d{1,3})x(\d{1,3}),([^,]+),([^,]+),\s*(DICT_\w+)(,\s*legacy)?')
EXAMPLE = '7x5,40mm,30mm,DICT_5X5_100'
# Squares in a row: fewer have too few corners, and no board has more.
SQUARES = range(3, 101)
LARGEST = 10.0  # m


class ImageOptions(NamedTuple):
    """The folder of the images, and what finds the board in them."""

    folder: Path
    finder: BoardFinder

    @staticmethod
    def check_file(files: Sequence[Path]) -> None:
        """Refuse anything but one table."""
        if len(files) != 1 or files[0].suffix.lower() not in TABLES:
            raise WrongUsage('--images takes one FILE, a table (.csv) with a column `image`')


def given_images(
    folder: Path | None, board: str | None, intrinsics: Path | None, camera: bool
) -> ImageOptions | None:
    """Return what --images asks for, None where it is not given."""
    if folder is None:
        if board is not None or intrinsics is not None:
            raise WrongUsage('--board and --intrinsics are for images: give --images FOLDER too')
        return None
    if not camera or board is None or intrinsics is None:
        raise WrongUsage(
            '--images needs --camera on-tool or fixed, --board, and --intrinsics, the '
            "camera's calibration file"
        )
    if not folder.is_dir():
        raise WrongUsage(f'--images: there is no folder {folder}')
    return ImageOptions(folder, BoardFinder(given_board(board), read_intrinsics(intrinsics)))


def given_board(text: str) -> Board:
    """Return a board in words."""
    if match := BOARD.fullmatch(text.strip()):
        columns, rows = int(match[1]), int(match[2])
        square, marker = (given_limit('--board', match[k]).position for k in (3, 4))
        if {columns, rows} <= set(SQUARES) and marker < square < LARGEST:
            return Board(columns, rows, square, marker, match[5], match[6] is not None)
    raise WrongUsage(
        f'--board: {text!r} is not accepted; write how many squares it has along and down (3 to '
        f'100), the edges of squares and of markers, which are smaller, and the dictionary: for '
        f'instance {EXAMPLE}; and ,legacy behind that for a board that OpenCV before 4.6 printed'
    )
