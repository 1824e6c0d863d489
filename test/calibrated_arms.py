# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Arms that differ from their tables by known errors, and poses measured of them."""

import itertools
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
from arms import robot_of

import kinematics_service as ks
from kinematics_service.apps.calibration.board_views import board_views
from kinematics_service.apps.calibration.boards.board import Board, SeenCorners
from kinematics_service.apps.calibration.boards.intrinsics import Intrinsics
from kinematics_service.apps.calibration.corrections import corrected_robot
from kinematics_service.apps.calibration.fitting import widened
from kinematics_service.apps.calibration.output.sheet import SHEETS
from kinematics_service.apps.checking.offsets import nearest_rotation
from kinematics_service.kinematics.uncertainty.corrected_chain import pose_change
from kinematics_service.kinematics.uncertainty.parameters import parameters_of, placement
from kinematics_service.rigid_motion import (
    exponential,
    inverse,
    inverses,
    pose_of,
    rotation_vector,
)
from kinematics_service.robot.task import seeded_poses

# Ten arms: 6R with and without parallel axes, 7R, SCARA, prismatic, coupled, modified, elementary,
# shape matrices.
TEN = (
    'puma560',
    'ur5e',
    'panda',
    'kuka_iiwa14',
    'scara_hsr065',
    'spherical_rrp',
    'parallelogram_left',
    'craig_3r',
    'rrp_elementary',
    'offset_stanford_shape',
)
# Where a tracker stands, and where its target is on the tool.
BASE = pose_of([1.0, 2.0, -0.5], (0.1, 1.0, -2.0))
TOOL = pose_of([0.02, -0.05, 0.1], (0.3, -0.2, 2.0))
# A spike on the tool.
TIP = np.array([0.02, -0.05, 0.1])


class MeasuredArm(NamedTuple):
    """
    An arm with errors and poses of it.

    `robot` is nominal, `true` has the errors; `errors` are those of `parameters`; q (N, n) and
    poses (N, 4, 4) are measured = base true tool with noise.
    """

    robot: ks.Robot
    true: ks.Robot
    parameters: tuple
    errors: np.ndarray
    q: np.ndarray
    poses: np.ndarray


def positions_within(robot, count, seed):
    """Return random joint positions within the limits, turns of at most half a turn."""
    prismatic = [kind == 'prismatic' for kind in robot.joint_types]
    within = seeded_poses(robot.limits, prismatic)
    low, high = within.min(axis=0), within.max(axis=0)
    random = np.random.default_rng(seed)
    return random.uniform(np.maximum(low, -np.pi), np.minimum(high, np.pi), (count, robot.dof))


@cache
def true_arm(name, seed, size, gears=False):
    """Return the parameters of an arm, errors of them, and the arm that has these."""
    robot = robot_of(name)
    random = np.random.default_rng(seed)
    parameters = parameters_of(robot, gears).table
    errors = size * np.array([one.scale for one in parameters])
    errors = errors * random.normal(size=len(parameters))
    return parameters, errors, corrected_robot(robot, parameters, errors)


def measured_arm(name, count, noise=0.0, seed=0, size=1.0, base=BASE, tool=TOOL, gears=False):
    """
    Return an arm with errors of 1 mm and 0.2 degrees, times `size`, and poses with noise.

    With `gears` ratios have errors of a thousandth.
    """
    robot = robot_of(name)
    parameters, errors, true = true_arm(name, seed, size, gears)
    random = np.random.default_rng([seed, 1])
    q = positions_within(robot, count, seed + 1)
    poses = base @ ks.forward_kinematics(true, q) @ tool
    poses[:, :3, 3] += noise * random.normal(size=(count, 3))
    poses[:, :3, :3] = exponential(noise * random.normal(size=(count, 3))) @ poses[:, :3, :3]
    return MeasuredArm(robot, true, parameters, errors, q, poses)


def predicted(found, q):
    """Return the measured poses (N, 4, 4) that a calibration predicts, of its first set."""
    poses = ks.forward_kinematics(found.calibrated, q)
    return found.base_offsets[0] @ poses @ found.tool_offsets[0]


