# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write messages as lines of text, for `demo` and `echo`. Only the word OK, WARN, ERROR or STALE has
a colour.
"""

import math
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rclpy.node import Node
from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from ...kernel import Floats
from ...node.messages import readings
from ...node.steady_time import steady_timer
from ...printing import broken_name, plain
from ...robot.measures import Level
from .readings import PoseReading, StatusesReading

# Widths in characters.
CELL_WIDTH = 9  # a number, and the gap before it
MAX_CELL_WIDTH = 14  # largest width of a Jacobian column; its header is the joint's name
ROW_LABEL_WIDTH = 4
VECTOR_LABEL_WIDTH = 19
STYLES = {
    Level.OK.name: 'bold green',
    Level.WARN.name: 'bold yellow',
    Level.ERROR.name: 'bold red',
    Level.STALE.name: 'bold magenta',
}
BARS = '▁▂▃▄▅▆▇█'
SCALE_BAR_WIDTH = 20
# Time between two updates of a live table, s.
REDRAW_PERIOD = 0.1


@contextmanager
def live(node: Node, draw: Callable[[Console], Group], whole: bool) -> Iterator[None]:
    """
    While the `with` block runs, call `draw` periodically, and show the lines that `draw` returns.

    The drawing fills the terminal if `whole` is True; else it uses the lines below the cursor.
    """
    console = Console(markup=False, highlight=False, emoji=False)
    with Live(
        console=console,
        screen=whole,
        auto_refresh=False,
        redirect_stdout=False,
        redirect_stderr=False,
    ) as screen:

        def redraw() -> None:
            screen.update(draw(console), refresh=True)

        redraw()
        steady_timer(node, REDRAW_PERIOD, redraw)
        yield
        redraw()


def number(value: float, decimals: int = 4) -> str:
    """
    Return a number as text with its sign, in at most eight characters; negative zero is +0.

    A large number has fewer decimals, or an exponent (`+1.5e+03`).
    """
    if not math.isfinite(value):
        return f'{value:+}'
    if abs(round(value, decimals)) >= 100.0:
        decimals = min(decimals, 3)
    if abs(round(value, decimals)) >= 1000.0:
        return f'{value:+.1e}'
    return f'{round(value, decimals) + 0.0:+.{decimals}f}'


def numbers(values: Sequence[float] | Floats, decimals: int = 4) -> str:
    """Return numbers as text, each in the same width, so that columns of several lines align."""
    return ' '.join(number(float(value), decimals).rjust(CELL_WIDTH) for value in values)


def matrix_lines(matrix: readings.JacobianReading, width: int) -> list[str]:
    """
    Return a Jacobian as lines of at most `width` characters, with the names of rows and joints. If
    the columns need more width, they continue in a second block of lines.
    """
    columns = [plain(name) for name in matrix.columns]
    rows = [plain(name) for name in matrix.rows]
    margin = max(ROW_LABEL_WIDTH, *map(len, rows))
    room = max(width - margin, CELL_WIDTH)
    cell = min(max(room // len(columns), CELL_WIDTH), MAX_CELL_WIDTH)
    block = max(1, room // cell)
    lines = []
    for first in range(0, len(columns), block):
        part = slice(first, first + block)
        headers = [_header(name, cell - 1) for name in columns[part]]
        for k in range(-max(map(len, headers)), 0):
            cells = (header[k] if -k <= len(header) else '' for header in headers)
            lines.append(' ' * margin + ''.join(f' {text.rjust(cell - 1)}' for text in cells))
        for name, values in zip(rows, matrix.jacobian[:, part].tolist()):
            cells = (number(value) for value in values)
            lines.append(
                name.rjust(margin) + ''.join(f' {text.rjust(cell - 1)}' for text in cells)
            )
    return lines


def _header(name: str, width: int) -> list[str]:
    lines = broken_name(name, width).split('\n')
    return [line if len(line) <= width else f'{line[: width - 1]}~' for line in lines]


def pose_lines(pose: PoseReading, width: int) -> list[str]:
    """
    Return the lines of a pose: position in m, roll pitch yaw in degrees, and quaternion. `width`
    has no effect.
    """
    degrees = [math.degrees(angle) for angle in pose.roll_pitch_yaw]
    return [
        f'position x y z     {numbers(pose.position)}  m, in {plain(pose.frame)}',
        f'roll pitch yaw     {numbers(degrees, 2)}  deg',
        f'quaternion x y z w {numbers(pose.quaternion_xyzw)}',
    ]


def vector_lines(
    pair: readings.VectorPair, reading: readings.VectorReading, width: int
) -> list[str]:
    """
    Return two lines for a twist, acceleration or wrench: one for each of its two vectors. `width`
    has no effect.
    """
    lines = [
        f'{f"{name} {axes}".ljust(VECTOR_LABEL_WIDTH)}{numbers(reading.vectors[name])}  {unit}'
        for name, (axes, unit) in pair.vectors.items()
    ]
    return [f'{lines[0]}, axes of {plain(reading.frame)}', *lines[1:]]


def scale_lines(reading: readings.ScaleReading, width: int = 0) -> list[str]:
    """
    Return a line with the velocity scale (0 to 1) as a number and as a bar; `width` has no effect.
    """
    filled = round(SCALE_BAR_WIDTH * min(max(reading.scale, 0.0), 1.0))
    return [f'scale {reading.scale:.3f}  {"█" * filled}{"░" * (SCALE_BAR_WIDTH - filled)}']


def warned_lines(warned: readings.WarningReading, width: int) -> list[str]:
    """
    Return the lines of a warning: level (such as WARN) and sentence, then its keys and values.
    """
    label = max(map(len, warned.values), default=0)
    lines = textwrap.wrap(f'{warned.level}  {plain(warned.sentence)}', width) or [warned.level]
    return lines + [
        f'  {plain(key).ljust(label)}  {plain(value)}' for key, value in warned.values.items()
    ]


def statuses_lines(reading: StatusesReading, width: int) -> list[str]:
    """
    Return the lines of a node's diagnostic statuses: for each status its level, name and sentence,
    then its keys and values.
    """
    return [
        line
        for status in reading.statuses
        for line in warned_lines(
            status._replace(sentence=f'{status.name}: {status.sentence}'), width
        )
    ]


def coloured(line: str, level: str) -> Text:
    """
    Return a line as `Text`. If it begins with the word `level`, such as WARN, colour this word.
    """
    text = Text(line, no_wrap=True, overflow='ellipsis')
    if line.startswith(level):
        text.stylize(f'{STYLES.get(level, "bold")} reverse', 0, len(level))
    return text


def bars(values: Sequence[float], highest: float) -> str:
    """
    Return a line of bar characters, one for each value: the lowest bar for 0 and below, the
    highest for `highest` and above.
    """
    steps = len(BARS) - 1
    return ''.join(BARS[round(min(max(value / highest, 0.0), 1.0) * steps)] for value in values)
