"""
The closed loops of an arm: their two chains folded into the constants of the kernel, and checked.

The joints keep their places, and the passive joints of all loops stand behind them.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NoReturn

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..errors import Fault, KinematicsError, RobotFileError
from ..kernel import Chain, Closure, Floats, Loop
from ..rigid_motion import inverse
from .chain import fold
from .conventions import row_of, table_rows
from .file.description import (
    JointDescription,
    Link,
    LoopDescription,
    RobotDescription,
    SingularityDescription,
)

ROWS = ('x', 'y', 'z', 'rx', 'ry', 'rz')
# Components that are not among the rows of a rotation vanish to this, rad.
PARALLEL = 1e-9
# Whether a passive joint moves a row is looked at with such steps, rad or m.
BESIDE = 0.1
# Poses that close are looked for near the assembly where too few others do.
GRID, BRANCH_STARTS, SAME_BRANCH = 24, 1000, 1e-6
FEW, AROUND, SEED = 100, (1.0, 0.3, 0.1, 0.03, 0.01), 20240523


def refuse_loops(description: RobotDescription, what: str) -> None:
    """
    Raise an error for an arm with closed loops.

    Parameters
    ----------
    description
        The arm.
    what
        What does not know of loops, as the beginning of a sentence.

    Raises
    ------
    KinematicsError
        The arm has closed loops.
    """
    if description.loops:
        names = ', '.join(repr(loop.name) for loop in description.loops)
        raise KinematicsError(
            f'{what} does not know of closed loops: {description.name} has {names}'
        )


def passive_names(description: RobotDescription) -> frozenset[str]:
    """Return the names of the passive joints."""
    return frozenset(joint.name for loop in description.loops for joint in loop.passive)


def opened(description: RobotDescription) -> RobotDescription:
    """Return the arm with its loops open: passive joints are joints, nothing else is known."""
    passive = tuple(
        JointDescription(joint.name, joint.name, joint.type, -np.inf, np.inf, np.inf)
        for loop in description.loops
        for joint in loop.passive
    )
    return replace(
        description,
        joints=description.joints + passive,
        singularity=SingularityDescription(None, None, 'distance', None, None, ()),
        known_poses=(),
        loops=(),
    )


def variables_of(description: RobotDescription) -> tuple[str, ...]:
    """Return the joint variables, and behind them the passive joints of all loops."""
    passive = (joint.name for loop in description.loops for joint in loop.passive)
    return (*(joint.variable for joint in description.joints), *passive)


def moving_variables(description: RobotDescription, links: Sequence[Link]) -> frozenset[str]:
    """Return what moves rows of the table: joints and passive joints, these with their loops."""
    moving = _variables(links, description.convention)
    for loop in reversed(description.loops):
        if moving & {joint.name for joint in loop.passive}:
            moving |= _variables((*loop.there, *loop.links), description.convention)
    return frozenset(moving)


def _variables(links: Sequence[Link], convention: str) -> set[str]:
    rows = [row_of(link, convention) for link in links]
    return {
        variable
        for row in rows
        for affine in (row.theta, row.d)
        for variable, _ in affine.coefficients
    }


def chain_of(description: RobotDescription, closure: Closure | None) -> Chain:
    """Return the chain of the tool."""
    return fold(
        table_rows(description),
        variables_of(description),
        description.base.motion.matrix,
        description.tool.motion.matrix,
        closure,
    )


def closure_of(description: RobotDescription) -> Closure | None:
    """
    Return the closed loops of an arm as the kernel reads them; None where it has none.

    Raises
    ------
    RobotFileError
        A loop does not close at its known position, or is flat there.
    """
    if not description.loops:
        return None
    variables = variables_of(description)
    n = len(description.joints)
    chains = [_chains(description, loop, variables) for loop in description.loops]
    size = max(_size(chain) for pair in chains for chain in pair) or 1.0
    units = _units(description, chains, size)
    first, following = n + sum(len(loop.passive) for loop in description.loops), None
    for loop, (there, back) in reversed(list(zip(description.loops, chains))):
        first -= len(loop.passive)
        axes = np.array([ROWS.index(row) for row in loop.rows], dtype=np.int64)
        following = Loop(there, back, axes, first, size, units, following)
    assert following is not None
    count = len(description.loops)
    start = np.zeros(kernel.section_width(n, count, following))
    values = [value for loop in description.loops for value in loop.assembled]
    start[: len(variables)] = [*description.loops[0].q, *values]
    given = start[: len(variables)].copy()
    failed = kernel.assemble(following, count, n, start)
    if failed:
        _refuse(description, count - failed, chains, given, start)
    closure = Closure(n, count, following, _turns(description, chains), start)
    for loop, pair in zip(description.loops, chains):
        _check_rest(description, loop, pair, start[: len(variables)])
    return closure


def _chains(
    description: RobotDescription, loop: LoopDescription, variables: Sequence[str]
) -> tuple[Chain, Chain]:
    # Both in the frame where they part.
    convention, here = description.convention, np.eye(4)
    there = [row_of(link, convention) for link in loop.there]
    back = [row_of(link, convention) for link in loop.links]
    return (
        fold(there, variables, inverse(loop.start.motion.matrix), loop.meets.motion.matrix),
        fold(back, variables, here, here),
    )


def _size(chain: Chain) -> float:
    # The lengths of a chain, together.
    lengths = np.linalg.norm(chain.table.before[:, :, 3], axis=1)
    return float(np.sum(lengths) + np.sum(np.abs(chain.table.d_0)))


def _units(
    description: RobotDescription, chains: Sequence[tuple[Chain, Chain]], size: float
) -> Floats:
    # What counts as a rad of each variable; endless for a joint that moves no loop.
    kinds = [joint.type for joint in description.joints]
    kinds += [joint.type for loop in description.loops for joint in loop.passive]
    inside = {int(j) for pair in chains for chain in pair for j in chain.table.joint}
    return np.array(
        [
            (size if kind == 'prismatic' else 1.0) if j in inside else np.inf
            for j, kind in enumerate(kinds)
        ]
    )


def _turns(
    description: RobotDescription, chains: Sequence[tuple[Chain, Chain]]
) -> kernel.Integers:
    # Whether a whole turn of a joint that has no limits leaves every loop as it is.
    turns = np.zeros(len(description.joints), dtype=np.int64)
    tables = [chain.table for pair in chains for chain in pair]
    for j, joint in enumerate(description.joints):
        endless = joint.type == 'revolute' and np.isinf([joint.lower, joint.upper]).all()
        shares = np.concatenate([table.by_theta[table.joint == j] for table in tables])
        turns[j] = endless and len(shares) > 0 and bool(np.all(shares == np.round(shares)))
    return turns


def _gap(pair: tuple[Chain, Chain], x: Floats) -> Floats:
    # The end of the second chain seen from that of the first, in the axes where both begin: the
    # way, and the rotation as axis times sine.
    poses = []
    for chain in pair:
        row = np.empty((1, chain.widths[kernel.POSE]))
        kernel.evaluate(chain, x[None].copy(), chain.at_rest[None].copy(), kernel.POSE, row)
        poses.append(row[0, :16].reshape(4, 4))
    there, back = poses
    turn = back[:3, :3] @ there[:3, :3].T
    rotation = 0.5 * np.array(
        [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
    )
    return np.concatenate([back[:3, 3] - there[:3, 3], rotation])


def _refuse(
    description: RobotDescription,
    k: int,
    chains: Sequence[tuple[Chain, Chain]],
    given: Floats,
    start: Floats,
) -> NoReturn:
    loop = description.loops[k]
    gap = _gap(chains[k], given)
    variables, n = len(given), len(description.joints)
    told = start[2 * variables + (variables - n) * n + 3 * k :]
    away = [f'{row} {gap[ROWS.index(row)]:.3g}' for row in loop.rows]
    where = f'loops[{k}].assembled'
    if idle := _idle_rows(description, k, chains[k], given):
        where = f'loops[{k}].rows'
        message = (
            f'no passive joint of the loop moves {" or ".join(idle)}: name the rows of the plane '
            'in which it moves'
        )
    elif told[1] <= 1e-9:
        message = (
            f'the loop is flat at this position: det of its closure by '
            f'{", ".join(joint.name for joint in loop.passive)} is 0, and two of its branches '
            'meet; give a position on one branch'
        )
    else:
        message = (
            f'the loop does not close here: its ends are apart by {", ".join(away)} (m, rad), and '
            "Newton's method finds no closed position nearby"
        )
    raise RobotFileError((Fault(description.file, loop.line, where, message),))


def _idle_rows(
    description: RobotDescription, k: int, pair: tuple[Chain, Chain], x: Floats
) -> list[str]:
    # The rows that the passive joints move neither here nor beside it: here alone might be flat.
    loop = description.loops[k]
    first = len(description.joints) + sum(len(one.passive) for one in description.loops[:k])
    passive = np.arange(first, first + len(loop.passive))
    away = np.array(x)
    away[passive] += BESIDE * (1.0 + np.arange(len(passive)))
    moved = np.zeros(len(ROWS))
    for j in passive:
        step = np.zeros(len(x))
        step[j] = BESIDE
        moved = np.maximum(moved, np.abs(_gap(pair, away + step) - _gap(pair, away - step)))
    return [row for row in loop.rows if moved[ROWS.index(row)] < PARALLEL]


def _check_rest(
    description: RobotDescription, loop: LoopDescription, pair: tuple[Chain, Chain], x: Floats
) -> None:
    # Of a rotation either all rows are named, or the others vanish by themselves: two rotations
    # that agree about one axis only are not closed by the slopes of their ends.
    named = [row for row in loop.rows if row in ROWS[3:]]
    if len(named) in (0, 3):
        return
    gap = _gap(pair, x)
    others = [row for row in ROWS[3:] if row not in named and abs(gap[ROWS.index(row)]) > PARALLEL]
    if others:
        k = description.loops.index(loop)
        message = (
            f'the ends are turned against each other about {" and ".join(others)} at the '
            f'assembled position, and only {" ".join(named)} is among the rows: '
            'name rx, ry and rz, or none'
        )
        raise RobotFileError((Fault(description.file, loop.line, f'loops[{k}].rows', message),))


def other_branches(description: RobotDescription, k: int) -> tuple[tuple[float, ...], ...]:
    """
    Return other positions of a loop's passive joints at which it closes at the known position.

    Newton's method looks for them from many positions, with no proof that there are no others;
    turns are left out.

    Parameters
    ----------
    description
        The arm.
    k
        Which loop; those before it stay as they are.
    """
    closure, loop = closure_of(description), description.loops[k]
    assert closure is not None  # it has loops
    turning = np.array([joint.type == 'revolute' for joint in loop.passive])
    n = len(description.joints)
    first = n + sum(len(one.passive) for one in description.loops[:k])
    places = slice(first, first + len(loop.passive))
    known = closure.variables_at_start()
    found = [known[places]]
    for values in _starts(turning, 2.0 * np.abs(known[places]) + 1.0):
        section = np.zeros(closure.width)
        section[: len(known)] = known
        section[places] = values
        if kernel.assemble(closure.first, k + 1, n, section):
            continue
        closed = section[places]
        apart = [np.where(turning, np.sin(0.5 * (closed - one)), closed - one) for one in found]
        if min(float(np.max(np.abs(one))) for one in apart) > SAME_BRANCH:
            found.append(closed)
    wrapped = [np.where(turning, np.arctan2(np.sin(v), np.cos(v)), v) for v in found[1:]]
    return tuple(tuple(values.tolist()) for values in wrapped)


def _starts(turning: npt.NDArray[np.bool_], strokes: Floats) -> Floats:
    # A grid of one or two variables, denser than Newton's method needs it; random ones of more.
    ends = np.where(turning, np.pi, strokes)
    if len(turning) > 2:
        random = np.random.default_rng(SEED)
        return random.uniform(-ends, ends, (BRANCH_STARTS, len(turning)))
    grids = np.meshgrid(*(np.linspace(-end, end, GRID) for end in ends))
    return np.stack([grid.ravel() for grid in grids], axis=1)


def close_at(chain: Chain, q: Floats) -> tuple[Floats, Floats]:
    """
    Return what the kernel says of the loops of a chain at each pose, and which does not close.

    Parameters
    ----------
    chain
        A chain with loops.
    q : shape (N, n), rad or m
        Joint positions.

    Returns
    -------
    shape (N, width) as `kernel.Closure` says, shape (N,) 0 or the loop counted from the last
    """
    sections = np.empty((len(q), chain.closure.width))
    failed = np.empty(len(q))
    kernel.close_at(chain, np.ascontiguousarray(q), sections, failed)
    return sections, failed


def closes_at(chain: Chain, q: Floats) -> npt.NDArray[np.bool_]:
    """Return for poses (..., n) whether the loops of a chain close there; always without loops."""
    if chain.loops == 0:
        return np.full(q.shape[:-1], True)
    return np.reshape(close_at(chain, q.reshape(-1, chain.dof))[1] == 0.0, q.shape[:-1])


def closed_poses(chain: Chain, q: Floats) -> Floats:
    """
    Return those of many poses at which the loops of a chain close, all of them without loops.

    Where they are few, others around the known position are put behind them.
    """
    if chain.loops == 0:
        return q
    found: Floats = q[closes_at(chain, q)]
    if len(found) >= FEW:
        return found
    random = np.random.default_rng(SEED)
    assembled = chain.closure.assembled()
    for share in AROUND:
        units = np.minimum(chain.closure.units(), 1.0)
        near = assembled + share * units * random.uniform(-1.0, 1.0, (10 * FEW, chain.dof))
        found = np.concatenate([found, near[closes_at(chain, near)]])
        if len(found) >= FEW:
            break
    return np.asarray(np.concatenate([found, assembled[None]]))