def held_out_chi_square(arm, found, count, noise, seed):
    """
    Return chi-square over its number of poses of the first set that nothing was fitted to.

    Their errors are counted by the noise, with Student's factor, and what the fit left open.
    """
    q = positions_within(arm.robot, count, [seed, 77])
    random = np.random.default_rng([seed, 78])
    poses = truly(arm, q)
    poses[:, :3, 3] += noise * random.normal(size=(count, 3))
    poses[:, :3, :3] = exponential(noise * random.normal(size=(count, 3))) @ poses[:, :3, :3]
    ahead = predicted(found, q)
    turned = rotation_vector(poses[:, :3, :3] @ np.swapaxes(ahead[:, :3, :3], 1, 2))
    left = np.concatenate([(poses - ahead)[:, :3, 3], turned], axis=1)
    arm_of = parameters_of(found.robot)
    begin = len(arm_of.table)
    chain = placement(arm_of.chain, found.base_starts[0], found.tool_starts[0], (begin, begin + 6))
    values = np.array([one.correction for one in found.parameters])
    J = pose_change(chain, values, q).jacobian
    each = np.repeat(widened(found.noise, found.freedom), 3)
    C = J @ found.covariance @ np.swapaxes(J, 1, 2) + np.diag(each**2)
    return np.sum(left * np.linalg.solve(C, left[:, :, None])[:, :, 0]) / left.size


def truly(arm, q, base=BASE, tool=TOOL):
    """Return the poses that would be measured without noise."""
    return base @ ks.forward_kinematics(arm.true, q) @ tool


class TouchingArm(NamedTuple):
    """An arm with errors whose tip touched points: q (N, n), and the point's name of each row."""

    robot: ks.Robot
    true: ks.Robot
    errors: np.ndarray
    q: np.ndarray
    marks: list


def touching_positions(robot, point, count, seed, noise=0.0):
    """Return joint positions (count, n) at which the tip is within noise of a point."""
    q = positions_within(robot, 8 * count, seed)
    random = np.random.default_rng([*np.ravel(seed), 5])
    targets = np.asarray(point) + noise * random.normal(size=(len(q), 3))
    off = np.arange(len(q))  # rows that are not there yet
    for _ in range(40):
        T = ks.forward_kinematics(robot, q[off])
        left = targets[off] - (T[:, :3, 3] + T[:, :3, :3] @ TIP)
        far = np.linalg.norm(left, axis=1) >= 1e-14
        off, left = off[far], left[far]
        J = ks.jacobian(robot, q[off], at=TIP)[:, :3]
        damped = J @ np.swapaxes(J, 1, 2) + np.sum(left**2, axis=1)[:, None, None] * np.eye(3)
        step = np.swapaxes(J, 1, 2) @ np.linalg.solve(damped, left[:, :, None])
        q[off] += np.clip(step[:, :, 0], -0.3, 0.3)
    reached = ~np.isin(np.arange(len(q)), off)
    reached &= np.max(np.abs(q), axis=1) < 2.0 * np.pi
    assert np.sum(reached) >= count
    return q[reached][:count]


@cache
def touching_arm(name, points, count, noise=0.0, seed=0):
    """Return an arm with errors of 1 mm and 0.2 degrees that touches named points, with noise."""
    _, errors, true = true_arm(name, seed, 1.0)
    q = [
        touching_positions(true, point, count, [seed, k], noise)
        for k, (_, point) in enumerate(points)
    ]
    marks = [mark for mark, _ in points for _ in range(count)]
    return TouchingArm(robot_of(name), true, errors, np.concatenate(q), marks)


class SheetTouches(NamedTuple):
    """
    An arm with wrong zeros that touched points of a sheet.

    q (N, n) as the joints report them, points (N, 3) in the frame of the sheet with their names,
    what is to be added to each joint, and the sign (N, n) of the way it came.
    """

    robot: ks.Robot
    q: np.ndarray
    points: np.ndarray
    names: list
    zeros: np.ndarray
    approach: np.ndarray


def sheet_touches(robot, place, each, noise, play, seed, size=0.05, crosses=None):
    """
    Return touches of crosses of a sheet at a place (4, 4), from `each` postures far apart.

    Joints are half the play (rad) behind the way they came; zeros are off by a size (rad).
    """
    random = np.random.default_rng([seed, 9])
    chosen, points, names = [], [], []
    for k, (name, point) in enumerate(SHEETS['a4'].points.items()):
        if crosses is not None and name not in crosses:
            continue
        at = place[:3, :3] @ point + place[:3, 3]
        q = touching_positions(robot, at, 100, [seed, k], noise)
        low, high = robot.limits.T
        q = q[np.all((q > low) & (q < high), axis=1)]
        own = [0]
        while len(own) < each:
            between = np.linalg.norm(q[:, None, :-1] - q[None, own, :-1], axis=2)
            own.append(int(np.argmax(between.min(axis=1))))
        chosen.append(q[own])
        points += each * [point]
        names += each * [name]
    q = np.concatenate(chosen)
    zeros = random.normal(size=robot.dof) * size
    approach = random.choice([-1.0, 1.0], q.shape)
    q = q - zeros + 0.5 * play * approach
    return SheetTouches(robot, q, np.array(points), names, zeros, approach)


