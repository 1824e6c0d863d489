# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The library as a user meets it: names, errors, frozen data, several threads."""

import copy
import dataclasses
import pickle
import re
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt
import pytest
from arms import BUNDLED, robot_of
from closed_forms import craig_jacobian_in_tool_axes
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.robot.chain import FrozenArrays

FUNCTIONS = {
    'forward_kinematics': lambda robot, q: ks.forward_kinematics(robot, q),
    'link_frames': lambda robot, q: ks.link_frames(robot, q),
    'jacobian': lambda robot, q: ks.jacobian(robot, q),
    'twist': lambda robot, q: ks.twist(robot, q, np.zeros(robot.dof)),
    'singularity': lambda robot, q: ks.singularity(robot, q),
    'evaluate': lambda robot, q: ks.evaluate(robot, q),
}
every_function = pytest.mark.parametrize('function', FUNCTIONS.values(), ids=FUNCTIONS.keys())


# What is promised; every other module may change.
API = """
    __version__ load_robot robot_from_text bundled_robots Robot Point
    forward_kinematics link_frames jacobian twist twist_at evaluate ToolState
    acceleration jacobian_rate analytic_jacobian AnalyticJacobian
    joint_torques wrench_from_torques WrenchEstimate
    null_space self_motion pseudo_inverse PseudoInverse scale MotionScale ServoRule
    singularity Singularity Level LoopClosure LoopError
    inverse_kinematics inverse_kinematics_of_each IkResult IkSolution IkFamily IkArc IkArcEnd
    joint_velocity ServoSettings ServoStep
    check_plan PlanCheck PlanError
    diagnose_frames FrameDiagnosis judge_table
    calibrate Calibration propose_poses ProposedPoses LineOfSight ToolLoads
    pose_covariance twist_covariance
    derive Derivation
    import_urdf UrdfImport export_urdf FrameNames
    KinematicsError RobotFileError RobotNotFoundError
    PointError JointVectorError TargetError TwistError WrenchError ServoSettingsError
    CalibrationError FramesError DerivationError UrdfError
"""


