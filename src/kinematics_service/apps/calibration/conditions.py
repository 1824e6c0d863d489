# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Add parameters for drifts between sessions, and for the compliance of joints under a load.

These parameters have normal priors about zero and are fitted with the table. Drifts are
differences from the first session (treatment coding: Searle, Linear Models, chapter 5). Joints
yield to a load in proportion to their torque. The robot file has no such parameters: its table is
that of the arm without a load, in the first session.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...errors import CalibrationError
from ...kernel import Floats, Integers
from ...kinematics.statics import joint_torques
from ...robot.file.parts.parameters import ANGLE, LENGTH, SIX, ArmParameter
from ...robot.robot import Robot
from . import checking

# Prior standard deviations of the compliance of a joint. The values are those of soft gears. The
# key is True for a turning joint (rad/Nm), False for a sliding joint (m/N).
COMPLIANCE_PRIOR = {True: 1e-4, False: 1e-5}
# Prior standard deviations of the drift of the instrument between sessions. They equal the usual
# errors of the angles and lengths in a DH table. The key is True for an angle (rad), False for a
# length (m).
PLACEMENT_PRIOR = {True: float(ANGLE), False: LENGTH}
# Prior standard deviation of the drift of a joint zero between sessions, as a multiple of the
# usual error of a joint zero. Changes of temperature cause the drift.
DRIFT_SHARE = 0.5
STANDARD_GRAVITY = 9.80665  # m/s^2
# Largest load (kg) of an arm with the characteristic length 1 m. The characteristic length L (m)
# is the RMS distance between base and tool over random poses. For other arms, the largest load is
# LARGEST_LOAD * L^3.
LARGEST_LOAD = 300.0


class ToolLoads(NamedTuple):
    """
    The load on the tool at each measured pose.

    Attributes
    ----------
    masses : shape (N,), kg
        Mass of the load at each of N measured poses.
    at : m
        Centre of mass of the load in the tool frame.
    gravity
        Direction of gravity in the base frame of the robot file; the length does not matter.
    """

    masses: npt.ArrayLike
    at: Sequence[float] = (0.0, 0.0, 0.0)
    gravity: Sequence[float] = (0.0, 0.0, -1.0)


def with_conditions(
    robot: Robot,
    given: checking.Measured,
    own_base: bool,
    sessions: Sequence[str | int] | None,
    loads: ToolLoads | None,
) -> checking.Measured:
    """
    Return the measurements with additional parameters for sessions and loads.

    Parameters
    ----------
    own_base
        Whether the base is fitted for each set of measurements separately (`given.sets` has the
        sets).
    sessions
        The name of the session of each measurement. None: no parameters for sessions are added.
    loads
        The load on the tool at each measurement. None: no parameters for loads are added.

    Raises
    ------
    CalibrationError
        The number of session names, or of masses, differs from the number of measurements; all
        session names are equal; all masses are equal; or a number in `loads` is not finite.
    """
    q, n = given.q, robot.dof
    number, remarks, placements = np.zeros(len(q), dtype=np.int64), list[str](), []
    # `moving` has the parameters that correct joint positions, with their prior standard
    # deviations. `rates` has the derivatives of the joint positions by these parameters.
    moving, rates = dict[ArmParameter, float](), [given.rates]
    if sessions is not None:
        names = tuple(dict.fromkeys(map(str, sessions)))
        if len(sessions) != len(q):
            raise CalibrationError(
                f'sessions must name the session of each of {len(q)} rows, not of {len(sessions)}',
                code='wrong-length',
            )
        if len(names) == 1:
            message = f'sessions: all rows are of session {names[0]!r}; name two or more, or none'
            raise CalibrationError(message, code='no-variation')
        for name in names:
            checking.check_mark('session', name)
        number = np.array([names.index(str(session)) for session in sessions])
        remarks += _elsewhere(q, number, [f'session {name}' for name in names], 'a drift')
        # If each set has its own base and was measured in one session, the base of the set
        # contains the drift of the instrument. Then add no placement parameters.
        pairs = np.unique(np.stack([given.sets, number]), axis=1).shape[1]
        six = () if own_base and pairs == given.set_count else SIX
        for k, name in enumerate(names[1:], 1):
            placements += [
                ArmParameter(f'{name}.{axis}', checking.PLACEMENT, axis in SIX[3:]) for axis in six
            ]
            for parameter in _of_joints(robot, f'{name}.', checking.ZEROS):
                moving[parameter] = DRIFT_SHARE * parameter.scale
            rates.append((number == k)[:, None, None] * np.eye(n))
    if loads is not None:
        masses, pull = _checked_loads(robot, len(q), loads)
        wrench = np.concatenate([masses[:, None] * pull, np.zeros((len(q), 3))], axis=1)
        torques = joint_torques(robot, q, wrench, at=np.asarray(loads.at))
        torques[np.abs(torques) < checking.ROUND_OFF * np.max(masses) * STANDARD_GRAVITY] = 0.0
        for parameter in _of_joints(robot, 'compliance.', checking.COMPLIANCE):
            moving[parameter] = COMPLIANCE_PRIOR[parameter.angle]
        rates.append(torques[:, :, None] * np.eye(n))
        larger = (masses > np.mean(masses)).astype(np.int64)
        remarks += _elsewhere(q, larger, ['the smaller loads', 'the larger loads'], 'elasticity')
    priors = {**moving, **{drift: PLACEMENT_PRIOR[drift.angle] for drift in placements}}
    return given._replace(
        rates=np.concatenate(rates, axis=2),
        moving=(*given.moving, *moving),
        placements=tuple(placements),
        sessions=number,
        priors={parameter.name: prior for parameter, prior in priors.items()},
        remarks=tuple(remarks),
    )


