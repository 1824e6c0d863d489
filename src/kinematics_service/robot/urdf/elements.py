# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Hold the links and joints of a URDF before the program writes it."""

from dataclasses import dataclass

from ...kernel import Floats
from ..file.parts.quantities import LARGEST

# This number, the largest that a robot file accepts, means no limit where URDF requires a number.
UNLIMITED = LARGEST
# The versions of URDF that urdfdom 6.0 reads. A file without a version counts as version 1.0.
VERSIONS = ('1.0', '1.1', '1.2')
# Name of the element with the attribute `joint_order`. The program writes this element if the
# joints in the robot file have another order than in the chain. Other readers of URDF skip unknown
# elements.
EXTENSION = 'kinematics_service'


@dataclass(frozen=True)
class Limit:
    """
    The element `<limit>` of a joint. URDF requires this element unless the joint is continuous.
    The number UNLIMITED means no limit.

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
    """
    The element `<mimic>` of a joint, whose position is `multiplier` times the position of the
    joint `joint`.
    """

    joint: str
    multiplier: float


@dataclass(frozen=True, eq=False)
class PlannedJoint:
    """
    One element `<joint>` of a URDF that the program will write.

    Parameters
    ----------
    name, type, parent, child
        Names of the joint and its links; the type is `fixed`, `revolute`, `continuous` or
        `prismatic`.
    origin : shape (4, 4), m
        Pose of the child link in the parent link, at position 0.
    sign
        1 or -1: the axis of the joint is sign times z.
    limit, mimic
        None in `limit` means a joint without limits. None in `mimic` means a joint that mimics no
        other joint.
    hub
        Whether the joint has a shape in pictures: only the first of several joints on one axis has
        a shape.
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
    The content of a URDF that the program will write: its links and joints, root first.

    Parameters
    ----------
    frames
        The links for the frames of the table: frames[0] is frame 0, frames[i] is after row i.
    tool
        The link for the tool frame.
    joint_order
        The names of the actuated joints in the order of the robot file; empty if the chain has the
        same order.
    """

    links: tuple[str, ...]
    joints: tuple[PlannedJoint, ...]
    frames: tuple[str, ...]
    tool: str
    joint_order: tuple[str, ...]


@dataclass(frozen=True)
class FrameNames:
    """
    Names of frames in a URDF that replace the names in the robot file.

    Parameters
    ----------
    base, tool
        Names of the base and tool frames; '' keeps the names in the robot file.
    frame_prefix
        Prefix of the name of every frame.
    """

    base: str = ''
    tool: str = ''
    frame_prefix: str = ''


AS_IN_THE_FILE = FrameNames()
