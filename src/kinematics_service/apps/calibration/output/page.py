# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write a calibration as one HTML page that needs no other files."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from ....kernel import Floats, Integers
from ....page import document, facts, resource, table
from ....robot.file.parts.parameters import TABLE_GROUPS
from ....version import __version__
from ...recordings.audit.report import charts
from ...recordings.audit.report.charts import ValueScale, nice_ticks, shown
from ..checking import not_nothing
from ..identified_table import CalibratedParameter
from ..report import cells_of, sentences_of
from ..result import Calibration

# A plot on the page shows at most this number of measured poses or touches.
MAX_ROWS = 1000
# Sizes of a plot, px: width, width if two plots stand side by side, height.
WIDTH = 720
COLUMN_WIDTH = 440
HEIGHT = 220
# Margins of a plot, px.
LEFT = 64
RIGHT = 12
TOP = 10
BOTTOM = 34
# Largest number of decades of a logarithmic axis.
PLOT_DECADES = 4
# The page shows the standard deviation of a parameter as a bar with a logarithmic scale of this
# number of decades. The scale ends at the prior standard deviation.
DECADES = 3


def page_of(
    result: Calibration, files: Sequence[str], robot: str, date: str, remarks: Sequence[str] = ()
) -> str:
    """
    Return the HTML page of a calibration.

    Parameters
    ----------
    files, robot, date
        Names of the measured files and of the robot file, and the date, for the head of the page.
    remarks
        Sentences on reading the files.
    """
    title = f'Calibration of {result.robot.name}'
    rows = [
        ('data', escape(', '.join(files))),
        ('', f'{result.count:,} {result.kind}'),
        ('robot file', escape(robot)),
        ('date', escape(date)),
        ('version', f'kinematics_service {__version__}'),
    ]
    body = [
        f'<h1>{escape(title)}</h1>\n{facts(rows)}',
        _verdict(result, remarks),
        '<h2>Errors</h2>\n',
        _errors(result),
        _by_pose(result),
        _by_joint(result),
        '<h2>What is known, and how well</h2>\n',
        _parameters(result),
    ]
    return document(title, body, resource(__package__, 'page.css'))


def _verdict(result: Calibration, remarks: Sequence[str]) -> str:
    first, *others = (*sentences_of(result), *remarks)
    level = 'ERROR' if not result.accepted else 'WARN' if result.no_better else 'OK'
    items = ''.join(f'<li>{escape(sentence)}.</li>' for sentence in others)
    return (
        f'<section class="verdict {level}"><p class="first">{escape(first)}.'
        f'</p><ul>{items}</ul></section>\n'
    )


def _errors(result: Calibration) -> str:
    alone = f'{result.placed} fitted alone'
    names = ('as given', alone, 'calibrated', f'held out, {alone}', 'held out, calibrated')
    named = list(zip(names, result.without))
    if result.outliers:
        included = result.with_outliers
        for k, errors in ((2, included.after), (4, included.held_out)):
            named.append((f'{names[k]}, with those left out', errors))
    headers = [result.kind, 'position rms', 'largest', 'orientation rms', 'largest']
    count = 3 if result.positions else len(headers)
    rows = ([escape(name), *map(not_nothing, errors.cells())][:count] for name, errors in named)
    return table(headers[:count], rows, range(1, count))


def _rows(result: Calibration) -> Integers:
    return np.unique(np.linspace(0, result.count - 1, MAX_ROWS).astype(int))


def _series(result: Calibration, rows: Integers, kind: int) -> list[tuple[str, Floats]]:
    sizes = np.linalg.norm(result.left[1:3, rows, kind], axis=2)
    return list(zip(('before', 'after'), sizes * (np.degrees(1.0) if kind else 1000)))


def _by_pose(result: Calibration) -> str:
    rows, row = _rows(result), result.row
    rings, x = np.flatnonzero(np.isin(rows, result.outliers)), rows.astype(float)
    text = ''
    for kind, (name, unit) in enumerate((('position', 'mm'), ('orientation', 'deg'))):
        if kind == 0 or not result.positions:
            title, series = f'error of the {name} by {row}', _series(result, rows, kind)
            text += PointPlot(title, unit, f'{row}, counted from 0', x, series, rings).html()
    if len(rings):
        text += '<p class="soft">A ring is around each outlier, which is left out.</p>\n'
    return text


def _by_joint(result: Calibration) -> str:
    rows = np.setdiff1d(_rows(result), result.outliers)
    series, title = _series(result, rows, 0), 'error of the position, mm'
    text = ''
    for name, slides, q in zip(result.robot.joint_names, result.robot.prismatic, result.q[rows].T):
        unit, x = ('m', q) if slides else ('deg', np.degrees(q))
        text += PointPlot(name, title, unit, x, series, width=COLUMN_WIDTH).html()
    return f'<h2>Errors by joint position</h2>\n<div class="joints">{text}</div>\n'


