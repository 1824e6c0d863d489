# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the panel beside the picture as HTML: gauges, tool, measures, Jacobian and limits.

All text from a robot file or a message is escaped.
"""

import math
from html import escape

import numpy as np

from ....estimation.status_text import (
    direction_in_words,
    flat_position,
    joints_in_words,
    structure_in_words,
)
from ....kernel import Floats
from ....kinematics.singularity import flat_loop
from ....node.drawing.observation import Observation
from ....node.drawing.scene import LEVEL_COLOURS, Scene, short_names
from ....rigid_motion import roll_pitch_yaw
from ....robot.measures import MEASURES, Level
from ....robot.task import TWIST_ROWS
from .gauges import Gauge, JointReading, gauges_of, headline, joint_readings

# Colour of text on a background in the colour of each level.
INK = {Level.OK: '#fff', Level.WARN: '#000', Level.ERROR: '#fff', Level.STALE: '#fff'}
# Symbols of the levels (OK, WARN, ERROR, STALE), for readers who cannot see the colours, and for
# print.
SIGNS = {Level.OK: '●', Level.WARN: '▲', Level.ERROR: '■', Level.STALE: '○'}

# CSS of the panel. On a narrow screen viser's panel would cover the picture, so the last rules of
# this style limit the height of the panel.
STYLE = """<style>
.kin{font-size:12px;line-height:1.35;padding:2px 10px 4px 8px}
.kin table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
.kin td,.kin th{padding:0 3px;text-align:right;font-weight:400}
.kin th{opacity:.75;overflow-wrap:anywhere;vertical-align:bottom}
.kin td:first-child,.kin th:first-child{text-align:left}
.kin .num{font-family:ui-monospace,monospace;font-size:11px}
.kin .head{font-weight:700;font-size:14px;padding:5px 8px;border-radius:4px;margin:2px 0}
#kin-title{font-weight:700;overflow-wrap:anywhere}
.kin .bar{position:relative;height:9px;border-radius:3px;background:#8884;margin:1px 0 15px}
.kin .bar.low{margin-bottom:3px;height:6px}
.kin .fill{height:100%;min-width:4px;border-radius:3px}
.kin .mark{position:absolute;top:-2px;bottom:-2px;border-left:2px solid currentColor}
.kin .mark span{position:absolute;top:12px;left:-6px;font-size:9px;opacity:.8;
white-space:nowrap}
.kin .pin{position:absolute;top:-3px;width:4px;height:12px;margin-left:-2px;border-radius:2px}
.kin .pair{display:flex;justify-content:space-between;gap:8px}
@media (max-width:36em){
.mantine-Paper-root:has(#kin-gauges){max-height:34vh!important;width:100%!important}
.mantine-Paper-root:has(#kin-gauges) .mantine-ScrollArea-content>*{width:100%!important}
}
</style>"""


def colour(level: Level) -> str:
    """Return the colour of a level for CSS."""
    return '#{:02x}{:02x}{:02x}'.format(*LEVEL_COLOURS[level])


def _box(name: str, content: str) -> str:
    return f'<div class="kin" id="kin-{name}">{content}</div>'


def gauges_html(seen: Observation, title: str, status: str) -> str:
    """
    Return HTML with the title, the headline (the singularity status), the status line and the
    gauges.
    """
    level = seen.level
    head = (
        f'<div id="kin-title">{escape(title)}</div>'
        f'<div class="head" data-level="{level.name}" '
        f'style="background:{colour(level)};color:{INK[level]}">'
        f'{SIGNS[level]} {escape(headline(seen))}</div>'
        f'<div id="kin-status">{escape(status)}</div>'
    )
    return STYLE + _box('gauges', head + ''.join(map(_gauge, gauges_of(seen))))


def _gauge(gauge: Gauge) -> str:
    marks = ''.join(
        f'<div class="mark" style="left:{100 * place:.1f}%"><span>{escape(name)}</span></div>'
        for place, name in gauge.marks
    )
    return (
        f'<div class="pair"><span>{escape(gauge.title)}</span>'
        f'<b data-gauge="{gauge.name}">{escape(gauge.text)}</b></div>'
        f'<div class="bar" data-gauge-level="{gauge.level.name}" '
        f'style="background:{colour(gauge.level)}44"><div class="fill" '
        f'style="width:{100 * gauge.fraction:.1f}%;background:{colour(gauge.level)}"></div>'
        f'{marks}</div>'
    )


def facts_html(seen: Observation, scene: Scene) -> str:
    """Return an HTML table of the tool's pose and velocity, and of the measures of singularity."""
    robot, s = seen.robot, seen.singularity
    position = seen.pose[:3, 3]
    angles = np.degrees(roll_pitch_yaw(seen.pose[:3, :3]))
    rows = [
        ('position x y z', f'{_numbers(position)} m', 'position'),
        ('roll pitch yaw', f'{_numbers(angles, 1)} °', 'rpy'),
    ]
    if seen.twist is None:
        rows.append(('velocity', 'unknown', 'velocity'))
    else:
        rows.append(('velocity vx vy vz', f'{_numbers(seen.twist[:3])} m/s', 'velocity'))
        rows.append(('angular wx wy wz', f'{_numbers(seen.twist[3:])} rad/s', 'angular'))
    for measure in MEASURES.values():
        value = getattr(s, measure.name)
        # Leave out the distance to singularity, because it has a gauge.
        if value is not None and measure.name != 'distance':
            rows.append((measure.short or measure.words, _value(value), measure.name))
    rows += [
        ('ellipsoid radii v', _numbers(scene.linear.radii), 'radii-v'),
        ('ellipsoid radii w', _numbers(scene.angular.radii), 'radii-w'),
    ]
    if seen.level in (Level.WARN, Level.ERROR):
        if loop := flat_loop(robot, s):
            rows.append(('near', flat_position(loop), 'lost'))
        else:
            rows += [
                ('lost', direction_in_words(s.lost_direction), 'lost'),
                ('joints opposed', joints_in_words(robot.joint_names, s.joint_motion), 'opposed'),
            ]
    if robot.singularity.task.structurally_deficient:
        rows.append(('always', structure_in_words(robot), 'always'))
    body = ''.join(
        f'<tr><td style="white-space:nowrap">{escape(label)}</td>'
        f'<td class="num" data-fact="{name}">{escape(text)}</td></tr>'
        for label, text, name in rows
    )
    return _box('facts', f'<table>{body}</table>')


def _value(value: float) -> str:
    return f'{value:.4g}' if math.isfinite(value) and value < 1e9 else 'infinite'


def jacobian_html(seen: Observation) -> str:
    """Return J as an HTML table: rows vx to wz, and a column for each joint."""
    names = short_names(seen.robot.joint_names)
    broken = (escape(name).replace('_', '_<wbr>') for name in names)
    head = ''.join(f'<th>{name}</th>' for name in broken)
    body = ''.join(
        f'<tr><td>{label}</td>'
        + ''.join(f'<td class="num">{_number(float(value))}</td>' for value in row)
        + '</tr>'
        for label, row in zip(TWIST_ROWS, seen.jacobian)
    )
    per = 'rad (m for sliding joints)' if np.any(seen.robot.prismatic) else 'rad'
    return _box(
        'jacobian',
        f'<table><tr><th></th>{head}</tr>{body}</table>'
        f'<div style="opacity:.75">base axes, at the tool; m and rad per {per}</div>',
    )


def joints_html(seen: Observation) -> str:
    """Return HTML with the position of each joint between its limits."""
    return _box('joints', ''.join(map(_joint, joint_readings(seen))))


def _joint(joint: JointReading) -> str:
    remark = f' {SIGNS[joint.level]} {joint.remark}' if joint.remark else ''
    if joint.fraction is not None:
        pin = (
            f'<div class="bar low"><div class="pin" style="left:{100 * joint.fraction:.1f}%;'
            f'background:{colour(joint.level)}"></div></div>'
        )
    else:
        pin = '<div style="opacity:.6">no limits</div>'
    return (
        f'<div class="pair"><span>{escape(joint.name)}<b style="color:{colour(joint.level)}">'
        f'{escape(remark)}</b></span><span class="num">{escape(joint.text)}</span></div>{pin}'
    )


def _number(value: float, decimals: int = 3) -> str:
    if abs(value) >= 1000.0:
        return f'{value:.2e}'
    return f'{round(value, decimals) + 0.0:.{decimals}f}'.replace('-', '\N{MINUS SIGN}')


def _numbers(values: Floats, decimals: int = 3) -> str:
    return '  '.join(_number(float(value), decimals) for value in values)
