# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the options of `audit` for planned trajectories."""

import math
from collections.abc import Sequence

from ....cli.options import WrongUsage
from ....errors import PlanError
from ....robot.robot import Robot
from ..audit.planned import PlanSettings
from ..plans.check import threshold_of_distance
from ..plans.point_speed import chain_to


def given_plans(
    robot: Robot, failures: Sequence[str] | None, limit: float | None, points: str | None
) -> PlanSettings:
    """
    Return the settings for checking plans. `failures` has the words of --fail-on.

    If `failures` contains `warn`, the least allowed distance to singular poses is the robot file's
    threshold `warn`. Otherwise it is the threshold `stop`.
    """
    if limit is not None and not 0.0 < limit < math.inf:
        raise WrongUsage(f'--speed-limit: {limit:g} m/s is not accepted; give a speed above 0')
    names = tuple(name.strip() for name in (points or '').split(',') if name.strip())
    for name in names:
        try:
            chain_to(robot, name)  # raises an error for an unknown point
        except PlanError as error:
            raise WrongUsage(f'--speed-of: {error}') from None
    strict = failures is not None and 'warn' in failures
    return PlanSettings(threshold_of_distance(robot, 'warn' if strict else 'stop'), limit, names)
