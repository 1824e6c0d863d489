# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Choose the poses to measure next by D-optimal design. The chosen poses reduce the determinant of
the covariance of the fit most.

Candidates are random joint positions inside the limits and away from singular poses, or given
joint positions. Candidates are added one by one: each time the candidate that reduces the
determinant most. Then chosen poses are exchanged for better candidates, until no exchange reduces
the determinant (Fedorov 1972).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...errors import CalibrationError
from ...kernel import Floats
from ...kinematics.arguments import number_or_nan
from ...kinematics.forward import forward_kinematics
from ...kinematics.singularity import singularity
from ...kinematics.uncertainty.corrected_chain import pose_change
from ...kinematics.uncertainty.parameters import parameters_of, placement
from ...rigid_motion import inverses
from ...robot.chain import FrozenArrays
from ...robot.file.parts.parameters import ENDS, GEARS, SIX, end_parameters
from ...robot.measures import Level
from ...robot.robot import AnyRobot, Robot, as_robot
from ...robot.task import SEED, seeded_poses
from ..recordings.readers.block import Flags
from .board_views import BoardViews
from .camera import ON_TOOL
from .checking import finite_rows, refuse_loops
from .chosen_parameters import prior_of
from .collecting import SECOND
from .fitting import of_inverses
from .result import Calibration

# Noise that is assumed if no pose has been measured yet: the standard deviation of each coordinate
# of a position (m) and of a rotation vector (rad).
NOISE = 5e-5
# Margin that candidates keep from each limit of a joint, as a share of the range of the joint.
LIMIT_MARGIN = 0.02
# An exchange of a chosen pose for another candidate is accepted only if it increases the log
# determinant of the information matrix by at least this.
MIN_GAIN = 1e-6
MAX_COUNT = 200
# Largest number of candidates. They are taken from given joint positions, or drawn near joint
# positions at which poses or images were measured.
MAX_GIVEN = 4096
# Candidates are drawn at random near measured joint positions. Each joint of a candidate is at
# most this value (rad) from the measured joint position. For prismatic joints, the value is
# multiplied by the characteristic length.
SPREAD = 0.5
# The planned motion uses this share of the speed limit of each joint.
SPEED_SHARE = 0.25
# Speed limit (rad/s, m/s) that is assumed for a joint without a speed limit.
USUAL_SPEED = 1.0
# Time (s) for which the arm stands still at each pose, so that it can be measured.
HOLD_TIME = 2.0
# Time (s) that the planned motion takes from rest to the first pose.
START_TIME = 5.0
# Number of decimals with which joint positions are written.
DIGITS = 6


class LineOfSight(NamedTuple):
    """
    A cone at the tool. The instrument must lie in the cone, so that the instrument sees the tool.

    Attributes
    ----------
    point : shape (3,), m
        Position of the instrument in the base frame.
    half_angle
        Half of the opening angle of the cone, rad.
    axis : shape (3,)
        Direction of the cone's axis in tool axes; default: the tool's z axis.
    """

    point: npt.ArrayLike
    half_angle: float
    axis: npt.ArrayLike = (0.0, 0.0, 1.0)

    def is_free(self, poses: Floats) -> Flags:
        """
        Return flags (N,): whether the instrument sees the tool at each of N tool poses (N, 4, 4).

        The instrument sees the tool if the angle between two directions is at most `half_angle`:
        the direction from the origin of the tool to the instrument, and `axis` (in tool axes).
        """
        axis = np.asarray(self.axis, dtype=np.float64)
        ways = np.asarray(self.point) - poses[:, :3, 3]
        along = np.einsum('nij,j,ni->n', poses[:, :3, :3], axis / np.linalg.norm(axis), ways)
        return np.asarray(along >= np.cos(self.half_angle) * np.linalg.norm(ways, axis=1))


@dataclass(frozen=True, eq=False)
class ProposedPoses(FrozenArrays):
    """
    Poses to measure next.

    Attributes
    ----------
    robot
        The arm.
    q : shape (N, n), rad or m
        Joint positions inside the limits, in an order that moves the joints little.
    names : P
        Names of the parameters.
    before, after : shape (P,), rad or m
        Standard deviations of the parameters now, and after these poses have been measured.
    rows : shape (N,)
        Indices of the proposed poses among the given joint positions; empty if none were given.
    """

    robot: Robot
    q: Floats
    names: tuple[str, ...]
    before: Floats
    after: Floats
    rows: npt.NDArray[np.intp]


