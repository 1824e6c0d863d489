# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The errors of the package: their tree, what they carry, and that it crosses processes."""

import copy
import inspect
import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from arms import robot_of

import kinematics_service as ks
from kinematics_service import errors
from kinematics_service.kinematics.inverse.servo import ServoSettings

PACKAGE = Path(ks.__file__).parent
# A line of the tree: how deep, the name, whether a ValueError, what it carries.
LINE = re.compile(r'^    ([ |+-]*)(\w+Error)( \(V\))?(?:: (.+))?$', re.MULTILINE)


def kinds():
    return {
        name: kind
        for name, kind in vars(errors).items()
        if inspect.isclass(kind) and issubclass(kind, errors.KinematicsError)
    }


def test_the_tree_is_that_of_the_classes():
    above, told = [], {}
    for branch, name, value, carried in LINE.findall(errors.__doc__):
        depth = len(branch) // 4
        above[depth:] = [name]
        told[name] = above[depth - 1] if depth else 'Exception'
        kind = getattr(errors, name)
        parents = [base.__name__ for base in kind.__bases__ if base is not ValueError]
        assert parents == [told[name]], name
        assert (ValueError in kind.__bases__) == bool(value), name
        assert all(word in inspect.getsource(kind) for word in carried.split(', ')), name
    assert told.keys() == kinds().keys()


def test_every_error_of_the_package_stands_in_one_file():
    one_of = '|'.join(kinds())
    derived = re.compile(rf'^ *class +([^_\W]\w*)\([^)]*\b(?:{one_of})\b', re.MULTILINE)
    found = {
        (file, name)
        for file in PACKAGE.rglob('*.py')
        for name in derived.findall(file.read_text(encoding='utf-8'))
    }
    assert {file for file, _ in found} == {PACKAGE / 'errors.py'}


WORDS = ('a', None, [], [1.0], 1j, {})


@pytest.mark.parametrize('words', WORDS, ids=repr)
def test_what_is_no_number_is_refused_with_the_name_of_the_argument(words):
    robot, q = robot_of('puma560'), np.full(6, 0.3)
    target = ks.forward_kinematics(robot, q)
    calls = {
        'tolerance': lambda: ks.inverse_kinematics(robot, target, tolerance=words),
        'speed_limit': lambda: ks.check_plan(robot, [0.0], [q], speed_limit=words),
        'distance': lambda: ks.check_plan(robot, [0.0], [q], distance=words),
        'damping': lambda: ks.pseudo_inverse(robot, q, damping=words),
        'damped_below': lambda: ks.pseudo_inverse(robot, q, damped_below=words),
        'horizon': lambda: ks.scale(robot, q, q, horizon=words),
    }
    for name, call in calls.items():
        if words is None and name in ('speed_limit', 'distance'):
            continue  # none is asked for
        with pytest.raises(errors.ArgumentError, match=f'^{name} must be'):
            call()


def test_an_argument_that_is_wrong_is_not_said_of_another():
    q = np.full(6, 0.3)
    with pytest.raises(errors.PointError, match='^at must be three'):
        ks.acceleration('puma560', q, q, q, at='a')
    with pytest.raises(
        errors.JointVectorError, match=r'^q and near have shapes \(7,\) and \(1,\)'
    ):
        ks.null_space('panda', np.full(7, 0.3), near=[1.0])


def position(robot):
    return np.full(robot.dof, 0.3)


def endless(robot):
    return np.where(np.arange(robot.dof) == 1, np.inf, 0.3)


# What is called, and: argument, expected, given; for joint values the row, too.
REFUSED = {
    'a vector too short': (lambda r: ks.evaluate(r, [0.1, 0.2]), 'q', ((6,),), (2,), None),
    'no numbers': (lambda r: ks.evaluate(r, 'home'), 'q', ((6,),), None, None),
    'velocities too many': (
        lambda r: ks.evaluate(r, position(r), np.ones(7)), 'qdot', ((6,),), (7,), None
    ),
    'q not finite': (lambda r: ks.evaluate(r, endless(r)), 'q', ((6,),), (6,), 0),
    'qdot not finite': (
        lambda r: ks.evaluate(r, position(r), endless(r)), 'qdot', ((6,),), (6,), 0
    ),
    'a row of many': (
        lambda r: ks.evaluate(r, [[position(r)] * 2, [position(r), endless(r)]]),
        'q', ((6,),), (2, 2, 6), 3,
    ),
    'qdot of a row': (
        lambda r: ks.evaluate(r, [position(r)] * 2, [position(r), endless(r)]),
        'qdot', ((6,),), (2, 6), 1,
    ),
    'too large together': (
        lambda r: ks.evaluate(r, position(r), np.full(6, 1.7e308)), '', ((6,),), (6,), 0
    ),
    'shapes that differ': (
        lambda r: ks.evaluate(r, np.ones((2, 6)), np.ones((3, 6))),
        'qdot', ((2, 6),), (3, 6), None,
    ),
    'a target of no shape': (
        lambda r: ks.inverse_kinematics(r, np.ones((2, 2))), 'target', ((4, 4), (3,)), (2, 2)
    ),
    'a target not finite': (
        lambda r: ks.inverse_kinematics(r, [np.nan, 0, 0]), 'target', ((4, 4), (3,)), (3,)
    ),
    'a twist too long': (
        lambda r: ks.joint_velocity(r, position(r), np.ones(7)), 'twist', ((6,),), (7,)
    ),
    'other axes': (
        lambda r: ks.joint_velocity(r, position(r), np.ones(6), axes='world'),
        'axes', ('base', 'tool'), 'world',
    ),
    'settings of a servo': (
        lambda r: ServoSettings(damping=-1.0), 'damping', ('above 0',), -1.0
    ),
}  # fmt: skip


@pytest.mark.parametrize('case', REFUSED)
def test_an_error_carries_what_was_refused(case):
    call, *expected = REFUSED[case]
    with pytest.raises(errors.ArgumentError) as refusal:
        call(robot_of('puma560'))
    error = refusal.value
    for same in (error, pickle.loads(pickle.dumps(error)), copy.copy(error)):
        assert type(same) is type(error)
        assert str(same) == str(error)
        told = [same.argument, same.expected, same.given]
        assert [*told, *([same.row] if hasattr(same, 'row') else [])] == expected


def test_a_robot_that_is_not_found_is_named_with_those_that_are_there():
    with pytest.raises(ks.RobotNotFoundError) as refusal:
        ks.load_robot('puma650')
    same = pickle.loads(pickle.dumps(refusal.value))
    assert same.name == 'puma650'
    assert {'puma560', 'ur5e'} <= set(same.known)
