"""Proposed poses as a table and as a JointTrajectory: `audit` reads and controllers run it."""

import numpy as np

from .proposal import ProposedPoses

# Share of each joint's speed limit that the motion takes, and of rad/s or m/s without a limit.
SHARE, USUAL_SPEED = 0.25, 1.0
# Time (s) that the arm stands still at each pose, to be measured; and from rest to the first one.
HOLD, START = 2.0, 5.0
# Decimals of joint positions and times.
DIGITS = 6


def table_text(proposed: ProposedPoses) -> str:
    """Return a table (CSV), a row for each pose: stamp and positions by joint."""
    names = [f'position.{name}' for name in proposed.robot.joint_names]
    lines = [','.join(['stamp', *names])]
    for time, q in zip(_times(proposed), proposed.q):
        lines.append(','.join([f'{time:.3f}', *(f'{x:.{DIGITS}f}' for x in q)]))
    return '\n'.join([*lines, ''])


def trajectory_text(proposed: ProposedPoses) -> str:
    """Return a JointTrajectory in YAML that stands still at each pose."""
    names = ', '.join(f'"{name}"' for name in proposed.robot.joint_names)
    lines = [f'joint_names: [{names}]', 'points:']
    for time, q in zip(_times(proposed), proposed.q):
        positions = ', '.join(f'{x:.{DIGITS}f}' for x in q)
        for moment in (time, time + HOLD):
            seconds = int(moment)
            rest = round((moment - seconds) * 1e9)
            lines.append(
                f'  - {{positions: [{positions}], '
                f'time_from_start: {{sec: {seconds}, nanosec: {rest}}}}}'
            )
    return '\n'.join([*lines, ''])


def _times(proposed: ProposedPoses) -> list[float]:
    # When the arm arrives at each pose.
    limits = proposed.robot.velocity_limits
    speeds = SHARE * np.where(np.isfinite(limits), limits, USUAL_SPEED)
    times = [START]
    for before, after in zip(proposed.q, proposed.q[1:]):
        moved = float(np.max(np.abs(after - before) / speeds))
        times.append(round(times[-1] + HOLD + moved, 3))
    return times
