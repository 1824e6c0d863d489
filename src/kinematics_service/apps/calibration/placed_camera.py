"""Where a calibration finds the camera and the board, and how well that is known."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...kernel import Floats
from ...rigid_motion import inverse, roll_pitch_yaw
from ...robot.file.parts.parameters import end_parameters
from ..checking.errors import angle_in_words, length_in_words
from .board_views import view_sentences
from .camera import ON_TOOL
from .result import Calibration


@dataclass(frozen=True, eq=False)
class PlacedThing:
    """
    The camera or the board.

    Attributes
    ----------
    name, frame
        What it is, and the frame of the robot file it stands in: tool or base.
    pose : shape (4, 4)
    deviation : shape (2, 3), m and rad
        Standard deviations of its position and rotation along and about the axes of that frame.
    """

    name: str
    frame: str
    pose: Floats
    deviation: Floats

    @property
    def sentence(self) -> str:
        """Return it in words."""
        x = ', '.join(f'{one:.5f}' for one in self.pose[:3, 3])
        rpy = ', '.join(f'{one:.3f}' for one in np.degrees(roll_pitch_yaw(self.pose[:3, :3])))
        lengths, angles = (
            ', '.join(words(one) for one in row)
            for words, row in zip((length_in_words, angle_in_words), self.deviation.tolist())
        )
        return (
            f'The {self.name} is at x, y, z {x} m, roll, pitch, yaw {rpy} deg in the {self.frame} '
            f'frame; standard deviations {lengths}; {angles}'
        )


def placed_camera(found: Calibration) -> tuple[PlacedThing, ...]:
    """Return camera and board of the first set; none where no camera measured."""
    if found.camera is None:
        return ()
    on_tool, still = ('camera', 'board') if found.camera == ON_TOOL else ('board', 'camera')
    description = found.robot.description
    tool, base = description.tool.motion.matrix, description.base.motion.matrix
    X, Y = found.base_offsets[0], found.tool_offsets[0]
    behind = found.tool_starts[0], inverse(found.base_starts[0])
    return (
        PlacedThing(on_tool, 'tool', Y, _deviation(found, 'tool', behind[0], tool[:3, :3].T)),
        PlacedThing(still, 'base', inverse(X), _deviation(found, 'base', behind[1], base[:3, :3])),
    )


def _deviation(found: Calibration, end: str, behind: Floats, R: Floats) -> Floats:
    # The corrections move what is behind them: p = t + w x p. What is not fitted is known.
    own, columns = found.fitted_of([one.name for one in end_parameters(end, 0)])
    moved = np.eye(6)
    moved[:3, 3:] = -np.cross(np.eye(3), behind[:3, 3])
    turned = np.kron(np.eye(2), R) @ moved[:, own]
    covariance = turned @ found.covariance[np.ix_(columns, columns)] @ turned.T
    return np.sqrt(np.diag(covariance)).reshape(2, 3)


def camera_sentences(found: Calibration) -> Iterator[str]:
    """Yield where camera and board are, and what the errors are of."""
    things: Sequence[PlacedThing] = placed_camera(found)
    for one in things:
        yield one.sentence
    if things:
        yield 'All errors are those of the board, as the camera sees it'
    if found.views is not None:
        yield from view_sentences(found.views, found.left[4], found.outliers)
