# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Estimate poses of a board from its corners in images, with their covariances."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...errors import CalibrationError
from ...kernel import Floats, Integers
from ...kinematics.forward import forward_kinematics
from ...rigid_motion import apart, exponential, inverses
from ...robot.chain import FrozenArrays
from ...robot.robot import Robot
from ..checking.diagnosis import MIN_POSES
from ..recordings.readers.block import Flags
from .boards.board import SeenCorners
from .boards.intrinsics import Intrinsics
from .boards.opencv import opencv
from .camera import ON_TOOL, Camera
from .checking import MIN_CHANGE, NAMES_IN_SENTENCE
from .placing import Free, offsets_of

if TYPE_CHECKING:
    from ...printing import Json

# A flat board looks nearly equal in two different poses. The pose with the larger sum of squared
# corner residuals is excluded if this sum is larger by 25 (5 squared) variances of the corner
# noise.
POSE_DEVIATIONS = 5.0
# OpenCV's refinement of a board pose stops after 50 steps, or if a step changes the pose by less
# than the machine epsilon. The flag 3 asks for both tests.
REFINED = (3, 50, float(np.finfo(np.float64).eps))
# Largest usual noise of a corner's coordinate, px. A larger noise causes a warning.
USUAL_PIXELS = 0.3
# Limits the distance d between board and camera in proposed poses:
# d_min / DISTANCE_RATIO < d < d_max * DISTANCE_RATIO. Here d_min and d_max are the least and the
# largest distance between board and camera in the images.
DISTANCE_RATIO = 1.2
# Least cosine of the angle between the board's normal and the camera's axis in proposed poses: the
# angle is at most 60 degrees.
FACING_COSINE = 0.5
# In proposed poses, the board keeps this distance from each edge of the image, as a share of the
# width and height of the image.
RIM_SHARE = 0.04
TOO_FLAT = 'the board is seen too flat, or from too far, to tell which way it is inclined'


class BoardPose(NamedTuple):
    """
    A pose (4, 4) of a board in the frame of the camera, and the sum of the squared residuals
    (px^2) of the corners at this pose.
    """

    pose: Floats
    squares: float


# Maps the index of an image to the poses of the board that fit the corners in this image, the
# likeliest pose first.
PosesOfImages = dict[int, list[BoardPose]]


