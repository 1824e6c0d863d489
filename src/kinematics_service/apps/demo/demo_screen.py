"""The demo's live table: everything in it was received on the node's topics."""

import math
import os
import textwrap
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from rich.console import ConsoleDimensions, Group, RenderableType
from rich.table import Table
from rich.text import Text

from ...errors import LayoutError
from ...kernel import Floats
from ...node.messages.readings import (
    TWIST,
    JacobianReading,
    WarningReading,
    jacobian_of,
    scale_of,
    warned_of,
)
from ...printing import plain
from ...robot.measures import MEASURES, Level
from .demo_listener import INTERVAL, DemoListener
from .live_table import BARS, STYLES, bars, coloured, matrix_lines, number, scale_lines
from .readings import pose_of

# Number of lines of a sentence, so that nothing below it jumps.
SENTENCE_LINES = 2
LABEL = 18
LEFT_COLUMN = 22
NARROW = 8
# A bar of full height is this distance, in rad.
FULL = 0.5
NOTHING = '-'
# Width in characters from which on there are two columns, least width of the left one, and the gap
# between them.
WIDE, LEFT, GAP = 120, 78, 2
# Width of the bar at the end of a history, with its number.
SCALE = 13
QDOT = 'qdot'


class ScreenSection(NamedTuple):
    """
    Lines that are shown whole or not at all; if there is little room, those of low rank go in
    first.
    """

    rank: int
    lines: Sequence[Text]