def test_the_public_names_are_these():
    assert dir(ks) == sorted(ks.__all__) == sorted(API.split())
    for name in ks.__all__:
        assert getattr(ks, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'forward_kinematic'"):
        ks.forward_kinematic  # noqa: B018


def test_errors_are_of_one_family_and_value_errors():
    errors = [
        value
        for name in ks.__all__
        if name.endswith('Error') and name != 'KinematicsError'
        for value in [getattr(ks, name)]
    ]
    assert len(errors) == 14
    for error in errors:
        assert issubclass(error, ks.KinematicsError)
        assert issubclass(error, ValueError)


def test_a_robot_is_found_by_name_and_by_path(tmp_path):
    by_name = ks.load_robot('craig_3r')
    path = tmp_path / 'mine.yaml'
    path.write_bytes(ks.bundled_robots()['craig_3r'].read_bytes())
    for place in (path, str(path)):
        found = ks.load_robot(place)
        assert np.array_equal(found.chain.table.before, by_name.chain.table.before)


OTHER_FUNCTIONS = {
    'acceleration': lambda robot: ks.acceleration(robot, [0.3, 0.4], [1, 2], [3, 4]),
    'jacobian_rate': lambda robot: ks.jacobian_rate(robot, [0.3, 0.4], [1, 2]),
    'analytic_jacobian': lambda robot: ks.analytic_jacobian(robot, [0.3, 0.4]),
    'joint_torques': lambda robot: ks.joint_torques(robot, [0.3, 0.4], [1, 2, 3, 4, 5, 6]),
    'wrench_from_torques': lambda robot: ks.wrench_from_torques(robot, [0.3, 0.4], [1, 2]).wrench,
    'inverse_kinematics': lambda robot: [s.q for s in ks.inverse_kinematics(robot, [0.5, 0.2, 0])],
    'joint_velocity': lambda robot: ks.joint_velocity(robot, [0.3, 0.4], [0.1] * 6).qdot,
    'check_plan': lambda robot: ks.check_plan(robot, [0, 1], [[0.3, 0.4], [0.5, 0.6]]).verdict,
    'pose_covariance': lambda robot: ks.pose_covariance(robot, [0.3, 0.4], joints=1e-3),
    'twist_covariance': lambda robot: ks.twist_covariance(
        robot, [0.3, 0.4], [1, 2], joints=1e-3, velocities=1e-3
    ),
    'propose_poses': lambda robot: ks.propose_poses(robot, 3, positions=True).q,
    'derive': lambda robot: str(ks.derive(robot).determinant),
    'export_urdf': lambda robot: ks.export_urdf(robot),
}


@pytest.mark.parametrize('name', [*FUNCTIONS, *OTHER_FUNCTIONS])
def test_a_function_takes_a_robot_its_name_or_its_file(name):
    function = OTHER_FUNCTIONS.get(name) or (lambda arm: FUNCTIONS[name](arm, [0.3, 0.4]))
    if name == 'twist':
        function = lambda arm: ks.twist(arm, [0.3, 0.4], [1, 2])  # noqa: E731
    robot, file = ks.load_robot('planar_2r'), ks.bundled_robots()['planar_2r']
    expected, *others = (repr(function(arm)) for arm in (robot, 'planar_2r', file, str(file)))
    assert others == [expected] * 3


def test_a_robot_given_by_its_file_is_read_again_when_that_has_changed(tmp_path):
    file = tmp_path / 'arm.yaml'
    text = ks.bundled_robots()['planar_2r'].read_text()
    file.write_text(text)
    assert ks.forward_kinematics(file, [0, 0])[0, 3] == pytest.approx(2.0)
    file.write_text(text.replace('L1: 1', 'L1: 1.5'))
    assert ks.forward_kinematics(file, [0, 0])[0, 3] == pytest.approx(2.5)


@pytest.mark.parametrize(
    ('typed', 'hint'),
    [
        ('ur5', 'there is no ur5; ur5e is another arm'),
        ('so100', 'there is no so100; so101 is another arm'),
        ('ur16e', 'ur10e is another arm'),
        ('xarm5', 'is another arm'),
        ('crx10ia', 'crx10ia_l is another arm'),
        ('panda2', 'panda is another arm'),
        ('puma650', "did you mean 'puma560'?"),
        ('pumma560', "did you mean 'puma560'?"),
        ('puma_560', "did you mean 'puma560'?"),
        ('pandda', "did you mean 'panda'?"),
        ('craig', "did you mean 'craig_3r'?"),
        ('iiwa14', "did you mean 'kuka_iiwa14'?"),
    ],
)
def test_another_model_of_a_maker_is_no_typing_error(typed, hint):
    with pytest.raises(ks.RobotNotFoundError) as caught:
        ks.load_robot(typed)
    assert hint in str(caught.value)
    assert ('did you mean' in hint) == ('did you mean' in str(caught.value))


def test_what_is_no_robot_is_refused_with_what_may_be_given():
    for typed in ('ur-5e', 'UR5E', 'ur5f'):
        with pytest.raises(ks.RobotNotFoundError, match="did you mean 'ur5e'"):
            ks.jacobian(typed, [0.0] * 6)
    for wrong in (5, None, b'ur5e'):
        with pytest.raises(ks.RobotNotFoundError, match='robot must be a Robot, the name of'):
            ks.jacobian(wrong, [0.0] * 6)


def test_an_unknown_robot_is_refused_with_the_names():
    with pytest.raises(ks.RobotNotFoundError) as refusal:
        ks.load_robot('puma650')
    listed = ', '.join(ks.bundled_robots())
    assert str(refusal.value) == (
        "no robot 'puma650': did you mean 'puma560'? give a robot file, a URDF or one of: "
        f'{listed}'
    )
    with pytest.raises(ks.RobotFileError, match=r'^nowhere/arm\.yaml: no such file;'):
        ks.load_robot('nowhere/arm.yaml')


@every_function
@pytest.mark.parametrize(
    ('q', 'message'),
    [
        (
            [0.0, 0.0],
            'q has shape (2,); craig_3r has 3 joints (q1, q2, q3), so it must be (..., 3)',
        ),
        (0.0, 'q has shape (); craig_3r has 3 joints (q1, q2, q3), so it must be (..., 3)'),
        (
            np.zeros((3, 2)),
            'q has shape (3, 2); craig_3r has 3 joints (q1, q2, q3), so it must be (..., 3)',
        ),
        (['a', 'b', 'c'], "q must be numbers of shape (..., 3), not ['a', 'b', 'c']"),
        (
            [[0.0, 0.0, 0.0], [0.0]],
            'q must be numbers of shape (..., 3), not [[0.0, 0.0, 0.0], [0.0]]',
        ),
        ({'q1': 0.0}, "q must be numbers of shape (..., 3), not {'q1': 0.0}"),
    ],
)
def test_joint_vectors_of_the_wrong_shape(function, q, message):
    with pytest.raises(ks.JointVectorError) as refusal:
        function(robot_of('craig_3r'), q)
    assert str(refusal.value) == message


@every_function
@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf])
def test_joint_vectors_that_are_not_finite(function, bad):
    robot = robot_of('craig_3r')
    with pytest.raises(ks.JointVectorError, match='must be finite'):
        function(robot, [0.0, bad, 0.0])
    batch = np.zeros((2, 4, 3))
    batch[1, 2, 1] = bad
    with pytest.raises(ks.JointVectorError, match=r'must be finite.*row 6 is'):
        function(robot, batch)


