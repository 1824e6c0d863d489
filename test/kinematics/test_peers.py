# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Random arms built in Pinocchio and in the Robotics Toolbox too: same pose, same Jacobian."""

import dataclasses

import numpy as np
import pytest
from random_robots import Constant, random_arm
from tolerances import ROUND_OFF

import kinematics_service as ks

pytestmark = pytest.mark.peers

KINDS = ('revolute', 'prismatic')

TABLES = {
    f'{convention}-{dof}-{seed}': dataclasses.replace(
        random_arm(seed, dof, convention, kinds=KINDS, plain=True),
        base=Constant((0.3, -0.2, 0.5, 0.4, -1.0, 2.0)),
        tool=Constant((0.1, 0.05, -0.2, -0.7, 0.3, 1.5)),
    )
    for convention in ('standard', 'modified')
    for dof in (1, 3, 6, 7)
    for seed in (dof % 2,)
}
random_tables = pytest.mark.parametrize('arm', TABLES.values(), ids=TABLES.keys())


def positions(arm):
    return np.random.default_rng(arm.dof).uniform(-3, 3, (5, arm.dof))


def compare(arm, pose, jacobian):
    robot = ks.robot_from_text(arm.text())
    for q in positions(arm):
        np.testing.assert_allclose(
            ks.forward_kinematics(robot, q), pose(q), rtol=0, atol=ROUND_OFF
        )
        # Both peers give the Jacobian of a single joint without its second dimension.
        expected = jacobian(q).reshape(6, arm.dof)
        np.testing.assert_allclose(ks.jacobian(robot, q), expected, rtol=0, atol=ROUND_OFF)


@pytest.mark.slow
@random_tables
def test_pinocchio_local_world_aligned(arm):
    pinocchio = pytest.importorskip('pinocchio')

    def se3(T):
        return pinocchio.SE3(T[:3, :3], T[:3, 3])

    model = pinocchio.Model()
    parent, still = 0, arm.base.matrix()
    for row in arm.rows:
        for factor in row:
            if not factor.terms:
                still = still @ factor.matrix(())
                continue
            # A positive unit motion; what is constant, and the sign, go into the placement.
            ((_, sign),) = factor.terms
            still = still @ dataclasses.replace(factor, terms=()).matrix(())
            axis = np.array([0.0, 0.0, sign])
            kind = 'Revolute' if factor.axis == 'Rz' else 'Prismatic'
            joint = getattr(pinocchio, f'JointModel{kind}Unaligned')(axis)
            parent = model.addJoint(parent, joint, se3(still), f'joint_{parent}')
            still = np.eye(4)
    frame = model.addFrame(
        pinocchio.Frame(
            'tool', parent, se3(still @ arm.tool.matrix()), pinocchio.FrameType.OP_FRAME
        )
    )
    data = model.createData()

    def pose(q):
        pinocchio.framesForwardKinematics(model, data, q)
        return data.oMf[frame].homogeneous

    def jacobian(q):
        axes = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        return pinocchio.computeFrameJacobian(model, data, q, frame, axes)

    compare(arm, pose, jacobian)


def in_the_toolbox(arm):
    toolbox = pytest.importorskip('roboticstoolbox')
    spatialmath = pytest.importorskip('spatialmath')
    standard = arm.convention == 'standard'
    links = []
    for row in arm.rows:
        theta, d, a, alpha = row if standard else (row[2], row[3], row[1], row[0])
        turns = bool(theta.terms)
        moving, still = (theta, d) if turns else (d, theta)
        ((_, sign),) = moving.terms
        kind = ('Revolute' if turns else 'Prismatic') + ('DH' if standard else 'MDH')
        constant = {'d' if turns else 'theta': still.constant}
        link = getattr(toolbox, kind)(
            a=a.constant,
            alpha=alpha.constant,
            offset=moving.constant,
            flip=sign < 0.0,
            **constant,
        )
        links.append(link)
    base, tool = (spatialmath.SE3(T.matrix(), check=False) for T in (arm.base, arm.tool))
    return toolbox.DHRobot(links, base=base, tool=tool)


@pytest.mark.slow
@random_tables
def test_robotics_toolbox_jacob0_and_jacobe(arm):
    peer = in_the_toolbox(arm)
    compare(arm, lambda q: peer.fkine(q).A, peer.jacob0)
    robot = ks.robot_from_text(arm.text())
    for q in positions(arm):
        expected = peer.jacobe(q).reshape(6, arm.dof)
        np.testing.assert_allclose(
            ks.jacobian(robot, q, axes='tool'), expected, rtol=0, atol=ROUND_OFF
        )
