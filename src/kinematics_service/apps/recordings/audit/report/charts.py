# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Draw curves over time as SVG.

The drawing stretches to any width. Its labels are HTML, so they keep their size.
"""

import math
from collections.abc import Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from .....kernel import Floats
from ..curves import WIDTH, Curve, across

HEIGHT = 100
# Margin above and below the curves of a chart, as a ratio of the range of their values.
AIR = 0.06
# Largest number of decades that a logarithmic axis shows.
DECADES = 5


class Band(NamedTuple):
    """A shaded interval of time, s, in a chart; `style` is WARN, ERROR or gap."""

    begin: float
    end: float
    style: str


class LevelLine(NamedTuple):
    """A horizontal line with a name in a chart, such as a limit."""

    value: float
    name: str
    style: str = 'limit'


class Chart(NamedTuple):
    """
    Curves over one time axis.

    Attributes
    ----------
    title, unit
        The quantity and its unit.
    levels
        Horizontal lines with names, such as limits. A linear axis shows only the lines near a
        curve.
    end : s
        End of the time axis.
    clip
        The largest value on the axis; larger values are drawn at this value.
    height
        In px.
    """

    title: str
    unit: str
    curves: Sequence[Curve]
    bands: Sequence[Band] = ()
    levels: Sequence[LevelLine] = ()
    log: bool = False
    height: int = 150
    end: float = 0.0
    clip: float = math.inf

    def html(self) -> str:
        """Return the chart as an HTML figure."""
        axis = ValueScale.of(self)
        keys = ''.join(
            f'<span class="key"><svg viewBox="0 0 30 10"><line class="{curve.style}" x1="0" '
            f'x2="30" y1="5" y2="5"/></svg>{escape(curve.name)}</span>'
            for curve in self.curves
            if len(self.curves) > 1
        )
        unit = f', {escape(self.unit)}' if self.unit else ''
        scale, time_unit = time_unit_of(self.end)
        marks, labels = self._axes(axis, scale)
        shades = ''.join(self._shade(band) for band in self.bands)
        paths = ''.join(
            f'<path class="{curve.style}" data-name="{escape(curve.name)}" '
            f'd="{self._path(curve, axis)}"/>'
            for curve in self.curves
        )
        log = ' data-log="1"' if self.log else ''
        return (
            f'<figure><figcaption><b>{escape(self.title)}</b>{unit}{keys}</figcaption>'
            f'<div class="plot" style="--height: {self.height}px">'
            f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" preserveAspectRatio="none" role="img" '
            f'aria-label="{escape(self.title)}" data-low="{axis.low:.9g}" '
            f'data-high="{axis.high:.9g}"{log} data-end="{self.end / scale:.9g}" '
            f'data-unit="{time_unit}">{shades}{marks}{paths}'
            f'<line class="cursor" x1="0" x2="0" y1="0" y2="{HEIGHT}"/></svg>'
            f'{labels}<span class="x unit">t, {time_unit}</span><span class="read"></span></div>'
            '</figure>\n'
        )

    def _axes(self, axis: 'ValueScale', scale: float) -> tuple[str, str]:
        marks, labels = [], []
        for value in axis.ticks():
            y = axis.at(value)
            marks.append(f'<line class="grid" x1="0" x2="{WIDTH}" y1="{y:.2f}" y2="{y:.2f}"/>')
            labels.append(f'<span class="y" style="top:{y:.2f}%">{shown(value)}</span>')
        for value in nice_ticks(0.0, self.end / scale, 8):
            x = 100.0 * value * scale / self.end if self.end else 0.0
            if x < 94.0:
                labels.append(f'<span class="x" style="left:{x:.2f}%">{shown(value)}</span>')
        for level in self.levels:
            if axis.low <= level.value <= axis.high:
                y = axis.at(level.value)
                marks.append(
                    f'<line class="{level.style}" x1="0" x2="{WIDTH}" y1="{y:.2f}" y2="{y:.2f}"/>'
                )
                top = f'top:{max(y, 12.0):.2f}%'
                labels.append(f'<span class="note" style="{top}">{escape(level.name)}</span>')
        return ''.join(marks), ''.join(labels)

    def _shade(self, band: Band) -> str:
        end = self.end or 1.0
        x = WIDTH * band.begin / end
        # Draw an interval at least 2 units wide, so that a short interval is visible.
        width = max(WIDTH * (band.end - band.begin) / end, 2.0)
        return f'<rect class="{band.style}" x="{x:.2f}" y="0" width="{width:.2f}" height="100"/>'

    def _path(self, curve: Curve, axis: 'ValueScale') -> str:
        x, y = across(curve.t, self.end), axis.at_all(curve.values)
        if len(x) == 1:
            return f'M{x[0] - 3:.1f} {y[0]:.2f}L{x[0] + 3:.1f} {y[0]:.2f}'
        return ''.join(
            f'{"M" if begin else "L"}{px:.1f} {py:.2f}'
            for px, py, begin in zip(x.tolist(), y.tolist(), curve.begins.tolist())
        )


class ValueScale(NamedTuple):
    """The vertical axis of a chart, for values from `low` to `high`, linear or logarithmic."""

    low: float
    high: float
    log: bool

    @classmethod
    def of(cls, chart: Chart) -> 'ValueScale':
        """
        Return the vertical axis of a chart. The axis covers the curves, and leaves a margin above
        and below them.

        A logarithmic axis covers also the horizontal lines in `levels`. A linear axis covers only
        the lines near the curves.
        """
        values = [curve.values for curve in chart.curves]
        lows = [float(np.min(column)) for column in values if len(column)] or [0.0]
        highs = [float(np.max(column)) for column in values if len(column)] or [1.0]
        low, high = min(lows), min(max(highs), chart.clip)
        marks = [level.value for level in chart.levels]
        return cls._of_powers(low, high, marks) if chart.log else cls._plain(low, high, marks)

    @classmethod
    def _of_powers(cls, low: float, high: float, marks: Sequence[float]) -> 'ValueScale':
        positive = [mark for mark in marks if mark > 0.0]
        high = max([high, *(1.3 * mark for mark in positive)]) or 1.0
        least = max(low, high * 10.0**-DECADES)
        low = min([least, *(0.7 * mark for mark in positive)])
        return cls(10 ** (math.log10(low) - 0.1), 10 ** (math.log10(high) + 0.1), True)

    @classmethod
    def _plain(cls, low: float, high: float, marks: Sequence[float]) -> 'ValueScale':
        room = (high - low) or max(abs(high), 1.0) * 0.1
        # Extend the range of the axis to a horizontal line (`mark`) if the curves come near the
        # line.
        for mark in marks:
            if low - 0.5 * room <= mark <= high + 0.5 * room:
                low, high = min(low, mark), max(high, mark)
        room = max((high - low) or room, 1e-9)
        return cls(low - AIR * room, high + AIR * room, False)

    def at(self, value: float) -> float:
        """Return the distance of a value from the top of the drawing, 0 to `HEIGHT`."""
        return float(self.at_all(np.array([value]))[0])

    def at_all(self, values: Floats) -> Floats:
        """Return the distances of values from the top of the drawing, 0 to `HEIGHT`."""
        if self.log:
            fraction = np.log(np.maximum(values, self.low) / self.low)
            fraction = fraction / math.log(self.high / self.low)
        else:
            fraction = (values - self.low) / (self.high - self.low)
        return np.asarray(HEIGHT * (1.0 - np.clip(fraction, 0.0, 1.0)))

    def ticks(self) -> list[float]:
        """Return round numbers at which the axis has labels."""
        if not self.log:
            return nice_ticks(self.low, self.high, 4)
        first, last = math.ceil(math.log10(self.low)), math.floor(math.log10(self.high))
        if last <= first:
            # Label round numbers if the axis contains fewer than two powers of ten.
            return [tick for tick in nice_ticks(self.low, self.high, 4) if tick > 0.0]
        return [10.0**k for k in range(first, last + 1)]


def nice_ticks(low: float, high: float, count: int) -> list[float]:
    """Return round numbers at even steps from `low` to `high`, about `count` of them."""
    if not high > low:
        return [low]
    raw = (high - low) / count
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(power * m for m in (1.0, 2.0, 2.5, 5.0, 10.0) if power * m >= raw * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def shown(value: float) -> str:
    """Return a number as text for the label of an axis; a negative zero becomes 0."""
    return f'{value + 0.0:.6g}'


def time_unit_of(end: float) -> tuple[float, str]:
    """
    Return the unit of a time axis that ends at `end` (s): the unit's length in s, and its name.
    """
    if end >= 3 * 3600.0:
        return 3600.0, 'h'
    return (60.0, 'min') if end >= 300.0 else (1.0, 's')
