# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Import OpenCV when it is first needed, because it is an optional package."""

import os
from types import ModuleType

from ....errors import RecordingError

INSTALL = (
    "images need opencv ({reason}): pip install '.[camera]' in its checkout, or pip install "
    'opencv-python-headless'
)


# Largest number of pixels of an image that OpenCV reads, ten times the pixels of a usual camera.
# OpenCV takes this limit at its import.
MAX_PIXELS = 2**28


def opencv() -> ModuleType:
    """
    Return the module `cv2`.

    Raises
    ------
    RecordingError
        OpenCV is not installed, or is too old to find a ChArUco board.
    """
    os.environ.setdefault('OPENCV_IO_MAX_IMAGE_PIXELS', str(MAX_PIXELS))
    try:
        import cv2
    except ImportError as error:
        raise RecordingError(INSTALL.format(reason=error), code='missing-package') from None
    if not hasattr(getattr(cv2, 'aruco', None), 'CharucoDetector'):
        raise RecordingError(
            INSTALL.format(reason=f'4.8, not {cv2.__version__}'), code='missing-package'
        )
    return cv2
