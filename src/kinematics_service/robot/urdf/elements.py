"""The links and joints a URDF is to have, as frozen data."""

from dataclasses import dataclass

from ...kernel import Floats
from ..file.parts.quantities import LARGEST

# URDF requires numbers that a robot file may lack: the largest that a robot file accepts.
UNLIMITED = LARGEST
# The versions of URDF that urdfdom 6.0 reads; a file without a version is of the first.
VERSIONS = ('1.0', '1.1', '1.2')
# If the order of the joints in the robot file is not that of the chain, the root has this element
# with the attribute joint_order; readers of URDF skip elements they do not know.
EXTENSION = 'kinematics_service'


@dataclass(frozen=True)
class Limit:
    """
    The limits that URDF requires of a joint that is not continuous; UNLIMITED stands for infinity.

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
    """This joint's position is `multiplier` times another's."""

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
        None if there is none.
    hub
        Whether it is drawn: of several joints on one axis only the first is.
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
        The names of the actuated joints if the chain's order is another; else empty.
    """

    links: tuple[str, ...]
    joints: tuple[PlannedJoint, ...]
    frames: tuple[str, ...]
    tool: str
    joint_order: tuple[str, ...]


@dataclass(frozen=True)
class FrameNames:
    """
    The names of frames and joints if they are not those of the robot file.

    Parameters
    ----------
    base, tool
        Names instead of the file's; empty: the file's.
    frame_prefix
        Put before every frame.
    """

    base: str = ''
    tool: str = ''
    frame_prefix: str = ''


AS_IN_THE_FILE = FrameNames()
