# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The intrinsics of a camera from its calibration file, and a board in images."""

from dataclasses import replace

import numpy as np
import pytest
from calibrated_arms import BOARD, INTRINSICS
from refusal import refused

from kinematics_service.apps.calibration.boards.board import Board, BoardFinder
from kinematics_service.apps.calibration.boards.intrinsics import read_intrinsics
from kinematics_service.errors import RecordingError
from kinematics_service.rigid_motion import pose_of

cv2 = pytest.importorskip('cv2')
from pictures import picture, printed, ros_file  # noqa: E402

K = '900, 0, 640.3, 0, 902, 481, 0, 0, 1'
D = '-0.12, 0.05, 0.0005, -0.0003, 0'
MESSAGE = f'height: 960\nwidth: 1280\ndistortion_model: plumb_bob\nd: [{D}]\nk: [{K}]\n---\n'
NESTED = (
    '{"camera_matrix": [[9e2, 0, 640.3], [0, 902, 481], [0, 0, 1]], '
    f'"dist_coeff": [[{D}]], '
    '"image_width": 1280, "image_height": 960}'
)
# How near (px, rms) corners of images without much noise are found.
FOUND = 0.05
HALF = replace(
    INTRINSICS,
    matrix=INTRINSICS.matrix * [[0.5], [0.5], [1.0]],
    width=640,
    height=480,
)
BEFORE = pose_of([-0.1, -0.07, 0.5], (0.2, -0.3, 0.1))


def same(one, other):
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ('matrix', 'distortion', 'width', 'height')
    )


def opencv_file(file):
    storage = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
    storage.write('image_width', 1280)
    storage.write('image_height', 960)
    storage.write('camera_matrix', INTRINSICS.matrix)
    storage.write('distortion_coefficients', INTRINSICS.distortion[None])
    storage.release()


@pytest.mark.parametrize('ending', ['.yaml', '.yml', '.json'])
def test_intrinsics_are_read_as_opencv_writes_them(ending, tmp_path):
    opencv_file(tmp_path / f'camera{ending}')
    assert same(read_intrinsics(tmp_path / f'camera{ending}'), INTRINSICS)


@pytest.mark.parametrize('text', [ros_file(INTRINSICS), MESSAGE, NESTED])
def test_intrinsics_are_read_as_ros_and_scripts_write_them(text, tmp_path):
    file = tmp_path / 'camera.yaml'
    file.write_text(text)
    assert same(read_intrinsics(file), INTRINSICS)


def test_eight_coefficients_of_distortion_are_those_of_opencv(tmp_path):
    camera = replace(
        INTRINSICS, distortion=np.array([0.4, -0.2, 1e-3, -1e-3, 0.01, 0.5, -0.1, 0.02])
    )
    file = tmp_path / 'camera.yaml'
    file.write_text(ros_file(camera, 'rational_polynomial'))
    read = read_intrinsics(file)
    assert same(read, camera)
    points = np.array([[0.1, -0.05, 0.6], [-0.2, 0.1, 0.5]])
    x, y = (points[:, :2] / points[:, 2:]).T
    r2 = x * x + y * y
    k1, k2, p1, p2, k3, k4, k5, k6 = camera.distortion
    ratio = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    u = x * ratio + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * ratio + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    expected = np.column_stack([u, v, np.ones(2)]) @ camera.matrix.T
    assert np.allclose(read.pixels(points)[0], expected[:, :2], atol=1e-9)


def test_pixels_move_as_their_differences():
    points = np.array([[0.1, -0.05, 0.6], [-0.2, 0.1, 0.5]])
    _, J = INTRINSICS.pixels(points)
    for axis in range(3):
        step = 1e-6 * np.eye(3)[axis]
        moved = INTRINSICS.pixels(points + step)[0] - INTRINSICS.pixels(points - step)[0]
        assert np.allclose(J[:, :, axis], moved / 2e-6, rtol=1e-6)


def test_what_is_behind_or_aside_is_not_seen():
    points = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, -0.5], [2.0, 0.0, 0.5], [0.5, 0.0, 0.5]])
    assert INTRINSICS.sees(points).tolist() == [True, False, False, False]
    near_the_rim = np.array([[0.36, 0.0, 0.5]])
    assert INTRINSICS.sees(near_the_rim).all()
    assert not INTRINSICS.sees(near_the_rim, 0.05).any()


