"""The section `uncertainty` of a calibrated robot file: what the calibration left open."""

import numpy as np

from ...kernel import Floats
from ...kinematics.uncertainty.arm_errors import named_errors
from ...robot.file.parts.description import RobotDescription, Uncertainty
from ...robot.file.parts.parameters import GEARS, ArmParameter
from ...robot.robot import Robot
from ...typography import number_text
from .checking import ROUND_OFF
from .corrections import of_joints_alone
from .fitting import widened
from .identified_table import calibrated_errors
from .result import Calibration

# Digits of L: poses that are known far better than each number still are by its products.
DIGITS = 6
# Smaller shares of a row are written as zero.
NEGLIGIBLE = 1e-7
OF_JOINTS = {
    'encoder_noise': 'noise',
    'encoder_resolution': 'resolution',
    'backlash': 'backlash',
    'velocity_noise': 'velocity_noise',
}


def uncertainty_section(found: Calibration, robot: Robot, ends: bool) -> list[str]:
    """
    Return the lines of the section.

    Parameters
    ----------
    found
        The calibration.
    robot
        The arm as it is written.
    ends
        Whether base and tool are those of the measured poses: then they are among it.
    """
    description = robot.description
    lines = ['uncertainty:']
    joints = of_joints_alone(found.robot.description.uncertainty)
    if joints is not None:
        lines += _of_joints(joints, robot)
    noise = widened(found.noise, found.freedom)
    floor = [f'xyz: {_scaled(noise.position, False, description)}']
    if not found.positions:
        floor.append(f'rpy: {_scaled(noise.rotation, True, description)}')
    lines.append(f'  floor: {{{", ".join(floor)}}}  # what the fit leaves of each number')
    parameters, factor = named_factor(found, robot, ends)
    if parameters:
        lines.append('  covariance:  # of these numbers, L L^T: a row of L each')
    for k, (one, row) in enumerate(zip(parameters, factor)):
        least = NEGLIGIBLE * float(np.linalg.norm(row))
        numbers = (x if abs(x) > least else 0.0 for x in row[: k + 1].tolist())
        texts = (
            number_text(float(f'{x:.{DIGITS}g}'))
            if one.group == GEARS
            else _scaled(x, one.angle, description)
            for x in numbers
        )
        lines.append(f'    {one.name}: [{", ".join(texts)}]')
    return lines if len(lines) > 1 else []


def named_factor(
    found: Calibration, robot: Robot, ends: bool
) -> tuple[tuple[ArmParameter, ...], Floats]:
    """
    Return numbers of a calibrated table, and L of their covariance L L^T, lower triangular.

    The corrections of a calibration are those of the nominal table. Nearly all of them are numbers
    of the calibrated one, if in other rows; what turns a row of two matrices is made of several.
    """
    errors, known = calibrated_errors(robot, found, ends), named_errors(robot)
    made_of = np.zeros((len(known.frames), len(errors.frames)))
    for column, (frame, screw, gear) in enumerate(zip(errors.frames, errors.screws, errors.gears)):
        there = (known.gears == gear) & (known.frames == frame)
        same = there & (np.abs(known.screws - screw).max(axis=1) < ROUND_OFF)
        free = np.flatnonzero(same & ~np.any(made_of, axis=1))
        if len(free):
            made_of[free[0], column] = 1.0
        else:
            own = np.flatnonzero(there)
            made_of[own, column] = np.linalg.lstsq(known.screws[own].T, screw, rcond=None)[0]
    factor = made_of @ errors.factor
    # A gear has a row for each screw of its joint, which are alike.
    _, first = np.unique(known.of, return_index=True)
    rows = first[np.any(made_of[first], axis=1)]
    triangle = np.linalg.qr(factor[rows].T, mode='r')
    signs = np.where(np.diag(triangle) < 0.0, -1.0, 1.0)
    return tuple(known.parameters[known.of[k]] for k in rows), (signs[:, None] * triangle).T


def _scaled(value: float, angle: bool, description: RobotDescription) -> str:
    # In the file's units, with few digits.
    unit = description.radians if angle else description.metres
    return number_text(float(f'{value / unit:.{DIGITS}g}'))


def _of_joints(joints: Uncertainty, robot: Robot) -> list[str]:
    lines = []
    for key, name in OF_JOINTS.items():
        values = getattr(joints, name)
        if values is not None and any(values):
            texts = (
                _scaled(value, not slides, robot.description)
                for value, slides in zip(values, robot.prismatic)
            )
            lines.append(f'  {key}: [{", ".join(texts)}]')
    return lines
