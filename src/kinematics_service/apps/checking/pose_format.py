# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the columns of a pose in a table, the kind of its orientation, and its units."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ...errors import RecordingError
from .euler_orders import EULER_ORDERS

# Kinds of orientations that are three angles; rpy is the same as xyz.
EULER = ('rpy', *EULER_ORDERS)
KINDS = ('xyzw', 'wxyz', 'rotvec', 'rpy', 'matrix', 'position', *EULER_ORDERS)
LENGTHS = ('m', 'mm', 'cm')
ANGLES = ('rad', 'deg')
XYZ = ('x', 'y', 'z')


def _numbers(count: int) -> tuple[str, ...]:
    return tuple(map(str, range(count)))


# Each entry has the endings of a pose's column names, in small letters, and the default kind of
# orientation. The search takes the first entry whose endings all occur in the table. If the names
# end in the numbers 0 to 15 of a matrix, then the endings 0 to 6 of a shorter entry occur, too. So
# entries with more numbers come first.
ENDS = (
    ((*XYZ, 'qx', 'qy', 'qz', 'qw'), 'xyzw'),
    ((*XYZ, 'rx', 'ry', 'rz'), 'rotvec'),
    ((*XYZ, 'roll', 'pitch', 'yaw'), 'rpy'),
    ((*XYZ, 'a', 'b', 'c'), 'ZYX'),
    ((*XYZ, 'w', 'p', 'r'), 'rpy'),
    ((*XYZ, 'o', 'a', 't'), 'ZYZ'),
    ((*XYZ, 'q1', 'q2', 'q3', 'q4'), 'wxyz'),
    (_numbers(16), 'matrix'),
    (_numbers(12), 'matrix'),
    (_numbers(7), 'xyzw'),
    (_numbers(7), 'wxyz'),
    (_numbers(6), 'rotvec'),
    (_numbers(6), 'rpy'),
    ((*XYZ, 'rx', 'ry', 'rz'), 'rpy'),
    # Columns of positions are taken only if the format is `position`.
    (XYZ, 'position'),
    (_numbers(3), 'position'),
)
# Endings of the column names of the position and of the orientation. They apply if the user gives
# two beginnings of names, as in `pose=pos_+quat_`.
PLACES = (XYZ, _numbers(3))
TURNS = (
    *((ends[3:], kind) for ends, kind in ENDS if ends[:3] == XYZ and ends[3:]),
    ((*XYZ, 'w'), 'xyzw'),
    ((*XYZ, 'w'), 'wxyz'),
    (_numbers(4), 'xyzw'),
    (_numbers(4), 'wxyz'),
    (_numbers(3), 'rotvec'),
    (_numbers(3), 'rpy'),
    (XYZ, 'rotvec'),
    (XYZ, 'rpy'),
)
ACCEPTED_POSES = (
    'accepted are x y z with qx qy qz qw, with rx ry rz (rotation vector) or with roll pitch yaw; '
    'or numbers from 0 on: 7 (x y z and a quaternion x y z w), 6 (x y z and a rotation vector), '
    '12 or 16 (a matrix); positions and orientations that begin otherwise are pose=pos_+quat_; '
    '--pose-format says kind and units, for instance mm,deg,rpy or deg,ZYX'
)


class PoseFormat(NamedTuple):
    """
    The meaning of the numbers of a pose.

    Attributes
    ----------
    kind
        One of `KINDS`; empty if the column names decide. `xyzw`, `wxyz`: a quaternion with this
        order of numbers. `rotvec`: a rotation vector. `rpy`: R = Rz(yaw) Ry(pitch) Rx(roll). Three
        letters: angles about three axes in turn. Small letters mean the fixed axes, capitals the
        axes that turn with the body. `matrix`: rows of four numbers. `position`: no orientation.
    length, angle
        Units: m, mm or cm; rad or deg.
    """

    kind: str = ''
    length: str = 'm'
    angle: str = 'rad'

    def in_words(self) -> str:
        """Return the format as text for `--pose-format`."""
        return ','.join(word for word in (self.length, self.angle, self.kind) if word)


