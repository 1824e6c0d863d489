"""A camera that sees a board: on the tool, or standing still."""

from typing import Literal

from ...errors import CalibrationError
from ...kernel import Floats
from ...rigid_motion import inverses

Camera = Literal['on-tool', 'fixed']
ON_TOOL: Camera = 'on-tool'


def seen_poses(poses: Floats, positions: bool) -> Floats:
    """
    Return the poses (N, 4, 4) of the camera in the frame of the board, from those of the board, or
    the other way round.

    Raises
    ------
    CalibrationError
        They are positions alone.
    """
    if positions:
        raise CalibrationError(
            'a camera on the tool is calibrated by poses of the board, not by positions alone'
        )
    return inverses(poses)
