# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The same arm in other libraries, for those that are installed: pose and Jacobian of one pose."""

from typing import NamedTuple

from kinematics_service.rigid_motion import screw_z
from kinematics_service.robot.conventions import table_rows


class Peer(NamedTuple):
    """A call that computes pose and J, one that returns J, and whether it takes microseconds."""

    call: object
    jacobian: object
    slow: bool


def links_of(robot):
    """Return for each joint the pose of its frame in the one before, and the tool in the last."""
    placements, still = [], robot.description.base.motion.matrix
    for row in table_rows(robot.description):
        still = still @ row.before
        if row.theta.coefficients:
            ((_, coefficient),) = row.theta.coefficients
            assert coefficient == 1.0
            assert not row.d.coefficients
            placements.append(still @ screw_z(row.theta.constant, row.d.constant))
            still = row.after
        else:
            still = still @ screw_z(row.theta.constant, row.d.constant) @ row.after
    return placements, still @ robot.description.tool.motion.matrix


def pinocchio_peer(robot, q):
    import pinocchio as pin

    placements, tool = links_of(robot)
    model, joint = pin.Model(), 0
    for name, placement in zip(robot.joint_names, placements):
        joint = model.addJoint(joint, pin.JointModelRZ(), pin.SE3(placement), name)
    frame = model.addFrame(pin.Frame('tool', joint, 0, pin.SE3(tool), pin.FrameType.OP_FRAME))
    data = model.createData()

    def call():
        pin.computeJointJacobians(model, data, q)
        return pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)

    return Peer(call, call, False)


def toolbox_peer(robot, q):
    import roboticstoolbox as rtb
    from spatialmath import SE3

    placements, tool = links_of(robot)
    elements = rtb.ETS([rtb.ET.SE3(SE3(placements[0], check=False))])
    for k, end in enumerate([*placements[1:], tool]):
        elements *= rtb.ETS([rtb.ET.Rz(jindex=k), rtb.ET.SE3(SE3(end, check=False))])

    def call():
        elements.fkine(q)
        return elements.jacob0(q)

    return Peer(call, lambda: elements.jacob0(q), True)


def peers_of(robot, q):
    """Return the peers by name; Pinocchio is needed, the other where it can be imported."""
    peers = {'Pinocchio': pinocchio_peer(robot, q)}
    try:
        peers['roboticstoolbox, ETS'] = toolbox_peer(robot, q)
    except ImportError:
        print('roboticstoolbox is not installed: left out')
    return peers