class CameraArm(NamedTuple):
    """
    An arm with errors, and a board in the frame of a camera.

    q (N, n) and poses (N, 4, 4) of the board; `on_tool` and `still` are where the one of camera
    and board is in the tool frame, and the other in the base frame.
    """

    robot: ks.Robot
    true: ks.Robot
    errors: np.ndarray
    q: np.ndarray
    poses: np.ndarray
    on_tool: np.ndarray
    still: np.ndarray


# Before a UR5e: joint positions about which the camera sees the board, and how far they go.
BEFORE_BOARD, AROUND = np.array([0.3, -1.4, 1.6, -1.8, -1.5, 0.4]), 0.6
# Noise of a board in a picture: m across and along the view, rad.
SEEN = (3e-4, 1e-3)


def camera_arm(where, count, seed, noise=SEEN, size=1.0):
    """Return a UR5e with errors and a camera that is on its tool, or fixed."""
    _, errors, true = true_arm('ur5e', seed, size)
    random = np.random.default_rng([seed, 11])
    on_tool = pose_of(random.uniform(-0.06, 0.06, 3), random.uniform(-0.5, 0.5, 3))
    still = pose_of([0.5, 0.1, 0.02], random.uniform(-0.5, 0.5, 3))
    if where == 'fixed':
        still = pose_of([1.3, 0.2, 0.5], random.uniform(-0.5, 0.5, 3))
    q = BEFORE_BOARD + random.uniform(-AROUND, AROUND, (count, 6))
    poses = board_seen(true, q, on_tool, still, where)
    poses[:, :3, 3] += noise[0] * random.normal(size=(count, 3))
    poses[:, :3, :3] = exponential(noise[1] * random.normal(size=(count, 3))) @ poses[:, :3, :3]
    return CameraArm(robot_of('ur5e'), true, errors, q, poses, on_tool, still)


def board_seen(robot, q, on_tool, still, where):
    """Return the board in the frame of the camera, (N, 4, 4)."""
    between = inverses(ks.forward_kinematics(robot, q) @ on_tool) @ still
    return between if where == 'on-tool' else inverses(between)


