"""Hold the links and joints of a URDF that will be written, as frozen data."""

from dataclasses import dataclass

from ...kernel import Floats
from ..file.parts.quantities import LARGEST

# Stands for no limit where URDF requires a number: the largest number that a robot file accepts.
UNLIMITED = LARGEST
# The versions of URDF that urdfdom 6.0 reads; a file without a version has the first.
VERSIONS = ('1.0', '1.1', '1.2')
# Element of the root with the attribute joint_order, if the robot file has the joints in another
# order than the chain. Other readers of URDF skip unknown elements.
EXTENSION = 'kinematics_service'


@dataclass(frozen=True)
class Limit:
    """
    The limits that URDF requires of a joint that is not continuous; UNLIMITED for no limit.

    Parameters
    ----------
    lower, upper : rad or m
        None for a continuous joint.
    velocity : rad/s or m/s
    """

    lower: float | None
    upper: float | None
    velocity: float


@dataclass(frozen=True)
class Mimic:
    """The position of the joint is `multiplier` times that of another joint."""

    joint: str
    multiplier: float


@dataclass(frozen=True, eq=False)
class PlannedJoint:
    """
    One `<joint>`.

    Parameters
    ----------
    name, type, parent, child
        Type: `fixed`, `revolute`, `continuous` or `prismatic`.
    origin : shape (4, 4), m
        Pose of the child in the parent, at position 0.
    sign
        The joint turns about, or slides along, sign times z.
    limit, mimic
        None for a joint without limits, or one that mimics no other.
    hub
        Whether the joint is drawn: only the first of several joints on one axis is.
    """

    name: str
    type: str
    parent: str
    child: str
    origin: Floats
    sign: float = 1.0
    limit: Limit | None = None
    mimic: Mimic | None = None
    hub: bool = False


@dataclass(frozen=True)
class UrdfPlan:
    """
    A URDF: links and joints, root first.

    Parameters
    ----------
    frames
        The links that are the frames of the table: [0] frame 0, [i] after row i.
    tool
        The link that is the tool frame.
    joint_order
        The names of the actuated joints if the chain has another order; else empty.
    """

    links: tuple[str, ...]
    joints: tuple[PlannedJoint, ...]
    frames: tuple[str, ...]
    tool: str
    joint_order: tuple[str, ...]


@dataclass(frozen=True)
class FrameNames:
    """
    Names of frames for a URDF, in place of those of the robot file.

    Parameters
    ----------
    base, tool
        Names of the base and tool frames; empty for those of the file.
    frame_prefix
        Prefix of every frame.
    """

    base: str = ''
    tool: str = ''
    frame_prefix: str = ''


AS_IN_THE_FILE = FrameNames()
