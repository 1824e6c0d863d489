"""
The shape of a robot file: which keys stand where, and which of them are texts, numbers, lists.

What is missing or has been refused is None in an entry.
"""

from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any

from ..text.entries import (
    Citation,
    Entry,
    Formula,
    Number,
    Numbers,
    Pair,
    Triple,
    Truth,
    Whole,
    Word,
    Words,
    called,
    one_of,
)
from ..text.yaml_document import Yaml
from .convention_table import CONVENTIONS, QUANTITIES
from .measure_table import MEASURES

# Other words for the accepted ones, of textbooks, URDF and other programs.
CONVENTION_WORDS = {
    word: convention.name for convention in CONVENTIONS.values() for word in convention.also
}
JOINT_TYPES = called(
    revolute='r rot rotary rotational rotation rotating hinge pin continuous turning',
    prismatic='p slide slider sliding linear translational translation trans telescopic',
    helical='h screw',
)
ANGLES = called(deg='degree degrees', rad='radian radians')
LENGTHS = called(
    m='metre metres meter meters si', mm='millimetre millimetres millimeter millimeters'
)
POSE_KEYS = called(
    xyz='position pos translation origin p', rpy='orientation rotation rot euler roll_pitch_yaw'
)
ROWS = 'link frame after after_row'
POSITIONS = 'joints angles positions'


class RobotEntry(Entry):
    """The file itself; what lies deeper is looked at part by part."""

    noun = 'a robot file'
    required = ('robot', 'convention', 'joints', 'links')
    also = called(
        robot='name',
        source='reference',
        links='dh table rows dh_table dh_parameters',
        known_poses='poses',
        tool='end_effector ee tcp',
        uncertainty='errors accuracy covariance',
    )

    robot: Word = None
    source: Citation = None
    convention: Annotated[str | None, one_of(*CONVENTIONS, also=CONVENTION_WORDS)] = None
    units: Yaml = None
    constants: Yaml = None
    joints: Yaml = None
    links: Yaml = None
    base: Yaml = None
    tool: Yaml = None
    points: Yaml = None
    loops: Yaml = None
    singularity: Yaml = None
    speed_limits: Yaml = None
    uncertainty: Yaml = None
    known_poses: Yaml = None
    tolerance: Yaml = None


class CellEntry(Entry):
    """The file of a cell: arms on one floor."""

    noun = 'a cell'
    required = ('cell', 'arms')
    also = called(cell='name', arms='robots', common='shared', frame='floor world base')

    cell: Word = None
    frame: Word = None
    units: Yaml = None
    common: Words = None
    arms: Yaml = None


class UnitsEntry(Entry):
    """The units of every number in the file."""

    noun = 'units'

    angle: Annotated[str | None, one_of('rad', 'deg', also=ANGLES)] = None
    length: Annotated[str | None, one_of('m', 'mm', also=LENGTHS)] = None


class JointEntry(Entry):
    """One actuated joint."""

    noun = 'a joint'
    required = ('name', 'type')
    also = called(
        variable='var symbol q',
        type='kind joint_type',
        limits='lower upper min max range qlim q_min q_max lower_limit upper_limit',
        velocity='speed vel max_speed max_velocity',
        acceleration='acc accel max_acceleration',
    )

    name: Word = None
    variable: Word = None
    type: Annotated[str | None, one_of('revolute', 'prismatic', 'helical', also=JOINT_TYPES)] = (
        None
    )
    limits: Pair = None
    velocity: Number = None
    acceleration: Number = None
    unused: Truth = None


def _entry_of(noun: str, kinds: Mapping[str, Any], also: Mapping[str, str]) -> type[Entry]:
    # Of keys that are known when a file is read; it needs all of them.
    return type(
        'FileEntry',
        (Entry,),
        {
            '__annotations__': dict(kinds),
            **dict.fromkeys(kinds),
            'noun': noun,
            'required': tuple(kinds),
            'also': also,
        },
    )


@cache
def dh_row_entry(quantities: tuple[str, ...]) -> type[Entry]:
    """Return the entry that is one row of a table with these quantities."""
    other_words = {'length': 'a', 'twist': 'alpha', 's': 'd', 'th': 'theta', 'angle': 'theta'}
    also = {word: name for word, name in other_words.items() if name in quantities}
    return _entry_of('a row of the table', dict.fromkeys(quantities, Number), also)


DhRowEntry = dh_row_entry(QUANTITIES)


class ShapeRowEntry(Entry):
    """One row of a Sheth-Uicker table."""

    noun = 'a row of the table'
    also = {'input': 'in', 'output': 'out'}

    in_: Yaml = None
    joint: Formula = None
    out: Yaml = None


