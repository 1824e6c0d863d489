"""Points over an axis on the page of a calibration, errors before and after side by side."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from ....kernel import Floats
from ...recordings.audit.report import charts
from ...recordings.audit.report.charts import ValueScale, nice_ticks, shown

WIDTH, NARROW, HEIGHT = 720, 440, 220
LEFT, RIGHT, TOP, BOTTOM = 64, 12, 10, 34
# Where a value stands.
Place = Callable[[float], float]
# Decades of a logarithmic axis at most.
DECADES = 4


@dataclass(frozen=True, eq=False)
class PointPlot:
    """
    Points over a linear axis, their values on a logarithmic one.

    Attributes
    ----------
    title, unit, across
        What the values are, in which unit, and what the axis below counts.
    x : shape (N,)
    series
        Values (N,) by style: before, after.
    rings : shape (M,)
        Rows that a ring is drawn around: outliers.
    width
        Of the drawing, whose texts are larger where it is less.
    """

    title: str
    unit: str
    across: str
    x: Floats
    series: Sequence[tuple[str, Floats]]
    rings: Sequence[int] = ()
    width: int = WIDTH

    def html(self) -> str:
        """Return the figure."""
        values = np.concatenate([one for _, one in self.series])
        high = float(np.max(values)) or 1.0
        least = float(np.min(values))
        low, high = 0.5 * max(least, high * 10.0**-DECADES), 2.0 * high
        below = '; points on the lower edge are below it' if least < low else ''
        begin, end = float(np.min(self.x)), float(np.max(self.x))
        room = (end - begin) / 50 or 0.5
        begin, end = begin - room, end + room

        def column(x: float) -> float:
            return LEFT + (self.width - LEFT - RIGHT) * (x - begin) / (end - begin)

        axis = ValueScale(low, high, log=True)

        def row(value: float) -> float:
            return TOP + (HEIGHT - BOTTOM - TOP) * axis.at(value) / charts.HEIGHT

        parts = [_value_axis(axis, row, self.width), _across_axis(begin, end, column)]
        for style, own in self.series:
            parts += [
                f'<circle class="{style}" cx="{column(x):.1f}" cy="{row(value):.1f}" r="2.4"/>'
                for x, value in zip(self.x.tolist(), own.tolist())
            ]
        first = self.series[0][1]
        parts += [
            f'<circle class="outlier" cx="{column(float(self.x[k])):.1f}" '
            f'cy="{row(float(first[k])):.1f}" r="5"/>'
            for k in self.rings
        ]
        parts.append(
            f'<text class="end" x="{self.width - RIGHT}" y="{HEIGHT - 3}">'
            f'{escape(self.across)}</text>'
        )
        keys = ''.join(
            f'<span class="key"><span class="swatch {style}"></span>{style}</span>'
            for style, _ in self.series
        )
        return (
            f'<figure><figcaption><b>{escape(self.title)}</b>, {escape(self.unit)}{below}{keys}'
            f'</figcaption><div class="wide"><svg class="drawing" viewBox="0 0 {self.width} '
            f'{HEIGHT}" role="img" aria-label="{escape(self.title)}">{"".join(parts)}</svg>'
            '</div></figure>\n'
        )


def _value_axis(axis: ValueScale, row: Place, width: int) -> str:
    return ''.join(
        f'<line class="grid" x1="{LEFT}" x2="{width - RIGHT}" y1="{row(tick):.1f}" '
        f'y2="{row(tick):.1f}"/>'
        f'<text class="end" x="{LEFT - 6}" y="{row(tick) + 4:.1f}">{shown(tick)}</text>'
        for tick in axis.ticks()
    )


def _across_axis(begin: float, end: float, column: Place) -> str:
    ticks = nice_ticks(begin, end, 8)
    return ''.join(
        f'<text class="middle" x="{column(tick):.1f}" y="{HEIGHT - 18}">{shown(tick)}</text>'
        for tick in ticks
    )
