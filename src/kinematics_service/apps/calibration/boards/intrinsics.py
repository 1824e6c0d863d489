# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the intrinsics of a camera from the calibration file of ROS or OpenCV."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ....errors import RecordingError
from ....kernel import Floats
from ....robot.chain import FrozenArrays
from ....robot.file.text.yaml_reader import YamlError
from ...recordings.readers.block import Flags
from ...recordings.readers.yaml_values import read_documents
from .opencv import opencv

# Accepted keys of the entries of an intrinsics file. The keys are those that ROS
# (camera_calibration and messages) and the samples of OpenCV write.
MATRIX = ('camera_matrix', 'k', 'K', 'mtx')
DISTORTION = ('distortion_coefficients', 'dist_coeffs', 'dist_coeff', 'd', 'D', 'dist')
WIDTH, HEIGHT = ('image_width', 'width'), ('image_height', 'height')
KEYS_OF_FILE = f'{MATRIX[0]}, {DISTORTION[0]}, {WIDTH[0]} and {HEIGHT[0]}'
# Accepted models of lens distortion, by ROS's names. Files of OpenCV have no model name.
MODELS = ('plumb_bob', 'rational_polynomial', '')
# Accepted counts of distortion coefficients. The distortion model of OpenCV can have these counts.
COUNTS = (4, 5, 8, 12, 14)
# Matches two texts that OpenCV writes and the YAML reader cannot read: the first line of a file,
# and the tag of a matrix.
NOT_YAML = re.compile(r'\A%YAML[^\n]*\n|!!opencv-matrix')


@dataclass(frozen=True, eq=False)
class Intrinsics(FrozenArrays):
    """
    The intrinsics of a camera: matrix, distortion and image size.

    Attributes
    ----------
    file
        The file of the intrinsics.
    matrix : shape (3, 3), px
        Camera matrix.
    distortion : shape (k,)
        Coefficients of OpenCV's distortion model.
    width, height : px
        Size of the images.
    """

    file: str
    matrix: Floats
    distortion: Floats
    width: int
    height: int

    def pixels(self, points: Floats) -> tuple[Floats, Floats]:
        """
        Project points (K, 3), m in the frame of the camera; return their pixels (K, 2) and the
        derivatives (K, 2, 3) of the pixels by the points, px/m.
        """
        zero = np.zeros(3)
        seen, J = opencv().projectPoints(points, zero, zero, self.matrix, self.distortion)
        # Columns 3 to 5 of J are the derivatives of the pixels by `tvec`, a translation that
        # OpenCV adds to each point. So these columns equal the derivatives by the point.
        return seen.reshape(-1, 2), J[:, 3:6].reshape(-1, 2, 3)

    def sees(self, points: Floats, rim: float = 0.0) -> Flags:
        """
        Return flags (K,): whether the camera sees each of K points (K, 3), m in the frame of the
        camera. A border of the image, the share `rim` of its width and height, is excluded.
        """
        size = np.array([self.width, self.height], dtype=np.float64)
        edge = np.linspace(0.0, 1.0, 9)
        around = np.array([(x, y) for x in edge for y in edge if {x, y} & {0.0, 1.0}]) * size
        widest = opencv().undistortPoints(around[:, None], self.matrix, self.distortion)
        # Exclude points whose direction is outside the field of view of an image without
        # distortion. The distortion model may map such points back into the image.
        limits = np.abs(widest).max(axis=(0, 1)) * points[:, 2:]
        inside = (points[:, 2] > 0.0) & np.all(np.abs(points[:, :2]) <= limits, axis=1)
        seen, _ = self.pixels(np.where(inside[:, None], points, (0.0, 0.0, 1.0)))
        within = np.all((seen >= rim * size) & (seen <= (1.0 - rim) * size), axis=1)
        return np.asarray(within & inside)


def read_intrinsics(file: Path) -> Intrinsics:
    """
    Read the intrinsics of a camera from a YAML or JSON file of ROS or OpenCV, and return them.

    Raises
    ------
    RecordingError
        The file cannot be read, lacks an entry, or has another model of distortion.
    """
    try:
        text = file.read_text(encoding='utf-8')
        entries = read_documents(NOT_YAML.sub('', text))[0]
        if not isinstance(entries, dict):
            raise YamlError(1, 'expected a mapping of entries')
        given = {str(key): value for key, value in entries.items()}
    except OSError as error:
        raise RecordingError(
            f'{file}: cannot be read: {error.strerror}; give the calibration file of the camera',
            code='unreadable',
        ) from None
    except (UnicodeDecodeError, YamlError, IndexError) as error:
        raise RecordingError(
            f'{file}: not a calibration file of a camera: {error}; give YAML or JSON with '
            f'{KEYS_OF_FILE}',
            code='syntax',
        ) from None
    model = given.get('distortion_model', '')
    if model not in MODELS:
        raise RecordingError(
            f'{file}: distortion_model: {model!r} is not one of {", ".join(MODELS[:2])}; '
            'rectify the images of a fisheye camera, and give the intrinsics of these',
            code='unsupported',
        )
    K = _numbers(file, given, MATRIX)
    d = _numbers(file, given, DISTORTION)
    size = [_numbers(file, given, names) for names in (WIDTH, HEIGHT)]
    whole = len(K) == 9 and len(d) in COUNTS and all(len(px) == 1 and px[0] > 0 for px in size)
    if not (whole and min(K[0], K[4]) > 0.0 and np.array_equal(K[[3, 6, 7, 8]], (0, 0, 0, 1))):
        raise RecordingError(
            f'{file}: {MATRIX[0]} needs 9 numbers (fx 0 cx, 0 fy cy, 0 0 1), {DISTORTION[0]} '
            f'{", ".join(map(str, COUNTS))}, and width and height one each, above 0',
            code='wrong-shape',
        )
    return Intrinsics(str(file), K.reshape(3, 3), d, int(size[0][0]), int(size[1][0]))


def _numbers(file: Path, given: dict[str, Any], names: tuple[str, ...]) -> Floats:
    entries = [given[name] for name in names if name in given]
    if not entries:
        message = f'{file}: {names[0]} is missing; a calibration file has {KEYS_OF_FILE}'
        raise RecordingError(message, code='missing-key')
    value = entries[0].get('data') if isinstance(entries[0], dict) else entries[0]
    try:
        numbers = np.array(value, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError):
        numbers = np.array([np.nan])
    if not np.all(np.isfinite(numbers)):
        raise RecordingError(f'{file}: {names[0]} must be finite numbers', code='not-a-number')
    return numbers
