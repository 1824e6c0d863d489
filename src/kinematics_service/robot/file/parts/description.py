# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Hold the content of a valid robot file as frozen data: angles in rad, lengths in m."""

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
    A named number of the robot file, in the units of the file, not in SI units.

    A constant may be a length, an angle or a ratio. Only the expressions that use the constant
    show which of the three it is, so its value is not converted to SI units. If `letter` is true,
    the file gives no value for the constant, and `value` is an arbitrary substitute number.
    """

    name: str
    text: str
    value: float
    letter: bool = False


@dataclass(frozen=True)
class JointDescription:
    """
    An actuated joint of a robot file: its names, type, limits and largest speed.

    Parameters
    ----------
    name
        The name in JointState messages.
    variable
        The name in expressions.
    type
        The type of the joint; the variable of a helical joint is an angle.
    lower, upper : rad or m
        The limits of the position; -inf and inf for a joint without limits.
    velocity : rad/s or m/s
        The largest speed; inf if the file does not give a value.
    unused
        True if the robot file says `unused: true`: the joint moves no row of the table.
    acceleration : rad/s^2 or m/s^2
        The largest acceleration, used only for braking; inf if the file does not give a value.
    """

    name: str
    variable: str
    type: JointType
    lower: float
    upper: float
    velocity: float
    unused: bool = False
    acceleration: float = math.inf


@dataclass(frozen=True)
class RigidMotion:
    """
    A constant pose as a matrix, with the expressions in the robot file that give the pose. Two
    poses with equal expressions are equal.

    Parameters
    ----------
    matrix : shape (4, 4), translation in m
        The pose as a matrix; the object has a read-only copy.
    texts : 6 or 16 expressions in the file's units
        x y z roll pitch yaw with R = Rz(yaw) Ry(pitch) Rx(roll), or the matrix row by row.
    """

    matrix: npt.NDArray[np.float64] = field(compare=False)
    texts: tuple[str, ...]

    def __post_init__(self) -> None:
        """Replace the field `matrix` by a read-only copy of the array."""
        matrix = np.array(self.matrix, dtype=np.float64)
        matrix.setflags(write=False)
        object.__setattr__(self, 'matrix', matrix)


IDENTITY = RigidMotion(np.eye(4), ('0',) * 6)


@dataclass(frozen=True)
class ElementaryMotion:
    """A table row that is a rotation about, or a translation along, one axis."""

    axis: Axis
    argument: Expression

    @property
    def turns(self) -> bool:
        """Return whether the motion is a rotation, so that its argument is an angle."""
        return self.axis.startswith('R')

    @property
    def motions(self) -> 'tuple[ElementaryMotion, ...]':
        """
        Return a tuple with only this motion. Every class of table row has the property `motions`;
        that of a DH row has several motions.
        """
        return (self,)


@dataclass(frozen=True)
class DhRow:
    """
    A table row with named quantities, such as a Denavit-Hartenberg row. Only the quantities theta
    and d may contain joint variables.

    Parameters
    ----------
    names
        The names of the quantities.
    motions
        The elementary motion of each quantity, in the order of `names`. The convention defines the
        order of the factors in the product T.
    """

    names: tuple[str, ...]
    motions: tuple[ElementaryMotion, ...]

    def __getitem__(self, name: str) -> Expression:
        """Return the expression of a quantity by its name, such as `theta`."""
        return self.motions[self.names.index(name)].argument


@dataclass(frozen=True)
class ShapeRow:
    """
    A table row of Sheth and Uicker, T = inner * joint * inverse(outer). If `joint` is None, the
    row is constant.
    """

    inner: RigidMotion
    joint: ElementaryMotion | None
    outer: RigidMotion

    @property
    def motions(self) -> tuple[ElementaryMotion, ...]:
        """
        Return a tuple with the elementary motion of the row's joint; empty if the row has no
        joint.
        """
        return () if self.joint is None else (self.joint,)


Link: TypeAlias = DhRow | ElementaryMotion | ShapeRow


@dataclass(frozen=True)
class Placement:
    """
    The base or the tool of an arm: the name of its frame, and its constant pose.

    For the base, `motion` is the pose of the table's frame 0 in the base frame. For the tool,
    `motion` is the pose of the tool in the frame after the last row.
    """

    frame: str
    motion: RigidMotion


@dataclass(frozen=True)
class PointDescription:
    """
    A named point of the arm: a frame that moves with a row of the table.

    Parameters
    ----------
    row
        The number of the frame that carries the point: 0 is frame 0 of the table, i is the frame
        after row i.
    motion
        The pose of the point in the frame of `row`.
    """

    name: str
    row: int
    motion: RigidMotion


@dataclass(frozen=True)
class PassiveJoint:
    """
    A joint without a motor: a closed loop of the arm determines its position.

    Parameters
    ----------
    name
        The name in expressions of the file. ROS messages do not contain passive joints.
    type
        Revolute or prismatic.
    """

    name: str
    type: JointType


@dataclass(frozen=True)
class LoopDescription:
    """
    A closed loop: a second chain of rows, beside the chain of the table, between two points of the
    arm.

    Parameters
    ----------
    passive
        The joints that the loop moves.
    start, meets
        The points at which the second chain begins and ends. Each point is fixed to a frame of the
        table.
    there
        The rows of the table from `start` to `meets`.
    links
        The rows of the second chain.
    rows
        The components of position and rotation that must agree at the ends of the two chains, in
        the axes of `start`: some of x y z rx ry rz, in that order.
    q : n values, assembled : one value for each passive joint, rad or m
        Positions of the joints (`q`) and of the passive joints (`assembled`) at which the loop is
        approximately closed.
    line
        The line of the key `assembled` in the file, for messages.
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
    The largest rounding errors of the numbers of a known pose: half a unit of the last digit, or 0
    for exact numbers.

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
    The pose of the tool in the base frame at one joint vector, as a datasheet or paper gives it.

    Parameters
    ----------
    q : n values, rad or m
    tolerance_xyz, tolerance_rpy : m, rad
        Tolerances of position and orientation. If the source gives no orientation,
        `tolerance_rpy` is inf, and the orientation of `motion` has no meaning.
    rounding
        The rounding errors of the numbers; zeros if the source gives a tolerance.
    """

    q: tuple[float, ...]
    motion: RigidMotion
    tolerance_xyz: float
    tolerance_rpy: float
    rounding: Rounding = Rounding()


@dataclass(frozen=True)
class Factor:
    """
    A singular factor: a named function of q whose zeros are singular poses.

    The expression of the factor is in the units of the file.

    Parameters
    ----------
    approximate
        Whether the zeros of the factor are close to singular poses, but not exactly singular. This
        is so if the factor was derived from the table before the table was calibrated.
    """

    name: str
    text: str
    approximate: bool = False


@dataclass(frozen=True)
class SingularityDescription:
    """
    The section `singularity`: the task, the measure, its thresholds, and factors.

    Parameters
    ----------
    task
        Rows of the Jacobian in the order x y z rx ry rz; None if `find_task` chooses them.
    length : m
        The characteristic length; None if `find_task` computes it.
    measure
        The measure that is compared with the thresholds; '' for the default measure of the arm.
    warn, stop
        Values of the measure at which WARN and ERROR begin, in SI units (rad for `distance`).
    factors
        The named factors, in the order of the file.
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
    Standard deviations of the joint positions and the table of an arm, in rad and m.

    Parameters
    ----------
    noise, resolution, backlash : n values
        For each joint position: standard deviation, encoder step, and total backlash.
    velocity_noise : n values
        Standard deviations of joint velocities, rad/s or m/s; None if they are not known.
    parameters
        Standard deviations of the numbers of the table, for a group such as `lengths` or for one
        number such as `a2`.
    factor
        The alternative to `parameters` if the errors of the numbers are correlated. The covariance
        matrix is L L^T with a lower triangular matrix L. The field has a name and a row of L for
        each parameter; row k has at most k numbers.
    floor_xyz, floor_rpy : m, rad
        Standard deviations, for each axis, of errors of the tool's position and rotation that come
        neither from the joints nor from the table.
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
        """
        Return the standard deviations of the joint positions, rad or m, computed from noise,
        resolution and backlash.
        """
        # Errors of resolution and backlash are uniform. A uniform distribution of width w has the
        # standard deviation w / sqrt(12).
        return tuple(
            math.sqrt(noise**2 + (step**2 + play**2) / 12.0)
            for noise, step, play in zip(self.noise, self.resolution, self.backlash)
        )

    @property
    def of_pose(self) -> bool:
        """Return whether any standard deviation that affects the pose of the tool is above 0."""
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
    Standard deviations of the numbers of the table, from the tolerances of the manufacturer.

    Parameters
    ----------
    length, angle, gear : m, rad, relative
        Standard deviations of each length, angle and gear ratio; None if the file gives no value.
    named
        Standard deviations of single numbers, by the names of the calibration parameters, such as
        theta2 or gear2.
    """

    length: float | None = None
    angle: float | None = None
    gear: float | None = None
    named: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class SpeedLimit:
    """
    The largest allowed speeds of the tool or of a point; inf for a speed without a limit.

    Parameters
    ----------
    of
        `tool`, or the name of the point.
    linear, angular : m/s, rad/s
        Largest speed of the point, and largest angular velocity of its frame.
    reduced : m/s
        Largest speed of the point while the arm moves at reduced speed.
    """

    of: str
    linear: float
    angular: float
    reduced: float


class MimicFormula(NamedTuple):
    """
    A mimic joint, whose position is multiplier * (position of its leader) + offset.

    Attributes
    ----------
    name, leader
        Names in JointState messages. The leader is a joint of the arm; the mimicking joint is not.
    offset : rad or m
        The position of the mimicking joint if the leader is at 0.
    slides
        Whether the mimicking joint slides.
    """

    name: str
    leader: str
    multiplier: float
    offset: float
    slides: bool


@dataclass(frozen=True)
class RobotDescription:
    """
    The content of a valid robot file, in SI units.

    Parameters
    ----------
    angle_unit, length_unit
        The units of the expressions in the file. The numbers in this object are in SI units,
        except the values of constants.
    links
        The rows of the table, in the form of the convention.
    points
        The points in the order of the file, without the tool.
    uncertainty
        The section `uncertainty`; None if the file does not have it.
    warnings
        Probable mistakes in the file, such as a number in a wrong unit or an unused constant.
    remarks
        Sentences about the file that only the command `check` prints.
    file
        The path as the user gave it.
    tolerances
        Standard deviations of the numbers of the table, from the manufacturer.
    sha256
        The SHA-256 digest of the file in hexadecimal digits; '' for a text without a file.
    loops
        The closed loops in the order of the file. A loop may use the passive joints of earlier
        loops.
    parts
        The paths of the robot files of a cell's arms; empty for a single arm.
    speed_limits
        The speed limits in the order of the file.
    mimics
        Joints of a URDF that mimic joints of the arm.
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
        """Return the file's unit of angles in rad: 1, or pi/180 for degrees."""
        return math.pi / 180.0 if self.angle_unit == 'deg' else 1.0

    @property
    def metres(self) -> float:
        """Return the file's unit of lengths in m: 1, or 0.001 for millimetres."""
        return 1e-3 if self.length_unit == 'mm' else 1.0
