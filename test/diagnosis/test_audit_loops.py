"""A recording of an arm with closed loops is judged; what does not close is counted."""

import math

import kinematics_service as ks
from kinematics_service.__main__ import main


def test_positions_at_which_a_loop_does_not_close_are_counted_and_left_out(tmp_path, capsys):
    # A five-bar whose elbows come too far apart for its rods, again and again.
    text = ks.bundled_robots()['five_bar'].read_text(encoding='utf-8').split('known_poses')[0]
    text = text.replace('distal: 0.4', 'distal: 0.3').replace('[0, 2*pi/3]', '[0, pi]')
    robot = tmp_path / 'short.yaml'
    robot.write_text(text.replace('psi1: -1.27, psi2: 1.27', 'psi1: -1.51, psi2: 1.51'))
    lines = ['stamp,position.left,position.right']
    opened = 0
    for k in range(700):
        x = 0.9 * abs(math.sin(0.01 * k))
        opened += 0.15 + 0.25 * math.sin(x) > 0.3  # half the way between the elbows, and a rod
        lines.append(f'{100 + 0.01 * k:.3f},{math.pi / 2 + x},{math.pi / 2 - x}')
    recording = tmp_path / 'recording.csv'
    recording.write_text('\n'.join(lines) + '\n')
    main(['audit', str(recording), '--robot', str(robot)])
    said = capsys.readouterr().out
    assert f'{opened} messages made no new state: loop does not close ({opened}).' in said
    assert 'The arm comes too close to a singularity (rods)' in said
