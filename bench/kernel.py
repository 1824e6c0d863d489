"""
One call of pose + Jacobian + twist beside Pinocchio, and a batch: ratios taken in one run.

    python bench/kernel.py [--robot ur5e] [--batch 100000]

Pinocchio's two calls are `computeJointJacobians` and `getFrameJacobian`, of the same arm.
"""

import argparse
import time

import numpy as np

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.conventions import table_rows
from kinematics_service.rigid_motion import screw_z
from kinematics_service.singularities import measure_rows

ROUNDS, CALLS = 7, 20_000


def nanoseconds(function, calls=CALLS):
    """Return the least time of a call over ROUNDS rounds: the one least disturbed."""
    function()
    best = np.inf
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        for _ in range(calls):
            function()
        best = min(best, (time.perf_counter() - begin) / calls)
    return best * 1e9


def pinocchio_twin(robot):
    """Return model, data and tool frame of an uncoupled arm of revolute joints in Pinocchio."""
    import pinocchio as pin

    model, joint, still = pin.Model(), 0, robot.description.base.motion.matrix
    names = dict(zip(robot.variables, robot.joint_names))
    for row in table_rows(robot.description):
        still = still @ row.before
        if row.theta.coefficients:
            ((variable, coefficient),) = row.theta.coefficients
            assert coefficient == 1.0
            assert not row.d.coefficients
            placement = pin.SE3(still @ screw_z(row.theta.constant, row.d.constant))
            joint = model.addJoint(joint, pin.JointModelRZ(), placement, names[variable])
            still = row.after
        else:
            still = still @ screw_z(row.theta.constant, row.d.constant) @ row.after
    tool = pin.SE3(still @ robot.description.tool.motion.matrix)
    frame = model.addFrame(pin.Frame('tool', joint, 0, tool, pin.FrameType.OP_FRAME))
    return pin, model, model.createData(), frame


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--robot', default='ur5e')
    parser.add_argument('--batch', type=int, default=100_000)
    arguments = parser.parse_args()
    robot = ks.load_robot(arguments.robot)
    chain, n = robot.chain, robot.dof
    random = np.random.default_rng(1)
    q = random.uniform(-3, 3, n)
    qdot = random.uniform(-1, 1, n)
    one, rates = q[None].copy(), qdot[None].copy()
    row = np.empty((1, chain.widths[kernel.JACOBIAN]))

    pin, model, data, frame = pinocchio_twin(robot)

    def peer():
        pin.computeJointJacobians(model, data, q)
        return pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)

    difference = np.max(np.abs(peer() - ks.jacobian(robot, q)))
    assert difference < 1e-12, difference

    def compiled():
        kernel.evaluate(chain.integers, chain.numbers, one, rates, kernel.JACOBIAN, row)

    batch = random.uniform(-3, 3, (arguments.batch, n))
    rows = np.empty((arguments.batch, chain.widths[kernel.JACOBIAN]))
    zero = np.zeros((1, n))

    def whole_batch():
        kernel.evaluate(chain.integers, chain.numbers, batch, zero, kernel.JACOBIAN, rows)

    times = {
        'Pinocchio: two calls for pose and J': nanoseconds(peer),
        'kernel call: pose, J, twist': nanoseconds(compiled),
        'evaluate(robot, q, qdot), checked': nanoseconds(lambda: ks.evaluate(robot, q, qdot)),
        'all measures of a row': nanoseconds(lambda: measure_rows(robot, row), 5000),
    }
    reference = times['Pinocchio: two calls for pose and J']
    print(f'{robot.name}, {n} joints; J agrees with Pinocchio to {difference:.1e}')
    print(f'{"":40}{"ns":>8}{"ratio":>8}')
    for name, value in times.items():
        print(f'{name:40}{value:8.0f}{value / reference:8.2f}')
    per_pose = nanoseconds(whole_batch, 3) / arguments.batch
    print(
        f'{"batch of " + str(arguments.batch) + ", a pose":40}{per_pose:8.0f}'
        f'{per_pose / reference:8.2f}'
    )


if __name__ == '__main__':
    main()
