"""Six joints of which three slide, in closed form: the others turn the tool, these carry it."""

import math

import numpy as np

from ...kernel import Floats
from ...rigid_motion import inverse, turn_about
from .problem import IkProblem
from .screws import Screws
from .search import DistinctSolutions, distinct, refined

# Axes are parallel, and directions dependent, to this share: then a joint may have any position.
FREE = 1e-9
# A cosine beyond 1 by less is the border of what the turning joints reach.
BORDER = 1e-9


def three_slides_solutions(problem: IkProblem, screws: Screws) -> DistinctSolutions | None:
    """
    Return all solutions of an arm of three turning and three sliding joints.

    None where a joint may have any position, or nearly: then there are no isolated ones.
    """
    target, plan = problem.target, problem.plan
    T = target.pose @ inverse(screws.home)
    angles = _angles(screws, T[:3, :3])
    if angles is None:
        return None
    candidates: list[Floats] = []
    for three in angles:
        psi = np.zeros(6)
        psi[~np.array(screws.slides)] = three
        ways = _ways(screws, psi, T[:3, 3])
        if ways is None:
            return None
        psi[np.array(screws.slides)] = ways
        candidates.append(np.asarray(np.linalg.solve(screws.coupling, psi)))
    q = np.array(candidates).reshape(-1, 6)
    found, _ = distinct(target, plan, refined(target, plan, q))
    return found


def _angles(screws: Screws, R: Floats) -> list[tuple[float, float, float]] | None:
    # R = Ra Rb Rc: za . Rb zc = za . R zc gives b, what is left a, and then c.
    a, b, c = screws.axes[~np.array(screws.slides)]
    still = (a @ b) * (b @ c)
    cosine, sine = a @ c - still, a @ np.cross(b, c)
    radius = math.hypot(cosine, sine)
    if radius < FREE:
        return None
    share = float(a @ R @ c - still) / radius
    if abs(share) > 1.0 + BORDER:
        return []
    middle, half = math.atan2(sine, cosine), math.acos(min(max(share, -1.0), 1.0))
    side = np.cross(c, np.eye(3)[int(np.argmin(np.abs(c)))])
    angles = []
    for second in (middle + half, middle - half):
        first = _angle(a, turn_about(b, second) @ c, R @ c)
        if first is None:
            return None
        before = turn_about(a, first) @ turn_about(b, second)
        third = _angle(c, side, before.T @ R @ side)
        angles.append((first, second, third or 0.0))
    return angles


def _angle(axis: Floats, u: Floats, v: Floats) -> float | None:
    # By how much to turn u about the axis until it points where v does; None: any angle does.
    u, v = u - (axis @ u) * axis, v - (axis @ v) * axis
    if np.linalg.norm(u) < FREE:
        return None
    return math.atan2(float(axis @ np.cross(u, v)), float(u @ v))


def _ways(screws: Screws, psi: Floats, goal: Floats) -> Floats | None:
    # With the angles known the position is linear in the ways.
    R, p, directions = np.eye(3), np.zeros(3), []
    for axis, point, slides, value in zip(screws.axes, screws.points, screws.slides, psi):
        if slides:
            directions.append(R @ axis)
            continue
        turn = turn_about(axis, value)
        p = p + R @ (point - turn @ point)
        R = R @ turn
    M = np.array(directions).T
    if np.linalg.svd(M, compute_uv=False)[-1] < FREE:
        return None
    return np.asarray(np.linalg.solve(M, goal - p))