def test_velocities_that_do_not_fit():
    robot = robot_of('craig_3r')
    with pytest.raises(ks.JointVectorError, match=r'^qdot has shape \(2,\); craig_3r has 3'):
        ks.twist(robot, np.zeros(3), np.zeros(2))
    with pytest.raises(ks.JointVectorError) as refusal:
        ks.twist(robot, np.zeros((4, 3)), np.zeros((5, 3)))
    assert str(refusal.value) == (
        'q and qdot have shapes (4, 3) and (5, 3), which do not go together'
    )
    for velocity in (np.nan, np.inf):
        with pytest.raises(ks.JointVectorError, match='must be finite'):
            ks.twist(robot, np.zeros(3), [0.0, velocity, 0.0])


def test_numbers_too_large_for_a_finite_result_are_refused():
    robot = robot_of('rrp_elementary')
    with pytest.raises(ks.JointVectorError, match='too large to compute with: row 0 is'):
        ks.twist(robot, [0.0, 0.0, 1e300], [1e300, 0.0, 0.0])


@pytest.mark.parametrize('axes', ['world', 5, -1, True, None, 1.0])
def test_axes_are_those_of_the_base_a_point_or_a_row(axes):
    robot, q = robot_of('craig_3r'), np.zeros(3)
    for function in (
        lambda: ks.jacobian(robot, q, axes=axes),
        lambda: ks.twist(robot, q, q, axes),
        lambda: ks.forward_kinematics(robot, q, axes),
    ):
        with pytest.raises(ks.PointError) as refusal:
            function()
        assert str(refusal.value) == (
            f'axes must be one of base, tool, or a row from 0 to 4, not {axes!r}'
        )
    with pytest.raises(ks.KinematicsError, match="not 'world'"):
        ks.jacobian(robot, q, axes='world')


def test_the_jacobian_in_tool_axes_is_the_one_by_hand():
    robot = robot_of('craig_3r')
    for q in np.random.default_rng(3).uniform(-3, 3, (20, 3)):
        J = craig_jacobian_in_tool_axes(q)
        np.testing.assert_allclose(ks.jacobian(robot, q, axes='tool'), J, rtol=0, atol=ROUND_OFF)
        twist = ks.twist(robot, q, [0.3, -0.2, 0.7], axes='tool')
        np.testing.assert_allclose(twist, J @ [0.3, -0.2, 0.7], rtol=0, atol=ROUND_OFF)


@pytest.mark.parametrize('name', BUNDLED)
def test_a_robot_says_what_it_is(name):
    robot = robot_of(name)
    n = robot.dof
    assert robot.name == name
    assert len(robot.joint_names) == len(robot.variables) == len(robot.joint_types) == n
    assert robot.limits.shape == (n, 2)
    assert robot.velocity_limits.shape == (n,)
    assert np.all(robot.limits[:, 0] < robot.limits[:, 1])
    assert np.all(robot.velocity_limits > 0.0)
    assert len(robot.continuous) == n
    assert robot.rows == len(robot.description.links)
    assert repr(robot) == f'Robot({name!r}, {n} joints, {robot.convention})'


