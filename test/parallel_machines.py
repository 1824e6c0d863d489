# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Parallel machines: joints from the platform's pose in closed form, and their velocity equation.

Each arm is a rod of fixed or driven length from a point that a motor moves to one of the platform;
along it both have the same velocity. That gives J without any passive joint.
"""

import math

import linkages
import numpy as np

DELTA = {'base': 0.567 * math.sqrt(3) / 6, 'platform': 0.076 / math.sqrt(3)}
DELTA |= {'arm': 0.524, 'rod': 1.244}
DELTA_DIRECTIONS = np.radians((-90.0, 30.0, 150.0))


def delta_joints(position, sizes=DELTA):
    """Return the joints (3,) of a delta, elbows outwards, from where its platform is (3,)."""
    x, y, z = position
    joints = []
    for angle in DELTA_DIRECTIONS:
        # In the plane of the arm the rod is as long as what it leaves across it.
        along = x * math.cos(angle) + y * math.sin(angle) + sizes['platform'] - sizes['base']
        across = y * math.cos(angle) - x * math.sin(angle)
        rod = math.sqrt(sizes['rod'] ** 2 - across**2)
        elbow = linkages.meeting_point((0.0, 0.0), sizes['arm'], (along, z), rod, 1)
        joints.append(-linkages.direction((0.0, 0.0), elbow))
    return np.array(joints)


def delta_jacobian(position, q, sizes=DELTA):
    """Return d position / d q (3, 3) of a delta: along each rod both of its ends are as fast."""
    outward = np.stack([np.cos(DELTA_DIRECTIONS), np.sin(DELTA_DIRECTIONS)], axis=1)
    outward = np.column_stack([outward, np.zeros(3)])
    up = np.array([0.0, 0.0, 1.0])
    cosines, sines = np.cos(q)[:, None], np.sin(q)[:, None]
    elbows = sizes['base'] * outward + sizes['arm'] * (cosines * outward - sines * up)
    rods = position + sizes['platform'] * outward - elbows
    turning = sizes['arm'] * (-sines * outward - cosines * up)
    return np.linalg.solve(rods, np.diag(np.sum(rods * turning, axis=1)))


def delta_position(q, sizes=DELTA):
    """
    Return where the platform (3,) is, below the plane of its elbows: where three spheres meet.
    """
    outward = np.stack([np.cos(DELTA_DIRECTIONS), np.sin(DELTA_DIRECTIONS)], axis=1)
    away = sizes['base'] - sizes['platform'] + sizes['arm'] * np.cos(q)
    centers = np.column_stack([away[:, None] * outward, -sizes['arm'] * np.sin(q)])
    a, b = centers[1] - centers[0], centers[2] - centers[0]
    shares = np.linalg.solve([[a @ a, a @ b], [a @ b, b @ b]], [0.5 * a @ a, 0.5 * b @ b])
    middle = shares[0] * a + shares[1] * b
    normal = np.cross(a, b)
    normal /= np.linalg.norm(normal)
    return centers[0] + middle - math.sqrt(sizes['rod'] ** 2 - middle @ middle) * normal


PLANAR_BASES = np.array([[0.0, 0.0], [0.5, 0.0], [0.25, 0.433]])
PLANAR_CORNERS = np.array([[-0.05, -0.03], [0.05, -0.03], [0.0, 0.06]])
PLANAR_RODS = (0.2, 0.18)
PLANAR_MIDDLE = np.array([1.4, -2.8, -0.7])  # of the joints, nearly
# Three arms of two rods each, with motors in their bases. The table goes over the first of them to
# the platform; the loops over the others need the elbow of the first and the platform's angle.
PLANAR = """
robot: planar_3rrr
convention: elementary
constants: {a: 0.2, b: 0.18}
joints:
  - {name: left, variable: q1, type: revolute, limits: [Q1 - 0.7, Q1 + 0.7]}
  - {name: right, variable: q2, type: revolute, limits: [Q2 - 0.7, Q2 + 0.7]}
  - {name: top, variable: q3, type: revolute, limits: [Q3 - 0.7, Q3 + 0.7]}
links: [Rz(q1), Tx(a), Rz(elbow1), Tx(b), Rz(platform), Tx(0.05), Ty(0.03)]
loops:
  - name: right_arm
    passive: [elbow1, elbow2]
    from: {row: 0, xyz: [0.5, 0, 0]}
    links: [Rz(q2), Tx(a), Rz(elbow2), Tx(b)]
    meets: {row: 7, xyz: [0.05, -0.03, 0]}
    rows: [x, y]
    assembled: {q: [Q1, Q2, Q3], elbow1: BENT1, elbow2: BENT2}
  - name: top_arm
    passive: [platform, elbow3]
    from: {row: 0, xyz: [0.25, 0.433, 0]}
    links: [Rz(q3), Tx(a), Rz(elbow3), Tx(b)]
    meets: {row: 7, xyz: [0, 0.06, 0]}
    rows: [x, y]
    assembled: {q: [Q1, Q2, Q3], platform: PLATFORM, elbow3: BENT3}
