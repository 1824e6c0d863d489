# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""List parts of a URDF's chain that the import ignores, and parts that are probably mistakes."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from difflib import get_close_matches

import numpy as np

from ...errors import Fault
from ..file.parts.quantities import Kind, unit_doubt
from ..file.text.entries import choice, did_you_mean, meant_by
from ..file.text.fault_report import MAX_FAULTS, quoted
from .chain import UrdfChain
from .document import XmlElement, listed_names
from .elements import VERSIONS
from .joints import ATTRIBUTES, SINCE
from .quantity import ROUND_OFF
from .tree import UrdfTree

# Matches two kinds of places in the generated robot file: a joint, and the table. A warning about
# a joint, or about the sum of the table's lengths, also applies to the URDF.
MAPPED_PLACES = re.compile(r'joints\[(\d+)\]|links$')
# A warning about an unknown XML element suggests a known element if the two names are similar: the
# similarity (difflib) is at least this. The value is the similarity of `axes` to `axis`.
SIMILARITY = 0.75
# The attributes of an `<origin>`, and whether their numbers are lengths or angles.
ORIGIN_KINDS: tuple[tuple[str, Kind], ...] = (('xyz', 'length'), ('rpy', 'angle'))


def chain_doubts(
    tree: UrdfTree, chain: UrdfChain, of_the_table: Sequence[Fault]
) -> tuple[Fault, ...]:
    """
    Return the warnings about a URDF chain. Equal warnings about several joints become one warning.

    Parameters
    ----------
    tree, chain
        The links and joints of the file; the chain.
    of_the_table
        The warnings about the robot file that was made from the chain. Warnings about units also
        apply to the URDF.
    """
    doubts: list[Fault] = []
    written = tree.root.attributes.get('version', tree.version)
    if written != tree.version:
        message = f'unknown version {quoted(written)}, read as {tree.version}{choice(VERSIONS)}'
        doubts.append(tree.root.fault(message, 'unknown-name'))
    for joint in chain.joints:
        doubts += _of_joint(joint.element, tree.version)
        doubts += [joint.limits.doubt] if joint.limits.doubt else []
    for doubt in of_the_table:
        if part := MAPPED_PLACES.match(doubt.where):
            element = tree.joints[chain.variables[int(part[1])].name] if part[1] else tree.root
            doubts.append(element.fault(_in_urdf(doubt.message), doubt.code))
    alike: dict[str, list[Fault]] = {}
    for doubt in doubts:
        alike.setdefault(doubt.message, []).append(doubt)
    return tuple(
        replace(first, message=f'{message} (and {len(more)} more like it)') if more else first
        for message, (first, *more) in list(alike.items())[:MAX_FAULTS]
    )


def chain_remarks(tree: UrdfTree, chain: UrdfChain, rounded: UrdfChain) -> tuple[str, ...]:
    """
    Return sentences about joint limits that a robot file cannot have, and about rounded angles.

    Parameters
    ----------
    tree, chain
        The links and joints of the file; the chain.
    rounded
        The chain after a second reading, in which angles and axes that look rounded were replaced
        by exact ones.
    """
    limits = {joint.name: joint.element.first('limit') for joint in chain.joints}
    rates = {'jerk', 'deceleration'} if tree.version >= SINCE['jerk'] else set()
    left_out = [name for name, limit in limits.items() if limit and rates & {*limit.attributes}]
    nearly = [
        joint.name
        for joint, other in zip(chain.joints, rounded.joints)
        if max(np.abs(joint.origin - other.origin).max(), np.abs(joint.axis - other.axis).max())
        > ROUND_OFF
    ]
    remarks = {
        'a robot file has no jerk, and of acceleration and deceleration the smaller one': left_out,
        'angles or axes are nearly parts of pi, which closed forms need; to round them, write '
        f'import --urdf {tree.root.file} --base {chain.base} --tip {chain.tip} --round-angles '
        '--out arm.yaml': nearly,
    }
    return tuple(f'{listed_names(names)}: {text}' for text, names in remarks.items() if names)


def _in_urdf(question: str) -> str:
    return f'{question.partition(" (then")[0]} (a URDF is in m and rad)'


def _of_joint(joint: XmlElement, version: str) -> Iterator[Fault]:
    for part in joint.children:
        known = ATTRIBUTES.get(part.tag, ())
        if known and part is not joint.first(part.tag):
            yield part.fault('only the first of several is read', 'duplicate-key')
            continue
        for name in part.attributes if known else ():
            since = SINCE.get(name, version)
            if name not in known:
                hint = f'{did_you_mean(meant_by(name, known))}{choice(known)}'
                message = f'unknown attribute {quoted(name)}, which is not read{hint}'
                yield part.fault(message, 'unknown-key')
            elif since > version:
                yield part.fault(
                    f'{name} is not read: it is of URDF {since}, and the file is of {version}; to '
                    f'use it, write <robot version="{since}">',
                    'newer-version',
                )
            elif name == 'quat_xyzw' and 'rpy' in part.attributes:
                message = 'rpy and quat_xyzw are the same rotation; rpy is read'
                yield part.fault(message, 'duplicate-key')
        for name, kind in ORIGIN_KINDS if part.tag == 'origin' else ():
            for value in map(float, part.attributes.get(name, '').split()):
                if doubt := unit_doubt(value, kind):
                    yield part.fault(_in_urdf(doubt), 'wrong-unit')
        for word in () if known else get_close_matches(part.tag[:60], ATTRIBUTES, 1, SIMILARITY):
            message = f'an unknown element, which is not read{did_you_mean(word)}'
            yield part.fault(message, 'unknown-key')