class PoseEntry(Entry):
    """A pose instead of a matrix."""

    noun = 'a pose'
    also = POSE_KEYS

    xyz: Triple = None
    rpy: Triple = None


class CellArmEntry(PoseEntry):
    """An arm of a cell, and where its base stands."""

    noun = 'an arm of a cell'
    required = ('robot',)
    also = {**POSE_KEYS, **called(robot='file name', joint_prefix='prefix')}

    robot: Word = None
    joint_prefix: Word = None


class PlacementEntry(PoseEntry):
    """The base or the tool."""

    noun = 'a placement'
    also = {**POSE_KEYS, **called(frame='name link')}

    frame: Word = None


class PointEntry(PoseEntry):
    """A named point of the arm."""

    noun = 'a point'
    required = ('row',)
    also = {**POSE_KEYS, **called(row=ROWS)}

    row: Whole = None


class LoopEntry(Entry):
    """A closed loop: a second chain that parts from the table and meets it again."""

    noun = 'a loop'
    required = ('name', 'passive', 'links', 'meets', 'rows', 'assembled')
    also = called(
        from_='start begins parts',
        meets='to end ends closes',
        links='chain table',
        rows='coincide components equal',
        assembled='assembly at closed',
    )

    name: Word = None
    passive: Yaml = None
    from_: Yaml = None
    links: Yaml = None
    meets: Yaml = None
    rows: Words = None
    assembled: Yaml = None


class PassiveEntry(Entry):
    """A joint that a loop moves."""

    noun = 'a passive joint'
    required = ('name',)
    also = {'kind': 'type', 'joint_type': 'type'}

    name: Word = None
    type: Annotated[str | None, one_of('revolute', 'prismatic', also=JOINT_TYPES)] = None


class LoopEndEntry(PoseEntry):
    """Where a loop parts from the table, or meets it."""

    noun = 'an end of a loop'
    also = {**POSE_KEYS, **called(row=ROWS)}

    row: Whole = None
    point: Word = None


@cache
def assembled_entry(passive: tuple[str, ...]) -> type[Entry]:
    """Return the entry of the positions at which a loop with these passive joints is closed."""
    kinds = {'q': Numbers, **dict.fromkeys(passive, Number)}
    return _entry_of('an assembly', kinds, called(q=POSITIONS))


class ToleranceEntry(Entry):
    """How exact a known pose is."""

    noun = 'a tolerance'

    xyz: Number = None
    rpy: Number = None


class KnownPoseEntry(PoseEntry):
    """A joint vector and where the tool then is."""

    noun = 'a known pose'
    required = ('q', 'xyz')
    also = {**POSE_KEYS, **called(q=POSITIONS)}

    q: Numbers = None
    tolerance: Yaml = None


class FactorEntry(Entry):
    """A named function of the joints whose zeros are singular poses."""

    noun = 'a singular factor'
    required = ('name', 'expression')

    name: Word = None
    expression: Number = None
    approximate: Truth = None


class SingularityEntry(Entry):
    """What is called singular, and when to warn."""

    noun = 'singularity'

    task: Words = None
    length: Number = None
    measure: Annotated[str | None, one_of(*MEASURES)] = None
    warn: Number = None
    stop: Number = None
    factors: Yaml = None


class UncertaintyEntry(Entry):
    """How far joints and table are off, as standard deviations and widths."""

    noun = 'uncertainty'
    also = called(
        encoder_noise='noise joint_noise encoders',
        encoder_resolution='resolution step',
        backlash='play',
        velocity_noise='velocity',
        floor='unmodelled',
    )

    encoder_noise: Yaml = None
    encoder_resolution: Yaml = None
    backlash: Yaml = None
    velocity_noise: Yaml = None
    parameters: Yaml = None
    covariance: Yaml = None
    floor: Yaml = None


class FloorEntry(Entry):
    """What no parameter explains."""

    noun = 'a floor'
    also = POSE_KEYS

    xyz: Number = None
    rpy: Number = None


class SpeedLimitEntry(Entry):
    """The largest speed of the tool or of a point."""

    noun = 'a speed limit'
    also = called(linear='speed velocity translation', angular='turning rotation')

    linear: Number = None
    angular: Number = None
    reduced: Number = None


class TableToleranceEntry(Entry):
    """How far the numbers of the table may be off."""

    noun = 'a tolerance of the table'
    also = called(
        length='lengths xyz position', angle='angles rpy rotation', gear='gears ratio ratios'
    )

    length: Number = None
    angle: Number = None
    gear: Number = None
    of: Yaml = None
