# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Recognise special geometry in the joint screws of an arm: parallel axes, axes that meet, links in a
plane.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ....kernel import Floats
from .screws import Screws

# Tolerance for parallel axes (rad) and for axes that meet (relative to the arm's size). The
# tolerance is 1e-9, because the numbers of DH tables have up to ten significant digits.
GEOMETRY_TOLERANCE = 1e-9
# Size of an arm whose lengths are all 0, m. It is not 0, because distances are divided by the
# size.
MIN_SIZE = 1e-300
# Two links turn together, as in a parallelogram, if their rotations per joint motion differ by at
# most this: 45 machine epsilons.
RATIO_TOLERANCE = 1e-14


def size_of(screws: Screws) -> float:
    """
    Return the size of an arm, m: the largest distance from its first axis to another axis or the
    tool.

    Each axis has one stored point (`screws.points`). The distance between two axes is the distance
    between the two stored points.
    """
    points = np.vstack([screws.points, screws.tool])
    return max(float(np.max(np.linalg.norm(points - points[0], axis=1))), MIN_SIZE)


def made_exact(screws: Screws, axes: Floats, points: Floats, coupling: Floats) -> Screws:
    """
    Return the screws with new axes, new points on the axes, and a new coupling.

    Callers replace nearly parallel axes by exactly parallel axes, or axes that nearly intersect by
    axes that intersect. The error bound `off` of the screws increases by twice the change of axes
    and points.
    """
    turns = np.linalg.norm(np.cross(axes, screws.axes), axis=1)
    shifts = np.linalg.norm(np.cross(points - screws.points, screws.axes), axis=1)
    shifts[np.array(screws.slides)] = 0.0
    off = screws.off + 2.0 * float(np.sum(turns) + np.sum(shifts) / size_of(screws))
    return replace(screws, axes=axes, points=points, coupling=coupling, off=off)


def parallel(a: Floats, b: Floats) -> bool:
    """Return whether the unit vectors a and b are parallel or opposite."""
    return float(np.linalg.norm(np.cross(a, b))) < GEOMETRY_TOLERANCE


def meeting_point(screws: Screws, indices: Sequence[int]) -> Floats | None:
    """
    Return the point (3,), m, at which several rotation axes intersect if all joints are at zero.

    `indices` are those of the axes. Returns None if the axes do not intersect in one point, if a
    screw is a translation, or if neighbouring axes are parallel.
    """
    if any(screws.slides[k] for k in indices):
        return None
    if any(parallel(screws.axes[i], screws.axes[j]) for i, j in zip(indices, indices[1:])):
        return None
    # Compute the point with the least sum of squared distances from the axes.
    across = [np.eye(3) - np.outer(screws.axes[k], screws.axes[k]) for k in indices]
    rows = np.vstack(across)
    right = np.concatenate([P @ screws.points[k] for P, k in zip(across, indices)])
    point = np.linalg.lstsq(rows, right, rcond=None)[0]
    miss = float(np.max(np.abs(rows @ point - right)))
    return np.asarray(point) if miss < GEOMETRY_TOLERANCE * size_of(screws) else None


def all_parallel(screws: Screws, indices: Sequence[int]) -> bool:
    """Return whether the screws with the given `indices` are all rotations about parallel axes."""
    first = screws.axes[indices[0]]
    return all(not screws.slides[k] and parallel(first, screws.axes[k]) for k in indices)


def with_parallel_axes(screws: Screws) -> tuple[Screws, Floats] | None:
    """
    Return six screws whose axes 2 to 4 are made exactly parallel, and the point (3,) at which axes
    5 and 6 meet, m.

    Returns None if axis 1 or 5 is parallel to axes 2 to 4, a joint is prismatic, or axes 5 and 6
    do not meet.
    """
    point = meeting_point(screws, (4, 5))
    neighbours = any(parallel(screws.axes[1], screws.axes[k]) for k in (0, 4))
    if any(screws.slides) or not all_parallel(screws, (1, 2, 3)) or neighbours or point is None:
        return None
    return in_one_direction(through(screws, (4, 5), point), (1, 2, 3)), point


def through(screws: Screws, indices: Sequence[int], point: Floats) -> Screws:
    """
    Return the screws with some axes shifted, so that these axes pass exactly through `point` (3,).

    `indices` are those of the shifted axes.
    """
    points = screws.points.copy()
    points[list(indices)] = point
    return made_exact(screws, screws.axes, points, screws.coupling)


