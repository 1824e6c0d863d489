# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the known poses of a robot file: tool poses at given q, from a datasheet or paper."""

import math
import re
from collections.abc import Sequence

from ..text.entries import checked, checked_list
from ..text.fault_report import Place, number
from ..text.yaml_document import Yaml
from .description import JointDescription, KnownPose, Rounding
from .motions import pose_motion
from .quantities import KIND_OF, Kind, Quantities, Units, unit_doubt
from .schema import KnownPoseEntry, ToleranceEntry

# Default tolerance of a known pose, m and rad. The value is one unit of the sixth decimal.
DEFAULT_TOLERANCE = 1e-6
# Joint positions that exceed a limit by less than this (rad or m) count as inside the limits.
LIMIT_TOLERANCE = 1e-9
DECIMALS = re.compile(r'[-+]?\d*\.(\d+)')
# A number in a known pose is taken as rounded if half a unit of its last digit is at most this, m
# or rad. For 0.4512 m, half a unit is 0.00005 m, so 0.4512 m is taken as rounded. For 0.45 m, half
# a unit is 0.005 m, so 0.45 m is taken as the exact value.
MAX_ROUNDING = 1e-3


def read_known_poses(
    data: Yaml, joints: Sequence[JointDescription], quantities: Quantities
) -> tuple[KnownPose, ...]:
    """
    Read the known poses in SI units; report faults, and leave out poses with faults.

    Parameters
    ----------
    data
        The value of the key `known_poses`; None if the file does not have the key.
    joints
        The joints whose entries have no fault. If a joint has a fault, `q` is not compared with
        the joint limits.
    quantities
        The meaning of the names in expressions.
    """
    if data is None:
        return ()
    at = quantities.top['known_poses']
    items = checked_list(data, at, 'a list of {q, xyz, rpy}')
    poses = [_known_pose(item, at[k], joints, quantities) for k, item in enumerate(items)]
    return tuple(pose for pose in poses if pose is not None)


def _known_pose(
    data: Yaml, at: Place, joints: Sequence[JointDescription], quantities: Quantities
) -> KnownPose | None:
    units, types, beside = quantities.units, quantities.types, at['tolerance']
    entry = checked(KnownPoseEntry, data, at)
    q = quantities.positions(entry.q, at['q'])
    if len(q) == len(joints):
        _remark_of_limits(q, joints, at['q'])
    motion = pose_motion(entry, at, quantities)
    given = {} if entry.tolerance is None else entry.tolerance
    tolerance = checked(ToleranceEntry, given, beside)
    xyz = quantities.above_zero(tolerance.xyz, 'length', beside['xyz']) or DEFAULT_TOLERANCE
    rpy = quantities.above_zero(tolerance.rpy, 'angle', beside['rpy']) or DEFAULT_TOLERANCE
    if entry.rpy is None:
        if tolerance.rpy is not None and isinstance(data, dict) and 'rpy' not in data:
            message = 'the pose has no rpy; write rpy, or delete this tolerance'
            beside['rpy'].fault(message, 'conflict')
        rpy = math.inf
    if motion is None or not at.intact or len(q) != len(types):
        return None
    if tolerance.xyz is not None or tolerance.rpy is not None:
        return KnownPose(q, motion, xyz, rpy)
    kinds = [KIND_OF[joint_type or 'revolute'] for joint_type in types]
    pairs = list(zip(entry.q or (), kinds))
    halves = {
        kind: _half_digit([text for text, joint_kind in pairs if joint_kind == kind], kind, units)
        for kind in KIND_OF.values()
    }
    rounding = Rounding(
        tuple(halves[kind] for kind in kinds),
        _half_digit(entry.xyz or (), 'length', units),
        _half_digit(entry.rpy or (), 'angle', units),
    )
    return KnownPose(q, motion, xyz, rpy, rounding)


def _half_digit(texts: Sequence[str | None], kind: Kind, units: Units) -> float:
    # Return the largest rounding error of the numbers in `texts`, m or rad: half a unit of the
    # last digit, or 0 if the numbers are taken as exact. The number with the most decimals gives
    # the last digit, because zeros at the end of other numbers may be omitted.
    matches = [match for text in texts if (match := DECIMALS.fullmatch(text or ''))]
    decimals = max((len(match[1]) for match in matches), default=0)
    if any(unit_doubt(float(match[0]), kind) for match in matches):
        units = Units('deg', 'mm')  # the number is implausible in rad or m, so assume deg and mm
    half = units.to_si(0.5 * 10.0**-decimals, kind)
    return half if decimals and half <= MAX_ROUNDING else 0.0


def _remark_of_limits(q: Sequence[float], joints: Sequence[JointDescription], at: Place) -> None:
    for index, (value, joint) in enumerate(zip(q, joints)):
        if not joint.lower - LIMIT_TOLERANCE <= value <= joint.upper + LIMIT_TOLERANCE:
            limits = f'[{number(joint.lower)}, {number(joint.upper)}]'
            at[index].remark(f'{number(value)} is outside the limits {limits} of {joint.name!r}')
