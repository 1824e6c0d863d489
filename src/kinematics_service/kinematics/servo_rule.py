# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute MoveIt Servo's speed factor of a tool motion from the condition number of the Jacobian.

The rule is `velocityScalingFactorForSingularity` (moveit_servo/src/utils/common.cpp of MoveIt 2).
The settings have the names and defaults of MoveIt. J has all six rows, in m and rad. If an arm has
n < 6 joints, the smallest of the n singular values is used, as proposed in moveit2#3750. MoveIt
Servo itself reads a sixth singular value, which does not exist, and halts.
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
        Condition numbers above which the arm is slowed (lower threshold) and stopped (hard stop).
    leaving_singularity_threshold_multiplier
        Factor by which the range between both thresholds is multiplied if the arm moves away from
        a singular pose.
    singularity_step_scale
        Length of the test step, m and rad, from which the rule finds in which direction the
        condition number grows.

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
        """Raise ServoSettingsError for invalid settings."""
        for name in (field.name for field in fields(self)):
            check_positive(ServoSettingsError, name, getattr(self, name))
        lower, hard_stop = self.lower_singularity_threshold, self.hard_stop_singularity_threshold
        if lower >= hard_stop:
            name = 'hard_stop_singularity_threshold'
            above = f'above lower_singularity_threshold, {lower:g}'
            raise ServoSettingsError.refused(name, above, hard_stop, code='wrong-order')

    def check(self, robot: Robot) -> None:
        """Raise ServoSettingsError for an arm with closed loops, which MoveIt does not support."""
        if robot.chain.loops:
            sentence = (
                f"{robot.name} has closed loops, for which MoveIt Servo's rule is not made; leave "
                'out rule to use the distance'
            )
            raise ServoSettingsError(sentence, 'rule', code='unsupported')


class ServoFactors(NamedTuple):
    """
    The speed factor by MoveIt Servo's rule and the numbers behind it, for one motion or many.

    Attributes
    ----------
    values : shape (...)
        The factor of each motion.
    condition, rate : shape (...), 1 and 1/s
        The condition number, and its rate along the motion.
    leaving : shape (...)
        Whether the motion leads away from a singular pose, according to the rule.
    """

    values: Floats
    condition: Floats
    rate: Floats
    leaving: npt.NDArray[np.bool_]


def servo_factors(state: ToolState, rule: ServoRule) -> ServoFactors:
    """Return MoveIt Servo's speed factors for the motions in `state`, which has velocities."""
    U, sigma, Vt = np.linalg.svd(state.jacobian, full_matrices=False)
    condition = sigma[..., 0] / sigma[..., -1]
    lower, stop = rule.lower_singularity_threshold, rule.hard_stop_singularity_threshold
    stopped = ~(condition < stop)
    # sigma is the smallest singular value, u its tool direction and v its joint motion: J v =
    # sigma u. A singular value decomposition does not determine the sign of u. So move the joints
    # along v / sigma, which moves the tool along +u, and test whether the condition number grows.
    u, v, least = U[..., -1], Vt[..., -1, :], np.where(stopped, np.inf, sigma[..., -1])
    step = v * (rule.singularity_step_scale / least)[..., None]
    next_jacobian = evaluate(state.robot, state.q + step).jacobian
    next_sigma = np.linalg.svd(next_jacobian, compute_uv=False)
    grows = next_sigma[..., 0] / next_sigma[..., -1] > condition
    along = np.sum(u * state.twist, axis=-1)
    towards = np.where(grows, along, -along) > 0.0
    span = (stop - lower) * np.where(towards, 1.0, rule.leaving_singularity_threshold_multiplier)
    values = np.clip(1.0 - (condition - lower) / span, 0.0, 1.0)
    assert state.qdot is not None  # the state must have velocities
    rates = jacobian_rate(state.robot, state.q, state.qdot)
    largest, smallest = (
        np.einsum('...i,...ij,...j->...', U[..., k], rates, Vt[..., k, :]) for k in (0, -1)
    )
    return ServoFactors(
        values=np.where(stopped, 0.0, values),
        condition=condition,
        rate=(largest - condition * smallest) / sigma[..., -1],
        leaving=~(towards | stopped),
    )