def in_one_direction(screws: Screws, indices: Sequence[int]) -> Screws:
    """
    Return the screws, with several nearly parallel axes made exactly parallel.

    `indices` are the indices of these axes. Each axis gets the direction of the first one. If an
    axis pointed in the opposite direction, its row of `coupling` is negated, because the angle
    about the reversed axis has the opposite sign.
    """
    axes, coupling = screws.axes.copy(), screws.coupling.copy()
    first = axes[indices[0]]
    for k in indices[1:]:
        coupling[k] = coupling[k] * np.sign(axes[k] @ first)
        axes[k] = first
    return made_exact(screws, axes, screws.points, coupling)


def with_feet(screws: Screws) -> Screws:
    """
    Return the screws, with the stored points of axes 1 and 2 moved along the axes to their common
    perpendicular.

    If axes 1 and 2 are parallel within the tolerance, they are made exactly parallel. If they
    intersect within the tolerance, they are made to intersect exactly.
    """
    if parallel(*screws.axes[:2]):
        screws = in_one_direction(screws, (0, 1))
        z = screws.axes[0]
        points = screws.points.copy()
        points[1] = points[1] - z * ((points[1] - points[0]) @ z)
    else:
        z1, z2 = screws.axes[:2]
        normal = np.cross(z1, z2)
        normal = normal / (normal @ normal)
        points = screws.points.copy()
        between = points[1] - points[0]
        points[0] = points[0] + (np.cross(between, z2) @ normal) * z1
        points[1] = points[1] + (np.cross(between, z1) @ normal) * z2
    if np.linalg.norm(points[1] - points[0]) < GEOMETRY_TOLERANCE * size_of(screws):
        points[1] = points[0]
    return made_exact(screws, screws.axes, points, screws.coupling)


def reversed_screws(screws: Screws) -> Screws:
    """
    Return the screws in the order from tool to base, with negative angles and displacements.

    The product A B C of the screw motions becomes its inverse C^-1 B^-1 A^-1.
    """
    return replace(
        screws,
        axes=screws.axes[::-1].copy(),
        points=screws.points[::-1].copy(),
        slides=screws.slides[::-1],
        coupling=-screws.coupling[::-1],
    )


def with_turn(screws: Screws, axis: Floats, point: Floats) -> Screws:
    """
    Return the screws with one more rotation at the end, about `axis` (3,) through `point` (3,).
    """
    n = len(screws.axes)
    coupling = np.eye(n + 1)
    coupling[:n, :n] = screws.coupling
    return replace(
        screws,
        axes=np.vstack([screws.axes, axis]),
        points=np.vstack([screws.points, point]),
        slides=(*screws.slides, False),
        coupling=coupling,
    )


def with_links_merged(screws: Screws) -> Screws:
    """
    Return the screws with the parallel rotations at the end of the arm merged to two rotations.

    The motion of the tool's origin does not change.

    Let the parallel rotations have the axes 1 to m. Link j is the vector from axis j to axis j +
    1. Link m is the vector from axis m to the tool. Link j turns by the sum of the rotation angles
    1 to j. If this sum is always equal for two links, as in a parallelogram, the two vectors are
    added to one link. If the sum is always 0, the link never turns, and its vector is added to the
    point of axis 1. If the number of turning links is then not 2, the screws are returned
    unchanged.
    """
    k = len(screws.axes)
    start = k
    while start > 0 and all_parallel(screws, range(start - 1, k)):
        start -= 1
    if k - start < 2:
        return screws
    given, screws = screws, in_one_direction(screws, range(start, k))
    z = screws.axes[start]
    turns: list[Floats] = []
    links: list[Floats] = []
    total = np.zeros(screws.coupling.shape[1])
    ends = [*screws.points[start + 1 :], screws.tool]
    still = screws.points[start]
    for j in range(start, k):
        total = total + screws.coupling[j]
        link = ends[j - start] - screws.points[j]
        if not np.any(np.abs(total) > RATIO_TOLERANCE):
            still = still + link
            continue
        alike = [np.allclose(turn, total, rtol=0.0, atol=RATIO_TOLERANCE) for turn in turns]
        if any(alike):
            links[alike.index(True)] = links[alike.index(True)] + link
        else:
            turns.append(total)
            links.append(link)
    if len(turns) != 2:
        return given
    home = screws.home.copy()
    home[:3, 3] = still + links[0] + links[1]
    return replace(
        screws,
        axes=np.vstack([screws.axes[:start], z, z]),
        points=np.vstack([screws.points[:start], still, still + links[0]]),
        slides=(*screws.slides[:start], False, False),
        coupling=np.vstack([screws.coupling[:start], turns[0], turns[1] - turns[0]]),
        home=home,
    )
