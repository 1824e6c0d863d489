# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Reduce curves over time to the points that a drawing can show. In each column of the drawing, a
curve keeps its extreme values.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from ....kernel import Floats
from ..readers.block import Flags

# Width of a drawing in units of the SVG.
WIDTH = 1000
# Number of columns of a drawing. A column shows the least and the largest value in its interval of
# time.
COLUMNS = 800
# If the number of points in memory exceeds this while a curve is built, only the points that
# change the drawing are kept.
MAX_HELD_POINTS = 2**20


class Curve(NamedTuple):
    """
    A curve of a chart, with its name, its CSS class (`c0` to `c5`, or `limit`), and its points.

    Attributes
    ----------
    t : shape (M,), s; values : shape (M,)
        The points; all values are finite.
    begins : shape (M,)
        Whether a new line starts at each point, after an interruption.
    """

    name: str
    style: str
    t: Floats
    values: Floats
    begins: Flags


def across(t: Floats, end: float) -> Floats:
    """Return the horizontal positions of times (s) in a drawing that ends at `end` (s)."""
    return t * (WIDTH / end) if end else np.full(len(t), 0.5 * WIDTH)


def curve_of(
    name: str, style: str, end: float, pieces: Iterable[tuple[Floats, Floats, Flags]]
) -> Curve:
    """
    Join pieces to a curve, and reduce the curve to the points that a drawing can show.

    The curve keeps the first, the least, the largest and the last value in each column of the
    drawing.

    Parameters
    ----------
    end : s
        End of the time axis.
    pieces
        Pieces of the curve: times (s) of points, their values, and whether the curve is
        interrupted before each point.
    """
    drawn: list[tuple[Floats, Floats, np.ndarray]] = []  # type: ignore[type-arg]
    count = held = groups = 0
    for t, values, breaks in pieces:
        known = np.flatnonzero(np.isfinite(values))
        # The drawn curve consists of unconnected polylines. `group` is the number of the polyline
        # of each point. After an interruption or an unknown value, the next polyline begins.
        group = groups + np.cumsum(breaks) + np.cumsum(~np.isfinite(values))
        groups = int(group[-1])
        count, held = count + len(known), held + len(known)
        drawn.append((t[known], values[known], group[known]))
        if held > MAX_HELD_POINTS:
            drawn = [_thinned(end, *_joined(drawn))]
            held = len(drawn[0][0])
    t, values, group = _joined(drawn)
    if count > 4 * COLUMNS:
        t, values, group = _thinned(end, t, values, group)
    return Curve(name, style, t, values, np.diff(group, prepend=-1) != 0)


def _joined(drawn: list[tuple[Any, ...]]) -> tuple[Any, ...]:
    return tuple(np.concatenate(columns) for columns in zip(*drawn))


def _thinned(end: float, t: Floats, values: Floats, group: np.ndarray) -> tuple[Any, ...]:  # type: ignore[type-arg]
    # Returns the points that suffice to draw the curve: in each pixel column of the chart the
    # first, last, lowest and highest point of each polyline. A second call keeps all these points,
    # so new points can be added to a thinned curve, which is then thinned again.
    column = np.minimum(across(t, end) * (COLUMNS / WIDTH), COLUMNS - 1).astype(np.int64)
    edges = np.flatnonzero(np.diff(column, prepend=-1) | (np.diff(group, prepend=-1) != 0))
    low, high = np.minimum.reduceat(values, edges), np.maximum.reduceat(values, edges)
    counts = np.diff(edges, append=len(values))
    # In a pixel column of the chart, a polyline may have its least value at several points. Keep
    # only the first of these points. Do the same for the largest value.
    least = _first_where(values == np.repeat(low, counts), edges)
    largest = _first_where(values == np.repeat(high, counts), edges)
    kept = np.unique(np.concatenate([edges, edges + counts - 1, least, largest]))
    return t[kept], values[kept], group[kept]


def _first_where(flags: Flags, edges: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    at = np.flatnonzero(flags)
    rows: np.ndarray = at[np.searchsorted(at, edges)]  # type: ignore[type-arg]
    return rows
