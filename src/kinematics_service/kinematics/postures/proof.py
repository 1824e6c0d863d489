"""
The proof that an arm changes no posture without meeting a singular pose, of arms that have one.

Each is of one kind: the equations for a target can be solved joint by joint, each has at most two
solutions, and its slope has different signs at them. det(J_t) is the product of the slopes. So
where it is not zero the signs stay, and with them the solution.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...kernel import Floats
from ...robot.robot import Robot
from ...robot.task import ROW_NAMES
from ..inverse.chain_geometry import (
    all_parallel,
    in_one_direction,
    meeting_point,
    parallel,
    reversed_screws,
    through,
    with_links_merged,
)
from ..inverse.plan import one_to_one
from ..inverse.screws import Screws, screws_of
from .position_arm import ROUND_OFF, PositionProof, position_proof

ONE_JOINT = 'one joint is at the same place twice only where a pose between is singular'
PLANAR = 'of an arm in a plane the bend between two links is told by the sign of det(J_t)'
THREE_ANGLES = 'of three turns the second has two angles, told by the sign of det(J_t)'
WRIST = 'the wrist has two solutions, told by the sign of a factor of det(J_t); '
PARALLEL_AXES = (
    'axes 2, 3 and 4 are parallel and axes 5 and 6 meet: joint 1, joint 5 and the bend of joint 3 '
    'have two solutions each, one after the other, told by the signs of factors of det(J_t)'
)


def proof_of_no_change(robot: Robot) -> PositionProof:
    """
    Return what is proved of an arm; its cusps are positions (k, n) of its joints, rad.

    Limits of its joints are left aside: inside them no more is possible.
    """
    screws, rows = screws_of(robot.chain), set(robot.task.rows)
    nowhere = np.empty((0, robot.dof))
    if robot.dof == 1 and len(screws.axes) == 1:
        return PositionProof(ONE_JOINT, nowhere)
    forms = [form for form in _forms(screws) if one_to_one(form, robot)]
    for form in forms:
        for is_so, sentence in _SENTENCES:
            if is_so(robot, form, rows):
                return PositionProof(sentence, nowhere)
    for form in forms:
        if rows == set(ROW_NAMES[:3]) and robot.dof == 3:
            found = position_proof(form)
            still = np.zeros((len(found.cusps), 1))
            to_joints = np.linalg.inv(form.coupling).T
            cusps = np.concatenate([still, found.cusps], axis=1) @ to_joints
            if found.sentence or len(cusps):
                return PositionProof(found.sentence, cusps)
        if rows == set(ROW_NAMES) and robot.dof == 6:
            wrist = meeting_point(form, (3, 4, 5))
            arm = None if wrist is None else _first_three(through(form, (3, 4, 5), wrist), wrist)
            if arm is not None and (sentence := position_proof(arm).sentence):
                return PositionProof(WRIST + sentence, nowhere)
    return PositionProof('', nowhere)


def _forms(screws: Screws) -> list[Screws]:
    return [screws, reversed_screws(screws), with_links_merged(screws)]


def _first_three(form: Screws, point: Floats) -> Screws:
    home = np.eye(4)
    home[:3, 3] = point
    return replace(
        form,
        axes=form.axes[:3].copy(),
        points=form.points[:3].copy(),
        slides=form.slides[:3],
        coupling=form.coupling[:3].copy(),
        home=home,
    )


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


def _is_three_angles(robot: Robot, form: Screws, rows: set[str]) -> bool:
    return rows == set(ROW_NAMES[3:]) and robot.dof == 3 and not any(form.slides)


def _has_parallel_axes(robot: Robot, form: Screws, rows: set[str]) -> bool:
    if rows != set(ROW_NAMES) or robot.dof != 6 or any(form.slides):
        return False
    if not all_parallel(form, (1, 2, 3)) or any(
        parallel(form.axes[1], form.axes[k]) for k in (0, 4)
    ):
        return False
    crossing = meeting_point(form, (4, 5))
    if crossing is None:
        return False
    return in_one_direction(through(form, (4, 5), crossing), (1, 2, 3)).off <= ROUND_OFF


_SENTENCES: tuple[tuple[Callable[[Robot, Screws, set[str]], bool], str], ...] = (
    (_is_planar, PLANAR),
    (_is_three_angles, THREE_ANGLES),
    (_has_parallel_axes, PARALLEL_AXES),
)
