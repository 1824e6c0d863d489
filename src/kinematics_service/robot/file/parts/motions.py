"""Constant poses of a robot file: {xyz, rpy}, matrices, the base and the tool."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ....rigid_motion import rotation_of_roll_pitch_yaw
from ..text.entries import checked, checked_list, checked_number
from ..text.fault_report import number, quoted
from ..text.yaml_document import Path
from .description import IDENTITY, Placement, RigidMotion
from .quantities import Kind, Quantities
from .schema import PlacementEntry, PoseEntry

ZEROS = ('0', '0', '0')
ROUND_OFF = 1e-12  # a rotation of exact expressions is this good: its numbers stay as they are
PRINTED = 1e-6  # six printed digits are this good: the nearest rotation is taken


def read_placement(
    data: Any, path: Path, default_frame: str, quantities: Quantities
) -> Placement | None:
    """Return the base or the tool, or None with its faults reported."""
    if data is None:
        return Placement(default_frame, IDENTITY)
    report = quantities.report
    before = report.fault_count
    entry = checked(PlacementEntry, data, path, report)
    frame = default_frame if entry.frame is None else entry.frame
    if frame.startswith('/'):
        report.fault((*path, 'frame'), f'{quoted(frame)} begins with a slash, which tf2 refuses')
    if any(character.isspace() for character in frame):
        report.fault((*path, 'frame'), f'{quoted(frame)} holds white space')
    motion = pose_motion(entry.xyz, entry.rpy, path, quantities)
    return None if motion is None or report.fault_count > before else Placement(frame, motion)


def pose_motion(
    xyz: Sequence[str | None] | None,
    rpy: Sequence[str | None] | None,
    path: Path,
    quantities: Quantities,
) -> RigidMotion | None:
    """
    Return the pose of xyz and rpy, R = Rz(yaw) Ry(pitch) Rx(roll); what is not given is zero.
    """
    lengths, angles = tuple(xyz or ZEROS), tuple(rpy or ZEROS)
    position = [
        quantities.fixed(text, 'length', (*path, 'xyz', i)) for i, text in enumerate(lengths)
    ]
    turns = [quantities.fixed(text, 'angle', (*path, 'rpy', i)) for i, text in enumerate(angles)]
    numbers = [value for value in (*position, *turns) if value is not None]
    texts = tuple(text for text in (*lengths, *angles) if text is not None)
    if len(numbers) < 6:
        return None
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_of_roll_pitch_yaw(numbers[3:])
    matrix[:3, 3] = numbers[:3]
    return RigidMotion(matrix, texts)


def read_motion(data: Any, path: Path, quantities: Quantities) -> RigidMotion | None:
    """Return a matrix of 3 or 4 rows, or {xyz, rpy}; identity where nothing is given."""
    if data is None:
        return IDENTITY
    if isinstance(data, dict):
        before = quantities.report.fault_count
        entry = checked(PoseEntry, data, path, quantities.report)
        motion = pose_motion(entry.xyz, entry.rpy, path, quantities)
        return motion if quantities.report.fault_count == before else None
    return _matrix_motion(data, path, quantities)


def _matrix_motion(data: Any, path: Path, quantities: Quantities) -> RigidMotion | None:
    report = quantities.report
    before = report.fault_count
    rows = checked_list(data, path, report, 'a matrix of 3 or 4 rows, or {xyz, rpy}')
    if report.fault_count == before and len(rows) not in (3, 4):
        report.fault(path, f'expected a matrix of 3 or 4 rows, not {len(rows)}')
    texts: list[str] = []
    values: list[float] = []
    for i, row in enumerate(rows[:4]):
        for j, item in enumerate(checked_list(row, (*path, i), report, 'four numbers', 4)):
            text = checked_number(item, (*path, i, j), report)
            kind: Kind = 'length' if i < 3 and j == 3 else 'number'
            value = quantities.fixed(text, kind, (*path, i, j))
            if text is not None and value is not None:
                texts.append(text)
                values.append(value)
    if report.fault_count > before or len(values) not in (12, 16):
        return None
    if len(values) == 12:
        texts, values = [*texts, '0', '0', '0', '1'], [*values, 0.0, 0.0, 0.0, 1.0]
    matrix = _rigid(np.reshape(values, (4, 4)), path, quantities)
    return None if matrix is None else RigidMotion(matrix, tuple(texts))


def _rigid(
    matrix: npt.NDArray[np.float64], path: Path, quantities: Quantities
) -> npt.NDArray[np.float64] | None:
    report = quantities.report
    if matrix[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        report.fault((*path, 3), 'the fourth row of a rigid motion is [0, 0, 0, 1]')
        return None
    R = matrix[:3, :3]
    # A rotation has no entry above 1; capped, so that the product below cannot overflow.
    capped = np.clip(R, -1e3, 1e3)
    error = float(np.abs(capped.T @ capped - np.eye(3)).max())
    if error > PRINTED:
        report.fault(
            path,
            f'not a rotation: its columns are not orthogonal unit vectors, by {number(error)} '
            f'(at most {PRINTED:g}); exact expressions such as sqrt(2)/2 are accepted',
        )
        return None
    if np.linalg.det(R) < 0.0:
        report.fault(path, 'the determinant is -1: a mirror image, not a rotation')
        return None
    if error <= ROUND_OFF:
        return matrix
    report.remark(
        path, f'is {number(error)} from a rotation matrix: the nearest rotation is used instead'
    )
    # The nearest rotation in the Frobenius norm: the orthogonal factor of the polar decomposition.
    U, _, Vt = np.linalg.svd(R)
    result: npt.NDArray[np.float64] = matrix.copy()
    result[:3, :3] = U @ Vt
    return result
