# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read and check a joint of a URDF: its type, origin, axis, limits and `<mimic>`."""

import math
import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...errors import Fault
from ...kernel import Floats
from ...rigid_motion import apart, exact_rpy, pose_of, rotation_of_quaternion
from ..file.text.fault_report import quoted
from .document import XmlElement
from .elements import UNLIMITED
from .quantity import CAD_NOISE, ROUNDED, as_rounded_part_of_pi, part_of_pi

NUMBER = re.compile(r'[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?')
INFINITE = re.compile(r'[-+]?inf(?:inity)?', re.IGNORECASE)
MOVING = ('revolute', 'continuous', 'prismatic')
# Joint types that a robot file cannot express. Each type has the reason that a message gives.
WHY_NOT = {
    'floating': 'a floating joint moves in six ways at once; begin the chain below it',
    'planar': 'a planar joint moves in three ways at once; begin the chain below it',
}
# Refuse an axis vector shorter than this, because its direction is only round-off.
MIN_AXIS_LENGTH = 1e-6
# A limit counts as no limit if its absolute value is above this, rad or m.
MAX_LIMIT = 1e4
RATES = ('velocity', 'acceleration', 'deceleration')
# For each element of a joint, the attributes that the import reads. SINCE has the version of URDF
# that introduced an attribute; other attributes are in all versions (README of urdfdom).
ATTRIBUTES = {
    'origin': ('xyz', 'rpy', 'quat_xyzw'),
    'axis': ('xyz',),
    'limit': ('lower', 'upper', 'effort', *RATES, 'jerk'),
    'mimic': ('joint', 'multiplier', 'offset'),
}
SINCE = {'quat_xyzw': '1.1', 'acceleration': '1.2', 'deceleration': '1.2', 'jerk': '1.2'}
INFINITE_ATTRIBUTES = ('lower', 'upper', *RATES)


class JointLimits(NamedTuple):
    """
    The limits of a joint, in rad or m and s; infinite for no limit.

    Attributes
    ----------
    acceleration
        The smaller of the limits of acceleration and deceleration.
    doubt
        A warning about limits that are probably a mistake; None for plausible limits.
    """

    lower: float
    upper: float
    velocity: float
    acceleration: float
    doubt: Fault | None = None


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """
    One joint with the values in the URDF file, in rad and m.

    Parameters
    ----------
    type
        `fixed`, `revolute`, `continuous` or `prismatic`.
    origin : shape (4, 4)
        Pose of the child link in the parent link, at position 0.
    axis : shape (3,)
        The axis as a unit vector in the child's frame.
    mimics
        The name of the joint that this joint mimics, or ''. The position of a mimic joint is
        multiplier * (position of the joint `mimics`) + offset.
    """

    element: XmlElement
    name: str
    type: str
    origin: Floats
    axis: Floats
    limits: JointLimits
    mimics: str
    multiplier: float
    offset: float


def read_joint(element: XmlElement, version: str, rounds: bool = False) -> UrdfJoint:
    """
    Read a joint of a URDF, and check all its values.

    Parameters
    ----------
    element
        The element `<joint>`.
    version
        The version of URDF that the file has.
    rounds
        Whether exact angles and axes replace angles and axes that look rounded.

    Raises
    ------
    UrdfError
        A robot file cannot express the type, an attribute is not a number, or `rpy` and
        `quat_xyzw` are different rotations.
    """
    kind = element.attributes.get('type', '')
    if kind not in (*MOVING, 'fixed'):
        reason = WHY_NOT.get(kind, f'unknown type {quoted(kind)}')
        code = 'unsupported' if kind in WHY_NOT else 'unknown-name'
        element.refuse(f'{reason} (accepted: {", ".join(MOVING)}, fixed)', code)
    mimic = None if kind == 'fixed' else element.first('mimic')
    followed = '' if mimic is None else mimic.attributes.get('joint', '')
    if mimic is not None and not followed:
        mimic.refuse('the attribute joint="..." is missing', 'missing-key')
    return UrdfJoint(
        element=element,
        name=element.attributes['name'],
        type=kind,
        origin=_origin(element, version, rounds),
        axis=_axis(element, rounds) if kind in MOVING else np.array([1.0, 0.0, 0.0]),
        limits=_limits(element, kind, version),
        mimics=followed,
        multiplier=_number(mimic, 'multiplier', 1.0),
        offset=_number(mimic, 'offset', 0.0),
    )


