"""A camera that sees a board: on the tool, or standing still."""

from typing import Literal

from ...errors import CalibrationError
from ...kernel import Floats
from ...rigid_motion import inverses
from .checking import Measured

Camera = Literal['on-tool', 'fixed']
ON_TOOL: Camera = 'on-tool'


def seen_poses(given: Measured) -> Floats:
    """
    Return the poses (N, 4, 4) of the camera in the frame of the board, from those of the board.

    Raises
    ------
    CalibrationError
        They are positions alone.
    """
    if given.positions:
        raise CalibrationError(
            'a camera on the tool is calibrated by poses of the board, not by positions alone'
        )
    return inverses(given.poses)
