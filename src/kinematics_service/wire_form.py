"""
The form of a stream of serialized joint states: where in the bytes its numbers stand.

"""

from dataclasses import dataclass

import numpy as np

from . import kernel
from .kernel import Bytes, Integers


@dataclass(frozen=True, eq=False)
class WireForm:
    """
    Serialized messages that differ in nothing but their numbers and in bytes nobody reads.

    Attributes
    ----------
    names
        Joint names.
    size
        Bytes of a message.
    stamp, positions, velocities
        Where they begin: int32 seconds and uint32 nanoseconds, then doubles, as in this machine's
        memory.
    velocity_count
        Number of velocities; there are as many positions as names.
    pattern : shape (2 size,)
        Bytes that select what must not change, then what stands there.

    """

    names: tuple[str, ...]
    size: int
    stamp: int
    positions: int
    velocities: int
    velocity_count: int
    pattern: Bytes

    def packed(self, layout: Integers) -> Integers:
        """
        Return the form and a layout (joint_table.py) as `kernel.observe_bytes` takes them.

        """
        header = np.zeros(kernel.FORM_HEADER, dtype=np.int64)
        header[kernel.FORM_STAMP] = self.stamp
        header[kernel.FORM_POSITIONS] = self.positions
        header[kernel.FORM_VELOCITIES] = self.velocities
        header[kernel.FORM_COUNT] = len(self.names)
        header[kernel.FORM_VELOCITY_COUNT] = self.velocity_count
        header[kernel.FORM_BYTES] = self.size
        header[kernel.FORM_PATTERN] = header.size + layout.size
        pattern = np.zeros(-(-self.pattern.size // 8), dtype=np.int64)
        pattern.view(np.uint8)[: self.pattern.size] = self.pattern
        return np.concatenate([header, layout, pattern])
