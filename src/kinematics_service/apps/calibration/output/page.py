"""A calibration as one page that needs nothing else."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from ....kernel import Floats
from ....page import document, facts, resource, table
from ....robot.file.parts.parameters import TABLE_GROUPS
from ....version import __version__
from ...checking.errors import Errors
from ..identified_table import CalibratedParameter
from ..knowledge import KNOWN
from ..report import cells_of, not_nothing, sentences_of
from ..result import Calibration
from .plots import NARROW, PointPlot

# Rows drawn at most.
MOST = 1000
# The bars of deviations show this many decades below the prior.
DECADES = 3


@dataclass(frozen=True)
class PageOrigin:
    """What the head of the page says: the files, the robot file, the date; remarks on reading."""

    files: tuple[str, ...]
    robot: str
    date: str
    remarks: tuple[str, ...] = ()


def page_of(found: Calibration, origin: PageOrigin) -> str:
    """Return the page as HTML."""
    title = f'Calibration of {found.robot.name}'
    body = [
        f'<h1>{escape(title)}</h1>\n{_header(found, origin)}',
        _verdict(found, origin),
        '<h2>Errors</h2>\n',
        _errors(found),
        _by_pose(found),
        _by_joint(found),
        '<h2>What is known, and how well</h2>\n',
        _parameters(found),
        _directions(found),
        f'<p class="soft">kinematics_service {__version__}.</p>\n',
    ]
    return document(title, body, resource(__package__, 'page.css'))


def _header(found: Calibration, origin: PageOrigin) -> str:
    rows = [
        ('data', escape(', '.join(origin.files))),
        ('', f'{found.count:,} {found.kind}'),
        ('robot file', escape(origin.robot)),
        ('date', escape(origin.date)),
        ('version', f'kinematics_service {__version__}'),
    ]
    return facts(rows)


def _verdict(found: Calibration, origin: PageOrigin) -> str:
    first, *others = (*sentences_of(found), *origin.remarks)
    level = 'ERROR' if not found.accepted else 'WARN' if found.no_better else 'OK'
    items = ''.join(f'<li>{escape(one)}.</li>' for one in others)
    return (
        f'<section class="verdict {level}"><p class="first">{escape(first)}.'
        f'</p><ul>{items}</ul></section>\n'
    )


def _errors(found: Calibration) -> str:
    fitted = found.placed
    named: Sequence[tuple[str, Errors]] = (
        ('as given', found.without.as_given),
        (f'{fitted} fitted alone', found.before),
        ('calibrated', found.after),
        (f'held out, {fitted} fitted alone', found.held_out_before),
        ('held out, calibrated', found.held_out),
    )
    if found.outliers:
        every = found.with_outliers
        named = (
            *named,
            ('calibrated, with those left out', every.after),
            ('held out, calibrated, with those left out', every.held_out),
        )
    headers = [found.kind, 'position rms', 'largest', 'orientation rms', 'largest']
    count = 3 if found.positions else len(headers)
    rows = ([escape(name), *map(not_nothing, one.cells())][:count] for name, one in named)
    return table(headers[:count], rows, range(1, count))


def _rows(found: Calibration) -> Floats:
    return np.unique(np.linspace(0, found.count - 1, MOST).astype(int))


def _series(found: Calibration, rows: Floats, kind: int) -> list[tuple[str, Floats]]:
    scale = np.degrees(1.0) if kind else 1000
    return [
        (style, scale * np.linalg.norm(one[rows, kind], axis=1))
        for style, one in zip(('before', 'after'), found.left[1:3])
    ]


def _by_pose(found: Calibration) -> str:
    rows = _rows(found)
    rings = [k for k, row in enumerate(rows.tolist()) if row in found.outliers]
    row = found.row
    kinds = [('error of the position', 'mm', 0), ('error of the orientation', 'deg', 1)]
    text = ''.join(
        PointPlot(
            f'{title} by {row}',
            unit,
            f'{row}, counted from 0',
            rows.astype(float),
            _series(found, rows, kind),
            rings,
        ).html()
        for title, unit, kind in kinds[: 1 if found.positions else 2]
    )
    if rings:
        text += '<p class="soft">A ring is around each outlier, which is left out.</p>\n'
    return text


def _by_joint(found: Calibration) -> str:
    rows = np.setdiff1d(_rows(found), found.outliers)
    series = _series(found, rows, 0)
    text = []
    for j, name in enumerate(found.robot.joint_names):
        slides = found.robot.prismatic[j]
        x = found.q[rows, j] * (1.0 if slides else math.degrees(1.0))
        unit = 'm' if slides else 'deg'
        text.append(
            PointPlot(name, 'error of the position, mm', unit, x, series, width=NARROW).html()
        )
    return f'<h2>Errors by joint position</h2>\n<div class="joints">{"".join(text)}</div>\n'


def _parameters(found: Calibration) -> str:
    groups = (*TABLE_GROUPS, *dict.fromkeys(one.group for one in found.parameters))
    ordered = sorted(found.parameters, key=lambda one: groups.index(one.group))
    rows = []
    for one in ordered:
        name, *cells = cells_of(one, found)
        rows.append([escape(name), escape(one.group), *map(escape, cells), _bar(one)])
    headers = ['parameter', 'group', 'correction', 'deviation', '', 'prior, deviation, correction']
    legend = (
        '<p class="soft">On a logarithmic axis of a thousand: '
        '<span class="swatch prior"></span>the prior, '
        '<span class="swatch deviation"></span>the standard deviation that is left, '
        '<span class="swatch assumed"></span>the same of what is assumed, '
        '<span class="swatch before"></span>the size of the correction.</p>\n'
    )
    return table(headers, rows, (2, 3)) + legend


def _bar(one: CalibratedParameter) -> str:
    # From the prior, which is where the axis ends, down to a thousandth of it.
    def across(value: float) -> float:
        share = 1.0 + math.log10(max(value / one.prior, 10.0**-DECADES)) / DECADES
        return 200 * min(share, 1.0)

    known = 'deviation' if one.identifiable or one.group not in TABLE_GROUPS else 'assumed'
    x = across(abs(one.correction))
    title = f'{one.name}: prior {one.prior:.3g}, deviation {one.deviation:.3g}'
    return (
        f'<svg class="bar" viewBox="0 0 200 12" preserveAspectRatio="none" role="img" '
        f'aria-label="{escape(title)}"><rect class="prior" width="200" height="12"/>'
        f'<rect class="{known}" y="3" height="6" width="{across(one.deviation):.1f}"/>'
        f'<line class="correction solid" x1="{x:.1f}" x2="{x:.1f}" y1="0" y2="12"/></svg>'
    )


def _directions(found: Calibration) -> str:
    values = np.maximum(found.singular_values, np.finfo(np.float64).tiny)
    plot = PointPlot(
        'how well each combination of the parameters is identified',
        f'singular values in units of the priors; identifiable above {KNOWN:g}',
        'direction, counted from 1',
        np.arange(1.0, len(values) + 1.0),
        [('after', values)],
    )
    return plot.html().replace('></span>after</span>', '></span>direction</span>')
