# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Prepare the poses of a board that a camera measured, and detect a wrong size of the board."""

from typing import Literal, NamedTuple

import numpy as np

from ...errors import CalibrationError
from ...kinematics.forward import forward_kinematics
from ...rigid_motion import inverses
from ...robot.robot import Robot
from .checking import REMARKED_DEVIATIONS, Measured, refuse_mistake
from .fitting import FitProblem, Identified, one_more
from .placing import Free, offsets_of

Camera = Literal['on-tool', 'fixed']
ON_TOOL: Camera = 'on-tool'
# If the fit shows a relative error of the board's size above this value, the result has a remark.
REMARKED_SHARE = 0.003
# If the fit shows a relative error of the board's size above this value, the calibration is
# refused.
REFUSED_SHARE = 0.01
LARGER = (
    'the squares of the board are some {} times as large as given, if the arm is as large as its '
    'table'
)
LONGER = "the camera's focal length is some {} times that of its calibration file"


class WrongSize(NamedTuple):
    """
    A sentence on a wrong size of the board or a wrong focal length, and whether the calibration is
    refused because of it.
    """

    sentence: str
    refused: bool


def wrong_size(problem: FitProblem, fit: Identified) -> WrongSize | None:
    """
    Return a sentence if the measured poses show a wrong size of the board's squares, or a wrong
    focal length of the camera; else None.

    If the board is larger than given, all its coordinates in the frame of the camera are
    multiplied by the same factor. If the focal length is longer, only the distance along the
    camera's axis is multiplied. A larger arm has the same effect as a smaller board. The priors of
    the arm's numbers decide whether the arm or the board is taken as wrong.
    """
    # Use the board poses that the fit predicts instead of the measured ones. If the tool only
    # rotates and hardly moves, the noise of measured positions would be taken for a wrong size of
    # the board.
    poses = problem.predicted(fit.values)
    poses = inverses(poses) if problem.given.from_tool else poses
    moves = np.zeros((len(poses), 2, 3, 2))
    moves[:, 0] = -poses[:, :3, 3, None] * np.array([(1.0, 1.0, 1.0), (0.0, 0.0, 1.0)]).T
    sizes = zip((LARGER, LONGER), *one_more(problem, fit, problem.whitened(moves)))
    candidates = [
        (abs(fraction) / deviation, template, fraction)
        for template, fraction, deviation in sizes
        if abs(fraction) > max(REMARKED_DEVIATIONS * deviation, REMARKED_SHARE)
    ]
    if not candidates:
        return None
    _, template, fraction = max(candidates)
    return WrongSize(template.format(f'{1.0 + fraction:.3f}'), abs(fraction) > REFUSED_SHARE)


def given_by_camera(robot: Robot, given: Measured, camera: Camera, check: bool) -> Measured:
    """
    Return the measurements of a camera in the form that the fit needs: if the camera is on the
    tool, the poses of the board in the frame of the camera are inverted.

    Raises
    ------
    CalibrationError
        A camera on the tool measured positions alone. Or `check` is set, and the residuals show
        that the squares of the board are more than 1 % larger or smaller than given.
    """
    if camera == ON_TOOL and given.positions:
        raise CalibrationError(
            'camera: on-tool needs poses of the board, not positions alone; give orientations too',
            code='no-orientations',
        )
    if camera == ON_TOOL:
        given = given._replace(poses=inverses(given.poses), from_tool=True)
    if not check or given.positions:
        return given
    A, B = forward_kinematics(robot, given.q), given.poses
    X, Y, before = offsets_of(A, B, False, Free())
    # Let A be the poses of the robot file, B the measured poses, X the base offset and Y the tool
    # offset: B = X A Y. Let p_A and R_A be the positions and rotations of A, p_B the positions of
    # B, and y the translation of Y. If the true board is s times as large as given, p_B must be
    # multiplied by s. So solve s p_B = X (p_A + R_A y) for s, for y, and for the translation of X.
    # The equation is linear in these unknowns, since the rotations of X and A do not depend on s.
    R = X[:3, :3] @ A[:, :3, :3]
    ones = np.broadcast_to(np.eye(3), R.shape)
    M = np.concatenate([ones, R, -B[:, :3, 3, None]], axis=2).reshape(-1, 7)
    right = -(A[:, :3, 3] @ X[:3, :3].T).reshape(-1)
    size = float(np.linalg.lstsq(M, right, rcond=None)[0][6])
    if size > 0.0 and abs(size - 1.0) > REFUSED_SHARE:
        scaled = B.copy()
        scaled[:, :3, 3] *= size
        # If `size`, the scale of the board, is below 1, the scaled positions have smaller
        # residuals for this reason alone. Divide the residuals by `size`, so that they are
        # comparable with `before`, the residuals of the positions as given.
        after = offsets_of(A, scaled, False, Free()).remainder / min(size, 1.0)
        sentence = f'the squares of the board are {size:.3g} times as large as given'
        refuse_mistake(sentence, 'board-size', float(np.median(after)), float(np.median(before)))
    return given
