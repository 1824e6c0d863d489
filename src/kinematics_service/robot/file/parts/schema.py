# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define the schema of a robot file: the keys of each part, and the type of each value.

Each part of the file is read into an `Entry` object. If a key is missing, or its value has a
fault, the attribute for the key is None.
"""

from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any

from ..text import entries
from ..text.yaml_document import Yaml
from .convention_table import CONVENTIONS, QUANTITIES
from .measure_table import MEASURES

# Maps of wrong words to accepted words. Textbooks, URDF and other programs use the wrong words. If
# a file has such a word, the error suggests the accepted word.
CONVENTION_WORDS = {
    word: convention.name for convention in CONVENTIONS.values() for word in convention.also
}
JOINT_TYPES = entries.called(
    revolute='r rot rotary rotational rotation rotating hinge pin continuous turning',
    prismatic='p slide slider sliding linear translational translation trans telescopic',
    helical='h screw',
)
ANGLES = entries.called(deg='degree degrees', rad='radian radians')
LENGTHS = entries.called(
    m='metre metres meter meters si', mm='millimetre millimetres millimeter millimeters'
)
POSE_KEYS = entries.called(
    xyz='position pos translation origin p', rpy='orientation rotation rot euler roll_pitch_yaw'
)
ROWS = 'link frame after after_row'
POSITIONS = 'joints angles positions'


class RobotEntry(entries.Entry):
    """
    The keys at the top level of a robot file. Other entry classes of this module have the keys of
    inner mappings, such as a point or a loop.
    """

    noun = 'a robot file'
    required = ('robot', 'convention', 'joints', 'links')
    also = entries.called(
        robot='name',
        source='reference',
        links='dh table rows dh_table dh_parameters',
        known_poses='poses',
        tool='end_effector ee tcp',
        uncertainty='errors accuracy covariance',
    )

    robot: entries.Word
    source: entries.Citation
    convention: Annotated[str | None, entries.one_of(*CONVENTIONS, also=CONVENTION_WORDS)]
    units: Yaml
    constants: Yaml
    joints: Yaml
    links: Yaml
    base: Yaml
    tool: Yaml
    points: Yaml
    loops: Yaml
    singularity: Yaml
    speed_limits: Yaml
    uncertainty: Yaml
    known_poses: Yaml
    tolerance: Yaml


class CellEntry(entries.Entry):
    """The file of a cell: several arms in one frame."""

    noun = 'a cell'
    required = ('cell', 'arms')
    also = entries.called(cell='name', arms='robots', common='shared', frame='floor world base')

    cell: entries.Word
    frame: entries.Word
    units: Yaml
    common: entries.Words
    arms: Yaml


class UnitsEntry(entries.Entry):
    """The units of the angles and lengths in the file."""

    noun = 'units'

    angle: Annotated[str | None, entries.one_of('rad', 'deg', also=ANGLES)]
    length: Annotated[str | None, entries.one_of('m', 'mm', also=LENGTHS)]


class JointEntry(entries.Entry):
    """One actuated joint."""

    noun = 'a joint'
    required = ('name', 'type')
    also = entries.called(
        variable='var symbol q',
        type='kind joint_type',
        limits='lower upper min max range qlim q_min q_max lower_limit upper_limit',
        velocity='speed vel max_speed max_velocity',
        acceleration='acc accel max_acceleration',
    )

    name: entries.Word
    variable: entries.Word
    type: Annotated[
        str | None, entries.one_of('revolute', 'prismatic', 'helical', also=JOINT_TYPES)
    ]
    limits: entries.Pair
    velocity: entries.Number
    acceleration: entries.Number
    unused: entries.Truth


def _entry_of(noun: str, kinds: Mapping[str, Any], also: Mapping[str, str]) -> type[entries.Entry]:
    # Return an entry class with the keys of `kinds`, which depend on the robot file. All keys are
    # required.
    class FileEntry(entries.Entry):
        __annotations__ = dict(kinds)
        required = tuple(kinds)

    FileEntry.noun, FileEntry.also = noun, also
    return FileEntry


@cache
def dh_row_entry(quantities: tuple[str, ...]) -> type[entries.Entry]:
    """Return the entry class for a table row that has exactly the keys `quantities`."""
    other_words = {'length': 'a', 'twist': 'alpha', 's': 'd', 'th': 'theta', 'angle': 'theta'}
    also = {word: name for word, name in other_words.items() if name in quantities}
    return _entry_of('a row of the table', dict.fromkeys(quantities, entries.Number), also)


DhRowEntry = dh_row_entry(QUANTITIES)


class ShapeRowEntry(entries.Entry):
    """One row of a Sheth-Uicker table."""

    noun = 'a row of the table'
    also = {'input': 'in', 'output': 'out'}

    in_: Yaml
    joint: entries.Formula
    out: Yaml


class PoseEntry(entries.Entry):
    """A constant pose that is given by `xyz` and `rpy`, not by a matrix."""

    noun = 'a pose'
    also = POSE_KEYS

    xyz: entries.Triple
    rpy: entries.Triple


class CellArmEntry(PoseEntry):
    """An arm of a cell, and the pose of its base."""

    noun = 'an arm of a cell'
    required = ('robot',)
    also = {**POSE_KEYS, **entries.called(robot='file name', joint_prefix='prefix')}

    robot: entries.Word
    joint_prefix: entries.Word


class PlacementEntry(PoseEntry):
    """The pose of the base or the tool."""

    noun = 'a placement'
    also = {**POSE_KEYS, **entries.called(frame='name link')}

    frame: entries.Word


class PointEntry(PoseEntry):
    """A named point of the arm."""

    noun = 'a point'
    required = ('row',)
    also = {**POSE_KEYS, **entries.called(row=ROWS)}

    row: entries.Whole


class LoopEntry(entries.Entry):
    """A closed loop: a second chain that begins and ends at rows of the table."""

    noun = 'a loop'
    required = ('name', 'passive', 'links', 'meets', 'rows', 'assembled')
    also = entries.called(
        from_='start begins parts',
        meets='to end ends closes',
        links='chain table',
        rows='coincide components equal',
        assembled='assembly at closed',
    )

    name: entries.Word
    passive: Yaml
    from_: Yaml
    links: Yaml
    meets: Yaml
    rows: entries.Words
    assembled: Yaml


class PassiveEntry(entries.Entry):
    """A passive joint: it has no motor, and the closed loop determines its position."""

    noun = 'a passive joint'
    required = ('name',)
    also = {'kind': 'type', 'joint_type': 'type'}

    name: entries.Word
    type: Annotated[str | None, entries.one_of('revolute', 'prismatic', also=JOINT_TYPES)]


class LoopEndEntry(PoseEntry):
    """A frame on the arm at which the second chain of a closed loop begins or ends."""

    noun = 'an end of a loop'
    also = {**POSE_KEYS, **entries.called(row=ROWS)}

    row: entries.Whole
    point: entries.Word


@cache
def assembled_entry(passive: tuple[str, ...]) -> type[entries.Entry]:
    """
    Return the entry class for `assembled`, which has the key `q` and a key for each passive joint.
    """
    kinds = {'q': entries.Numbers, **dict.fromkeys(passive, entries.Number)}
    return _entry_of('an assembly', kinds, entries.called(q=POSITIONS))


class ToleranceEntry(entries.Entry):
    """The tolerance of a known pose."""

    noun = 'a tolerance'

    xyz: entries.Number
    rpy: entries.Number


class KnownPoseEntry(PoseEntry):
    """A joint vector and the pose of the tool."""

    noun = 'a known pose'
    required = ('q', 'xyz')
    also = {**POSE_KEYS, **entries.called(q=POSITIONS)}

    q: entries.Numbers
    tolerance: Yaml


class FactorEntry(entries.Entry):
    """A singular factor: a named function of q whose zeros are singular poses."""

    noun = 'a singular factor'
    required = ('name', 'expression')

    name: entries.Word
    expression: entries.Number
    approximate: entries.Truth


class SingularityEntry(entries.Entry):
    """The task, the measure of singularity, and its thresholds."""

    noun = 'singularity'

    task: entries.Words
    length: entries.Number
    measure: Annotated[str | None, entries.one_of(*MEASURES)]
    warn: entries.Number
    stop: entries.Number
    factors: Yaml


class UncertaintyEntry(entries.Entry):
    """The uncertainty of joints and table: standard deviations, encoder steps and backlash."""

    noun = 'uncertainty'
    also = entries.called(
        encoder_noise='noise joint_noise encoders',
        encoder_resolution='resolution step',
        backlash='play',
        velocity_noise='velocity',
        floor='unmodelled',
    )

    encoder_noise: Yaml
    encoder_resolution: Yaml
    backlash: Yaml
    velocity_noise: Yaml
    parameters: Yaml
    covariance: Yaml
    floor: Yaml


class FloorEntry(ToleranceEntry):
    """
    Standard deviations of the tool's position and rotation from causes other than joints and
    table.
    """

    noun = 'a floor'
    also = POSE_KEYS


class SpeedLimitEntry(entries.Entry):
    """The largest speed of the tool or of a point."""

    noun = 'a speed limit'
    also = entries.called(linear='speed velocity translation', angular='turning rotation')

    linear: entries.Number
    angular: entries.Number
    reduced: entries.Number


class TableToleranceEntry(entries.Entry):
    """Standard deviations of the numbers of the table."""

    noun = 'a tolerance of the table'
    also = entries.called(
        length='lengths xyz position', angle='angles rpy rotation', gear='gears ratio ratios'
    )

    length: entries.Number
    angle: entries.Number
    gear: entries.Number
    of: Yaml
