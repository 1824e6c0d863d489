# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write an MCAP file, without ROS, with the messages that a node would have published on a
recording's joint states.

The messages of a topic differ only in stamps and numbers. So one message is serialized as a
template, and copies of its bytes are filled with stamps and numbers.
"""

from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .....errors import RecordingError
from .....estimation.cdr import DOUBLE, STAMP_AT, WHOLE, CdrWriter
from .....estimation.status_text import StatusText
from .....kernel import Floats
from .....output_file import new_file
from .....robot.measures import MEASURES
from .....robot.robot import Robot
from ...readers.bag_checks import add_checksums
from ...readers.block import Times
from ..timeline import PublishedWarning, TimelineBatch

if TYPE_CHECKING:
    from rosbags.rosbag2 import Writer

NODE = '/kinematics'
WARNING = f'{NODE}/singularity/warning'
SECOND = 1_000_000_000
ROWS = 'vx,vy,vz,wx,wy,wz'


class _BagTopic(NamedTuple):
    connection: Any
    raw: bytes
    numbers_at: int
    stamped: bool
    of_motion: bool

    def filled(self, numbers: Floats, stamps: Times) -> np.ndarray:  # type: ignore[type-arg]
        """
        Return N serialized messages of the topic, shape (N, bytes): copies of the template `raw`.
        Copy i gets the k numbers of row i of `numbers` (N, k), and stamp i of `stamps` (N,), ns.
        """
        table = np.tile(np.frombuffer(self.raw, dtype=np.uint8), (len(numbers), 1))
        data = np.ascontiguousarray(numbers, dtype='<f8').view(np.uint8)
        table[:, self.numbers_at : self.numbers_at + data.shape[1]] = data
        if self.stamped:
            seconds, nanoseconds = np.divmod(stamps, SECOND)
            table[:, STAMP_AT : STAMP_AT + 4] = _bytes(seconds, '<i4')
            table[:, STAMP_AT + 4 : STAMP_AT + 8] = _bytes(nanoseconds, '<u4')
        return table


def _bytes(values: Times, kind: str) -> np.ndarray:  # type: ignore[type-arg]
    return values.astype(kind).reshape(-1, 1).view(np.uint8)


@contextmanager
def open_writer(file: Path, robot: Robot, joint_prefix: str) -> Iterator['BagWriter']:
    """
    Open a new MCAP file for messages. If an error occurs, no file remains.

    Raises
    ------
    RecordingError
        rosbags is missing.
    KinematicsError
        The file cannot be written.
    """
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
    except ImportError:
        raise RecordingError(
            "--out needs rosbags: pip install '.[bag]' in its checkout, or pip install rosbags",
            code='missing-package',
        ) from None
    with new_file(file) as made:
        bag = made.parent / 'bag'
        with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            yield BagWriter(writer, robot, joint_prefix)
        (bag / 'bag.mcap').rename(made)
        add_checksums(made)


class BagWriter:
    """
    Writes the messages that the node would publish for batches of states, in the node's order.
    """

    def __init__(self, writer: 'Writer', robot: Robot, joint_prefix: str) -> None:
        from rosbags.typesys import Stores, get_typestore

        self._writer, self._robot = writer, robot
        self._store = get_typestore(Stores.ROS2_JAZZY)
        self._types: Any = self._store.types
        names = ','.join(joint_prefix + name for name in robot.joint_names)
        base, tool = robot.base_frame, robot.tool_frame
        self._measures = [
            measure.name
            for measure in reversed(MEASURES.values())
            if robot.singularity.task.square or not measure.of_square
        ]
        self._topics = [
            self._add('pose', 'geometry_msgs/msg/PoseStamped', 7, base),
            self._add_jacobian(names),
            self._add('twist', 'geometry_msgs/msg/TwistStamped', 6, base),
            self._add('velocity', 'geometry_msgs/msg/VelocityStamped', 6, base, tool, base),
            *(self._add(f'singularity/{x}', 'std_msgs/msg/Float64', 1) for x in self._measures),
        ]
        self._warning = self._connection(WARNING, 'diagnostic_msgs/msg/DiagnosticStatus', True)

    def write(self, part: TimelineBatch) -> None:
        """Write all messages of a batch, each at the time of receipt of its joint state."""
        known, state = part.known, part.state
        poses = np.concatenate([state.position, part.quaternion_xyzw], axis=1)
        J = state.jacobian.reshape(len(known), 6 * self._robot.dof)
        measures = (getattr(part.singularity, name)[:, None] for name in self._measures)
        numbers = [poses, J, state.twist, state.twist, *measures]
        columns = []
        for topic, values in zip(self._topics, numbers):
            data = memoryview(topic.filled(values, known.stamps).tobytes())
            columns.append((topic, data, len(topic.raw)))
        warnings = defaultdict[int, list[PublishedWarning]](list)
        for warning in part.warnings:
            warnings[warning.row - part.first].append(warning)
        for k, (arrival, moves) in enumerate(zip(known.arrivals.tolist(), known.moving.tolist())):
            pending = warnings[k]
            while pending and pending[0].moment < arrival:
                # write the warning about a time-out that came before this joint state
                self._warn(*pending.pop(0)[1:])
            for topic, data, size in columns:
                if moves or not topic.of_motion:
                    message = data[k * size : (k + 1) * size]
                    self._writer.write(topic.connection, arrival, message)
            for warning in pending:
                self._warn(*warning[1:])

    def _warn(self, moment: int, status_text: StatusText) -> None:
        pair = self._types['diagnostic_msgs/msg/KeyValue']
        message = self._types['diagnostic_msgs/msg/DiagnosticStatus'](
            level=int(status_text.level),
            name=f'{NODE[1:]}: singularity',
            message=status_text.sentence,
            hardware_id=dict(status_text.values).get('robot', ''),
            values=[pair(key=key, value=value) for key, value in status_text.values],
        )
        raw = self._store.serialize_cdr(message, 'diagnostic_msgs/msg/DiagnosticStatus')
        self._writer.write(self._warning, moment, bytes(raw))

    def _connection(self, topic: str, kind: str, latched: bool = False) -> Any:
        return self._writer.add_connection(
            topic, kind, typestore=self._store, offered_qos_profiles=[_quality(latched)]
        )

    def _add(self, name: str, kind: str, numbers: int, *texts: str) -> _BagTopic:
        # Adds a topic whose messages end with `numbers` float64 numbers. If `texts` (such as frame
        # names) are given, a stamp and the texts come before the numbers.
        writer = CdrWriter()
        if texts:
            writer.room(WHOLE, 2)
        for text in texts:
            writer.text(text)
        return self._filling(name, kind, writer, numbers, bool(texts))

    def _add_jacobian(self, names: str) -> _BagTopic:
        n = self._robot.dof
        dimensions = (ROWS, 6, 6 * n), (names, n, n)
        writer = CdrWriter()
        writer.whole(len(dimensions))
        for label, size, stride in dimensions:
            writer.text(label)
            writer.whole(size)
            writer.whole(stride)
        writer.whole(0)  # field data_offset of the array layout
        writer.whole(6 * n)
        return self._filling('jacobian', 'std_msgs/msg/Float64MultiArray', writer, 6 * n, False)

    def _filling(
        self, name: str, kind: str, writer: CdrWriter, numbers: int, stamped: bool
    ) -> _BagTopic:
        at = writer.room(DOUBLE, numbers)
        connection = self._connection(f'{NODE}/{name}', kind)
        of_motion = name in ('twist', 'velocity')
        return _BagTopic(connection, bytes(writer.data), at, stamped, of_motion)


def _quality(latched: bool) -> Any:
    # Returns the quality of service that the node offers; players of bags read it from the file.
    from rosbags import interfaces as given

    durability = given.QosDurability
    forever = given.QosTime(9_223_372_036, 854_775_807)
    return given.Qos(
        given.QosHistory.KEEP_LAST,
        1 if latched else 100,
        given.QosReliability.RELIABLE,
        durability.TRANSIENT_LOCAL if latched else durability.VOLATILE,
        forever,
        forever,
        given.QosLiveliness.AUTOMATIC,
        forever,
        avoid_ros_namespace_conventions=False,
    )
