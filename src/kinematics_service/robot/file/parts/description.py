"""What a valid robot file says, as frozen data: angles in rad, lengths in m."""

import math
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ....errors import Fault
from ..text.expressions import Expression
from .convention_table import Axis

JointType = Literal['revolute', 'prismatic', 'helical']
AngleUnit = Literal['rad', 'deg']
LengthUnit = Literal['m', 'mm']


@dataclass(frozen=True)
class Constant:
    """
    A named number of the file.

    Its value is in the file's units, unlike everything else here: whether a constant is a
    length, an angle, or a ratio shows only where it is used. A letter has no value in the file;
    its number here is generic.
    """

    name: str
    text: str
    value: float
    letter: bool = False


@dataclass(frozen=True)
class JointDescription:
    """
    An actuated joint.

    Parameters
    ----------
    name
        As in JointState.
    variable
        Its name in expressions.
    type
        A helical joint's variable is its angle.
    lower, upper : rad or m
        -inf and inf where there is none.
    velocity : rad/s or m/s
        The largest speed; inf where none is given.
    unused
        It stands in no row of the table, and the file says so: it moves nothing.
    acceleration : rad/s^2 or m/s^2
        How fast it can be stopped; inf where none is given.
    """

    name: str
    variable: str
    type: JointType
    lower: float
    upper: float
    velocity: float
    unused: bool = False
    acceleration: float = math.inf


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """
    A constant pose, and how the file wrote it.

    Parameters
    ----------
    matrix : shape (4, 4), translation in m
        Kept as a read-only copy.
    texts : 6 or 16 expressions in the file's units
        x y z roll pitch yaw with R = Rz(yaw) Ry(pitch) Rx(roll), or the matrix row by row.
    """

    matrix: npt.NDArray[np.float64]
    texts: tuple[str, ...]

    def __post_init__(self) -> None:
        """Freeze a copy of the matrix."""
        matrix = np.array(self.matrix, dtype=np.float64)
        matrix.setflags(write=False)
        object.__setattr__(self, 'matrix', matrix)

    def __eq__(self, other: object) -> bool:
        """Compare numbers and texts exactly."""
        if not isinstance(other, RigidMotion):
            return NotImplemented
        return self.texts == other.texts and np.array_equal(self.matrix, other.matrix)

    def __hash__(self) -> int:
        """Hash the texts alone: equal motions have equal texts."""
        return hash(self.texts)


IDENTITY = RigidMotion(np.eye(4), ('0',) * 6)


@dataclass(frozen=True)
class ElementaryMotion:
    """A rotation about, or a translation along, one axis."""

    axis: Axis
    argument: Expression

    @property
    def turns(self) -> bool:
        """Return whether it is a rotation, its argument an angle."""
        return self.axis.startswith('R')

    @property
    def motions(self) -> 'tuple[ElementaryMotion, ...]':
        """Return the elementary motions of the row: itself."""
        return (self,)


@dataclass(frozen=True)
class DhRow:
    """
    A row of named quantities, such as Denavit and Hartenberg's; all but theta and d are constant.

    Parameters
    ----------
    names
        Of the quantities.
    motions
        What each is; in which order they multiply is said by the convention.
    """

    names: tuple[str, ...]
    motions: tuple[ElementaryMotion, ...]

    def __getitem__(self, name: str) -> Expression:
        """Return a quantity by its name."""
        return self.motions[self.names.index(name)].argument


@dataclass(frozen=True)
class ShapeRow:
    """A Sheth-Uicker row, T = inner * joint * inverse(outer); no joint: a fixed row."""

    inner: RigidMotion
    joint: ElementaryMotion | None
    outer: RigidMotion

    @property
    def motions(self) -> tuple[ElementaryMotion, ...]:
        """Return the elementary motions of the row: its joint's."""
        return () if self.joint is None else (self.joint,)


Link: TypeAlias = DhRow | ElementaryMotion | ShapeRow


@dataclass(frozen=True)
class Placement:
    """A named frame: the table's frame 0 in it (base), or it in the last row's frame (tool)."""

    frame: str
    motion: RigidMotion


