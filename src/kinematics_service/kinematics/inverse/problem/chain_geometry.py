"""Features of the screws of an arm: parallel axes, axes that meet, links in a plane."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ....kernel import Floats
from .screws import Screws

# Axes are parallel, or meet, within this share of the arm's size: the round-off of ten digits in a
# table, and far more than that of a product of matrices.
SAME = 1e-9
# A size that stands for none at all, m.
SMALLEST = 1e-300
# Sums of ratios that are equal but for round-off.
EQUAL = 1e-14


def size_of(screws: Screws) -> float:
    """Return the largest distance between the points of the arm, in m."""
    points = np.vstack([screws.points, screws.tool])
    return max(float(np.max(np.linalg.norm(points - points[0], axis=1))), SMALLEST)


def made_exact(screws: Screws, axes: Floats, points: Floats, coupling: Floats) -> Screws:
    """Return the screws with axes, points and coupling a little changed, which counts as error."""
    turns = np.linalg.norm(np.cross(axes, screws.axes), axis=1)
    ways = np.linalg.norm(np.cross(points - screws.points, screws.axes), axis=1)
    ways[np.array(screws.slides)] = 0.0
    off = screws.off + 2.0 * float(np.sum(turns) + np.sum(ways) / size_of(screws))
    return replace(screws, axes=axes, points=points, coupling=coupling, off=off)


def parallel(a: Floats, b: Floats) -> bool:
    """Return whether two unit vectors are parallel or opposite."""
    return float(np.linalg.norm(np.cross(a, b))) < SAME


def meeting_point(screws: Screws, which: Sequence[int]) -> Floats | None:
    """
    Return the point (3,) in which rotation axes meet at rest, m; None if they do not.

    Neighbours among them must not be parallel: they would share an axis, or miss each other.
    """
    if any(screws.slides[k] for k in which):
        return None
    if any(parallel(screws.axes[i], screws.axes[j]) for i, j in zip(which, which[1:])):
        return None
    # Least squares over the distances across each axis.
    across = [np.eye(3) - np.outer(screws.axes[k], screws.axes[k]) for k in which]
    rows = np.vstack(across)
    right = np.concatenate([P @ screws.points[k] for P, k in zip(across, which)])
    point = np.linalg.lstsq(rows, right, rcond=None)[0]
    miss = float(np.max(np.abs(rows @ point - right)))
    return np.asarray(point) if miss < SAME * size_of(screws) else None


def all_parallel(screws: Screws, which: Sequence[int]) -> bool:
    """Return whether these are rotations about parallel axes."""
    first = screws.axes[which[0]]
    return all(not screws.slides[k] and parallel(first, screws.axes[k]) for k in which)


def with_parallel_axes(screws: Screws) -> tuple[Screws, Floats] | None:
    """
    Return the screws of six turning joints whose axes 2 to 4 are parallel, and not to their
    neighbours, and the point (3,) in which axes 5 and 6 meet, m; None where they are not such.
    """
    point = meeting_point(screws, (4, 5))
    neighbours = any(parallel(screws.axes[1], screws.axes[k]) for k in (0, 4))
    if any(screws.slides) or not all_parallel(screws, (1, 2, 3)) or neighbours or point is None:
        return None
    return in_one_direction(through(screws, (4, 5), point), (1, 2, 3)), point


def through(screws: Screws, which: Sequence[int], point: Floats) -> Screws:
    """Return the screws with some axes through the point in which they meet."""
    points = screws.points.copy()
    points[list(which)] = point
    return made_exact(screws, screws.axes, points, screws.coupling)


def in_one_direction(screws: Screws, which: Sequence[int]) -> Screws:
    """Return the screws with some parallel axes in the direction of the first of them."""
    axes, coupling = screws.axes.copy(), screws.coupling.copy()
    first = axes[which[0]]
    for k in which[1:]:
        coupling[k] = coupling[k] * np.sign(axes[k] @ first)
        axes[k] = first
    return made_exact(screws, axes, screws.points, coupling)


def with_feet(screws: Screws) -> Screws:
    """
    Return the screws with the points of axes 1 and 2 at the feet of their common perpendicular.

    Axes that are parallel, or meet, up to the last digits do so exactly then.
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
    if np.linalg.norm(points[1] - points[0]) < SAME * size_of(screws):
        points[1] = points[0]
    return made_exact(screws, screws.axes, points, screws.coupling)


def reversed_screws(screws: Screws) -> Screws:
    """Return the screws from tool to base: the inverse of a product is that of the inverses."""
    return replace(
        screws,
        axes=screws.axes[::-1].copy(),
        points=screws.points[::-1].copy(),
        slides=screws.slides[::-1],
        coupling=-screws.coupling[::-1],
    )


def with_turn(screws: Screws, axis: Floats, point: Floats) -> Screws:
    """Return the screws with one more, which turns about an axis (3,) and is its own joint."""
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
    Return screws that move the tool's origin alike, its last parallel rotations made two.

    In a plane each link is a vector turned by the sum of the angles before it. Links that turn
    together, as in a parallelogram, are one link; links that do not turn come before the others.
    If more than two remain, the screws are returned unchanged.
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
        if not np.any(np.abs(total) > EQUAL):
            still = still + link
            continue
        for i, turn in enumerate(turns):
            if np.allclose(turn, total, rtol=0.0, atol=EQUAL):
                links[i] = links[i] + link
                break
        else:
            turns.append(total)
            links.append(link)
    if len(turns) != 2:
        return given
    points = [still, still + links[0]]
    coupling = [turns[0], turns[1] - turns[0]]
    home = screws.home.copy()
    home[:3, 3] = still + links[0] + links[1]
    return Screws(
        axes=np.vstack([screws.axes[:start], z, z]),
        points=np.vstack([screws.points[:start], *points]),
        slides=(*screws.slides[:start], False, False),
        coupling=np.vstack([screws.coupling[:start], *coupling]),
        home=home,
        off=screws.off,
    )
