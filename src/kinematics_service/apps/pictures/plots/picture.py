# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Set the style of pictures, and write them to a file or show them in a window."""

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ....errors import KinematicsError, PlotError
from ....output_file import write_file
from ....printing import plain
from .artists import Figure

# Colours that people with any colour vision can tell apart: M. Okabe, K. Ito, Color Universal
# Design, 2008.
BLACK, ORANGE, SKY, GREEN = '#000000', '#E69F00', '#56B4E9', '#009E73'
YELLOW, BLUE, VERMILION, PURPLE = '#F0E442', '#0072B2', '#D55E00', '#CC79A7'
GREY, LIGHT = '#606060', '#C8C8C8'
# Colours of x, y and z of a frame, as in other viewers of robots.
AXIS_COLORS = ('#D7191C', '#2CA02C', '#1F5FD7')
SERIES = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)
# A line style of matplotlib: a sign such as `--`, or an offset with the lengths of dashes and
# gaps.
Dashes = str | tuple[float, tuple[float, ...]]
DASHES: tuple[Dashes, ...] = ('-', '--', '-.', ':', (0, (6, *5 * [1.5])), (0, (3, 1)), '-')

# Settings that differ from matplotlib's default style. The font stays DejaVu Sans, because it
# comes with matplotlib.
STYLE = {
    'figure.titlesize': 10.5,
    'legend.fontsize': 9.0,
    'axes.grid': True,
    'grid.color': '#DDDDDD',
    'axes.axisbelow': True,
    'axes.spines.top': False,
    'axes.spines.right': False,
    'lines.solid_capstyle': 'round',
    'savefig.dpi': 120,
    # Use a constant instead of a random salt, so that the same picture gives the same bytes.
    'svg.hashsalt': 'kinematics_service',
}
# Metadata of a picture file by its suffix, without a date, so that the same picture gives the same
# bytes.
METADATA: dict[str, dict[str, str | None]] = {
    '.png': {'Software': 'kinematics_service'},
    '.svg': {'Date': None, 'Creator': 'kinematics_service'},
    '.pdf': {'CreationDate': None, 'Creator': 'kinematics_service'},
}
INSTALL = "pip install '.[plot]' in its checkout, or pip install matplotlib"

Draw = Callable[[Figure], None]


def suffix_of(file: Path, other: str = '') -> str:
    """
    Return the suffix of a picture file; if the suffix is not `.png`, `.svg` or `.pdf`, return
    `other`.

    Raises
    ------
    PlotError
        The suffix is not `.png`, `.svg` or `.pdf`, and `other` is empty.
    """
    suffix = file.suffix.lower()
    if suffix in METADATA:
        return suffix
    if other:
        return other
    given = f'a picture cannot have the suffix {suffix!r}' if suffix else 'the suffix is missing'
    raise PlotError(f'{file}: {given}; write {", ".join(METADATA)}', code='unsupported')


def refuse_without_matplotlib() -> None:
    """
    Raise an error that says how to install matplotlib if it is missing.

    Raises
    ------
    PlotError
        matplotlib cannot be imported.
    """
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError as error:
        message = f'pictures need matplotlib ({error}): {INSTALL}'
        raise PlotError(message, code='missing-package') from None


@contextmanager
def drawing() -> Iterator[None]:
    """Use the style of pictures inside the `with` block, instead of the user's settings."""
    import matplotlib

    with matplotlib.rc_context():
        backend = matplotlib.rcParams['backend']
        matplotlib.rcdefaults()
        matplotlib.rcParams.update({**STYLE, 'backend': backend})
        yield


def drawn(draw: Draw) -> Figure:
    """Return a new figure without a window, filled by the function `draw`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with drawing():
        figure = Figure()
        FigureCanvasAgg(figure)
        draw(figure)
    return figure


def save_picture(draw: Draw, file: Path, other: str = '') -> None:
    """
    Write a picture to a file as PNG, SVG or PDF; the file's suffix chooses the format.

    After an error no partial file is left.

    Parameters
    ----------
    draw
        Function that draws into an empty figure and sets the figure's size.
    file
        The file to write; an existing file is replaced when the new one is complete.
    other
        The suffix to use if the file's own suffix is not that of a picture, for example for a
        pipe.

    Raises
    ------
    PlotError
        matplotlib is missing, the suffix is unknown, or the file cannot be written.
    """
    suffix = suffix_of(file, other)
    refuse_without_matplotlib()
    figure = drawn(draw)
    content = io.BytesIO()
    with drawing():
        figure.savefig(content, format=suffix[1:], metadata=METADATA[suffix])
    try:
        write_file(file, content.getvalue())
    except KinematicsError as error:
        raise PlotError(str(error), code=error.code) from None


def show_picture(draw: Draw, title: str) -> None:
    """
    Show a picture in a window, and return when the window is closed.

    Raises
    ------
    PlotError
        matplotlib or a display is missing.
    """
    refuse_without_matplotlib()
    import matplotlib
    from matplotlib import pyplot

    nowhere = '--show: no window can be opened here ({}); write a file with --save FILE'
    with drawing():
        try:
            figure = pyplot.figure()
        except Exception as error:
            # Catch all errors, because each toolkit has its own errors for a missing display.
            reason = ' '.join(str(error).split()) or type(error).__name__
            raise PlotError(nowhere.format(reason), code='no-display') from None
        backend = matplotlib.get_backend()
        if backend.lower() in ('agg', 'pdf', 'svg', 'ps', 'cairo', 'template'):
            pyplot.close(figure)
            reason = f"no display, or no toolkit; matplotlib's {backend}"
            raise PlotError(nowhere.format(reason), code='no-display')
        draw(figure)
        figure.canvas.manager.set_window_title(title)
        pyplot.show()


def with_unit(quantity: str, unit: str) -> str:
    """Return the label of a quantity: `time (s)`, or `condition number` without a unit."""
    return f'{quantity} ({unit})' if unit else quantity


def words(text: str) -> str:
    """
    Return a text of the user in a form that matplotlib shows literally, without formulas and
    control characters.
    """
    return plain(text).replace('$', r'\$')
