"""
A robot's table laid out as the links and joints of a URDF.

Every frame of the table becomes a link. A variable's URDF joint is where it first occurs in the
table, about z or -z. The other terms in `theta` and `d` become further joints on the same axis
that mimic it: `theta3 - theta2` turns by theta2 and by -1 times theta3, a helical joint turns and
slides, and behind a gear `q1/3` is q1 and -2/3 times q1. So every robot file can be expressed.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...kernel import Floats
from ...rigid_motion import screw_z
from ..conventions import Row, table_rows
from ..robot import Robot
from .elements import AS_IN_THE_FILE, UNLIMITED, FrameNames, Limit, Mimic, PlannedJoint, UrdfPlan

IDENTITY = np.eye(4)


@dataclass(frozen=True)
class _JointTerm:
    # One term of theta or d: a variable (its index) times a factor. One of each joint's terms
    # leads: it is the joint itself.
    joint: int
    turns: bool
    factor: float
    leads: bool = False


class _UniqueNames:
    # Names that are unique: a second use of a name gets an underscore more.
    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = set(taken)

    def new(self, name: str) -> str:
        while name in self._taken:
            name += '_'
        self._taken.add(name)
        return name


def _motions(row: Row, index_of: Mapping[str, int]) -> list[_JointTerm]:
    turning = [_JointTerm(index_of[v], True, c) for v, c in row.theta.coefficients]
    return turning + [_JointTerm(index_of[v], False, c) for v, c in row.d.coefficients]


def _with_leaders(robot: Robot, rows: list[list[_JointTerm]]) -> list[list[_JointTerm]]:
    # For each joint its first motion becomes the joint itself, with factor +-1, and a rest that
    # follows it. It comes first, because Pinocchio needs the joint to mimic before the joint that
    # mimics.
    led: set[int] = set()
    result = []
    for row in rows:
        leaders, followers = [], []
        for motion in row:
            slides = bool(robot.prismatic[motion.joint])
            if motion.joint in led or motion.turns == slides:
                followers.append(motion)
                continue
            led.add(motion.joint)
            sign = math.copysign(1.0, motion.factor)
            leaders.append(replace(motion, factor=sign, leads=True))
            if motion.factor != sign:
                followers.append(replace(motion, factor=motion.factor - sign))
        result.append(leaders + followers)
    return result


class _Planner:
    def __init__(self, robot: Robot, names: FrameNames) -> None:
        self.robot = robot
        self.joint_names = robot.joint_names
        self.base = names.frame_prefix + (names.base or robot.base_frame)
        self.tool = names.frame_prefix + (names.tool or robot.tool_frame)
        self.points = {
            names.frame_prefix + point.name: point for point in robot.description.points
        }
        self._stem = f'{names.frame_prefix}{robot.name}_frame'
        self._new_link = _UniqueNames((self.base, self.tool, *self.points)).new
        self._new_joint = _UniqueNames(self.joint_names).new

    def plan(self) -> UrdfPlan:
        robot, rows = self.robot, table_rows(self.robot.description)
        index_of = {variable: j for j, variable in enumerate(robot.variables)}
        motions = _with_leaders(robot, [_motions(row, index_of) for row in rows])
        frames = [self._new_link(f'{self._stem}_{i}') for i in range(len(rows) + 1)]
        base = robot.description.base.motion.matrix
        joints = [self._fixed(self.base, frames[0], base)]
        ends = itertools.pairwise(frames)
        for i, (row, moving, (parent, child)) in enumerate(zip(rows, motions, ends), start=1):
            joints += self._row(i, row, moving, parent, child)
        joints += [
            self._fixed(frames[point.row], name, point.motion.matrix)
            for name, point in self.points.items()
        ]
        joints.append(self._fixed(frames[-1], self.tool, robot.description.tool.motion.matrix))
        order = self._order(joints)
        moved = {motion.joint for motion in itertools.chain(*motions)}
        joints += [self._idle(j) for j in range(robot.dof) if j not in moved]
        links = (self.base, *(joint.child for joint in joints))
        return UrdfPlan(links, tuple(joints), tuple(frames), self.tool, order)

    def _row(
        self, i: int, row: Row, moving: list[_JointTerm], parent: str, child: str
    ) -> Iterator[PlannedJoint]:
        still = row.before @ screw_z(row.theta.constant, row.d.constant)
        if not moving:
            yield self._fixed(parent, child, still @ row.after)
            return
        ends_here = np.array_equal(row.after, IDENTITY)
        for k, motion in enumerate(moving):
            last = k == len(moving) - 1
            axis = f'{self._stem}_{i}_axis' + (f'_{k + 1}' if k else '')
            end = child if last and ends_here else self._new_link(axis)
            if motion.leads:
                yield self._actuated(motion.joint, motion.factor, parent, end, still, k == 0)
            else:
                yield self._follower(i, motion, parent, end, still, k == 0)
            parent, still = end, IDENTITY
        if not ends_here:
            yield self._fixed(parent, child, row.after)

    def _fixed(self, parent: str, child: str, origin: Floats) -> PlannedJoint:
        return PlannedJoint(self._new_joint(f'{child}_fixed'), 'fixed', parent, child, origin)

    def _idle(self, j: int) -> PlannedJoint:
        # The variable is in no row; its name is kept all the same.
        end = self._new_link(f'{self._stem}_idle_{self.robot.variables[j]}')
        return self._actuated(j, 1.0, self.base, end, IDENTITY, False)

    def _type(self, j: int) -> str:
        if self.robot.prismatic[j]:
            return 'prismatic'
        # A joint that is to be followed by a sliding one is not continuous: to Pinocchio that is
        # a pair (cos, sin), which no length can mimic.
        helical = self.robot.joint_types[j] == 'helical'
        limited = bool(np.isfinite(self.robot.limits[j]).any())
        return 'revolute' if limited or helical else 'continuous'

    def _actuated(
        self, j: int, sign: float, parent: str, child: str, origin: Floats, hub: bool
    ) -> PlannedJoint:
        kind = self._type(j)
        limit = _limit(kind, self.robot.limits[j], self.robot.velocity_limits[j])
        return PlannedJoint(
            self.joint_names[j], kind, parent, child, origin, sign, limit, None, hub
        )

    def _follower(
        self, i: int, motion: _JointTerm, parent: str, child: str, origin: Floats, hub: bool
    ) -> PlannedJoint:
        j, factor = motion.joint, motion.factor
        # Revolute like the joint it follows, continuous like it: Pinocchio accepts no other.
        kind = self._type(j) if motion.turns else 'prismatic'
        limits = np.sort(factor * self.robot.limits[j])
        limit = _limit(kind, limits, abs(factor) * self.robot.velocity_limits[j])
        name = self._new_joint(f'{self.joint_names[j]}_in_row_{i}')
        mimic = Mimic(self.joint_names[j], factor)
        return PlannedJoint(name, kind, parent, child, origin, 1.0, limit, mimic, hub)

    def _order(self, joints: list[PlannedJoint]) -> tuple[str, ...]:
        # A reader finds the joints in the order in which they move the chain.
        moving = (joint for joint in joints if joint.type != 'fixed')
        found = [joint.name for joint in moving if joint.mimic is None]
        ours = [name for name in self.joint_names if name in found]
        return () if found == ours else tuple(ours)


def _limit(kind: str, limits: Floats, velocity: float) -> Limit | None:
    lower, upper = (_number(end) for end in limits)
    if kind == 'continuous':
        return Limit(None, None, velocity) if math.isfinite(velocity) else None
    return Limit(lower, upper, _number(velocity))


def _number(value: float) -> float:
    return min(max(float(value), -UNLIMITED), UNLIMITED)


def plan_of(robot: Robot, names: FrameNames = AS_IN_THE_FILE) -> UrdfPlan:
    """
    Return the links and joints of a robot, its base frame the root, its tool frame the last leaf.
    """
    return _Planner(robot, names).plan()
