"""The meaning of the columns of a pose in a table: the kind of its orientation, and the units."""

from typing import NamedTuple

from ...errors import RecordingError
from ...rigid_motion import EULER_ORDERS

# Three angles of an orientation; rpy is xyz.
EULER = ('rpy', *EULER_ORDERS)
KINDS = ('xyzw', 'wxyz', 'rotvec', 'rpy', 'matrix', 'position', *EULER_ORDERS)
LENGTHS = ('m', 'mm')
ANGLES = ('rad', 'deg')
XYZ = ('x', 'y', 'z')


def _numbers(count: int) -> tuple[str, ...]:
    return tuple(map(str, range(count)))


# Endings of column names with their default kind of orientation, in the order of the search: the
# numbers of a matrix begin like those of a quaternion.
ENDS = (
    ((*XYZ, 'qx', 'qy', 'qz', 'qw'), 'xyzw'),
    ((*XYZ, 'rx', 'ry', 'rz'), 'rotvec'),
    ((*XYZ, 'roll', 'pitch', 'yaw'), 'rpy'),
    (_numbers(16), 'matrix'),
    (_numbers(12), 'matrix'),
    (_numbers(7), 'xyzw'),
    (_numbers(7), 'wxyz'),
    (_numbers(6), 'rotvec'),
    (_numbers(6), 'rpy'),
    ((*XYZ, 'rx', 'ry', 'rz'), 'rpy'),
    # Positions alone are taken where they are asked for.
    (XYZ, 'position'),
    (_numbers(3), 'position'),
)
ACCEPTED_POSES = (
    'accepted are x y z with qx qy qz qw, with rx ry rz (rotation vector) or with roll pitch yaw; '
    'or numbers from 0 on: 7 (x y z and a quaternion x y z w), 6 (x y z and a rotation vector), '
    '12 or 16 (a matrix); --pose-format says kind and units, for instance mm,deg,rpy or deg,ZYX'
)


class PoseFormat(NamedTuple):
    """
    The meaning of the numbers of a pose.

    Attributes
    ----------
    kind
        One of `KINDS`, empty if the names of the columns tell it: a quaternion by the order of
        its numbers, a rotation vector, roll pitch yaw (R = Rz(yaw) Ry(pitch) Rx(roll)), three
        angles in another of the 24 orders, by their axes (small letters: that stand still;
        capitals: that move along), a matrix (rows of four), or none: a position alone.
    length, angle
        m or mm; rad or deg.
    """

    kind: str = ''
    length: str = 'm'
    angle: str = 'rad'


def pose_format(text: str) -> PoseFormat:
    """
    Return the format of words like `mm,deg,rpy`.

    Raises
    ------
    RecordingError
        A word is unknown, or there are two of one kind.
    """
    fields = {'kind': KINDS, 'length': LENGTHS, 'angle': ANGLES}
    found: dict[str, str] = {}
    for word in (part.strip() for part in text.split(',')):
        field = next((name for name, words in fields.items() if word in words), None)
        if field is None:
            named = (*(one for one in KINDS if one not in EULER_ORDERS), *LENGTHS, *ANGLES)
            raise RecordingError(
                f'{word!r} is not one of {", ".join(named)}, nor three angles by their axes such '
                'as xyz (axes that stand still) or ZYX (axes that move along)'
            )
        if found.get(field, word) != word:
            raise RecordingError(f'{found[field]} and {word} exclude each other')
        found[field] = word
    return PoseFormat(**found)


def pose_columns(
    header: list[str], prefix: str, wanted: PoseFormat
) -> tuple[list[str], PoseFormat] | None:
    """
    Return the columns of a pose that begin with `prefix`, and their format; None if there are
    none.
    """
    wanted_kind = 'rpy' if wanted.kind in EULER else wanted.kind
    for ends, kind in ENDS:
        columns = [prefix + end for end in ends]
        asked = wanted_kind in ('', kind) and (kind != 'position' or wanted.kind == kind)
        if asked and all(column in header for column in columns):
            return columns, wanted._replace(kind=wanted.kind or kind)
    return None
