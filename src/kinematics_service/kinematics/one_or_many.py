"""Type variables of results that hold numbers for one pose and arrays for a batch."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # A result type without brackets is for one pose. That needs type variables with defaults,
    # which `typing` has from Python 3.13 on.
    from typing_extensions import TypeVar

    from ..kernel import Floats
    from ..robot.measures import Level

    Number = TypeVar('Number', default=float)
    Index = TypeVar('Index', default=int)
    Grade = TypeVar('Grade', default=Level)
    Text = TypeVar('Text', default=str)
    Pose = TypeVar('Pose', default=Floats | None)  # None: no such pose
else:
    from typing import TypeVar

    Number, Index, Grade = TypeVar('Number'), TypeVar('Index'), TypeVar('Grade')
    Text, Pose = TypeVar('Text'), TypeVar('Pose')
