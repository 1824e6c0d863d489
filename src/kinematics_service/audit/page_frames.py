"""
What the audit page says of a second source of poses.

"""

from html import escape

import numpy as np

from ..frame_doctor.errors import in_degrees, in_mm
from ..kernel import Floats
from ..rigid_motion import roll_pitch_yaw
from .auditing import Audit
from .page_charts import frame_charts
from .page_table import table


def frame_section(audit: Audit) -> str:
    """
    Return the section, empty where there is no second source.

    """
    report = audit.frames
    if report is None:
        return ''
    diagnosis = report.diagnosis
    frame = f' in {escape(report.frame)}' if report.frame else ''
    rows = [
        _errors('as they are', diagnosis.as_given),
        _errors('with a constant base and tool offset', diagnosis.errors),
    ]
    rows += [_errors(f'and undone: {cause.sentence}', cause.errors) for cause in diagnosis.causes]
    # Offsets mean something only where the cause is undone.
    best = diagnosis.cause or diagnosis
    undone = ', that undone' if diagnosis.cause else ''
    offsets = [
        _offset('base offset (the table&#39;s base in the frame of the source)', best.base_offset),
        _offset('tool offset (the source&#39;s tool in that of the table)', best.tool_offset),
    ]
    free = ''
    if diagnosis.undetermined:
        free = (
            f'<p>Not determined by these poses: {escape("; ".join(diagnosis.undetermined))}.</p>\n'
        )
    return (
        f'<h2>Frames: poses of {escape(report.name)}{frame}</h2>\n'
        f'<p>{escape(diagnosis.sentence)}.</p>\n'
        f'<p class="soft">{report.matched:,} of {report.poses:,} poses have joint positions at '
        'their time.</p>\n'
        + table(
            ['poses apart', 'position rms', 'largest', 'orientation rms', 'largest'],
            rows,
            (1, 2, 3, 4),
        )
        + table([f'offset{undone}', 'x y z, mm', 'roll pitch yaw, &deg;'], offsets, (1, 2))
        + free
        + frame_charts(audit, report)
    )


def _errors(name: str, errors: tuple[float, float, float, float]) -> list[str]:
    p_rms, p_max, r_rms, r_max = errors
    return [
        escape(name),
        in_mm(p_rms),
        in_mm(p_max),
        in_degrees(r_rms),
        in_degrees(r_max),
    ]


def _offset(name: str, T: Floats) -> list[str]:
    def row(values: Floats) -> str:
        return ' &nbsp; '.join(f'{value + 0.0:.2f}' for value in np.round(values, 2))

    return [name, row(1e3 * T[:3, 3]), row(np.degrees(roll_pitch_yaw(T[:3, :3])))]
