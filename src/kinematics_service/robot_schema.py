"""
The shape of a robot file: which keys stand where, and which of them are texts, numbers, lists.

What is missing or has been refused is None in an entry.
"""

from typing import Annotated, Any

from pydantic import Field

from .entries import Citation, Entry, Number, Numbers, Pair, Triple, Word, Words, one_of


class RobotEntry(Entry):
    """
    The file itself; what lies deeper is looked at part by part.

    """

    noun = 'a robot file'
    required = ('robot', 'convention', 'joints', 'links')

    robot: Word = None
    source: Citation = None
    convention: Annotated[str | None, one_of('standard', 'modified', 'elementary', 'shape')] = None
    units: Any = None
    constants: Any = None
    joints: Any = None
    links: Any = None
    base: Any = None
    tool: Any = None
    singularity: Any = None
    known_poses: Any = None


class UnitsEntry(Entry):
    """
    The units of every number in the file.

    """

    noun = 'units'

    angle: Annotated[str | None, one_of('rad', 'deg')] = None
    length: Annotated[str | None, one_of('m', 'mm')] = None


class JointEntry(Entry):
    """
    One actuated joint.

    """

    noun = 'a joint'
    required = ('name', 'type')

    name: Word = None
    variable: Word = None
    type: Annotated[str | None, one_of('revolute', 'prismatic', 'helical')] = None
    limits: Pair | None = None
    velocity: Number = None


class DhRowEntry(Entry):
    """
    One row of a Denavit-Hartenberg table, standard or modified.

    """

    noun = 'a row of the table'
    required = ('a', 'alpha', 'd', 'theta')

    a: Number = None
    alpha: Number = None
    d: Number = None
    theta: Number = None


class ShapeRowEntry(Entry):
    """
    One row of a Sheth-Uicker table.

    """

    noun = 'a row of the table'

    inner: Any = Field(None, alias='in')
    joint: Word = None
    outer: Any = Field(None, alias='out')


class PoseEntry(Entry):
    """
    A pose instead of a matrix.

    """

    noun = 'a pose'

    xyz: Triple | None = None
    rpy: Triple | None = None


class PlacementEntry(PoseEntry):
    """
    The base or the tool.

    """

    noun = 'a placement'

    frame: Word = None


class ToleranceEntry(Entry):
    """
    How exact a known pose is.

    """

    noun = 'a tolerance'

    xyz: Number = None
    rpy: Number = None


class KnownPoseEntry(PoseEntry):
    """
    A joint vector and where the tool then is.

    """

    noun = 'a known pose'
    required = ('q', 'xyz', 'rpy')

    q: Numbers | None = None
    tolerance: Any = None


class FactorEntry(Entry):
    """
    A named function of the joints whose zeros are singular poses.

    """

    noun = 'a singular factor'
    required = ('name', 'expression')

    name: Word = None
    expression: Number = None


class SingularityEntry(Entry):
    """
    What is called singular, and when to warn.

    """

    noun = 'singularity'

    task: Words | None = None
    length: Number = None
    measure: Annotated[
        str | None,
        one_of(
            'distance',
            'determinant',
            'manipulability',
            'smallest_singular_value',
            'condition_number',
        ),
    ] = None
    warn: Number = None
    stop: Number = None
    factors: Any = None