def _origin(element: XmlElement, version: str, rounds: bool) -> Floats:
    origin = element.first('origin')
    if origin is None:
        return np.eye(4)
    x, y, z = _numbers(origin, 'xyz', '0 0 0')
    roll, pitch, yaw = _numbers(origin, 'rpy', '0 0 0', rounds)
    pose = pose_of((x, y, z), (roll, pitch, yaw))
    if 'quat_xyzw' not in origin.attributes:
        return pose
    quaternion = _numbers(origin, 'quat_xyzw', '', count=4)
    if not any(quaternion):
        origin.refuse('quat_xyzw: a quaternion of length 0 is not a rotation', 'not-a-rotation')
    roll, pitch, yaw = exact_rpy(rotation_of_quaternion(quaternion))
    if rounds:
        roll, pitch, yaw = map(part_of_pi, (roll, pitch, yaw))
    turned = pose_of((x, y, z), (roll, pitch, yaw))
    if version >= SINCE['quat_xyzw'] and 'rpy' not in origin.attributes:
        return turned
    if apart(pose, turned)[1] > ROUNDED:
        rpy = origin.attributes.get('rpy', '0 0 0 (not written)')
        origin.refuse(
            f'rpy {rpy} and quat_xyzw {origin.attributes["quat_xyzw"]} are two rotations; delete '
            'quat_xyzw, or delete rpy and write '
            f'<robot version="{SINCE["quat_xyzw"]}">',
            'conflict',
        )
    return pose


def _axis(element: XmlElement, rounds: bool) -> Floats:
    axis = element.first('axis')
    direction = np.array([1.0, 0.0, 0.0])
    if axis is not None:
        direction = np.array(_numbers(axis, 'xyz', '1 0 0'))
        if rounds:
            direction[np.abs(direction) < CAD_NOISE * np.abs(direction).max()] = 0.0
        length = float(np.linalg.norm(direction))
        if length < MIN_AXIS_LENGTH:
            xyz = quoted(axis.attributes.get('xyz', ''))
            axis.refuse(f'xyz={xyz} has no direction; write a unit vector', 'zero-axis')
        # Leave a vector unchanged if it is a unit vector up to round-off.
        if abs(length - 1.0) > 1e-15:
            direction = direction / length
    return direction


def _limits(element: XmlElement, kind: str, version: str) -> JointLimits:
    limit = element.first('limit')
    velocity, *both = (
        # A velocity or acceleration limit of 0 means no limit, because many files write 0 for an
        # unknown limit.
        rate if 0.0 < (rate := _number(limit, name, 0.0)) < UNLIMITED else math.inf
        for name in RATES
        if SINCE.get(name, version) <= version
    )
    rates = velocity, min(both, default=math.inf)
    if kind not in ('revolute', 'prismatic'):
        return JointLimits(-math.inf, math.inf, *rates)
    if limit is None:
        other = ", or type='continuous'" if kind == 'revolute' else ''
        message = f'a {kind} joint needs <limit lower="..." upper="..."/>{other}'
        element.refuse(message, 'missing-key')
    lower, upper = _number(limit, 'lower', 0.0), _number(limit, 'upper', 0.0)
    doubt = None
    if lower == upper == 0.0:
        doubt = limit.fault('limits 0 and 0 mean a joint without limits', 'no-limits')
        lower, upper = -math.inf, math.inf
    elif not lower < upper and element.first('mimic') is None:
        limit.refuse(
            f'the lower limit must be below the upper one, not {lower:g} and {upper:g} '
            "(type='fixed' for a joint that does not move)",
            'wrong-order',
        )
    elif any(MAX_LIMIT <= abs(end) < UNLIMITED for end in (lower, upper)):
        doubt = limit.fault(
            f'limits {lower:.9g} and {upper:.9g}: a limit beyond {MAX_LIMIT:g} means no limit',
            'no-limits',
        )
    return JointLimits(
        lower if lower > -MAX_LIMIT else -math.inf,
        upper if upper < MAX_LIMIT else math.inf,
        *rates,
        doubt,
    )


def _number(element: XmlElement | None, attribute: str, default: float) -> float:
    text = None if element is None else element.attributes.get(attribute)
    if element is None or text is None:
        return default
    if attribute in INFINITE_ATTRIBUTES and INFINITE.fullmatch(text.strip()):
        return float(text)
    return _value(element, attribute, text.strip())


def _value(element: XmlElement, attribute: str, text: str, rounds: bool = False) -> float:
    if '$' in text:
        message = f'{attribute}={quoted(text)} is xacro; expand the file first'
        element.refuse(f'{message} (xacro FILE > robot.urdf)', 'xacro')
    if not NUMBER.fullmatch(text) or not abs(float(text)) <= UNLIMITED:
        if attribute in INFINITE_ATTRIBUTES and NUMBER.fullmatch(text):
            return math.copysign(UNLIMITED, float(text))
        message = f'{attribute}: {quoted(text)} is not a number (at most {UNLIMITED:g})'
        element.refuse(message, 'not-a-number')
    return as_rounded_part_of_pi(text) if rounds else float(text)


def _numbers(
    element: XmlElement, attribute: str, default: str, rounds: bool = False, count: int = 3
) -> list[float]:
    text = element.attributes.get(attribute, default)
    words = text.split()
    separated = ' '.join(text.replace(',', ' ').split())
    if ',' in text and len(separated.split()) == count:
        element.refuse(
            f'{attribute}: {quoted(text)} has commas between its numbers; '
            f'write {quoted(separated)}',
            'decimal-comma',
        )
    if len(words) != count and '$' not in text:
        required = 'three' if count == 3 else 'four'
        message = f'{attribute}: expected {required} numbers, not {quoted(text)}'
        element.refuse(message, 'wrong-length')
    return [_value(element, attribute, word, rounds) for word in words]
