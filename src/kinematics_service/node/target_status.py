# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Describe how the node answered a target, as a status: a sentence, and values by key."""

import numpy as np

from ..estimation.status_text import StatusText
from ..kernel import Floats
from ..kinematics.inverse.result import IkFamily, IkResult
from ..kinematics.inverse.self_motion.best_posture import BestPosture
from ..kinematics.inverse.servo import FOLLOWED_ROUND_OFF, ServoStep
from ..robot.measures import Level
from .messages.target_messages import Choice


def pose_status(result: IkResult, choice: Choice, near: Floats, redundancy: str) -> StatusText:
    """
    Return the status of a target pose: OK if the arm can reach it, otherwise ERROR.

    Parameters
    ----------
    near : shape (n,)
        The present joint positions; the status reports the largest joint motion from them to the
        answer.
    redundancy
        The criterion that selects the solution of a redundant arm.
    """
    values = [
        ('status', result.status),
        ('solutions', str(len(choice.answers))),
        ('method', result.method),
    ]
    if choice.answers:
        values.append(('residual', f'{choice.answers[0].residual:.3g}'))
        motion = float(np.max(np.abs(choice.answers[0].q - near)))
        values.append(('largest joint motion', f'{motion:.6g}'))
        values.append(('margin', f'{choice.answers[0].margin:.6g}'))
        if redundancy != 'near' and isinstance(choice.answers[0], IkFamily):
            values += _on_arc(choice.best, redundancy)
        return StatusText(Level.OK, result.reason, tuple(values))
    sentence = result.reason
    nearest = result.nearest
    if nearest is not None:
        values += [
            ('nearest position error (m)', f'{nearest.position_error:.6g}'),
            ('nearest rotation error (rad)', f'{nearest.rotation_error:.6g}'),
            ('nearest', _numbers(nearest.q)),
        ]
        sentence += (
            f'; the nearest pose is {nearest.position_error:.4g} m and '
            f'{nearest.rotation_error:.4g} rad away'
        )
    return StatusText(Level.ERROR, sentence, tuple(values))


def _on_arc(best: BestPosture | None, redundancy: str) -> list[tuple[str, str]]:
    if best is None:
        return [('redundancy', 'near'), ('arc', 'none was followed from this posture')]
    ends = ['singular' if not end.joint else f'{end.joint} {end.limit}' for end in best.arc.ends]
    return [
        ('redundancy', redundancy),
        ('arc', f'from {ends[0]} to {ends[1]}' if ends else 'closed'),
        ('arc length', f'{best.arc.length:.6g}'),
        ('left to the best', f'{best.left:.6g}'),
        ('other arcs', 'not looked for'),
    ]


def twist_status(step: ServoStep) -> StatusText:
    """Return the status of a target twist: WARN if the resulting tool twist is not the target."""
    values = (
        ('limited by', ', '.join(step.limited_by) or 'nothing'),
        ('damping', f'{step.damping:.4g}'),
        ('followed', f'{step.followed:.6g}'),
        ('scale', f'{step.scale:.6g}'),
        ('smallest singular value', f'{step.smallest_singular_value:.6g}'),
        ('held joints', ', '.join(step.held)),
        ('twist', _numbers(step.twist)),
    )
    reasons = []
    if step.lost:
        reasons.append(
            f'this singular pose has lost the direction asked for: {step.followed:.1%} of the '
            f'twist is made; move the joints by way_out of the singularity warning first'
        )
    elif step.damping > 0.0:
        reasons.append(f'damped near a singularity ({step.damping:.0%} of the maximum)')
    elif step.followed < 1.0 - FOLLOWED_ROUND_OFF:
        reasons.append(
            f'{step.followed:.0%} of the twist is made: the arm cannot make the rest at any pose '
            '(ik.rows says what counts)'
        )
    if step.slowest:
        reasons.append(f'slowed to {step.scale:.0%} by the velocity limit of {step.slowest}')
    if step.held:
        reasons.append(f'held at the limit of {", ".join(step.held)}')
    if reasons:
        return StatusText(Level.WARN, '; '.join(reasons), values)
    return StatusText(Level.OK, 'followed as asked', values)


def _numbers(values: Floats) -> str:
    return ' '.join(f'{value:.6g}' for value in values)
