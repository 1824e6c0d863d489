"""Curves of the tool's velocity along a path; the only place that knows matplotlib."""

import io
from pathlib import Path as File

import numpy as np

from ...errors import DerivationError
from ...output_file import write_file
from ..path import Path

SAMPLES = 1001


def plot_velocity(path: Path, span: tuple[float, float], file: File) -> None:
    """
    Draw v and omega over time with the crossings of the singular set, as a PNG.

    Raises
    ------
    DerivationError
        matplotlib is not installed.
    KinematicsError
        The file cannot be written.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise DerivationError('--plot needs matplotlib: pip install matplotlib') from None
    times = np.linspace(*span, SAMPLES)
    unit = path.derivation.robot.description.length_unit
    figure = Figure(figsize=(9, 6), layout='constrained')
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, sharex=True)
    for axes, vector, label in (
        (upper, path.v, f'linear velocity ({unit}/s)'),
        (lower, path.omega, 'angular velocity (rad/s)'),
    ):
        for k, name in enumerate('xyz'):
            axes.plot(times, path.sampled(vector[k], times), label=name)
        for crossing in path.crossings(*span):
            axes.axvline(crossing.time, color='0.6', linewidth=0.8, linestyle='--')
        axes.set_ylabel(label)
        axes.legend(loc='upper right')
    lower.set_xlabel('time (s)')
    content = io.BytesIO()
    figure.savefig(content, dpi=120, format='png')
    write_file(file, content.getvalue())
