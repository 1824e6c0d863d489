# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the texts of the demo: introduction, lines during the motion, and summary.

Lines during the motion are printed if the output is not a terminal.
"""

import math
import os
from collections.abc import Sequence

from ...kinematics.singularity import singularity
from ...node.messages.readings import WarningReading, scale_of, warned_of
from ...printing import plain
from ...robot.measures import MEASURES
from ...robot.robot import Robot
from ...typography import listed
from .demo_listener import DemoListener
from .live_table import number
from .motions.trajectory import Trajectory
from .readings import pose_of
from .standard_output import StandardOutput

COMMAND = 'python -m kinematics_service'
# Largest number of changes of the warning level (OK, WARN, ERROR, STALE) that the summary lists.
MAX_LEVELS = 12
# Environment variables that must have the same values in the terminal of the demo and in a
# terminal from which the user reads the node's topics. Otherwise ROS does not find the node.
MUST_MATCH = ('ROS_DOMAIN_ID', 'RMW_IMPLEMENTATION')


def motion_in_words(robot: Robot, trajectory: Trajectory) -> str:
    """
    Return a sentence with the singular pose on a trajectory, and how often the arm passes it.
    """
    distance = float(singularity(robot, trajectory.centre).distance)
    if distance > robot.singularity.thresholds.warn:
        return (
            f'{robot.name} moves; no singular pose with enough room around it was found inside '
            'its limits'
        )
    joints = ' '.join(number(position, 3) for position in trajectory.centre)
    return (
        f'{robot.name} moves through the singular pose q = {joints} '
        f'once in {trajectory.period / 2.0:.0f} s'
    )


def invitation(motion: str, source: str, discovery: str, set_aside: Sequence[str]) -> list[str]:
    """
    Return the first lines that the demo prints: the arm's motion, and commands that show the
    node's messages in a second terminal.

    Parameters
    ----------
    motion
        The motion of the arm as text.
    source
        Full name of the node.
    discovery
        The environment variable of the discovery range with its value, as `NAME=VALUE`.
    set_aside
        Names of environment variables that were removed to keep discovery on this host.
    """
    namespace = source.rpartition('/')[0]
    same = [f'{name}={os.environ[name]}' for name in MUST_MATCH if os.environ.get(name)]
    environment = ''.join(f'{setting} ' for setting in same) + discovery
    lines = [
        f'{motion}; everything stays in {namespace} on this host',
        'in another terminal:',
        f'  {environment} {COMMAND} echo jacobian --node {source}',
        f'  {environment} ros2 topic echo {source}/jacobian',
    ]
    if set_aside:
        lines.append(f'{" and ".join(set_aside)} ignored here: unset it there, too')
    return [*lines, 'Ctrl-C ends it']


class PlainReport:
    """
    Prints lines if the output is not a terminal: tool position and distance once a second, and a
    line at each change of the warning level (OK, WARN, ERROR, STALE).
    """

    def __init__(self, listener: DemoListener, output: StandardOutput) -> None:
        self._listener, self._output = listener, output
        self._level = ''

    def warn(self, warned: WarningReading) -> None:
        """
        Print a warning if its level (OK, WARN, ERROR, STALE) differs from the last warning's
        level.
        """
        if warned.level != self._level:
            self._level = warned.level
            self._output.line(
                f'{self._listener.time:6.1f} s  {warned.level}: {plain(warned.sentence)}'
            )

    def tick(self) -> None:
        """
        Print the position of the tool, and the distance of the arm to the nearest singular pose.
        """
        listener = self._listener
        if listener.pose.message is None:
            self._output.line(f'{listener.time:6.1f} s  no pose yet')
            return
        pose, distance = pose_of(listener.pose.message), listener.measure('distance')
        xyz = ' '.join(number(float(x)) for x in pose.position)
        distance_text = '' if distance is None else _distance(distance)
        kept = ''
        if listener.scale.message is not None and listener.reason.message is not None:
            cause = plain(warned_of(listener.reason.message).cause)
            kept = f'scale {scale_of(listener.scale.message).scale:.2f} {cause}'.rstrip()
        parts = f'{listener.time:6.1f} s', f'tool {xyz} m', distance_text, self._level, kept
        self._output.line('  '.join(part for part in parts if part))


def _distance(distance: float) -> str:
    shown = f'distance {distance:.4f} rad ({math.degrees(distance):.1f} deg)'
    return MEASURES['distance'].farther(distance) or shown


def summary(listener: DemoListener, sent: int) -> list[str]:
    """
    Return lines for the end of the demo: how many joint states the arm sent, how many messages the
    node published, the smallest distance to a singular pose, and the sequence of warning levels.
    """
    lines = [
        f'{listener.time:.1f} s: {sent} joint states sent; heard {listener.pose.count} poses, '
        f'{listener.jacobian.count} Jacobians, {listener.twist.count} twists, '
        f'{listener.warning.count} warnings'
    ]
    nearest = listener.nearest
    if math.isfinite(nearest.distance):
        where = ''
        if nearest.pose is not None:
            xyz = ' '.join(number(float(x)) for x in nearest.pose.position)
            where = f', tool at {xyz} m in {plain(nearest.pose.frame)}'
        away = _distance(nearest.distance)
        lines.append(f'nearest to a singular pose at {nearest.time:.1f} s: {away}{where}')
    if listener.levels:
        lines.append(f'levels: {listed(listener.levels, MAX_LEVELS, " > ")}')
    return lines