# Pose formats by the maker of a robot controller or of a laser tracker. The makers call the
# orientation A B C (KUKA), W P R (FANUC), O A T (Kawasaki), quaternion q1 q2 q3 q4 (ABB),
# rotation vector (Universal Robots), and Rx Ry Rz (Staubli, and Leica's trackers). For FARO the
# orientation of the probe is read as three Euler angles about z, x and z.
MAKERS = {
    'kuka': PoseFormat('ZYX', 'mm', 'deg'),
    'fanuc': PoseFormat('rpy', 'mm', 'deg'),
    'abb': PoseFormat('wxyz', 'mm', 'deg'),
    'staubli': PoseFormat('XYZ', 'mm', 'deg'),
    'kawasaki': PoseFormat('ZYZ', 'mm', 'deg'),
    'ur': PoseFormat('rotvec', 'm', 'rad'),
    'leica': PoseFormat('XYZ', 'mm', 'deg'),
    'faro': PoseFormat('ZXZ', 'mm', 'rad'),
}


def pose_format(text: str) -> PoseFormat:
    """
    Return the pose format that a text like `mm,deg,rpy`, or a maker's name, describes.

    Raises
    ------
    RecordingError
        A word is unknown, or two words of one kind exclude each other.
    """
    fields = {'kind': KINDS, 'length': LENGTHS, 'angle': ANGLES}
    values: dict[str, str] = {}
    words = [part.strip() for part in text.split(',')]
    makers = [word for word in words if word.lower() in MAKERS]
    if len(makers) > 1:
        raise RecordingError(
            f'{makers[0]} and {makers[1]} exclude each other; write one', code='conflict'
        )
    usual = MAKERS[makers[0].lower()] if makers else PoseFormat()
    for word in (part for part in words if part not in makers):
        field = next((name for name, words in fields.items() if word in words), None)
        if field is None:
            named = (*(kind for kind in KINDS if kind not in EULER_ORDERS), *LENGTHS, *ANGLES)
            raise RecordingError(
                f'{word!r} is not one of {", ".join(named)}, nor three angles by their axes such '
                'as xyz (axes that stand still) or ZYX (axes that move along), nor a maker '
                f'({", ".join(MAKERS)})',
                code='unknown-name',
            )
        if values.get(field, word) != word:
            raise RecordingError(
                f'{values[field]} and {word} exclude each other; write one', code='conflict'
            )
        values[field] = word
    return usual._replace(**values)


def pose_columns(
    header: list[str], beginnings: Sequence[str], given: PoseFormat
) -> tuple[list[str], PoseFormat] | None:
    """
    Find the columns of a pose in a header. Return the columns with their format; None if no
    columns were found.

    Parameters
    ----------
    beginnings
        One text with which all column names begin; or two texts: the beginning of the position's
        column names, and the beginning of the orientation's column names.
    given
        The format that the user asked for.
    """
    endings = [_ends_of(header, beginning) for beginning in beginnings]
    choices: Iterator[tuple[tuple[tuple[str, ...], ...], str]]
    if len(beginnings) == 1:
        choices = (((ends,), kind) for ends, kind in ENDS)
    else:
        choices = (((place, turn), kind) for place in PLACES for turn, kind in TURNS)
    for parts, kind in choices:
        if _is_allowed(kind, given) and all(
            end in names for ends, names in zip(parts, endings) for end in ends
        ):
            order = ('w', *XYZ) if kind == 'wxyz' and parts[-1] == (*XYZ, 'w') else parts[-1]
            columns = [
                names[end] for ends, names in zip((*parts[:-1], order), endings) for end in ends
            ]
            return columns, given._replace(kind=given.kind or kind)
    return None


def pose_of_columns(columns: list[str], given: PoseFormat) -> tuple[list[str], PoseFormat] | None:
    """
    Return `columns` with the pose format that fits the number of columns; None if none fits.

    `columns` must be in the order of a pose's numbers. `given` is the format that the user asked
    for. If `given.kind` is empty, the kind of orientation follows from the number of columns.
    """
    for ends, kind in ENDS:
        fits = ends == _numbers(len(columns))
        if fits and (given.kind == '' or _family(given.kind) == kind):
            return columns, given._replace(kind=given.kind or kind)
    return None


def _family(kind: str) -> str:
    return 'rpy' if kind in EULER else kind


def _is_allowed(kind: str, given: PoseFormat) -> bool:
    # Return whether columns with this kind of orientation may be taken as a pose. Columns of
    # positions are taken only if the user asked for `position`.
    if given.kind == '':
        return kind != 'position'
    return _family(given.kind) == _family(kind)


def _ends_of(header: list[str], beginning: str) -> dict[str, str]:
    # Return the column names that start with `beginning`. The keys are the endings of the names in
    # small letters, with and without a leading dot, space or underscore.
    names = {name[len(beginning) :]: name for name in header if name.startswith(beginning)}
    plain = {end.lstrip('. _').lower(): name for end, name in names.items()}
    return plain | {end.lower(): name for end, name in names.items()}
