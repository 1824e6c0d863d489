# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Name the unit of each measure of singularity; the unit of the determinant depends on the arm."""

from .measures import MEASURES
from .robot import Robot


def measure_units(robot: Robot) -> dict[str, str]:
    """
    Return the unit of each measure of singularity as text, such as `m^3`; empty for the unit 1.

    The determinant and the manipulability have the unit `mixed` if J_t is not square and its
    minors have different units.
    """
    power = _volume_power(robot)
    volume = {None: 'mixed', 0: '', 1: 'm'}.get(power, f'm^{power}')
    return {
        measure.name: volume if measure.of_volume else measure.drawn_unit or measure.unit
        for measure in MEASURES.values()
    }


def _volume_power(robot: Robot) -> int | None:
    # Return k if the product of the singular values of the unscaled J_t has the unit m^k. Each
    # linear row of J_t adds 1 to k. Each column of a sliding joint subtracts 1. Return None if J_t
    # is not square and its minors have different units.
    rows, n = robot.singularity.task.rows, robot.dof
    linear = sum(row in ('x', 'y', 'z') for row in rows)
    slides = int(robot.prismatic.sum())
    if len(rows) > n:
        return (n if linear else 0) - slides if linear in (0, len(rows)) else None
    return linear - slides if len(rows) == n or slides == 0 else None