def propose_poses(
    robot: AnyRobot,
    count: int,
    after: Calibration | None = None,
    positions: bool = False,
    *,
    among: npt.ArrayLike | None = None,
    line_of_sight: LineOfSight | None = None,
) -> ProposedPoses:
    """
    Return the poses to measure next for a calibration.

    Parameters
    ----------
    robot
        The arm.
    count
        Number of poses.
    after
        The calibration so far; None: nothing has been measured. If its poses were measured in
        several sets, for example from several places of the instrument, the proposed poses
        continue the first set.
    positions
        Whether only positions will be measured; ignored if `after` is given.
    among : shape (M, n), rad or m
        The joint positions to choose from, at most 4,096 of them; None: any joint positions inside
        the limits and away from singular poses.
    line_of_sight
        The cone in which the instrument must lie; None: no condition. If `after` is from images of
        a board, the whole board is also in view at the proposed poses.

    Raises
    ------
    CalibrationError
        `count` is not between 1 and 200; too few poses satisfy the conditions; `among` does not
        have the shape of joint positions; or `after` is a calibration by touched points.

    Examples
    --------
    >>> import kinematics_service as ks
    >>> robot = ks.load_robot('ur5e')
    >>> ks.propose_poses(robot, 8).q.shape
    (8, 6)
    """
    robot = as_robot(robot)
    refuse_loops(robot.description)
    if after is not None and after.points:
        message = 'after: poses are proposed after measured poses, not after touched points'
        raise CalibrationError(message, code='unsupported')
    if not 1 <= number_or_nan(count) <= MAX_COUNT or count != int(count):
        message = f'count: {count} is out of range; propose 1 to {MAX_COUNT} poses'
        raise CalibrationError(message, code='out-of-range')
    views = None if after is None else after.views
    if among is None:
        q = _candidates(robot) if after is None or views is None else _around(robot, after, views)
        rows = np.arange(len(q))
    else:
        q = finite_rows('among', among, robot.dof)
        # Remove repeated joint positions, so that each joint position is one candidate.
        rows = np.sort(np.unique(q, axis=0, return_index=True)[1])
        if len(rows) > MAX_GIVEN:
            rows = rows[np.linspace(0, len(rows) - 1, MAX_GIVEN).astype(int)]
    if line_of_sight is not None:
        rows = rows[line_of_sight.is_free(forward_kinematics(robot, q[rows]))]
    if after is not None and views is not None:
        rows = rows[views.are_in_view(_board(after, forward_kinematics(robot, q[rows])))]
    if len(rows) < count:
        where = 'of those that are given' if among is not None else f'of {robot.name}'
        faces = '' if line_of_sight is None else ' from which the tool faces the point'
        faces += '' if views is None else ' that have the board in the image'
        raise CalibrationError(
            f'only {len(rows)} poses {where}{faces} can be proposed, not {count}; ask for fewer',
            code='too-few',
        )
    q = q[rows]
    names, J, scales = _equations(robot, q, after, positions)
    known = np.eye(len(names))
    if after is not None:
        columns = after.fitted_of(names)[1]
        known = after.covariance[np.ix_(columns, columns)] / np.outer(scales, scales)
    chosen = _chosen(J, np.asarray(np.linalg.inv(known), dtype=np.float64), count)
    covariance = _after(known, J[chosen].reshape(-1, len(names)))
    before, later = (scales * np.sqrt(np.diag(matrix)) for matrix in (known, covariance))
    chosen = [chosen[k] for k in _order(q[chosen])]
    of_given = rows[chosen] if among is not None else rows[:0]
    return ProposedPoses(robot, q[chosen], names, before, later, of_given)


