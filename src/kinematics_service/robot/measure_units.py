"""The units of determinant and manipulability, which depend on the arm and its task."""

from .robot import Robot


def volume_power(robot: Robot) -> int | None:
    """
    Return k where the product of the singular values of the unscaled J_t counts in m^k.

    They count in m for rows of translation, and columns of sliding joints take that back. None
    where the minors of a J_t that is not square differ.
    """
    rows, n = robot.task.rows, robot.dof
    linear = sum(row in ('x', 'y', 'z') for row in rows)
    slides = sum(kind == 'prismatic' for kind in robot.joint_types)
    if len(rows) > n:
        return (n if linear else 0) - slides if linear in (0, len(rows)) else None
    return linear - slides if len(rows) == n or slides == 0 else None


def volume_unit(robot: Robot) -> str:
    """Return the unit in plain letters: `m^3`, and nothing where it is 1."""
    power = volume_power(robot)
    return {None: 'mixed', 0: '', 1: 'm'}.get(power, f'm^{power}')
