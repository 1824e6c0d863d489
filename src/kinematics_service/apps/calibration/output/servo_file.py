# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the calibration file of LeRobot for Feetech servos, and write it with corrected zeros."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

from ....errors import CalibrationError
from ...recordings.readers.joint_format import SERVO_TURN
from ..zeros import JointZero

# Largest homing offset that a servo holds (11 bits and a sign), ticks.
OFFSET_LIMIT = (1 << 11) - 1


def read_servos(file: Path, joints: Sequence[str]) -> dict[str, dict[str, int]]:
    """
    Read a calibration file of LeRobot, and return its entries by joint.

    Raises
    ------
    CalibrationError
        The file cannot be read, or has no homing offset of some joint.
    """
    try:
        content = json.loads(file.read_text(encoding='utf-8'))
        for name in joints:
            int(content[name]['homing_offset'])
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        raise CalibrationError(
            f'{file}: not a calibration of servos: {error!r}; give JSON with a homing_offset of '
            f'each of {", ".join(joints)}',
            code='unreadable',
        ) from None
    return dict(content)


def servos_text(servos: dict[str, dict[str, int]], zeros: Sequence[JointZero]) -> str:
    """
    Return the text of LeRobot's calibration file, with homing offsets corrected by the identified
    `zeros`.

    A servo reports its encoder minus the homing offset. The joint position is zero in the middle
    of range_min and range_max. The function changes only the homing offset, and keeps the range.

    Raises
    ------
    CalibrationError
        A homing offset would be larger than a servo can store.
    """
    changed = dict(servos)
    for zero in (zero for zero in zeros if zero.known and not zero.prismatic):
        servo = servos[zero.joint]
        sign = -1.0 if servo.get('drive_mode') else 1.0
        ticks = round(sign * zero.correction * SERVO_TURN / math.tau)
        moved = int(servo['homing_offset']) - ticks
        if abs(moved) > OFFSET_LIMIT:
            raise CalibrationError(
                f'{zero.joint}: its homing_offset would be {moved}, beyond {OFFSET_LIMIT}; '
                'mount its horn anew, or home the servo',
                code='out-of-range',
            )
        changed[zero.joint] = {**servo, 'homing_offset': moved}
    return json.dumps(changed, indent=4) + '\n'
