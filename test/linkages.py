# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Closed forms of linkages, by the law of cosines: plane geometry, no kinematics of ours."""

import math

# A five-bar whose elbows come too far apart for its rods.
SHORT_FIVE_BAR = """
robot: short_five_bar
convention: standard
constants: {D: 0.3, proximal: 0.25, distal: 0.3}
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
links:
  - {alpha: 0, a: proximal, d: 0, theta: q1}
  - {alpha: 0, a: distal,   d: 0, theta: psi1}
loops:
  - name: rods
    passive: [psi1, psi2]
    from: {row: 0, xyz: [D, 0, 0]}
    links:
      - {alpha: 0, a: proximal, d: 0, theta: q2}
      - {alpha: 0, a: distal,   d: 0, theta: psi2}
    meets: {row: 2}
    rows: [x, y]
    assembled: {q: [pi/2, pi/2], psi1: -pi/6, psi2: pi/6}
"""


def meeting_point(center, radius, other, other_radius, side):
    """
    Return where two circles meet, seen from the first center on the left (1) or right (-1).
    """
    x, y = other[0] - center[0], other[1] - center[1]
    away = math.hypot(x, y)
    along = (away**2 + radius**2 - other_radius**2) / (2 * away)
    across = side * math.sqrt(radius**2 - along**2)
    return (
        center[0] + (along * x - across * y) / away,
        center[1] + (along * y + across * x) / away,
    )


def direction(start, end):
    """Return the angle of the way from a point to another."""
    return math.atan2(end[1] - start[1], end[0] - start[0])


def five_bar(q, D=0.3, proximal=0.25, distal=0.4):
    """Return the tip of a planar five-bar, elbows outwards, and the direction of its left rod."""
    left = (proximal * math.cos(q[0]), proximal * math.sin(q[0]))
    right = (D + proximal * math.cos(q[1]), proximal * math.sin(q[1]))
    tip = meeting_point(left, distal, right, distal, 1)
    return tip, direction(left, tip)


def crank_slider(q, crank=0.05, rod=0.15):
    """Return how far the slider is from the axis of the crank."""
    return crank * math.cos(q) + math.sqrt(rod**2 - (crank * math.sin(q)) ** 2)


EXCAVATOR = {
    'boom': 5.7,
    'stick': 2.9,
    'bucket': 1.5,
    'boom_pivot': (0.3, 1.9),
    'boom_base': (0.6, -0.7),
    'boom_rod': (2.5, 0.9),
    'stick_base': (2.7, 1.1),
    'stick_rod': (-0.7, 0.3),
    'bucket_base': (0.2, 0.75),
    'rocker_pivot': (2.45, 0.05),
    'rocker': 0.6,
    'coupler': 0.58,
    'bucket_pin': (-0.1, 0.42),
}


def excavator(q, sizes=EXCAVATOR):
    """
    Return position and pitch (upwards) of the bucket's tip, and the angles of boom, stick, bucket.

    Each cylinder turns its body by the angle between two sides of a triangle.
    """
    swing, boom_length, stick_length, bucket_length = q
    boom = _turned(sizes['boom_base'], sizes['boom_rod'], boom_length, 1)
    begin, rod = sizes['stick_base'], sizes['stick_rod']
    begin = (begin[0] - sizes['boom'], begin[1])
    stick = _turned(begin, rod, stick_length, -1)
    pivot, base = sizes['rocker_pivot'], sizes['bucket_base']
    end = meeting_point(base, bucket_length, pivot, sizes['rocker'], 1)
    hinge = (sizes['stick'], 0.0)
    pin = meeting_point(end, sizes['coupler'], hinge, math.hypot(*sizes['bucket_pin']), 1)
    bucket = direction(hinge, pin) - math.atan2(sizes['bucket_pin'][1], sizes['bucket_pin'][0])
    pitch = boom + stick + bucket
    x = sizes['boom_pivot'][0] + sizes['boom'] * math.cos(boom)
    z = sizes['boom_pivot'][1] + sizes['boom'] * math.sin(boom)
    x += sizes['stick'] * math.cos(boom + stick) + sizes['bucket'] * math.cos(pitch)
    z += sizes['stick'] * math.sin(boom + stick) + sizes['bucket'] * math.sin(pitch)
    return (x * math.cos(swing), x * math.sin(swing), z), pitch, (boom, stick, bucket)


def _turned(base, rod, length, side):
    # A body turns about the origin; its point `rod` is `length` away from `base`.
    near, far = math.hypot(*base), math.hypot(*rod)
    cosine = (near**2 + far**2 - length**2) / (2 * near * far)
    return math.atan2(base[1], base[0]) + side * math.acos(cosine) - math.atan2(rod[1], rod[0])
