# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
A tour of the library that calls every function of the kernel, each call's numbers hashed.

    python test/kernel/kernel_tour.py [robot ...]

prints a line for each robot and function: two machines, two Pythons, or the compiled kernel and
its source run by plain Python agree to the last bit where their lines are equal.
"""

import contextlib
import hashlib
import itertools
import sys
from collections import Counter
from collections.abc import Sequence
from types import SimpleNamespace
from unittest import mock

import numpy as np

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation.cdr import STAMP_AT, CdrWriter
from kinematics_service.estimation.estimator import Estimator, EstimatorSettings
from kinematics_service.estimation.joint_sample import JointSample
from kinematics_service.estimation.joint_state_form import SerializedSample, form_of
from kinematics_service.kinematics.inverse.problem.plan import plan_for
from kinematics_service.kinematics.inverse.problem.problem import IkProblem
from kinematics_service.kinematics.inverse.problem.screws import screws_of
from kinematics_service.kinematics.inverse.problem.target import EXACT_ERROR, ik_target_of
from kinematics_service.kinematics.inverse.search import refinement
from kinematics_service.kinematics.inverse.self_motion.curve import point_of
from kinematics_service.rigid_motion import inverse
from kinematics_service.robot.bundled import find_robot
from kinematics_service.robot.cell import read_robot
from kinematics_service.robot.closed_poses import close_at
from kinematics_service.robot.file.parts.description import RobotDescription
from kinematics_service.robot.joint_spans import joint_spans
from kinematics_service.robot.loops import chain_of, closure_of
from kinematics_service.robot.robot import Robot
from kinematics_service.robot.task import ROW_NAMES

SECOND = 1_000_000_000
# More poses than are evaluated side by side.
POSES, MESSAGES = kernel.LANES + 2, 12
SINGLY = 3  # of them so many also one by one
# Messages to an arm that is searched: plain Python takes a tenth of a second for each.
SEARCHED_MESSAGES = 3
# Arms whose inverse kinematics is asked for: three joints, each closed form, a search, a redundant
# one. Plain Python takes seconds for each.
SOLVED = ('craig_3r', 'puma560', 'ur5e', 'scara_hsr065', 'panda')
# What describes an arm, a stream or a target is no number that the kernel computes.
GIVEN = (
    *(kernel.Loop, kernel.LoopGroup),
    *(kernel.Arm, kernel.Chain, kernel.TaskRows, kernel.Tape, kernel.OurJoints),
    kernel.ReportedJoints,
    *(kernel.ClosedForm, kernel.Joints, kernel.Refinement, kernel.Residual, kernel.Servo),
    *(kernel.SixJoints, kernel.CurvePoint, kernel.CurvePath),
    *(kernel.Clearance, kernel.NearestSearch, kernel.PoseErrors),
)
# Of solutions, and of a step of the servo.
# Of a solution's record, with the signs of its posture in place of words.
SAID_OF_ONE = ('residual', 'margin', 'feasible', 'posture', 'beyond')
SIGNS = tuple(itertools.product((-1, 0, 1), repeat=3))
SAID_OF_A_STEP = ('qdot', 'damping', 'least_singular_value', 'shortened', 'slowest')
# How it is built; and details, which have tests of their own.
NOT_PART_OF_IT = {
    *('is_compiled', 'notice', 'use_compiled', 'sine_and_cosine'),
    *('decompose', 'determinant_of', 'eigenvectors', 'shortest_angle', 'groups_from'),
    *('linearise', 'end_in_time'),
}


def functions():
    """Return the names of the kernel's public functions."""
    return {
        name
        for name, value in ((name, getattr(kernel, name)) for name in dir(kernel))
        if callable(value)
        and not name.startswith('_')
        and not isinstance(value, type)
        and str(getattr(value, '__module__', '')).startswith(kernel.__name__)
    } - NOT_PART_OF_IT


