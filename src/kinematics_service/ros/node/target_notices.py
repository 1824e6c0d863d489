"""What became of a target, in a sentence and as keys and values."""

import numpy as np

from ...estimation.status_text import StatusText
from ...kernel import Floats
from ...kinematics.inverse.result import IkResult
from ...kinematics.inverse.servo import ServoStep
from ...robot.measures import Level
from ..messages.target_messages import Choice


def pose_status(result: IkResult, choice: Choice, near: Floats) -> StatusText:
    """
    Return what became of a pose target: OK where the arm can be there, otherwise ERROR.

    `near` are the present joint positions: who executes the answer sees how far it is.
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


def twist_status(step: ServoStep) -> StatusText:
    """Return what became of a twist target: WARN where the tool moves otherwise than asked."""
    values = (
        ('limited by', ', '.join(step.limited_by) or 'nothing'),
        ('damping', f'{step.damping:.4g}'),
        ('scale', f'{step.scale:.6g}'),
        ('smallest singular value', f'{step.smallest_singular_value:.6g}'),
        ('held joints', ', '.join(step.held)),
        ('twist', _numbers(step.twist)),
    )
    reasons = []
    if step.damping > 0.0:
        reasons.append(f'damped near a singularity ({step.damping:.0%} of the most)')
    if step.slowest:
        reasons.append(f'slowed to {step.scale:.0%} by the velocity limit of {step.slowest}')
    if step.held:
        reasons.append(f'held at the limit of {", ".join(step.held)}')
    if reasons:
        return StatusText(Level.WARN, '; '.join(reasons), values)
    return StatusText(Level.OK, 'followed as asked', values)


def _numbers(values: Floats) -> str:
    return ' '.join(f'{value:.6g}' for value in values)
