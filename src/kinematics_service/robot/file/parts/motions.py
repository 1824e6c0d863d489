# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read constant poses of a robot file, given as {xyz, rpy} or as a matrix; read base and tool."""

import numpy as np
import numpy.typing as npt

from ....rigid_motion import pose_of
from ..text.entries import checked, checked_list, checked_number
from ..text.fault_report import Place, number, quoted
from ..text.yaml_document import Yaml
from .description import IDENTITY, Placement, RigidMotion
from .quantities import Kind, Quantities
from .schema import PlacementEntry, PoseEntry

ZEROS = ('0', '0', '0')
# Use a rotation matrix R unchanged if no entry of |R^T R - 1| exceeds this. Matrices of exact
# expressions such as sqrt(2)/2 are within this tolerance.
EXACT_ROTATION_TOLERANCE = 1e-12
# If no entry of |R^T R - 1| exceeds this, replace R by the nearest rotation, because R may have
# been printed with six digits. Otherwise refuse R.
PRINTED_ROTATION_TOLERANCE = 1e-6


def read_placement(
    data: Yaml, at: Place, default_frame: str, quantities: Quantities
) -> Placement | None:
    """Read the pose of the base or of the tool. Report faults; after a fault return None."""
    if data is None:
        return Placement(default_frame, IDENTITY)
    entry = checked(PlacementEntry, data, at)
    frame = default_frame if entry.frame is None else entry.frame
    if frame.startswith('/'):
        plain = quoted(frame.lstrip('/'))
        message = f'{quoted(frame)} begins with a slash, which tf2 refuses; write {plain}'
        at['frame'].fault(message, 'wrong-name')
    if any(character.isspace() for character in frame):
        at['frame'].fault(f'{quoted(frame)} has white space; write underscores', 'wrong-name')
    motion = pose_motion(entry, at, quantities)
    return None if motion is None or not at.intact else Placement(frame, motion)


def pose_motion(entry: PoseEntry, at: Place, quantities: Quantities) -> RigidMotion | None:
    """
    Read a pose given by xyz and rpy, R = Rz(yaw) Ry(pitch) Rx(roll). A missing key means zeros.

    The result is None if a value has a fault.
    """
    lengths, angles = tuple(entry.xyz or ZEROS), tuple(entry.rpy or ZEROS)
    position = [quantities.fixed(text, 'length', at['xyz', i]) for i, text in enumerate(lengths)]
    turns = [quantities.fixed(text, 'angle', at['rpy', i]) for i, text in enumerate(angles)]
    numbers = [value for value in (*position, *turns) if value is not None]
    texts = tuple(text for text in (*lengths, *angles) if text is not None)
    if len(numbers) < 6:
        return None
    x, y, z, roll, pitch, yaw = numbers
    return RigidMotion(pose_of((x, y, z), (roll, pitch, yaw)), texts)


def read_motion(data: Yaml, at: Place, quantities: Quantities) -> RigidMotion | None:
    """
    Read a pose given by a matrix of 3 or 4 rows, or by {xyz, rpy}. A missing pose is the identity.
    """
    if data is None:
        return IDENTITY
    if isinstance(data, dict):
        entry = checked(PoseEntry, data, at)
        motion = pose_motion(entry, at, quantities)
        return motion if at.intact else None
    return _matrix_motion(data, at, quantities)


def _matrix_motion(data: Yaml, at: Place, quantities: Quantities) -> RigidMotion | None:
    rows = checked_list(data, at, 'a matrix of 3 or 4 rows, or {xyz, rpy}')
    if at.intact and len(rows) not in (3, 4):
        at.fault(f'expected a matrix of 3 or 4 rows, not {len(rows)}', 'wrong-shape')
    texts: list[str] = []
    values: list[float] = []
    for i, row in enumerate(rows[:4]):
        for j, item in enumerate(checked_list(row, at[i], 'four numbers', 4)):
            text = checked_number(item, at[i, j])
            kind: Kind = 'length' if i < 3 and j == 3 else 'number'
            value = quantities.fixed(text, kind, at[i, j])
            if text is not None and value is not None:
                texts.append(text)
                values.append(value)
    if not at.intact or len(values) not in (12, 16):
        return None
    if len(values) == 12:
        texts, values = [*texts, '0', '0', '0', '1'], [*values, 0.0, 0.0, 0.0, 1.0]
    matrix = _rigid(np.reshape(values, (4, 4)), at)
    return None if matrix is None else RigidMotion(matrix, tuple(texts))


def _rigid(matrix: npt.NDArray[np.float64], at: Place) -> npt.NDArray[np.float64] | None:
    if matrix[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        at[3].fault('the fourth row of a rigid motion is [0, 0, 0, 1]', 'not-a-motion')
        return None
    R = matrix[:3, :3]
    # The entries of a rotation are between -1 and 1. Limit the entries of R to the range -1000 to
    # 1000, so that R^T R cannot overflow. The check below still refuses a matrix with such large
    # entries.
    capped = np.clip(R, -1e3, 1e3)
    error = float(np.abs(capped.T @ capped - np.eye(3)).max())
    if error > PRINTED_ROTATION_TOLERANCE:
        at.fault(
            f'not a rotation: its columns are not orthogonal unit vectors, by {number(error)} '
            f'(at most {PRINTED_ROTATION_TOLERANCE:g}); write more digits, or exact expressions '
            'such as sqrt(2)/2',
            'not-a-rotation',
        )
        return None
    if np.linalg.det(R) < 0.0:
        message = 'the determinant is -1: a mirror image, not a rotation; check the signs'
        at.fault(message, 'not-a-rotation')
        return None
    if error <= EXACT_ROTATION_TOLERANCE:
        return matrix
    at.remark(f'is {number(error)} from a rotation matrix: the nearest rotation is used instead')
    # Return the rotation nearest to R in the Frobenius norm: the orthogonal factor of the polar
    # decomposition of R.
    U, _, Vt = np.linalg.svd(R)
    result: npt.NDArray[np.float64] = matrix.copy()
    result[:3, :3] = U @ Vt
    return result