def _candidates(robot: Robot) -> Floats:
    q = seeded_poses(robot.limits, robot.prismatic)
    # Limit revolute joints to half a turn each way from 0, because a full turn more does not
    # change the pose of the tool.
    turn = np.where(robot.prismatic, np.inf, np.pi)
    low, high = np.clip([q.min(axis=0), q.max(axis=0)], -turn, turn)
    fraction = (q - q.min(axis=0)) / np.ptp(q, axis=0)
    q = low + (LIMIT_MARGIN + (1.0 - 2.0 * LIMIT_MARGIN) * fraction) * (high - low)
    away = np.asarray(singularity(robot, q).level) == Level.OK
    if not np.any(away):
        raise CalibrationError(
            f'{robot.name}: all its poses are near singular ones, none is proposed; check its '
            'joint limits and its task',
            code='singular',
        )
    return np.asarray(q[away])


def _board(after: Calibration, poses: Floats) -> Floats:
    # Return the poses (N, 4, 4) of the board in the frame of the camera, for given poses of the
    # tool in the base frame.
    measured = after.base_offsets[0] @ poses @ after.tool_offsets[0]
    return inverses(measured) if after.camera == ON_TOOL else measured


def _around(robot: Robot, after: Calibration, views: BoardViews) -> Floats:
    # Return random joint positions near those at which the images were taken, because at other
    # joint positions the camera seldom sees the board.
    random = np.random.default_rng(SEED)
    q = after.q[random.integers(after.count, size=MAX_GIVEN)]
    q = q + random.uniform(-1.0, 1.0, q.shape) * SPREAD * robot.singularity.task.column_scales
    low, high = robot.limits.T
    margin = LIMIT_MARGIN * np.where(np.isfinite(high - low), high - low, 0.0)
    inside = np.all((q > low + margin) & (q < high - margin), axis=1)
    q = q[inside & views.are_in_view(_board(after, forward_kinematics(robot, q)))]
    return np.asarray(q[np.asarray(singularity(robot, q).level) == Level.OK])


def _equations(
    robot: Robot, q: Floats, after: Calibration | None, positions: bool
) -> tuple[tuple[str, ...], Floats, Floats]:
    # Return the names of the parameters, the Jacobian (N, rows, P) of the N candidate poses by the
    # parameters, and the prior standard deviations. Each row of the Jacobian is divided by the
    # noise of the measured number, and each column multiplied by the prior standard deviation of
    # the parameter.
    known = () if after is None else after.parameters
    arm = parameters_of(robot, any(entry.group == GEARS for entry in known))
    parameters = [*arm.table, *(entry for end in ENDS for entry in end_parameters(end, 0))]
    names, count, noise = [entry.name for entry in parameters], len(arm.table), (NOISE, NOISE)
    base, tool = robot.description.base.motion.matrix, robot.description.tool.motion.matrix
    if after is None:
        point = ('tool.rx', 'tool.ry', 'tool.rz') if positions else ()
        kept = [k for k, name in enumerate(names) if name not in point]
        of_file = robot.description.tolerances
        scales = np.array([prior_of(parameters[k], {}, of_file) for k in kept])
    else:
        kept, fitted = after.fitted_of(names)
        scales = np.array([known[k].prior for k in fitted])
        positions, noise = after.positions, after.noise
        base, tool = after.base_offsets[0] @ base, tool @ after.tool_offsets[0]
    chain = placement(arm.chain, base, tool, (count, count + len(SIX)))
    change = pose_change(chain, np.zeros(len(parameters)), q)
    J = change.jacobian
    if after is not None and after.camera == ON_TOOL:
        J = of_inverses(change.pose, J)
    if after is not None and after.views is not None:
        J = after.views.whitening_at(_board(after, forward_kinematics(robot, q))) @ J
    J = J[:, : 3 if positions else 6, kept] * scales
    J[:, :3] /= noise[0]
    J[:, 3:] /= noise[1]
    return tuple(names[k] for k in kept), J, scales


def _after(covariance: Floats, J: Floats) -> Floats:
    # Return the covariance of the parameters after a measurement with the Jacobian J and unit
    # noise. Use Joseph's form, whose result stays positive definite. Other forms of the update may
    # lose this property, because entries of the covariance differ by ten powers of ten.
    S = J @ covariance @ J.T + np.eye(len(J))
    gain = np.linalg.solve(S, J @ covariance).T
    kept = np.eye(len(covariance)) - gain @ J
    return np.asarray(kept @ covariance @ kept.T + gain @ gain.T)


