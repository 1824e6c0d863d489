"""
The shape of a robot file: which keys stand where, and which of them are texts, numbers, lists.

What is missing or has been refused is None in an entry.
"""

from functools import cache
from typing import Annotated, Any

from ..text.entries import (
    Citation,
    Entry,
    Number,
    Numbers,
    Pair,
    Triple,
    Truth,
    Whole,
    Word,
    Words,
    one_of,
)
from .convention_table import CONVENTIONS, QUANTITIES
from .measure_table import MEASURES

# Other words for the accepted ones, of textbooks, URDF and other programs.
CONVENTION_WORDS = {
    word: convention.name for convention in CONVENTIONS.values() for word in convention.also
}
JOINT_TYPES = {
    **dict.fromkeys(
        ('r', 'rot', 'rotary', 'rotational', 'rotation', 'rotating', 'hinge', 'pin', 'continuous')
        + ('turning',),
        'revolute',
    ),
    **dict.fromkeys(
        ('p', 'slide', 'slider', 'sliding', 'linear', 'translational', 'translation', 'trans')
        + ('telescopic',),
        'prismatic',
    ),
    **dict.fromkeys(('h', 'screw'), 'helical'),
}
ANGLES = {'degree': 'deg', 'degrees': 'deg', 'radian': 'rad', 'radians': 'rad'}
LENGTHS = {
    **dict.fromkeys(('metre', 'metres', 'meter', 'meters', 'si'), 'm'),
    **dict.fromkeys(('millimetre', 'millimetres', 'millimeter', 'millimeters'), 'mm'),
}
POSE_KEYS = {
    **dict.fromkeys(('position', 'pos', 'translation', 'origin', 'p'), 'xyz'),
    **dict.fromkeys(('orientation', 'rotation', 'rot', 'euler', 'roll_pitch_yaw'), 'rpy'),
}


class RobotEntry(Entry):
    """The file itself; what lies deeper is looked at part by part."""

    noun = 'a robot file'
    required = ('robot', 'convention', 'joints', 'links')
    also = {
        'name': 'robot',
        'reference': 'source',
        **dict.fromkeys(('dh', 'table', 'rows', 'dh_table', 'dh_parameters'), 'links'),
        'poses': 'known_poses',
        **dict.fromkeys(('end_effector', 'ee', 'tcp'), 'tool'),
        **dict.fromkeys(('errors', 'accuracy', 'covariance'), 'uncertainty'),
    }

    robot: Word = None
    source: Citation = None
    convention: Annotated[str | None, one_of(*CONVENTIONS, also=CONVENTION_WORDS)] = None
    units: Any = None
    constants: Any = None
    joints: Any = None
    links: Any = None
    base: Any = None
    tool: Any = None
    points: Any = None
    loops: Any = None
    singularity: Any = None
    uncertainty: Any = None
    known_poses: Any = None
    tolerance: Any = None


class UnitsEntry(Entry):
    """The units of every number in the file."""

    noun = 'units'

    angle: Annotated[str | None, one_of('rad', 'deg', also=ANGLES)] = None
    length: Annotated[str | None, one_of('m', 'mm', also=LENGTHS)] = None


class JointEntry(Entry):
    """One actuated joint."""

    noun = 'a joint'
    required = ('name', 'type')
    also = {
        **dict.fromkeys(('var', 'symbol', 'q'), 'variable'),
        **dict.fromkeys(('kind', 'joint_type'), 'type'),
        **dict.fromkeys(
            ('lower', 'upper', 'min', 'max', 'range', 'qlim', 'q_min', 'q_max', 'lower_limit')
            + ('upper_limit',),
            'limits',
        ),
        **dict.fromkeys(('speed', 'vel', 'max_speed', 'max_velocity'), 'velocity'),
    }

    name: Word = None
    variable: Word = None
    type: Annotated[str | None, one_of('revolute', 'prismatic', 'helical', also=JOINT_TYPES)] = (
        None
    )
    limits: Pair = None
    velocity: Number = None
    unused: Truth = None


@cache
def dh_row_entry(quantities: tuple[str, ...]) -> type[Entry]:
    """Return the entry that is one row of a table with these quantities."""
    other_words = {'length': 'a', 'twist': 'alpha', 's': 'd', 'th': 'theta', 'angle': 'theta'}
    return type(
        'DhRowEntry',
        (Entry,),
        {
            '__annotations__': dict.fromkeys(quantities, Number),
            **dict.fromkeys(quantities),
            'noun': 'a row of the table',
            'required': quantities,
            'also': {word: name for word, name in other_words.items() if name in quantities},
        },
    )


