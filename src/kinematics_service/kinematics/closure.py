# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the state of the closed loops of an arm: passive joint positions and determinants."""

from dataclasses import dataclass

from ..kernel import Floats
from ..robot.closed_poses import close_at
from ..robot.file.parts.loop_groups import closed_together, group_in_words
from ..robot.robot import Robot


@dataclass(frozen=True, eq=False)
class LoopClosure:
    """
    The state of an arm's closed loops, passive joints and determinants, at one pose or at many.

    Attributes
    ----------
    names : L names
        The names of the loops. Loops that share passive joints are solved together as one loop
        with the name 'a + b'.
    passive_joint_names : P names
        Names of the joints that the loops move.
    passive : shape (..., P), rad or m
        The positions of the passive joints.
    coupling : shape (..., P, n)
        The derivatives of the passive joints psi by the joints q, -(d Phi / d psi)^-1 d Phi / d q,
        where Phi = 0 are the loop equations.
    determinants : shape (..., L)
        det(d Phi / d psi) of each loop, in SI units. If a determinant is 0, the loop equations are
        singular, and the branch of solutions ends or meets another branch.
    residuals : shape (..., L)
        The largest component of Phi for each loop: position components divided by the size of the
        loops (the largest sum of constant lengths in one chain of a loop), rotation components in
        rad.
    steps : shape (..., L)
        Number of Newton's steps of each loop. The steps begin at the positions `assembled` of the
        robot file.
    """

    names: tuple[str, ...]
    passive_joint_names: tuple[str, ...]
    passive: Floats
    coupling: Floats
    determinants: Floats
    residuals: Floats
    steps: Floats


def closure_in(robot: Robot, section: Floats) -> LoopClosure:
    """
    Return the state of the closed loops, read from `section` (..., width), the part of the
    kernel's results that is about loops.
    """
    n, closure = robot.dof, robot.chain.closure
    P, variables = closure.passive, closure.variables
    leading = section.shape[:-1]
    status = section[..., closure.status_at : closure.screws_at]
    status = status.reshape(*leading, closure.groups, 3)
    return LoopClosure(
        names=robot.loop_names,
        passive_joint_names=robot.passive_joint_names,
        passive=section[..., n:variables],
        coupling=section[..., closure.coupling_at : closure.status_at].reshape(*leading, P, n),
        determinants=status[..., 0],
        residuals=status[..., 1],
        steps=status[..., 2],
    )


def why_not_closed(robot: Robot, q: Floats) -> tuple[str, str]:
    """
    Return the name of a loop that does not close at joint positions q (n,), and a sentence with
    the reason. Returns two empty texts if all loops close.
    """
    sections, failed = close_at(robot.chain, q[None])
    if failed[0] == 0.0:
        return '', ''
    name = robot.loop_names[len(robot.loop_names) - int(failed[0])]
    if closed_together(name):
        fails, whose = f'the {group_in_words(name)} of {robot.name} do', 'their'
    else:
        fails, whose = f'the loop {name!r} of {robot.name} does', 'its'
    return name, (
        f'{fails} not close at [{_numbers(q)}]: on the way from the assembled position {whose} '
        f'branch ends at [{_numbers(sections[0, : robot.dof])}]'
    )


def _numbers(q: Floats) -> str:
    return ', '.join(f'{value:.6g}' for value in q)
