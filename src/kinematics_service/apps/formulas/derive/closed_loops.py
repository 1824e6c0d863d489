# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Derive the closure equations of closed loops, the coupling of passive joints, and the determinants.

All expressions contain the positions of active and passive joints. The closure equations determine
the positions of the passive joints from the positions of the active joints. In general, the
solution has no closed form, so the passive joints stay in the expressions.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import sympy
from sympy.simplify.fu import TR8

from ....errors import DerivationError
from ....robot.file.parts.description import (
    IDENTITY,
    Link,
    LoopDescription,
    Placement,
    RigidMotion,
    RobotDescription,
)
from ....robot.file.parts.loop_groups import loop_groups
from ....robot.robot import Robot
from ....robot.task import ROW_NAMES
from .algebra.arithmetic import Arithmetic
from .algebra.matrices import Matrix
from .frames import Frames, frames_of
from .jacobian import VEE, in_axes_of, may_turn
from .trigonometry import Writer, writer_of

# If an expression has at most this number of operations, products of sines and cosines are
# replaced by sines and cosines of sums. The replacement does not shorten expressions with more
# operations.
MAX_OPERATIONS = 150
# The determinant of an arm with closed loops is derived only if the sum of its joints and passive
# joints is at most this.
MAX_VARIABLES = 6


@dataclass(frozen=True)
class LoopEquations:
    """
    The equations of a closed loop in symbols.

    Attributes
    ----------
    name
        The loop's name.
    passive
        Symbols psi of the loop's passive joints.
    equations
        Phi, a list of expressions that are 0 if the loop is closed. The last frame of the loop's
        own chain must meet a frame of the table. Phi is the pose difference between the two
        frames, in the axes of the frame in which the loop begins.
    coupling
        The derivative d psi / d q, with one row for each passive joint and one column for each
        joint of the arm.
    determinant
        The determinant of d Phi / d psi. If it is 0, the loop equations are singular and the loop
        may change its branch.
    """

    name: str
    passive: tuple[sympy.Symbol, ...]
    equations: tuple[sympy.Expr, ...]
    coupling: sympy.Matrix
    determinant: sympy.Expr


def simplified(expression: sympy.Expr) -> sympy.Expr:
    """
    Return a quotient of two expressions, with a shorter numerator if one is found.

    In the shorter numerator, sines and cosines of sums of angles replace products of sines and
    cosines.
    """
    numerator, denominator = sympy.fraction(expression)
    forms = [sympy.factor_terms(form, clear=False) for form in _forms(numerator)]
    return min(forms, key=sympy.count_ops) / denominator


def _forms(expression: sympy.Expr) -> list[sympy.Expr]:
    # Return the expression. If it is not too long, return also its form without products of sines
    # and cosines.
    long = sympy.count_ops(expression) > MAX_OPERATIONS
    return [expression] if long else [expression, _without_products(expression)]


def _without_products(expression: sympy.Expr) -> sympy.Expr:
    # Write products of sines and cosines as sines and cosines of sums, because most terms then
    # cancel if axes are parallel. The function TR8 of sympy takes a thirtieth of the time of
    # `sympy.trigsimp`.
    return sympy.expand(TR8(sympy.expand(expression)))


def loop_equations(
    name: str,
    constraint: Sequence[sympy.Expr],
    joints: Sequence[sympy.Symbol],
    passive: Sequence[sympy.Symbol],
) -> LoopEquations:
    """
    Return the equations of a loop closed by Phi(q, psi) = 0, with the coupling d psi / d q.

    Phi stays 0 along every motion: dPhi/dq + dPhi/dpsi dpsi/dq = 0. So dpsi/dq = -(dPhi/dpsi)^-1
    dPhi/dq.

    Parameters
    ----------
    name
        The loop's name.
    constraint
        Phi, as many expressions as there are passive joints.
    joints, passive
        Symbols q and psi.
    """
    phi = sympy.Matrix(constraint)
    by_passive = phi.jacobian(list(passive))
    by_joints = phi.jacobian(list(joints))
    determinant = simplified(by_passive.det())
    coupling = (-by_passive.adjugate() * by_joints / determinant).applyfunc(simplified)
    coupling = coupling.as_immutable()
    return LoopEquations(name, tuple(passive), tuple(constraint), coupling, determinant)


