# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Factory calibrations of Universal Robots: the same arm, its lengths those of an arm."""

import json

import numpy as np
import pytest
from calibrated_arms import positions_within
from recordings import recorded

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.rigid_motion import roll_pitch_yaw, screw_x, screw_z

# The worst of a thousand configurations is 3e-13 m; the factory's own d of 446 m round as much.
SAME = 1e-11
SIX = 'delta_theta: expected six numbers'


@pytest.fixture
def reference():
    file = recorded('vendor_reference') / 'ur_calibration_reference.json'
    return json.loads(file.read_text())


def table_text(name, table):
    """Return a robot file with the nominal table of the reference."""
    rows = '\n'.join(
        f'  - {{a: {a}, alpha: {alpha}, d: {d}, theta: q{k + 1}}}'
        for k, (a, alpha, d) in enumerate(zip(table['a'], table['alpha'], table['d']))
    )
    joints = '\n'.join(f'  - {{name: q{k}, type: revolute}}' for k in range(1, 7))
    return (
        f'robot: {name}\nsource: reference\nconvention: standard\njoints:\n{joints}\n'
        f'links:\n{rows}\n'
    )


def conf_text(unit):
    lines = [f'delta_{key} = {unit[key]}' for key in ('theta', 'a', 'd', 'alpha')]
    end = ['joint_checksum = [ 0x6e0f7bf ]', 'calibration_status = 2 # 2 == Linearised']
    return '\n'.join(['[mounting]', *lines, *end, ''])


def factory_poses(table, unit, q):
    """Multiply the factory's table out, row by row."""
    T = np.tile(np.eye(4), (len(q), 1, 1))
    for k in range(6):
        theta, d, a, alpha = (table[key][k] + unit[key][k] for key in ('theta', 'd', 'a', 'alpha'))
        turned = np.array([screw_z(theta + angle, d) for angle in q[:, k]])
        T = T @ turned @ screw_x(alpha, a)
    return T


def imported(capsys, tmp_path, file, robot):
    out = tmp_path / 'mine.yaml'
    options = ['--ur-calibration', str(file), '--robot', str(robot), '--out', str(out)]
    code = main(['import', *options])
    printed, err = capsys.readouterr()
    assert 'Traceback' not in printed + err
    return code, printed + err, out


@pytest.mark.slow
@pytest.mark.parametrize('unit', [0, 2])
def test_the_factory_table_of_a_real_unit_becomes_one_of_millimetres(
    unit, reference, tmp_path, capsys
):
    given = reference['unit_delta_dh'][unit]
    nominal = reference[given['model']]
    table = {**nominal, 'theta': [0.0] * 6}
    robot = tmp_path / 'nominal.yaml'
    robot.write_text(table_text(given['model'], table))
    file = tmp_path / 'calibration.conf'
    file.write_text(conf_text(given))
    code, printed, out = imported(capsys, tmp_path, file, robot)
    assert code == 0, printed
    mine = ks.load_robot(out)
    q = positions_within(mine, 50, 3)
    expected = factory_poses(table, given, q)
    assert np.abs(ks.forward_kinematics(mine, q) - expected).max() < SAME
    lengths = [
        abs(cell.affine.constant)
        for row in mine.description.links
        for cell in (row['a'], row['d'])
    ]
    assert max(lengths) < 0.7  # the factory's are up to 446 m
    assert main(['check', '--strict', str(out)]) == 0


