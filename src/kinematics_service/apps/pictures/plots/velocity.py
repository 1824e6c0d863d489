# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw the velocity of the tool along a path: components and norm over time."""

from collections.abc import Sequence

import numpy as np

from ....kinematics.forward import twist
from ....kinematics.singularity import singularity
from ....robot.robot import Robot
from .artists import Figure
from .captions import short
from .motion import PlottedMotion
from .over_time import draw_curves, draw_legend, panels, shade
from .picture import AXIS_COLORS, BLACK, Draw, with_unit, words


def velocity_picture(robot: Robot, motion: PlottedMotion, marked: Sequence[float] = ()) -> Draw:
    """
    Return the picture of the tool's velocity J qdot in base axes, and of the joint velocities.

    Parameters
    ----------
    robot
        The arm.
    motion
        The motion of the arm.
    marked
        Times at which the picture has vertical lines, s.
    """
    tool = twist(robot, motion.q, motion.qdot)
    levels = singularity(robot, motion.q).level
    slides = robot.prismatic
    joints = [
        (chosen, unit) for chosen, unit in ((~slides, 'rad/s'), (slides, 'm/s')) if np.any(chosen)
    ]

    def draw(figure: Figure) -> None:
        note = ' (velocities: differences of the positions)' if motion.differentiated else ''
        heights = [2.2, 2.2] + [1.7] * len(joints)
        title = (
            f'{words(robot.name)}: velocity of {words(robot.tool_frame)} in the axes of '
            f'{words(robot.base_frame)}\nalong {words(motion.described)}{note}'
        )
        linear, angular, *rates = rows = panels(figure, heights, title)
        for axes, part, kind, letter, unit in (
            (linear, tool[:, :3], 'linear', 'v', 'm/s'),
            (angular, tool[:, 3:], 'angular', 'ω', 'rad/s'),
        ):
            names = [f'{letter}{axis}' for axis in 'xyz'] + [f'|{letter}|']
            with_norm = np.column_stack([part, np.linalg.norm(part, axis=1)])
            draw_curves(axes, motion, with_norm, names, (*AXIS_COLORS, BLACK))
            axes.set_ylabel(with_unit(f'{kind} velocity', unit))
            axes.lines[-1].set(linestyle='-', linewidth=1.0, zorder=2)
        for axes, (chosen, unit) in zip(rates, joints):
            names = [f"{short(name)}'" for name, take in zip(robot.variables, chosen) if take]
            draw_curves(axes, motion, motion.qdot[:, chosen], names)
            axes.set_ylabel(with_unit('joint velocity', unit))
        for axes in rows:
            for time in marked:
                axes.axvline(time, color='0.5', linewidth=0.8, linestyle='--')
            draw_legend(axes)
            axes.margins(x=0.0)
        shade(figure, rows, motion, levels, 'near a singular pose')

    return draw