@dataclass(frozen=True)
class PointDescription:
    """
    A named point of the arm: a frame that moves with a row of the table.

    Parameters
    ----------
    row
        0 is the table's frame 0, i the frame after row i.
    motion
        The point in that frame.
    """

    name: str
    row: int
    motion: RigidMotion


@dataclass(frozen=True)
class PassiveJoint:
    """
    A joint without a motor, moved by a closed loop.

    Parameters
    ----------
    name
        In expressions; no message has it.
    type
        Revolute or prismatic.
    """

    name: str
    type: JointType


@dataclass(frozen=True)
class LoopDescription:
    """
    A closed loop: a second chain that parts from the table and meets it again.

    Parameters
    ----------
    passive
        The joints that it moves.
    start, meets
        Where the second chain parts from the table, and the frame that its end coincides with.
    there
        The rows of the table between them.
    links
        The rows of the second chain.
    rows
        Components that coincide, in the axes of `start`, ordered x y z rx ry rz.
    q : n values, assembled : one value for each passive joint, rad or m
        Positions at which the loop is closed, or nearly.
    line
        In the file.
    """

    name: str
    passive: tuple[PassiveJoint, ...]
    start: PointDescription
    meets: PointDescription
    there: tuple[Link, ...]
    links: tuple[Link, ...]
    rows: tuple[str, ...]
    q: tuple[float, ...]
    assembled: tuple[float, ...]
    line: int = field(default=0, compare=False)


class Rounding(NamedTuple):
    """
    Half of the last digit that the numbers of a known pose are written with; 0 for exact ones.

    Attributes
    ----------
    q : n values, rad or m
    xyz, rpy : m, rad
    """

    q: tuple[float, ...] = ()
    xyz: float = 0.0
    rpy: float = 0.0


@dataclass(frozen=True)
class KnownPose:
    """
    Where the tool is in the base frame at one joint vector, by the file's source.

    Parameters
    ----------
    q : n values, rad or m
    tolerance_xyz, tolerance_rpy : m, rad
        The latter is inf where the source gives no orientation; that of `motion` is then none.
    rounding
        Of exact numbers where the source gives a tolerance.
    """

    q: tuple[float, ...]
    motion: RigidMotion
    tolerance_xyz: float
    tolerance_rpy: float
    rounding: Rounding = Rounding()


@dataclass(frozen=True)
class Factor:
    """
    A named function of the joints whose zeros are singular poses, in the file's units.

    Parameters
    ----------
    approximate
        Its zeros are near singular poses only: it is that of a table without corrections.
    """

    name: str
    text: str
    approximate: bool = False


@dataclass(frozen=True)
class SingularityDescription:
    """
    What the file says about singular poses.

    Parameters
    ----------
    task
        Rows of the Jacobian, ordered x y z rx ry rz; None: chosen from the arm.
    length : m
        The characteristic length; None: chosen from the arm.
    measure
        Which number is compared with the thresholds; empty: the default of the arm.
    warn, stop
        Thresholds: rad for `distance`, else plain numbers in SI units.
    factors
        In the order of the file.
    """

    task: tuple[str, ...] | None = None
    length: float | None = None
    measure: str = ''
    warn: float | None = None
    stop: float | None = None
    factors: tuple[Factor, ...] = ()


@dataclass(frozen=True)
class Uncertainty:
    """
    How far an arm may be off, all of it in rad and m.

    Parameters
    ----------
    noise, resolution, backlash : n values
        Of joint positions: standard deviations; the steps they are counted in; the whole play.
    velocity_noise : n values
        Standard deviations of joint velocities, rad/s or m/s; None: not known.
    parameters
        Standard deviations by group or name of the numbers of the table.
    factor
        Instead: of their covariance L L^T the row of L of each, by name; each as long as there
        are rows up to it.
    floor_xyz, floor_rpy : m, rad
        Standard deviation of what else a position and a rotation are off by, about each axis.
    """

    noise: tuple[float, ...]
    resolution: tuple[float, ...]
    backlash: tuple[float, ...]
    velocity_noise: tuple[float, ...] | None
    parameters: tuple[tuple[str, float], ...]
    factor: tuple[tuple[str, tuple[float, ...]], ...]
    floor_xyz: float
    floor_rpy: float

    @property
    def joint_deviations(self) -> tuple[float, ...]:
        """Return the standard deviations of the joint positions, rad or m."""
        # A number that may be anywhere within a width w has the deviation w / sqrt(12).
        return tuple(
            math.sqrt(noise**2 + (step**2 + play**2) / 12.0)
            for noise, step, play in zip(self.noise, self.resolution, self.backlash)
        )

    @property
    def of_pose(self) -> bool:
        """Return whether it says that a pose is off."""
        numbers = (
            *self.joint_deviations,
            *(deviation for _, deviation in self.parameters),
            *(number for _, row in self.factor for number in row),
            *(self.floor_xyz, self.floor_rpy),
        )
        return any(numbers)


