"""
A topic with poses of the tool in a bag: of a long topic only as many as the frame check can use.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from .block import SECOND
from .pose_format import PoseFormat
from .source import PoseTrack
from .tool_poses import PoseRows

# The position and the orientation in a message of each type; None without an orientation.
POSES: dict[str, Callable[[Any], tuple[Any, Any]]] = {
    f'geometry_msgs/msg/{name}': parts
    for name, parts in (
        ('PoseStamped', lambda one: (one.pose.position, one.pose.orientation)),
        ('PoseWithCovarianceStamped', lambda one: POSES[POSE](one.pose)),
        ('TransformStamped', lambda one: (one.transform.translation, one.transform.rotation)),
        ('PointStamped', lambda one: (one.point, None)),
    )
}
POSE = 'geometry_msgs/msg/PoseStamped'
TRANSFORM = 'geometry_msgs/msg/TransformStamped'
TRANSFORMS = 'tf2_msgs/msg/TFMessage'
# Number of poses kept (13 MB): if there are more, every second one is dropped, again and again.
# The frame check uses some hundred of those within the recording.
HELD = 2**16


def track_of_messages(
    topic: str,
    kind: str,
    messages: Iterable[tuple[int, bytes]],
    read: Callable[[bytes], Sequence[Any]],
) -> PoseTrack | None:
    """
    Return the poses of messages that come with the time (ns) of their receipt; None without any.

    Parameters
    ----------
    kind
        Their type, one of `POSES`.
    read
        Makes messages, one or none but for `/tf`, of their bytes, or raises any exception.
    """
    form = PoseFormat('position' if kind.endswith('PointStamped') else 'xyzw')
    rows, stamps = (
        np.empty((HELD, 3 if form.kind == 'position' else 7)),
        np.empty(HELD, dtype=np.int64),
    )
    stride, kept, count, looked_at, frame = 1, 0, 0, 0, ''
    unreadable = 0
    for time, raw in messages:
        count += 1
        if (count - 1) % stride:
            continue
        if kept == HELD:
            kept, stride = HELD // 2, 2 * stride
            rows[:kept], stamps[:kept] = rows[::2].copy(), stamps[::2].copy()
        looked_at += 1
        try:
            found = read(raw)
        except Exception:  # bytes can make the reader raise any exception
            unreadable += 1
            continue
        if not found:
            count, looked_at = count - 1, looked_at - 1
            continue
        message = found[0]
        stamp = message.header.stamp
        stamps[kept] = int(stamp.sec) * SECOND + int(stamp.nanosec) or time
        p, o = POSES[kind](message)
        rows[kept] = (p.x, p.y, p.z) if o is None else (p.x, p.y, p.z, o.x, o.y, o.z, o.w)
        frame = frame or str(message.header.frame_id)
        kept += 1
    if not count:
        return None
    if not kept:
        none = np.zeros((0, 4, 4))
        return PoseTrack(topic, '', stamps[:0], none, refused='none of its messages can be read')
    poses = PoseRows(form, rows.shape[1])
    poses.take(stamps[:kept], rows[:kept])
    track = poses.track(topic, frame)
    if unreadable:
        doubt = f'{unreadable:,} of {looked_at:,} messages cannot be read'
        track = track._replace(doubts=(*track.doubts, doubt))
    return track._replace(total=count)
