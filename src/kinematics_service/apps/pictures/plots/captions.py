# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write texts in pictures: joint positions with units, and the distance to a singular pose."""

import math
import textwrap
from collections.abc import Sequence

import numpy as np

from ....kernel import Floats
from ....kinematics.singularity import Singularity, flat_loop, none_found
from ....robot.file.parts.loop_groups import group_in_words
from ....robot.measures import Level
from ....robot.robot import Robot
from .picture import words

# Maximum number of letters of a joint name in a picture; a longer name is cut.
MAX_LETTERS = 16


def short(name: str) -> str:
    """Return a name, cut to at most MAX_LETTERS letters."""
    return words(name if len(name) <= MAX_LETTERS else name[: MAX_LETTERS - 1] + '…')


def signed(value: float, digits: int = 2) -> str:
    """Return a number with a typographic minus sign, and without a negative zero."""
    return f'{round(float(value), digits) + 0.0:.{digits}f}'.replace('-', '\N{MINUS SIGN}')


def positions(robot: Robot, q: Floats, width: int, skip: Sequence[int] = ()) -> str:
    """
    Return joint positions q (n,) as text with joint variables and units, in lines of at most
    `width` letters.

    For example `q1 0.10, q2 −1.57 rad; d3 0.20 m`, without the joints with indices in `skip`.
    """
    groups = []
    for unit in ('rad', 'm'):
        chosen = [j for j in range(robot.dof) if robot.units[j] == unit and j not in skip]
        if chosen:
            # A no-break space keeps a name and its number on one line.
            texts = (
                f'{short(robot.variables[j])}\N{NO-BREAK SPACE}{signed(q[j])}' for j in chosen
            )
            groups.append(f'{", ".join(texts)}\N{NO-BREAK SPACE}{unit}')
    return '\n'.join(textwrap.wrap('; '.join(groups), width, break_on_hyphens=False))


def nearness(robot: Robot, singularity: Singularity) -> str:
    """
    Return a text with the distance to the nearest singular pose, and the name of the singular
    factor that is nearest to zero.
    """
    distance = float(singularity.distance)
    farther = none_found(singularity)
    if singularity.rank < singularity.generic_rank:
        text = 'singular pose'
    elif farther:
        text = f'singular pose: {farther}'
    else:
        text = f'distance to singularity {distance:.3g} rad ({math.degrees(distance):.3g}°)'
    factors = singularity.factors
    if factors is not None and not farther and np.min(factors.estimates) <= 1.5 * distance:
        if not robot.singularity.factors.is_loop(factors.nearest):
            text += f': {words(factors.names[factors.nearest])}'
        elif loop := flat_loop(robot, singularity):
            text += f': {words(group_in_words(loop))} flat'
    if singularity.level not in (Level.OK, Level.STALE):
        text += f' [{singularity.level.name}]'
    return text
