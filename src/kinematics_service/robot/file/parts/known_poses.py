"""The known poses of a robot file: where the tool is, by the file's own source."""

import math
import re
from collections.abc import Mapping, Sequence

from ..text.entries import checked, checked_list
from ..text.fault_report import Place, number
from ..text.yaml_document import Yaml
from .description import JointDescription, KnownPose, Rounding
from .motions import pose_motion
from .quantities import KIND_OF, LONG, TURN, Kind, Quantities, Units
from .schema import KnownPoseEntry, ToleranceEntry

EXACT = 1e-6  # m and rad: what a datasheet with six digits can promise
ROUND_OFF = 1e-9
DECIMALS = re.compile(r'[-+]?\d*\.(\d+)')
# A number of fewer digits is as likely exact as rounded (m or rad): 0.45 m, 22.5 deg are exact.
COARSEST = 1e-3
# Larger ones are hardly in m and rad.
USUAL: Mapping[Kind, float] = {'length': LONG, 'angle': TURN}


def read_known_poses(
    data: Yaml, joints: Sequence[JointDescription], quantities: Quantities
) -> tuple[KnownPose, ...]:
    """
    Return the poses in SI units, without those that have faults.

    Parameters
    ----------
    data
        The list as the file has it; None where there is none.
    joints
        Their descriptions; fewer where some have faults, and then no q is compared with limits.
    quantities
        What the names in expressions mean.
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
    tolerance = ToleranceEntry({})
    if entry.tolerance is not None:
        tolerance = checked(ToleranceEntry, entry.tolerance, beside)
    xyz = quantities.above_zero(tolerance.xyz, 'length', beside['xyz']) or EXACT
    rpy = quantities.above_zero(tolerance.rpy, 'angle', beside['rpy']) or EXACT
    if entry.rpy is None:
        if tolerance.rpy is not None and isinstance(data, dict) and 'rpy' not in data:
            beside['rpy'].fault('the pose has no rpy that it could be of')
        rpy = math.inf
    if motion is None or not at.intact or len(q) != len(types):
        return None
    if tolerance.xyz is not None or tolerance.rpy is not None:
        return KnownPose(q, motion, xyz, rpy)
    kinds = [KIND_OF[joint_type or 'revolute'] for joint_type in types]
    halves = {
        kind: _half_digit([t for t, one in zip(entry.q or (), kinds) if one == kind], kind, units)
        for kind in KIND_OF.values()
    }
    rounding = Rounding(
        tuple(halves[kind] for kind in kinds),
        _half_digit(entry.xyz or (), 'length', units),
        _half_digit(entry.rpy or (), 'angle', units),
    )
    return KnownPose(q, motion, xyz, rpy, rounding)


def _half_digit(texts: Sequence[str | None], kind: Kind, units: Units) -> float:
    # In m or rad. The number with most digits counts: of others zeros may have been left out.
    decimals = [found for text in texts if (found := DECIMALS.fullmatch(text or ''))]
    most = max((len(found[1]) for found in decimals), default=0)
    if any(abs(float(found[0])) > USUAL[kind] for found in decimals):
        units = Units('deg', 'mm')  # whatever the file says
    half = units.to_si(0.5 * 10.0**-most, kind)
    return half if most and half <= COARSEST else 0.0


def _remark_of_limits(q: Sequence[float], joints: Sequence[JointDescription], at: Place) -> None:
    for index, (value, joint) in enumerate(zip(q, joints)):
        if not joint.lower - ROUND_OFF <= value <= joint.upper + ROUND_OFF:
            limits = f'[{number(joint.lower)}, {number(joint.upper)}]'
            at[index].remark(f'{number(value)} lies outside the limits {limits} of {joint.name!r}')
