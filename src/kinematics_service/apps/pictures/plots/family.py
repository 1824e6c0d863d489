"""The picture of a redundant arm's postures: each joint along the arcs of the nearest curve."""

import numpy as np

from ....errors import PlotError
from ....kinematics.inverse.result import IkResult
from ....robot.robot import Robot
from .artists import Figure
from .picture import GREY, SERIES, Draw, with_unit, words

# Inches: of a panel, of the words above and below all of them.
WIDTH, HEIGHT, HEAD = 8.5, 1.1, 1.3


def family_picture(robot: Robot, result: IkResult) -> Draw:
    """
    Return the picture of the first family of a result that has intervals.

    Its arcs stand side by side: each joint's position over the length of the arc, and its limits.

    Raises
    ------
    PlotError
        None has.
    """
    arcs = next((family.intervals for family in result.families if family.intervals), ())
    if not arcs:
        raise PlotError(
            f'{robot.name} has no arc of postures inside its limits at this target: '
            f'{result.reason}'
        )

    def draw(figure: Figure) -> None:
        figure.set_size_inches(WIDTH, robot.dof * HEIGHT + HEAD)
        figure.set_layout_engine('constrained', h_pad=0.02)
        rows = figure.subplots(robot.dof, 1, sharex=True, squeeze=False)[:, 0]
        for j, axes in enumerate(rows):
            begin = 0.0
            for k, arc in enumerate(arcs):
                axes.plot(begin + arc.s, arc.q[:, j], color=SERIES[k % len(SERIES)])
                begin += 1.04 * arc.length
            for limit in robot.limits[j][np.isfinite(robot.limits[j])].tolist():
                axes.axhline(limit, color=GREY, linewidth=0.8, linestyle='--')
            unit = 'm' if robot.prismatic[j] else 'rad'
            axes.set_ylabel(words(with_unit(robot.joint_names[j], unit)), fontsize=7)
        rows[-1].set_xlabel(with_unit('length of the arcs, one after the other', 'rad'))
        count = f'{len(arcs)} {"arc" if len(arcs) == 1 else "arcs"}'
        figure.suptitle(words(f'{robot.name}: {count} of the nearest curve'))

    return draw
