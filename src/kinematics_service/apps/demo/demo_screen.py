# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw the live table of the demo from messages that the node published."""

import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from rich.console import ConsoleDimensions, Group
from rich.text import Text

from ...errors import LayoutError
from ...kernel import Floats
from ...node.messages import readings
from ...printing import plain
from ...robot.measures import MEASURES, Level
from .demo_listener import INTERVAL, DemoListener
from .live_table import BARS, STYLES, bars, coloured, matrix_lines, number, scale_lines
from .readings import pose_of

# Number of lines reserved for the warning, so that the lines below it never move.
SENTENCE_LINES = 2
# Widths in characters.
LABEL_WIDTH = 18
MEASURE_WIDTH = 22
NUMBER_WIDTH = 8
HISTORY_SCALE_WIDTH = 13  # text beside a bar chart, such as `█ 0.5 rad`
# In the bar chart of past distances to singular poses, a bar of full height means this distance,
# rad.
FULL_BAR = 0.5
MISSING = '-'
QDOT = 'qdot'


class ScreenSection(NamedTuple):
    """
    Lines of the table that are shown together or not at all.

    If the terminal has too few lines, sections with the largest number `rank` are left out first.
    """

    rank: int
    lines: Sequence[Text]


def screen(
    listener: DemoListener, size: ConsoleDimensions, blocks: bool, units: Mapping[str, str]
) -> Group:
    """
    Return the live table: the latest warning, then the sections for which the terminal has room.

    Parameters
    ----------
    listener
        The listener with the received messages.
    size
        Size of the terminal in characters.
    blocks
        Whether the terminal can show block characters.
    units
        The unit of each singularity measure, by name.
    """
    width, height = size
    elsewhere = f'elsewhere: python -m kinematics_service echo jacobian --node {listener.source}'
    sections = [
        ScreenSection(0, _warning(listener.warned, width)),
        ScreenSection(1, [_title(listener, width)]),
        ScreenSection(9, [Text()]),
        ScreenSection(4, _motion(listener, width)),
        ScreenSection(8, [Text()]),
        ScreenSection(5, _jacobian(listener, width)),
        ScreenSection(9, [Text()]),
        ScreenSection(2, [_distance(listener)]),
        ScreenSection(6, [_scale(listener)]),
        ScreenSection(3, _histories(listener, width) if blocks else []),
        ScreenSection(6, _measures(listener, width, units)),
        ScreenSection(7, _lost(listener)),
        ScreenSection(8, [Text(elsewhere)] if len(elsewhere) <= width else []),
    ]
    return Group(*_fitting(sections, height))


def _fitting(parts: Sequence[ScreenSection], height: int) -> list[Text]:
    kept: set[int] = set()
    for k in sorted(range(len(parts)), key=lambda k: parts[k].rank):
        if len(parts[k].lines) <= height:
            kept.add(k)
            height -= len(parts[k].lines)
    lines = [line for k in sorted(kept) for line in parts[k].lines]
    # If two successive lines are empty, keep one of them.
    lines = [line for k, line in enumerate(lines) if line or k == 0 or lines[k - 1]]
    for line in lines:
        line.no_wrap, line.overflow = True, 'ellipsis'
    return lines


def _histories(listener: DemoListener, width: int) -> list[Text]:
    room = width - LABEL_WIDTH - HISTORY_SCALE_WIDTH
    shown, speeds = list(listener.history)[-room:], list(listener.speeds)[-room:]
    highest = max(speeds, default=0.0) or 1.0
    lines = [
        (f'distance, {len(shown) * INTERVAL:.0f} s', bars(shown, FULL_BAR), f'{FULL_BAR:g} rad'),
        ('fastest joint', bars(speeds, highest), f'{highest:.2g} rad/s'),
    ]
    return [_labelled(label, f'{history} {BARS[-1]} {full}') for label, history, full in lines]


def _labelled(label: str, text: str, style: str = '') -> Text:
    return Text.assemble((label.ljust(LABEL_WIDTH), 'bold'), (text, style))


def _title(listener: DemoListener, width: int) -> Text:
    robot = listener.warned.values.get('robot', '') if listener.warned else ''
    left = f'{plain(robot)}  {listener.source}'
    right = f'{listener.time:.1f} s  {listener.jacobian.rate():.0f} Hz  Ctrl-C ends it'
    return Text(left + right.rjust(width - len(left)), style='bold')