def screen(
    listener: DemoListener, size: ConsoleDimensions, blocks: bool, units: Mapping[str, str]
) -> RenderableType:
    """
    Return the live table: the level first, and of the rest what fits.

    Parameters
    ----------
    listener
        The messages received.
    size
        Size of the terminal; from WIDE characters on there are two columns.
    blocks
        Whether the terminal can show block characters.
    units
        Of each measure.
    """
    width, height = size
    wide = width >= WIDE
    left = max(LEFT, (width - GAP) // 2) if wide else width
    right = width - left - GAP if wide else width
    head = [
        ScreenSection(0, _warning(listener.warned, width)),
        ScreenSection(1, [_title(listener, width)]),
    ]
    tool = [ScreenSection(9, [Text()]), ScreenSection(4, _motion(listener, left))]
    joints = [ScreenSection(8, [Text()]), ScreenSection(5, _jacobian(listener, left))]
    near = [
        ScreenSection(9, [Text()]),
        ScreenSection(2, [_distance(listener)]),
        ScreenSection(6, [_scale(listener)]),
        ScreenSection(3, _histories(listener, right) if blocks else []),
        ScreenSection(6, _measures(listener, right, units)),
        ScreenSection(7, _lost(listener)),
    ]
    elsewhere = f'elsewhere: python -m kinematics_service echo jacobian --node {listener.source}'
    foot = [
        ScreenSection(9, [Text()]),
        ScreenSection(8, [Text(elsewhere)] if len(elsewhere) <= width else []),
    ]
    if not wide:
        return Group(*_fitting([*head, *tool, *joints, *near, *foot[1:]], height))
    if blocks:
        near += [ScreenSection(9, [Text()]), ScreenSection(7, _speed_bars(listener, right))]
    room = height - sum(len(part.lines) for part in (*head, *foot))
    columns = Table.grid(padding=(0, GAP, 0, 0))
    columns.add_column(width=left)
    columns.add_column()
    columns.add_row(Group(*_fitting([*tool, *joints], room)), Group(*_fitting(near, room)))
    return Group(*_fitting(head, height), columns, *_fitting(foot, height))


def _fitting(parts: Sequence[ScreenSection], height: int) -> list[Text]:
    kept: set[int] = set()
    for k in sorted(range(len(parts)), key=lambda k: parts[k].rank):
        if len(parts[k].lines) <= height:
            kept.add(k)
            height -= len(parts[k].lines)
    lines = [line for k in sorted(kept) for line in parts[k].lines]
    # No empty line after another one.
    lines = [line for k, line in enumerate(lines) if line or k == 0 or lines[k - 1]]
    for line in lines:
        line.no_wrap, line.overflow = True, 'ellipsis'
    return lines


def _histories(listener: DemoListener, width: int) -> list[Text]:
    shown = list(listener.history)[-(width - LABEL - SCALE) :]
    speeds = list(listener.speeds)[-(width - LABEL - SCALE) :]
    highest = max(speeds, default=0.0) or 1.0
    lines = [
        (f'distance, {len(shown) * INTERVAL:.0f} s', bars(shown, FULL), f'{FULL:g} rad'),
        ('fastest joint', bars(speeds, highest), f'{highest:.2g} rad/s'),
    ]
    return [_labelled(label, f'{history} {BARS[-1]} {full}') for label, history, full in lines]


def _speed_bars(listener: DemoListener, width: int) -> list[Text]:
    speeds = listener.joint_speeds()
    if not speeds:
        return []
    highest = max([*listener.speeds, 1e-9])
    label = max(map(len, speeds))
    room = max(width - label - NARROW - 4, 1)
    lines = [Text(), Text('joint speeds, rad/s (sliding: m/s)', style='bold')]
    for name, speed in speeds.items():
        full = round(room * min(abs(speed) / highest, 1.0)) if math.isfinite(speed) else 0
        lines.append(
            Text(f'{plain(name).rjust(label)} {number(speed, 3).rjust(NARROW)} {BARS[-1] * full}')
        )
    return lines


def _labelled(label: str, rest: str, style: str = '') -> Text:
    return Text.assemble((label.ljust(LABEL), 'bold'), (rest, style))


def _title(listener: DemoListener, width: int) -> Text:
    robot = listener.warned.values.get('robot', '') if listener.warned else ''
    left = f'{plain(robot)}  {listener.source}'
    right = f'{listener.time:.1f} s  {listener.jacobian.rate():.0f} Hz  Ctrl-C ends it'
    return Text(left + right.rjust(width - len(left)), style='bold')


def _warning(warned: WarningReading | None, width: int) -> list[Text]:
    if warned is None:
        return [Text('waiting for the node'), *[Text()] * (SENTENCE_LINES - 1)]
    sentence = plain(warned.sentence)
    if warned.level != Level.STALE.name:
        # Its numbers are those of the moment of the warning; those of now are below.
        head, _, tail = sentence.partition(': ')
        factor = plain(warned.values.get('factor', ''))
        if factor and tail.startswith(factor):
            head += f' ({factor})'
        sentence = '; '.join(part for part in (head, tail.partition('; ')[2]) if part)
    indent = ' ' * 7
    lines = textwrap.wrap(
        warned.level.ljust(len(indent)) + sentence,
        width,
        subsequent_indent=indent,
        max_lines=SENTENCE_LINES,
        placeholder=' ...',
    )
    texts = [coloured(line, warned.level) for line in lines]
    return texts + [Text()] * (SENTENCE_LINES - len(texts))


def _motion(listener: DemoListener, width: int) -> list[Text]:
    pose, twist = [NOTHING], [NOTHING]
    if listener.pose.message is not None:
        shown = pose_of(listener.pose.message)
        degrees = [math.degrees(angle) for angle in shown.roll_pitch_yaw]
        pose = [f'{_narrow(shown.position)} m  ', f'  rpy {_narrow(degrees, 1)} deg']
    if listener.twist.message is not None:
        linear, angular = TWIST.of(listener.twist.message).vectors.values()
        twist = [f'{_narrow(linear)} m/s', f'  ang {_narrow(angular)} rad/s']
    lines = []
    for label, parts in (('tool  x y z ', pose), ('twist x y z ', twist)):
        if len(label) + sum(map(len, parts)) <= width:
            parts = [''.join(parts)]
        lines.append(Text.assemble((label, 'bold'), parts[0]))
        lines += [Text(part.strip().rjust(len(label) + len(part) - 6)) for part in parts[1:]]
    return lines


def _narrow(values: Sequence[float] | Floats, decimals: int = 4) -> str:
    return ''.join(f' {number(float(value), decimals).rjust(NARROW - 1)}' for value in values)


def _jacobian(listener: DemoListener, width: int) -> list[Text]:
    if listener.jacobian.message is None:
        return [_labelled('Jacobian', NOTHING)]
    try:
        matrix = jacobian_of(listener.jacobian.message)
    except LayoutError as error:
        return [_labelled('Jacobian', str(error))]
    speeds = listener.joint_speeds()
    if set(matrix.columns) <= set(speeds):
        # Below each column the speed of its joint.
        row = np.array([speeds[name] for name in matrix.columns])
        matrix = JacobianReading(
            (*matrix.rows, QDOT), matrix.columns, np.vstack([matrix.jacobian, row])
        )
    return [Text(line) for line in matrix_lines(matrix, width)]


def _distance(listener: DemoListener) -> Text:
    distance = listener.measure('distance')
    level = listener.warned.level if listener.warned else ''
    shown = NOTHING
    if distance is not None:
        shown = f'{distance:.4f} rad = {math.degrees(distance):.1f} deg'
        shown = MEASURES['distance'].farther(distance) or shown
    return _labelled('distance', shown, STYLES.get(level, ''))


def _scale(listener: DemoListener) -> Text:
    # Of the arm's motion as a command: the arm itself goes on.
    message, reason = listener.scale.message, listener.reason.message
    if message is None or reason is None:
        return _labelled('scale', NOTHING)
    told, (line,) = warned_of(reason), scale_lines(scale_of(message))
    return _labelled('scale', f'{line.removeprefix("scale ")}  {plain(told.cause)}'.rstrip())


def _measures(listener: DemoListener, width: int, units: Mapping[str, str]) -> list[Text]:
    cells = []
    for name, measure in MEASURES.items():
        if name != 'distance':  # it has a line of its own
            number, unit = listener.measure(name), units[name]
            value = _measure(number) if number is None else f'{_measure(number)} {unit}'.rstrip()
            cells.append(_labelled(measure.short or measure.words, value.ljust(LEFT_COLUMN)))
    across = 2 if width >= 2 * len(cells[0]) else 1
    return [Text.assemble(*cells[k : k + across]) for k in range(0, len(cells), across)]


def _lost(listener: DemoListener) -> list[Text]:
    warned = listener.warned
    level = warned.level if warned else ''
    near = {}
    if warned is not None and level in (Level.WARN.name, Level.ERROR.name):
        near = warned.values
    always = []
    if warned is not None and 'structural' in warned.values:
        always = [_labelled('always', plain(warned.values['structural']))]
    return [
        *always,
        _labelled('lost direction', plain(near.get('lost_direction', NOTHING))),
        _labelled('joints opposed', _shortened(near.get('joints_against_each_other', NOTHING))),
    ]


def _measure(value: float | None) -> str:
    return 'none' if value is None else f'{value:+.4g}' if value < 0.0 else f' {value:.4g}'


def _shortened(joints: str) -> str:
    # "a_joint + b_joint" is easier to read without the common ending of the names.
    names = [word for word in plain(joints).split(' ') if word not in '+-']
    common = os.path.commonprefix([name[::-1] for name in names])[::-1]
    ending = common[common.find('_') :] if '_' in common and len(names) > 1 else ''
    return plain(joints).replace(ending, '') if ending else plain(joints)
