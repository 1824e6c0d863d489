# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read bags of ROS 2 (MCAP, sqlite3) and ROS 1, without ROS, by the optional package rosbags."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import groupby, islice
from pathlib import Path
from traceback import walk_tb
from typing import Any

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from ....errors import KinematicsError, RecordingError
from ....estimation.joint_state_columns import columns_of
from ....robot.measures import Level
from ....typography import listed
from . import unpacking
from .bag_checks import checked
from .bag_poses import POSES, TRANSFORM, TRANSFORMS, track_of_messages
from .between_points import PlannedTrajectory
from .block import LARGEST_BLOCK, LARGEST_BYTES, SECOND, Block, UnreadableMessage, joined
from .plan_reader import blocks_of_trajectories, trajectory_of_message
from .source import PoseTrack, RecordingSource, Remark, Selection

JOINT_STATE = 'sensor_msgs/msg/JointState'
TRAJECTORY = 'trajectory_msgs/msg/JointTrajectory'
MAX_LISTED = 20
MAGIC = {
    '.mcap': (b'\x89MCAP0\r\n', 'an MCAP file'),
    '.db3': (b'SQLite format 3', 'an sqlite3 bag'),
    '.bag': (b'#ROSBAG V2', 'a ROS 1 bag'),
}


@contextmanager
def open_bag(path: Path, selection: Selection) -> Iterator[RecordingSource]:
    """
    Open a bag as a recording or a plan.

    Raises
    ------
    RecordingError
        The bag cannot be read, or lacks the topic.
    """
    with unpacking.bounded_chunks(path):
        with _one_sentence(path):
            _check(path)
            if path.is_dir():
                unpacking.refuse_to_grow(path)
            # Use the message definitions of Jazzy as default, because bags older than ROS 2 Iron
            # contain no definitions.
            reader = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY))
            reader.open()
        try:
            with _one_sentence(path):
                yield _Bag(path, reader, selection).source()
        finally:
            reader.close()


@contextmanager
def _one_sentence(path: Path) -> Iterator[None]:
    # Turns any exception of rosbags into a RecordingError, because rosbags can raise any exception
    # for a damaged file.
    try:
        yield
    except KinematicsError:
        raise
    except Exception as error:
        # If this package raised the error, and not rosbags or its dependencies, raise the error
        # unchanged: the cause is a fault of this package, not a damaged file.
        *_, (frame, _) = walk_tb(error.__traceback__)
        if frame.f_globals.get('__name__', '').startswith(__package__.partition('.')[0]):
            raise
        reason = ' '.join(str(error).split()) or type(error).__name__
        message = f'{path}: cannot be read as a bag: {reason}{_advice(path)}'
        raise RecordingError(message, code='unreadable') from None


def _advice(path: Path) -> str:
    if path.suffix == '.mcap':
        with path.open('rb') as stream:
            stream.seek(-8, 2)
            if stream.read() != MAGIC['.mcap'][0]:
                return '; the file is cut off: `mcap recover` may repair it'
    return ''


def _check(path: Path) -> None:
    if path.is_dir():
        if not (path / 'metadata.yaml').exists():
            raise RecordingError(
                f'{path}: the folder is not a rosbag2 bag (metadata.yaml is missing) and not a '
                'dataset (meta/info.json and .parquet, .hdf5 and .npz files are missing); give '
                'the folder that has them',
                code='wrong-kind',
            )
        return
    with path.open('rb') as stream:
        head = stream.read(16)
    if not head:
        raise RecordingError(f'{path}: the file is empty; record the bag anew', code='empty')
    magic, kind = MAGIC.get(path.suffix.lower(), (b'', ''))
    if not head.startswith(magic):
        message = f'{path}: is not {kind}; rename it to the suffix of its own type'
        raise RecordingError(message, code='wrong-kind')
    for suffix, (start, kind) in MAGIC.items():
        if head.startswith(start) and path.suffix.lower() != suffix:
            message = f'{path}: looks like {kind}; rename it to *{suffix}'
            raise RecordingError(message, code='wrong-kind')


def _types_of(fields: Any) -> Iterator[str]:
    # Yields the type names of a message's fields. If a field is an array, yields the type of its
    # elements.
    for _, (node, value) in fields:
        while node.name in ('ARRAY', 'SEQUENCE'):
            node, value = value[0]
        if node.name == 'NAME':
            yield value