def _warning(warned: readings.WarningReading | None, width: int) -> list[Text]:
    if warned is None:
        return [Text('waiting for the node'), *[Text()] * (SENTENCE_LINES - 1)]
    sentence = plain(warned.sentence)
    if warned.level != Level.STALE.name:
        # Omit the numbers in the warning's sentence. They were measured when the warning was
        # published, and the table shows the present values.
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
    pose, twist = [MISSING], [MISSING]
    if listener.pose.message is not None:
        shown = pose_of(listener.pose.message)
        degrees = [math.degrees(angle) for angle in shown.roll_pitch_yaw]
        pose = [f'{_narrow(shown.position)} m  ', f'  rpy {_narrow(degrees, 1)} deg']
    if listener.twist.message is not None:
        linear, angular = readings.TWIST.of(listener.twist.message).vectors.values()
        twist = [f'{_narrow(linear)} m/s', f'  ang {_narrow(angular)} rad/s']
    lines = []
    for label, parts in (('tool  x y z ', pose), ('twist x y z ', twist)):
        if len(label) + sum(map(len, parts)) <= width:
            parts = [''.join(parts)]
        lines.append(Text.assemble((label, 'bold'), parts[0]))
        lines += [Text(part.strip().rjust(len(label) + len(part) - 6)) for part in parts[1:]]
    return lines


def _narrow(values: Sequence[float] | Floats, decimals: int = 4) -> str:
    return ''.join(
        f' {number(float(value), decimals).rjust(NUMBER_WIDTH - 1)}' for value in values
    )


def _jacobian(listener: DemoListener, width: int) -> list[Text]:
    if listener.jacobian.message is None:
        return [_labelled('Jacobian', MISSING)]
    try:
        matrix = readings.jacobian_of(listener.jacobian.message)
    except LayoutError as error:
        return [_labelled('Jacobian', str(error))]
    speeds = listener.joint_speeds()
    if set(matrix.columns) <= set(speeds):
        # Below each column of the Jacobian, show the velocity of the column's joint.
        row = np.array([speeds[name] for name in matrix.columns])
        matrix = readings.JacobianReading(
            (*matrix.rows, QDOT), matrix.columns, np.vstack([matrix.jacobian, row])
        )
    return [Text(line) for line in matrix_lines(matrix, width)]


def _distance(listener: DemoListener) -> Text:
    distance = listener.measure('distance')
    level = listener.warned.level if listener.warned else ''
    shown = MISSING
    if distance is not None:
        shown = f'{distance:.4f} rad = {math.degrees(distance):.1f} deg'
        shown = MEASURES['distance'].farther(distance) or shown
    return _labelled('distance', shown, STYLES.get(level, ''))


def _scale(listener: DemoListener) -> Text:
    # Return the line with the scale: the factor (0 to 1) by which a velocity command of the arm is
    # to be multiplied. The simulated arm ignores the scale.
    message, reason = listener.scale.message, listener.reason.message
    if message is None or reason is None:
        return _labelled('scale', MISSING)
    cause, (line,) = readings.warned_of(reason).cause, scale_lines(readings.scale_of(message))
    return _labelled('scale', f'{line.removeprefix("scale ")}  {plain(cause)}'.rstrip())


def _measures(listener: DemoListener, width: int, units: Mapping[str, str]) -> list[Text]:
    cells = []
    for name, measure in MEASURES.items():
        if name != 'distance':  # the table shows the distance in another line
            number, unit = listener.measure(name), units[name]
            value = _measure(number) if number is None else f'{_measure(number)} {unit}'.rstrip()
            cells.append(_labelled(measure.short or measure.words, value.ljust(MEASURE_WIDTH)))
    across = 2 if width >= 2 * len(cells[0]) else 1
    return [Text.assemble(*cells[k : k + across]) for k in range(0, len(cells), across)]


def _lost(listener: DemoListener) -> list[Text]:
    level, values = '', {}
    if listener.warned is not None:
        level, values = listener.warned.level, listener.warned.values
    near = values if level in (Level.WARN.name, Level.ERROR.name) else {}
    return [
        *([_labelled('always', plain(values['structural']))] if 'structural' in values else []),
        _labelled('lost direction', plain(near.get('lost_direction', MISSING))),
        _labelled('joints opposed', plain(near.get('joints_against_each_other', MISSING))),
    ]


def _measure(value: float | None) -> str:
    return 'none' if value is None else f'{value:+.4g}' if value < 0.0 else f' {value:.4g}'
