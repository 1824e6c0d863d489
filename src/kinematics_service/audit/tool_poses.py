"""
Poses of a second source as matrices.

"""

import math

import numpy as np

from ..frame_doctor.rotations import exponential
from ..kernel import Floats
from ..rigid_motion import rotation_of_quaternion, rotation_of_roll_pitch_yaw
from .block import AuditError, Flags, Times
from .pose_format import PoseFormat
from .source import PoseTrack

# A quaternion may be so far from unit length: float32 and printed digits, not another thing.
UNIT = 0.05
# Up to this share of the rows may be no pose and are left out; more are refused.
FEW = 0.05
# No arm on a fixed base is so far (m) from the origin of a cell.
FARTHEST = 20.0
# A rotation vector or an angle is at most a turn (rad); printed digits may be a little above.
TURN = 1.001 * math.tau


def pose_track(
    name: str,
    frame: str,
    stamps: Times,
    rows: Floats,
    form: PoseFormat,
    q: Floats | None = None,
) -> PoseTrack:
    """
    Return the track of poses in rows (N, k) of a format; refused where they cannot be poses.

    Single rows that are no pose are left out, and told: uninitialised first messages, say.
    """
    none = _none(rows, form)
    if np.mean(none) > FEW:
        kept = rows  # refused below, with the reason
    else:
        kept, stamps, q = rows[~none], stamps[~none], None if q is None else q[~none]
    try:
        poses = poses_of(kept, form)
    except AuditError as error:
        return PoseTrack(name, frame, stamps, np.zeros((0, 4, 4)), q, str(error))
    doubts = []
    if len(kept) < len(rows):
        doubts.append(
            f'{len(rows) - len(kept):,} of {len(rows):,} poses are left out: they are not finite '
            'or have a quaternion that is not of unit length'
        )
    far = float(np.max(np.abs(poses[:, :3, 3]), initial=0.0))
    if far > FARTHEST:
        ask = ': are these millimetres? (--pose-format mm)' if form.length == 'm' else ''
        doubts.append(f'positions are up to {far:,.0f} m away{ask}')
    return PoseTrack(name, frame, stamps, poses, q, '', tuple(doubts))


def _none(rows: Floats, form: PoseFormat) -> Flags:
    none: Flags = ~np.all(np.isfinite(rows), axis=1)
    if form.kind in ('xyzw', 'wxyz'):
        with np.errstate(invalid='ignore'):
            none |= ~(np.abs(np.linalg.norm(rows[:, 3:], axis=1) - 1.0) <= UNIT)
    return none


def poses_of(rows: Floats, form: PoseFormat) -> Floats:
    """
    Return poses (N, 4, 4), m, of rows (N, k).

    Raises
    ------
    AuditError
        A number is not finite or beyond what it can be.

    """
    if not np.all(np.isfinite(rows)):
        raise AuditError('a pose is not finite')
    length = 1e-3 if form.length == 'mm' else 1.0
    T = np.zeros((len(rows), 4, 4))
    T[:, 3, 3] = 1.0
    if form.kind == 'matrix':
        T[:, :3] = _matrices(rows)
    else:
        T[:, :3, :3], T[:, :3, 3] = ROTATIONS[form.kind](rows[:, 3:], form), rows[:, :3]
    T[:, :3, 3] *= length
    return T


def _of_quaternions(numbers: Floats, form: PoseFormat) -> Floats:
    norms = np.linalg.norm(numbers, axis=1)
    if np.any(np.abs(norms - 1.0) > UNIT):
        worst = float(norms[int(np.argmax(np.abs(norms - 1.0)))])
        raise AuditError(f'a quaternion has the length {worst:.3g}, which should be 1')
    return rotation_of_quaternion(numbers if form.kind == 'xyzw' else np.roll(numbers, -1, axis=1))


def _of_vectors(numbers: Floats, form: PoseFormat) -> Floats:
    vectors = _angles(numbers, form)
    longest = float(np.max(np.linalg.norm(vectors, axis=1), initial=0.0))
    if longest > TURN:
        raise AuditError(_more_than_a_turn('a rotation vector has the length', longest, form))
    return exponential(vectors)


def _of_roll_pitch_yaw(numbers: Floats, form: PoseFormat) -> Floats:
    angles = _angles(numbers, form)
    largest = float(np.max(np.abs(angles), initial=0.0))
    if largest > TURN:
        raise AuditError(_more_than_a_turn('an angle is', largest, form))
    return np.array([rotation_of_roll_pitch_yaw(one) for one in angles]).reshape(-1, 3, 3)


ROTATIONS = {
    'xyzw': _of_quaternions,
    'wxyz': _of_quaternions,
    'rotvec': _of_vectors,
    'rpy': _of_roll_pitch_yaw,
}


def _angles(numbers: Floats, form: PoseFormat) -> Floats:
    return np.radians(numbers) if form.angle == 'deg' else numbers


def _more_than_a_turn(what: str, angle: float, form: PoseFormat) -> str:
    if form.angle == 'deg':
        return f'{what} {math.degrees(angle):.4g} deg, more than a turn'
    other = 'deg' if form.kind == 'rpy' else 'deg, or deg,rpy if they are roll pitch yaw'
    return f'{what} {angle:.4g} rad, more than a turn: are these degrees? (--pose-format {other})'


def _matrices(rows: Floats) -> Floats:
    # Rows of four; sixteen numbers may also stand in columns, which the (0, 0, 0, 1) tells.
    if rows.shape[1] == 12:
        return rows.reshape(-1, 3, 4)
    T = rows.reshape(-1, 4, 4)
    for matrices in (T, np.swapaxes(T, 1, 2)):
        if np.allclose(matrices[:, 3], (0.0, 0.0, 0.0, 1.0), atol=1e-6):
            return np.array(matrices[:, :3])
    raise AuditError('a matrix has no row 0 0 0 1, so it is no pose')