def said_by(argument):
    """Yield the bytes of all numbers that an argument or a result of the kernel has."""
    if isinstance(argument, np.ndarray):
        yield argument.tobytes()
    elif isinstance(argument, kernel.JointMemory):
        yield from (column.tobytes() for column in argument.columns)
    elif isinstance(argument, kernel.OutgoingMessages):
        yield argument.table.data.tobytes()
    elif isinstance(argument, kernel.IncomingForm):
        yield from said_by(argument.reported.stamp)
    elif isinstance(argument, kernel.Solutions):
        yield from said_by(argument.q[: argument.count])
        for k, record in enumerate(records_of(argument)):
            yield from said_by(argument.share(k))
            for name in SAID_OF_ONE:
                yield from said_by(getattr(record, name))
    elif isinstance(argument, kernel.ServoOutput):
        for name in SAID_OF_A_STEP:
            yield from said_by(getattr(argument, name))
        yield from said_by([argument.is_held(j) for j in range(len(argument.qdot))])
    elif not isinstance(argument, GIVEN):
        yield repr(np.array(argument).tolist()).encode()


def records_of(found):
    """Return solutions as records, with the places of joints as their names."""
    joints = tuple(range(found.q.shape[1]))
    return found.records(SimpleNamespace, joints, SIGNS, EXACT_ERROR, 0, found.count, False)


class Record:
    """Every call of the kernel from outside, with what it left in its arrays and returned."""

    def __init__(self):
        self.hashes, self.calls = {}, Counter()
        self._inside = False

    def wrapped(self, name, function):
        def call(*arguments):
            if self._inside:
                return function(*arguments)
            self._inside = True
            try:
                result = function(*arguments)
            finally:
                self._inside = False
            digest = self.hashes.setdefault(name, hashlib.sha256())
            for argument in (*arguments, result):
                for said in said_by(argument):
                    digest.update(said)
            self.calls[name] += 1
            return result

        return call

    @contextlib.contextmanager
    def running(self):
        """Record while this lasts; new arrays are zeros, so that what is not filled is equal."""
        before = {name: getattr(kernel, name) for name in functions()}
        empty, np.empty = np.empty, np.zeros
        for name, function in before.items():
            setattr(kernel, name, self.wrapped(name, function))
        try:
            yield
        finally:
            np.empty = empty
            for name, function in before.items():
                setattr(kernel, name, function)

    def lines(self, name):
        """Yield a name, each function, its number of calls, and the hash of its numbers."""
        for function, digest in sorted(self.hashes.items()):
            yield name, function, self.calls[function], digest.hexdigest()


def any_errors(robot: Robot, random: np.random.Generator):
    """Return errors along random screws in frames of the table, with a triangle of causes."""
    count = 2 * robot.chain.frames
    return kernel.PoseErrors(
        robot.chain,
        kernel.PoseErrorTable(
            frame=np.arange(count) // 2,
            screw=random.normal(size=(count, 6)),
            gear=np.arange(count) % (robot.dof + 1) - 1,
            spread=np.tril(random.normal(size=(count, count))),
            rates=random.uniform(0.0, 1.0, robot.dof),
            floor=random.uniform(0.0, 1.0, 6),
        ),
    )


def poses(robot: Robot, random: np.random.Generator):
    q = random.uniform(-9, 9, (POSES, robot.dof))
    q[0], q[1] = 0.0, np.pi / 2
    qdot = random.normal(size=q.shape)
    batch = ks.evaluate(robot, q, qdot, depth=kernel.ALL_FRAMES)
    errors = any_errors(robot, random)
    for in_tool_axes in (False, True):
        kernel.covariances(errors, batch.row, q, qdot, in_tool_axes, np.zeros((POSES, 2, 6, 6)))
    with np.errstate(all='ignore'):
        ks.evaluate(robot, q, qdot)
        ks.forward_kinematics(robot, q)
        for k in range(SINGLY):
            ks.evaluate(robot, q[k], qdot[k])
            ks.forward_kinematics(robot, q[k])
        if robot.singularity.factors:
            robot.singularity.factors.evaluate(q[:SINGLY])
    kernel.quaternions(
        batch.link_frames.reshape(-1, 4, 4), np.empty((q.shape[0] * robot.chain.frames, 4))
    )


def nearest_singular_poses(robot: Robot, random: np.random.Generator):
    q = random.uniform(-9, 9, (SINGLY, robot.dof))
    q[0], q[1] = 0.0, np.pi / 2
    qdot = random.normal(size=q.shape)
    with np.errstate(all='ignore'):
        found = ks.singularity(robot, q, qdot)
        assert found.clearance.size == found.distance.size == SINGLY
        for k in range(SINGLY) if robot.singularity.task.square else (SINGLY - 1,):
            state = ks.evaluate(robot, q[k], qdot[k])
            search = kernel.NearestSearch(robot.singularity.arm)
            kernel.measure_one(search, state.row, np.empty(robot.singularity.measure_places.width))
            ks.singularity(robot, q[k], qdot[k])
            ks.evaluate(robot, q[k], measured=True)