def _of_joints(robot: Robot, prefix: str, group: str) -> Iterator[ArmParameter]:
    for name, slides in zip(robot.joint_names, robot.prismatic):
        yield ArmParameter(f'{prefix}{name}', group, not slides)


def _checked_loads(robot: Robot, count: int, loads: ToolLoads) -> tuple[Floats, Floats]:
    # Check the loads. Return the masses (N,), kg, and the weight of a mass of 1 kg as a vector in
    # the base frame, N.
    masses, at, down = (np.array(field, dtype=np.float64) for field in loads)
    if masses.shape != (count,):
        message = f'loads must be {count} masses, not of the shape {masses.shape}'
        raise CalibrationError(message, code='wrong-shape')
    if not np.all(np.isfinite(masses)) or np.min(masses) < 0.0:
        message = 'loads must be masses in kg, finite and not below 0'
        raise CalibrationError(message, code='out-of-range')
    if not (at.shape == down.shape == (3,) and np.all(np.isfinite([at, down])) and np.any(down)):
        raise CalibrationError(
            'the centre of mass and the direction of gravity of loads must be three finite '
            'numbers, those of gravity not all 0',
            code='out-of-range',
        )
    if np.ptp(masses) == 0.0:
        raise CalibrationError(
            f'loads: {masses[0]:g} kg in all rows do not show how the joints yield; measure the '
            'same joint positions with another load too',
            code='no-variation',
        )
    limit = LARGEST_LOAD * robot.singularity.task.length**3
    if np.max(masses) > limit:
        raise CalibrationError(
            f'loads: {np.max(masses):,.0f} kg is more than an arm of this size carries '
            f'({limit:,.0f} kg); write masses in kg, not g',
            code='wrong-unit',
        )
    return masses, STANDARD_GRAVITY * down / np.linalg.norm(down)


def _elsewhere(q: Floats, marks: Integers, names: Sequence[str], cause: str) -> Iterator[str]:
    # Yield a warning on each group of measurements (a session, the smaller loads, or the larger
    # loads) if most joint positions of the group were measured in no other group.
    numbers = checking.position_numbers(q)
    shared = (np.isin(numbers[marks == k], numbers[marks != k]) for k in range(len(names)))
    alone = ', '.join(name for name, flags in zip(names, shared) if np.mean(flags) < 0.5)
    if alone:
        yield (
            f'Most joint positions of {alone} were measured nowhere else: an error of the arm '
            f'there looks like {cause}; measure the same joint positions'
        )
