# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""`check` tells what a robot file says of how far its arm may be off."""

import pytest

from kinematics_service.__main__ import main

ARM = """\
robot: mine
source: made up for this test
convention: standard
units: {angle: deg, length: mm}
joints:
  - {name: q1, type: revolute, limits: [-180, 180]}
  - {name: q2, type: prismatic, limits: [0, 200]}
links:
  - {a: 300, alpha: 90, d: 0, theta: q1}
  - {a: 100, alpha: 0, d: q2, theta: 0}
"""


def said(tmp_path, capsys, sections):
    file = tmp_path / 'mine.yaml'
    file.write_text(ARM + sections)
    assert main(['check', str(file)]) == 0
    lines = capsys.readouterr().out.splitlines()
    begin = next(k for k, line in enumerate(lines) if line.startswith('  measure')) + 1
    end = next(k for k, line in enumerate(lines) if line.startswith('  known poses'))
    return [' '.join(line.split()) for line in lines[begin:end]]


@pytest.mark.parametrize(
    ('sections', 'end'),
    [
        (
            'uncertainty: {encoder_noise: [0.18, 0.6]}\n',
            'positions: 0.00314 rad, 0.0006 m',
        ),
        (
            'uncertainty: {velocity_noise: [1.8, 2]}\n',
            'velocities: 0.0314 rad/s, 0.002 m/s',
        ),
        (
            'uncertainty: {parameters: {lengths: 0.3, angles: 0.09}}\n',
            ': lengths 0.0003, angles 0.00157',
        ),
        (
            'uncertainty: {covariance: {a1: [0.3], a2: [0.3, 0.4]}}\n',
            ': a1 0.0003, a2 0.0005',
        ),
        (
            'uncertainty: {floor: {xyz: 0.1, rpy: 0.18}}\n',
            'floor of poses: 0.0001 m, 0.00314 rad',
        ),
    ],
)
def test_an_uncertainty_is_told_in_rad_and_metres(tmp_path, capsys, sections, end):
    (line,) = said(tmp_path, capsys, sections)
    assert line.startswith('uncertainty ')
    assert line.endswith(end)


def test_a_file_without_an_uncertainty_has_no_line_of_it(tmp_path, capsys):
    assert said(tmp_path, capsys, '') == []


def test_a_tolerance_is_told_in_rad_and_metres(tmp_path, capsys):
    told = said(tmp_path, capsys, 'tolerance: {length: 0.2, angle: 0.18, of: {a2: 0.05}}\n')
    assert told == ['tolerance lengths 0.0002, angles 0.00314, a2 5e-05 (m, rad)']
