"""Joint states of a recording in columns: messages in a row that look alike."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby, islice
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ....estimation.joint_sample import JointSample
from ....kernel import Floats

Times: TypeAlias = npt.NDArray[np.int64]
Flags: TypeAlias = npt.NDArray[np.bool_]

# In ns.
SECOND = 1_000_000_000
# Most messages of a block, and most bytes of serialized ones: the memory of one stays within some
# tens of MB, unless a single message has more.
LARGEST_BLOCK, LARGEST_BYTES = 16_384, 2**26


@dataclass(frozen=True, eq=False)
class Block:
    """
    Consecutive JointState messages with the same names and as many numbers.

    Attributes
    ----------
    names
        Joint names, as in the messages.
    stamps, received : shape (N,), ns
        Stamps of the header, 0 if there is none; and times of the recording.
    positions, velocities : shape (N, k), rad or m, rad/s or m/s
        As in the messages; k is mostly the number of names, and 0 if a message has none.
    """

    names: tuple[str, ...]
    stamps: Times
    received: Times
    positions: Floats
    velocities: Floats

    def __len__(self) -> int:
        return len(self.stamps)

    def sample(self, k: int) -> JointSample:
        """
        Return message k as the estimator takes it; the steady clock is that of the recording.
        """
        received = int(self.received[k])
        return JointSample(
            self.names,
            self.positions[k].tolist(),
            self.velocities[k].tolist(),
            int(self.stamps[k]),
            received,
            received,
        )


@dataclass(frozen=True)
class UnreadableMessage:
    """A message among the blocks that is no JointState, with the reason in words."""

    received: int
    reason: str

    def __len__(self) -> int:
        return 1


def blocks_of(samples: Iterable[JointSample]) -> Iterator[Block]:
    """Yield samples in blocks, in their order."""

    def kind(sample: JointSample) -> tuple[tuple[str, ...], int, int]:
        return tuple(sample.names), len(sample.positions), len(sample.velocities)

    for _, alike in groupby(samples, kind):
        while some := list(islice(alike, LARGEST_BLOCK)):
            yield _block(some)


def _block(samples: list[JointSample]) -> Block:
    def table(rows: list[object]) -> Floats:
        return np.array(rows, dtype=np.float64).reshape(len(rows), -1)

    return Block(
        tuple(samples[0].names),
        np.array([sample.stamp for sample in samples], dtype=np.int64),
        np.array([sample.received for sample in samples], dtype=np.int64),
        table([sample.positions for sample in samples]),
        table([sample.velocities for sample in samples]),
    )
