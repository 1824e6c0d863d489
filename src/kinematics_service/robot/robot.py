# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Build a robot: the data of one arm that the kernel needs at every q."""

import os
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..errors import Fault, KinematicsError, PointError, RobotFileError
from ..kernel import Chain, Floats
from ..notebook import as_html
from ..typography import counted
from .bundled import RobotSource, bundled_robots, find_robot
from .cell import read_robot
from .chain import FrozenArrays
from .file.parts.description import Factor, RobotDescription
from .file.parts.loop_groups import group_name, loop_groups
from .file.reader import parse_robot
from .loops import chain_of, closure_of, variables_of
from .measures import Thresholds
from .points import TOOL, Point, described_point, ending_at, known_points
from .points import with_tool as described_with_tool
from .singularity_model import SingularityModel, singularity_model
from .task import find_task, generic_poses


@dataclass(frozen=True, eq=False)
class Robot(FrozenArrays):
    """
    The read-only data of one arm: its joints, frames, chain and singularity model.

    Attributes
    ----------
    name, source, convention
        The values of the keys `robot`, `source` and `convention` in the robot file.
    joint_names, variables
        Names of the n joints in JointState messages, and in the expressions of the robot file.
    joint_types
        Type of each of the n joints: `revolute`, `prismatic` or `helical`.
    limits : shape (n, 2), rad or m
        Lower and upper limits of the joint positions, infinite for no limit; read-only.
    velocity_limits, acceleration_limits : shape (n,), rad/s or m/s, rad/s^2 or m/s^2
        Infinite for no limit; read-only.
    base_frame, tool_frame
        Names of the frames; a pose of the robot is that of the tool in the base frame.
    rows
        Number of rows of the table.
    chain
        The kernel's chain from the base to the tool.
    singularity
        The task, the thresholds and the named factors, which decide whether a pose is singular.
    description
        The content of the robot file, in SI units.
    """

    name: str
    source: str
    convention: str
    joint_names: tuple[str, ...]
    variables: tuple[str, ...]
    joint_types: tuple[str, ...]
    limits: Floats
    velocity_limits: Floats
    acceleration_limits: Floats
    base_frame: str
    tool_frame: str
    rows: int
    chain: Chain
    singularity: SingularityModel
    description: RobotDescription

    def __post_init__(self) -> None:
        """Check that `singularity.chain` is the object `chain`, not a copy of it."""
        super().__post_init__()
        if self.singularity.chain is not self.chain:
            raise TypeError('the chain of a robot is not that of its singularity model')

    @property
    def dof(self) -> int:
        """Return the number of joints n."""
        return len(self.joint_names)

    @cached_property
    def prismatic(self) -> npt.NDArray[np.bool_]:
        """Return for each joint whether it slides, shape (n,); read-only."""
        slides = np.array([kind == 'prismatic' for kind in self.joint_types])
        slides.setflags(write=False)
        return slides

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Return the unit of each joint position, `rad` or `m`."""
        return tuple('m' if slides else 'rad' for slides in self.prismatic)

    @cached_property
    def continuous(self) -> tuple[bool, ...]:
        """Return for each joint whether it turns without limits, so that its angle may wrap."""
        return tuple(
            kind == 'revolute' and bool(np.all(np.isinf(limits)))
            for kind, limits in zip(self.joint_types, self.limits)
        )

    @property
    def passive_joint_names(self) -> tuple[str, ...]:
        """Return the names of the joints that closed loops move, in the order of the file."""
        return variables_of(self.description)[self.dof :]

    @property
    def loop_names(self) -> tuple[str, ...]:
        """
        Return the names of the arm's closed loops; `a + b` for two loops that are solved together.
        The result is empty if no loop moves the tool.
        """
        groups = loop_groups(self.description.loops) if self.chain.loops else ()
        return tuple(map(group_name, groups))

    @property
    def points(self) -> tuple[str, ...]:
        """Return the names of the points: `tool`, followed by the points of the robot file."""
        return known_points(self.description)

    @cached_property
    def _found_points(self) -> dict[str | int, Point]:
        return {}

    @cached_property
    def _found_ends(self) -> dict[str, 'Robot']:
        return {}

    def point(self, of: str | int) -> Point:
        """
        Return a point of the arm, by its name or by the number of a table row.

        Parameters
        ----------
        of
            `tool`, the name of a point in the robot file, or the number of a row: 0 is the table's
            frame 0, i the frame after row i.

        Raises
        ------
        PointError
            The arm has no such point or row.
        """
        # Look up stored points only if `of` is a str or an int. As keys, True and 1.0 would find
        # row 1.
        if type(of) is str or type(of) is int:
            point = self._found_points.get(of)
            if point is not None:
                return point
        described, chain = described_point(self.description, of), self.chain
        if of != TOOL:
            chain = chain_of(self.description, chain.closure, described)
        key = of if isinstance(of, str) else int(of)
        return self._found_points.setdefault(key, Point(described.name, chain))

    def ending_at(self, of: str | int, at: npt.ArrayLike | None = None) -> 'Robot':
        """
        Return an arm that ends at a point of this arm: the point is the tool of the result.

        The name of the result consists of the names of arm and point, such as `puma560_elbow`. The
        task is chosen from the joints that move the point, and the thresholds are the defaults.
        The Jacobian keeps columns of zeros for joints after the point.

        Parameters
        ----------
        of
            The point, given as in `Robot.point`.
        at : shape (3,), m
            Another origin of the tool, in the frame of the point.

        Raises
        ------
        PointError
            The arm has no such point or row, no joint moves the point, or `at` is not three finite
            numbers.
        """
        point = self.point(of)
        arm = self._found_ends.get(point.name) if at is None else None
        if arm is not None:
            return arm
        if not point.chain.entries:
            sentence = (
                f'no joint moves {of!r} of {self.name}, so it cannot be singular; '
                'give a point after the first joint'
            )
            raise PointError(sentence, 'of', self.points, of, code='no-effect')
        description = ending_at(self.description, of, at)
        robot = self if description is self.description else _build_for_its_joints(description)
        if at is None:
            self._found_ends[point.name] = robot
        return robot

    def __repr__(self) -> str:
        return f'Robot({self.name!r}, {counted(self.dof, "joint")}, {self.convention})'

    _repr_html_ = as_html


def build_robot(description: RobotDescription, in_letters: bool = False) -> Robot:
    """
    Return the robot of a description, which is the content of a robot file.

    Parameters
    ----------
    in_letters
        True to accept constants without a value. Then only results that hold for every value of
        these constants are valid.

    Raises
    ------
    RobotFileError
        No joint moves the tool, a loop does not close, the thresholds do not fit the arm, or
        constants have no value.
    """
    if description.letters and (not in_letters or description.loops):
        message = f'{description.letters}: no value; write a number for each'
        if not description.loops:
            message += ' (check, derive and compare work without)'
        raise RobotFileError((Fault(description.file, 0, 'constants', message, 'no-value'),))
    joints = description.joints
    chain = chain_of(description, closure_of(description))
    try:
        singularity = singularity_model(description, chain)
    except KinematicsError as error:
        fault = Fault(description.file, 1, 'singularity', str(error), error.code)
        raise RobotFileError((fault,)) from None
    if barely_moved := singularity.task.barely_moved:
        doubt = Fault(description.file, 0, 'singularity', barely_moved, 'barely-moved')
        description = replace(description, warnings=(*description.warnings, doubt))
    return Robot(
        name=description.name,
        source=description.source,
        convention=description.convention,
        joint_names=tuple(joint.name for joint in joints),
        variables=tuple(joint.variable for joint in joints),
        joint_types=tuple(joint.type for joint in joints),
        limits=singularity.limits,
        velocity_limits=np.array([joint.velocity for joint in joints]),
        acceleration_limits=np.array([joint.acceleration for joint in joints]),
        base_frame=description.base.frame,
        tool_frame=description.tool.frame,
        rows=len(description.links),
        chain=chain,
        singularity=singularity,
        description=description,
    )


def _build_for_its_joints(description: RobotDescription) -> Robot:
    # Build a robot, and choose its task without the Jacobian columns of its unused joints. If the
    # arm has closed loops, choose the task from all joints.
    if description.loops:
        return build_robot(description)
    joints = tuple(joint for joint in description.joints if not joint.unused)
    of_joints = replace(description, joints=joints)
    task = singularity_model(of_joints, chain_of(of_joints, None)).task
    singularity = replace(description.singularity, task=task.rows)
    return build_robot(replace(description, singularity=singularity))


def with_chain(robot: Robot, chain: Chain) -> Robot:
    """Return a copy of a robot with another kernel chain. The task and the thresholds stay."""
    return replace(robot, chain=chain, singularity=replace(robot.singularity, chain=chain))


def with_singularity(
    robot: Robot, length: float | None = None, thresholds: Thresholds | None = None
) -> Robot:
    """Return a copy of a robot with another characteristic length (m) or other thresholds."""
    task = robot.singularity.task
    if length is not None and length != task.length:
        q = generic_poses(robot.chain, robot.limits, robot.prismatic)
        task = find_task(robot.chain, robot.joint_names, q, robot.prismatic, task.rows, length)
    thresholds = thresholds or robot.singularity.thresholds
    judged = replace(robot.singularity, task=task, thresholds=thresholds)
    return replace(robot, singularity=judged)


@lru_cache(maxsize=32)
def with_tool(
    robot: Robot,
    xyz: tuple[float, ...] | None = None,
    rpy: tuple[float, ...] | None = None,
) -> Robot:
    """
    Return an arm with another tool, given by the tool's position or orientation.

    The section `singularity` of the robot file applies to the new tool, too. A singular factor in
    this section is left out if its zeros are not singular poses of the arm with the new tool.

    Parameters
    ----------
    robot
        The arm of the file.
    xyz : m
        Origin of the tool in the frame after the last row; default: the origin in the file.
    rpy : rad
        Orientation of the tool in the frame after the last row, R = Rz(yaw) Ry(pitch) Rx(roll);
        default: the orientation in the file.

    Raises
    ------
    RobotFileError
        No joint moves the tool, or the thresholds do not fit the arm.
    """
    if xyz is None and rpy is None:
        return robot
    description = described_with_tool(robot.description, xyz, rpy)
    try:
        return build_robot(description)
    except RobotFileError:
        bare = build_robot(_with_factors(description, ()))
    factors = description.singularity.factors
    kept = tuple(factor for factor in factors if _is_accepted(description, factor))
    return build_robot(_with_factors(description, kept)) if kept else bare


def _with_factors(description: RobotDescription, factors: tuple[Factor, ...]) -> RobotDescription:
    return replace(description, singularity=replace(description.singularity, factors=factors))


def _is_accepted(description: RobotDescription, factor: Factor) -> bool:
    # Return whether `build_robot` accepts this factor. `build_robot` refuses a factor that is zero
    # at a pose that is not singular.
    with suppress(RobotFileError):
        return build_robot(_with_factors(description, (factor,))) is not None
    return False


def load_robot(name: str | os.PathLike[str]) -> Robot:
    """
    Return the robot that a YAML file, a URDF or a cell describes, or a bundled robot.

    The function reads the file of a bundled robot only once, and any other file at every call.

    Parameters
    ----------
    name
        A path such as `config/craig_3r.yaml`, or a bundled name such as `puma560`. For a URDF,
        `arm.urdf` means the longest chain of joints, without the joints of a hand, and
        `arm.urdf:BASE:TIP` the chain between two links. For a cell, `cell.yaml` means the motion
        of the second arm's tool relative to the first arm's tool. `cell.yaml:BASE:TIP` means the
        motion of TIP relative to BASE. BASE and TIP are arms, or points of arms such as
        `left/elbow`. If BASE is the frame of the cell, the result is one arm.

    Raises
    ------
    RobotNotFoundError
        The name is neither a file nor a bundled robot.
    RobotFileError
        The file is not a valid robot; the message has a line for each fault.
    UrdfError
        The URDF has no chain from BASE to TIP. Or the chain has a joint that a robot file cannot
        express.
    """
    source = find_robot(name)
    if os.fspath(name) in bundled_robots():
        return _robot_of(source, *file_state(source.file))
    return build_robot(read_robot(source))


# The type of the argument `robot` of the library's functions: a Robot, the name of a bundled
# robot, or the path of a file.
AnyRobot: TypeAlias = Robot | str | os.PathLike[str]


def as_robot(robot: AnyRobot) -> Robot:
    """
    Return the robot for an argument that is a Robot, a bundled robot's name or a file's path.

    The first call reads the file; a later call reads it again only if the file has changed.

    Raises
    ------
    RobotNotFoundError, RobotFileError, UrdfError
        The errors that `load_robot` raises.
    """
    if isinstance(robot, Robot):
        return robot
    source = find_robot(robot)
    source = source._replace(file=source.file.absolute())
    try:
        state = file_state(source.file)
        parts = _robot_of(source, *state).description.parts
        return _robot_of(source, *state, *(k for part in parts for k in file_state(part)))
    except OSError:
        # The file cannot be read. This call raises an error that says why.
        return load_robot(robot)


def robot_in_letters(robot: AnyRobot) -> Robot:
    """
    Return the robot that the argument names, as `as_robot` does. Constants in its file may be
    without a value.
    """
    if not isinstance(robot, str | os.PathLike) or os.fspath(robot) in bundled_robots():
        return as_robot(robot)
    return build_robot(read_robot(find_robot(robot)), in_letters=True)


def file_state(file: str | os.PathLike[str]) -> tuple[int, int, int]:
    """
    Return three numbers that change if a file changes: modification time (ns), size and inode.
    """
    state = os.stat(file)
    return state.st_mtime_ns, state.st_size, state.st_ino


@lru_cache(maxsize=64)
def _robot_of(source: RobotSource, *_state: int) -> Robot:
    return build_robot(read_robot(source))


def robot_from_text(text: str, file: str = '<text>') -> Robot:
    """
    Return the robot that a text in the format of a robot file describes.

    Raises
    ------
    RobotFileError
        The text is not a valid robot.
    """
    return build_robot(parse_robot(text, file))
