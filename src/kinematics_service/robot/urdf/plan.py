# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Convert the table of a robot to the links and joints of a URDF.

Every frame of the table becomes a link. In a row, `theta` and `d` are sums of terms, and a term is
a factor times a joint variable. Every term becomes a joint of the URDF, about or along the z axis
of the row. For each joint variable, the first term with the variable becomes a joint whose
position is the variable. Later terms with the same variable become joints that mimic the first
joint.

- `theta3 - theta2` becomes two joints: one joint turns by theta3, the other by -theta2.
- A helical joint becomes a joint that turns and a joint that slides.
- A gear `q1/3` becomes two joints on one axis, because q1/3 = q1 - 2/3 q1. The first joint turns
  by q1, and the second joint mimics the first with the factor -2/3.

Therefore a URDF can express every robot file without loops.
"""

import itertools
import math
from collections.abc import Iterator, Mapping
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
    # One term of theta or d in a table row: a factor times the variable with the index `joint`.
    # Each term becomes a joint of the URDF. A variable may have several terms, and one of them is
    # the leading term (`leads` is true). The position of the leading term's joint is the variable
    # itself. The joints of the other terms mimic the joint of the leading term.
    joint: int
    turns: bool
    factor: float
    leads: bool = False


def _unique(name: str, taken: set[str]) -> str:
    # Append underscores to a name until it is not in `taken`. Add the result to `taken`, and
    # return it.
    while name in taken:
        name += '_'
    taken.add(name)
    return name


def _motions(row: Row, index_of: Mapping[str, int]) -> list[_JointTerm]:
    turning = [_JointTerm(index_of[v], True, c) for v, c in row.theta.coefficients]
    return turning + [_JointTerm(index_of[v], False, c) for v, c in row.d.coefficients]


def _with_leaders(robot: Robot, rows: list[list[_JointTerm]]) -> list[list[_JointTerm]]:
    # Choose the first term of each variable (in theta or d) as its leader. The leader becomes the
    # joint of the variable, and other terms become mimic joints. A leader has the factor 1 or -1.
    # If the term has another factor, split the term into a leader and a second term:
    # q/3 = q - 2/3 q. In each row, put leaders before other terms, because Pinocchio needs this
    # order.
    with_leader: set[int] = set()
    result = []
    for row in rows:
        leaders, followers = [], []
        for motion in row:
            slides = bool(robot.prismatic[motion.joint])
            if motion.joint in with_leader or motion.turns == slides:
                followers.append(motion)
                continue
            with_leader.add(motion.joint)
            sign = math.copysign(1.0, motion.factor)
            leaders.append(replace(motion, factor=sign, leads=True))
            if motion.factor != sign:
                followers.append(replace(motion, factor=motion.factor - sign))
        result.append(leaders + followers)
    return result


class _Planner:
    def __init__(self, robot: Robot, names: FrameNames) -> None:
        self.robot = robot
        self.base = names.frame_prefix + (names.base or robot.base_frame)
        self.tool = names.frame_prefix + (names.tool or robot.tool_frame)
        self.points = {
            names.frame_prefix + point.name: point for point in robot.description.points
        }
        self._stem = f'{names.frame_prefix}{robot.name}_frame'
        self._links = {self.base, self.tool, *self.points}
        self._joints = set(robot.joint_names)

    def plan(self) -> UrdfPlan:
        robot, rows = self.robot, table_rows(self.robot.description)
        index_of = {variable: j for j, variable in enumerate(robot.variables)}
        motions = _with_leaders(robot, [_motions(row, index_of) for row in rows])
        frames = [_unique(f'{self._stem}_{i}', self._links) for i in range(len(rows) + 1)]
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
        names = [joint.name for joint in joints if joint.type != 'fixed' and not joint.mimic]
        order = tuple(name for name in robot.joint_names if name in names)
        # Readers of URDF order joints as in the chain. So write the order of the joints only if it
        # differs from the order in the chain.
        order = () if list(order) == names else order
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
            end = child if last and ends_here else _unique(axis, self._links)
            yield self._moving(i, motion, parent, end, still, k == 0)
            parent, still = end, IDENTITY
        if not ends_here:
            yield self._fixed(parent, child, row.after)

    def _fixed(self, parent: str, child: str, origin: Floats) -> PlannedJoint:
        name = _unique(f'{child}_fixed', self._joints)
        return PlannedJoint(name, 'fixed', parent, child, origin)

    def _idle(self, j: int) -> PlannedJoint:
        # No row of the table contains variable j. Return a joint at the base that is not part of
        # the chain, so that the URDF has all joints of the robot.
        end = _unique(f'{self._stem}_idle_{self.robot.variables[j]}', self._links)
        term = _JointTerm(j, not self.robot.prismatic[j], 1.0, True)
        return self._moving(0, term, self.base, end, IDENTITY, False)

    def _moving(
        self, i: int, term: _JointTerm, parent: str, child: str, origin: Floats, hub: bool
    ) -> PlannedJoint:
        j, factor, name = term.joint, term.factor, self.robot.joint_names[term.joint]
        limits, velocity = self.robot.limits[j], float(self.robot.velocity_limits[j])
        # A helical joint becomes a turning joint and a sliding joint that mimics it. Give the
        # turning joint the type `revolute` even if it has no limits. The type `continuous` would
        # be wrong: Pinocchio represents the angle of a continuous joint by (cos, sin), and a
        # sliding joint cannot mimic this pair. Give a turning mimic joint the same type as the
        # joint that it mimics, because Pinocchio requires this.
        helical = self.robot.joint_types[j] == 'helical'
        kind = 'revolute' if helical or np.isfinite(limits).any() else 'continuous'
        kind = kind if term.turns else 'prismatic'
        mimic = None
        if not term.leads:
            limits, velocity = np.sort(factor * limits), abs(factor) * velocity
            name, mimic = _unique(f'{name}_in_row_{i}', self._joints), Mimic(name, factor)
            factor = 1.0
        lower, upper, speed = np.clip([*limits, velocity], -UNLIMITED, UNLIMITED).tolist()
        limit: Limit | None = Limit(lower, upper, speed)
        if kind == 'continuous':
            limit = Limit(None, None, velocity) if math.isfinite(velocity) else None
        return PlannedJoint(name, kind, parent, child, origin, factor, limit, mimic, hub)


def plan_of(robot: Robot, names: FrameNames = AS_IN_THE_FILE) -> UrdfPlan:
    """
    Return the links and joints of a robot's URDF. The base frame is the root link, and the tool
    frame is the last leaf.
    """
    return _Planner(robot, names).plan()
