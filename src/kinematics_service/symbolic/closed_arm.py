"""
The exact derivation of an arm with closed loops: what closes them, how the passive joints follow.

Everything is in the joints and in the passive joints: these follow from those by the closure
equations, for which there is no closed form in general.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy

from ..errors import DerivationError
from ..robot.file.parts.description import IDENTITY, LoopDescription, Placement, RobotDescription
from ..robot.file.parts.loop_groups import loop_groups
from ..robot.loops import opened
from ..robot.robot import AnyRobot, Robot, as_robot
from ..robot.task import ROW_NAMES
from . import jacobian as ways
from .algebra.arithmetic import Arithmetic, arithmetic_of
from .algebra.names import names_of
from .closed_loop import loop_coupling, simplified
from .frames import frames_of
from .trigonometry import Writer, writer_of

# Joints and passive joints of a determinant that is multiplied out, at most.
MOST_VARIABLES = 6

LINEAR, ANGULAR = frozenset(ROW_NAMES[:3]), frozenset(ROW_NAMES[3:])


@dataclass(frozen=True)
class LoopEquations:
    """
    A closed loop in symbols.

    Attributes
    ----------
    name
        Of the loop.
    passive
        Symbols psi of its passive joints.
    equations
        Phi, each 0 where the loop is closed: the end of its own chain seen from where it meets the
        table, in the axes of the frame where it begins.
    coupling
        d psi / d q by the joints of the arm, one row a passive joint.
    determinant
        Of d Phi / d psi: where it is 0 the loop is flat.
    """

    name: str
    passive: tuple[Any, ...]
    equations: tuple[Any, ...]
    coupling: Any
    determinant: Any


@dataclass(frozen=True, eq=False)
class ClosedDerivation:
    """
    An arm with closed loops in symbols.

    Attributes
    ----------
    robot
        The arm.
    variables
        Symbols of its joints.
    loops
        Its loops, in the order of the file.
    T, jacobian_open
        Pose of the tool, and its Jacobian by the joints and the passive joints as if each moved by
        itself.
    coupling
        d (q, psi) / d q: J = jacobian_open * coupling.
    determinant
        det(J_t) of the task rows, a product over those of the loops; None where it is not square,
        or of more than MOST_VARIABLES joints and passive joints.
    """

    robot: Robot
    variables: tuple[Any, ...]
    loops: tuple[LoopEquations, ...]
    T: Any
    jacobian_open: Any
    coupling: Any
    determinant: Any

    @property
    def jacobian(self) -> Any:
        """Return J by the joints of the arm."""
        return self.jacobian_open * self.coupling


def derive_closed(
    robot: AnyRobot, progress: Callable[[str], None] | None = None
) -> ClosedDerivation:
    """
    Return the exact derivation of an arm with closed loops.

    Raises
    ------
    DerivationError
        The arm has no loops, an angle is no fraction of a joint's, or the pose is too long.

    Examples
    --------
    >>> import kinematics_service as ks
    >>> found = ks.derive_closed(ks.load_robot('crank_slider'))
    >>> found.loops[0].determinant
    rod*cos(psi + q)
    """
    robot = as_robot(robot)
    if not robot.description.loops:
        raise DerivationError(f'{robot.name} has no closed loops')
    _refuse_groups(robot)
    tell = progress or (lambda _: None)
    tell('frames')
    description = opened(robot.description)
    # Its angles are those of all rows.
    rows = tuple(link for loop in robot.description.loops for link in loop.links)
    whole = replace(description, links=description.links + rows)
    arithmetic = arithmetic_of(whole, names_of(whole))
    frames = frames_of(description, arithmetic)
    writer = writer_of(frames, arithmetic)
    tell('Jacobian')
    J = ways.geometric(frames, arithmetic)
    n = robot.dof
    symbols = arithmetic.names.variables
    loops: list[LoopEquations] = []
    coupling = sympy.eye(n)
    first = n
    for loop in robot.description.loops:
        tell(f'loop {loop.name}')
        psi = symbols[first : first + len(loop.passive)]
        equations = _equations(description, loop, arithmetic)
        found = loop_coupling(equations, symbols[:first], psi)
        own = (found.passive * coupling).applyfunc(simplified)
        coupling = coupling.col_join(own)
        loops.append(LoopEquations(loop.name, psi, equations, own, found.determinant))
        first += len(psi)
    tell('determinant')
    open_rows = _task_rows(
        robot, ways.in_axes_of(J, frames.in_base[_simplest_frame(robot)]), writer
    )
    determinant = None
    if open_rows.rows == n and len(symbols) <= MOST_VARIABLES:
        determinant = _determinant(open_rows, symbols, loops)
    return ClosedDerivation(
        robot=robot,
        variables=symbols[:n],
        loops=tuple(loops),
        T=writer.matrix(frames.T_base_tool),
        jacobian_open=writer.matrix(J),
        coupling=sympy.ImmutableMatrix(coupling),
        determinant=determinant,
    )


def _refuse_groups(robot: Robot) -> None:
    # The inverse of so many equations is no formula that anybody reads.
    for group in loop_groups(robot.description.loops):
        if len(group) > 1:
            names = ', '.join(repr(loop.name) for loop in group)
            raise DerivationError(
                f'the derivation takes one loop after another: those of {robot.name} that need '
                f"each other's passive joints are closed together ({names})"
            )


def _simplest_frame(robot: Robot) -> int:
    # Three rows together have the same determinant in any axes: those where the loops begin do not
    # turn with the joints before them.
    rows = set(robot.task.rows)
    whole = all(part <= rows or not part & rows for part in (LINEAR, ANGULAR))
    return robot.description.loops[0].start.row if whole else 0


def _task_rows(robot: Robot, J: Any, writer: Writer) -> Any:
    written = writer.matrix(J)
    rows = [ROW_NAMES.index(row) for row in robot.task.rows]
    return written.extract(rows, list(range(written.cols)))


def _determinant(open_rows: Any, symbols: Sequence[Any], loops: Sequence[LoopEquations]) -> Any:
    # det(A - B D^-1 C) det D = det [[A, B], [C, D]], of which no entry is a quotient.
    slopes = sympy.Matrix([e for loop in loops for e in loop.equations]).jacobian(list(symbols))
    numerator = open_rows.col_join(slopes).det(method='berkowitz')
    numerator = sympy.factor(sympy.trigsimp(sympy.expand(numerator)))
    return numerator / sympy.Mul(*(loop.determinant for loop in loops))


def _equations(
    description: RobotDescription, loop: LoopDescription, arithmetic: Arithmetic
) -> tuple[Any, ...]:
    # The residual of a loop as the kernel has it; of a rotation its axis times the sine, which is
    # zero with it.
    start = _chain(description, (), loop.start.motion, arithmetic)
    there = start.inv() * _chain(description, loop.there, loop.meets.motion, arithmetic)
    back = _chain(description, loop.links, IDENTITY, arithmetic)
    turn = back[:3, :3] * there[:3, :3].T
    gap = [
        *(back[i, 3] - there[i, 3] for i in range(3)),
        (turn[2, 1] - turn[1, 2]) / 2,
        (turn[0, 2] - turn[2, 0]) / 2,
        (turn[1, 0] - turn[0, 1]) / 2,
    ]
    return tuple(simplified(sympy.expand(gap[ROW_NAMES.index(row)])) for row in loop.rows)


def _chain(description: RobotDescription, links: Any, end: Any, arithmetic: Arithmetic) -> Any:
    alone = replace(
        description,
        links=tuple(links),
        base=Placement('from', IDENTITY),
        tool=Placement('to', end),
    )
    frames = frames_of(alone, arithmetic)
    return writer_of(frames, arithmetic).matrix(frames.T_base_tool)