def _parameters(result: Calibration) -> str:
    groups = (*TABLE_GROUPS, *dict.fromkeys(parameter.group for parameter in result.parameters))
    rows = []
    for parameter in sorted(result.parameters, key=lambda entry: groups.index(entry.group)):
        name, *cells = cells_of(parameter, result)
        rows.append([escape(name), escape(parameter.group), *map(escape, cells), _bar(parameter)])
    headers = ['parameter', 'group', 'correction', 'deviation', '', 'prior, deviation, correction']
    legend = (
        '<p class="soft">On a logarithmic axis of a thousand: '
        '<span class="swatch prior"></span>the prior, '
        '<span class="swatch deviation"></span>the standard deviation that is left, '
        '<span class="swatch assumed"></span>the same of what is assumed, '
        '<span class="swatch before"></span>the size of the correction.</p>\n'
    )
    return table(headers, rows, (2, 3)) + legend


def _bar(entry: CalibratedParameter) -> str:
    # Return an SVG drawing of a parameter: a bar for its standard deviation and a line for its
    # correction. The logarithmic axis goes from a thousandth of the prior standard deviation to
    # the prior standard deviation.
    def across(value: float) -> float:
        fraction = 1.0 + math.log10(max(value / entry.prior, 10.0**-DECADES)) / DECADES
        return 200 * min(fraction, 1.0)

    known = 'deviation' if entry.identifiable or entry.group not in TABLE_GROUPS else 'assumed'
    x = across(abs(entry.correction))
    title = f'{entry.name}: prior {entry.prior:.3g}, deviation {entry.deviation:.3g}'
    return (
        f'<svg class="bar" viewBox="0 0 200 12" preserveAspectRatio="none" role="img" '
        f'aria-label="{escape(title)}"><rect class="prior" width="200" height="12"/>'
        f'<rect class="{known}" y="3" height="6" width="{across(entry.deviation):.1f}"/>'
        f'<line class="correction solid" x1="{x:.1f}" x2="{x:.1f}" y1="0" y2="12"/></svg>'
    )


@dataclass(frozen=True, eq=False)
class PointPlot:
    """
    A plot of points with a linear horizontal axis and a logarithmic vertical axis.

    Attributes
    ----------
    title, unit, across
        The quantity, its unit, and the quantity of the horizontal axis.
    x : shape (N,)
        Values of the horizontal axis.
    series
        Pairs of a style (`before`, `after`) and its values (N,) of the vertical axis.
    rings : shape (M,)
        Indices of the outliers among the N points; a ring is drawn around each outlier.
    width
        Width of the drawing; a narrow drawing has larger texts.
    """

    title: str
    unit: str
    across: str
    x: Floats
    series: Sequence[tuple[str, Floats]]
    rings: Sequence[int] | Integers = ()
    width: int = WIDTH

    def html(self) -> str:
        """Return the plot as an HTML figure."""
        values = np.concatenate([y for _, y in self.series])
        high, least = float(np.max(values)) or 1.0, float(np.min(values))
        up = ValueScale(0.5 * max(least, high * 10.0**-PLOT_DECADES), 2.0 * high, log=True)
        begin, end = float(np.min(self.x)), float(np.max(self.x))
        room = (end - begin) / 50 or 0.5
        along = ValueScale(begin - room, end + room, log=False)

        def columns(x: Floats) -> list[float]:
            fraction = 1.0 - along.at_all(x) / charts.HEIGHT
            return list((LEFT + (self.width - LEFT - RIGHT) * fraction).tolist())

        def rows(y: Floats) -> list[float]:
            return list((TOP + (HEIGHT - BOTTOM - TOP) * up.at_all(y) / charts.HEIGHT).tolist())

        right, ticks, marks = self.width - RIGHT, up.ticks(), nice_ticks(along.low, along.high, 8)
        parts = [
            f'<line class="grid" x1="{LEFT}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}"/>'
            f'<text class="end" x="{LEFT - 6}" y="{y + 4:.1f}">{shown(tick)}</text>'
            for tick, y in zip(ticks, rows(np.array(ticks)))
        ]
        parts += [
            f'<text class="middle" x="{x:.1f}" y="{HEIGHT - 18}">{shown(tick)}</text>'
            for tick, x in zip(marks, columns(np.array(marks)))
        ]
        rings, first = np.array(self.rings, dtype=np.int64), self.series[0][1]
        circles = [(style, 2.4, self.x, y) for style, y in self.series]
        for style, radius, x_of, y_of in [*circles, ('outlier', 5, self.x[rings], first[rings])]:
            parts += [
                f'<circle class="{style}" cx="{x:.1f}" cy="{y:.1f}" r="{radius}"/>'
                for x, y in zip(columns(x_of), rows(y_of))
            ]
        keys = ''.join(
            f'<span class="key"><span class="swatch {style}"></span>{style}</span>'
            for style, _ in self.series
        )
        below = '; points on the lower edge are below it' if least < up.low else ''
        title = escape(self.title)
        return (
            f'<figure><figcaption><b>{title}</b>, {escape(self.unit)}{below}{keys}</figcaption>'
            f'<div class="wide"><svg class="drawing" viewBox="0 0 {self.width} {HEIGHT}" '
            f'role="img" aria-label="{title}">{"".join(parts)}<text class="end" x="{right}" '
            f'y="{HEIGHT - 3}">{escape(self.across)}</text></svg></div></figure>\n'
        )