@dataclass(frozen=True, eq=False)
class BoardViews(FrozenArrays):
    """
    A board in images: its corners and its poses.

    Attributes
    ----------
    camera
        The intrinsics of the camera.
    seen : N
        The corners in each image.
    rows : shape (N,)
        For each image, the index of the joint positions at which it was taken.
    poses : shape (N, 4, 4)
        Poses of the board in the frame of the camera.
    squares : shape (N,), px^2
        The sum of the squared corner residuals at each pose.
    left_out
        Sentences on images without a pose.
    """

    camera: Intrinsics
    seen: tuple[SeenCorners, ...]
    rows: Integers
    poses: Floats
    squares: Floats
    left_out: tuple[str, ...] = ()

    @property
    def noise(self) -> float:
        """
        Return the standard deviation (px) of one coordinate of a corner in the images, estimated
        from the corner residuals.
        """
        free = sum(2 * len(corners.points) - 6 for corners in self.seen)
        return float(np.sqrt(np.sum(self.squares) / free))

    @property
    def typical(self) -> Floats:
        """
        Return the noise of a board pose for a corner noise of 1 px, shape (2,).

        The first number is the standard deviation of one coordinate of the position (m). The
        second is the standard deviation of one coordinate of the rotation vector (rad). Both are
        root mean squares over all images and axes.
        """
        variances = np.einsum('nkk->nk', self._covariances(self.poses, self.seen))
        return np.asarray(np.sqrt(variances.reshape(-1, 2, 3).mean(axis=(0, 2))))

    @property
    def instrument(self) -> tuple[float, float]:
        """
        Return the noise of a board pose, which follows from the noise of the corners.

        The first number is the standard deviation of one coordinate of the position (m). The
        second is the standard deviation of one coordinate of the rotation vector (rad). Both are
        root mean squares over all images and axes.
        """
        position, rotation = (self.noise * self.typical).tolist()
        return position, rotation

    @property
    def doubt(self) -> str:
        """Return a warning if the noise of the corners is large, else an empty text."""
        if self.noise < USUAL_PIXELS:
            return ''
        return (
            f'within an image each number of a corner is off by {self.noise:.2f} px, more than '
            f'is usual ({USUAL_PIXELS:g}): are {self.camera.file} and the images of one camera '
            'and lens, and is the board flat?'
        )

    def _covariances(self, poses: Floats, seen: Iterable[SeenCorners]) -> Floats:
        # Return the covariance (6, 6) of each of N poses of the board, if the corners have a noise
        # of one pixel.
        moves = (moved(self.camera, *pair) for pair in zip(poses, seen))
        return np.array([np.linalg.inv(J.T @ J) for _, J in moves])

    @property
    def whitening(self) -> Floats:
        """
        Return N whitening matrices (N, 6, 6), one for each pose of the board.

        The matrix times the residual of the pose gives six uncorrelated numbers. For every
        pose, the first three numbers have the standard deviation `instrument[0]` (m), and the last
        three have `instrument[1]` (rad).
        """
        return self.whitening_at(self.poses, self.seen)

    def whitening_at(self, poses: Floats, seen: Sequence[SeenCorners] = ()) -> Floats:
        """
        Return a whitening matrix (6, 6) for each of N given poses (N, 4, 4) of the board.

        Without `seen`, the function assumes that the camera sees the same corners at each pose:
        those of the image with most corners.
        """
        corners = seen or [self._whole] * len(poses)
        roots = np.linalg.cholesky(self._covariances(poses, corners))
        return np.asarray(np.repeat(self.typical, 3)[:, None] * np.linalg.inv(roots))

    @property
    def _whole(self) -> SeenCorners:
        # Return the corners of the image with most corners.
        return max(self.seen, key=lambda corners: len(corners.points))

    def are_in_view(self, poses: Floats) -> Flags:
        """
        Return flags (N,): whether the camera sees the whole board at each of N poses (N, 4, 4) of
        the board.

        The distance from camera to board must be in the range of the distances in the images,
        widened by DISTANCE_RATIO. The angle between the board's normal and the axis of the camera
        must be below 60 degrees.
        """
        points = self._whole.points
        middle = np.append(points.mean(axis=0), 1.0)
        depths = (self.poses @ middle)[:, 2]
        near, far = depths.min() / DISTANCE_RATIO, depths.max() * DISTANCE_RATIO
        z = (poses @ middle)[:, 2]
        free = (poses[:, 2, 2] > FACING_COSINE) & (near < z) & (z < far)
        if np.any(free):
            some = poses[free]
            at = points @ np.swapaxes(some[:, :3, :3], 1, 2) + some[:, None, :3, 3]
            seen = self.camera.sees(at.reshape(-1, 3), RIM_SHARE)
            free[free] = np.all(seen.reshape(len(some), -1), axis=1)
        return np.asarray(free)

    def pixel_errors(self, remainders: Floats) -> Floats:
        """
        Return the RMS errors (N,), px, of the corners of each image, if the board is at the pose
        that the calibrated arm predicts.

        Parameters
        ----------
        remainders : shape (N, 2, 3), m and rad
            Residuals from the predicted poses to `poses`, in the frame of the camera.
        """
        predicted = self.poses.copy()
        predicted[:, :3, 3] -= remainders[:, 0]
        predicted[:, :3, :3] = exponential(-remainders[:, 1]) @ predicted[:, :3, :3]
        residuals = (moved(self.camera, *pair)[0] for pair in zip(predicted, self.seen))
        return np.array([np.sqrt(np.mean(np.sum(residual**2, axis=1))) for residual in residuals])


def moved(camera: Intrinsics, pose: Floats, seen: SeenCorners) -> tuple[Floats, Floats]:
    """
    Return the residuals (K, 2), px, between the seen corners and the corners computed for a pose
    of the board. Return also the derivatives (2 K, 6) of the computed pixels by position and
    rotation of the board.
    """
    arms = seen.points @ pose[:3, :3].T
    pixels, J = camera.pixels(arms + pose[:3, 3])
    moves = np.concatenate([J, np.cross(arms[:, None], J)], axis=2)
    return seen.pixels - pixels, moves.reshape(-1, 6)


def board_poses(camera: Intrinsics, seen: SeenCorners) -> list[BoardPose]:
    """
    Return the poses of a flat board that fit its corners in an image: one or two poses, the
    likeliest first.
    """
    cv2 = opencv()
    given = seen.points, seen.pixels, camera.matrix, camera.distortion
    _, turns, places, _ = cv2.solvePnPGeneric(*given, flags=cv2.SOLVEPNP_IPPE)
    fits = []
    for turn, place in zip(turns, places):
        turn, place = cv2.solvePnPRefineLM(*given, turn, place, REFINED)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(turn)[0], place[:, 0]
        fits.append(BoardPose(pose, float(np.sum(moved(camera, pose, seen)[0] ** 2))))
    best, *others = sorted(fits, key=lambda fit: fit.squares)
    free = 2 * len(seen.points) - 6
    limit = best.squares * (1.0 + POSE_DEVIATIONS**2 / free)
    turned = apart(best.pose[None], np.array([fit.pose for fit in [best, *others]]))[1][1:]
    rivals = zip(others, turned)
    return [best, *(fit for fit, w in rivals if fit.squares < limit and w > MIN_CHANGE)]