def loops_of(
    robot: Robot, arm: RobotDescription, arithmetic: Arithmetic, tell: Callable[[str], None]
) -> tuple[LoopEquations, ...]:
    """
    Return the equations of the closed loops of an arm, in the order of the file; empty without
    loops.

    Parameters
    ----------
    robot
        The arm.
    arm
        The arm with its loops open.
    arithmetic
        The polynomial ring of the arm. It contains the angles of the arm and of the rows of its
        loops.
    tell
        A callback that receives a short text about the next step of the derivation.

    Raises
    ------
    DerivationError
        Several loops need each other's passive joints.
    """
    loops = robot.description.loops
    for group in loop_groups(loops):
        # Refuse loops that must be solved together, because the inverse of their equations is too
        # long to read.
        if len(group) > 1:
            names = ', '.join(repr(loop.name) for loop in group)
            raise DerivationError(
                f'the derivation takes one loop after another: those of {robot.name} that need '
                f"each other's passive joints are closed together ({names})",
                code='unsupported',
            )
    symbols = arithmetic.names.variables
    closures: list[LoopEquations] = []
    coupling = sympy.eye(robot.dof)
    for loop in loops:
        tell(f'loop {loop.name}')
        first = coupling.rows
        psi = symbols[first : first + len(loop.passive)]
        equations = _equations(arm, loop, arithmetic)
        closure = loop_equations(loop.name, equations, symbols[:first], psi)
        if closures:
            by_joints = (closure.coupling * coupling).applyfunc(simplified)
            closure = replace(closure, coupling=by_joints)
        coupling = coupling.col_join(closure.coupling)
        closures.append(closure)
    return tuple(closures)


def closed_determinant(
    robot: Robot, J: Matrix, frames: Frames, loops: Sequence[LoopEquations], writer: Writer
) -> sympy.Expr | None:
    """
    Return det(J_t) of the task rows J_t of an arm with closed loops, as a quotient.

    The denominator is the product of the loops' determinants. Return None if J_t is not square, or
    if the arm has more than MAX_VARIABLES joints and passive joints.

    Parameters
    ----------
    robot
        The arm.
    J
        The Jacobian by joints and passive joints, base axes.
    frames
        The frames of the arm with its loops open.
    """
    symbols = writer.arithmetic.names.variables
    if not robot.singularity.task.square or len(symbols) > MAX_VARIABLES:
        return None
    # Express J in the axes of the frame in which the first loop begins. In these axes, the joints
    # before the frame occur neither in the columns of later joints nor in the loop equations, so
    # the determinant is shorter. If `may_turn` is false, the determinant depends on the axes, so
    # keep the axes of frame 0.
    task = robot.singularity.task.axes.tolist()
    frame = robot.description.loops[0].start.row if may_turn(task) else 0
    turned = in_axes_of(J, frames.in_base[frame])
    rows = writer.matrix(turned[task])
    # Let [A, B] be the task rows of the Jacobian with open loops, and [C, D] the derivatives of
    # the loop equations. The columns in A and C belong to the joints, those in B and D to the
    # passive joints. Then det(J_t) = det [[A, B], [C, D]] / det D, and det D is the product of the
    # determinants of the loops. The matrix [[A, B], [C, D]] has no quotients as entries.
    slopes = sympy.Matrix([e for loop in loops for e in loop.equations]).jacobian(list(symbols))
    numerator = rows.col_join(slopes).det(method='berkowitz')
    numerator = sympy.factor(_without_products(numerator))
    return numerator / sympy.Mul(*(loop.determinant for loop in loops))


def _equations(
    description: RobotDescription, loop: LoopDescription, arithmetic: Arithmetic
) -> tuple[sympy.Expr, ...]:
    # Return the residual of the loop equations, defined as in the numeric kernel. The residual of
    # a rotation is the axis times the sine of the angle.
    start = _chain(description, (), loop.start.motion, arithmetic)
    T_start_meets = start.inv() * _chain(description, loop.there, loop.meets.motion, arithmetic)
    T_start_end = _chain(description, loop.links, IDENTITY, arithmetic)
    turn = T_start_end[:3, :3] * T_start_meets[:3, :3].T
    gap = [T_start_end[i, 3] - T_start_meets[i, 3] for i in range(3)]
    gap += [(turn[i, j] - turn[j, i]) / 2 for i, j in zip(*VEE)]
    entries = (sympy.expand(gap[ROW_NAMES.index(row)]) for row in loop.rows)
    return tuple(min(_forms(entry), key=sympy.count_ops) for entry in entries)


def _chain(
    description: RobotDescription, links: Sequence[Link], end: RigidMotion, arithmetic: Arithmetic
) -> sympy.Matrix:
    alone = replace(
        description,
        links=tuple(links),
        base=Placement('from', IDENTITY),
        tool=Placement('to', end),
    )
    frames = frames_of(alone, arithmetic)
    return writer_of(frames).matrix(frames.T_base_tool)
