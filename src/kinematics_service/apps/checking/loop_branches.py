# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find other branches of closed loops: other passive joint positions at which the loops close.

Newton's method starts from a grid of positions, or from random positions.
"""

import numpy as np
import numpy.typing as npt

from ... import kernel
from ...kernel import Closure, Floats, LoopGroup
from ...robot.chain import poses_and_jacobians
from ...robot.file.parts.description import RobotDescription
from ...robot.file.parts.loop_groups import loop_groups, passive_of
from ...robot.loops import closure_of, gap_between

# Number of start values of each passive joint, if a group of loops has one or two passive joints.
GRID_POINTS = 24
# Number of random starts, if a group of loops has more than two passive joints.
RANDOM_STARTS = 400
# Two solutions are different branches if a passive joint differs by more than this value (rad, m).
BRANCH_TOLERANCE = 1e-6
# Number of damped steps that move each random start toward positions at which the loops close.
DAMPED_STEPS = 60
# Largest damped step of a passive joint toward closed loops: for turning joints in rad, for
# sliding joints as a fraction of the size of the loops.
STEP_LIMIT = 0.5
# Damping of the damped steps, in the units of J^T J.
DAMPING = 1e-6
# Seed of the random start positions of passive joints.
SEED = 20240523


def other_branches(description: RobotDescription, g: int) -> tuple[tuple[float, ...], ...]:
    """
    Return further positions of the passive joints of a group of loops at which these loops close.

    The active joints stay at the known position of the file. Newton's method starts at many
    positions of the passive joints, and may miss branches. Positions that differ by full turns
    are one branch.

    Parameters
    ----------
    description
        The arm.
    g
        Index of the group of loops; the passive joints of earlier groups keep their known
        positions.
    """
    closure, groups = closure_of(description), loop_groups(description.loops)
    assert closure is not None  # the description has loops
    passive = passive_of(groups[g])
    turning = np.array([joint.type == 'revolute' for joint in passive])
    first = len(description.joints) + sum(len(passive_of(group)) for group in groups[:g])
    places = np.arange(first, first + len(passive))
    known = closure.variables_at_start()
    branches = [known[places]]
    for values in _starts(closure, g, places, turning, 2.0 * np.abs(known[places]) + 1.0):
        section = np.zeros(closure.width)
        section[: len(known)] = known
        section[places] = values
        if kernel.assemble(closure.first, g + 1, closure.dof, section):
            continue
        closed = section[places]
        gaps = [np.where(turning, np.sin(0.5 * (closed - v)), closed - v) for v in branches]
        if min(float(np.max(np.abs(gap))) for gap in gaps) > BRANCH_TOLERANCE:
            branches.append(closed)
    wrapped = [np.where(turning, np.arctan2(np.sin(v), np.cos(v)), v) for v in branches[1:]]
    return tuple(tuple(values.tolist()) for values in wrapped)


def _starts(
    closure: Closure,
    g: int,
    places: kernel.Integers,
    turning: npt.NDArray[np.bool_],
    strokes: Floats,
) -> Floats:
    # Return the passive joint positions from which Newton's method starts. For one or two passive
    # joints, they form a dense grid. For more joints, they are random positions that damped steps
    # (Levenberg-Marquardt) have moved toward closed loops.
    ends = np.where(turning, np.pi, strokes)
    if len(turning) <= 2:
        grids = np.meshgrid(*(np.linspace(-end, end, GRID_POINTS) for end in ends))
        return np.stack([grid.ravel() for grid in grids], axis=1)
    group, random = kernel.groups_from(closure.first)[g], np.random.default_rng(SEED)
    x = np.tile(closure.variables_at_start(), (RANDOM_STARTS, 1))
    x[:, places] = random.uniform(-ends, ends, (RANDOM_STARTS, len(turning)))
    longest = STEP_LIMIT * closure.first.arguments[3][places]
    with np.errstate(all='ignore'):
        for _ in range(DAMPED_STEPS):
            gap, slopes = _residuals(group, x)
            slopes = slopes[..., places]
            squares = np.swapaxes(slopes, 1, 2) @ slopes + DAMPING * np.eye(len(places))
            steps = np.linalg.solve(squares, np.swapaxes(slopes, 1, 2) @ gap[..., None])[..., 0]
            x[:, places] -= np.clip(steps, -longest, longest)
    return x[:, places]


def _residuals(group: LoopGroup, x: Floats) -> tuple[Floats, Floats]:
    # Return the residuals (N, p) of the loop equations of a group at joint variables x (N, v), and
    # the derivatives (N, p, v) of the residuals.
    gaps, slopes = [], []
    for loop in group.members():
        there, J_there = poses_and_jacobians(loop.there, x)
        back, J_back = poses_and_jacobians(loop.back, x)
        gaps.append(gap_between(there, back)[:, loop.axes()])
        slopes.append((J_back - J_there)[:, loop.axes()])
    return np.concatenate(gaps, axis=1), np.concatenate(slopes, axis=1)