"""


def planar_text():
    """Return the robot file of the planar machine, closed in its middle."""
    middle = np.array([0.25, 0.144])
    q = planar_joints(middle, 0.0)
    text = PLANAR
    for k in range(3):
        elbow = PLANAR_BASES[k] + PLANAR_RODS[0] * np.array([math.cos(q[k]), math.sin(q[k])])
        rod = linkages.direction(elbow, middle + PLANAR_CORNERS[k])
        text = text.replace(f'Q{k + 1}', str(q[k])).replace(f'BENT{k + 1}', str(rod - q[k]))
        text = text.replace('PLATFORM', str(-rod))
    return text


def planar_joints(middle, angle):
    """Return the joints (3,) of the planar machine, all elbows on the left of their arms."""
    joints = []
    for base, corner in zip(PLANAR_BASES, PLANAR_CORNERS):
        end = middle + plane_rotation(angle) @ corner
        elbow = linkages.meeting_point(base, PLANAR_RODS[0], end, PLANAR_RODS[1], 1)
        joints.append(linkages.direction(base, elbow))
    return PLANAR_MIDDLE + np.remainder(joints - PLANAR_MIDDLE + math.pi, math.tau) - math.pi


def planar_jacobian(middle, angle, q):
    """Return d (x, y, angle) / d q (3, 3)."""
    ways = np.array([plane_rotation(angle) @ corner for corner in PLANAR_CORNERS])
    arms = PLANAR_RODS[0] * np.stack([np.cos(q), np.sin(q)], axis=1)
    rods = middle + ways - PLANAR_BASES - arms
    turning = rods[:, 1] * ways[:, 0] - rods[:, 0] * ways[:, 1]
    pushing = rods[:, 1] * arms[:, 0] - rods[:, 0] * arms[:, 1]
    return np.linalg.solve(np.column_stack([rods, turning]), np.diag(pushing))


def plane_rotation(angle):
    """Return the rotation (2, 2) by an angle."""
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


HEXAPOD_BASES = np.array(
    [[math.cos(a), math.sin(a), 0.0] for a in np.radians((-10, 10, 110, 130, 230, 250))]
)
HEXAPOD_CORNERS = 0.5 * np.array(
    [[math.cos(a), math.sin(a), 0.0] for a in np.radians((-50, 50, 70, 170, 190, 290))]
)
HEXAPOD_WAYS = ('x', 'y', 'z', 'yaw', 'pitch', 'roll')
HEXAPOD_HEIGHT = 1.2


def hexapod_text():
    """Return the robot file of a platform on six legs of driven length: 18 rows together."""
    platform = np.array([0.0, 0.0, HEXAPOD_HEIGHT])
    q = hexapod_lengths(platform, np.eye(3))
    lines = ['robot: hexapod', 'convention: elementary', 'joints:']
    for k in range(1, 7):
        limits = [float(q[k - 1]) + away for away in (-0.2, 0.2)]
        lines.append(f'  - {{name: leg{k}, variable: c{k}, type: prismatic, limits: {limits}}}')
    lines += ['links: [Tx(x), Ty(y), Tz(z), Rz(yaw), Ry(pitch), Rx(roll)]', 'loops:']
    for k, way in enumerate(HEXAPOD_WAYS):
        base, end = HEXAPOD_BASES[k], HEXAPOD_CORNERS[k]
        leg = platform + end - base
        lean = math.asin(-leg[1] / q[k])
        tilt = math.atan2(leg[0], leg[2])
        driven = f'{{name: {way}, type: prismatic}}' if k < 3 else way
        values = [f'tilt{k + 1}: {tilt}', f'lean{k + 1}: {lean}']
        values.append(f'{way}: {platform[k] if k < 3 else 0.0}')
        lines += [
            f'  - name: leg{k + 1}',
            f'    passive: [tilt{k + 1}, lean{k + 1}, {driven}]',
            f'    from: {{row: 0, xyz: {base.tolist()}}}',
            f'    links: [Ry(tilt{k + 1}), Rx(lean{k + 1}), Tz(c{k + 1})]',
            f'    meets: {{row: 6, xyz: {end.tolist()}}}',
            '    rows: [x, y, z]',
            f'    assembled: {{q: {q.tolist()}, {", ".join(values)}}}',
        ]
    return '\n'.join(lines) + '\n'


def hexapod_lengths(position, R):
    """Return the lengths of the legs (6,) from the pose of the platform."""
    return np.linalg.norm(position + HEXAPOD_CORNERS @ R.T - HEXAPOD_BASES, axis=1)


def hexapod_jacobian(position, R):
    """Return the twist of the platform by the lengths of the legs (6, 6)."""
    ways = HEXAPOD_CORNERS @ R.T
    legs = position + ways - HEXAPOD_BASES
    legs /= np.linalg.norm(legs, axis=1)[:, None]
    return np.linalg.inv(np.column_stack([legs, np.cross(ways, legs)]))
