# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write the sections `uncertainty` and `tolerance` of a robot file as text."""

import math
from collections.abc import Iterator, Sequence

from ...robot.file.parts.description import Tolerances, Uncertainty
from ...robot.robot import Robot


def uncertainty_in_words(robot: Robot) -> Iterator[str]:
    """
    Yield lines of text that list the standard deviations in the section `uncertainty` of a robot
    file. Yield none if the section is absent.
    """
    given = robot.description.uncertainty
    if given is None:
        return
    if any(given.joint_deviations):
        yield f'joint positions: {_by_joint(robot, given.joint_deviations)}'
    if given.velocity_noise is not None:
        yield f'joint velocities: {_by_joint(robot, given.velocity_noise, "/s")}'
    if table := list(_of_table(given)):
        yield f'numbers of the table (m, rad): {", ".join(table)}'
    if given.floor_xyz or given.floor_rpy:
        yield f'floor of poses: {given.floor_xyz:.3g} m, {given.floor_rpy:.3g} rad'


def tolerances_in_words(given: Tolerances) -> str:
    """Return the entries of the section `tolerance` as text; empty if the section is absent."""
    groups = (('lengths', given.length), ('angles', given.angle), ('gear ratios', given.gear))
    values = [*((name, value) for name, value in groups if value is not None), *given.named]
    words = ', '.join(f'{name} {value:.3g}' for name, value in values)
    return f'{words} (m, rad)' if words else ''


def _by_joint(robot: Robot, values: Sequence[float], per: str = '') -> str:
    units = [unit + per for unit in robot.units]
    if len({*zip(values, units)}) == 1:
        return f'{values[0]:.3g} {units[0]}'
    return ', '.join(f'{value:.3g} {unit}' for value, unit in zip(values, units))


def _of_table(given: Uncertainty) -> Iterator[str]:
    for name, value in given.parameters:
        yield f'{name} {value:.3g}'
    # The covariance of the table's numbers is L L^T. `factor` pairs the name of each number with a
    # row of L, and the norm of this row is the standard deviation of the number.
    for name, row in given.factor:
        yield f'{name} {math.hypot(*row):.3g}'