@pytest.mark.slow
def test_the_yaml_of_ur_calibration_is_read_as_origins_of_joints(tmp_path, capsys):
    robot = ks.load_robot('ur5e')
    random = np.random.default_rng(0)
    origins, rows = [], []
    for link in robot.description.links:
        d, a = link['d'].affine.constant, link['a'].affine.constant
        origins.append(screw_z(0.0, d))
        rows.append(screw_x(link['alpha'].affine.constant, a))
    # Each joint's origin is what follows the joint before it; small errors are added.
    poses = [origins[0], *(rows[k] @ origins[k + 1] for k in range(5))]
    poses = [
        T @ screw_x(*(1e-3 * random.normal(size=2))) @ screw_z(*(1e-3 * random.normal(size=2)))
        for T in poses
    ]
    links = ('shoulder', 'upper_arm', 'forearm', 'wrist_1', 'wrist_2', 'wrist_3')
    lines = ['kinematics:']
    for link, T in zip(links, poses):
        numbers = [*T[:3, 3].tolist(), *roll_pitch_yaw(T[:3, :3]).tolist()]
        keys = ('x', 'y', 'z', 'roll', 'pitch', 'yaw')
        lines += [f'  {link}:', *(f'    {key}: {x!r}' for key, x in zip(keys, numbers))]
    file = tmp_path / 'my_robot_calibration.yaml'
    file.write_text('\n'.join([*lines, '  hash: calib_1234', '']))
    code, printed, out = imported(capsys, tmp_path, file, 'ur5e')
    assert code == 0, printed
    q = positions_within(robot, 50, 3)
    expected = np.tile(np.eye(4), (50, 1, 1))
    for T, joint in zip(poses, q.T):
        expected = expected @ T @ np.array([screw_z(angle, 0.0) for angle in joint])
    assert np.abs(ks.forward_kinematics(ks.load_robot(out), q) - expected).max() < SAME


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('nothing\n', 'delta_theta|shoulder'),
        ('[mounting]\ndelta_theta = [0, 0]\n', SIX),
        ('[mounting]\ndelta_theta = __import__("os")\n', SIX),
        *(
            (f'[mounting]\ndelta_theta = {six}\n', SIX)
            for six in (
                f'[{"9" * 400}, 0, 0, 0, 0, 0]',
                f'[0x{"f" * 20_000}, 0, 0, 0, 0, 0]',
                '[1e999, 0, 0, 0, 0, 0]',
                '{1: 0, 2: 0, 3: 0, 4: 0, 5: 0, 6: 0}',
                '{1, 2, 3, 4, 5, 6}',
                'b"123456"',
                '"123456"',
                '["1", "2", "3", "4", "5", "6"]',
                '[True, False, True, False, True, False]',
                '[0, 0, 0, 0, 0, 0, "x"]',
                '[1j, 0, 0, 0, 0, 0]',
                '123456',
                f'{"[" * 5000}',
            )
        ),
        ('[mounting]\ndelta_theta = [0, 0, 0, 0, 0, 0]\n', 'delta_a is missing'),
        ('[mounting]\ndelta_theta = (0, 0, 0, 0, 0, 0)\n', 'delta_a is missing'),
        ('delta_theta = [0]\n', 'cannot be read'),
        ('kinematics: 3\n', 'kinematics must be a mapping'),
        ('kinematics: {shoulder: {x: 1}}\n', 'kinematics.shoulder: |x, y'),
        ('kinematics: [1\n', 'not valid YAML'),
    ],
)
def test_a_file_that_is_none_is_refused(text, words, tmp_path, capsys):
    file = tmp_path / 'calibration.conf'
    file.write_text(text)
    code, printed, _ = imported(capsys, tmp_path, file, 'ur5e')
    assert code == 1
    assert 'calibration.conf:' in printed
    assert [word for word in words.split('|') if word not in printed] == []


def test_the_calibration_of_another_robot_is_refused(reference, tmp_path, capsys):
    file = tmp_path / 'calibration.conf'
    file.write_text(conf_text(reference['unit_delta_dh'][1]))
    code, printed, _ = imported(capsys, tmp_path, file, 'ur3e')
    assert code == 1
    assert 'it is another robot' in printed
    code, printed, _ = imported(capsys, tmp_path, file, 'panda')
    assert code == 1
    assert 'panda: ' in printed
    assert 'ur3e, ur5e' in printed
    code, printed, _ = imported(capsys, tmp_path, tmp_path / 'none.conf', 'ur10e')
    assert code == 1
    assert 'cannot be read' in printed
    assert main(['import', '--ur-calibration', str(file)]) == 2
    assert main(['import', '--base', 'a']) == 2