DhRowEntry = dh_row_entry(QUANTITIES)


class ShapeRowEntry(Entry):
    """One row of a Sheth-Uicker table."""

    noun = 'a row of the table'
    also = {'input': 'in', 'output': 'out'}

    in_: Any = None
    joint: Word = None
    out: Any = None


class PoseEntry(Entry):
    """A pose instead of a matrix."""

    noun = 'a pose'
    also = POSE_KEYS

    xyz: Triple = None
    rpy: Triple = None


class PlacementEntry(PoseEntry):
    """The base or the tool."""

    noun = 'a placement'
    also = {**POSE_KEYS, 'name': 'frame', 'link': 'frame'}

    frame: Word = None


class PointEntry(PoseEntry):
    """A named point of the arm."""

    noun = 'a point'
    required = ('row',)
    also = {**POSE_KEYS, **dict.fromkeys(('link', 'frame', 'after', 'after_row'), 'row')}

    row: Whole = None


class LoopEntry(Entry):
    """A closed loop: a second chain that parts from the table and meets it again."""

    noun = 'a loop'
    required = ('name', 'passive', 'links', 'meets', 'rows', 'assembled')
    also = {
        **dict.fromkeys(('start', 'begins', 'parts'), 'from'),
        **dict.fromkeys(('to', 'end', 'ends', 'closes'), 'meets'),
        **dict.fromkeys(('chain', 'table'), 'links'),
        **dict.fromkeys(('coincide', 'components', 'equal'), 'rows'),
        **dict.fromkeys(('assembly', 'at', 'closed'), 'assembled'),
    }

    name: Word = None
    passive: Any = None
    from_: Any = None
    links: Any = None
    meets: Any = None
    rows: Words = None
    assembled: Any = None


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
    also = {**POSE_KEYS, **dict.fromkeys(('link', 'frame', 'after', 'after_row'), 'row')}

    row: Whole = None
    point: Word = None


@cache
def assembled_entry(passive: tuple[str, ...]) -> type[Entry]:
    """Return the entry of the positions at which a loop with these passive joints is closed."""
    return type(
        'AssembledEntry',
        (Entry,),
        {
            '__annotations__': {'q': Numbers, **dict.fromkeys(passive, Number)},
            **dict.fromkeys(('q', *passive)),
            'noun': 'an assembly',
            'required': ('q', *passive),
            'also': dict.fromkeys(('joints', 'angles', 'positions'), 'q'),
        },
    )


class ToleranceEntry(Entry):
    """How exact a known pose is."""

    noun = 'a tolerance'

    xyz: Number = None
    rpy: Number = None


class KnownPoseEntry(PoseEntry):
    """A joint vector and where the tool then is."""

    noun = 'a known pose'
    required = ('q', 'xyz')
    also = {**POSE_KEYS, **dict.fromkeys(('joints', 'angles', 'positions'), 'q')}

    q: Numbers = None
    tolerance: Any = None


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
    factors: Any = None


class UncertaintyEntry(Entry):
    """How far joints and table are off, as standard deviations and widths."""

    noun = 'uncertainty'
    also = {
        **dict.fromkeys(('noise', 'joint_noise', 'encoders'), 'encoder_noise'),
        **dict.fromkeys(('resolution', 'step'), 'encoder_resolution'),
        'play': 'backlash',
        'velocity': 'velocity_noise',
        'unmodelled': 'floor',
    }

    encoder_noise: Any = None
    encoder_resolution: Any = None
    backlash: Any = None
    velocity_noise: Any = None
    parameters: Any = None
    covariance: Any = None
    floor: Any = None


class FloorEntry(Entry):
    """What no parameter explains."""

    noun = 'a floor'
    also = POSE_KEYS

    xyz: Number = None
    rpy: Number = None


class TableToleranceEntry(Entry):
    """How far the numbers of the table may be off."""

    noun = 'a tolerance of the table'
    also = {
        **dict.fromkeys(('lengths', 'xyz', 'position'), 'length'),
        **dict.fromkeys(('angles', 'rpy', 'rotation'), 'angle'),
        **dict.fromkeys(('gears', 'ratio', 'ratios'), 'gear'),
    }

    length: Number = None
    angle: Number = None
    gear: Number = None
    of: Any = None