def board_views(
    robot: Robot,
    q: Floats,
    seen: Sequence[SeenCorners | str],
    names: Sequence[str],
    intrinsics: Intrinsics,
    camera: Camera,
) -> BoardViews:
    """
    Return the poses of a board in images taken at joint positions (N, n), rad or m.

    If two poses fit the corners of an image, the function takes the pose that agrees with the arm
    and the other images.

    Parameters
    ----------
    seen, names : N
        `seen` has the corners of each image, or a sentence that says why the image has no corners.
        `names` has the names of the images.

    Raises
    ------
    CalibrationError
        Fewer than three images determine a pose of the board.
    """
    given = {k: view for k, view in enumerate(seen) if isinstance(view, SeenCorners)}
    left_out = [f'{names[k]}: {text}' for k, text in enumerate(seen) if isinstance(text, str)]
    fits = {k: board_poses(intrinsics, view) for k, view in given.items()}
    sure = [k for k, group in fits.items() if len(group) == 1]
    if len(sure) < len(fits):
        if len(sure) < MIN_POSES:
            left_out += [f'{names[k]}: {TOO_FLAT}' for k in fits if k not in sure]
            fits = {k: fits[k] for k in sure}
        else:
            fits = _decided(robot, q, fits, sure, camera)
    if len(fits) < MIN_POSES:
        raise CalibrationError(
            f'{len(fits)} of {len(seen)} images tell where the board is: at least {MIN_POSES} '
            f'are needed. {_named(left_out)}',
            code='too-few',
        )
    poses, squares = (np.array(values) for values in zip(*(group[0] for group in fits.values())))
    corners, rows = tuple(given[k] for k in fits), np.array(list(fits))
    return BoardViews(intrinsics, corners, rows, poses, squares, tuple(left_out))


def _decided(
    robot: Robot, q: Floats, fits: PosesOfImages, sure: Sequence[int], camera: Camera
) -> PosesOfImages:
    # First fit the offsets of base and tool to the images in which only one pose of the board is
    # possible. Then choose, for each image, the board pose whose rotation is nearest to the one
    # that the arm predicts.
    def placed(poses: Floats) -> Floats:
        return inverses(poses) if camera == ON_TOOL else poses

    A = forward_kinematics(robot, q)
    B = placed(np.array([fits[k][0].pose for k in sure]))
    X, Y, _ = offsets_of(A[list(sure)], B, False, Free())
    result = {}
    for k, group in fits.items():
        poses = placed(np.array([fit.pose for fit in group]))
        angles = apart(poses, (X @ A[k] @ Y)[None])[1]
        result[k] = [group[int(np.argmin(angles))]]
    return result


def view_sentences(views: BoardViews, held_out: Floats, outliers: Sequence[int]) -> Iterator[str]:
    """
    Yield sentences on the errors of the corners, and on the images that do not determine a pose.

    Parameters
    ----------
    held_out : shape (N, 2, 3), m and rad
        The residual of each pose in cross-validation. The poses are divided into blocks, and the
        residuals of a block are computed with corrections that were fitted to the other blocks.
    outliers
        Indices of the poses that were left out of the fit.
    """
    errors = np.delete(views.pixel_errors(held_out), outliers)
    yield (
        f'Corners of held-out images are {np.sqrt(np.mean(errors**2)):.2f} px off (rms); within '
        f'an image each number of a corner has a noise of {views.noise:.2f} px'
    )
    if views.doubt:
        yield views.doubt[0].upper() + views.doubt[1:]
    yield f'The intrinsics are those of {views.camera.file}: nothing of them is fitted'
    if views.left_out:
        single = len(views.left_out) == 1
        images = '1 image is' if single else f'{len(views.left_out)} images are'
        yield f'{images} left out: {_named(views.left_out)}'


def _named(left_out: Sequence[str]) -> str:
    more = len(left_out) - NAMES_IN_SENTENCE
    return '; '.join(left_out[:NAMES_IN_SENTENCE]) + (f'; and {more} more' if more > 0 else '')


def view_document(views: BoardViews, held_out: Floats) -> dict[str, 'Json']:
    """
    Return the poses, errors and remarks of the images as a dictionary for JSON. `held_out` (N, 2,
    3), m and rad, has the residuals of the poses from cross-validation.
    """
    errors = views.pixel_errors(held_out).tolist()
    return {
        'intrinsics': views.camera.file,
        'noise': views.noise,
        'seen': [
            {'name': view.name, 'row': int(k), 'corners': len(view.points), 'held_out_pixels': px}
            for view, k, px in zip(views.seen, views.rows, errors)
        ],
        'left_out': views.left_out,
    }
