"""A joint of a URDF: its type, origin, axis, limits, and what it mimics."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...errors import Fault
from ...kernel import Floats
from ...rigid_motion import pose_of
from ...robot.file.text.fault_report import quoted
from .document import XmlElement
from .elements import UNLIMITED

NUMBER = re.compile(r'[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?')
INFINITE = re.compile(r'[-+]?inf(?:inity)?', re.IGNORECASE)
MOVING = ('revolute', 'continuous', 'prismatic')
# No robot file can express these, such as that of a mobile base.
WHY_NOT = {
    'floating': 'a floating joint moves in six ways at once: begin the chain below it',
    'planar': 'a planar joint moves in three ways at once: begin the chain below it',
}
# An axis shorter than this is not a direction but a mistake.
SHORTEST_AXIS = 1e-6
# No joint goes so far (rad or m): such limits stand for none.
ENDLESS = 1e4

Angle = Callable[[str], float]


class JointLimits(NamedTuple):
    """
    The limits of a joint, in rad or m; infinite if there is none.

    Attributes
    ----------
    doubt
        What is in the file and cannot be meant; None where there is nothing to doubt.
    """

    lower: float
    upper: float
    velocity: float
    doubt: Fault | None = None


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """
    One joint, in rad and m.

    Parameters
    ----------
    type
        `fixed`, `revolute`, `continuous` or `prismatic`.
    origin : shape (4, 4)
        Of the child in the parent at position 0.
    axis : shape (3,)
        Unit vector in the child's frame.
    mimics
        The joint it follows, or empty: its position is multiplier times that one's plus offset.
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


def read_joint(element: XmlElement, angle: Angle = float) -> UrdfJoint:
    """
    Return a joint, all of it checked.

    Parameters
    ----------
    element
        `<joint>`.
    angle
        Converts the text of an angle of `<origin rpy>` to rad.

    Raises
    ------
    UrdfError
        Its type is no joint of an arm, or an attribute is no number.
    """
    kind = element.attributes.get('type', '')
    if kind not in (*MOVING, 'fixed'):
        why = WHY_NOT.get(kind, f'its type is {quoted(kind)}')
        element.refuse(f'{why} (accepted: {", ".join(MOVING)}, fixed)')
    mimic = None if kind == 'fixed' else element.first('mimic')
    followed = '' if mimic is None else mimic.attributes.get('joint', '')
    if mimic is not None and not followed:
        mimic.refuse('it does not say which joint="..." to mimic')
    return UrdfJoint(
        element=element,
        name=element.attributes['name'],
        type=kind,
        origin=_origin(element, angle),
        axis=_axis(element) if kind in MOVING else np.array([1.0, 0.0, 0.0]),
        limits=_limits(element, kind),
        mimics=followed,
        multiplier=_number(mimic, 'multiplier', 1.0),
        offset=_number(mimic, 'offset', 0.0),
    )


def _origin(element: XmlElement, angle: Angle) -> Floats:
    origin = element.first('origin')
    if origin is None:
        return np.eye(4)
    x, y, z = _three(origin, 'xyz', '0 0 0', float)
    roll, pitch, yaw = _three(origin, 'rpy', '0 0 0', angle)
    return pose_of((x, y, z), (roll, pitch, yaw))


def _axis(element: XmlElement) -> Floats:
    axis = element.first('axis')
    direction = np.array([1.0, 0.0, 0.0])
    if axis is not None:
        direction = np.array(_three(axis, 'xyz', '1 0 0', float))
        length = float(np.linalg.norm(direction))
        if length < SHORTEST_AXIS:
            axis.refuse(f'xyz={quoted(axis.attributes.get("xyz", ""))} has no direction')
        # A vector that is a unit vector up to its last bits stays as it is written.
        if abs(length - 1.0) > 1e-15:
            direction = direction / length
    return direction


def _limits(element: XmlElement, kind: str) -> JointLimits:
    limit = element.first('limit')
    velocity = _number(limit, 'velocity', 0.0)
    if not 0.0 < velocity < UNLIMITED:
        velocity = math.inf  # many files have 0 for an unknown velocity
    if kind not in ('revolute', 'prismatic'):
        return JointLimits(-math.inf, math.inf, velocity)
    if limit is None:
        other = ", or type='continuous'" if kind == 'revolute' else ''
        element.refuse(f'a {kind} joint needs <limit lower="..." upper="..."/>{other}')
    lower, upper = _number(limit, 'lower', 0.0), _number(limit, 'upper', 0.0)
    doubt = None
    if lower == upper == 0.0:
        doubt = limit.fault('limits 0 and 0 are taken as none')
        lower, upper = -math.inf, math.inf
    elif not lower < upper and element.first('mimic') is None:
        limit.refuse(
            f'the lower limit must be below the upper one, not {lower:g} and {upper:g} '
            "(type='fixed' for a joint that does not move)"
        )
    elif any(ENDLESS <= abs(end) < UNLIMITED for end in (lower, upper)):
        doubt = limit.fault(
            f'limits {lower:.9g} and {upper:.9g} are farther than any joint goes: '
            f'what is beyond {ENDLESS:g} is taken as none'
        )
    return JointLimits(
        lower if lower > -ENDLESS else -math.inf,
        upper if upper < ENDLESS else math.inf,
        velocity,
        doubt,
    )


def _number(element: XmlElement | None, attribute: str, default: float) -> float:
    text = None if element is None else element.attributes.get(attribute)
    if element is None or text is None:
        return default
    if attribute in ('lower', 'upper', 'velocity') and INFINITE.fullmatch(text.strip()):
        return float(text)
    return _value(element, attribute, text.strip(), float)


def _value(element: XmlElement, attribute: str, text: str, worth: Angle) -> float:
    if '$' in text:
        element.refuse(f'{attribute}={quoted(text)} is xacro: expand the file first')
    if not NUMBER.fullmatch(text) or not abs(float(text)) <= UNLIMITED:
        if attribute in ('lower', 'upper', 'velocity') and NUMBER.fullmatch(text):
            return math.copysign(UNLIMITED, float(text))
        element.refuse(f'{attribute}: {quoted(text)} is not a number (at most {UNLIMITED:g})')
    return worth(text)


def _three(element: XmlElement, attribute: str, default: str, worth: Angle) -> list[float]:
    text = element.attributes.get(attribute, default)
    words = text.split()
    separated = ' '.join(text.replace(',', ' ').split())
    if ',' in text and len(separated.split()) == 3:
        element.refuse(
            f'{attribute}: {quoted(text)} has commas between its numbers: '
            f'write {quoted(separated)}'
        )
    if len(words) != 3 and '$' not in text:
        element.refuse(f'{attribute}: expected three numbers, not {quoted(text)}')
    return [_value(element, attribute, word, worth) for word in words]
