# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Camera, board and arm from images of a board: noise of corners, flat boards, wrong sizes."""

import json
import re
import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest
from calibrated_arms import (
    BOARD,
    INTRINSICS,
    board_seen,
    corners_of,
    is_in_view,
    pictured,
    pictured_arm,
    pictured_errors,
)
from refusal import refused

from kinematics_service.__main__ import main
from kinematics_service.apps.calibration.board_views import board_poses, board_views, moved
from kinematics_service.apps.calibration.boards.board import SeenCorners
from kinematics_service.apps.calibration.proposal import propose_poses
from kinematics_service.errors import CalibrationError
from kinematics_service.rigid_motion import apart, exponential, pose_of

cv2 = pytest.importorskip('cv2')
from pictures import picture, ros_file, written  # noqa: E402

BOTH = ('on-tool', 'fixed')
# Without noise (m); what a fit at once is nearer by than the closed form, at the least.
EXACT, NEARER = 1e-7, 3.0
SMALL = replace(
    INTRINSICS,
    matrix=np.array([[600.0, 0.0, 320.2], [0.0, 601.0, 240.5], [0.0, 0.0, 1.0]]),
    width=640,
    height=480,
)
TINY = replace(
    SMALL,
    matrix=SMALL.matrix * [[0.75], [0.75], [1.0]],
    width=480,
    height=360,
)
WORDS = '7x5,40mm,30mm,DICT_5X5_100'


def run(capsys, *argv):
    code = main([*map(str, argv)])
    out, err = capsys.readouterr()
    assert 'Traceback' not in out + err
    return code, ' '.join(out.split()), ' '.join(err.split())


def table(file, arm, names=None):
    names = [one.name for one in arm.seen] if names is None else names
    header = ','.join(['image', *(f'position.{name}' for name in arm.robot.joint_names)])
    rows = (','.join([name, *map(repr, q)]) for name, q in zip(names, arm.q.tolist()))
    file.write_text('\n'.join([header, *rows]) + '\n')
    return file


def turned(pose, other):
    return apart(pose[None], other[None])[1][0]


@pytest.mark.parametrize('where', BOTH)
def test_without_noise_the_board_is_where_it_is_seen(where):
    arm = pictured_arm(where, 25, 3, corner=0.0)
    found = pictured(arm, where)
    assert found.accepted
    assert np.abs(found.views.poses - arm.poses).max() < EXACT
    assert pictured_errors(arm, where, found)[0] < EXACT


@pytest.mark.slow
@pytest.mark.parametrize('where', BOTH)
def test_images_are_nearer_than_the_closed_form_and_as_sure_as_they_say(where):
    ratios, squares = [], []
    for seed in range(200, 202):
        arm = pictured_arm(where, 25, seed, corner=0.4)
        found = pictured(arm, where)
        fitted, closed = pictured_errors(arm, where, found)
        ratios.append(closed / fitted)
        count = len(arm.errors)
        error = np.array([one.correction for one in found.parameters[:count]]) - arm.errors
        squares.append(error @ np.linalg.solve(found.covariance[:count, :count], error) / count)
        assert not any('times' in one for one in found.remarks)
    assert np.median(ratios) > NEARER
    assert 0.8 < np.mean(squares) < 1.25