def messages(robot: Robot, random: np.random.Generator, source: str):
    estimator = Estimator(robot, EstimatorSettings(velocity_source=source))
    names, stamp = robot.joint_names, 1000 * SECOND
    q = random.uniform(-3, 3, robot.dof)
    for k in range(MESSAGES):
        q = q + random.normal(scale=0.1, size=q.size)
        rates = random.normal(size=q.size) if k % 3 else ()
        stamp += (10_000_000, 7, 0, -3_000_000, -5 * SECOND)[k % 5 if k > 4 else 0]
        said = 0 if k == 7 else stamp
        ours = names[: len(names) // 2] if k == 9 else names
        numbers = q[: len(ours)].copy()
        if k == 10:
            numbers[0] = np.nan
        rates = rates[: len(ours)]
        sample = JointSample(ours, numbers, rates, said, said or stamp, stamp)
        estimator.take(sample, kernel.JACOBIAN if k % 2 else kernel.ALL_FRAMES)
    estimator.reset()


def joint_state_bytes(names: Sequence[str], stamp: np.ndarray, numbers: np.ndarray) -> bytes:
    # A serialized JointState, its velocities after its positions.
    writer = CdrWriter()
    writer.room(4, 2)
    writer.text('base')
    writer.whole(len(names))
    for name in names:
        writer.text(name)
    for half in np.split(numbers, 2):
        writer.whole(half.size)
        at = writer.room(8, half.size)
        writer.data[at:] = half.tobytes()
    writer.whole(0)
    writer.data[STAMP_AT : STAMP_AT + 8] = stamp.tobytes()
    return bytes(writer.data)


def bytes_of_messages(robot: Robot, random: np.random.Generator, count: int):
    estimator, n = Estimator(robot, EstimatorSettings()), robot.dof
    names = robot.joint_names
    form = form_of(joint_state_bytes(names, np.zeros(2, np.uint32), np.zeros(2 * n)))
    assert form is not None
    row = robot.chain.single_widths[kernel.ALL_FRAMES]
    # One stamp, three numbers: of the row, and of the measures beyond its end. Others have two
    # covariances beyond these.
    answers = kernel.OutgoingMessages(
        kernel.OutgoingTable(
            np.zeros(40, np.uint8),
            stamps=np.array([4]),
            targets=np.array([12, 20, 28]),
            sources=np.array([3, 7, row + kernel.DISTANCE]),
        )
    )
    beyond = row + robot.singularity.measure_places.width
    uncertain = kernel.OutgoingMessages(
        kernel.OutgoingTable(
            np.zeros(12 + 8 * 73, np.uint8),
            stamps=np.array([4]),
            targets=12 + 8 * np.arange(73),
            sources=np.array([3, *range(beyond, beyond + 72)]),
        ),
        any_errors(robot, random),
        of_pose=True,
        of_twist=True,
    )
    for k in range(count):
        stamp = np.array([1000 + k % 7, 5 * k], np.uint32)
        numbers = random.uniform(-3, 3, 2 * n)
        if k == 5:
            numbers[0] = np.inf
        data = joint_state_bytes(names, stamp, numbers)
        with np.errstate(all='ignore'):
            sample = SerializedSample(form, data, SECOND * k)
            estimator.take(sample, answers=uncertain if k % 2 else answers)
        estimator.take(SerializedSample(form, b'O' + data[1:], SECOND * k))
    answer = ks.evaluate(robot, np.full(n, 0.3), measured=True, depth=kernel.ALL_FRAMES)
    for stamp in (0, 5 * SECOND + 3, -1, 2**62):
        kernel.fill_messages(answers, stamp, answer.row, answer.measures)


def targets(robot: Robot, random: np.random.Generator):
    # A redundant arm is searched: one target.
    for k in range(2) if robot.dof <= len(ROW_NAMES) else (1,):
        q = random.uniform(np.maximum(robot.limits[:, 0], -2), np.minimum(robot.limits[:, 1], 2))
        if k == 0:
            q *= 0.0
        state = ks.evaluate(robot, q, q)
        far = state.pose.copy()
        far[:3, 3] += 1e3
        # Plain Python takes minutes for all curves of solutions: they are visited one by one.
        if robot.singularity.task.square:
            ks.inverse_kinematics(robot, state.pose, curves=False)
        ks.inverse_kinematics(robot, state.pose, near=q, all_solutions=False)
        if robot.dof == len(ROW_NAMES):
            ks.inverse_kinematics_of_each(robot, state.pose[None], near=q)
        ks.inverse_kinematics(robot, state.pose[:3, 3], rows=('x', 'y', 'z'), all_solutions=False)
        if k == 1:
            ks.inverse_kinematics(robot, far)
            ks.inverse_kinematics(robot, state.pose, axis='z', all_solutions=False)
        ks.joint_velocity(robot, state, state.twist)
        ks.joint_velocity(robot, state, 1e3 * random.normal(size=6), axes='tool')
        # What a search finds: the same solution twice, and one nearby.
        found = np.array([q, q + 2 * np.pi, q + 0.1])
        errors = np.array([0.0, 0.1, 0.2]) * EXACT_ERROR
        plan = plan_for(robot, ROW_NAMES)
        kernel.distinct(
            ik_target_of(robot, state.pose).residual,
            plan.joints,
            EXACT_ERROR,
            found,
            errors,
            *np.zeros((2, 3), np.int64),
        )
    if robot.dof == len(ROW_NAMES) + 1:
        curves(robot, random.uniform(-1.0, 1.0, robot.dof))


def curves(robot: Robot, q: np.ndarray):
    # A piece of the curve of solutions through a pose, both ways; a fold, and what is beside it.
    target = ik_target_of(robot, ks.forward_kinematics(robot, q))
    plan, n = plan_for(robot, ROW_NAMES), len(q)
    problem = IkProblem(robot, target, plan, q, 0)
    point, samples = point_of(problem), np.zeros((9, 2 * n))
    for side in (1.0, -1.0):
        samples[0, :n] = q
        kernel.trace(point, side, samples)
    kernel.passes(point, samples, q)
    kernel.write_derivative(point, q, np.zeros((n - 1, n)))
    path = kernel.CurvePath(point, samples)
    middle = samples[4, :n]
    # Where the first joint is in the middle of a step, and where none turns round.
    low, high = samples[4:6, 0]
    level = 0.5 * (low + high)
    brackets = np.array(
        [[0, 0], [level, np.nan], [4, 4], [low - level, 1], [5, 5], [high - level, -1]]
    )
    kernel.write_roots(path, brackets, np.zeros((2, 1 + n)))
    kernel.write_places(path, np.array([0.3, 1.7]), np.zeros((2, n)))
    kernel.nearest_place(path, np.array([middle, np.ones(n)]), 3.0, 5.0)


def details(random: np.random.Generator):
    # What the tour above has no need for.
    screws = random.normal(size=(6, 7))
    screws[:, 6] = 0.0
    screws[:, :3] /= np.linalg.norm(screws[:, :3], axis=1)[:, None]
    T = ks.forward_kinematics(ks.load_robot('ur5e'), random.normal(size=6))
    for way in (kernel.POSITION_3, kernel.SPHERICAL_WRIST, kernel.PARALLEL_AXES):
        for slides in (0.0, 1.0):
            table = screws.copy()
            if way == kernel.PARALLEL_AXES:
                table[2:4, :3] = table[1, :3]
            else:
                table[2, 6] = slides
            k = 3 if way == kernel.POSITION_3 else 6
            form = kernel.ClosedForm(
                way, table[:k].copy(), table[5, 3:6].copy(), T, False, np.eye(k), np.eye(k), 2e-15
            )
            found = np.zeros((kernel.MAX_CANDIDATES, k))
            kernel.inverse_candidates(form, T, np.zeros(k), found, np.zeros(1))
    # Six joints, one of which slides, by two eliminations; then those of an arm.
    screws[1, 6] = 1.0
    options = np.array([[0, 0, 0], [4, 1, 1]])
    general = kernel.SixJoints(screws, np.eye(4), np.eye(6), options, 16)
    psi, said = np.zeros((kernel.MAX_CANDIDATES, 6, 2)), np.zeros(3)
    found = kernel.complex_solutions(general, T, psi, said)
    beside = T.copy()
    beside[:3, 3] += 1e-3
    kernel.followed_solutions(general, beside, found, psi)
    # Two that slide: apart, next to each other, across the joint between them; three.
    options = np.array([[4, 0, 1], [1, 1, 0]])
    for more, bound in (([4], 8), ([2], 8), ([3], 8), ([3, 4], 2)):
        table = screws.copy()
        table[more, 6] = 1.0
        if more == [3]:
            table[1:4, :3] = np.eye(3)
        general = kernel.SixJoints(table, np.eye(4), np.eye(6), options, bound)
        kernel.complex_solutions(general, T, psi, said)
    robot = ks.load_robot('ur5e')
    turning = screws_of(robot.chain)
    table = np.column_stack([turning.axes, turning.points, np.zeros(6)])
    arm = kernel.SixJoints(table, inverse(turning.home), np.eye(6), options[:1], 16)
    plan, target = plan_for(robot, ROW_NAMES), ik_target_of(robot, T)
    q = np.zeros((kernel.MAX_CANDIDATES, 6))
    solutions = kernel.Solutions(plan.joints, np.zeros(6), EXACT_ERROR, q)
    kernel.eliminated_solutions(arm, refinement(target, plan), solutions, np.zeros(3, int))


def wide_arm() -> Robot:
    # Joints that are more than the rows, as few as can be, of which one counts for the seeds of
    # singular poses: those of seven joints take plain Python a quarter of a minute.
    text = ks.bundled_robots()['planar_3r'].read_text(encoding='utf-8')
    text = text.partition('singularity:')[0] + 'singularity: {task: [x, y]}\n'
    spans = np.array([[0.0, 0.0, np.inf], [-3.0, 6.0, np.inf], [0.0, 0.0, np.inf]])
    with mock.patch('kinematics_service.robot.singularity_model.joint_spans', return_value=spans):
        robot = ks.robot_from_text(text)
        robot.singularity.arm.atlas()
    return robot


def few_seeds(name: str) -> Robot:
    """Return a bundled robot of which two joints count for the seeds of singular poses."""

    def spans_of_two(chain: kernel.Chain, *others) -> np.ndarray:
        spans = joint_spans(chain, *others)
        spans[: chain.dof - 2, 1] = 0.0
        return spans

    with mock.patch(
        'kinematics_service.robot.singularity_model.joint_spans', side_effect=spans_of_two
    ):
        robot = ks.robot_from_text(ks.bundled_robots()[name].read_text(encoding='utf-8'))
        robot.singularity.arm.atlas()
    return robot


def visit(robot: Robot):
    random = np.random.default_rng(7)
    poses(robot, random)
    judged = robot if robot.singularity.task.square else wide_arm()
    nearest_singular_poses(judged, random)
    count = MESSAGES if judged is robot else SEARCHED_MESSAGES
    for source in ('auto', 'message', 'difference') if judged is robot else ():
        messages(judged, random, source)
    bytes_of_messages(judged, random, count)
    if robot.name in SOLVED:
        targets(robot, random)


def visit_loops(description: RobotDescription):
    """Close the loops of an arm, from its file on and at poses around the known one."""
    closure = closure_of(description)
    chain = chain_of(description, closure)
    units = np.minimum(closure.units(), 1.0)
    share = np.linspace(-0.3, 0.3, POSES)[:, None] * np.arange(1, chain.dof + 1) / chain.dof
    close_at(chain, closure.assembled() + units * share)


def tour(robots):
    """Yield robot, function, number of calls, sha256 of all their numbers."""
    record = Record()
    with record.running():
        details(np.random.default_rng(7))
    yield from record.lines('details')
    for name in robots:
        description = read_robot(find_robot(name))
        # Plain Python takes seconds for the task of an arm with loops.
        robot = None if description.loops else few_seeds(name)
        record = Record()
        with record.running():
            visit_loops(description) if robot is None else visit(robot)
        yield from record.lines(name)


def main():
    for line in tour(sys.argv[1:] or sorted(ks.bundled_robots())):
        print(*line)


if __name__ == '__main__':
    main()
