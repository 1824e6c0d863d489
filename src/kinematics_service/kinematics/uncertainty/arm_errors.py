# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute first-order covariances of the tool's pose and twist from the uncertain parameters of an
arm. An error of a parameter moves the tool along a screw.

The robot file gives standard deviations of joint positions, joint velocities and parameters of the
table.
"""

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ... import kernel
from ...errors import CalibrationError
from ...kernel import Floats, Integers, PoseErrors, PoseErrorTable
from ...rigid_motion import inverse
from ...robot.file.parts.description import Uncertainty
from ...robot.file.parts.parameters import (
    ENDS,
    GROUPS,
    SIX,
    ArmParameter,
    end_parameters,
    gear_parameters,
)
from ...robot.points import TOOL
from ...robot.robot import Robot
from ..forward import BASE, link_frames
from ..tool_state import ToolState
from .corrected_chain import CorrectedChain, error_screws, seen_from
from .parameters import every_parameter_of, parameters_of, placement

# Number of robots whose `PoseErrors` are cached. A node needs those of one robot.
CACHE_SIZE = 8


class TableErrors(NamedTuple):
    """
    Arrays that describe the uncertain parameters of a robot's DH table. `pose_errors` converts
    them to the kernel's `PoseErrors`.

    Attributes
    ----------
    frames : shape (P,)
        For each parameter, the index of a frame of the table. In this frame the screw of the
        parameter does not depend on the joint positions.
    screws : shape (P, 6)
        The screw of each parameter in its frame: linear velocity of the frame's origin, angular
        velocity.
    gears : shape (P,)
        If the parameter is the error of a gear ratio, the index of the joint with this gear;
        otherwise -1.
    factor : shape (P, causes)
        A matrix F such that F F^T is the covariance of the parameters. Each column is the effect
        of one independent cause of error. The rows are in rad, in m, or without unit for gear
        ratios.
    """

    frames: Integers
    screws: Floats
    gears: Integers
    factor: Floats


class NamedErrors(NamedTuple):
    """
    The parameters for which a robot file may give a standard deviation, with their error screws.

    An error of a parameter moves the tool along a screw. Screw k belongs to the parameter
    `parameters[of[k]]`. A gear ratio has one screw for each row of the table that its joint moves.
    Every other parameter has one screw. The arrays `frames`, `screws` and `gears` are as in
    `TableErrors`.
    """

    parameters: tuple[ArmParameter, ...]
    frames: Integers
    screws: Floats
    gears: Integers
    of: Integers


def frames_of_elements(robot: Robot) -> Integers:
    """
    Return for k = 0, 1, ... the index of the first table frame after exactly k joint screws.

    Frames and joint screws are counted from the base. Only the first k joint screws move this
    frame.
    """
    parents = robot.chain.table.frame_parent
    return np.array([int(np.argmax(parents == k - 1)) for k in range(robot.chain.elements + 1)])


def screws_in_frames(
    robot: Robot, chain: CorrectedChain, values: Floats
) -> tuple[Integers, Floats]:
    """
    Return for each of the P corrections of a chain the index of a frame of the table, shape (P,),
    and the screw of the correction in this frame, shape (P, 6).

    Parameters
    ----------
    robot
        The arm with the corrections `values` built in, so that its poses are those of the
        corrected chain.
    """
    errors = error_screws(chain, values)
    if len(errors.starts) != robot.chain.elements + 1:
        raise CalibrationError(
            f'calibration: its corrections are those of another arm; give one of {robot.name}',
            code='mismatch',
        )
    at_zero = link_frames(robot, np.zeros(robot.dof))
    frames, screws = frames_of_elements(robot), np.empty_like(errors.screws)
    for k, (frame, start) in enumerate(zip(frames, errors.starts)):
        mask = errors.after == k
        screws[mask] = seen_from(inverse(at_zero[frame]) @ start, errors.screws[mask])
    return frames[errors.after], screws


def named_errors(robot: Robot) -> NamedErrors:
    """
    Return all parameters for which a robot file may give a standard deviation, with their screws.
    The gear ratios are last.
    """
    arm = every_parameter_of(robot.description)
    description, count = robot.description, len(arm.table)
    base, tool = description.base.motion.matrix, description.tool.motion.matrix
    chain = placement(arm.chain, base, tool, (count, count + len(SIX)))
    frames, screws = screws_in_frames(robot, chain, np.zeros(count + 2 * len(SIX)))
    ends = (parameter for end in ENDS for parameter in end_parameters(end, 0))
    gears = gear_parameters(description.joints)
    moving = joint_screws(robot)
    of_joints = [
        (count + 12 + k, e)
        for k, gear in enumerate(gears)
        for e in np.flatnonzero(moving.joints == gear.row).tolist()
    ]
    entries = np.array([e for _, e in of_joints], dtype=np.int64)
    return NamedErrors(
        (*arm.table, *ends, *gears),
        np.concatenate([frames, moving.frames[entries]]),
        np.concatenate([screws, moving.screws[entries]]),
        np.concatenate([np.full(len(frames), -1), moving.joints[entries]]),
        np.array([*range(len(frames)), *(k for k, _ in of_joints)]),
    )


class JointScrews(NamedTuple):
    """
    The joint screws of an arm.

    A joint has one screw for each row of the DH table that it moves.

    `joints` (E,) has indices of joints; `frames` and `screws` are as in `TableErrors`.
    """

    joints: Integers
    frames: Integers
    screws: Floats


def joint_screws(robot: Robot) -> JointScrews:
    """Return the joint screws of an arm, each in a frame of the table."""
    chain = robot.chain.table
    offsets = np.tile(np.eye(4), (robot.chain.frames, 1, 1))
    offsets[:, :3] = chain.frame_offset
    of_elements = frames_of_elements(robot)
    frames, screws = [], []
    for k in range(robot.chain.elements):
        frame = int(of_elements[k + 1])
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            screw = np.array([[0.0, 0.0, chain.by_d[e], 0.0, 0.0, chain.by_theta[e]]])
            frames.append(frame)
            screws.append(seen_from(inverse(offsets[frame]), screw)[0])
    return JointScrews(chain.joint, np.array(frames), np.array(screws))


def _deviations(robot: Robot, given: Mapping[str, float]) -> dict[str, float]:
    # Returns the standard deviation of each parameter by name. A standard deviation that the robot
    # file gives for a group of parameters applies to each parameter of the group.
    groups = {name: value for name, value in given.items() if name in GROUPS}
    grouped = {}
    if groups:
        table = (*parameters_of(robot).table, *gear_parameters(robot.description.joints))
        grouped = {entry.name: groups[entry.group] for entry in table if entry.group in groups}
    named = {name: value for name, value in given.items() if name not in groups}
    return {name: value for name, value in {**grouped, **named}.items() if value > 0.0}


def table_errors_of(robot: Robot, uncertainty: Uncertainty | None) -> TableErrors:
    """
    Return the uncertain parameters of the robot file as `TableErrors`; its arrays are empty if the
    file gives no uncertain parameter.
    """
    rows = uncertainty.factor if uncertainty else ()
    deviations = _deviations(robot, dict(uncertainty.parameters) if uncertainty else {})
    names = [*deviations, *(name for name, _ in rows)]
    if not names:
        none = np.zeros(0, dtype=np.int64)
        return TableErrors(none, np.zeros((0, 6)), none, np.zeros((0, 0)))
    causes = max([len(names), *(len(row) for _, row in rows)])
    factor = np.zeros((len(names), causes))
    np.fill_diagonal(factor, [*deviations.values(), *(0.0 for _ in rows)])
    for k, (_, row) in enumerate(rows):
        factor[k, : len(row)] = row
    known = named_errors(robot)
    row_of = {name: k for k, name in enumerate(names)}
    at = [k for k, of in enumerate(known.of) if known.parameters[of].name in row_of]
    indices = [row_of[known.parameters[known.of[k]].name] for k in at]
    return TableErrors(known.frames[at], known.screws[at], known.gears[at], factor[indices])


def pose_errors(
    robot: Robot,
    table: TableErrors,
    joints: Floats,
    velocities: Floats,
    floor: tuple[float, float] = (0.0, 0.0),
) -> PoseErrors:
    """
    Return the kernel's `PoseErrors` for standard deviations of joints, table parameters and pose.

    Parameters
    ----------
    joints, velocities : shape (n,)
        Standard deviations of joint positions (rad or m) and of joint velocities (rad/s or m/s).
        The errors of all joints are independent.
    floor : m, rad
        Standard deviations, for each axis, of further errors of the tool's position and rotation,
        which come neither from the joints nor from the table.
    """
    of_joints = joint_screws(robot)
    count = len(of_joints.joints)
    frames = np.concatenate([of_joints.frames, table.frames])
    causes = np.zeros((len(frames), robot.dof + table.factor.shape[1]))
    causes[:count, : robot.dof] = joints * np.eye(robot.dof)[of_joints.joints]
    causes[count:, robot.dof :] = table.factor
    order = np.argsort(frames, kind='stable')
    order = order[np.any(causes[order] != 0.0, axis=1)]
    moving = np.any(causes != 0.0, axis=0)
    return PoseErrors(
        robot.chain,
        PoseErrorTable(
            frame=frames[order],
            screw=np.concatenate([of_joints.screws, table.screws])[order],
            gear=np.concatenate([np.full(count, -1), table.gears])[order],
            spread=np.ascontiguousarray(causes[np.ix_(order, moving)]),
            rates=np.array(velocities, dtype=np.float64),
            floor=np.repeat(np.square(floor), 3),
        ),
    )


@lru_cache(maxsize=CACHE_SIZE)
def errors_of_file(robot: Robot) -> PoseErrors | None:
    """
    Return the kernel's `PoseErrors` with the standard deviations of the robot file; None if the
    file has none.
    """
    uncertainty = robot.description.uncertainty
    if uncertainty is None:
        return None
    velocities = uncertainty.velocity_noise or (0.0,) * robot.dof
    return pose_errors(
        robot,
        table_errors_of(robot, uncertainty),
        np.array(uncertainty.joint_deviations),
        np.array(velocities),
        (uncertainty.floor_xyz, uncertainty.floor_rpy),
    )


def covariances(errors: PoseErrors, state: ToolState, axes: str = BASE) -> Floats:
    """
    Return the covariances of the tool's pose and twist, shape (..., 2, 6, 6).

    The state must have the frames of all rows of the table.

    The covariance of the twist is in `axes`, `base` or `tool`.
    """
    qdot = np.zeros_like(state.q) if state.qdot is None else state.qdot
    count = math.prod(state.row.shape[:-1])
    rows, positions, rates = (
        np.ascontiguousarray(table).reshape(count, table.shape[-1])
        for table in (state.row, state.q, qdot)
    )
    matrices = np.empty((count, 2, 6, 6))
    kernel.covariances(errors, rows, positions, rates, axes == TOOL, matrices)
    return matrices.reshape(*state.row.shape[:-1], 2, 6, 6)
