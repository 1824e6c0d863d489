"""
What is known of an arm at every message of a recording, in columns.

"""

from dataclasses import dataclass
from typing import NamedTuple

from ..kernel import Floats
from ..notice import Notice
from ..singularities import Singularity
from ..tool_state import ToolState
from .block import Flags, Times
from .ingest import Known
from .judging import Levels

MEASURE_NAMES = (
    'determinant',
    'manipulability',
    'condition_number',
    'smallest_singular_value',
    'distance',
)


class Said(NamedTuple):
    """
    A warning as the node would have published it; `row` is the state it belongs to or precedes.

    """

    row: int
    moment: int
    notice: Notice


@dataclass(frozen=True, eq=False)
class Timeline:
    """
    Every state of a recording; N of them.

    Attributes
    ----------
    messages : shape (N,)
        Number of the message that made it, from 0.
    stamps, arrivals : shape (N,), ns
        Of the state; of the receipt.
    t : shape (N,), s
        Time since the first state by the stamps; a step back takes no time.
    q, qdot : shape (N, n), rad or m, rad/s or m/s
        Rows of `qdot` are NaN where unknown.
    differenced : shape (N,)
        Whether the velocities are differences of positions.
    position : shape (N, 3), m; quaternion_xyzw : shape (N, 4); twist : shape (N, 6)
        Of the tool in the base frame; the twist is NaN where unknown.
    measures : by name, shape (N,)
        As in `Singularity`; `determinant` is missing where J_t is not square.
    time_to_warning : shape (N,), s
        NaN where unknown.
    factors : shape (N, F), rad
        Distance to the zero of each named factor; F is 0 where the file lists none.
    levels : shape (N,)
        OK, WARN or ERROR, with hysteresis.
    silent : shape (N,)
        Whether the state was stale just before.
    said
        What the node would have said.

    """

    messages: Times
    stamps: Times
    arrivals: Times
    t: Floats
    q: Floats
    qdot: Floats
    differenced: Flags
    position: Floats
    quaternion_xyzw: Floats
    twist: Floats
    measures: dict[str, Floats]
    time_to_warning: Floats
    factors: Floats
    levels: Levels
    silent: Flags
    said: tuple[Said, ...]

    def __len__(self) -> int:
        return len(self.stamps)


class Part(NamedTuple):
    """
    A batch of states with everything the node would publish of them.

    `first` is the number of its first state, and `said` what is said at its states.

    """

    first: int
    known: Known
    state: ToolState
    quaternion_xyzw: Floats
    singularity: Singularity
    said: list[Said]
