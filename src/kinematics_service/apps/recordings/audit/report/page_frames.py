# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the section of the audit page that compares tool poses of a second source with computed
poses.
"""

from html import escape

import numpy as np

from .....kernel import Floats
from .....page import table
from .....rigid_motion import roll_pitch_yaw
from ..auditing import Audit
from ..frames import FrameReport, NotCompared
from .page_charts import frame_charts


def frame_section(audit: Audit) -> str:
    """
    Return the HTML section that compares measured with computed poses; empty without measured
    poses.
    """
    report = audit.frames
    if report is None:
        return ''
    if isinstance(report, NotCompared):
        return (
            f'<h2>Frames: poses of {escape(report.name)}</h2>\n'
            f'<p>Not compared: {escape(report.reason)}.</p>\n'
        )
    diagnosis = report.diagnosis
    frame = f' in {escape(report.frame)}' if report.frame else ''
    causes = diagnosis.causes or diagnosis.likely
    errors = {
        'as they are': diagnosis.as_given,
        'with a constant base and tool offset': diagnosis.errors,
        **{f'and undone: {cause.sentence}': cause.errors for cause in causes},
    }
    rows = ([escape(name), *error.cells()] for name, error in errors.items())
    headers = ('poses apart', 'position rms', 'largest', 'orientation rms', 'largest')
    # If the check found the cause of the pose differences, show the base and tool offsets that
    # were fitted after the cause was corrected. Offsets fitted without this correction are wrong.
    best = diagnosis.cause or diagnosis
    undone = ', that undone' if diagnosis.cause else ''
    offsets = [
        _offset('base offset (the table&#39;s base in the frame of the source)', best.base_offset),
        _offset('tool offset (the source&#39;s tool in that of the table)', best.tool_offset),
    ]
    free = escape('; '.join(diagnosis.undetermined))
    free = f'<p>Not determined by these poses: {free}.</p>\n' if free else ''
    return (
        f'<h2>Frames: poses of {escape(report.name)}{frame}</h2>\n'
        f'<p>{escape(report.sentence)}.</p>\n'
        f'{_notes(report)}'
        + table(headers, rows, (1, 2, 3, 4))
        + table([f'offset{undone}', 'x y z, mm', 'roll pitch yaw, &deg;'], offsets, (1, 2))
        + free
        + frame_charts(audit, report)
    )


def _notes(report: FrameReport) -> str:
    # Returns the number of compared poses, the limits of the pose differences, and remarks on
    # implausible poses, as HTML.
    limits = report.limits
    compared = f'{report.diagnosis.count:,} of {report.poses:,} poses are compared.'
    unmatched = f' {escape(report.unmatched)}.' if report.unmatched else ''
    judged = (
        f' A remainder (rms) is a warning from {limits.warn.in_words()} on, and bad from '
        f'{limits.bad.in_words()} on, or where its cause is named.'
    )
    doubts = ''.join(f'<p>{escape(doubt)}.</p>\n' for doubt in report.doubts)
    return f'<p class="soft">{compared}{unmatched}{judged}</p>\n{doubts}'


def _offset(name: str, T: Floats) -> list[str]:
    def row(values: Floats) -> str:
        return ' &nbsp; '.join(f'{value + 0.0:.2f}' for value in np.round(values, 2))

    return [name, row(1e3 * T[:3, 3]), row(np.degrees(roll_pitch_yaw(T[:3, :3])))]
