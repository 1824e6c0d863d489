"""
The proof that an arm changes no posture without meeting a singular pose, of arms that have one.

Each is of one kind: the equations for a target can be solved joint by joint, each has at most two
solutions, and its slope has different signs at them. det(J_t) is the product of the slopes. So
where it is not zero the signs stay, and with them the solution.
"""

from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...robot.robot import Robot
from ...robot.task import ROW_NAMES
from ..inverse.problem.chain_geometry import (
    meeting_point,
    reversed_screws,
    through,
    with_feet,
    with_links_merged,
    with_parallel_axes,
)
from ..inverse.problem.plan import one_to_one
from ..inverse.problem.screws import Screws, screws_of
from .position_arm import ROUND_OFF, AspectGrid, position_proof

ONE_JOINT = 'one joint is at the same place twice only where a pose between is singular'
PLANAR = 'of an arm in a plane the bend between two links is told by the sign of det(J_t)'
THREE_ANGLES = 'of three turns the second has two angles, told by the sign of det(J_t)'
WRIST = 'the wrist has two solutions, told by the sign of a factor of det(J_t); '
PARALLEL_AXES = (
    'axes 2, 3 and 4 are parallel and axes 5 and 6 meet: joint 1, joint 5 and the bend of joint 3 '
    'have two solutions each, one after the other, told by the signs of factors of det(J_t)'
)


class PostureProof(NamedTuple):
    """
    What the geometry of an arm says of its postures; limits of its joints are left aside.

    Attributes
    ----------
    sentence
        Why each aspect has one posture of a target at most; empty where that is not proved.
    cusps : shape (k, n), rad
        Where joint positions of three equal solutions may be.
    grid
        The aspects of three turning joints and a position; None for other arms.
    """

    sentence: str
    cusps: Floats
    grid: AspectGrid | None


def proof_of_no_change(robot: Robot) -> PostureProof:
    """Return what the geometry of an arm without loops says of its postures."""
    screws, rows = screws_of(robot.chain), set(robot.task.rows)
    if rows == set(ROW_NAMES[:3]) and robot.dof == 3:
        for form in (screws, with_links_merged(screws)):
            if one_to_one(form, robot):
                return _position(form)
    sentence = ''
    if robot.dof == 1 and len(screws.axes) == 1:
        sentence = ONE_JOINT
    elif one_to_one(screws, robot):
        sentence = _whole(robot, screws) if rows == set(ROW_NAMES) else _few(robot, screws, rows)
    return PostureProof(sentence, np.empty((0, robot.dof)), None)


def _position(form: Screws) -> PostureProof:
    found = position_proof(form, form.tool)
    psi = np.column_stack([np.zeros(len(found.cusps)), found.cusps])
    cusps = psi @ np.linalg.inv(form.coupling).T
    is_exact = with_feet(form).off <= ROUND_OFF and not any(form.slides[1:])
    return PostureProof(found.sentence, cusps, AspectGrid(form) if is_exact else None)


def _few(robot: Robot, screws: Screws, rows: set[str]) -> str:
    if _is_planar(robot, screws, rows):
        return PLANAR
    three_angles = rows == set(ROW_NAMES[3:]) and robot.dof == 3 and not any(screws.slides)
    return THREE_ANGLES if three_angles else ''


def _whole(robot: Robot, screws: Screws) -> str:
    if robot.dof != 6:
        return ''
    for form in (screws, reversed_screws(screws)):
        found = with_parallel_axes(form)
        if found and found[0].off <= ROUND_OFF:
            return PARALLEL_AXES
        wrist = meeting_point(form, (3, 4, 5))
        if wrist is not None:
            rest = position_proof(through(form, (3, 4, 5), wrist), wrist)
            if rest.sentence:
                return WRIST + rest.sentence
    return ''


def _is_planar(robot: Robot, form: Screws, rows: set[str]) -> bool:
    # All axes along one of frame 0; two joints that turn and the position in the plane count, or
    # three and the angle, too; and one that slides across the plane.
    axes = np.abs(form.axes @ robot.task.rotation)
    k = int(np.argmax(axes[0]))
    turns, slides = form.slides.count(False), form.slides.count(True)
    wanted = set(ROW_NAMES[:3]) - (set() if slides else {ROW_NAMES[k]})
    if turns == 3:
        wanted.add(ROW_NAMES[3 + k])
    across = np.linalg.norm(np.delete(axes, k, axis=1))
    return turns in (2, 3) and slides < 2 and rows == wanted and bool(across < ROUND_OFF)