@dataclass(frozen=True)
class Tolerances:
    """
    Standard deviations of the numbers of the table, as made and measured by the maker.

    Parameters
    ----------
    length, angle, gear : m, rad, share
        Of all lengths, angles and gear ratios; None: not said.
    named
        Of single numbers, by their names in a calibration: theta2, d1, a3, gear2.
    """

    length: float | None = None
    angle: float | None = None
    gear: float | None = None
    named: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class SpeedLimit:
    """
    The largest speed of the tool, or of a point; infinite where none is given.

    Parameters
    ----------
    of
        `tool`, or the name of the point.
    linear, angular : m/s, rad/s
        Of its origin, and of its frame.
    reduced : m/s
        Of its origin, where the arm has been told to move at reduced speed.
    """

    of: str
    linear: float
    angular: float
    reduced: float


class MimicFormula(NamedTuple):
    """
    A joint that follows another: its position is multiplier times that of the leader plus offset.

    Attributes
    ----------
    name, leader
        As in JointState; the arm's joints include the leader, not the follower.
    offset : rad or m
    slides
        Whether the follower slides.
    """

    name: str
    leader: str
    multiplier: float
    offset: float
    slides: bool


@dataclass(frozen=True)
class RobotDescription:
    """
    A robot file that has been read and found right.

    Parameters
    ----------
    angle_unit, length_unit
        What the texts inside are written in; every number but the constants' is SI.
    links
        The rows of the table; the convention says of which kind.
    points
        In the order of the file; the tool is none of them.
    uncertainty
        None where the file does not say.
    warnings
        What is allowed but is most likely a mistake: another unit, a constant nobody uses.
    remarks
        Sentences for `check`: what is worth knowing.
    file
        The path as the user gave it.
    tolerances
        How far the numbers of the table may be off.
    sha256
        Of the bytes of the file; empty for a text that was in none.
    loops
        In the order of the file: each may move with the passive joints of those before it.
    parts
        Other files that it was read from: those of the arms of a cell.
    speed_limits
        In the order of the file.
    mimics
        Joints of a URDF that follow joints of the arm.
    """

    name: str
    source: str
    convention: str
    angle_unit: AngleUnit
    length_unit: LengthUnit
    constants: tuple[Constant, ...]
    joints: tuple[JointDescription, ...]
    links: tuple[Link, ...]
    base: Placement
    tool: Placement
    points: tuple[PointDescription, ...]
    singularity: SingularityDescription
    uncertainty: Uncertainty | None
    known_poses: tuple[KnownPose, ...]
    warnings: tuple[Fault, ...]
    remarks: tuple[str, ...]
    file: str
    tolerances: Tolerances = Tolerances()
    sha256: str = field(default='', compare=False)
    loops: tuple[LoopDescription, ...] = ()
    parts: tuple[str, ...] = field(default=(), compare=False)
    speed_limits: tuple[SpeedLimit, ...] = ()
    mimics: tuple[MimicFormula, ...] = ()

    @property
    def letters(self) -> str:
        """Return the names of the constants without a value, joined by commas."""
        return ', '.join(constant.name for constant in self.constants if constant.letter)

    @property
    def radians(self) -> float:
        """Return the file's unit of angles, rad."""
        return math.pi / 180.0 if self.angle_unit == 'deg' else 1.0

    @property
    def metres(self) -> float:
        """Return the file's unit of lengths, m."""
        return 1e-3 if self.length_unit == 'mm' else 1.0
