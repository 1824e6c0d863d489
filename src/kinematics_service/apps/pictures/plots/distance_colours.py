# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Draw distances to a singular pose as colours; distances of at least 1 rad have a separate colour.
"""

from typing import NamedTuple

import numpy as np

from ....kernel import Floats
from ....robot.measures import MEASURES
from .artists import Artist, Axes, Figure
from .picture import with_unit

DISTANCE = MEASURES['distance']
# Colour of distances of at least 1 rad; it differs from the background and from the colour scale.
FARTHER = '#D9E6EE'


class ColourScale(NamedTuple):
    """
    The lower and upper limit of a colour scale for distances, rad; `open` is True if the picture
    has distances above `high`.
    """

    low: float
    high: float
    open: bool = False


def draw_distances(
    figure: Figure,
    axes: Axes,
    values: Floats,
    extent: tuple[float, float, float, float],
    scale: ColourScale,
    label: str,
) -> list[Artist]:
    """
    Draw distances to a singular pose (rows, columns), rad, with a colour bar; return the legend
    entry for distances of at least 1 rad, if any.
    """
    from matplotlib import colormaps
    from matplotlib.patches import Patch

    farther = bool(np.any(values >= DISTANCE.most))
    high = DISTANCE.most if farther else scale.high
    image = axes.imshow(
        np.ma.masked_invalid(values), origin='lower', extent=extent, interpolation='nearest',
        cmap=colormaps['cividis'].with_extremes(over=FARTHER) if farther else 'cividis',
        vmin=scale.low, vmax=np.nextafter(high, 0.0) if farther else high,
    )  # fmt: skip
    extend = 'max' if farther or scale.open else 'neither'
    bar = figure.colorbar(image, cax=axes.inset_axes((1.03, 0.0, 0.045, 1.0)), extend=extend)
    bar.set_label(with_unit(label, 'rad'))
    if not farther:
        return []
    label = DISTANCE.farther(DISTANCE.most)
    return [Patch(facecolor=FARTHER, edgecolor='black', linewidth=0.5, label=label)]
