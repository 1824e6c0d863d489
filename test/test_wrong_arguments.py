# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Wrong values of each argument of each public function: a sentence, and no bare error."""

import inspect
import math

import numpy as np
import pytest
from arms import robot_of

import kinematics_service as ks
from kinematics_service import errors, kernel

UR, PANDA, PLANAR = map(robot_of, ('puma560', 'panda', 'planar_2r'))
Q, Q7 = np.full(6, 0.3), np.full(7, 0.3)
T = ks.forward_kinematics(UR, Q)
SIX = np.ones(6)
WHERE = {'axes': 'base', 'of': 'tool', 'at': None}
# Of each function a call that is right, and the robot.
CALLS = {
    'acceleration': (UR, {'q': Q, 'qdot': Q, 'qddot': Q, **WHERE}),
    'analytic_jacobian': (UR, {'q': Q, 'rates': 'rpy', 'of': 'tool', 'at': None}),
    'calibrate': (UR, {'q': [Q], 'poses': [T], 'sets': [0], 'qdot': None, 'noise': (1e-3, 1e-3)}),
    'check_plan': (
        UR,
        {
            'times': [0.0],
            'q': [Q],
            'qdot': None,
            'qddot': None,
            'distance': 0.1,
            'speed_limit': None,
            'speed_of': (),
        },
    ),
    'derive': (PLANAR, {'locked': {'a': '0'}}),
    'diagnose_frames': (UR, {'q': [Q], 'poses': [T], 'stamps': None, 'motion': None}),
    'evaluate': (UR, {'q': Q, 'qdot': None, 'depth': kernel.JACOBIAN}),
    'export_urdf': (PLANAR, {}),
    'forward_kinematics': (UR, {'q': Q, **WHERE}),
    'import_urdf': (None, {'urdf': '<robot/>', 'base': '', 'tip': ''}),
    'inverse_kinematics': (
        UR,
        {'target': T, 'near': None, 'rows': None, 'axis': None, 'tolerance': 1e-6, 'seed': 0},
    ),
    'inverse_kinematics_of_each': (UR, {'targets': [T], 'near': None, 'tolerance': 1e-6}),
    'jacobian': (UR, {'q': Q, **WHERE}),
    'jacobian_rate': (UR, {'q': Q, 'qdot': Q, **WHERE}),
    'joint_torques': (UR, {'q': Q, 'wrench': SIX, **WHERE}),
    'joint_velocity': (
        UR,
        {'state': Q, 'twist': SIX, 'settings': ks.ServoSettings(), 'axes': 'base'},
    ),
    'link_frames': (UR, {'q': Q}),
    'load_robot': (None, {'name': 'puma560'}),
    'null_space': (PANDA, {'q': Q7, 'rows': None, 'near': None}),
    'pose_covariance': (UR, {'q': Q, 'joints': 1e-3, 'calibration': None}),
    'propose_poses': (UR, {'count': 0, 'among': None}),
    'pseudo_inverse': (
        UR,
        {'q': Q, 'rows': None, 'of': 'tool', 'damping': 0.0, 'damped_below': 0.1},
    ),
    'robot_from_text': (None, {'text': 'x'}),
    'scale': (UR, {'q': Q, 'qdot': Q, 'horizon': 0.1, 'rule': None}),
    'self_motion': (PANDA, {'q': Q7}),
    'singularity': (UR, {'q': Q, 'qdot': None}),
    'twist': (UR, {'q': Q, 'qdot': Q, **WHERE}),
    'twist_at': (None, {'twist': SIX, 'r': np.ones(3)}),
    'twist_covariance': (
        UR,
        {
            'q': Q,
            'qdot': Q,
            'axes': 'base',
            'joints': 1e-3,
            'velocities': 1e-3,
            'calibration': None,
        },
    ),
    'wrench_from_torques': (UR, {'q': Q, 'torques': Q, **WHERE, 'damping': 0.0}),
}
WRONG = (
    *(None, True, 0, -1, 1.5, math.nan, 1j, 10**400, 'x', b'x', object()),
    *([], ['x'], [1], [[1, 2], [3]], {}, {'a': 1}, set()),
    *(np.zeros((0, 6)), np.zeros((2, 7)), np.full(6, math.nan), np.array([None])),
)
# They make no difference to what is asked here: another file, a table that is read elsewhere.
ELSEWHERE = {'bundled_robots', 'judge_table'}


def test_every_public_function_is_called():
    functions = {name for name in ks.__all__ if inspect.isfunction(getattr(ks, name))}
    assert functions - ELSEWHERE == CALLS.keys()


@pytest.mark.filterwarnings('ignore:invalid value:RuntimeWarning')
@pytest.mark.parametrize('function', CALLS)
def test_a_wrong_argument_is_refused_with_a_sentence(function):
    robot, right = CALLS[function]
    if robot is not None:
        right = {'robot': robot, **right}
    for name in right:
        for value in WRONG:
            if name == 'locked' and type(value) in (type(None), dict):
                continue  # nothing is locked: it would be derived
            try:
                getattr(ks, function)(**{**right, name: value})
            except errors.KinematicsError:
                continue
            except Exception as error:
                raise AssertionError(f'{name}={value!r}: {error!r}') from error


SENTENCES = {
    'qdot must be numbers': (
        lambda: ks.acceleration(UR, Q, None, Q),
        lambda: ks.jacobian_rate(UR, Q, None),
        lambda: ks.scale(UR, Q, None),
    ),
    'rule must be a ServoRule or None': (lambda: ks.scale(UR, Q, Q, rule='servo'),),
    "rows must be some of x y z rx ry rz, not '0'": (
        lambda: ks.inverse_kinematics(UR, T, rows=0),
        lambda: ks.null_space(PANDA, Q7, rows=0),
    ),
    'depth must be kernel.POSE': (lambda: ks.evaluate(UR, Q, depth='x'),),
    'rates must be one of': (lambda: ks.analytic_jacobian(UR, Q, rates=[1]),),
    'seed must be a whole number from 0 on, not -1': (
        lambda: ks.inverse_kinematics(UR, T, seed=-1),
    ),
    'joints must be numbers': (lambda: ks.pose_covariance(UR, Q, joints='x'),),
    'robot must be a Robot, the name of': (
        lambda: ks.jacobian(None, Q),
        lambda: ks.load_robot(1.5),
    ),
}


@pytest.mark.parametrize('sentence', SENTENCES)
def test_the_sentence_names_the_argument_and_what_is_accepted(sentence):
    for call in SENTENCES[sentence]:
        with pytest.raises(ValueError, match=f'^{sentence}') as caught:
            call()
        assert isinstance(caught.value, errors.KinematicsError)


def test_an_empty_batch_has_no_covariances():
    none = np.zeros((0, 6))
    assert ks.pose_covariance(UR, none, joints=1e-3).shape == (0, 6, 6)
    found = ks.twist_covariance(UR, none, none, joints=1e-3, velocities=1e-3)
    assert found.shape == (0, 6, 6)
    assert ks.pose_covariance(UR, none.reshape(2, 0, 6), joints=1e-3).shape == (2, 0, 6, 6)
