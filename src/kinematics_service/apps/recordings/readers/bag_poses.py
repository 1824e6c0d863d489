# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read measured tool poses from a topic of a bag. If the topic has more than `MAX_POSES_HELD` poses,
keep an evenly spread part of the poses.
"""

from collections.abc import Callable, Iterable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from ...checking.pose_format import PoseFormat
from .block import SECOND
from .source import PoseTrack
from .tool_poses import PoseRows

# Paths of the fields for position and orientation in a message, by message type.
POSES = {
    'geometry_msgs/msg/PoseStamped': ('pose.position', 'pose.orientation'),
    'geometry_msgs/msg/PoseWithCovarianceStamped': ('pose.pose.position', 'pose.pose.orientation'),
    'geometry_msgs/msg/TransformStamped': ('transform.translation', 'transform.rotation'),
    'geometry_msgs/msg/PointStamped': ('point',),
}
TRANSFORM = 'geometry_msgs/msg/TransformStamped'
TRANSFORMS = 'tf2_msgs/msg/TFMessage'
# Largest number of poses in memory (20 MB). Whenever it is reached, every second pose is dropped.
# The comparison with computed poses needs only some hundred poses.
MAX_POSES_HELD = 2**16


def track_of_messages(
    topic: str,
    kind: str,
    messages: Iterable[tuple[int, bytes]],
    read: Callable[[bytes], Sequence[Any]],
) -> PoseTrack | None:
    """
    Return the tool poses in messages; None without messages. Each message is a pair: time of
    receipt (ns), and bytes.

    Parameters
    ----------
    kind
        The type of the messages, one of `POSES`.
    read
        A function that decodes the bytes of a message and returns its poses: several for `/tf`,
        otherwise at most one. It may raise any exception.
    """
    parts = zip(POSES[kind], ('xyz', 'xyzw'))
    numbers = [attrgetter(f'{part}.{axis}') for part, axes in parts for axis in axes]
    stamps, rows, frame = list[int](), list[list[float]](), ''
    stride, count, looked_at, unreadable = 1, 0, 0, 0
    for time, raw in messages:
        count += 1
        if (count - 1) % stride:
            continue
        looked_at += 1
        try:
            decoded = read(raw)
        except Exception:  # damaged bytes can make the reader raise any exception
            unreadable += 1
            continue
        if not decoded:
            count, looked_at = count - 1, looked_at - 1
            continue
        message = decoded[0]
        stamp = message.header.stamp
        stamps.append(int(stamp.sec) * SECOND + int(stamp.nanosec) or time)
        rows.append([number(message) for number in numbers])
        frame = frame or str(message.header.frame_id)
        if len(rows) > MAX_POSES_HELD:
            stamps, rows, stride = stamps[::2], rows[::2], 2 * stride
    if not count:
        return None
    if not rows:
        none = np.zeros(0, dtype=np.int64), np.zeros((0, 4, 4))
        return PoseTrack(topic, '', *none, refused='none of its messages can be read')
    poses = PoseRows(PoseFormat('xyzw' if len(numbers) == 7 else 'position'), len(numbers))
    poses.take(np.array(stamps, dtype=np.int64), np.array(rows, dtype=np.float64))
    track = poses.track(topic, frame)
    if unreadable:
        doubt = f'{unreadable:,} of {looked_at:,} messages cannot be read'
        track = track._replace(doubts=(*track.doubts, doubt))
    return track._replace(total=count)
