"""OpenCV, imported only where an image is looked at."""

from typing import Any

from ...errors import RecordingError

INSTALL = (
    "images need opencv ({reason}): pip install '.[camera]' in its checkout, or pip install "
    'opencv-python-headless'
)


def opencv() -> Any:
    """
    Return the module `cv2`.

    Raises
    ------
    RecordingError
        It is not installed, or too old to find a ChArUco board.
    """
    try:
        import cv2
    except ImportError as error:
        raise RecordingError(INSTALL.format(reason=error)) from None
    if not hasattr(getattr(cv2, 'aruco', None), 'CharucoDetector'):
        raise RecordingError(INSTALL.format(reason=f'4.8, not {cv2.__version__}'))
    return cv2
