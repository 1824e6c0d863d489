# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Log the first lines of a node, which describe its arm and its settings."""

from rclpy.node import Node

from .. import kernel
from ..estimation.status_text import structure_in_words
from ..rigid_motion import exact_rpy
from ..robot.measures import why_unsearched
from ..robot.robot import Robot
from ..typography import counted, listed
from .parameters.node_parameters import NodeParameters

# Largest number of unknown parameters listed in a log line.
MAX_NAMES = 5


def tool_in_words(robot: Robot) -> str:
    """Return the tool of an arm as a sentence."""
    motion = robot.description.tool.motion.matrix
    xyz, rpy = (
        ', '.join(f'{number:.6g}' for number in numbers)
        for numbers in (motion[:3, 3], exact_rpy(motion[:3, :3]))
    )
    return f'the tool is now at xyz [{xyz}] m, rpy [{rpy}] rad in the frame after the last row'


def introduce(node: Node, parameters: NodeParameters, topic: str) -> None:
    """
    Log the arm, the topic of the joint states, values that are probably mistakes, and unknown
    parameters.
    """
    settings, logger = parameters.settings, node.get_logger()
    if notice := kernel.notice():
        logger.warning(notice)
    robot = settings.robot
    if parameters.by_default:
        logger.info(
            f'no robot is given, so this is {robot.name}; choose yours with --robot FILE|NAME '
            "(names: command 'robots')"
        )
    logger.info(
        f'robot {robot.name}: {counted(robot.dof, "joint")}, {robot.convention}, '
        f'{settings.base_frame} to {settings.tool_frame}; listening to {topic}'
    )
    for doubt in (*robot.description.warnings, *settings.doubts):
        logger.warning(str(doubt))
    if unknown := parameters.unknown():
        logger.warning(f'unknown parameters have no effect: {listed(unknown, MAX_NAMES)}')
    if unsearched := why_unsearched(robot.dof):
        logger.warning(f'{unsearched}: the warning watches {robot.singularity.thresholds.measure}')
    if robot.singularity.task.structurally_deficient:
        logger.warning(
            f'{structure_in_words(robot)}; measures are taken over '
            f'{robot.singularity.task.generic_rank} singular values'
        )
