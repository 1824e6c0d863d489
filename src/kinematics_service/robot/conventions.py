"""The conventions of a robot file, each turned into the same rows: before, screw_z, after."""

from collections.abc import Callable
from dataclasses import dataclass

from ..kernel import Floats
from ..rigid_motion import Z_INTO, inverse, screw_x
from .file.description import DhRow, ElementaryMotion, RobotDescription, ShapeRow
from .file.expressions import Affine

ZERO = Affine(0.0, ())


@dataclass(frozen=True)
class Row:
    """
    One row of a table: T = before @ Rz(theta) Tz(d) @ after, theta and d affine in the variables.
    """

    before: Floats
    theta: Affine
    d: Affine
    after: Floats


def _standard(row: DhRow) -> Row:
    # T = Rz(theta) Tz(d) Tx(a) Rx(alpha): Denavit and Hartenberg 1955, as in Paul and Siciliano.
    after = screw_x(row.alpha.affine.constant, row.a.affine.constant)
    return Row(Z_INTO['z'], row.theta.affine, row.d.affine, after)


def _modified(row: DhRow) -> Row:
    # T = Rx(alpha) Tx(a) Rz(theta) Tz(d): Craig, "Introduction to Robotics", eq. 3.6.
    before = screw_x(row.alpha.affine.constant, row.a.affine.constant)
    return Row(before, row.theta.affine, row.d.affine, Z_INTO['z'])


def _elementary(motion: ElementaryMotion) -> Row:
    # Rx is Rz with z turned into x before, and back after; likewise the others.
    kind, axis = motion.axis
    turn = Z_INTO[axis]
    argument = motion.argument.affine
    theta, d = (argument, ZERO) if kind == 'R' else (ZERO, argument)
    return Row(turn, theta, d, turn.T)


def _shape(row: ShapeRow) -> Row:
    # T = S_in Phi inverse(S_out): Sheth and Uicker 1971.
    out = inverse(row.outer.matrix)
    if row.joint is None:
        return Row(row.inner.matrix, ZERO, ZERO, out)
    joint = _elementary(row.joint)
    return Row(row.inner.matrix @ joint.before, joint.theta, joint.d, joint.after @ out)


ROWS_OF: dict[str, Callable[..., Row]] = {
    'standard': _standard,
    'modified': _modified,
    'elementary': _elementary,
    'shape': _shape,
}


def table_rows(description: RobotDescription) -> tuple[Row, ...]:
    """Return the rows of a robot's table, base and tool not included."""
    row_of = ROWS_OF[description.convention]
    return tuple(row_of(link) for link in description.links)
