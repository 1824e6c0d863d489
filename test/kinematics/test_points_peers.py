# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Any frame, any point, any axes: the same numbers under the names of other libraries."""

import numpy as np
import pytest
from arms import DISTINCT_BUNDLED, poses, robot_of
from tolerances import ROUND_OFF

import kinematics_service as ks

pytestmark = pytest.mark.peers

# Pinocchio's Jacobian has the columns of all joints only where none mimics another.
UNCOUPLED = tuple(name for name in DISTINCT_BUNDLED if not name.startswith('parallelogram'))
AT = np.array([0.3, -0.2, 0.5])


def agree(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF)


class InPinocchio:
    """A robot's URDF in Pinocchio: every row of the table and every point is a frame of it."""

    def __init__(self, robot):
        self.pinocchio = pytest.importorskip('pinocchio')
        self.robot = robot
        self.model = self.pinocchio.buildModelFromXML(ks.export_urdf(robot), True)
        self.data = self.model.createData()
        joints = [self.model.joints[self.model.getJointId(name)] for name in robot.joint_names]
        self.columns = [joint.idx_v for joint in joints]
        self.places = [(joint.idx_q, joint.nq) for joint in joints]

    def add_point(self, frame, at):
        """Add a frame fixed to another one, its axes parallel, and return its number."""
        old = self.model.frames[self.model.getFrameId(frame)]
        place = old.placement * self.pinocchio.SE3(np.eye(3), at)
        kind = self.pinocchio.FrameType.OP_FRAME
        number = self.model.addFrame(
            self.pinocchio.Frame(f'{frame}_point', old.parentJoint, place, kind)
        )
        self.data = self.model.createData()
        return number

    def whole(self, q):
        values = self.pinocchio.neutral(self.model)
        for (at, size), value in zip(self.places, q):
            values[at : at + size] = [np.cos(value), np.sin(value)] if size == 2 else value
        return values

    def jacobian(self, q, frame, axes):
        reference = getattr(self.pinocchio.ReferenceFrame, axes)
        J = self.pinocchio.computeFrameJacobian(
            self.model, self.data, self.whole(q), frame, reference
        )
        return J[:, self.columns]


@pytest.mark.parametrize('name', UNCOUPLED)
def test_pinocchio_frames_in_its_three_references(name):
    robot = robot_of(name)
    peer = InPinocchio(robot)
    for row in {robot.rows // 2, robot.rows}:
        frame = f'{robot.name}_frame_{row}'
        here = peer.model.getFrameId(frame)
        there = peer.add_point(frame, AT)
        for q in poses(robot, 3)[:4]:
            J = ks.jacobian(robot, q, of=row)
            agree(J, peer.jacobian(q, here, 'LOCAL_WORLD_ALIGNED'))
            agree(ks.jacobian(robot, q, of=row, axes=row), peer.jacobian(q, here, 'LOCAL'))
            # WORLD: the point of the body that is at the world's origin.
            origin = -ks.forward_kinematics(robot, q, of=row)[:3, 3]
            spatial = np.transpose([ks.twist_at(column, origin) for column in J.T])
            agree(spatial, peer.jacobian(q, here, 'WORLD'))
            expected = peer.jacobian(q, there, 'LOCAL_WORLD_ALIGNED')
            agree(ks.jacobian(robot, q, of=row, at=AT), expected)


@pytest.mark.parametrize('name', UNCOUPLED)
def test_pinocchio_time_variation_of_the_jacobian(name):
    robot = robot_of(name)
    peer = InPinocchio(robot)
    model, data, pinocchio = peer.model, peer.data, peer.pinocchio
    frame = model.getFrameId(robot.tool_frame)
    for q in poses(robot, 3)[:3]:
        qdot, v = np.random.default_rng(1).uniform(-1, 1, robot.dof), np.zeros(model.nv)
        v[peer.columns] = qdot
        pinocchio.computeJointJacobiansTimeVariation(model, data, peer.whole(q), v)
        pinocchio.updateFramePlacements(model, data)
        expected = pinocchio.getFrameJacobianTimeVariation(
            model, data, frame, pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        agree(ks.jacobian_rate(robot, q, qdot), expected[:, peer.columns])


def in_the_toolbox():
    """Return an arm of three joints in the Robotics Toolbox, and the same one here."""
    toolbox = pytest.importorskip('roboticstoolbox')
    E = toolbox.ET
    rows = ((E.tz(0.4), E.Rx(np.pi / 2)), (E.tx(0.3),), (E.tx(0.3),))
    links, parent = [], None
    for i, row in enumerate(rows, start=1):
        # A link of the toolbox ends at its joint: what follows is a link of its own.
        turn = toolbox.ETS(E.Rz(jindex=i - 1))
        links.append(toolbox.Link(turn, name=f'joint_{i}', parent=parent))
        links.append(toolbox.Link(toolbox.ETS(list(row)), name=f'row_{i}', parent=links[-1]))
        parent = links[-1]
    peer = toolbox.Robot(links)
    robot = ks.robot_from_text(
        'robot: three\nconvention: standard\njoints:\n'
        + ''.join(f'  - {{name: q{i}, type: revolute}}\n' for i in (1, 2, 3))
        + 'links:\n  - {a: 0, alpha: pi/2, d: 0.4, theta: q1}\n'
        + ''.join(f'  - {{a: 0.3, alpha: 0, d: 0, theta: q{i}}}\n' for i in (2, 3))
    )
    return peer, robot


@pytest.mark.slow
def test_robotics_toolbox_jacob0_of_a_link_and_with_a_tool():
    spatialmath = pytest.importorskip('spatialmath')
    peer, robot = in_the_toolbox()
    for q in poses(robot, 1)[[0, 4]]:
        for row in (1, 2, 3):
            end = f'row_{row}'
            agree(ks.forward_kinematics(robot, q, of=row), peer.fkine(q, end=end).A)
            for at in ((0, 0, 0), AT):
                tool = spatialmath.SE3(*at)
                columns = ks.jacobian(robot, q, of=row, at=at)
                agree(columns[:, :row], peer.jacob0(q, end=end, tool=tool)[:, :row])
                columns = ks.jacobian(robot, q, of=row, at=at, axes=row)
                agree(columns[:, :row], peer.jacobe(q, end=end, tool=tool)[:, :row])


@pytest.mark.slow
def test_robotics_toolbox_jacob0_dot_and_jacob0_analytical():
    peer, robot = in_the_toolbox()
    random = np.random.default_rng(0)
    for q, qdot in random.uniform(-1, 1, (5, 2, 3)):
        agree(ks.jacobian_rate(robot, q, qdot), peer.jacob0_dot(q, qdot))
        for here, there in (('rpy', 'rpy/zyx'), ('rotation_vector', 'exp')):
            expected = peer.jacob0_analytical(q, representation=there)
            agree(ks.analytic_jacobian(robot, q, here).jacobian, expected)