class _Bag:
    def __init__(self, path: Path, reader: Any, selection: Selection) -> None:
        self.path, self.reader, self.selection = path, reader, selection
        self.packed = unpacking.leave_messages_packed(reader.readers[0])
        self.types: dict[str, str] = {c.topic: c.msgtype for c in reader.connections}
        self.remarks: list[Remark] = []
        self.plans: list[PlannedTrajectory] = []
        self.read = 0

    def source(self) -> RecordingSource:
        topic, kind = self._topic()
        self._refuse_other_fields(topic, kind)
        connections = self._connections(topic)
        total: int | None = sum(connection.msgcount for connection in connections)
        if not total:
            raise self._without_messages(topic)
        poses = self._poses()
        filetype = {'.bag': 'ROS 1 bag', '.mcap': 'MCAP file'}.get(self.path.suffix, 'rosbag2 bag')
        planned = kind == TRAJECTORY
        if planned:

            def read() -> Iterator[PlannedTrajectory]:
                for message, _ in self._messages(connections):
                    self.plans.append(trajectory_of_message(message))
                    yield self.plans[-1]

            blocks: Iterator[Block | UnreadableMessage] = blocks_of_trajectories(
                read(), self.selection, f'{self.path}: {topic}', self.remarks
            )
            filetype, total = f'planned trajectory in a {filetype}', None
        else:
            blocks = self._blocks(connections)
        guarded = self._guarded(blocks, connections)
        others = lambda: poses, self.remarks, self.plans, self._pose_topics()
        return RecordingSource(filetype, topic, planned, total, guarded, *others)

    def _guarded(
        self, blocks: Iterator[Block | UnreadableMessage], connections: list[Any]
    ) -> Iterator[Block | UnreadableMessage]:
        with _one_sentence(self.path):
            yield from blocks
            self.remarks += checked(self.path)
            if (promised := self._promised(connections)) != self.read:
                counts = f'{self.path.name} counts {promised:,} messages on {connections[0].topic}'
                text = f'{counts}, but holds {self.read:,}'
                self.remarks.append(Remark(Level.WARN, text, 'wrong-length'))

    def _promised(self, connections: list[Any]) -> int:
        if self.reader.is2:
            return sum(connection.msgcount for connection in connections)
        ids = {connection.id for connection in connections}
        chunks = (chunk for reader in self.reader.readers for chunk in reader.chunk_infos)
        return sum(
            n for chunk in chunks for id_, n in chunk.connection_counts.items() if id_ in ids
        )

    def _topic(self) -> tuple[str, str]:
        topic, kinds = self.selection.topic, (JOINT_STATE, TRAJECTORY)
        if topic is not None:
            kind = self.types.get(topic) or self.types.get(f'/{topic}')
            if kind in kinds:
                return (topic if topic in self.types else f'/{topic}'), kind
            known = f'is {kind}' if kind else 'does not exist'
            message = f'{self.path}: topic {topic} {known}; {self._listed()}'
            raise RecordingError(message, code='wrong-type' if kind else 'unknown-name')
        for kind in kinds:
            topics = [topic for topic, type_ in self.types.items() if type_ == kind]
            if len(topics) > 1:
                name = kind.rpartition('/')[2]
                raise RecordingError(
                    f'{self.path}: several topics have {name}; choose one with --topic '
                    f'({", ".join(sorted(topics))})',
                    code='ambiguous',
                )
            if topics:
                return topics[0], kind
        raise RecordingError(f'{self.path}: {self._listed()}', code='missing-topic')

    def _refuse_other_fields(self, topic: str, kind: str) -> None:
        # Raise an error if the bag defines a message type with the name of a ROS type but other
        # fields. Messages are read by the ROS definition, and would give wrong numbers.
        usual = dict(get_typestore(Stores.ROS2_JAZZY).fielddefs)
        if not self.reader.is2:
            usual |= get_typestore(Stores.ROS1_NOETIC).fielddefs
        defined, names = self.reader.typestore.fielddefs, [kind]
        for name in names:
            fields = usual[name][1]
            if name in defined and defined[name][1] != fields:
                listed = ', '.join(field for field, _ in defined[name][1]) or 'nothing'
                raise RecordingError(
                    f'{self.path}: {topic}: the bag defines {name} otherwise than ROS, with the '
                    f'fields {listed[:200]}; record it with the type of ROS',
                    code='mismatch',
                )
            names += [part for part in _types_of(fields) if part not in names]

    def _without_messages(self, topic: str) -> RecordingError:
        message = f'{self.path}: {topic} has no messages; record it anew'
        return RecordingError(message, code='empty')

    def _listed(self) -> str:
        known = sorted(self.types.items())
        if topics := [topic for topic, kind in known if kind in (JOINT_STATE, TRAJECTORY)]:
            return f'JointState or JointTrajectory are on {", ".join(topics)}'
        shown = [f'{topic} ({kind})' for topic, kind in known]
        there_is = f'there is {listed(shown, MAX_LISTED)}' if shown else 'the bag is empty'
        return f'no topic has JointState or JointTrajectory; {there_is}'

    def _connections(self, topic: str) -> list[Any]:
        return [c for c in self.reader.connections if c.topic == topic]

    def _messages(self, connections: list[Any]) -> Iterator[tuple[Any, int]]:
        for time, raw in self._raw(connections):
            yield self.reader.deserialize(raw, connections[0].msgtype), time

    def _raw(self, connections: list[Any]) -> Iterator[tuple[int, bytes]]:
        unpacking.refuse_to_hold(self.path, self.reader.readers[0], connections[0].topic)
        self.read = 0
        for _, time, raw in self.reader.messages(connections):
            self.read += 1
            yield time, unpacking.unpacked(raw, self.path) if self.packed else raw

    def _blocks(self, connections: list[Any]) -> Iterator[Block | UnreadableMessage]:
        for length, alike in groupby(self._raw(connections), lambda message: len(message[1])):
            limit = max(1, min(LARGEST_BLOCK, LARGEST_BYTES // max(length, 1)))
            while some := list(islice(alike, limit)):
                yield from self._alike(some)
                some.clear()  # free the memory before the next messages are read

    def _alike(self, messages: Sequence[tuple[int, bytes]]) -> Iterator[Block | UnreadableMessage]:
        # Yields blocks of joint states from messages of equal length in bytes. Messages that
        # differ from the first message only in numbers and stamps are read as arrays; other
        # messages are decoded one by one.
        times, raws = zip(*messages)
        columns = columns_of(raws, not self.reader.is2) if len(raws) > 1 else None
        if columns is None:
            yield from joined(self._block(raw, time) for time, raw in messages)
            return
        received = np.array(times, dtype=np.int64)
        edges = np.flatnonzero(np.diff(columns.alike)) + 1
        for begin, end in zip([0, *edges.tolist()], [*edges.tolist(), len(raws)]):
            span = slice(begin, end)
            if not columns.alike[begin]:
                yield from joined(self._block(raw, time) for time, raw in messages[span])
                continue
            yield Block(
                columns.names,
                columns.stamps[span],
                received[span],
                columns.positions[span],
                columns.velocities[span],
            )

    def _block(self, raw: bytes, time: int) -> Block | UnreadableMessage:
        try:
            message: Any = self.reader.deserialize(raw, JOINT_STATE)
        except Exception as error:  # damaged bytes can make the reader raise any exception
            return UnreadableMessage(time, ' '.join(str(error).split()) or type(error).__name__)
        stamp = int(message.header.stamp.sec) * SECOND + int(message.header.stamp.nanosec)
        stamps, received = (np.array([when], dtype=np.int64) for when in (stamp, time))
        positions, velocities = message.position[None], message.velocity[None]
        return Block(tuple(message.name), stamps, received, positions, velocities)

    def _poses(self) -> PoseTrack | None:
        topic = self.selection.pose_topic
        if topic is None:
            return None
        topic, _, child = topic.partition(':')
        kind = self.types.get(topic)
        if kind not in (*POSES, TRANSFORMS) or (child and kind != TRANSFORMS):
            known = f'is {kind}' if kind else 'does not exist'
            raise RecordingError(
                f'{self.path}: pose topic {self.selection.pose_topic} {known}; poses are on '
                f'{self._pose_topics() or "no topic"}',
                code='wrong-type' if kind else 'unknown-name',
            )
        self._refuse_other_fields(topic, kind)
        connections = self._connections(topic)
        pose_kind = kind
        if kind == TRANSFORMS:
            child, pose_kind = self._child(topic, child, connections), TRANSFORM

        def read(raw: bytes) -> list[Any]:
            message: Any = self.reader.deserialize(raw, kind)
            if kind != TRANSFORMS:
                return [message]
            return [pose for pose in message.transforms if pose.child_frame_id == child]

        track = track_of_messages(topic, pose_kind, self._raw(connections), read)
        if track is None:
            raise self._without_messages(topic)
        return track

    def _pose_topics(self) -> str:
        usable = (*POSES, TRANSFORMS)
        return ', '.join(sorted(name for name, kind in self.types.items() if kind in usable))

    def _child(self, topic: str, frame: str, connections: list[Any]) -> str:
        # Returns the name of the child frame whose transforms on a /tf topic are the tool poses:
        # the requested frame, or the only child frame of the topic.
        parents: dict[str, set[str]] = {}
        for message, _ in self._messages(connections):
            for transform in message.transforms:
                parents.setdefault(transform.child_frame_id, set()).add(transform.header.frame_id)
        chosen = frame or (next(iter(parents)) if len(parents) == 1 else '')
        if len(parents.get(chosen, ())) == 1:
            return chosen
        shown = [
            f'{name} in {" and ".join(sorted(frames))}' for name, frames in sorted(parents.items())
        ]
        raise RecordingError(
            f'{self.path}: {topic} has the transforms of {listed(shown, MAX_LISTED)}; choose one '
            f'that was measured apart from the joints: --pose-topic {topic}:FRAME',
            code='unknown-name' if frame and frame not in parents else 'ambiguous',
        )