def closed_form(A, B):
    """
    Return X of A_i X B_i = Z for poses (N, 4, 4): AX = XB (Park and Martin 1994), all pairs.

    A are poses of the tool in the base frame, B of what stands still in that of what is on it.
    """
    i, j = np.triu_indices(len(A), 1)
    a, b = inverses(A[j]) @ A[i], B[j] @ inverses(B[i])
    M = rotation_vector(b[:, :3, :3]).T @ rotation_vector(a[:, :3, :3])
    U, _, Vt = np.linalg.svd(M)
    R = Vt.T @ np.diag([1.0, 1.0, np.linalg.det(Vt.T @ U.T)]) @ U.T
    left = (a[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    right = (b[:, :3, 3] @ R.T - a[:, :3, 3]).reshape(-1)
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, np.linalg.lstsq(left, right, rcond=None)[0]
    return X


def by_closed_form(arm, where, form=closed_form):
    """Return what is on the tool, and what stands still, by a closed form on the nominal arm."""
    A = ks.forward_kinematics(arm.robot, arm.q)
    B = arm.poses if where == 'on-tool' else inverses(arm.poses)
    X = form(A, B)
    every = A @ X @ B
    Z = np.eye(4)
    Z[:3, :3], Z[:3, 3] = nearest_rotation(every[:, :3, :3].mean(axis=0)), every[:, :3, 3].mean(0)
    return X, Z


def board_errors(arm, where, found, q=None, point=(0.0, 0.0, 0.0), forms=(closed_form,)):
    """
    Return how far (m, RMS) a point of the board at new poses is off: calibrated, by closed forms.
    """
    if q is None:
        q = BEFORE_BOARD + np.random.default_rng(5).uniform(-AROUND, AROUND, (200, 6))
    true = board_seen(arm.true, q, arm.on_tool, arm.still, where)
    fitted = found.tool_offsets[0], np.linalg.inv(found.base_offsets[0])
    every = [(found.calibrated, *fitted)]
    every += [(arm.robot, *by_closed_form(arm, where, form)) for form in forms]
    seen = [board_seen(*one[:1], q, *one[1:], where) for one in every]
    left = [(one - true)[:, :3] @ np.append(point, 1.0) for one in seen]
    return [np.sqrt(np.mean(np.sum(one**2, axis=1))) for one in left]


class PicturedArm(NamedTuple):
    """
    An arm with errors, and the corners of a board in images of a camera.

    q (N, n); poses (N, 4, 4) of the board in the frame of the camera without noise; `on_tool` and
    `still` as `CameraArm` has them.
    """

    robot: ks.Robot
    true: ks.Robot
    errors: np.ndarray
    q: np.ndarray
    poses: np.ndarray
    on_tool: np.ndarray
    still: np.ndarray
    seen: list


# A board that is 0.28 m wide, and a camera with distortion.
BOARD = Board(7, 5, 0.04, 0.03, 'DICT_5X5_100')
INTRINSICS = Intrinsics(
    'camera.yaml',
    np.array([[900.0, 0.0, 640.3], [0.0, 902.0, 481.0], [0.0, 0.0, 1.0]]),
    np.array([-0.12, 0.05, 0.0005, -0.0003, 0.0]),
    1280,
    960,
)
# What a corner is off by in an image, px; the board is seen within 60 degrees of its normal, from
# some distance (m); on a tool it faces aside.
CORNER, OBLIQUE, AWAY = 0.2, 0.5, 0.7
ASIDE = pose_of([0.0] * 3, (0.0, np.pi / 2, 0.0))


def pictured_arm(where, count, seed, corner=CORNER, size=1.0, camera=INTRINSICS):
    """Return a UR5e with errors and images of a board whose corners have a noise (px)."""
    _, errors, true = true_arm('ur5e', seed, size)
    random = np.random.default_rng([seed, 13])
    on_tool = pose_of(random.uniform(-0.06, 0.06, 3), random.uniform(-0.2, 0.2, 3))
    # The board is seen from this far, a little from aside, where the arm is before it.
    seen = pose_of([*random.uniform(-0.05, 0.05, 2), AWAY], random.uniform(-0.3, 0.3, 3))
    seen = seen @ pose_of(-BOARD.corners.mean(axis=0), (0.0, 0.0, 0.0))
    if where == 'fixed':
        on_tool, seen = on_tool @ ASIDE, inverse(seen)
    still = ks.forward_kinematics(true, BEFORE_BOARD) @ on_tool @ seen
    q = in_view(true, on_tool, still, where, count, random, camera)
    poses = board_seen(true, q, on_tool, still, where)
    seen = [
        corners_of(pose, f'{k:03}.png', corner, random, camera) for k, pose in enumerate(poses)
    ]
    return PicturedArm(robot_of('ur5e'), true, errors, q, poses, on_tool, still, seen)


def in_view(true, on_tool, still, where, count, random, camera=INTRINSICS):
    """Return joint positions (count, n) from which the board is wholly seen."""
    kept = np.zeros((0, 6))
    while len(kept) < count:
        q = BEFORE_BOARD + random.uniform(-AROUND, AROUND, (400, 6))
        poses = board_seen(true, q, on_tool, still, where)
        seen = (own for own, pose in zip(q, poses) if is_in_view(pose, camera))
        kept = np.concatenate(
            [kept, *(own[None] for own in itertools.islice(seen, count - len(kept)))]
        )
    return kept


def pictured(arm, where, camera=INTRINSICS):
    """Return the calibration by images of a board, and the images."""
    names = [f'{k:03}.png' for k in range(len(arm.seen))]
    views = board_views(arm.robot, arm.q, arm.seen, names, camera, where)
    q = arm.q[views.rows]
    weights = {'whitening': views.whitening, 'noise': views.instrument}
    found = ks.calibrate(arm.robot, q, views.poses, camera=where, **weights)
    return replace(found, views=views)


def pictured_errors(arm, where, found, forms=(closed_form,)):
    """Return `board_errors` of the middle of the board, where it is seen."""
    random = np.random.default_rng(77)
    q = in_view(arm.true, arm.on_tool, arm.still, where, 60, random)
    seen = arm._replace(q=arm.q[found.views.rows], poses=found.views.poses)
    return board_errors(seen, where, found, q, BOARD.corners.mean(axis=0), forms)


def is_in_view(pose, camera=INTRINSICS):
    """Return whether the board at a pose in the frame of the camera is wholly in the image."""
    points = BOARD.corners @ pose[:3, :3].T + pose[:3, 3]
    return pose[2, 2] > OBLIQUE and bool(np.all(camera.sees(points)))


def corners_of(pose, name, noise, random, camera=INTRINSICS):
    """Return the corners of the board at a pose in the frame of the camera, with noise (px)."""
    pixels = camera.pixels(BOARD.corners @ pose[:3, :3].T + pose[:3, 3])[0]
    return SeenCorners(name, BOARD.corners, pixels + noise * random.normal(size=pixels.shape))