def _chosen(J: Floats, information: Floats, count: int) -> list[int]:
    chosen = list[int]()
    for _ in range(count):
        chosen.append(_best(J, information, chosen))
    value, exchanged = _value(J, information, chosen), True
    # Exchange chosen poses as long as the log determinant of the information matrix M grows.
    # Compare log det M of whole sets of poses. If M is ill-conditioned, differences between the
    # gains of single poses would be round-off. log det M grows with each exchange, so no set
    # occurs twice and the loop ends.
    while exchanged:
        exchanged = False
        for place in range(count):
            others = chosen[:place] + chosen[place + 1 :]
            changed = [*others[:place], _best(J, information, others), *others[place:]]
            if (grown := _value(J, information, changed)) > value + MIN_GAIN:
                chosen, value, exchanged = changed, grown, True
    return chosen


def _measured(J: Floats, information: Floats, chosen: Sequence[int]) -> Floats:
    # Return the information matrix after the chosen poses are measured: `information` plus what
    # these poses add. Sort the poses, so that the matrix does not depend on the order of choice.
    rows = J[np.array(sorted(chosen), dtype=np.int64)].reshape(-1, len(information))
    return np.asarray(information + rows.T @ rows)


def _value(J: Floats, information: Floats, chosen: Sequence[int]) -> float:
    return float(np.linalg.slogdet(_measured(J, information, chosen))[1])


def _best(J: Floats, information: Floats, others: Sequence[int]) -> int:
    # Return the index of the candidate pose with the largest gain among those that are not in
    # `others`, the candidates already chosen. Let M be the information matrix after the poses
    # `others` are measured. A pose with the Jacobian J increases log det M by log det(I + J M^-1
    # J^T), which is its gain.
    inverse = np.linalg.inv(_measured(J, information, others))
    inner = np.eye(J.shape[1]) + J @ (0.5 * (inverse + inverse.T)) @ np.swapaxes(J, 1, 2)
    gains = np.asarray(np.linalg.slogdet(inner)[1])
    gains[np.array(others, dtype=np.int64)] = -np.inf
    return int(np.argmax(gains))


def _order(q: Floats) -> list[int]:
    # Return the order in which the arm visits the poses: from each pose to the nearest remaining
    # pose.
    remaining, order = set(range(1, len(q))), [0]
    while remaining:
        order.append(min(remaining, key=lambda k: float(np.max(np.abs(q[k] - q[order[-1]])))))
        remaining.remove(order[-1])
    return order


def _written(q: Floats) -> list[str]:
    return [f'{x:.{DIGITS}f}' for x in q.tolist()]


def table_text(proposed: ProposedPoses) -> str:
    """Return proposed poses as CSV text, one row for each pose: stamp (s) and joint positions."""
    lines = [','.join(['stamp', *(f'position.{name}' for name in proposed.robot.joint_names)])]
    for time, q in zip(_times(proposed), proposed.q):
        lines.append(','.join([f'{time:.3f}', *_written(q)]))
    return '\n'.join([*lines, ''])


def trajectory_text(proposed: ProposedPoses) -> str:
    """
    Return proposed poses as a JointTrajectory in YAML text. The arm stands still for 2 s at each
    pose.
    """
    names = ', '.join(f'"{name}"' for name in proposed.robot.joint_names)
    lines = [f'joint_names: [{names}]', 'points:']
    for time, q in zip(_times(proposed), proposed.q):
        for moment in (time, time + HOLD_TIME):
            at = f'sec: {int(moment)}, nanosec: {round((moment - int(moment)) * SECOND)}'
            positions = ', '.join(_written(q))
            lines.append(f'  - {{positions: [{positions}], time_from_start: {{{at}}}}}')
    return '\n'.join([*lines, ''])


def _times(proposed: ProposedPoses) -> list[float]:
    # Return the times (s) at which the arm arrives at each pose.
    limits = proposed.robot.velocity_limits
    speeds = SPEED_SHARE * np.where(np.isfinite(limits), limits, USUAL_SPEED)
    times = [START_TIME]
    for before, after in zip(proposed.q, proposed.q[1:]):
        moved = float(np.max(np.abs(after - before) / speeds))
        times.append(round(times[-1] + HOLD_TIME + moved, 3))
    return times