def test_the_noise_of_poses_is_that_of_the_corners():
    arm = pictured_arm('on-tool', 80, 4)
    found = pictured(arm, 'on-tool')
    views = found.views
    assert 0.95 < views.noise / 0.2 < 1.05
    assert np.abs(np.array(found.noise) / views.typical / 0.2 - 1.0).max() < 0.15
    # Errors of single images are within what their corners leave open.
    off = np.concatenate([arm.poses[:, :3, 3] - views.poses[:, :3, 3], np.zeros((80, 3))], axis=1)
    for k, (pose, true) in enumerate(zip(views.poses, arm.poses)):
        turn = true[:3, :3] @ pose[:3, :3].T
        off[k, 3:] = 0.5 * np.array(
            [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
        )
    whitened = np.einsum('nij,nj->ni', views.whitening, off) / np.repeat(views.typical, 3)
    assert 0.85 < np.mean(whitened**2) / 0.2**2 < 1.15
    # Far worse along the view than across.
    across, along = (arm.poses - views.poses)[:, :2, 3], (arm.poses - views.poses)[:, 2, 3]
    assert np.std(along) > 2.0 * np.std(across)


def test_corners_move_as_their_differences():
    arm = pictured_arm('fixed', 3, 5, corner=0.0)
    pose, seen = arm.poses[0], arm.seen[0]
    _, J = moved(INTRINSICS, pose, seen)
    for axis in range(6):
        left = []
        for step in (1e-6, -1e-6):
            other = pose.copy()
            if axis < 3:
                other[axis, 3] += step
            else:
                other[:3, :3] = exponential(step * np.eye(3)[axis - 3]) @ other[:3, :3]
            left.append(moved(INTRINSICS, other, seen)[0])
        assert np.allclose(
            J[:, axis], (left[1] - left[0]).reshape(-1) / 2e-6, rtol=1e-5, atol=1e-3
        )


def small_board(arm, size, noise, seed, whole=6):
    """Return the corners of a board that is smaller in all images but the first ones."""
    random = np.random.default_rng(seed)
    middle = BOARD.corners.mean(axis=0)
    seen = []
    for k, (one, pose) in enumerate(zip(arm.seen, arm.poses)):
        points = middle + (1.0 if k < whole else size) * (BOARD.corners - middle)
        pixels = INTRINSICS.pixels(points @ pose[:3, :3].T + pose[:3, 3])[0]
        pixels += noise * random.normal(size=pixels.shape)
        seen.append(SeenCorners(one.name, points, pixels))
    return seen


def test_of_two_poses_that_corners_do_not_tell_apart_the_arm_tells_the_right_one():
    arm = pictured_arm('on-tool', 24, 9)
    wrong = 0
    for seed in range(3):
        seen = small_board(arm, 0.12, 0.1, seed)
        several = [board_poses(INTRINSICS, one) for one in seen]
        assert sum(len(one) == 2 for one in several) > 8
        wrong += sum(turned(one[0].pose, pose) > 0.15 for one, pose in zip(several, arm.poses))
        names = [one.name for one in seen]
        views = board_views(arm.robot, arm.q, seen, names, INTRINSICS, 'on-tool')
        assert not views.left_out
        assert max(turned(one, pose) for one, pose in zip(views.poses, arm.poses)) < 0.15
    assert wrong > 2


def test_without_an_image_that_tells_flat_boards_are_left_out():
    arm = pictured_arm('on-tool', 12, 9)
    seen = small_board(arm, 0.12, 0.1, 0, whole=0)
    names = [one.name for one in seen]
    sure = [len(board_poses(INTRINSICS, one)) == 1 for one in seen]
    assert 0 < sum(sure) < len(seen)
    flat = [one for one, told in zip(seen, sure) if not told][:4]
    with refused(CalibrationError, 'too-few', '0 of 4 images', 'inclined'):
        board_views(arm.robot, arm.q[:4], flat, names[:4], INTRINSICS, 'on-tool')


@pytest.mark.parametrize(('where', 'size'), [('on-tool', 0.97), ('fixed', 1.03)])
def test_squares_of_another_size_are_named(where, size):
    for seed in (21,):
        arm = pictured_arm(where, 25, seed)
        seen = [one._replace(points=size * one.points) for one in arm.seen]
        try:
            found = pictured(arm._replace(seen=seen), where)
        except CalibrationError as error:
            sentence = str(error)
        else:
            assert not found.accepted
            sentence = found.refusals[-1]
        ratio = re.match(r'the squares of the board are (?:some )?(\d\.\d+) ', sentence)[1]
        assert abs(float(ratio) * size - 1.0) < 0.01


def test_squares_of_another_size_by_far_are_named():
    arm = pictured_arm('fixed', 25, 23)
    for size in (0.001, 0.7, 25.4):
        seen = [one._replace(points=size * one.points) for one in arm.seen]
        with refused(CalibrationError, 'board-size', 'undone'):
            pictured(arm._replace(seen=seen), 'fixed')


@pytest.mark.parametrize('where', BOTH)
def test_another_focal_length_is_named(where):
    arm = pictured_arm(where, 25, 24)
    both = ((1.007, 0.004), (1.03, 0.015))
    for ratio, limit in both if where == 'on-tool' else both[:1]:
        matrix = INTRINSICS.matrix * [[ratio], [ratio], [1.0]]
        matrix[:2, 2] = INTRINSICS.matrix[:2, 2]
        found = pictured(arm, where, replace(INTRINSICS, matrix=matrix))
        assert found.accepted == (ratio < 1.01)
        sentence = (found.remarks if found.accepted else found.refusals)[-1]
        told = re.match(r"the camera's focal length is some (\d\.\d+) ", sentence)[1]
        assert abs(float(told) * ratio - 1.0) < limit


def test_another_camera_is_refused():
    arm = pictured_arm('on-tool', 25, 25)
    views = board_views(arm.robot, arm.q, arm.seen, 25 * ['a'], INTRINSICS, 'on-tool')
    assert not views.doubt
    other = replace(INTRINSICS, distortion=np.array([0.3, 0.0, 0.0, 0.0, 0.0]))
    views = board_views(arm.robot, arm.q, arm.seen, 25 * ['a'], other, 'on-tool')
    assert 'camera.yaml' in views.doubt
    with pytest.raises(CalibrationError):
        pictured(arm, 'on-tool', other)


@pytest.mark.parametrize('where', BOTH)
def test_a_camera_that_is_elsewhere_is_refused(where):
    for seed in (26,):
        arm = pictured_arm(where, 25, seed)
        other = BOTH[BOTH.index(where) - 1]
        with refused(CalibrationError, 'tool-axes', 'take calibrate-camera'):
            pictured(arm, other)


def test_proposed_poses_have_the_board_in_the_image():
    where = 'fixed'  # for a camera on the tool the command proposes some
    arm = pictured_arm(where, 8, 28)
    found = pictured(arm, where)
    proposed = propose_poses(arm.robot, 5, found)
    seen = board_seen(arm.true, proposed.q, arm.on_tool, arm.still, where)
    assert all(map(is_in_view, seen))
    assert np.all(proposed.q >= arm.robot.limits[:, 0])
    assert np.all(proposed.q <= arm.robot.limits[:, 1])
    # What they tell, they tell: the deviations after as many images are those that were promised.
    random = np.random.default_rng(2)
    more = [corners_of(pose, f'{k}.png', 0.2, random) for k, pose in enumerate(seen)]
    q = np.concatenate([arm.q, proposed.q])
    later = pictured(arm._replace(q=q, seen=[*arm.seen, *more]), where)
    deviations = {one.name: one.deviation for one in later.parameters}
    ratios = [deviations[name] / own for name, own in zip(proposed.names, proposed.after)]
    assert 0.5 < np.median(ratios) < 2.0
    with refused(CalibrationError, 'too-few', 'the board in the image'):
        propose_poses(arm.robot, 8, found, among=arm.q + [1.5, 0, 0, 0, 0, 0])


@pytest.mark.slow
def test_the_command_goes_from_images_to_the_robot_file(tmp_path, capsys):
    # Of a camera that is fixed the command says the same by measured poses.
    where = 'on-tool'
    random = np.random.default_rng(1)
    arm = pictured_arm(where, 12, 30, camera=TINY)
    folder = tmp_path / 'pictures'
    written(folder, arm, BOARD, TINY, random)
    cv2.imwrite(str(folder / '003.png'), np.full((360, 480), 90, dtype=np.uint8))
    # One image is of another pose of the arm.
    pose = arm.poses[7] @ pose_of([0.02, 0.0, 0.0], (0.0, 0.0, 0.0))
    cv2.imwrite(str(folder / '007.png'), picture(BOARD, TINY, pose, random))
    (tmp_path / 'camera.yaml').write_text(ros_file(TINY))
    file = table(tmp_path / 'taken.csv', arm, [f'{k:03}.png' for k in range(12)])
    mine, document, page = (tmp_path / name for name in ('mine.yaml', 'all.json', 'all.html'))
    given = [file, '--robot', 'ur5e', '--stamps', 'none', '--camera', where]
    given += ['--images', folder, '--board', WORDS, '--intrinsics', tmp_path / 'camera.yaml']
    outputs = ['--output', mine, '--json', document, '--html', page]
    code, out, err = run(capsys, 'calibrate-camera', *given, *outputs)
    assert (code, err) == (0, '')
    assert 'held-out images are 0.' in out
    assert '1 image is left out: 003.png' in out
    assert 'from 0: pose 6 007.png' in out
    assert f'those of {tmp_path / "camera.yaml"}' in out
    images = json.loads(document.read_text())['images']
    assert [one['name'] for one in images['seen']] == [f'{k:03}.png' for k in range(12) if k != 3]
    assert images['seen'][3]['row'] == 4
    assert images['seen'][6]['held_out_pixels'] > 5.0
    assert all(one['held_out_pixels'] < 2.0 for k, one in enumerate(images['seen']) if k != 6)
    first, _ = json.loads(document.read_text())['camera']
    assert np.abs(np.subtract(first['pose'], arm.on_tool)[:3, 3]).max() < 5e-3
    code, out, err = run(capsys, 'check', '--strict', mine)
    assert (code, err) == (0, '')
    code, out, err = run(capsys, 'calibrate-propose', *given, '--count', 1)
    assert (code, err) == (0, '')
    _, _, rows = out.partition('stamp,position.')
    assert len(rows.split()) == 2


def test_wrong_options_of_images_are_sentences(tmp_path, capsys):
    arm = pictured_arm('on-tool', 4, 31, camera=SMALL)
    folder, camera = tmp_path / 'pictures', tmp_path / 'camera.yaml'
    folder.mkdir()
    cv2.imwrite(str(folder / 'a.png'), np.full((480, 640), 90, dtype=np.uint8))
    cv2.imwrite(str(folder / 'b.png'), np.full((10, 10), 90, dtype=np.uint8))
    camera.write_text(ros_file(SMALL))
    arm = arm._replace(q=arm.q[:3])
    file = table(tmp_path / 'taken.csv', arm, ['a.png', 'b.png', 'c'])
    twice = table(tmp_path / 'twice.csv', arm, 3 * ['a.png'])
    other = tmp_path / 'other.csv'
    other.write_text(file.read_text().replace('image', 'picture'))
    images, board = ('--images', folder), ('--board', WORDS)
    on_tool, intrinsics = ('--camera', 'on-tool'), ('--intrinsics', camera)
    every = (*images, *board, *on_tool, *intrinsics)
    for code, sentence, *options in (
        (2, 'go together: give all three', file, *on_tool, *board),
        (2, 'go together: give all three', file, *on_tool, *intrinsics),
        (2, "Missing option '--camera'", file, *images, *board, *intrinsics),
        (2, 'go together: give all three', file, *images, *on_tool, *intrinsics),
        (2, 'go together: give all three', file, *images, *on_tool, *board),
        (2, f'no folder {camera}', file, '--images', camera, *board, *on_tool, *intrinsics),
        (2, 'takes one FILE', file, other, *every),
        (2, 'takes one FILE', camera, *every),
        (2, 'give FILE', *every),
        (2, 'for instance 7x5', file, *images, '--board', '7x5', *on_tool, *intrinsics),
        (2, 'which are smaller', file, *images, '--board', WORDS.replace('30mm', '50mm'), *on_tool,
         *intrinsics),
        (1, '--board: unknown', file, *images, '--board', WORDS.replace('5X5', '9X9'), *on_tool,
         *intrinsics),
        (1, 'not a calibration', file, *images, *board, *on_tool, '--intrinsics', file),
        (1, "no column 'image'", other, *every),
        (1, "no image 'c'", file, *every),
        (1, 'the image a.png', twice, *every),
    ):  # fmt: skip
        found, _, err = run(
            capsys, 'calibrate-camera', '--robot', 'ur5e', '--stamps', 'none', *options
        )
        assert (found, sentence in err) == (code, True), err


def test_an_image_of_too_many_pixels_is_named(tmp_path, capsys):
    arm = pictured_arm('on-tool', 3, 33, camera=SMALL)
    header = b'IHDR' + struct.pack('>IIBBBBB', 60_000, 60_000, 8, 0, 0, 0, 0)
    check = struct.pack('>I', zlib.crc32(header))
    (tmp_path / 'a.png').write_bytes(b'\x89PNG\r\n\x1a\n\0\0\0\r' + header + check)
    camera = tmp_path / 'camera.yaml'
    camera.write_text(ros_file(SMALL))
    file = table(tmp_path / 'taken.csv', arm._replace(q=arm.q[:1]), ['a.png'])
    given = [
        'calibrate-camera',
        file,
        '--robot',
        'ur5e',
        '--stamps',
        'none',
        '--camera',
        'on-tool',
    ]
    given += ['--images', tmp_path, '--board', WORDS, '--intrinsics', camera]
    code, _, err = run(capsys, *given)
    assert (code, '\n' in err) == (1, False)
    assert 'a.png: not a readable image' in err
    assert '268,435,456 pixels' in err


def test_mirrored_images_are_named(tmp_path, capsys):
    arm = pictured_arm('on-tool', 1, 32, camera=SMALL)
    folder, camera = tmp_path / 'pictures', tmp_path / 'camera.yaml'
    folder.mkdir()
    camera.write_text(ros_file(SMALL))
    for one, pose in zip(arm.seen, arm.poses):
        image = picture(BOARD, SMALL, pose, np.random.default_rng(1))
        cv2.imwrite(str(folder / one.name), np.ascontiguousarray(image[::-1]))
    given = [
        'calibrate-camera',
        table(tmp_path / 'taken.csv', arm),
        '--robot',
        'ur5e',
        '--stamps',
        'none',
    ]
    given += ['--images', folder, '--board', WORDS, '--intrinsics', camera]
    code, _, err = run(capsys, *given, '--camera', 'on-tool')
    assert code == 1
    assert f'{folder}: ' in err
    assert 'mirrored' in err
