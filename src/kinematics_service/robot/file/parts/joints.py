# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the joints of a robot file: names, variables, types and limits."""

import math
from collections.abc import Sequence
from typing import NamedTuple, get_args

from ..text.entries import checked, checked_list
from ..text.expression_syntax import IDENTIFIER, why_no_name
from ..text.fault_report import Place, number, quoted
from ..text.yaml_document import ScalarNode, Yaml
from .description import JointDescription, JointType
from .quantities import DEGREES, INFINITE, KIND_OF, RADIANS, Quantities
from .schema import JointEntry

MAX_JOINTS = 128  # limits the size of Jacobian messages, which have a column for each joint
# Warn of a joint velocity above this limit (rad/s or m/s), because such a number is probably in
# another unit.
FASTEST_JOINT = 100.0
NOUN = 'a list of joints, {name, type, limits}'


class JointHead(NamedTuple):
    """
    The names and the type of a joint, which the reader needs before it reads expressions.
    Expressions in the file contain the names of joints.

    Attributes
    ----------
    entry
        The entry in the list of joints.
    type, variable
        The type, and the name of the joint in expressions; None if the value has a fault.
    hidden
        If the joint's entry has faults: all words in the entry that may be the name of the joint
        in expressions. Otherwise empty.
    """

    entry: JointEntry
    type: JointType | None
    variable: str | None
    hidden: frozenset[str]


def read_joint_heads(data: Yaml, constants: Sequence[str], at: Place) -> list[JointHead]:
    """Read the names and types in the list of joints, and report the faults of each joint."""
    items = checked_list(data, at, NOUN)
    if data == []:
        at.fault('at least one joint is needed', 'empty')
    if len(items) > MAX_JOINTS:
        at.fault(
            f'{len(items)} joints (at most {MAX_JOINTS}, because each message has a Jacobian '
            'with a column for each joint)',
            'too-many',
        )
        items = []
    entries = [checked(JointEntry, item, at[index]) for index, item in enumerate(items)]
    names = [entry.name for entry in entries]
    variables: list[str | None] = []
    heads = []
    for index, (item, entry) in enumerate(zip(items, entries)):
        first = names.index(entry.name)
        if entry.name is not None:
            _check_name(entry.name, first, index, at[index, 'name'])
        variable = None
        if entry.name is None or first == index or entry.variable is not None:
            variable = _variable(entry, variables, constants, at[index])
        variables.append(variable)
        joint_type = next((name for name in get_args(JointType) if name == entry.type), None)
        given = item if isinstance(item, dict) else {}
        hidden = _words(given)
        if variable and joint_type and given.keys() <= JointEntry.checks.keys():
            hidden = frozenset()
        heads.append(JointHead(entry, joint_type, variable, hidden))
    return heads


def _words(given: dict[str, Yaml]) -> frozenset[str]:
    # Return the words in a joint's entry that may be the name of the joint in expressions. If a
    # key is misspelled, the value of any key may be the name.
    return frozenset(
        value.text
        for key, value in given.items()
        if isinstance(value, ScalarNode) and key != 'type' and IDENTIFIER.fullmatch(value.text)
    )


def read_joint(head: JointHead, at: Place, quantities: Quantities) -> JointDescription | None:
    """Read the numbers of a joint in SI units; return None if its entry has faults."""
    entry, joint_type, variable, _ = head
    if joint_type is None:
        return None
    lower, upper = _limits(entry, joint_type, at['limits'], quantities)
    velocity, acceleration = (
        quantities.above_zero(getattr(entry, key), KIND_OF[joint_type], at[key]) or math.inf
        for key in ('velocity', 'acceleration')
    )
    if FASTEST_JOINT < velocity < math.inf:
        message = f'{number(velocity)} per second is very fast: which unit?'
        at['velocity'].warn(message, 'wrong-unit')
    if entry.name is None or variable is None or not at.intact:
        return None
    return JointDescription(
        *(entry.name, variable, joint_type, lower, upper, velocity, bool(entry.unused)),
        acceleration,
    )


def _check_name(name: str, first: int, index: int, at: Place) -> None:
    if ',' in name:
        # Refuse a comma, because commas separate the joint names in the label of a Jacobian
        # message.
        at.fault(f'{quoted(name)} has a comma; write another name', 'wrong-name')
    if first < index:
        at.fault(f'{quoted(name)} is already the name of joints[{first}]', 'duplicate-name')


def _variable(
    entry: JointEntry, earlier: Sequence[str | None], constants: Sequence[str], at: Place
) -> str | None:
    variable = entry.variable or entry.name
    if variable is None:
        return None
    key = 'variable' if entry.variable else 'name'
    if not entry.variable and not IDENTIFIER.fullmatch(variable):
        message = f"{quoted(variable)} is not a name for expressions; add 'variable: q1'"
        code = 'wrong-name'
    elif reason := why_no_name(variable):
        advice = '' if entry.variable else "; add 'variable', its name in expressions"
        message, code = f'{quoted(variable)} {reason.message}{advice}', reason.code
    elif variable in constants:
        message, code = f'{quoted(variable)} is also the name of a constant', 'duplicate-name'
    elif variable in earlier:
        message = (
            f'{quoted(variable)} is already the variable of joints[{earlier.index(variable)}]'
        )
        code = 'duplicate-name'
    else:
        return variable
    at[key].fault(message, code)
    return None


def _limits(
    entry: JointEntry, joint_type: JointType, at: Place, quantities: Quantities
) -> tuple[float, float]:
    if entry.limits is None:
        return -math.inf, math.inf
    lower, upper = (
        float(text.replace('.', ''))
        if text is not None and INFINITE.fullmatch(text)
        else quantities.fixed(text, KIND_OF[joint_type], at[index], usual=False)
        for index, text in enumerate(entry.limits)
    )
    if lower is None or upper is None:
        return -math.inf, math.inf
    if not lower < upper:
        texts = ', '.join(map(str, entry.limits))
        at.fault(f'the lower limit must be below the upper one, not [{texts}]', 'wrong-order')
    else:
        _warn_of_limits(lower, upper, joint_type, at, quantities)
    return lower, upper


def _warn_of_limits(
    lower: float, upper: float, joint_type: JointType, at: Place, quantities: Quantities
) -> None:
    largest = max((abs(end) for end in (lower, upper) if math.isfinite(end)), default=0.0)
    if largest == 0.0:
        return
    units = quantities.units
    if joint_type == 'prismatic':
        quantities.warn_of_length(largest, 0.002, 10.0, 'a stroke to {}', at)
    elif joint_type == 'revolute':
        turns = largest / (2.0 * math.pi)
        # Accept limits up to 4 turns in rad, because a wrist may turn several times. Warn of a
        # whole number of rad between 1 and 4 turns, such as 10 or 20 rad, because it is probably
        # in degrees.
        if units.angle == 'rad' and (turns > 4.0 or (turns > 1.0 and largest.is_integer())):
            at.warn(f'limits of {number(turns)} turns: {DEGREES}', 'wrong-unit')
        if units.angle == 'deg' and largest <= math.radians(2.0 * math.pi + 0.01):
            at.warn(f'limits within {math.degrees(largest):.3g} deg: {RADIANS}', 'wrong-unit')