@pytest.mark.parametrize(
    ('text', 'code', 'word'),
    [
        (ros_file(INTRINSICS, 'equidistant'), 'unsupported', "'equidistant'"),
        (MESSAGE.replace('width', 'wide'), 'missing-key', 'image_width'),
        (MESSAGE.replace('height', 'high'), 'missing-key', 'image_height'),
        (MESSAGE.replace('k: ', 'q: '), 'missing-key', 'camera_matrix'),
        (MESSAGE.replace('900', 'fx'), 'not-a-number', 'camera_matrix'),
        (MESSAGE.replace('900', '.nan'), 'not-a-number', 'camera_matrix'),
        (MESSAGE.replace('900, ', ''), 'wrong-shape', '9 numbers'),
        (MESSAGE.replace('900', '-900'), 'wrong-shape', '(fx 0 cx'),
        (MESSAGE.replace('481, 0', '481, 7'), 'wrong-shape', '9 numbers'),
        (MESSAGE.replace('-0.12, 0.05, ', ''), 'wrong-shape', '4, 5, 8'),
        ('nothing', 'syntax', 'a mapping'),
        ('', 'syntax', 'camera_matrix'),
        ('{a: [', 'syntax', 'camera_matrix'),
    ],
)
def test_what_is_no_calibration_file_is_refused_in_a_sentence(text, code, word, tmp_path):
    file = tmp_path / 'camera.yaml'
    file.write_text(text)
    with refused(RecordingError, code, str(file), word):
        read_intrinsics(file)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with refused(RecordingError, 'unreadable', 'No such file'):
        read_intrinsics(tmp_path / 'camera.yaml')


@pytest.mark.parametrize(
    'board', [BOARD, Board(6, 8, 0.03, 0.02, 'DICT_4X4_250', True), BOARD._replace(rows=6)]
)
def test_corners_are_found_where_they_are(board, tmp_path):
    random = np.random.default_rng(1)
    file = tmp_path / 'a.png'
    cv2.imwrite(str(file), picture(board, HALF, BEFORE, random))
    seen = BoardFinder(board, HALF).corners_in(file)
    assert len(seen.points) > 0.9 * (board.columns - 1) * (board.rows - 1)
    true = HALF.pixels(seen.points @ BEFORE[:3, :3].T + BEFORE[:3, 3])[0]
    assert np.sqrt(np.mean((seen.pixels - true) ** 2)) < FOUND


def test_images_that_tell_no_pose_say_why(tmp_path):
    random = np.random.default_rng(1)
    finder, file = BoardFinder(BOARD, HALF), tmp_path / 'a.png'
    image = picture(BOARD, HALF, BEFORE, random)
    for changed, sentence in (
        (np.full_like(image, 90), '0 corners and 0 markers'),
        (np.where(np.arange(480)[:, None] < 260, image, 90), 'corners'),
    ):
        cv2.imwrite(str(file), changed)
        assert sentence in finder.corners_in(file)
    cv2.imwrite(str(file), image)
    other = BoardFinder(BOARD._replace(columns=5, rows=7), HALF).corners_in(file)
    assert 'markers are seen' in other
    assert not other.startswith('0 corners and 0')
    cv2.imwrite(str(file), np.ascontiguousarray(image[:, ::-1]))
    assert '0 corners' in finder.corners_in(file)
    assert finder.is_mirrored_in(file)


def test_images_of_another_camera_are_refused(tmp_path):
    file = tmp_path / 'a.png'
    cv2.imwrite(str(file), printed(BOARD))
    with refused(RecordingError, 'mismatch', '420x300', '640x480'):
        BoardFinder(BOARD, HALF).corners_in(file)
    file.write_text('no image')
    with refused(RecordingError, 'unreadable', str(file)):
        BoardFinder(BOARD, HALF).corners_in(file)


def test_a_board_that_cannot_be_is_refused():
    with refused(RecordingError, 'unknown-name', "'DICT_9X9'", 'DICT_4X4_50'):
        BoardFinder(BOARD._replace(dictionary='DICT_9X9'), HALF)
    with refused(RecordingError, 'too-few', '50 markers', '20x10', '100'):
        BoardFinder(Board(20, 10, 0.04, 0.03, 'DICT_4X4_50'), HALF)
