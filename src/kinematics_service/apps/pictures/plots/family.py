# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Draw the inverse kinematics solutions of a redundant arm: joint positions along a solution curve.

The picture shows the first curve that has arcs inside the joint limits, and only these arcs.
"""

import numpy as np

from ....errors import PlotError
from ....kinematics.inverse.result import IkResult
from ....robot.robot import Robot
from .artists import Figure
from .over_time import panels
from .picture import GREY, SERIES, Draw, with_unit, words

# Height of a panel, inches.
PANEL_HEIGHT = 1.1


def family_picture(robot: Robot, result: IkResult) -> Draw:
    """
    Return the picture of the result's first solution curve that has an arc inside the limits.

    Each panel shows the position and the limits of one joint. The horizontal axis is the length
    along the curve's arcs.

    Raises
    ------
    PlotError
        No solution curve has an arc inside the limits.
    """
    arcs = next((family.intervals for family in result.families if family.intervals), ())
    if not arcs:
        raise PlotError(
            f'{robot.name} has no arc of postures inside its limits at this target: '
            f'{result.reason}',
            code='no-solution',
        )

    def draw(figure: Figure) -> None:
        count = f'{len(arcs)} {"arc" if len(arcs) == 1 else "arcs"}'
        title = words(f'{robot.name}: {count} of the nearest curve')
        across = 'length of the arcs, one after the other (rad)'
        rows = panels(figure, [PANEL_HEIGHT] * robot.dof, title, across)
        for j, axes in enumerate(rows):
            begin = 0.0
            for k, arc in enumerate(arcs):
                axes.plot(begin + arc.s, arc.q[:, j], color=SERIES[k % len(SERIES)])
                begin += 1.04 * arc.length
            for limit in robot.limits[j][np.isfinite(robot.limits[j])].tolist():
                axes.axhline(limit, color=GREY, linewidth=0.8, linestyle='--')
            unit = 'm' if robot.prismatic[j] else 'rad'
            axes.set_ylabel(words(with_unit(robot.joint_names[j], unit)), fontsize=7)

    return draw
