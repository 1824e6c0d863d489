"""The units of the measures: those of determinant and manipulability depend on the arm."""

from .measures import MEASURES
from .robot import Robot


def measure_units(robot: Robot) -> dict[str, str]:
    """
    Return the unit of each measure in plain letters: `m^3`, and nothing where it is 1.

    `mixed` where the minors of a J_t that is not square differ.
    """
    power = _volume_power(robot)
    volume = {None: 'mixed', 0: '', 1: 'm'}.get(power, f'm^{power}')
    return {
        measure.name: volume if measure.of_volume else measure.drawn_unit or measure.unit
        for measure in MEASURES.values()
    }


def _volume_power(robot: Robot) -> int | None:
    # k where the product of the singular values of the unscaled J_t counts in m^k: they count in m
    # for rows of translation, and columns of sliding joints take that back. None where the minors
    # of a J_t that is not square differ.
    rows, n = robot.singularity.task.rows, robot.dof
    linear = sum(row in ('x', 'y', 'z') for row in rows)
    slides = int(robot.prismatic.sum())
    if len(rows) > n:
        return (n if linear else 0) - slides if linear in (0, len(rows)) else None
    return linear - slides if len(rows) == n or slides == 0 else None
