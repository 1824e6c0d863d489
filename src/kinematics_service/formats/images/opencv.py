"""OpenCV, imported only where an image is looked at."""

from typing import Any

from ...errors import RecordingError

INSTALL = (
    "images need opencv: pip install '.[camera]' in its checkout, or pip install "
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
    except ImportError:
        raise RecordingError(INSTALL) from None
    if not hasattr(getattr(cv2, 'aruco', None), 'CharucoDetector'):
        raise RecordingError(f'opencv {cv2.__version__} is too old, 4.8 is needed; {INSTALL}')
    return cv2