def frozen_arrays(robot):
    return (
        robot.limits,
        robot.velocity_limits,
        *robot.chain.table[1:],
        robot.chain.at_rest,
        robot.singularity.task.axes,
        robot.singularity.task.rotation,
        robot.singularity.task.row_scales,
        robot.singularity.task.column_scales,
    )


def test_a_robot_is_frozen_down_to_its_arrays():
    robot = robot_of('puma560')
    with pytest.raises(dataclasses.FrozenInstanceError):
        robot.name = 'other'
    for array in frozen_arrays(robot):
        with pytest.raises(ValueError, match='read-only'):
            array[0] = 0


def test_every_field_of_a_frozen_record_that_is_an_array_is_frozen():
    @dataclasses.dataclass(frozen=True, eq=False)
    class Record(FrozenArrays):
        name: str
        q: kernel.Floats

    @dataclasses.dataclass(frozen=True, eq=False)
    class Longer(Record):
        which: npt.NDArray[np.bool_]
        rows: kernel.Integers

    for record in (
        Record('a', np.zeros(2)),
        copy.deepcopy(Longer('a', np.zeros(2), np.zeros(2, bool), np.zeros(2, int))),
    ):
        arrays = [value for value in vars(record).values() if isinstance(value, np.ndarray)]
        assert len(arrays) == len(dataclasses.fields(record)) - 1
        assert not any(array.flags.writeable for array in arrays)


def test_results_are_the_callers_own():
    # Writing into a result changes neither the robot nor the next result.
    robot, q = robot_of('puma560'), np.full(6, 0.3)
    first = ks.forward_kinematics(robot, q)
    kept = first.copy()
    first[:] = 0.0
    ks.jacobian(robot, q)[:] = 0.0
    ks.link_frames(robot, q)[:] = 0.0
    assert np.array_equal(ks.forward_kinematics(robot, q), kept)
    assert np.array_equal(q, np.full(6, 0.3))


def test_a_state_keeps_the_positions_it_was_evaluated_at():
    q, qdot = np.full(6, 0.3), np.full(6, 0.1)
    state = ks.evaluate(robot_of('puma560'), q, qdot)
    q[:], qdot[:] = 9.0, 9.0
    assert np.all(state.q == 0.3)
    assert np.all(state.qdot == 0.1)


def test_the_same_number_by_every_road():
    robot, q = robot_of('panda'), np.linspace(-1, 1, 7)
    whole = ks.evaluate(robot, q, q, depth=kernel.ALL_FRAMES)
    middle = ks.evaluate(robot, q, q)
    assert np.array_equal(whole.pose, ks.forward_kinematics(robot, q))
    assert np.array_equal(whole.pose, middle.pose)
    assert np.array_equal(whole.jacobian, ks.jacobian(robot, q))
    assert np.array_equal(whole.twist, ks.twist(robot, q, q))
    assert np.array_equal(whole.link_frames, ks.link_frames(robot, q))
    assert np.array_equal(whole.position, whole.pose[:3, 3])


@pytest.mark.parametrize(
    'copied', [copy.deepcopy, lambda robot: pickle.loads(pickle.dumps(robot))]
)
def test_a_robot_crosses_processes(copied):
    robot = robot_of('scara_hsr065')
    # Where the kernel runs uncompiled there are none of the modules that it is compiled in.
    assert b'kinematics_service.kernel._' not in pickle.dumps(robot)
    other = copied(robot)
    q = np.full(4, 0.1)
    assert np.array_equal(ks.jacobian(other, q), ks.jacobian(robot, q))
    assert ks.singularity(other, q).distance == ks.singularity(robot, q).distance
    for array in frozen_arrays(other):
        assert not array.flags.writeable


@pytest.mark.slow
def test_threads_share_a_robot():
    robot = robot_of('panda')
    batches = np.random.default_rng(0).uniform(-1, 1, (16, 100, 7))
    expected = [ks.singularity(robot, q).distance for q in batches]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda q: ks.singularity(robot, q).distance, batches))
    assert np.array_equal(found, expected)


def test_the_version_is_that_of_the_manifest():
    assert re.fullmatch(r'\d+\.\d+\.\d+', ks.__version__)
