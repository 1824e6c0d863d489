# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Robot files that calibrations write: each is one that every command takes, or says why not."""

import functools

import brute_force
import numpy as np
import pytest
from arms import robot_of, without_known_poses
from calibrated_arms import measured_arm

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.calibration.corrections import corrected_robot
from kinematics_service.apps.calibration.report import facts_of, sentences_of
from kinematics_service.apps.calibration.robot_text import CalibrationOrigin, calibrated_text
from kinematics_service.kinematics.uncertainty.parameters import parameters_of

NOISE = 5e-5
SIX_ROWS = ('x', 'y', 'z', 'rx', 'ry', 'rz')
MADE_UP = CalibrationOrigin('made up', '2026-01-01')
# What is fitted, and by which tolerances.
KINDS = {
    'gears': {'fit': ['gears', 'base', 'tool']},
    'everything': {'fit': ['all']},
    'tolerance': {'tolerances': {'lengths': 3e-3, 'offsets': 5e-3, 'angles': 5e-3}},
}


@functools.cache
def found_of(name, kind):
    arm = measured_arm(name, 30, NOISE, gears=kind != 'tolerance')
    return arm, ks.calibrate(arm.robot, arm.q, arm.poses, check=False, **KINDS[kind])


def calibrated(name, kind, frames):
    """Return what is found of an arm, and its robot file."""
    arm, found = found_of(name, kind)
    text = ks.bundled_robots()[name].read_text()
    return found, calibrated_text(found, text, arm.q, arm.poses, MADE_UP, frames)


def test_the_file_has_the_sentences_of_the_report_on_what_was_found():
    found, made = calibrated('ur5e', 'tolerance', 'robot')
    head = made.partition('\nrobot:')[0]
    facts = list(facts_of(found))
    assert len(facts) >= 4 + len(found.combinations)
    said = list(sentences_of(found))
    for fact in facts:
        assert f'\n# {fact}\n' in head
        assert fact in said


@pytest.mark.slow
def test_factors_that_a_measured_tool_moves_elsewhere_are_left_out_and_it_is_said():
    # The elbow of three joints is singular where the point of the tool is, not the flange.
    kept = []
    for frames in ('robot', 'measured'):
        for name, kind in (('craig_3r', 'tolerance'), ('parallelogram_left', 'gears')):
            assert 'factors:' in ks.bundled_robots()[name].read_text()
            _, made = calibrated(name, kind, frames)
            factors = ks.robot_from_text(made).singularity.factors
            assert all(factors.approximate)
            assert bool(factors) == ('approximate here' in made)
            assert bool(factors) != ('do not hold here' in made)
            kept.append((name, frames) if factors else ())
    assert ('craig_3r', 'robot') in kept
    assert ('craig_3r', 'measured') not in kept


def test_a_tool_that_is_measured_leaves_exact_factors_of_six_joints_exact():
    arm = measured_arm('puma560', 20, size=0.0)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, fit=['base', 'tool'])
    text = ks.bundled_robots()['puma560'].read_text()
    made = calibrated_text(found, text, arm.q, arm.poses, MADE_UP, 'measured')
    assert ks.robot_from_text(made).singularity.factors.complete
    assert 'approximate' not in made


@pytest.mark.slow
def test_constants_that_the_nominal_base_alone_used_are_left_out():
    nominal = ks.bundled_robots()['offset_stanford_dh'].read_text()
    assert 'base: {xyz: [x0, y0, z0]' in nominal
    _, made = calibrated('offset_stanford_dh', 'tolerance', 'measured')
    read = ks.robot_from_text(made).description
    assert [one.name for one in read.constants] == ['a', 'h', 'l', 'm', 'n']
    assert read.warnings == ()


def test_gear_ratios_that_were_found_are_no_matter_of_formulas(tmp_path, capsys):
    file = tmp_path / 'geared.yaml'
    file.write_text(calibrated('craig_3r', 'gears', 'robot')[1])
    assert main(['derive', str(file)]) == 1
    said = capsys.readouterr().err
    assert 'are no short polynomials' in said
    assert 'without the gear ratios' in said


