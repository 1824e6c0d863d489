"""
MoveIt Servo's rule: how much of a tool motion is kept at a condition number of the Jacobian.

The rule is that of `velocityScalingFactorForSingularity` (moveit_servo/src/utils/common.cpp of
MoveIt 2), and its settings have the names and the defaults that they have there. Its J has all six
rows, in m and rad. Of an arm with n < 6 joints the last of the n singular values counts, as
proposed in moveit2#3750: Servo itself reads a sixth one, which does not exist, and halts.
"""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..errors import ServoSettingsError
from ..kernel import Floats
from ..robot.robot import Robot
from .acceleration import jacobian_rate
from .arguments import check_positive
from .tool_state import ToolState, evaluate


@dataclass(frozen=True)
class ServoRule:
    """
    MoveIt Servo's rule for singular poses, by the condition number of J (6 x n, m and rad).

    Attributes
    ----------
    lower_singularity_threshold, hard_stop_singularity_threshold
        Condition numbers from which the arm is slowed, and stopped.
    leaving_singularity_threshold_multiplier
        What leads away is slowed this many times less.
    singularity_step_scale
        The step, m and rad, that shows which way the condition number grows.

    Raises
    ------
    ServoSettingsError
        A number is not positive and finite, or an arm would be stopped before it is slowed.
    """

    lower_singularity_threshold: float = 17.0
    hard_stop_singularity_threshold: float = 30.0
    leaving_singularity_threshold_multiplier: float = 2.0
    singularity_step_scale: float = 0.01

    def __post_init__(self) -> None:
        """Refuse invalid settings."""
        for name in (field.name for field in fields(self)):
            check_positive(ServoSettingsError, name, getattr(self, name))
        lower, hard_stop = self.lower_singularity_threshold, self.hard_stop_singularity_threshold
        if lower >= hard_stop:
            raise ServoSettingsError(
                f'hard_stop_singularity_threshold, {hard_stop:g}, must be above '
                f'lower_singularity_threshold, {lower:g}',
                'hard_stop_singularity_threshold',
            )

    def check(self, robot: Robot) -> None:
        """Raise ServoSettingsError for an arm with closed loops, of which MoveIt knows none."""
        if robot.chain.loops:
            raise ServoSettingsError(
                f"{robot.name} has closed loops, for which MoveIt Servo's rule is not made: take "
                'the distance',
                'rule',
            )


class ServoShares(NamedTuple):
    """
    What the rule says of motions.

    Attributes
    ----------
    values : shape (...)
        The share of each motion that is kept.
    condition, rate : shape (...), 1 and 1/s
        The condition number, and how fast the motion makes it grow.
    leaving : shape (...)
        Whether the motion is slowed as one that leads away.
    """

    values: Floats
    condition: Floats
    rate: Floats
    leaving: npt.NDArray[np.bool_]


def servo_shares(state: ToolState, rule: ServoRule) -> ServoShares:
    """Return what the rule says of states with known velocities."""
    U, sigma, Vt = np.linalg.svd(state.jacobian, full_matrices=False)
    condition = sigma[..., 0] / sigma[..., -1]
    lower, stop = rule.lower_singularity_threshold, rule.hard_stop_singularity_threshold
    stopped = ~(condition < stop)
    # The inverse moves the joints by v / sigma along the tool's hardest direction u, whose sign is
    # by chance: the step says whether +u or -u leads to larger condition numbers.
    u, v, least = U[..., -1], Vt[..., -1, :], np.where(stopped, np.inf, sigma[..., -1])
    step = v * (rule.singularity_step_scale / least)[..., None]
    next_jacobian = evaluate(state.robot, state.q + step).jacobian
    next_sigma = np.linalg.svd(next_jacobian, compute_uv=False)
    grows = next_sigma[..., 0] / next_sigma[..., -1] > condition
    along = np.sum(u * state.twist, axis=-1)
    towards = np.where(grows, along, -along) > 0.0
    span = (stop - lower) * np.where(towards, 1.0, rule.leaving_singularity_threshold_multiplier)
    values = np.clip(1.0 - (condition - lower) / span, 0.0, 1.0)
    assert state.qdot is not None  # it has been given
    rates = jacobian_rate(state.robot, state.q, state.qdot)
    largest, smallest = (
        np.einsum('...i,...ij,...j->...', U[..., k], rates, Vt[..., k, :]) for k in (0, -1)
    )
    return ServoShares(
        values=np.where(stopped, 0.0, values),
        condition=condition,
        rate=(largest - condition * smallest) / sigma[..., -1],
        leaving=~(towards | stopped),
    )