# Of each kind of arm one, each kind of fit at some of them: derivations take seconds, but where
# gear ratios were found.
ARMS = {
    'panda': 'gears',
    'scara_hsr065': 'tolerance',
    'parallelogram_left': 'gears',
    'rrp_elementary': 'everything',
    'offset_stanford_shape': 'gears',
}


@pytest.mark.slow
@pytest.mark.parametrize(('name', 'kind'), ARMS.items())
def test_every_arm_goes_on_from_its_calibrated_file(name, kind, tmp_path, capsys):
    file, urdf, again = (tmp_path / name for name in ('mine.yaml', 'mine.urdf', 'again.yaml'))
    for frames in ('robot', 'measured'):
        found, made = calibrated(name, kind, frames)
        file.write_text(made)
        assert main(['check', '--strict', str(file)]) == 0, capsys.readouterr().out
        robot = ks.load_robot(file)
        reached = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, found.q[3]))
        assert min(one.residual for one in (*reached.solutions, *reached.families)) < 1e-9
    code, said = main(['derive', str(file)]), capsys.readouterr()
    assert (
        code == 0 or 'derive the nominal robot file' in said.err or 'round the angles' in said.err
    )
    assert 'Traceback' not in said.err
    assert main(['export', str(file), '--urdf', str(urdf)]) == 0
    ends = ['--base', robot.base_frame, '--tip', robot.tool_frame]
    assert main(['import', '--urdf', str(urdf), *ends, '--out', str(again)]) == 0
    back = ks.forward_kinematics(ks.load_robot(again), found.q)
    assert np.abs(back - ks.forward_kinematics(robot, found.q)).max() < 1e-9
    assert 'Traceback' not in capsys.readouterr().err
    assert robot.dof == robot_of(name).dof


@pytest.mark.parametrize('name', ['planar_2r', 'planar_3r', 'scara_hsr065'])
def test_a_calibrated_planar_arm_is_still_singular_where_it_was(name):
    # A twist of 1 mrad moves the tool out of its plane; the task must stay that of the plane.
    text = without_known_poses(name).partition('\nsingularity:')[0]
    robot = ks.robot_from_text(f'{text}\n')
    table = parameters_of(robot).table
    errors = 1e-3 * np.random.default_rng(3).normal(size=len(table))
    corrected = corrected_robot(robot, table, errors)
    assert corrected.singularity.task.rows == robot.singularity.task.rows
    q = np.random.default_rng(4).uniform(-1.0, 1.0, (20, robot.dof))
    singular = ks.singularity(robot, q).nearest_singular
    singular = singular[np.isfinite(singular[:, 0])]
    assert len(singular) > 3
    assert np.all(ks.singularity(corrected, singular).distance < 0.03)


def test_a_bent_arm_of_five_joints_is_regular_where_parallel_axes_made_it_singular():
    # J is 6x5: its rank falls where two conditions hold. Three parallel axes meet both at once
    # where the arm is straight; axes that are off by 1 mrad do not.
    robot = robot_of('so101')
    table = parameters_of(robot).table
    q = np.random.default_rng(4).uniform(-1.0, 1.0, (20, robot.dof))
    singular = ks.singularity(robot, q).nearest_singular
    singular = singular[np.isfinite(singular[:, 0])][:12]
    errors = 1e-3 * np.random.default_rng(0).normal(size=len(table))
    corrected = corrected_robot(robot, table, errors)
    tasks = [one.singularity.task for one in (robot, corrected)]
    assert [(one.rows, one.generic_rank) for one in tasks] == [(SIX_ROWS, 5)] * 2
    found = ks.singularity(corrected, singular)
    away = found.distance > 0.03
    assert 3 < np.sum(away) < 11
    # By proof none is singular within the clearance, and by brute force none below the distance.
    assert np.all(found.clearance[away] > 0.03)
    true, _ = brute_force.nearest_singular(corrected, singular, known=24)
    assert np.all(found.distance < 1.05 * np.minimum(true, 1.0))
    assert np.all(true[away] > 0.95 * found.distance[away])
